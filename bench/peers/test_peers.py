"""Tests of the judge and of the run, without any peer: `python3 bench/peers/test_peers.py`.

The judge is held against transforms that Pinocchio made, and against poses worked out by hand; the run against a
made-up `ikiru` that answers as the command's contract says.
"""

from __future__ import annotations

import json
import math
import os
import sys
import tempfile
import unittest
from pathlib import Path

from environments import ENVIRONMENTS, environment

if __name__ == "__main__" and Path(sys.prefix).resolve() != (ENVIRONMENTS / "judge").resolve():
    python = environment("judge")
    os.execv(python, [str(python), __file__, *sys.argv[1:]])

import argparse

import numpy as np

import compare
from judge import Arm, Human, angle_of, pose_matrix, rotation_about

FK = compare.ROOT / "crates" / "ikiru-formats" / "tests" / "data" / "robots" / "fk" / "panda.json"
PANDA = next(folder / "panda.urdf" for folder in compare.PANDA_FOLDERS if (folder / "panda.urdf").exists())
FAKE_IKIRU = '''#!{python}
"""Answers as `ikiru bench` does: rest poses for the human, the right answers for the Panda."""
import json, sys
sys.path.insert(0, {here!r})
import numpy as np
from judge import Arm
words = sys.argv[1:]
if words == ["--version"]:
    print("ikiru 9.9.9")
    sys.exit()
option = lambda name: words[words.index("--" + name) + 1]
rows = []
if words[1] == "paper":
    targets = json.load(open(option("targets")))[int(option("warmup")):]
    for method in option("methods").split(","):
        for target in targets:
            rows.append(dict(method=method, objective=option("objective"), points=0, run=0, target=target, success=True,
                             cost=0.0, iterations=1, time_us=10.0, angles=[0.0] * 12))
else:
    arm = Arm({panda!r}, "panda_link0", "panda_link8")
    random = np.random.default_rng(int(option("seed")))
    for _ in range(int(option("n"))):
        values = random.uniform(arm.lower, arm.upper)
        pose = arm.pose(values)
        w = np.sqrt(max(1 + np.trace(pose[:3, :3]), 0)) / 2
        r = pose[:3, :3]
        quaternion = [(r[2, 1] - r[1, 2]) / (4 * w), (r[0, 2] - r[2, 0]) / (4 * w), (r[1, 0] - r[0, 1]) / (4 * w), w]
        rows.append(dict(robot="panda", base=arm.base, tip=arm.tip, joints=arm.joints[::-1], success=True,
                         target=dict(position=pose[:3, 3].tolist(), rotation=quaternion), position_error=0,
                         rotation_error=0, iterations=1, restarts=0, time_us=20.0, values=values[::-1].tolist()))
json.dump(rows, open(option("json"), "w"))
'''


