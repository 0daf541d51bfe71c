"""What a peer's script and `run.py` say to each other: a job file in, a file of rows out. Standard library only.

A peer's script offers `systems(job)`, which gives one or more `System`s, and ends with `main(systems)`. The clock
runs around `System.solve` alone: one target in, joint values out. What comes back is judged elsewhere (`judge.py`).
"""

from __future__ import annotations

import json
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

Values = Sequence[float]


@dataclass
class Job:
    """One task for one peer. Angles in radians, lengths in metres."""

    task: str
    """`simple`, `combined` or `panda`."""
    rig: str
    """Path of the .glb or .urdf file."""
    targets: list[Any]
    """Points `[x, y, z]`, or for the Panda poses: 4 rows of 4 numbers, tip in the world of the file."""
    warmup: list[Any]
    """Targets that are solved before the clock counts, at least one."""
    joints: list[str]
    """Names of the joints that move, in the order of the values that are wanted."""
    lower: list[float]
    """Lowest value of each joint (three for each joint of the human: x, y, z)."""
    upper: list[float]
    """Highest value of each joint."""
    base: str = ""
    """First link of the chain (Panda)."""
    tip: str = ""
    """Last link of the chain (Panda), or the joint that reaches (human)."""

    def middle(self) -> list[float]:
        """The middle of the joint ranges: where the Panda starts."""
        return [(low + high) / 2 for low, high in zip(self.lower, self.upper)]


@dataclass
class System:
    """One way of using a peer: one line of the table."""

    name: str
    settings: str
    """Every setting that is not the peer's default, for the notes."""
    solve: Callable[[Any], tuple[Values, bool]]
    """Target → values, and whether the peer believes that it arrived."""


@dataclass
class Row:
    """One solved target."""

    values: list[float]
    time_us: float
    claimed: bool


@dataclass
class SystemRows:
    """All targets of one system."""

    name: str
    settings: str
    first_call_secs: float
    """The very first call, compilation included; not part of the times."""
    rows: list[Row] = field(default_factory=list)


@dataclass
class PeerResult:
    """What a peer's script writes: versions and rows, or the reason why there are none."""

    version: str = ""
    systems: list[SystemRows] = field(default_factory=list)
    error: str = ""


def read_job(path: Path) -> Job:
    """Reads a job file."""
    return Job(**json.loads(path.read_text()))


def write_job(job: Job, path: Path) -> None:
    """Writes a job file."""
    path.write_text(json.dumps(asdict(job)))


def read_result(path: Path) -> PeerResult:
    """Reads what a peer's script wrote."""
    raw = json.loads(path.read_text())
    systems = [
        SystemRows(**{**system, "rows": [Row(**row) for row in system["rows"]]}) for system in raw["systems"]
    ]
    return PeerResult(version=raw["version"], systems=systems, error=raw["error"])


def time_system(system: System, job: Job) -> SystemRows:
    """Warms up, then solves every target once with the clock around the call."""
    began = time.perf_counter()
    system.solve(job.warmup[0])
    result = SystemRows(system.name, system.settings, time.perf_counter() - began)
    for target in job.warmup:
        system.solve(target)
    for target in job.targets:
        began = time.perf_counter()
        values, claimed = system.solve(target)
        time_us = (time.perf_counter() - began) * 1e6
        result.rows.append(Row([float(value) for value in values], time_us, bool(claimed)))
    return result


def main(package: str, systems: Callable[[Job], list[System]]) -> None:
    """Entry point of a peer's script: `peer_x.py JOB.json RESULT.json`."""
    if len(sys.argv) != 3:
        sys.exit(f"usage: {sys.argv[0]} JOB.json RESULT.json (run.py calls this)")
    job = read_job(Path(sys.argv[1]))
    result = PeerResult()
    try:
        result.version = version(package)
        for system in systems(job):
            result.systems.append(time_system(system, job))
    except Exception as error:  # noqa: BLE001 — whatever a peer throws becomes its line in the table
        traceback.print_exc()
        result.error = f"{type(error).__name__}: {error}"
    Path(sys.argv[2]).write_text(json.dumps(asdict(result)))
