"""Runs Ikiru and its peers in turn, has every answer judged, and lays out the table. Imported by `run.py`."""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from environments import ENVIRONMENTS, HERE, ROOT, Unavailable, environment, last_line
from judge import HUMAN_TIP, Arm, Human, Verdict, pose_matrix
from protocol import Job, Row, SystemRows, read_result, write_job

N_WARMUP = 10
MAX_SECS = 4 * 3600
WORK = ENVIRONMENTS / "work"
HUMAN_RIG = ROOT / "crates" / "ikiru-formats" / "assets" / "reference_human.glb"
HUMAN_TARGETS = {"simple": "reachable.json", "combined": "combined_box.json"}
PANDA_FOLDERS = [ROOT / "crates" / "ikiru-formats" / folder / "robots" for folder in ("data", "assets", "tests/data")]
PANDA_CHAIN = ("panda_link0", "panda_link8")
PEERS = {
    "jax-ik": ("peer_jax_ik.py", ["simple", "combined"]),
    "optik-py": ("peer_optik.py", ["panda"]),
    "pin-pink": ("peer_pink.py", ["panda"]),
    "mink": ("peer_mink.py", ["panda"]),
}
"""Package → script, and the tasks that it takes part in."""


@dataclass
class Task:
    """What is solved: judged by `human` or by `arm`."""

    name: str
    description: str
    rig: Path
    warmup: list[Any]
    targets: list[Any]
    human: Human | None = None
    arm: Arm | None = None

    def judge(self, values: list[float], target: Any) -> Verdict:
        """The judge's word on one answer."""
        if self.human is not None:
            return self.human.judge(values, target, self.name == "combined")
        return self.arm.judge(values, np.array(target))

    def job(self) -> Job:
        """The same task for a peer."""
        chain = self.human or self.arm
        base, tip = ("", HUMAN_TIP) if self.arm is None else (self.arm.base, self.arm.tip)
        return Job(self.name, str(self.rig), self.targets, self.warmup, chain.joints, list(chain.lower),
                   list(chain.upper), base, tip)


@dataclass
class Line:
    """One line of the table, and its notes."""

    task: str
    system: str
    version: str
    n_targets: int = 0
    success: float = 0.0
    times_us: np.ndarray = field(default_factory=lambda: np.array([]))
    ratio: float | None = None
    missing: str = ""
    notes: list[str] = field(default_factory=list)


