// Draws one body with its targets; runs in the browser. `window.outcome` tells render.mjs when it is done.
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { ground, lights, marker, outline, sticks } from "./scene.mjs";

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
  const gltf = await new GLTFLoader().loadAsync("/model");
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
