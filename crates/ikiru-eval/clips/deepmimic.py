"""Takes a DeepMimic motion to BVH: python3 deepmimic.py humanoid3d_walk.txt > deepmimic_walk.bvh

A DeepMimic frame is its duration, the root's position and quaternion (w first), then the joints in the order below:
quaternions of balls, angles about z of knees and elbows. x is forward, y up; a BVH here faces z. Offsets are those of
the humanoid that the motions were made for, at a quarter.
"""

import json
import math
import sys

# Name, parent, offset (metres, x forward, z right), whether it has a quaternion (None: nothing, at the tips).
JOINTS = [
    ("Hips", None, (0, 0, 0), True),
    ("Chest", "Hips", (0, 0.236151, 0), True),
    ("Neck", "Chest", (0, 0.223894, 0), True),
    ("RightUpLeg", "Hips", (0, 0, 0.084887), True),
    ("RightLeg", "RightUpLeg", (0, -0.421546, 0), False),
    ("RightFoot", "RightLeg", (0, -0.40987, 0), True),
    ("RightArm", "Chest", (-0.02405, 0.2435, 0.18311), True),
    ("RightForeArm", "RightArm", (0, -0.274788, 0), False),
    ("LeftUpLeg", "Hips", (0, 0, -0.084887), True),
    ("LeftLeg", "LeftUpLeg", (0, -0.421546, 0), False),
    ("LeftFoot", "LeftLeg", (0, -0.40987, 0), True),
    ("LeftArm", "Chest", (-0.02405, 0.2435, -0.18311), True),
    ("LeftForeArm", "LeftArm", (0, -0.274788, 0), False),
    ("RightHand", "RightForeArm", (0, -0.258947, 0), None),
    ("LeftHand", "LeftForeArm", (0, -0.258947, 0), None),
    ("Head", "Neck", (0, 0.0875, 0), None),
    ("RightToeBase", "RightFoot", (0.13, -0.045, 0), None),
    ("LeftToeBase", "LeftFoot", (0.13, -0.045, 0), None),
]


def facing_z(v):
    x, y, z = v
    return (-z, y, x)


def euler(w, x, y, z):
    """Degrees about z, x, y, in that order."""
    x, y, z = facing_z((x, y, z))
    sin_x = max(-1.0, min(1.0, 2 * (y * z + w * x)))
    about_z = math.atan2(2 * (w * z - x * y), 1 - 2 * (x * x + z * z))
    about_y = math.atan2(2 * (w * y - x * z), 1 - 2 * (x * x + y * y))
    return [math.degrees(angle) for angle in (about_z, math.asin(sin_x), about_y)]


def hierarchy(name, depth=0):
    _, parent, offset, _ = next(joint for joint in JOINTS if joint[0] == name)
    pad = "\t" * depth
    lines = [f"{pad}{'ROOT' if parent is None else 'JOINT'} {name}", pad + "{"]
    lines.append(f"{pad}\tOFFSET " + " ".join(f"{v:.6f}" for v in facing_z(offset)))
    places = "Xposition Yposition Zposition " if parent is None else ""
    lines.append(f"{pad}\tCHANNELS {6 if parent is None else 3} {places}Zrotation Xrotation Yrotation")
    children = [joint[0] for joint in JOINTS if joint[1] == name]
    for child in children:
        lines += hierarchy(child, depth + 1)
    if not children:
        lines += [f"{pad}\tEnd Site", pad + "\t{", f"{pad}\t\tOFFSET 0 0.05 0", pad + "\t}"]
    return lines + [pad + "}"]


def order(name):
    return [name] + [below for joint in JOINTS if joint[1] == name for below in order(joint[0])]


def main():
    frames = json.load(open(sys.argv[1]))["Frames"]
    print("HIERARCHY")
    print("\n".join(hierarchy("Hips")))
    print(f"MOTION\nFrames: {len(frames)}\nFrame Time: {frames[0][0]:.6f}")
    for frame in frames:
        rest, turns = frame[4:], {}
        for name, _, _, has_quaternion in JOINTS:
            if has_quaternion:
                turns[name], rest = euler(*rest[:4]), rest[4:]
            elif has_quaternion is False:
                half, rest = 0.5 * rest[0], rest[1:]
                turns[name] = euler(math.cos(half), 0, 0, math.sin(half))
            else:
                turns[name] = [0.0] * 3
        assert not rest
        values = list(facing_z(frame[1:4])) + [v for name in order("Hips") for v in turns[name]]
        print(" ".join(f"{v:.4f}" for v in values))


main()
