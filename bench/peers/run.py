#!/usr/bin/env python3
"""Ikiru and its peers, side by side: makes their environments, runs them in turn on one core, judges, writes a table.

`python3 bench/peers/run.py [--ikiru PATH] [--n N] [--only NAME] [--out FILE.md]`; see README.md beside this file.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from environments import ENVIRONMENTS, ROOT, Unavailable, environment

ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "RAYON_NUM_THREADS": "1",
    "NPROC": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
    "JAX_PLATFORMS": "cpu",
}


def arguments() -> argparse.Namespace:
    """What was typed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ikiru", type=Path, default=ROOT / "target" / "release" / "ikiru",
                        help="the command to compare with (default: target/release/ikiru)")
    parser.add_argument("--n", type=int, default=1000, help="targets a task, warm-up not counted (default 1000)")
    parser.add_argument("--only", action="append", metavar="NAME",
                        help="jax-ik, optik-py, pin-pink or mink; may be given several times (default: all)")
    parser.add_argument("--seed", type=int, default=1, help="of the Panda's targets (default 1)")
    parser.add_argument("--out", type=Path, help="Markdown file (default: standard output)")
    given = parser.parse_args()
    if given.n < 1:
        parser.error("--n must be at least 1")
    return given


def main() -> None:
    """Pins the process to one core, moves into the judge's environment (it has numpy) and starts."""
    given = arguments()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    os.environ.update(ONE_THREAD)
    try:
        python = environment("judge")
    except Unavailable as reason:
        sys.exit(f"the judge's environment: {reason}")
    if Path(sys.prefix).resolve() != (ENVIRONMENTS / "judge").resolve():
        os.execv(python, [str(python), str(Path(__file__).resolve()), *sys.argv[1:]])
    from compare import compare

    table = compare(given)
    if given.out is None:
        print(table)
    else:
        given.out.write_text(table + "\n")


if __name__ == "__main__":
    main()
