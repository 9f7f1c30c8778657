// SPDX-FileCopyrightText: 2026 the qmat authors
// SPDX-License-Identifier: MIT
//
// Assets that the build made fall, roll and collide: three.js draws them, Rapier moves them, and their colliders come from
// the glTF files. `?seconds=4` simulates so long before the first picture, and stops there.
import RAPIER from '@dimforge/rapier3d-compat';
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { addToRapier, bodiesOf, openGlb } from '/readers/qmat_physics.mjs';

const COPIES = 30, STEP = 1 / 60;
const colours = [0xd9a441, 0x5b8db8, 0xb85b6a, 0x6aa86f, 0x8d74b0];

const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.shadowMap.enabled = true;
document.body.append(renderer.domElement);
const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(40, 1, 0.1, 100);
scene.background = new THREE.Color(0xdfe6ee);
camera.position.set(3.6, 3, 5);
const controls = new OrbitControls(camera, renderer.domElement);
controls.target.set(-0.9, 0.6, 0.2);
controls.update();
const sun = new THREE.DirectionalLight(0xffffff, 2.4);
sun.position.set(4, 9, 3);
sun.castShadow = true;
sun.shadow.mapSize.set(2048, 2048);
Object.assign(sun.shadow.camera, { left: -6, right: 6, top: 6, bottom: -6 });
scene.add(sun, new THREE.HemisphereLight(0xffffff, 0x8899aa, 1.2));

await RAPIER.init();
const world = new RAPIER.World({ x: 0, y: -9.81, z: 0 });
world.timestep = STEP;

/** A box that does not move, with its collider. */
function addBox(at, half, colour) {
  const mesh = new THREE.Mesh(new THREE.BoxGeometry(...half.map((v) => 2 * v)), new THREE.MeshStandardMaterial({ color: colour }));
  mesh.position.set(...at);
  mesh.receiveShadow = mesh.castShadow = true;
  scene.add(mesh);
  world.createCollider(RAPIER.ColliderDesc.cuboid(...half).setTranslation(...at).setFriction(0.7));
}
addBox([0, -0.5, 0], [20, 0.5, 20], 0xc9d2da);
for (let i = 0; i < 5; i++) addBox([-1.2 - 0.6 * i, 0.2 * (i + 1), 0], [0.3, 0.2 * (i + 1), 1.6], 0xaab6c2);

/** An asset: what is drawn, its first body that moves, and the scale that makes its diagonal 1. */
async function load(name) {
  const bytes = await (await fetch(`/assets/${encodeURIComponent(name)}`)).arrayBuffer();
  const gltf = await new GLTFLoader().parseAsync(bytes, '');
  const body = bodiesOf(openGlb(bytes)).find((one) => one.motion);
  const box = new THREE.Box3().setFromObject(gltf.scene), scale = 1 / box.getSize(new THREE.Vector3()).length();
  return { name, view: gltf.scene, body, scale };
}

/** The colliders of a body as lines. */
function shapesOf(body, scale) {
  const group = new THREE.Group(), material = new THREE.MeshBasicMaterial({ color: 0x204060, wireframe: true });
  for (const shape of body.shapes) {
    for (const [x, y, z, r] of shape.ends ?? (shape.radius ? [[...shape.center, shape.radius]] : [])) {
      const ball = new THREE.Mesh(new THREE.IcosahedronGeometry(r * scale, 1), material);
      ball.position.set(x * scale, y * scale, z * scale);
      group.add(ball);
    }
    if (!shape.points) continue;
    const dots = new THREE.BufferGeometry().setFromPoints(shape.points.map((p) => new THREE.Vector3(...p).multiplyScalar(scale)));
    group.add(new THREE.Points(dots, new THREE.PointsMaterial({ color: 0x204060, size: 0.02 })));
  }
  return group;
}

const assets = await Promise.all((await (await fetch('/assets.json')).json()).map(load));
const moving = [];
for (let i = 0; i < COPIES; i++) {
  const { view, body, scale } = assets[i % assets.length], holder = new THREE.Group(), copy = view.clone(true);
  copy.scale.setScalar(scale);
  copy.traverse((object) => {
    if (!object.isMesh) return;
    object.material = new THREE.MeshStandardMaterial({ color: colours[i % colours.length], roughness: 0.55 });
    object.castShadow = object.receiveShadow = true;
  });
  const shapes = shapesOf(body, scale);
  shapes.visible = false;
  holder.add(copy, shapes);
  scene.add(holder);
  const turn = new THREE.Quaternion().setFromEuler(new THREE.Euler(i, 2 * i, 3 * i));
  const at = [-3.2 + 1.1 * (i % 5), 2.6 + 0.9 * Math.floor(i / 5), (i % 3) - 1];
  moving.push({ holder, shapes, view: copy, rigid: addToRapier(RAPIER, world, body, { at, rotation: turn.toArray(), scale }) });
}

const box = document.querySelector('#shapes');
const show = () => moving.forEach(({ shapes, view }) => ([shapes.visible, view.visible] = [box.checked, !box.checked]));
box.addEventListener('change', show);

function draw() {
  for (const { holder, rigid } of moving) {
    holder.position.copy(rigid.translation());
    holder.quaternion.copy(rigid.rotation());
  }
  renderer.setSize(innerWidth, innerHeight);
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  renderer.render(scene, camera);
}

const seconds = Number(new URLSearchParams(location.search).get('seconds') ?? 0);
for (let t = 0; t < seconds; t += STEP) world.step();
draw();
window.bodies = moving.map(({ rigid }) => rigid); // to look at in the console
const heights = moving.map(({ rigid }) => rigid.translation().y);
document.title = `${moving.length} bodies, the lowest at ${Math.min(...heights).toFixed(2)}`;
if (!seconds) {
  renderer.setAnimationLoop(() => {
    world.step();
    draw();
  });
}
