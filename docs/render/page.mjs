// Draws one body with its targets; runs in the browser. `window.outcome` tells render.mjs when it is done.
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const FIELD_OF_VIEW_DEG = 26;
/** Where the camera stands, seen from the body: the body faces +Z, its left is +X. */
const DIRECTIONS = {
  front: [0, 0.06, 1],
  side: [1, 0.06, 0],
  "three-quarter": [0.62, 0.2, 1],
};

/** The part of the picture that the body may fill. */
const FILL = 0.92;

try {
  const options = await (await fetch("/options.json")).json();
  window.outcome = { done: await draw(options) };
} catch (error) {
  window.outcome = { failed: String(error?.message ?? error) };
}

async function draw({ targets, camera: view, width, height, time }) {
  const scene = new THREE.Scene();
  const gltf = await new GLTFLoader().loadAsync("/model.glb");
  if (time !== null) setTime(gltf, time);
  scene.add(gltf.scene);
  scene.updateMatrixWorld(true);

  let n_meshes = 0;
  gltf.scene.traverse((node) => {
    if (!node.isMesh) return;
    n_meshes += 1;
    node.castShadow = node.receiveShadow = true;
    node.frustumCulled = false; // a posed skin may leave the bounds of its rest pose
  });
  if (n_meshes === 0) scene.add(sticks(gltf.scene));
  scene.updateMatrixWorld(true);

  const points = outline(scene);
  if (points.length === 0) throw new Error("the file holds nothing to draw");
  const box = new THREE.Box3().setFromPoints(points);
  const size_of_body = box.getSize(new THREE.Vector3()).length();
  // Feet near the ground stand on it; what hangs below or flies far above brings its own floor.
  const floor = box.min.y > -0.05 && box.min.y < 0.5 ? 0 : box.min.y;
  points.push(box.getCenter(new THREE.Vector3()).setY(floor));
  for (const target of targets) {
    const point = new THREE.Vector3(...target);
    scene.add(marker(point, 0.009 * size_of_body));
    points.push(point);
  }
  box.setFromPoints(points);

  scene.add(ground(box, floor), ...lights(box));
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  renderer.setPixelRatio(2); // drawn at twice the size, shown at the wanted one: smooth edges
  renderer.setSize(width, height);
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = THREE.PCFShadowMap;
  renderer.toneMapping = THREE.NeutralToneMapping;
  document.body.append(renderer.domElement);
  renderer.render(scene, camera(points, DIRECTIONS[view], width / height));
  return { n_meshes, size: box.getSize(new THREE.Vector3()).toArray() };
}

/** Poses the body as its first clip has it at a time, in seconds. */
function setTime(gltf, time) {
  if (gltf.animations.length === 0) throw new Error("--time was given, but the file holds no clip");
  const mixer = new THREE.AnimationMixer(gltf.scene);
  const action = mixer.clipAction(gltf.animations[0]);
  action.setLoop(THREE.LoopOnce);
  action.clampWhenFinished = true;
  action.play();
  mixer.setTime(time);
}

/** A camera that sees every point, with the drawn part in the middle of the picture. */
function camera(points, direction, aspect) {
  const camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW_DEG, aspect, 0.01, 1000);
  const back = new THREE.Vector3(...direction).normalize();
  const right = new THREE.Vector3(0, 1, 0).cross(back).normalize();
  const up = back.clone().cross(right);
  const slope_y = Math.tan(THREE.MathUtils.degToRad(FIELD_OF_VIEW_DEG / 2)) * FILL;
  // A point is inside while |x| ≤ slope · depth. Across and upwards alike, both sides are touched at one distance.
  const fit = (axis, slope) => {
    let [low, high] = [Infinity, -Infinity];
    for (const point of points) {
      const depth = slope * point.dot(back);
      low = Math.min(low, point.dot(axis) - depth);
      high = Math.max(high, point.dot(axis) + depth);
    }
    return { middle: (low + high) / 2, distance: (high - low) / 2 / slope };
  };
  const across = fit(right, slope_y * aspect);
  const upwards = fit(up, slope_y);
  camera.position
    .copy(right)
    .multiplyScalar(across.middle)
    .addScaledVector(up, upwards.middle)
    .addScaledVector(back, Math.max(across.distance, upwards.distance));
  camera.lookAt(camera.position.clone().sub(back));
  return camera;
}

/** Points of everything drawn, as posed: enough of them to frame it. */
function outline(root) {
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
function lights(box) {
  const center = box.getCenter(new THREE.Vector3());
  const reach = box.getSize(new THREE.Vector3()).length();
  const at = (color, strength, x, y, z) => {
    const light = new THREE.DirectionalLight(color, strength);
    light.position.copy(center).add(new THREE.Vector3(x, y, z).multiplyScalar(reach));
    light.target.position.copy(center);
    light.target.updateMatrixWorld();
    return light;
  };
  const key = at(0xfff1e0, 3.1, 0.9, 1.3, 1.1);
  key.castShadow = true;
  key.shadow.mapSize.set(2048, 2048);
  key.shadow.radius = 6;
  key.shadow.normalBias = 0.01 * reach;
  Object.assign(key.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, far: 5 * reach });
  const fill = at(0xdce8ff, 0.9, -1.4, 0.5, 0.9);
  const edge = at(0xffffff, 1.5, -0.5, 1.0, -1.5);
  return [new THREE.HemisphereLight(0xffffff, 0x8d857c, 1.5), key, fill, edge];
}

/** A grid of half metres (or of what suits a smaller thing) that catches the shadow. */
function ground(box, floor) {
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
  ground.add(grid, shadow);
  ground.position.y = floor;
  return ground;
}

/** A green sphere, seen faintly through the body that covers it. */
function marker(point, radius) {
  const geometry = new THREE.SphereGeometry(radius, 32, 16);
  const solid = new THREE.MeshStandardMaterial({ color: 0x18b54a, emissive: 0x0b6b2a, roughness: 0.4 });
  const ghost = new THREE.MeshBasicMaterial({ color: 0x18b54a, opacity: 0.45, transparent: true, depthTest: false });
  const marker = new THREE.Group();
  marker.add(new THREE.Mesh(geometry, solid), new THREE.Mesh(geometry, ghost));
  marker.position.copy(point);
  return marker;
}

/** For a skeleton without a skin: a ball at each joint, a stick to its parent. */
function sticks(root) {
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
