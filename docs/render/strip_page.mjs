// Draws a motion as a row of poses, one camera for all; runs in the browser. `window.outcome` tells strip.mjs when it is done.
import * as THREE from "three";
import { BVHLoader } from "three/addons/loaders/BVHLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { clone } from "three/addons/utils/SkeletonUtils.js";
import { ground, lights, marker, outline } from "./scene.mjs";
import { machine } from "./machine.mjs";

/** Poses, evenly from the first frame to the last, unless times are given. */
const N_POSES = 7;
/** Samples of a joint's way in a second. */
const TRAIL_RATE = 120;
/** Room above and below the row, as a part of its height, and beside it, as a part of the distance from pose to pose. */
const MARGIN = 0.05;
const SIDE = 0.12;
/** Height of the line with times below the row, pixels. */
const LABELS = 34;
/** Where the light stands: high, so that a shadow stays with its body. */
const KEY_LIGHT = [0.5, 1.6, 0.9];
/** Thickness of targets and trails, as parts of the distance from pose to pose. */
const TARGET = 0.026;
const TRAIL = 0.008;
const TRAIL_COLOR = 0xe0702a;

try {
  const options = await (await fetch("/options.json")).json();
  window.outcome = { done: await draw(options) };
} catch (error) {
  window.outcome = { failed: String(error?.message ?? error) };
}

async function draw({ kind, times: wanted, targets, trails, camera: direction, gap, width }) {
  const { body, clip } = await (kind === "bvh" ? bvh() : glb());
  const back = new THREE.Vector3(...direction).normalize();
  const right = new THREE.Vector3(0, 1, 0).cross(back).normalize();
  const up = back.clone().cross(right);
  const times = wanted ?? Array.from({ length: N_POSES }, (_, idx) => (clip.duration * idx) / (N_POSES - 1));
  const ways = trails.map((name) => way(body, clip, name));
  const figures = times.map((secs) => {
    const figure = new THREE.Group();
    figure.add(posed(body, clip, secs));
    figure.updateMatrixWorld(true);
    return { figure, secs, points: outline(figure) };
  });
  for (const { points } of figures) {
    points.push(...targets.map(({ point }) => new THREE.Vector3(...point)), ...ways.flat());
  }

  // Everyone the same distance from the next, as near as the closest two let them be.
  const extents = figures.map(({ points }) => extent(points, right));
  let spacing = 0;
  for (let idx = 1; idx < figures.length; idx += 1) {
    spacing = Math.max(spacing, extents[idx - 1].high - extents[idx].low);
  }
  spacing += gap * Math.max(...extents.map(({ low, high }) => high - low));
  for (const { figure, secs } of figures) {
    for (const { point, secs: at } of targets) {
      // A target whose time has not come is a faint one.
      const sphere = at === null || at <= secs + 1e-6 ? marker : ghost;
      figure.add(sphere(new THREE.Vector3(...point), TARGET * spacing));
    }
    for (const path of ways) {
      const so_far = path.filter((_, idx) => idx / TRAIL_RATE <= secs + 1e-6);
      if (so_far.length > 2) figure.add(trail(so_far, TRAIL * spacing));
    }
  }
  const scene = new THREE.Scene();
  const everything = [];
  figures.forEach(({ figure, points }, idx) => {
    const shift = right.clone().multiplyScalar(idx * spacing);
    figure.position.copy(shift);
    scene.add(figure);
    everything.push(...points.map((point) => point.clone().add(shift)));
  });
  scene.updateMatrixWorld(true);

  const box = new THREE.Box3().setFromPoints(everything);
  const floor = box.min.y > -0.05 && box.min.y < 0.5 ? 0 : box.min.y;
  // A shadow falls where the light's ray through a point meets the floor.
  const ray = new THREE.Vector3(...KEY_LIGHT);
  const shadows = everything.map((point) => point.clone().addScaledVector(ray, (floor - point.y) / ray.y));
  const [across, upwards] = [extent(everything, right), extent([...everything, ...shadows], up)];
  const room = MARGIN * (upwards.high - upwards.low);
  const beside = SIDE * spacing;
  const [left, wide] = [across.low - beside, across.high - across.low + 2 * beside];
  const [bottom, high] = [upwards.low - room, upwards.high - upwards.low + 2 * room];
  const height = Math.round((width * high) / wide);
  scene.add(ground(box, floor, false), ...lights(box, KEY_LIGHT, 4096));

  // Without perspective everyone is seen from the same side.
  const depth = 4 * box.getSize(new THREE.Vector3()).length();
  const camera = new THREE.OrthographicCamera(-wide / 2, wide / 2, high / 2, -high / 2, 0.01, 3 * depth);
  const middle = box.getCenter(new THREE.Vector3()).dot(back);
  camera.position
    .copy(right)
    .multiplyScalar(left + wide / 2)
    .addScaledVector(up, bottom + high / 2)
    .addScaledVector(back, middle + depth);
  camera.lookAt(camera.position.clone().sub(back));

  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  renderer.setPixelRatio(2); // drawn at twice the size, shown at the wanted one: smooth edges
  renderer.setSize(width, height);
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = THREE.PCFShadowMap;
  renderer.toneMapping = THREE.NeutralToneMapping;
  document.body.style.background = "#eceff2"; // one colour: small files
  document.body.append(renderer.domElement);
  renderer.render(scene, camera);
  for (const { figure, secs } of figures) {
    label(`${Number(secs.toFixed(2))} s`, ((figure.position.dot(right) - left) / wide) * width, height);
  }
  return { height: height + LABELS };
}

