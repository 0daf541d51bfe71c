"""The judge: decides from joint values alone whether a target was reached, for every system in the same way.

It shares no code with Ikiru or any peer: files are parsed here, frames are products of 4 × 4 matrices in numpy.
Nobody's own word on success counts.
"""

from __future__ import annotations

import json
import math
import struct
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

COST_BELOW = 0.005
"""The paper's bar for the human."""
TOLERANCE = 1e-5
"""Metres and radians, for the Panda."""
LIMIT_SLACK = 1e-6
"""Radians: what single precision (jax-ik) and quadratic programs (pin-pink, mink) may lose at a limit."""

HUMAN_TIP = "left_index3_look"
HUMAN_LIMITS_DEG: dict[str, tuple[Sequence[float], Sequence[float]]] = {
    "left_collar": ((-10, -10, -10), (10, 10, 10)),
    "left_shoulder": ((0, -140, -70), (50, 50, 25)),
    "left_elbow": ((-45, -180, -10), (90, 5, 10)),
    "left_wrist": ((-90, -70, -55), (90, 70, 85)),
}
"""Ranges of the paper's twelve angles: x, y, z of R = Rz · Ry · Rx."""


@dataclass(frozen=True)
class Look:
    """A look-at term: the joint's +Y towards its tip (`length` along +Y) plus `offset`, in world axes."""

    joint: str
    length: float
    offset: tuple[float, float, float]
    weight: float


HUMAN_LOOKS = (
    Look("left_wrist", 0.0915, (0, 1, 0), 0.1 / 3),
    Look("left_index3_look", 0.1, (0, 0, 1), 0.1 / 3),
    Look("left_shoulder", 0.261, (0, 0, -1), 0.0002 / 3),
)


@dataclass(frozen=True)
class Verdict:
    """Whether a target was reached, and by how much."""

    success: bool
    position_error: float
    """Metres; for the human the cost."""
    rotation_error: float
    """Radians; 0 for the human."""
    limit_excess: float
    """Radians beyond the worst limit; negative inside."""


def translation(offset: Sequence[float]) -> np.ndarray:
    """4 × 4 translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def rotation_about(axis: Sequence[float], angle: float) -> np.ndarray:
    """4 × 4 rotation about an axis of any length (Rodrigues)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return matrix


def rotation_xyz(x: float, y: float, z: float) -> np.ndarray:
    """Rz · Ry · Rx: the paper's joints, and URDF's roll, pitch, yaw."""
    return rotation_about((0, 0, 1), z) @ rotation_about((0, 1, 0), y) @ rotation_about((1, 0, 0), x)


def rotation_of(quaternion: Sequence[float]) -> np.ndarray:
    """4 × 4 rotation of a quaternion x, y, z, w of any length."""
    vector, w = np.asarray(quaternion[:3], float), float(quaternion[3])
    length = np.linalg.norm(vector)
    return np.eye(4) if length == 0.0 else rotation_about(vector, 2 * math.atan2(length, w))


