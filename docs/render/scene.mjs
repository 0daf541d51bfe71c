// What both pages draw with: light, ground, targets, and bodies without a skin; runs in the browser.
import * as THREE from "three";

/** Points of everything drawn, as posed: enough of them to frame it. */
export function outline(root) {
  const points = [];
  root.traverse((node) => {
    if (!node.isMesh) return;
    const n_vertices = node.geometry.attributes.position.count;
    const stride = Math.max(1, Math.floor(n_vertices / 4000));
    for (let vertex = 0; vertex < n_vertices; vertex += stride) {
      points.push(node.getVertexPosition(vertex, new THREE.Vector3()).applyMatrix4(node.matrixWorld));
    }
  });
  return points;
}

/** Soft light from the sky, a key light with a shadow, a fill from the other side and an edge from behind. */
export function lights(box, key_from = [0.9, 1.3, 1.1], n_shadow = 2048) {
  const center = box.getCenter(new THREE.Vector3());
  const reach = box.getSize(new THREE.Vector3()).length();
  const at = (color, strength, x, y, z) => {
    const light = new THREE.DirectionalLight(color, strength);
    light.position.copy(center).add(new THREE.Vector3(x, y, z).multiplyScalar(reach));
    light.target.position.copy(center);
    light.target.updateMatrixWorld();
    return light;
  };
  const key = at(0xfff1e0, 3.1, ...key_from);
  key.castShadow = true;
  key.shadow.mapSize.set(n_shadow, n_shadow);
  key.shadow.radius = 6;
  key.shadow.normalBias = 0.01 * reach;
  Object.assign(key.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, far: 5 * reach });
  const fill = at(0xdce8ff, 0.9, -1.4, 0.5, 0.9);
  const edge = at(0xffffff, 1.5, -0.5, 1.0, -1.5);
  return [new THREE.HemisphereLight(0xffffff, 0x8d857c, 1.5), key, fill, edge];
}

/** A grid of half metres (or of what suits a smaller thing) that catches the shadow. */
export function ground(box, floor, has_grid = true) {
  const size = box.getSize(new THREE.Vector3());
  const cell = size.length() > 0.8 ? 0.5 : 0.1;
  const n_cells = 2 * Math.ceil((4 * size.length()) / cell / 2);
  const ground = new THREE.Group();
  const grid = new THREE.GridHelper(n_cells * cell, n_cells, 0x7d8791, 0x98a2ac);
  grid.material.transparent = true;
  grid.material.opacity = 0.6;
  const shadow = new THREE.Mesh(
    new THREE.PlaneGeometry(n_cells * cell, n_cells * cell).rotateX(-Math.PI / 2),
    new THREE.ShadowMaterial({ opacity: 0.28 }),
  );
  shadow.receiveShadow = true;
  shadow.position.y = -0.001 * size.length();
  if (has_grid) ground.add(grid);
  ground.add(shadow);
  ground.position.y = floor;
  return ground;
}

/** A green sphere, seen faintly through the body that covers it. */
export function marker(point, radius) {
  const geometry = new THREE.SphereGeometry(radius, 32, 16);
  const solid = new THREE.MeshStandardMaterial({ color: 0x18b54a, emissive: 0x0b6b2a, roughness: 0.4 });
  const ghost = new THREE.MeshBasicMaterial({ color: 0x18b54a, opacity: 0.45, transparent: true, depthTest: false });
  const marker = new THREE.Group();
  marker.add(new THREE.Mesh(geometry, solid), new THREE.Mesh(geometry, ghost));
  marker.position.copy(point);
  return marker;
}

/** For a skeleton without a skin: a ball at each joint, a stick to its parent. */
export function sticks(root) {
  const points = [];
  root.traverse((node) => points.push([node, new THREE.Vector3().setFromMatrixPosition(node.matrixWorld)]));
  const bounds = new THREE.Box3().setFromPoints(points.map(([, point]) => point));
  const radius = 0.006 * bounds.getSize(new THREE.Vector3()).length();
  const joint = new THREE.MeshStandardMaterial({ color: 0xe8833a, roughness: 0.6 });
  const bone = new THREE.MeshStandardMaterial({ color: 0x5b7fa6, roughness: 0.6 });
  const sticks = new THREE.Group();
  for (const [node, point] of points) {
    if (node === root) continue;
    const ball = new THREE.Mesh(new THREE.SphereGeometry(radius, 16, 12), joint);
    ball.position.copy(point);
    ball.castShadow = true;
    sticks.add(ball);
    if (node.parent === root) continue;
    const start = new THREE.Vector3().setFromMatrixPosition(node.parent.matrixWorld);
    const along = point.clone().sub(start);
    if (along.length() < 1e-6) continue;
    const stick = new THREE.Mesh(new THREE.CylinderGeometry(radius * 0.35, radius * 0.8, along.length(), 12), bone);
    stick.position.copy(start).addScaledVector(along, 0.5);
    stick.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.clone().normalize());
    stick.castShadow = true;
    sticks.add(stick);
  }
  return sticks;
}
