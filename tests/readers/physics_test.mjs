// SPDX-License-Identifier: GPL-3.0-or-later
// The physics extensions of .gltf files against their schema: physics_test.mjs SCHEMA FILE.gltf... Run from a folder with the
// packages of package.json. The Khronos validator (validator_test.mjs) does not know these extensions.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import Ajv from 'ajv/dist/2020.js';

const [schema, ...files] = process.argv.slice(2);
const valid = new Ajv({ strict: true, strictRequired: false, allErrors: true }).compile(JSON.parse(fs.readFileSync(schema)));
const names = ['KHR_implicit_shapes', 'KHR_physics_rigid_bodies', 'OMI_physics_shape', 'OMI_physics_body'];
const kinds = new Set();

/** Every reference names something that is there, every shape is used, and every extension is declared. */
function checkReferences(json) {
  const khr = json.extensions.KHR_implicit_shapes?.shapes ?? [], omi = json.extensions.OMI_physics_shape?.shapes ?? [];
  const used = [new Set(), new Set()], there = new Set(Object.keys(json.extensions));
  for (const { extensions = {} } of json.nodes) {
    Object.keys(extensions).forEach((name) => there.add(name));
    const geometry = extensions.KHR_physics_rigid_bodies?.collider?.geometry;
    const shape = extensions.OMI_physics_body?.collider?.shape;
    if (geometry?.shape !== undefined) used[0].add(geometry.shape);
    if (geometry?.node !== undefined) {
      assert.notEqual(json.nodes[geometry.node]?.mesh, undefined);
      assert.equal(geometry.convexHull, true);
      kinds.add('KHR hull');
    }
    if (shape !== undefined) used[1].add(shape);
  }
  [khr, omi].forEach((shapes, i) => assert.deepEqual([...used[i]].sort((a, b) => a - b), [...shapes.keys()]));
  khr.forEach((shape) => kinds.add(`KHR ${shape.type}`));
  omi.forEach((shape) => kinds.add(`OMI ${shape.type}`));
  omi.filter((shape) => shape.convex).forEach((shape) => assert(json.meshes[shape.convex.mesh]));
  assert.deepEqual(names.filter((name) => there.has(name)), names.filter((name) => json.extensionsUsed.includes(name)));
  const rotations = json.nodes.flatMap(({ extensions = {} }) =>
    [extensions.KHR_physics_rigid_bodies, extensions.OMI_physics_body].map((body) => body?.motion?.inertiaOrientation));
  rotations.filter(Boolean).forEach((q) => assert(Math.abs(Math.hypot(...q) - 1) < 1e-6));
}

/** The schema refuses each of these: a change of the first body, collider or shape of its kind. */
function checkRefusals(json) {
  const changes = [
    (file) => { file.extensions.KHR_implicit_shapes.shapes[0].type = 'cone'; },
    (file) => { file.extensions.KHR_implicit_shapes.shapes[0].extra = 1; },
    (file) => { file.nodes.find((node) => node.extensions?.KHR_physics_rigid_bodies?.motion).extensions.KHR_physics_rigid_bodies.motion.mass = -1; },
    (file) => { file.nodes.find((node) => node.extensions?.OMI_physics_body?.motion).extensions.OMI_physics_body.motion.type = 'rigid'; },
    (file) => { file.nodes.find((node) => node.extensions?.OMI_physics_body?.collider).extensions.OMI_physics_body.collider = {}; },
    (file) => { file.nodes.find((node) => node.extensions?.KHR_physics_rigid_bodies?.collider).extensions.KHR_physics_rigid_bodies.collider.geometry = {}; },
  ];
  for (const change of changes) {
    const changed = structuredClone(json);
    change(changed);
    assert(!valid(changed), String(change));
  }
}

for (const file of files) {
  const json = JSON.parse(fs.readFileSync(file));
  assert(valid(json), `${file}: ${JSON.stringify(valid.errors, null, 1)}`);
  checkReferences(json);
  if (names.every((name) => json.extensionsUsed.includes(name))) checkRefusals(json);
}
// A capsule of OMI has equal radii, which no model here has (tests/io/gltf/gltf_colliders_test.c).
for (const kind of ['KHR sphere', 'KHR capsule', 'KHR hull', 'OMI sphere', 'OMI convex']) assert(kinds.has(kind), `no ${kind}`);
console.log(`ok physics: ${files.length} files`);
