// SPDX-License-Identifier: GPL-3.0-or-later
// Compares colliders in a glTF file with those that VHACD (of Rapier) makes of the same closed surface:
//   node colliders.mjs READERS FILE.glb SURFACE [POINTS]
// One line of JSON. Both are measured by the same random points: so many as put POINTS (a million) into the solid.
import { readFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import RAPIER from '@dimforge/rapier3d-compat';
import { surfaceOf } from './surface.mjs';

const [readers, path, model, wanted = '1000000'] = process.argv.slice(2);
const { openGlb, bodiesOf } = await import(pathToFileURL(`${readers}/qmat_physics.mjs`));
await RAPIER.init();

const minus = (p, q) => [0, 1, 2].map((k) => p[k] - q[k]);
const dot = (p, q) => p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
const cross = (p, q) => [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];

/** Random numbers in [0, 1) that are the same in every run (mulberry32). */
function randomFrom(seed) {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

function boundsOf(points, radius = () => 0) {
  const low = [Infinity, Infinity, Infinity], high = low.map((v) => -v);
  for (const p of points) for (let k = 0; k < 3; k++) {
    low[k] = Math.min(low[k], p[k] - radius(p));
    high[k] = Math.max(high[k], p[k] + radius(p));
  }
  return { low, high };
}

/** The facets of a convex hull as planes: [x, y, z, offset], normals outward. Rapier computes the hull. */
function planesOf(points) {
  const world = new RAPIER.World({ x: 0, y: 0, z: 0 }), desc = RAPIER.ColliderDesc.convexHull(new Float32Array(points.flat()));
  if (!desc) throw new Error('a hull has no volume');
  const collider = world.createCollider(desc);
  collider.clearShapeCache(); // the description has no triangles
  const hull = collider.shape;
  const at = (id) => [0, 1, 2].map((k) => hull.vertices[3 * id + k]);
  const middle = boundsOf(points), centre = middle.low.map((v, k) => (v + middle.high[k]) / 2), planes = [];
  for (let i = 0; i < hull.indices.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => at(hull.indices[i + k])), n = cross(minus(b, a), minus(c, a)), length = Math.hypot(...n);
    if (!(length > 0)) continue;
    const sign = dot(n, minus(centre, a)) > 0 ? -1 : 1, unit = n.map((v) => (sign * v) / length);
    // All points are behind the plane: those of single precision may be off by a little.
    planes.push([...unit, Math.max(...points.map((p) => dot(unit, p)))]);
  }
  world.free();
  return planes;
}

/** A shape: { low, high, holds(x, y, z) }, where holds allows a point to be outside by `slack`. */
function shapeOf(shape, slack) {
  if (shape.points) {
    const planes = planesOf(shape.points);
    return { ...boundsOf(shape.points), holds: (x, y, z) => planes.every((n) => n[0] * x + n[1] * y + n[2] * z <= n[3] + slack) };
  }
  let [a, b] = shape.ends ?? [[...shape.center, shape.radius], [...shape.center, shape.radius]];
  if (b[3] > a[3]) [a, b] = [b, a];
  const axis = minus(b, a), length = Math.hypot(...axis), narrowing = a[3] - b[3], tapered = length > narrowing;
  // The nearest sphere between the ends is off the foot of the perpendicular where the capsule narrows (Quilez's round cone).
  const u = tapered ? axis.map((v) => v / length) : axis, slope = tapered ? narrowing / length : 0, rise = Math.sqrt(1 - slope * slope);
  return {
    ...boundsOf([a, b], (p) => p[3]),
    holds: (x, y, z) => {
      const p = [x - a[0], y - a[1], z - a[2]];
      if (!tapered) return Math.hypot(...p) <= a[3] + slack;
      const along = dot(p, u), away = Math.sqrt(Math.max(dot(p, p) - along * along, 0));
      const t = Math.min(Math.max(along - (away * slope) / rise, 0), length);
      return Math.hypot(along - t, away) <= a[3] - slope * t + slack;
    },
  };
}

/** Which shapes may reach a column at (x, y). */
const above = (shapes, x, y) => shapes.filter(({ low, high }) => x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1]);

