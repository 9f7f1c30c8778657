// SPDX-License-Identifier: GPL-3.0-or-later
// The ES module in three.js, Babylon.js and glTF-Transform, and the golden files against the JSON Schema:
// js_loaders_test.mjs FOLDER_OF_READERS. Run from a folder with the packages of package.json.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import Ajv from 'ajv/dist/2020.js';
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { NullEngine, Scene, LoadAssetContainerAsync } from '@babylonjs/core/pure.js';
import { registerGLTFExtension } from '@babylonjs/loaders/glTF/2.0/index.js';
import * as core from '@gltf-transform/core';
import { checkMedial, eachGolden } from './js_test.mjs';

globalThis.self ??= globalThis; // GLTFLoader asks it for URL
const folder = process.argv[2], reader = await import(pathToFileURL(path.join(folder, 'qmat_reader.mjs')));

// The JSON Schema holds for all golden files and not for broken ones.
const valid = new Ajv().compile(JSON.parse(fs.readFileSync(path.join(folder, 'qmat_extras.schema.json'))));
await eachGolden(folder, (name, file, expected, json) => {
  const extras = json.nodes[0].extras;
  assert(valid(extras), JSON.stringify(valid.errors));
  const names = Object.keys(JSON.parse(fs.readFileSync(path.join(folder, 'qmat_extras.schema.json'))).properties);
  Object.keys(extras).forEach((key) => assert(names.includes(key), `${key} is not in the schema`));
  assert(!valid({ ...extras, qmat_vertices: 0 }));
  assert(!valid({ ...extras, qmat_flat: 'not base64' }));
  assert(!valid({ ...extras, qmat_data: undefined, qmat_flat: undefined }));
});

// three.js
const loader = new GLTFLoader();
loader.register(() => new reader.ThreePlugin());
await eachGolden(folder, async (name, file, expected) => {
  const bytes = fs.readFileSync(file), data = name.endsWith('.glb') ? new Uint8Array(bytes).buffer : bytes.toString();
  const gltf = await loader.parseAsync(data, '');
  const found = [];
  gltf.scene.traverse((object) => object.medial && found.push(object));
  assert.equal(found.length, 1);
  assert.equal(found[0].isMesh === true, name === 'shown.glb');
  checkMedial(found[0].medial, expected);
  // What it shows is nowhere outside of the envelope by more than rounding to single precision.
  const group = reader.threeGroup(THREE, found[0].medial), point = new THREE.Vector3();
  assert.equal(group.children[0].count, expected.spheres.length);
  group.updateMatrixWorld(true);
  let farthest = 0;
  for (const mesh of group.children.slice(1)) {
    const position = mesh.geometry.getAttribute('position');
    for (let i = 0; i < position.count; i++) {
      point.fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld);
      farthest = Math.max(farthest, reader.distance(found[0].medial, point.toArray()).distance);
    }
  }
  assert(farthest < 1e-5 * expected.size, `${name}: ${farthest}`);
});
console.log('ok three.js');

// Babylon.js
registerGLTFExtension('QMAT_medial', false, reader.babylonExtension);
const scene = new Scene(new NullEngine());
await eachGolden(folder, async (name, file, expected) => {
  const bytes = fs.readFileSync(file), data = name.endsWith('.glb') ? new Uint8Array(bytes) : `data:${bytes}`;
  const container = await LoadAssetContainerAsync(data, scene, { pluginExtension: path.extname(file) });
  const found = [...container.transformNodes, ...container.meshes].filter((node) => node.metadata?.medial);
  assert.equal(found.length, 1);
  checkMedial(found[0].metadata.medial, expected);
  container.dispose();
});
console.log('ok Babylon.js');

// glTF-Transform: what it writes has the same medial mesh, and the physics of a file with a node removed before others.
const physics = {
  asset: { version: '2.0' },
  scene: 0,
  scenes: [{ nodes: [0, 1, 3] }],
  nodes: [
    { name: 'goes' },
    { name: 'body', children: [2], extensions: { KHR_physics_rigid_bodies: { motion: { mass: 2 },
      trigger: { nodes: [2, 3] }, joint: { connectedNode: 3, joint: 0 } } } },
    { name: 'collider', extensions: { KHR_physics_rigid_bodies: { collider: { geometry: { shape: 1 }, physicsMaterial: 0 } } } },
    { name: 'hull', extensions: { KHR_physics_rigid_bodies: { collider: { geometry: { node: 2, convexHull: true } } } } },
  ],
  extensionsUsed: ['KHR_implicit_shapes', 'KHR_physics_rigid_bodies'],
  extensions: {
    KHR_implicit_shapes: { shapes: [{ type: 'sphere', sphere: { radius: 1 } },
      { type: 'capsule', capsule: { height: 1, radiusBottom: 0.5, radiusTop: 0.25 } }] },
    KHR_physics_rigid_bodies: { physicsMaterials: [{ staticFriction: 0.5 }], physicsJoints: [{ limits: [] }] },
  },
};
const io = new core.NodeIO().registerExtensions(reader.physicsExtensions(core));
await eachGolden(folder, async (name, file, expected) => {
  const document = await io.read(file), again = await io.readBinary(await io.writeBinary(document));
  checkMedial(reader.ofExtras(again.getRoot().listNodes()[0].getExtras()), expected);
});
const document = await io.readJSON({ json: structuredClone(physics), resources: {} });
document.getRoot().listNodes()[0].dispose();
const { json } = await io.writeJSON(document);
assert.deepEqual(json.extensions, physics.extensions);
assert.deepEqual(new Set(json.extensionsUsed), new Set(physics.extensionsUsed));
assert.deepEqual(json.nodes.map((node) => node.name), ['body', 'collider', 'hull']);
const bodies = json.nodes.map((node) => node.extensions.KHR_physics_rigid_bodies);
assert.deepEqual(bodies[0], { motion: { mass: 2 }, trigger: { nodes: [1, 2] }, joint: { connectedNode: 2, joint: 0 } });
assert.deepEqual(bodies[1], physics.nodes[2].extensions.KHR_physics_rigid_bodies);
assert.deepEqual(bodies[2], { collider: { geometry: { node: 1, convexHull: true } } });
console.log('ok glTF-Transform');