class Ikiru:
    """The command under `--ikiru`."""

    def __init__(self, path: Path) -> None:
        found = shutil.which(path)
        if found is None:
            raise Unavailable(f"no command at {path}: `cargo build --release -p ikiru-cli --features bench`, or --ikiru PATH")
        self.command = found
        self.version = self.call("--version").strip().removeprefix("ikiru ")

    def call(self, *words: str | Path) -> str:
        """Runs the command; its standard output, or the reason why there is none."""
        done = subprocess.run([self.command, *map(str, words)], capture_output=True, text=True, timeout=MAX_SECS)
        if done.returncode not in (0, 1):  # 1: some targets were missed
            raise Unavailable(f"`ikiru {words[0]}` ended with {done.returncode}: {last_line(done.stderr)}")
        return done.stdout

    def rows(self, *words: str | Path) -> list[dict[str, Any]]:
        """Runs a benchmark and reads its JSON rows."""
        path = WORK / "ikiru.json"
        path.unlink(missing_ok=True)
        self.call("bench", *words, "--json", path)
        try:
            rows = json.loads(path.read_text())
        except (OSError, ValueError) as error:
            raise Unavailable(f"`ikiru bench {words[0]}` left no readable JSON: {error}") from error
        if not rows:
            raise Unavailable(f"`ikiru bench {words[0]}` left no rows")
        return rows

    def human(self, task: Task) -> dict[str, list[Row]]:
        """The paper's task, by method; every row's target must be the one that was asked for."""
        targets = WORK / "targets.json"
        targets.write_text(json.dumps(task.warmup + task.targets))
        by_method: dict[str, list[Row]] = defaultdict(list)
        for row in self.rows("paper", "--objective", task.name, "--targets", targets, "--methods", "lm,lm-local",
                             "--runs", "1", "--warmup", str(N_WARMUP)):
            asked = task.targets[len(by_method[row["method"]])]
            if not np.allclose(row["target"], asked, atol=1e-12):
                raise Unavailable(f"`ikiru bench paper` solved {row['target']} where {asked} was asked for")
            by_method[row["method"]].append(Row(row["angles"], row["time_us"], row["success"]))
        return self.whole(task, by_method)

    def panda(self, task: Task, seed: int) -> dict[str, list[Row]]:
        """The Panda's task; every row's target must be the task's."""
        rows = self.panda_rows(len(task.targets), seed)
        solved = [pose_matrix(row["target"]["position"], row["target"]["rotation"]) for row in rows]
        if len(solved) != len(task.targets) or not np.allclose(solved, task.targets, atol=1e-12):
            raise Unavailable("`ikiru bench robots` made other targets from the same seed")
        orders = [[row["joints"].index(joint) for joint in task.arm.joints] for row in rows]
        return {"lm": [Row([row["values"][idx] for idx in order], row["time_us"], row["success"])
                       for row, order in zip(rows, orders)]}

    def panda_rows(self, n_targets: int, seed: int) -> list[dict[str, Any]]:
        """The robots benchmark's own rows; its targets are those that the peers get too."""
        rows = self.rows("robots", "--robots", "panda", "--n", str(n_targets), "--seed", str(seed))
        rows = [row for row in rows if row["robot"] == "panda"]
        if not rows:
            raise Unavailable("`ikiru bench robots` left no rows for the panda")
        return rows

    @staticmethod
    def whole(task: Task, by_method: dict[str, list[Row]]) -> dict[str, list[Row]]:
        """Every method must have answered every target."""
        for method, rows in by_method.items():
            if len(rows) != len(task.targets):
                raise Unavailable(f"`ikiru bench` gave {len(rows)} rows for {method}, not {len(task.targets)}")
        return by_method


def human_task(name: str, n_targets: int) -> Task:
    """The paper's task, simple or combined, on the project's own target points."""
    file = HUMAN_TARGETS[name]
    points = json.loads((ROOT / "crates" / "ikiru-eval" / "targets" / file).read_text())[: N_WARMUP + n_targets]
    task = Task(name, "", HUMAN_RIG, points[:N_WARMUP], points[N_WARMUP:], human=Human(HUMAN_RIG))
    objective = "fingertip to a point" if name == "simple" else "fingertip to a point, and three look-at terms"
    task.description = f"{objective}; {len(task.targets)} points of `{file}`, from the rest pose, cost below 0.005"
    return task


def panda_task(ikiru: Ikiru | None, n_targets: int, seed: int) -> Task:
    """Random reachable poses: Ikiru's own from its seed, or the judge's where Ikiru is not there."""
    path = next((folder / "panda.urdf" for folder in PANDA_FOLDERS if (folder / "panda.urdf").exists()), None)
    if path is None:
        raise Unavailable("panda.urdf is not in crates/ikiru-formats")
    rows = [] if ikiru is None else ikiru.panda_rows(n_targets, seed)
    arm = Arm(path, rows[0].get("base") or PANDA_CHAIN[0], rows[0]["tip"]) if rows else Arm(path, *PANDA_CHAIN)
    if rows and sorted(rows[0]["joints"]) != sorted(arm.joints):
        raise Unavailable(f"`ikiru bench robots` moves {rows[0]['joints']}, the file's chain is {arm.joints}")
    if rows:
        poses = [pose_matrix(row["target"]["position"], row["target"]["rotation"]) for row in rows]
    else:
        poses = arm.sample(n_targets, seed)
    maker = "Ikiru's" if rows else "the judge's, since Ikiru's command is missing"
    task = Task("panda", "", path, [pose.tolist() for pose in arm.sample(N_WARMUP, seed + 1)],
                [pose.tolist() for pose in poses], arm=arm)
    task.description = (f"pose of `{arm.tip}`; {len(poses)} random reachable poses ({maker}, seed {seed}), from the "
                        "middle of the ranges, within 1e-5 m and 1e-5 rad")
    return task


