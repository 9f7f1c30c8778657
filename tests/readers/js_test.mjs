// SPDX-License-Identifier: GPL-3.0-or-later
// The ES module against the golden files and 10,000 mutations of each: js_test.mjs FOLDER_OF_READERS
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

/** The JSON of a .glb or .gltf file. */
export function jsonOf(file) {
  const bytes = fs.readFileSync(file);
  return JSON.parse(file.endsWith('.glb') ? bytes.subarray(20, 20 + bytes.readUInt32LE(12)) : bytes);
}

const rows = (list, width) => Array.from({ length: list.length / width }, (_, i) => Array.from(list.slice(width * i, width * (i + 1))));

/** What a reader decoded is what is expected of it. */
export function checkMedial(medial, expected) {
  const spheres = rows(medial.spheres, 4);
  assert.equal(spheres.length, expected.spheres.length);
  spheres.forEach((sphere, i) => {
    const d = sphere.map((x, k) => x - expected.spheres[i][k]);
    assert(Math.hypot(d[0], d[1], d[2]) + Math.abs(d[3]) <= expected.within * (1 + 1e-9), `sphere ${i}`);
  });
  assert.deepEqual(rows(medial.slabs, 3), expected.slabs);
  assert.deepEqual(rows(medial.cones, 2), expected.cones);
  assert.deepEqual(rows(medial.points, 1), expected.points);
  assert.equal(!medial.errors, !expected.errors);
  expected.errors?.forEach((error, i) => {
    assert(medial.errors[i] >= error + expected.within * (1 - 1e-9) && medial.errors[i] < error + 1.1 * expected.within + 1e-6);
  });
  if (expected.joints) assert.deepEqual(rows(medial.joints, 4), expected.joints);
  expected.weights?.flat().forEach((weight, i) => assert(Math.abs(medial.weights[i] - weight) < 1e-4));
}

function checkAnswers(reader, medial, expected) {
  const near = 1e-9 * expected.size, same = (a, b, what) => assert(Math.abs(a - b) <= near, `${what}: ${a}, not ${b}`);
  const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
  expected.distances.forEach(({ point, distance }, i) => {
    const found = reader.distance(medial, point);
    same(found.distance, distance, `distance ${i}`);
    same(Math.hypot(...point.map((x, k) => x - found.closest[k])), Math.abs(distance), `closest point ${i}`);
    if (distance > 0) same(reader.distance(medial, found.closest).distance, 0, `distance of closest point ${i}`);
  });
  expected.supports.forEach(({ direction, distance }, i) => {
    const found = reader.support(medial, direction);
    same(found.distance, distance, `support ${i}`);
    same(dot(found.point, direction), distance, `support point ${i}`);
  });
  expected.rays.forEach(({ origin, direction, distance }, i) => {
    const found = reader.ray(medial, origin, direction, 8 * expected.size);
    if (distance === null) return assert.equal(found, null, `ray ${i}`);
    same(found.distance, distance, `ray ${i}`);
    assert(Math.abs(dot(found.normal, found.normal) - 1) < 1e-9);
    assert(found.distance === 0 || dot(found.normal, direction) <= 0, `normal ${i}`);
    if (found.distance > near) assert.equal(reader.ray(medial, origin, direction, found.distance - near), null);
  });
}

function mutate(reader, blob) {
  let state = 1, decoded = 0;
  const next = (below) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor((state / 2 ** 32) * below);
  };
  for (let i = 0; i < 10000; i++) {
    const size = Math.max(next(4) ? blob.length : next(blob.length), next(8) ? 0 : blob.length + next(16));
    const bytes = new Uint8Array(size);
    bytes.set(blob.subarray(0, size));
    for (let edits = next(6); edits > 0 && size > 0; edits--) bytes[next(next(2) ? size : Math.min(size, 64))] = next(256);
    let medial = null;
    try {
      medial = reader.decode(i % 2 ? bytes : btoa(String.fromCharCode(...bytes)));
    } catch (error) {
      assert.equal(error.constructor, Error, error.stack);
    }
    if (!medial) continue;
    decoded++;
    if (i % 10) continue;
    assert(!Number.isNaN(reader.distance(medial, [0.5, -1, 2]).distance));
    assert(!Number.isNaN(reader.support(medial, [0.6, 0, -0.8]).distance));
    assert(!Number.isNaN(reader.ray(medial, [0.5, -1, 2], [0.6, 0, -0.8])?.distance ?? 0));
  }
  assert(decoded > 500 && decoded < 9500, `${decoded} of 10,000 mutations can be decoded`);
}

/** Calls test(name, file, expected, json) for every golden file. */
export async function eachGolden(folder, test) {
  const golden = path.join(folder, 'golden'), names = fs.readdirSync(golden).filter((name) => /\.(glb|gltf)$/.test(name));
  assert(names.length >= 6);
  for (const name of names) {
    const file = path.join(golden, name);
    const expected = JSON.parse(fs.readFileSync(file.replace(/\.\w+$/, '.expected.json')));
    await test(name, file, expected, jsonOf(file));
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const folder = process.argv[2], reader = await import(pathToFileURL(path.join(folder, 'qmat_reader.mjs')));
  await eachGolden(folder, (name, file, expected, json) => {
    const medial = reader.ofExtras(json.nodes[0].extras);
    checkMedial(medial, expected);
    checkAnswers(reader, medial, expected);
    mutate(reader, new Uint8Array(Buffer.from(json.nodes[0].extras.qmat_flat, 'base64')));
    console.log(`ok ${name}`);
  });
  assert.equal(reader.ofExtras({}), null);
  assert.equal(reader.ofExtras(undefined), null);
}