def angle_of(rotation: np.ndarray) -> float:
    """Angle of a 3 × 3 rotation, exact also near 0."""
    skew = [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    return math.atan2(float(np.linalg.norm(skew)), float(np.trace(rotation)) - 1)


class Human:
    """The reference human's left arm, straight from the nodes of a .glb file."""

    def __init__(self, path: Path) -> None:
        raw = path.read_bytes()
        if raw[:4] != b"glTF":
            raise ValueError(f"{path}: not a .glb file")
        length, kind = struct.unpack_from("<II", raw, 12)
        if kind != 0x4E4F534A:
            raise ValueError(f"{path}: the first chunk is not JSON")
        nodes = json.loads(raw[20 : 20 + length])["nodes"]
        parents = {child: idx for idx, node in enumerate(nodes) for child in node.get("children", [])}
        idx: int | None = next(i for i, node in enumerate(nodes) if node.get("name") == HUMAN_TIP)
        self.chain: list[tuple[str, np.ndarray]] = []
        while idx is not None:
            node = nodes[idx]
            if "matrix" in node or "scale" in node:
                raise ValueError(f"{path}: node {idx} has a matrix or a scale, which this judge does not read")
            rest = translation(node.get("translation", (0, 0, 0))) @ rotation_of(node.get("rotation", (0, 0, 0, 1)))
            self.chain.insert(0, (node["name"], rest))
            idx = parents.get(idx)
        self.joints = list(HUMAN_LIMITS_DEG)
        self.lower = np.radians([low for ranges in HUMAN_LIMITS_DEG.values() for low in ranges[0]])
        self.upper = np.radians([high for ranges in HUMAN_LIMITS_DEG.values() for high in ranges[1]])

    def frames(self, angles: Sequence[float]) -> dict[str, np.ndarray]:
        """World frames of the arm's joints and of their ancestors."""
        frames, world = {}, np.eye(4)
        for name, rest in self.chain:
            world = world @ rest
            if name in self.joints:
                first = 3 * self.joints.index(name)
                world = world @ rotation_xyz(*angles[first : first + 3])
            frames[name] = world
        return frames

    def cost(self, angles: Sequence[float], target: Sequence[float], combined: bool) -> float:
        """The paper's J: the distance (equation 16), and if combined the three look-at terms (equation 17)."""
        frames = self.frames(angles)
        cost = float(np.linalg.norm(frames[HUMAN_TIP][:3, 3] - target))
        for look in HUMAN_LOOKS if combined else ():
            bone = frames[look.joint][:3, 1]
            towards = look.length * bone + look.offset
            angle = math.atan2(float(np.linalg.norm(np.cross(bone, towards))), float(bone @ towards))
            cost += look.weight * angle**2
        return cost

    def judge(self, angles: Sequence[float], target: Sequence[float], combined: bool) -> Verdict:
        """Cost below the bar and all limits held."""
        if len(angles) != 12 or not np.isfinite(angles).all():
            return Verdict(False, math.inf, 0.0, math.inf)
        cost = self.cost(angles, target, combined)
        excess = limit_excess(angles, self.lower, self.upper)
        return Verdict(cost < COST_BELOW and excess <= LIMIT_SLACK, cost, 0.0, excess)


class Arm:
    """A chain of a URDF file, from a base link to a tip link, in the file's own world."""

    def __init__(self, path: Path, base: str, tip: str) -> None:
        by_child = {joint.find("child").get("link"): joint for joint in ET.parse(path).getroot().findall("joint")
                    if joint.find("child") is not None}
        if base in by_child:
            raise ValueError(f"{path}: {base} is not the root link; poses would not be in the file's world")
        self.segments: list[tuple[np.ndarray, str, np.ndarray]] = []
        self.joints: list[str] = []
        lower, upper, link = [], [], tip
        while link != base:
            if link not in by_child:
                raise ValueError(f"{path}: no chain from {base} to {tip}")
            joint = by_child[link]
            kind = joint.get("type")
            if kind not in ("fixed", "revolute", "prismatic"):
                raise ValueError(f"{path}: joint {joint.get('name')} is {kind}, which this judge does not read")
            self.segments.insert(0, (origin_of(joint), kind, vector_of(joint.find("axis"), "xyz", (1, 0, 0))))
            if kind != "fixed":
                self.joints.insert(0, joint.get("name"))
                lower.insert(0, float(joint.find("limit").get("lower")))
                upper.insert(0, float(joint.find("limit").get("upper")))
            link = joint.find("parent").get("link")
        self.base, self.tip = base, tip
        self.lower, self.upper = np.array(lower), np.array(upper)

    def pose(self, values: Sequence[float]) -> np.ndarray:
        """The tip link's frame in the world of the file."""
        world, remaining = np.eye(4), iter(values)
        for origin, kind, axis in self.segments:
            world = world @ origin
            if kind == "revolute":
                world = world @ rotation_about(axis, next(remaining))
            elif kind == "prismatic":
                world = world @ translation(axis * next(remaining))
        return world

    def judge(self, values: Sequence[float], target: np.ndarray) -> Verdict:
        """Position and rotation within tolerance and all limits held."""
        if len(values) != len(self.joints) or not np.isfinite(values).all():
            return Verdict(False, math.inf, math.inf, math.inf)
        pose = self.pose(values)
        position = float(np.linalg.norm(pose[:3, 3] - target[:3, 3]))
        rotation = angle_of(target[:3, :3].T @ pose[:3, :3])
        excess = limit_excess(values, self.lower, self.upper)
        return Verdict(position <= TOLERANCE and rotation <= TOLERANCE and excess <= LIMIT_SLACK,
                       position, rotation, excess)

    def sample(self, n_targets: int, seed: int) -> list[np.ndarray]:
        """Reachable poses: of random joint values inside the limits."""
        random = np.random.default_rng(seed)
        return [self.pose(random.uniform(self.lower, self.upper)) for _ in range(n_targets)]


def limit_excess(values: Sequence[float], lower: np.ndarray, upper: np.ndarray) -> float:
    """How far the worst value lies beyond its range."""
    return float(np.max(np.maximum(lower - values, np.asarray(values) - upper)))


def vector_of(element: ET.Element | None, attribute: str, default: Sequence[float]) -> np.ndarray:
    """Three numbers of an attribute, if it is there."""
    text = None if element is None else element.get(attribute)
    return np.array(default if text is None else [float(number) for number in text.split()], float)


def origin_of(joint: ET.Element) -> np.ndarray:
    """The fixed transform of a URDF joint."""
    origin = joint.find("origin")
    return translation(vector_of(origin, "xyz", (0, 0, 0))) @ rotation_xyz(*vector_of(origin, "rpy", (0, 0, 0)))


def pose_matrix(position: Sequence[float], quaternion: Sequence[float]) -> np.ndarray:
    """4 × 4 pose of a position and a quaternion x, y, z, w."""
    return translation(position) @ rotation_of(quaternion)