class JudgeTest(unittest.TestCase):
    def test_panda_frames_are_those_of_pinocchio(self) -> None:
        recorded = json.loads(FK.read_text())
        arm = Arm(PANDA, "panda_link0", "panda_link8")
        link_idx = recorded["links"].index("panda_link8")
        for configuration in recorded["configurations"]:
            expected = configuration["frames"][link_idx]
            verdict = arm.judge(
                [configuration["joints"][name][0] for name in arm.joints], pose_matrix(expected[:3], expected[3:])
            )
            self.assertLess(verdict.position_error, 1e-10)
            self.assertLess(verdict.rotation_error, 1e-9)

    def test_a_target_just_off_or_a_limit_just_broken_is_a_failure(self) -> None:
        arm = Arm(PANDA, "panda_link0", "panda_link8")
        values = (arm.lower + arm.upper) / 2
        pose = arm.pose(values)
        off = pose.copy()
        off[0, 3] += 1.1e-5
        self.assertTrue(arm.judge(values, pose).success)
        self.assertFalse(arm.judge(values, off).success)
        self.assertFalse(arm.judge(values, pose @ rotation_about((0, 1, 0), 1.1e-5)).success)
        values[0] = arm.upper[0] + 2e-6
        self.assertFalse(arm.judge(values, arm.pose(values)).success)
        self.assertFalse(arm.judge(values[:-1], pose).success)
        self.assertFalse(arm.judge([math.nan] * 7, pose).success)

    def test_human_at_rest(self) -> None:
        human = Human(compare.HUMAN_RIG)
        translations = [rest[:3, 3] for _, rest in human.chain]
        tip = np.sum(translations, axis=0)  # rest rotations are the identity up to the tip
        self.assertTrue(human.judge([0.0] * 12, tip, combined=False).success)
        self.assertFalse(human.judge([0.0] * 12, tip + [0, 0.0051, 0], combined=False).success)
        # At rest +Y of wrist and shoulder points up, that of the finger along +X (its rest turns −90° about Z).
        wrist, finger = 0.0, math.atan2(1.0, 0.1)
        shoulder = math.atan2(1.0, 0.261)
        expected = 0.1 / 3 * (wrist**2 + finger**2) + 0.0002 / 3 * shoulder**2
        self.assertAlmostEqual(human.cost([0.0] * 12, tip, combined=True), expected, places=12)

    def test_human_turns_by_z_then_y_then_x(self) -> None:
        human = Human(compare.HUMAN_RIG)
        angles = [0.0] * 12
        angles[3:6] = [0.3, -0.4, 0.2]
        rest, turned = human.frames([0.0] * 12), human.frames(angles)
        about_z, about_y, about_x = (rotation_about(axis, angle)[:3, :3] for axis, angle in
                                     [((0, 0, 1), 0.2), ((0, 1, 0), -0.4), ((1, 0, 0), 0.3)])
        rotation = about_z @ about_y @ about_x
        origin = rest["left_shoulder"][:3, 3]
        expected = origin + rotation @ (rest["left_wrist"][:3, 3] - origin)
        np.testing.assert_allclose(turned["left_wrist"][:3, 3], expected, atol=1e-12)
        self.assertTrue(human.judge(angles, [0, 0, 0], combined=False).limit_excess < 0)
        angles[3] = -2e-6
        self.assertAlmostEqual(human.judge(angles, [0, 0, 0], combined=False).limit_excess, 2e-6)

    def test_small_angles_are_exact(self) -> None:
        for angle in [0.0, 1e-12, 1e-7, 1.0, 3.0]:
            self.assertAlmostEqual(angle_of(rotation_about((1, 2, 3), angle)[:3, :3]), angle, places=14)


class RunTest(unittest.TestCase):
    def table(self, ikiru: Path, *only: str) -> str:
        return compare.compare(argparse.Namespace(ikiru=ikiru, n=4, only=list(only), seed=3, out=None))

    def test_ikiru_is_read_and_judged_and_a_broken_peer_is_a_line(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            fake = Path(folder) / "ikiru"
            fake.write_text(FAKE_IKIRU.format(python=sys.executable, here=str(compare.HERE), panda=str(PANDA)))
            fake.chmod(0o755)
            peers, compare.PEERS = compare.PEERS, {"broken": ("peer_broken.py", ["simple", "panda"])}
            try:
                table = self.table(fake, "broken")
            finally:
                compare.PEERS = peers
        self.assertIn("| panda | **Ikiru** `lm` | 9.9.9 | 100.00 | 20 µs | 20 µs | 20 µs | 1 |", table)
        self.assertIn("| simple | **Ikiru** `lm` | 9.9.9 | 0.00 | 10 µs | 10 µs | 10 µs | 1 |", table)
        self.assertIn("4 of 4 called solved by the system, not by the judge", table)
        self.assertIn("| panda | broken | – | not run: ", table)

    def test_without_ikiru_the_table_says_so(self) -> None:
        peers, compare.PEERS = compare.PEERS, {"broken": ("peer_broken.py", ["panda"])}
        try:
            table = self.table(Path("/nowhere/ikiru"), "broken")
        finally:
            compare.PEERS = peers
        self.assertIn("| panda | **Ikiru** | – | not run: no command at /nowhere/ikiru", table)


if __name__ == "__main__":
    unittest.main()