async function glb() {
  const gltf = await new GLTFLoader().loadAsync("/model");
  if (gltf.animations.length === 0) throw new Error("the file holds no clip");
  gltf.scene.traverse((node) => {
    if (!node.isMesh) return;
    node.castShadow = node.receiveShadow = true;
    node.frustumCulled = false; // a posed skin may leave the bounds of its rest pose
  });
  return { body: gltf.scene, clip: gltf.animations[0] };
}

/** A skeleton alone, drawn as a machine. */
async function bvh() {
  const { skeleton, clip } = await new BVHLoader().loadAsync("/model");
  const body = new THREE.Group();
  body.add(skeleton.bones[0]);
  machine(body, (secs) => pose(body, clip, secs), clip.duration);
  return { body, clip };
}

/** Poses a body as its clip has it at a time, in seconds. */
function pose(body, clip, secs) {
  const mixer = new THREE.AnimationMixer(body);
  const action = mixer.clipAction(clip);
  action.setLoop(THREE.LoopOnce);
  action.clampWhenFinished = true;
  action.play();
  mixer.setTime(secs);
  body.updateMatrixWorld(true);
}

function posed(body, clip, secs) {
  const copy = clone(body);
  pose(copy, clip, secs);
  return copy;
}

/** Where a joint is all the while, in the world. */
function way(body, clip, name) {
  const copy = clone(body);
  const node = copy.getObjectByName(name);
  if (!node) throw new Error(`the file has no joint '${name}'`);
  const n = Math.round(clip.duration * TRAIL_RATE);
  return Array.from({ length: n + 1 }, (_, idx) => {
    pose(copy, clip, (clip.duration * idx) / n);
    return new THREE.Vector3().setFromMatrixPosition(node.matrixWorld);
  });
}

function extent(points, axis) {
  let [low, high] = [Infinity, -Infinity];
  for (const point of points) {
    const along = point.dot(axis);
    low = Math.min(low, along);
    high = Math.max(high, along);
  }
  return { low, high };
}

/** A tube along the way so far. It shines through what covers it, faintly. */
function trail(points, radius) {
  const curve = new THREE.CatmullRomCurve3(points);
  const geometry = new THREE.TubeGeometry(curve, points.length, radius, 8);
  const solid = new THREE.MeshBasicMaterial({ color: TRAIL_COLOR });
  const faint = new THREE.MeshBasicMaterial({ color: TRAIL_COLOR, opacity: 0.25, transparent: true, depthTest: false });
  const group = new THREE.Group();
  group.add(new THREE.Mesh(geometry, solid), new THREE.Mesh(geometry, faint));
  return group;
}

/** A target whose time has not come. */
function ghost(point, radius) {
  const material = new THREE.MeshBasicMaterial({ color: 0x18b54a, opacity: 0.35, transparent: true, depthTest: false });
  const mesh = new THREE.Mesh(new THREE.SphereGeometry(radius, 32, 16), material);
  mesh.position.copy(point);
  return mesh;
}

function label(text, center, top) {
  const line = document.createElement("div");
  line.textContent = text;
  line.style.cssText = `position: absolute; top: ${top - 2}px; left: ${center - 60}px; width: 120px; height: 34px;
    text-align: center; font: 500 21px system-ui, "DejaVu Sans", sans-serif; color: #4a545e;`;
  document.body.append(line);
}