/** The solid of a closed surface: crossings of its triangles with a column, by a grid of the xy plane. */
function solidOf({ points, rows }) {
  const edges = new Map();
  for (const row of rows) for (let k = 0; k < 3; k++) {
    const [a, b] = [row[k], row[(k + 1) % 3]], key = a < b ? `${a} ${b}` : `${b} ${a}`;
    edges.set(key, (edges.get(key) ?? 0) + (a < b ? 1 : -1));
  }
  if ([...edges.values()].some((v) => v !== 0)) throw new Error(`${model}: the surface is not closed and oriented`);
  const { low, high } = boundsOf(points), CELLS = 128, size = [0, 1].map((k) => (high[k] - low[k]) / CELLS);
  const cells = Array.from({ length: CELLS * CELLS }, () => []);
  const cell = (v, k) => Math.min(Math.max(Math.floor((v - low[k]) / size[k]), 0), CELLS - 1);
  for (const row of rows) {
    const box = boundsOf(row.map((id) => points[id]));
    for (let i = cell(box.low[0], 0); i <= cell(box.high[0], 0); i++)
      for (let j = cell(box.low[1], 1); j <= cell(box.high[1], 1); j++) cells[i * CELLS + j].push(row);
  }
  return { low, high, crossings: (x, y) => {
    const found = [];
    if (x < low[0] || x > high[0] || y < low[1] || y > high[1]) return found;
    for (const row of cells[cell(x, 0) * CELLS + cell(y, 1)]) {
      const [a, b, c] = row.map((id) => points[id]);
      const side = (p, q) => (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]), w = [side(b, c), side(c, a), side(a, b)];
      if (!(w.every((v) => v > 0) || w.every((v) => v < 0))) continue;
      found.push({ z: (w[0] * a[2] + w[1] * b[2] + w[2] * c[2]) / (w[0] + w[1] + w[2]), turn: w[0] > 0 ? -1 : 1 });
    }
    return found;
  } };
}

/** VHACD's hulls, as near to `count` as a search over its concavity gets: more of two equally near. Its count is not monotone. */
function vhacd({ points, rows }, count) {
  const vertices = new Float32Array(points.flat()), indices = new Uint32Array(rows.flat());
  let best = null, [low, high] = [1e-5, 0.5];
  for (let i = 0; i < 10; i++) {
    const concavity = Math.sqrt(low * high), resolution = 128;
    const hulls = RAPIER.ColliderDesc.convexDecomposition(vertices, indices, { maxConvexHulls: 1024, concavity, resolution })?.shape.shapes ?? [];
    const off = Math.abs(hulls.length - count);
    if (!best || off < best.off || (off === best.off && hulls.length > count)) best = { off, hulls, concavity };
    if (hulls.length === count) break;
    if (hulls.length > count) low = concavity; else high = concavity;
  }
  return best.hulls.map(({ vertices: v }) => ({ points: Array.from({ length: v.length / 3 }, (_, i) => [...v.subarray(3 * i, 3 * i + 3)]) }));
}

const surface = surfaceOf(model), solid = solidOf(surface), diagonal = Math.hypot(...minus(solid.high, solid.low));
const given = bodiesOf(openGlb(readFileSync(path))).flatMap((body) => body.shapes);
// The file's numbers are of single precision.
const ours = given.map((shape) => shapeOf(shape, 1e-6 * diagonal));
const theirs = vhacd(surface, given.length), other = theirs.map((shape) => shapeOf(shape, 0));
const low = [0, 1, 2].map((k) => Math.min(...[solid, ...ours, ...other].map((one) => one.low[k])));
const high = [0, 1, 2].map((k) => Math.max(...[solid, ...ours, ...other].map((one) => one.high[k])));

const random = randomFrom(1), IN_COLUMN = 16;
const sets = [ours, other].map((shapes) => ({ shapes, union: 0, both: 0, outside: 0 }));
let inSolid = 0;
while (inSolid < Number(wanted)) {
  const [x, y] = [0, 1].map((k) => low[k] + random() * (high[k] - low[k]));
  const crossings = solid.crossings(x, y), near = sets.map(({ shapes }) => above(shapes, x, y));
  for (let i = 0; i < IN_COLUMN; i++) {
    const z = low[2] + random() * (high[2] - low[2]);
    const inside = crossings.reduce((sum, c) => sum + (c.z > z ? c.turn : 0), 0) !== 0;
    inSolid += inside;
    sets.forEach((set, k) => {
      const held = near[k].some((shape) => z >= shape.low[2] && z <= shape.high[2] && shape.holds(x, y, z));
      set.union += held;
      set.both += held && inside;
      set.outside += inside && !held;
    });
  }
}
const figures = ({ shapes, union, both, outside }, bytes) => ({
  shapes: shapes.length, outside, volume: union / inSolid, iou: both / (union + inSolid - both), bytes });
/** What the shapes alone take as numbers of four bytes: spheres and capsules, and the vertices of hulls. */
const bytesOf = (shapes) => shapes.reduce((sum, s) => sum + 4 * (s.points ? 3 * s.points.length : s.ends ? 8 : 4), 0);
console.log(JSON.stringify({ points: inSolid, qmat: figures(sets[0], bytesOf(given)), vhacd: figures(sets[1], bytesOf(theirs)) }));
