// SPDX-License-Identifier: GPL-3.0-or-later
import { readFileSync } from 'node:fs';

/** The triangles of a surface: OFF, OBJ, STL. { points, rows: three numbers of points each }. */
export function surfaceOf(path) {
  const bytes = readFileSync(path), points = [], rows = [];
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
