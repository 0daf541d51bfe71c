#!/usr/bin/env python3
"""Derives the VRM 0.x sample from the VRM 1.0 one: the same character, turned to face -z, with the old extension.

Usage: make_vrm0.py mh_male_vrm1.vrm mh_male_vrm0.vrm      (Python 3, standard library only)

Nodes, positions, normals and inverse bind matrices are turned by 180 degrees about y: x and z change their signs,
and a rotation is conjugated by that turn, so that rest rotations that were the identity stay it, as VRM 0.x wants.
"""

import json
import struct
import sys

JSON, BIN = 0x4E4F534A, 0x004E4942
SIGNS = [-1.0, 1.0, -1.0, 1.0]

# VRM 1.0 calls the bones of the thumb by other names.
OLD_NAMES = {
    side + new: side + old
    for side in ("left", "right")
    for new, old in (("ThumbMetacarpal", "ThumbProximal"), ("ThumbProximal", "ThumbIntermediate"))
}


def chunks(data):
    at = 12
    while at < len(data):
        length, kind = struct.unpack_from("<II", data, at)
        yield kind, data[at + 8 : at + 8 + length]
        at += 8 + length


def turned(values):
    """Vectors and quaternions: x and z change their signs. (0 - v has no -0.)"""
    return [0.0 - v if sign < 0 else v for v, sign in zip(values, SIGNS)]


def turn_accessor(document, binary, index, width):
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    assert accessor["componentType"] == 5126 and "sparse" not in accessor
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", 4 * width)
    for element in range(accessor["count"]):
        at = start + element * stride
        values = struct.unpack_from("<%df" % width, binary, at)
        if width == 16:
            values = [0.0 - v if SIGNS[i // 4] * SIGNS[i % 4] < 0 else v for i, v in enumerate(values)]
        else:
            values = turned(values)
        struct.pack_into("<%df" % width, binary, at, *values)
    if "min" in accessor and width == 3:
        low, high = turned(accessor["min"]), turned(accessor["max"])
        accessor["min"] = [min(pair) for pair in zip(low, high)]
        accessor["max"] = [max(pair) for pair in zip(low, high)]


def old_extension(document):
    new = document["extensions"]["VRMC_vrm"]
    bones = new["humanoid"]["humanBones"]
    meta = new["meta"]
    return {
        "exporterVersion": "make_vrm0.py",
        "specVersion": "0.0",
        "meta": {
            "title": meta["name"],
            "version": meta["version"],
            "author": ", ".join(meta["authors"]),
            "contactInformation": "",
            "reference": "",
            "allowedUserName": "Everyone",
            "violentUssageName": "Allow",
            "sexualUssageName": "Allow",
            "commercialUssageName": "Allow",
            "otherPermissionUrl": "",
            "licenseName": "CC0",
            "otherLicenseUrl": meta["otherLicenseUrl"],
        },
        "humanoid": {
            "humanBones": [
                {"bone": OLD_NAMES.get(bone, bone), "node": value["node"], "useDefaultValues": True}
                for bone, value in bones.items()
            ],
            "armStretch": 0.05,
            "legStretch": 0.05,
            "upperArmTwist": 0.5,
            "lowerArmTwist": 0.5,
            "upperLegTwist": 0.5,
            "lowerLegTwist": 0.5,
            "feetSpacing": 0,
            "hasTranslationDoF": False,
        },
        "firstPerson": {
            "firstPersonBone": bones["head"]["node"],
            "firstPersonBoneOffset": {"x": 0, "y": 0.06, "z": 0},
            "meshAnnotations": [],
            "lookAtTypeName": "Bone",
        },
        "blendShapeMaster": {"blendShapeGroups": [{"name": "Neutral", "presetName": "neutral", "binds": []}]},
        "secondaryAnimation": {"boneGroups": [], "colliderGroups": []},
        "materialProperties": [
            {
                "name": material.get("name", ""),
                "shader": "VRM_USE_GLTFSHADER",
                "renderQueue": 2000,
                "floatProperties": {},
                "vectorProperties": {},
                "textureProperties": {},
                "keywordMap": {},
                "tagMap": {},
            }
            for material in document["materials"]
        ],
    }


def main(source, target):
    with open(source, "rb") as file:
        parts = dict(chunks(file.read()))
    document, binary = json.loads(parts[JSON]), bytearray(parts[BIN])
    for node in document["nodes"]:
        assert "matrix" not in node
        for member in ("translation", "rotation"):
            if member in node:
                node[member] = turned(node[member])
    widths = {}
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            assert "targets" not in primitive and "TANGENT" not in primitive["attributes"]
            for attribute in ("POSITION", "NORMAL"):
                widths[primitive["attributes"][attribute]] = 3
    for skin in document["skins"]:
        widths[skin["inverseBindMatrices"]] = 16
    for index, width in widths.items():
        turn_accessor(document, binary, index, width)
    document["extensions"] = {"VRM": old_extension(document)}
    document["extensionsUsed"] = ["VRM"]

    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    with open(target, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(binary)))
        file.write(struct.pack("<II", len(text), JSON) + text)
        file.write(struct.pack("<II", len(binary), BIN) + binary)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