def run_ikiru(ikiru: Ikiru, task: Task, seed: int) -> dict[str, list[Row]]:
    """Ikiru's rows by method, once."""
    print(f"{task.name}: Ikiru", file=sys.stderr)
    try:
        return ikiru.panda(task, seed) if task.arm is not None else ikiru.human(task)
    except (KeyError, IndexError, TypeError, ValueError, subprocess.TimeoutExpired) as error:
        raise Unavailable(f"`ikiru bench`: {type(error).__name__}: {error}") from error


def run_peer(package: str, task: Task) -> tuple[str, list[SystemRows]]:
    """A peer's version and its rows, once."""
    python = environment(package)
    print(f"{task.name}: {package}", file=sys.stderr)
    script = HERE / PEERS[package][0]
    scratch = WORK / package
    shutil.rmtree(scratch, ignore_errors=True)  # a compilation cache would hide what the first call costs
    scratch.mkdir(parents=True)
    write_job(task.job(), scratch / "job.json")
    try:
        with (scratch / "log.txt").open("w") as log:
            done = subprocess.run([str(python), str(script), "job.json", "result.json"], cwd=scratch, stdout=log,
                                  stderr=subprocess.STDOUT, timeout=MAX_SECS)
    except subprocess.TimeoutExpired as error:
        raise Unavailable(f"not done after {MAX_SECS} s") from error
    if not (scratch / "result.json").exists():
        reason = last_line((scratch / "log.txt").read_text())
        raise Unavailable(f"ended with {done.returncode}: {reason}")
    result = read_result(scratch / "result.json")
    if result.error:
        raise Unavailable(result.error)
    return result.version, result.systems


