// SPDX-License-Identifier: GPL-3.0-or-later
// The scene of upright_test.sh in three.js: upright_test.mjs FILE.glb FOLDER_OF_READERS. Metres, y up, USD's y is -z.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

globalThis.self ??= globalThis; // GLTFLoader asks it for URL
const reader = await import(pathToFileURL(path.join(process.argv[3], 'qmat_reader.mjs')));
const loader = new GLTFLoader();
loader.register(() => new reader.ThreePlugin());
const gltf = await loader.parseAsync(new Uint8Array(fs.readFileSync(process.argv[2])).buffer, '');
gltf.scene.updateMatrixWorld(true);
const expected = new THREE.Box3(new THREE.Vector3(-0.5, 0, -5.5), new THREE.Vector3(2.5, 3, 0.2));
const near = (box, what) => {
  // 2 % of a body of 3.2 m is 6.4 cm.
  const off = Math.max(box.min.distanceTo(expected.min), box.max.distanceTo(expected.max));
  assert(off < 0.07 * Math.sqrt(3), `${what}: ${JSON.stringify(box)}`);
};
near(new THREE.Box3().setFromObject(gltf.scene), 'the meshes');
const spheres = new THREE.Box3();
let count = 0;
gltf.scene.traverse((object) => {
  if (!object.medial) return;
  count++;
  const scale = object.matrixWorld.getMaxScaleOnAxis(), centre = new THREE.Vector3();
  for (let i = 0; i < object.medial.spheres.length; i += 4) {
    const s = object.medial.spheres.subarray(i, i + 4);
    centre.set(s[0], s[1], s[2]).applyMatrix4(object.matrixWorld);
    for (const side of [-1, 1]) spheres.expandByPoint(centre.clone().addScalar(side * s[3] * scale));
  }
});
assert.equal(count, 2);
near(spheres, 'the medial spheres');
console.log('ok three.js');
