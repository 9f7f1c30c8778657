// SPDX-License-Identifier: GPL-3.0-or-later
import { readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';

const types = { 5121: ['Uint8', 1], 5123: ['Uint16', 2], 5125: ['Uint32', 4], 5126: ['Float32', 4] };

/** The triangles of the only mesh of a glTF file, in its own space. */
function surfaceOfGltf(path, bytes) {
  const isGlb = path.endsWith('.glb'), length = isGlb ? bytes.readUInt32LE(12) : bytes.length;
  const json = JSON.parse((isGlb ? bytes.subarray(20, 20 + length) : bytes).toString('utf8')), points = [], rows = [];
  if (json.meshes?.length !== 1 || json.extensionsRequired) throw new Error(`${path}: only files of one plain mesh are read`);
  const buffers = json.buffers.map(({ uri }) => (uri === undefined ? bytes.subarray(28 + length) :
    uri.startsWith('data:') ? Buffer.from(uri.replace(/^[^,]*,/, ''), 'base64') : readFileSync(join(dirname(path), decodeURI(uri)))));
  const numbersOf = ({ bufferView, byteOffset = 0, componentType, count }, width) => {
    const view = json.bufferViews[bufferView], data = buffers[view.buffer], from = data.byteOffset + (view.byteOffset ?? 0) + byteOffset;
    const [type, size] = types[componentType], step = view.byteStride ?? width * size, read = new DataView(data.buffer);
    return Array.from({ length: count }, (_, i) => Array.from({ length: width }, (__, k) => read[`get${type}`](from + i * step + k * size, true)));
  };
  for (const { attributes, indices, mode = 4 } of json.meshes[0].primitives) {
    if (mode !== 4) throw new Error(`${path}: only triangles are read`);
    const first = points.length, some = numbersOf(json.accessors[attributes.POSITION], 3);
    const ids = indices === undefined ? some.map((_, i) => i) : numbersOf(json.accessors[indices], 1).flat();
    for (const point of some) points.push(point);
    for (let i = 0; i + 2 < ids.length; i += 3) rows.push([0, 1, 2].map((k) => first + ids[i + k]));
  }
  return { points, rows };
}

/** The triangles of a surface: OFF, OBJ, STL, glTF. { points, rows: three numbers of points each }. */
export function surfaceOf(path) {
  const bytes = readFileSync(path), points = [], rows = [];
  if (/[.]gl(b|tf)$/.test(path)) return surfaceOfGltf(path, bytes);
  const fan = (ids) => ids.slice(2).forEach((_, k) => rows.push([ids[0], ids[k + 1], ids[k + 2]]));
  if (path.endsWith('.stl') && bytes.length === 84 + 50 * bytes.readUInt32LE(80)) {
    for (let i = 84; i < bytes.length; i += 50)
      for (let c = 1; c < 4; c++) points.push([0, 4, 8].map((k) => bytes.readFloatLE(i + 12 * c + k)));
  } else {
    const lines = bytes.toString('utf8').split('\n').map((line) => line.replace(/#.*/, '').trim()).filter(Boolean);
    if (path.endsWith('.off')) {
      const words = lines.join(' ').replace(/^C?N?OFF/, '').trim().split(/\s+/).map(Number);
      for (let i = 0; i < words[0]; i++) points.push(words.slice(3 + 3 * i, 6 + 3 * i));
      for (let i = 0, at = 3 + 3 * words[0]; i < words[1]; at += words[at] + 1, i++) fan(words.slice(at + 1, at + 1 + words[at]));
    } else {
      for (const line of lines) {
        const words = line.split(/\s+/), ids = words.slice(1).map((word) => parseInt(word, 10));
        if (words[0] === 'v' || words[0] === 'vertex') points.push(words.slice(1, 4).map(Number));
        if (words[0] === 'f') fan(ids.map((id) => (id < 0 ? points.length + id : id - 1)));
      }
    }
  }
  if (rows.length === 0) for (let i = 0; i + 2 < points.length; i += 3) rows.push([i, i + 1, i + 2]);
  return { points, rows };
}