def line_of(task: Task, system: str, version: str, rows: list[Row]) -> Line:
    """Judges all rows; notes where a system's own word differs from the judge's."""
    targets = task.targets * (len(rows) // len(task.targets))  # Ikiru: several runs, one after the other
    verdicts = [task.judge(row.values, target) for row, target in zip(rows, targets, strict=True)]
    line = Line(task.name, system, version, len(rows), 100 * float(np.mean([v.success for v in verdicts])),
                np.array([row.time_us for row in rows]))
    wrong = sum(row.claimed and not verdict.success for row, verdict in zip(rows, verdicts))
    modest = sum(verdict.success and not row.claimed for row, verdict in zip(rows, verdicts))
    outside = sum(verdict.limit_excess > 1e-6 for verdict in verdicts)
    for count, what in [(wrong, "called solved by the system, not by the judge"),
                        (modest, "called solved by the judge, not by the system"),
                        (outside, "with a joint beyond its limit")]:
        if count:
            line.notes.append(f"{count} of {len(rows)} {what}")
    return line


def compare_task(ikiru: Ikiru | None, missing: str, task: Task, packages: list[str], seed: int) -> list[Line]:
    """All lines of one task: Ikiru runs right before and right after every peer."""
    all_runs: dict[str, list[Row]] = defaultdict(list)
    peer_lines: list[Line] = []

    def run_ours() -> float:
        nonlocal ikiru, missing
        if ikiru is None:
            return float("nan")
        try:
            runs = run_ikiru(ikiru, task, seed)
        except Unavailable as reason:
            ikiru, missing = None, str(reason)
            return float("nan")
        for method, rows in runs.items():
            all_runs[method] += rows
        return float(np.mean([row.time_us for row in runs["lm"]])) if "lm" in runs else float("nan")

    for package in packages:
        before = run_ours()
        try:
            version, systems = run_peer(package, task)
        except Unavailable as reason:
            peer_lines.append(Line(task.name, package, "–", missing=str(reason)))
            continue
        ours = (before + run_ours()) / 2
        for system in systems:
            line = line_of(task, system.name, version, system.rows)
            line.ratio = float(np.mean(line.times_us)) / ours
            line.notes.insert(0, f"{system.settings}; the first call took {system.first_call_secs:.2g} s")
            peer_lines.append(line)

    our_lines = []
    for method, rows in all_runs.items():
        line = line_of(task, f"**Ikiru** `{method}`", ikiru.version if ikiru else "–", rows)
        if "lm" in all_runs:
            line.ratio = float(np.mean(line.times_us) / np.mean([row.time_us for row in all_runs["lm"]]))
        line.notes.insert(0, f"{len(rows) // len(task.targets)} runs, one before and one after each peer")
        our_lines.append(line)
    if missing:
        our_lines.insert(0, Line(task.name, "**Ikiru**", "–", missing=missing))
    return our_lines + peer_lines


def compare(given: argparse.Namespace) -> str:
    """Everything; the Markdown text."""
    WORK.mkdir(parents=True, exist_ok=True)
    packages = given.only or list(PEERS)
    unknown = [name for name in packages if name not in PEERS]
    if unknown:
        sys.exit(f"--only {unknown[0]}: no such peer; there are {', '.join(PEERS)}")
    ikiru, missing = None, ""
    try:
        ikiru = Ikiru(given.ikiru)
    except Unavailable as reason:
        missing = str(reason)
    lines: list[Line] = []
    descriptions: list[str] = []
    for name in ("simple", "combined", "panda"):
        ours = [package for package in packages if name in PEERS[package][1]]
        if not ours:
            continue
        robots_missing = ""
        try:
            if name != "panda":
                task = human_task(name, given.n)
            else:
                try:
                    task = panda_task(ikiru, given.n, given.seed)
                except Unavailable as reason:
                    robots_missing = str(reason)
                    task = panda_task(None, given.n, given.seed)
        except (Unavailable, OSError, ValueError, KeyError) as reason:
            lines.append(Line(name, "all", "–", missing=str(reason)))
            continue
        descriptions.append(f"- **{name}**: {task.description}.")
        usable = None if robots_missing else ikiru
        lines += compare_task(usable, missing or robots_missing, task, ours, given.seed)
    return markdown(lines, descriptions)


def markdown(lines: list[Line], descriptions: list[str]) -> str:
    """The table with what belongs under it."""
    text = [
        "# Ikiru and its peers",
        "",
        f"`{' '.join(['python3 bench/peers/run.py', *sys.argv[1:]])}`",
        "",
        f"Machine: {cpu()}, {os.cpu_count()} cores, of which this used one; {platform.system()} {platform.machine()}, "
        f"Python {platform.python_version()}.",
        "",
        *descriptions,
        "",
        "| task | system | version | success % | mean | median | p99 | ratio to Ikiru |",
        "|---|---|---|---|---|---|---|---|",
    ]
    notes = []
    for line in lines:
        if line.missing:
            text.append(f"| {line.task} | {line.system} | {line.version} | not run: {cell(line.missing)} | | | | |")
            continue
        times = [duration(value) for value in (line.times_us.mean(), *np.percentile(line.times_us, [50, 99]))]
        ratio = "–" if line.ratio is None or not np.isfinite(line.ratio) else times_as(line.ratio)
        cells = [line.task, line.system, line.version, f"{line.success:.2f}", *times, ratio]
        text.append(f"| {' | '.join(cells)} |")
        notes.append(f"- {line.task}, {line.system}: {'; '.join(line.notes)}.")
    footer = ("Times are of the solve call alone, failures included; the ratio is of means, against Ikiru's `lm` runs "
              "right before and after the peer. Success is the judge's, from the joint values.")
    text += ["", footer, "", *notes]
    return "\n".join(text)


def duration(time_us: float) -> str:
    """Three digits with the unit that fits."""
    if time_us < 999.5:
        return f"{time_us:.3g} µs"
    return f"{time_us / 1000:.3g} ms" if time_us < 999_500 else f"{time_us / 1e6:.3g} s"


def times_as(ratio: float) -> str:
    """Three digits, never with an exponent."""
    return f"{ratio:,.0f}" if ratio >= 100 else f"{ratio:.3g}"


def cell(text: str) -> str:
    """Text that does not break a table."""
    return " ".join(text.replace("|", "\\|").split())[:300]


def cpu() -> str:
    """The processor's name."""
    try:
        for row in Path("/proc/cpuinfo").read_text().splitlines():
            if row.startswith("model name"):
                return row.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or "unknown processor"
