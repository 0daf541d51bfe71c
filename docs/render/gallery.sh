#!/bin/sh
# Plans the gallery's motions and draws them into docs/gallery. Needs what README.md beside this file says.
set -eu
cd "$(dirname "$0")/../.."
motions=$(mktemp -d)
trap 'rm -r "$motions"' EXIT
mkdir -p docs/gallery

plan() {
  cargo run --release --quiet -p ikiru-cli -- plan "scenarios/motion/$1.toml" --out "$motions/$1.$2"
}
strip() {
  name=$1 kind=$2
  shift 2
  node docs/render/strip.mjs "$motions/$name.$kind" "docs/gallery/$name.png" --width 1200 "$@"
}

plan reach_palm_down glb
strip reach_palm_down glb --gap 0.18 --target 0.18,1.15,0.42,1.5 --trail middle_01_l

plan three_points glb
strip three_points glb --gap 0.08 --times 0,0.5,1,1.5,2,3,4 --trail hand_l \
  --target 0.45,1.30,0.25,1 --target 0.15,1.45,0.35,2 --target 0.35,1.05,0.40,3

# A robot's file has no skin that a .glb could carry. Targets in the world of the picture: y up, the arm forward along z.
plan panda_arc bvh
strip panda_arc bvh --gap 0.12 --camera 0.35,0.5,1 --trail panda_joint8 \
  --target 0.30,0.40,0.45,1 --target -0.30,0.40,0.45,2
