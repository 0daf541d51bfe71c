"""World transforms of all links in random configurations, by a program that shares no code with Ikiru.

    python -m venv venv && venv/bin/pip install pin==4.1.0 numpy==2.4.6
    venv/bin/python make_fk.py            # writes fk/*.json beside this file

For every robot here and in `assets/robots`: 20 configurations within limits from a fixed seed. Frames are those of the file's own
world, [x, y, z, qx, qy, qz, qw]. Pinocchio is told nothing of <mimic>: followers are set here, from the
file. It does not know Bullet's `spherical` joints and capsules: solids are dropped, and such a joint is given as a
floating one that does not translate.
"""

import json
import math
import pathlib
import tempfile
import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).parent
SHIPPED = HERE.parents[2] / "assets" / "robots"
N_CONFIGURATIONS = 20
SCALAR = ("revolute", "continuous", "prismatic")


def compact(values):
    return [float(f"{value:.12f}") for value in values]


def joints_of(robot):
    return {joint.get("name"): joint for joint in robot.findall("joint")}


def leader_of(joints, name):
    """The joint that `name` follows in the end: (leader, multiplier, offset)."""
    multiplier, offset = 1.0, 0.0
    while (mimic := joints[name].find("mimic")) is not None:
        # value = multiplier * (m * leader + o) + offset
        m, o = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
        multiplier, offset = multiplier * m, multiplier * o + offset
        name = mimic.get("joint")
    return name, multiplier, offset


def limits_of(joint):
    limit = joint.find("limit")
    if joint.get("type") == "continuous" or limit is None:
        return -math.pi, math.pi
    if limit.get("lower") is None and limit.get("upper") is None:
        return -math.inf, math.inf
    return float(limit.get("lower", 0)), float(limit.get("upper", 0))


def sample(joints, rng):
    """The values of all joints that move by themselves, and of all joints; rounded as they are written."""
    own, everything = {}, {}
    ranges = {}
    for name, joint in joints.items():
        if joint.get("type") not in SCALAR:
            continue
        leader, multiplier, offset = leader_of(joints, name)
        low, high = ((end - offset) / multiplier for end in limits_of(joint))
        before = ranges.get(leader, (-math.inf, math.inf))
        ranges[leader] = max(before[0], min(low, high)), min(before[1], max(low, high))
    for name, joint in joints.items():
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        match joint.get("type"):
            case "revolute" | "continuous" | "prismatic":
                if name in ranges:
                    own[name] = compact([rng.uniform(*ranges[name])])
            case "planar":
                own[name] = compact([*rng.uniform(-2, 2, size=2), rng.uniform(-math.pi, math.pi)])
            case "floating":
                own[name] = compact([*rng.uniform(-2, 2, size=3), *quaternion])
            case "spherical":
                own[name] = compact(quaternion)
    for name, joint in joints.items():
        if joint.get("type") in SCALAR:
            leader, multiplier, offset = leader_of(joints, name)
            everything[name] = [multiplier * own[leader][0] + offset]
        elif name in own:
            everything[name] = own[name]
    return own, everything


def model_of(robot, joints):
    for link in robot.findall("link"):
        for solid in link.findall("visual") + link.findall("collision"):
            link.remove(solid)
    kinds = {name: joint.get("type") for name, joint in joints.items()}
    for joint in joints.values():
        if joint.get("type") == "spherical":
            joint.set("type", "floating")
    with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
        file.write(ET.tostring(robot, encoding="unicode"))
        file.flush()
        return pin.buildModelFromUrdf(file.name), kinds


def configuration(model, kinds, values):
    q = pin.neutral(model)
    for name, value in values.items():
        joint = model.joints[model.getJointId(name)]
        if kinds[name] == "planar" or joint.nq == 2:
            value = [*value[:-1], math.cos(value[-1]), math.sin(value[-1])]
        if kinds[name] == "spherical":
            value = [0, 0, 0, *value]
        assert len(value) == joint.nq, name
        q[joint.idx_q : joint.idx_q + joint.nq] = value
    return q


def frames_of(model, links, q):
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return [pin.SE3ToXYZQUAT(data.oMf[model.getFrameId(link, pin.FrameType.BODY)]).tolist() for link in links]


def main():
    for path in sorted([*HERE.glob("*.urdf"), *SHIPPED.glob("*.urdf")], key=lambda path: path.name):
        robot = ET.fromstring(path.read_text().rstrip("\0"))
        joints, rng = joints_of(robot), np.random.default_rng(20250)
        configurations = [sample(joints, rng) for _ in range(N_CONFIGURATIONS)]
        model, kinds = model_of(robot, joints)
        links = [link.get("name") for link in robot.findall("link")]
        lines = []
        for own, everything in configurations:
            q = configuration(model, kinds, everything)
            frames = [compact(frame) for frame in frames_of(model, links, q)]
            lines.append(json.dumps({"joints": own, "frames": frames}, separators=(",", ":")))
        text = '{"links":' + json.dumps(links) + ',\n"configurations":[\n' + ",\n".join(lines) + "\n]}\n"
        (HERE / "fk" / f"{path.stem}.json").write_text(text)
        print(path.stem, len(links), "links")


main()
