// SPDX-License-Identifier: GPL-3.0-or-later
// What bodies get from qmat_physics.mjs, whatever the scale of their nodes: motion_test.mjs FOLDER_OF_READERS
import assert from 'node:assert/strict';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const { bodiesOf, addToRapier } = await import(pathToFileURL(path.join(process.argv[2], 'qmat_physics.mjs')));

/** An engine that only remembers what it is given. */
function recorder() {
  const got = {}, collider = new Proxy({}, { get: (_, name, self) => (name === 'then' ? undefined : () => self) });
  const desc = new Proxy({}, { get: (_, name, self) => (...values) => { got[name] = values; return self; } });
  const engine = {
    RigidBodyDesc: { dynamic: () => desc, fixed: () => desc, kinematicPositionBased: () => desc },
    ColliderDesc: { ball: (radius) => { got.radius = radius; return collider; } },
  };
  return { got, engine, world: { createRigidBody: () => ({}), createCollider: () => ({}) } };
}

/** A solid ball of 2 kg and 0.5 m: 0.2 kg m^2. Its node is in units of `meters`. */
function ball(meters, motion) {
  const physics = { KHR_physics_rigid_bodies: { motion } };
  const shape = { extensions: { KHR_physics_rigid_bodies: { collider: { geometry: { shape: 0 } } } } };
  return { json: {
    nodes: [{ scale: [meters, meters, meters], children: [1], extensions: physics }, shape],
    extensions: { KHR_implicit_shapes: { shapes: [{ type: 'sphere', sphere: { radius: 0.5 / meters } }] } },
  } };
}

for (const meters of [1, 0.001, 25]) {
  const { got, engine, world } = recorder();
  const [body] = bodiesOf(ball(meters, { mass: 2, centerOfMass: [0, 0, 0], inertiaDiagonal: [0.2, 0.2, 0.2] }));
  addToRapier(engine, world, body, { scale: meters });
  const [mass, , inertia] = got.setAdditionalMassProperties;
  assert.equal(mass, 2);
  assert(Math.abs(got.radius - 0.5) < 1e-9);
  for (const k of ['x', 'y', 'z']) assert(Math.abs(inertia[k] - 0.2) < 1e-9, `in units of ${meters} m: ${inertia[k]}`);
}
const { got, engine, world } = recorder();
addToRapier(engine, world, bodiesOf(ball(1, { isKinematic: true }))[0]);
assert.equal(got.setAdditionalMassProperties, undefined);
console.log('ok motion');
