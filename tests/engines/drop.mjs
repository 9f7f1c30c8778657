// SPDX-License-Identifier: GPL-3.0-or-later
// Drops the colliders of glTF files on a plane and down a staircase, in Rapier, Jolt and Bullet, for ten seconds each:
//   node drop.mjs READERS FILE.glb SURFACE [FILE.glb SURFACE...]
// A line a file; exit 1 unless every body stays finite and slow enough, no vertex of the surface gets below what is under
// it, and the surface ends within 1 % of its diagonal of what it lies on.
import { readFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import RAPIER from '@dimforge/rapier3d-compat';
import initAmmo from 'ammojs-typed';
import initJolt from 'jolt-physics';
import { surfaceOf } from './surface.mjs';

const [readers, ...files] = process.argv.slice(2);
const { openGlb, bodiesOf, moved, addToRapier, addToJolt, addToBullet } = await import(pathToFileURL(`${readers}/qmat_physics.mjs`));
await RAPIER.init();
const Jolt = await initJolt();
const Ammo = await initAmmo.call({});

const STEP = 1 / 120, SECONDS = 10, GRAVITY = 9.81;
const TREADS = 5, DEPTH = 0.5, RISE = 0.2;
// All in diagonals of the model. A staircase goes down along x to a floor at 0.
const scenes = {
  plane: { boxes: [{ at: [0, -1, 0], half: [50, 1, 50] }], start: [0, 1, 0], push: 0 },
  stairs: {
    boxes: [{ at: [0, -1, 0], half: [50, 1, 50] }, ...Array.from({ length: TREADS }, (_, i) => (
      { at: [-DEPTH * (i + 0.5), RISE * (i + 1) / 2, 0], half: [DEPTH / 2, RISE * (i + 1) / 2, 4] }))],
    start: [-DEPTH * (TREADS - 0.5), RISE * TREADS + 1, 0], push: 0.6,
  },
};

/** The height of what is under a point. */
function ground(boxes, [x, , z]) {
  return boxes.reduce((top, { at, half }) =>
    (Math.abs(x - at[0]) <= half[0] && Math.abs(z - at[2]) <= half[2] ? Math.max(top, at[1] + half[1]) : top), -Infinity);
}

/** The distance from a point to a box; below 0 inside. */
function toBox(p, { at, half }) {
  const d = p.map((v, k) => Math.abs(v - at[k]) - half[k]);
  return Math.hypot(...d.map((v) => Math.max(v, 0))) + Math.min(Math.max(...d), 0);
}

/** The gradient of toBox. */
function awayFrom(p, { at, half }) {
  const d = p.map((v, k) => Math.abs(v - at[k]) - half[k]), most = Math.max(...d), sign = p.map((v, k) => (v < at[k] ? -1 : 1));
  if (most <= 0) return d.map((v, k) => (k === d.indexOf(most) ? sign[k] : 0));
  const length = Math.hypot(...d.map((v) => Math.max(v, 0)));
  return d.map((v, k) => (sign[k] * Math.max(v, 0)) / length);
}

/** The distance from triangles to boxes, to 1e-4: edges of boxes may meet triangles far from a vertex. The distance to a
 * box is convex, so a triangle is halved until the tangent at its middle shows that no point of it is nearer. */
function gapOf({ points, rows }, boxes) {
  const minus = (p, q) => [0, 1, 2].map((k) => p[k] - q[k]), middle = (p, q) => [0, 1, 2].map((k) => (p[k] + q[k]) / 2);
  const dot = (p, q) => p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
  let best = Infinity;
  for (const box of boxes) {
    for (const row of rows) for (const id of row) best = Math.min(best, toBox(points[id], box));
    const stack = rows.map((row) => row.map((id) => points[id]));
    while (stack.length > 0) {
      const corners = stack.pop(), at = [0, 1, 2].map((k) => (corners[0][k] + corners[1][k] + corners[2][k]) / 3);
      const value = toBox(at, box), slope = awayFrom(at, box);
      best = Math.min(best, value);
      if (value + Math.min(...corners.map((p) => dot(slope, minus(p, at)))) >= best - 1e-4) continue;
      const sides = [0, 1, 2].map((k) => minus(corners[(k + 1) % 3], corners[k])).map((d) => dot(d, d));
      const k = sides.indexOf(Math.max(...sides)), [a, b, c] = [0, 1, 2].map((i) => corners[(k + i) % 3]), m = middle(a, b);
      stack.push([a, m, c], [m, b, c]);
    }
  }
  return best;
}

const engines = {
  rapier(scene, body, scale, at) {
    const world = new RAPIER.World({ x: 0, y: -GRAVITY, z: 0 });
    world.timestep = STEP;
    for (const { at: p, half } of scene.boxes) {
      const floor = world.createRigidBody(RAPIER.RigidBodyDesc.fixed().setTranslation(...p));
      world.createCollider(RAPIER.ColliderDesc.cuboid(...half).setFriction(0.7), floor);
    }
    const made = addToRapier(RAPIER, world, body, { at, scale });
    made.setAngularDamping(0.8);
    made.setLinvel({ x: scene.push, y: 0, z: 0 }, true);
    return {
      step: () => world.step(),
      pose: () => [made.translation(), made.rotation()],
      speed: () => Math.hypot(...Object.values(made.linvel())),
      free: () => world.free(),
    };
  },
  jolt(scene, body, scale, at) {
    const settings = new Jolt.JoltSettings(), pairs = new Jolt.ObjectLayerPairFilterTable(2);
    settings.mMaxWorkerThreads = 1;
    pairs.EnableCollision(0, 1);
    const broad = new Jolt.BroadPhaseLayerInterfaceTable(2, 2);
    for (const i of [0, 1]) broad.MapObjectToBroadPhaseLayer(i, new Jolt.BroadPhaseLayer(i));
    settings.mObjectLayerPairFilter = pairs;
    settings.mBroadPhaseLayerInterface = broad;
    settings.mObjectVsBroadPhaseLayerFilter = new Jolt.ObjectVsBroadPhaseLayerFilterTable(broad, 2, pairs, 2);
    const jolt = new Jolt.JoltInterface(settings), system = jolt.GetPhysicsSystem();
    const physics = system.GetPhysicsSettings(), bodies = system.GetBodyInterface();
    physics.mPenetrationSlop = 0.002; // its default, 2 cm, is for lengths in metres
    system.SetPhysicsSettings(physics);
    for (const { at: p, half } of scene.boxes) {
      const box = new Jolt.BodyCreationSettings(new Jolt.BoxShape(new Jolt.Vec3(...half), 0.001), new Jolt.RVec3(...p),
        new Jolt.Quat(0, 0, 0, 1), Jolt.EMotionType_Static, 0);
      box.mFriction = 0.7;
      bodies.AddBody(bodies.CreateBody(box).GetID(), Jolt.EActivation_DontActivate);
    }
    const made = addToJolt(Jolt, system, body, { at, scale });
    made.GetMotionProperties().SetAngularDamping(0.8);
    made.SetLinearVelocity(new Jolt.Vec3(scene.push, 0, 0));
    const three = (v) => ({ x: v.GetX(), y: v.GetY(), z: v.GetZ() });
    return {
      step: () => jolt.Step(STEP, 1),
      pose: () => [three(made.GetPosition()), { ...three(made.GetRotation()), w: made.GetRotation().GetW() }],
      speed: () => made.GetLinearVelocity().Length(),
      free: () => Jolt.destroy(jolt),
    };
  },
  bullet(scene, body, scale, at) {
    const config = new Ammo.btDefaultCollisionConfiguration();
    const world = new Ammo.btDiscreteDynamicsWorld(new Ammo.btCollisionDispatcher(config), new Ammo.btDbvtBroadphase(),
      new Ammo.btSequentialImpulseConstraintSolver(), config);
    world.setGravity(new Ammo.btVector3(0, -GRAVITY, 0));
    for (const { at: p, half } of scene.boxes) {
      const place = new Ammo.btTransform(new Ammo.btQuaternion(0, 0, 0, 1), new Ammo.btVector3(...p));
      const box = new Ammo.btBoxShape(new Ammo.btVector3(...half));
      box.setMargin(0.001);
      const info = new Ammo.btRigidBodyConstructionInfo(0, new Ammo.btDefaultMotionState(place), box, new Ammo.btVector3(0, 0, 0));
      info.set_m_friction(0.7);
      world.addRigidBody(new Ammo.btRigidBody(info));
    }
    const { body: made, pose } = addToBullet(Ammo, world, body, { at, scale });
    made.setDamping(0, 0.8);
    // Its default, 0.8 m/s and 1 rad/s, stops bodies of a metre that still roll. Below 0.2 m/s a capsule that touches a
    // riser rolls along it without end: Bullet's friction has one direction for each contact.
    made.setSleepingThresholds(0.2, 1);
    made.setLinearVelocity(new Ammo.btVector3(scene.push, 0, 0));
    return {
      step: () => world.stepSimulation(STEP, 0),
      pose: () => pose().map(([x, y, z, w]) => ({ x, y, z, w })),
      speed: () => made.getLinearVelocity().length(),
      free: () => Ammo.destroy(world),
    };
  },
};

function matrixOf({ x: px, y: py, z: pz }, { x, y, z, w }) {
  return [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0, 2 * (x * y - z * w), 1 - 2 * (x * x + z * z),
    2 * (y * z + x * w), 0, 2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0, px, py, pz, 1];
}

/** What went wrong, and how far the surface ends from what it lies on. */
function drop(start, name, body, surface, scale) {
  const every = Math.ceil(surface.points.length / 4000), points = surface.points.filter((_, k) => k % every === 0);
  const scene = scenes[name], low = Math.min(...points.map((p) => p[1]));
  const centre = [0, 1, 2].map((k) => (Math.min(...points.map((p) => p[k])) + Math.max(...points.map((p) => p[k]))) / 2);
  const at = [scene.start[0] - centre[0], scene.start[1] - low - 0.5, scene.start[2] - centre[2]];
  const run = start(scene, body, scale, at), most = 1.2 * Math.sqrt(2 * GRAVITY * 3);
  let deepest = 0;
  const check = () => {
    const m = matrixOf(...run.pose());
    let gap = Infinity;
    for (const point of points) {
      const p = moved(m, point);
      const near = Math.min(...scene.boxes.map((box) => toBox(p, box)));
      if (!Number.isFinite(near)) return NaN;
      gap = Math.min(gap, near);
    }
    deepest = Math.max(deepest, -gap);
    return gap;
  };
  for (let i = 0; i < SECONDS / STEP; i++) {
    run.step();
    if (!(run.speed() < most)) return { wrong: `explodes after ${(i * STEP).toFixed(2)} s`, gap: NaN };
    if (i % 30 === 0 && Number.isNaN(check())) return { wrong: 'is no number', gap: NaN };
  }
  const [place, turn] = run.pose(), m = matrixOf(place, turn), speed = run.speed();
  const gap = gapOf({ points: surface.points.map((p) => moved(m, p)), rows: surface.rows }, scene.boxes);
  run.free();
  const wrong = deepest > 0.02 ? `sinks by ${(100 * deepest).toFixed(1)} %` : Math.abs(gap) > 0.01 ? `${gap > 0 ? 'hovers' : 'lies deep'} by ${(100 * Math.abs(gap)).toFixed(2)} %` :
    speed > 0.05 ? `still moves at ${speed.toFixed(2)}` : ground(scene.boxes, [place.x, 0, place.z]) === -Infinity ? 'is gone' : null;
  return { wrong, gap };
}

let failures = 0;
for (let i = 0; i + 1 < files.length; i += 2) {
  const file = openGlb(readFileSync(files[i])), [body] = bodiesOf(file).filter((one) => one.motion);
  const surface = surfaceOf(files[i + 1]), spans = [0, 1, 2].map((k) => {
    let [low, high] = [Infinity, -Infinity];
    for (const p of surface.points) [low, high] = [Math.min(low, p[k]), Math.max(high, p[k])];
    return high - low;
  });
  const scale = 1 / Math.hypot(...spans);
  surface.points = surface.points.map((p) => p.map((v) => scale * v));
  const kinds = [(s) => s.radius, (s) => s.ends, (s) => s.points].map((is) => body?.shapes.filter(is).length);
  const cells = [];
  for (const engine of Object.keys(engines)) for (const scene of Object.keys(scenes)) {
    let result;
    try {
      if (!body) throw new Error('no body that moves');
      result = drop(engines[engine], scene, body, surface, scale);
    } catch (error) {
      result = { wrong: error.message ?? String(error), gap: NaN };
    }
    if (result.wrong) failures++;
    cells.push(`${engine} ${scene} ${result.wrong ?? `${(100 * result.gap).toFixed(2)} %`}`);
  }
  console.log(`${files[i]}: ${kinds[0]} spheres, ${kinds[1]} capsules, ${kinds[2]} hulls: ${cells.join('; ')}`);
}
process.exit(failures > 0 ? 1 : 0);
