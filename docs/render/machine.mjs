// A body for a skeleton that has none: links between joints and, where a joint turns about one axis, a drum about it.
import * as THREE from "three";

/** Radius of the thickest link, as a part of the machine's size; the last is half as thick. */
const RADIUS = 0.062;
const SAMPLES = 12;

/** Gives the nodes of a skeleton meshes that move with them. `pose` poses it at a time, in seconds. */
export function machine(body, pose, duration) {
  const axes = turning_axes(body, pose, duration);
  pose(0);
  const joints = [];
  body.traverse((node) => node.isBone && node.name !== "ENDSITE" && joints.push(node));
  const places = joints.map((node) => new THREE.Vector3().setFromMatrixPosition(node.matrixWorld));
  const size = new THREE.Box3().setFromPoints(places).getSize(new THREE.Vector3()).length();
  const shell = new THREE.MeshStandardMaterial({ color: 0xe9ebee, roughness: 0.45 });
  const drum = new THREE.MeshStandardMaterial({ color: 0x4d6580, roughness: 0.5 });
  const tool = new THREE.MeshStandardMaterial({ color: 0x3a424b, roughness: 0.6 });
  const deepest = Math.max(...joints.map(depth));
  const radius = (node) => RADIUS * size * (1 - (0.5 * depth(node)) / deepest);
  for (const node of joints) {
    const children = node.children.filter((child) => child.isBone);
    const is_leaf = children.every((child) => child.name === "ENDSITE");
    for (const child of children) {
      const [thick, thin] = child.name === "ENDSITE" || !axes.has(child) ? [0.4, 0.3] : [0.85, 0.85];
      const material = thick < 0.8 ? tool : shell;
      node.add(link(child.position, thick * radius(node), thin * radius(child), material));
    }
    if (axes.has(node)) node.add(turn(axes.get(node), radius(node), drum));
    else if (depth(node) === 0) node.add(foot(node, radius(node), drum));
    else if (!is_leaf) node.add(ball(0.5 * radius(node), tool));
  }
}

function depth(node) {
  return node.parent?.isBone ? depth(node.parent) + 1 : 0;
}

/** The axis of every joint that turns about one, in the joint's own frame. */
function turning_axes(body, pose, duration) {
  const axes = new Map();
  const before = new Map();
  for (let idx = 0; idx <= SAMPLES; idx += 1) {
    pose((duration * idx) / SAMPLES);
    body.traverse((node) => {
      if (!node.isBone) return;
      const turned = before.get(node)?.clone().invert().multiply(node.quaternion);
      before.set(node, node.quaternion.clone());
      if (!turned) return;
      const axis = new THREE.Vector3(turned.x, turned.y, turned.z);
      if (axis.length() > 1e-3 && !axes.has(node)) axes.set(node, axis.normalize());
    });
  }
  return axes;
}

function link(end, thick, thin, material) {
  const group = new THREE.Group();
  if (end.length() < 1e-4) return group;
  const tube = new THREE.Mesh(new THREE.CylinderGeometry(thin, thick, end.length(), 32), material);
  tube.position.copy(end).multiplyScalar(0.5);
  tube.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), end.clone().normalize());
  tube.castShadow = tube.receiveShadow = true;
  group.add(tube);
  return group;
}

function turn(axis, radius, material) {
  const mesh = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, 2.5 * radius, 40), material);
  mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), axis);
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}

/** What it stands on: flat on the ground, whatever the root's own axes are. */
function foot(root, radius, material) {
  const mesh = new THREE.Mesh(new THREE.CylinderGeometry(1.5 * radius, 1.7 * radius, 0.9 * radius, 40), material);
  mesh.quaternion.copy(root.getWorldQuaternion(new THREE.Quaternion()).invert());
  mesh.position.set(0, 0.45 * radius, 0).applyQuaternion(mesh.quaternion);
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}

function ball(radius, material) {
  const mesh = new THREE.Mesh(new THREE.SphereGeometry(radius, 32, 16), material);
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}
