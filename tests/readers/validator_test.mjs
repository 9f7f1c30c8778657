// SPDX-License-Identifier: GPL-3.0-or-later
// The Khronos validator on .glb files with colliders: validator_test.mjs FILE.glb... Run from a folder with the packages of
// package.json. It does not know the extensions of physics (physics_test.mjs); all else is to have no error and no warning.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import validator from 'gltf-validator';

const issuesOf = async (bytes) => (await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 0 })).issues;

const files = process.argv.slice(2);
assert(files.length > 0);
for (const file of files) {
  const bytes = fs.readFileSync(file);
  const { numErrors, numWarnings, messages } = await issuesOf(bytes);
  assert.equal(numErrors + numWarnings, 0, `${file}: ${JSON.stringify(messages.filter(({ severity }) => severity < 2), null, 1)}`);
  const extensions = messages.filter(({ code }) => code === 'UNSUPPORTED_EXTENSION').map(({ message }) => message.match(/'(.*)'/)[1]);
  for (const name of ['KHR_physics_rigid_bodies', 'OMI_physics_body']) assert(extensions.includes(name), `${file} has no ${name}`);

  // It finds the last hull or mesh damaged: a vertex beyond the largest that its accessor names.
  const length = bytes.readUInt32LE(12), json = JSON.parse(bytes.subarray(20, 20 + length));
  const { POSITION } = json.meshes.at(-1).primitives[0].attributes, { byteOffset = 0, bufferView } = json.accessors[POSITION];
  bytes.writeFloatLE(1e9, 28 + length + (json.bufferViews[bufferView].byteOffset ?? 0) + byteOffset);
  assert((await issuesOf(bytes)).numErrors > 0, `${file}: damage is not found`);
}
console.log(`ok validator: ${files.length} files`);
