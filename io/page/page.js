// SPDX-License-Identifier: GPL-3.0-or-later
//
// The script of a page that report.page makes. It follows examples/readers/qmat_reader.mjs in one module, which decodes
// the medial meshes (decode) and has the vector functions (dot, minus). Lengths are in the unit frame: the diagonal of
// the surface's bounding box is 1. Camera, colours and light are those of nodes/page/look.c.

const page = JSON.parse(document.getElementById('data').textContent);
const $ = (id) => document.getElementById(id);
const HALF_VIEW = Math.tan(Math.PI / 12);
const FILLED = 0.92;
const canRead = (() => { // else the page shows its picture
  try {
    return Boolean(new DecompressionStream('deflate-raw'));
  } catch {
    return false;
  }
})();
const KINDS = ['sphere', 'cone', 'slab'];
const css = (colour) => `rgb(${colour.map((x) => Math.round(255 * x)).join(' ')})`;

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

// ---- numbers as text ----

const count = (n) => n.toLocaleString('en-US');
const counted = (n, name) => `${count(n)} ${name}${n === 1 ? '' : 's'}`;

/** A number rounded up to that many digits: what is shown are upper bounds. */
function roundedUp(x, digits) {
  if (!(x > 0)) return 0;
  const decimals = Math.max(digits - 1 - Math.floor(Math.log10(x)), 0);
  return Number((Math.ceil(x * 10 ** decimals * (1 - 1e-12)) / 10 ** decimals).toFixed(decimals));
}

/** An upper bound as a percentage, as qmat prints it. */
function percent(x) {
  return x > 0 ? `${roundedUp(Math.max(100 * x, 0.001), 2)} %` : '0 %';
}

/** A share of the diagonal as a length, where the unit is known, else in the units of the model. */
function length(mesh, share) {
  const meters = share * mesh.diagonal * mesh.meters_per_unit;
  if (!(meters > 0)) return `${roundedUp(share * mesh.diagonal, 3)} units`;
  const [unit, size] = [['km', 1e3], ['m', 1], ['cm', 1e-2], ['mm', 1e-3], ['\u00b5m', 1e-6]].find(([, size]) => meters >= size) ?? ['\u00b5m', 1e-6];
  return `${roundedUp(meters / size, 3)} ${unit}`;
}

// ---- data ----

/** An array as io/page/page_array.h describes it; `row` is 0 where numbers are not differences. */
async function arrayOf(text, Type, row) {
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer()), width = Type.BYTES_PER_ELEMENT, count = planes.length / width;
  const bytes = new Uint8Array(planes.length); // little-endian, as all browsers' machines are
  for (let k = 0; k < width; k++) for (let i = 0; i < count; i++) bytes[width * i + k] = planes[k * count + i];
  const numbers = new Type(bytes.buffer), parts = new { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array }[width](bytes.buffer);
  for (let i = 0; row > 0 && i < count; i++) parts[i] = ((parts[i] >>> 1) ^ -(parts[i] & 1)) + (i < row ? 0 : parts[i - row]);
  return numbers;
}

const medialOf = async (text) => complexOf(decode(new Uint8Array((await arrayOf(text, Uint32Array, 0)).buffer)));

/** Spheres, edges and slabs of a decoded medial mesh; the edges are those of slabs too. */
function complexOf(medial) {
  const edges = Array.from(medial.cones);
  for (let i = 0; i < medial.slabs.length; i += 3) {
    const [a, b, c] = medial.slabs.subarray(i, i + 3);
    edges.push(a, b, a, c, b, c);
  }
  return reduced(Float32Array.from(medial.spheres), edges, medial.slabs, (id) => id);
}

/** The same after its spheres are merged: without repeated and degenerate simplices. */
function reduced(spheres, edges, slabs, idOf) {
  const seen = new Set(), keptEdges = [], keptSlabs = [];
  const size = spheres.length / 4 + 1;
  for (let i = 0; i < edges.length; i += 2) {
    const a = idOf(edges[i]), b = idOf(edges[i + 1]);
    const key = Math.min(a, b) * size + Math.max(a, b);
    if (a === b || seen.has(key)) continue;
    seen.add(key);
    keptEdges.push(a, b);
  }
  const seenSlabs = new Set();
  for (let i = 0; i < slabs.length; i += 3) {
    const ids = [idOf(slabs[i]), idOf(slabs[i + 1]), idOf(slabs[i + 2])].sort((x, y) => x - y);
    const key = `${ids[0]} ${ids[1]} ${ids[2]}`;
    if (ids[0] === ids[1] || ids[1] === ids[2] || seenSlabs.has(key)) continue;
    seenSlabs.add(key);
    keptSlabs.push(...ids);
  }
  return { spheres, edges: keptEdges, slabs: keptSlabs };
}

/** All levels of detail, each named by its number of spheres: the medial meshes that medial.lod extracts. */
class Chain {
  static async read(json) {
    const chain = new Chain();
    chain.start = await medialOf(json.medial);
    chain.ends = await arrayOf(json.ends, Uint32Array, 0);
    chain.merged = await arrayOf(json.merged, Float32Array, 0);
    chain.errors = await arrayOf(json.errors, Float32Array, 1);
    chain.most = json.spheres;
    chain.least = json.spheres - chain.ends.length / 2;
    chain.proved = new Map(json.bounds.map(([spheres, ...both]) => [spheres, both]));
    chain.stops = chain.sliderStops();
    return chain;
  }
  /** The levels that the slider stops at, the finest first: the proved ones, and above them four in each doubling. */
  sliderStops() {
    const stops = [...this.proved.keys()].reverse();
    if (stops.length === 0) stops.push(this.least);
    for (let n = stops.at(-1); n < this.most; stops.push(n)) n = Math.min(this.most, Math.max(n + 1, Math.round(n * 2 ** 0.25)));
    return stops.reverse();
  }
  /** The slider's place nearest to a level; 0 is the finest. */
  place(spheres) {
    const away = (n) => Math.abs(Math.log(n / spheres));
    return this.stops.reduce((best, n, i) => (away(n) < away(this.stops[best]) ? i : best), 0);
  }
  /** Both errors of the level are at most this at the constraint points. */
  error(spheres) {
    return this.errors[this.most - spheres];
  }
  level(spheres) {
    const collapses = this.most - spheres, n = this.most, roots = new Uint32Array(n);
    for (let v = 0; v < n; v++) roots[v] = v;
    for (let i = collapses - 1; i >= 0; i--) roots[this.ends[2 * i + 1]] = roots[this.ends[2 * i]];
    const ids = new Uint32Array(n);
    let next = 0;
    for (let v = 0; v < n; v++) if (roots[v] === v) ids[v] = next++;
    const kept = new Float32Array(4 * next);
    for (let v = 0; v < n; v++) if (roots[v] === v) kept.set(this.start.spheres.subarray(4 * v, 4 * v + 4), 4 * ids[v]);
    for (let i = 0; i < collapses; i++) {
      const v = this.ends[2 * i];
      if (roots[v] === v) kept.set(this.merged.subarray(4 * i, 4 * i + 4), 4 * ids[v]);
    }
    return reduced(kept, this.start.edges, this.start.slabs, (v) => ids[roots[v]]);
  }
}

class Mesh {
  static async read(json) {
    const mesh = Object.assign(new Mesh(), json), s = json.surface;
    if (mesh.failure || !canRead) return mesh;
    mesh.result = await medialOf(json.medial);
    mesh.chain = json.chain ? await Chain.read(json.chain) : null;
    mesh.positions = await arrayOf(s.positions, Int16Array, 3);
    mesh.normals = await arrayOf(s.normals, Int8Array, 3);
    mesh.errors = await arrayOf(s.errors, Int16Array, 1);
    mesh.corners = await arrayOf(s.corners, Uint32Array, 1);
    mesh.reach = reachOf(mesh);
    return mesh;
  }
}

/** The triangles that touch the spheres of slabs on both sides: 6 numbers a corner, its place and its normal. */
function slabFaces({ spheres, slabs }) {
  const faces = [], sphere = (id) => spheres.subarray(4 * id, 4 * id + 4);
  for (let i = 0; i < slabs.length; i += 3) {
    const s = [sphere(slabs[i]), sphere(slabs[i + 1]), sphere(slabs[i + 2])];
    const u = minus(s[1], s[0]), v = minus(s[2], s[0]), du = s[1][3] - s[0][3], dv = s[2][3] - s[0][3];
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), area = dot(n, n);
    if (!(area > 1e-20 * uu * vv)) continue;
    // The radius grows along x u + y v; where it grows by less than the distance there are two tangent planes.
    const x = (vv * du - uv * dv) / area, y = (uu * dv - uv * du) / area, steep = 1 - (x * du + y * dv);
    if (!(steep > 0)) continue;
    for (const side of [1, -1]) {
      const rise = (side * Math.sqrt(steep)) / Math.sqrt(area);
      const normal = n.map((q, k) => rise * q - x * u[k] - y * v[k]);
      // Lifted a little, so that a face covers the cones that touch it along its sides.
      for (const c of s) faces.push(...normal.map((q, k) => c[k] + (c[3] > 0 ? c[3] + 3e-5 : 0) * q), ...normal);
    }
  }
  return new Float32Array(faces);
}

// ---- camera ----

function axesOf({ turn, tilt }) {
  const a = (turn * Math.PI) / 180, b = (tilt * Math.PI) / 180, [ca, sa, cb, sb] = [Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b)];
  if (page.camera.z_up) return { right: [ca, sa, 0], up: [-sa * sb, ca * sb, cb], towards: [sa * cb, -ca * cb, sb] };
  return { right: [ca, 0, -sa], up: [-sa * sb, cb, -ca * sb], towards: [sa * cb, sb, ca * cb] };
}

/** How far from the origin anything of a mesh is; levels of detail stick out a little more. */
function reachOf({ positions, result: { spheres } }) {
  let reach = 0;
  for (let i = 0; i < positions.length; i += 3) reach = Math.max(reach, Math.hypot(positions[i], positions[i + 1], positions[i + 2]) / 32767);
  for (let i = 0; i < spheres.length; i += 4) reach = Math.max(reach, Math.hypot(spheres[i], spheres[i + 1], spheres[i + 2]) + spheres[i + 3]);
  return reach + 0.1;
}

/** How far away the camera has to be for all of the model to be in view. */
function fittingDistance(mesh, axes, aspect) {
  const tall = HALF_VIEW * FILLED, wide = tall * aspect;
  let distance = 0;
  const fit = (p, radius) => {
    const depth = dot(p, axes.towards), x = Math.abs(dot(p, axes.right)), y = Math.abs(dot(p, axes.up));
    distance = Math.max(distance, depth + x / wide + radius * Math.sqrt(1 + 1 / (wide * wide)),
      depth + y / tall + radius * Math.sqrt(1 + 1 / (tall * tall)));
  };
  for (let i = 0; i < mesh.positions.length; i += 3) fit([mesh.positions[i] / 32767, mesh.positions[i + 1] / 32767, mesh.positions[i + 2] / 32767], 0);
  for (let i = 0; i < mesh.result.spheres.length; i += 4) fit(mesh.result.spheres.subarray(i, i + 3), mesh.result.spheres[i + 3]);
  return distance;
}

// ---- drawing ----

const COMMON = `#version 300 es
precision highp float;
precision highp int;
uniform vec3 right, up, towards, target;
uniform float away, aspect, reach; // nothing is farther from the target than the last
const float HALF = ${HALF_VIEW};
`;

const PROJECT = `
vec4 project(vec3 p) {
  vec3 d = p - target;
  float w = away - dot(d, towards), near = max(1e-3, away - reach), far = away + reach;
  return vec4(dot(d, right) / (HALF * aspect), dot(d, up) / HALF, (w * (far + near) - 2.0 * far * near) / (far - near), w);
}
`;

const SHADE = `
out vec4 pixel;
vec3 shade(vec3 normal, vec3 colour) {
  vec3 n = vec3(dot(normal, right), dot(normal, up), dot(normal, towards));
  float edge = 1.0 - max(n.z, 0.0);
  float light = (0.52 + 0.48 * max(dot(n, vec3(-0.448, 0.647, 0.617)), 0.0) + 0.16 * max(dot(n, vec3(0.703, -0.201, 0.683)), 0.0)) *
    (1.0 - 0.38 * edge * edge * edge);
  float gloss = 0.12 * pow(max(dot(n, vec3(-0.249, 0.360, 0.899)), 0.0), 28.0);
  return min(colour * light + gloss, 1.0);
}
vec3 facing(vec3 normal, vec3 ray) {
  float size = length(normal);
  return size > 0.0 ? normal * (dot(normal, ray) > 0.0 ? -1.0 : 1.0) / size : -ray;
}
`;

const SURFACE = [`${COMMON}${PROJECT}
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 direction;
layout(location = 2) in float error;
out vec3 at, normal;
out float f;
void main() {
  at = position;
  normal = direction;
  f = 4.0 * error;
  gl_Position = project(position);
}`, `${COMMON}${SHADE}
in vec3 at, normal;
in float f;
uniform int look; // 0: error, 1: glass, 2: plain
uniform vec3 map[5], plain;
void main() {
  vec3 ray = normalize(at - target - away * towards), n = facing(normal, ray), colour = plain;
  if (look == 0) {
    float place = clamp((f + 1.0) / 2.0, 0.0, 1.0) * 4.0;
    int low = min(int(place), 3);
    colour = mix(map[low], map[low + 1], place - float(low));
  }
  float edge = 1.0 - clamp(dot(n, towards), 0.0, 1.0), opacity = look == 1 ? 0.2 + 0.55 * edge * edge : 1.0;
  pixel = vec4(shade(n, colour) * opacity, opacity);
}`];

const FACE = [`${COMMON}${PROJECT}
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 direction;
out vec3 at, normal;
void main() {
  at = position;
  normal = direction;
  gl_Position = project(position);
}`, `${COMMON}${SHADE}
in vec3 at, normal;
uniform vec3 colour;
void main() {
  pixel = vec4(shade(facing(normal, normalize(at - target - away * towards)), colour), 1.0);
}`];

// The corners of a box as one strip.
const BOX = `
vec3 corner() {
  int bit = 1 << gl_VertexID;
  return 2.0 * vec3((0x287a & bit) != 0, (0x02af & bit) != 0, (0x31e3 & bit) != 0) - 1.0;
}
`;

// The ray starts where it is nearest to the middle of the primitive: single precision would lose small ones otherwise.
const RAY = `
in vec3 at;
uniform vec3 colour;
vec3 eye, ray;
float approach(vec3 middle, out vec3 near) {
  eye = target + away * towards;
  ray = normalize(at - eye);
  float t = dot(middle - eye, ray);
  near = eye + t * ray - middle;
  return t;
}
void finish(float t, vec3 normal) {
  vec4 place = project(eye + t * ray);
  gl_FragDepth = 0.5 * place.z / place.w + 0.5;
  pixel = vec4(shade(facing(normal, ray), colour), 1.0);
}
`;

const SPHERE = [`${COMMON}${PROJECT}${BOX}
layout(location = 0) in vec4 sphere;
out vec3 at;
flat out vec4 s;
void main() {
  s = sphere;
  vec3 c = corner();
  at = sphere.xyz + sphere.w * (c.x * right + c.y * up + c.z * towards);
  gl_Position = project(at);
}`, `${COMMON}${PROJECT}${SHADE}${RAY}
flat in vec4 s;
void main() {
  vec3 near;
  float t = approach(s.xyz, near), square = s.w * s.w - dot(near, near);
  if (square <= 0.0) discard;
  float depth = sqrt(square);
  if (t - depth <= 0.0) discard; // behind the eye
  finish(t - depth, near - depth * ray);
}`];

const CONE = [`${COMMON}${PROJECT}${BOX}
layout(location = 0) in vec4 a;
layout(location = 1) in vec4 b;
out vec3 at;
flat out vec3 foot, axis;
flat out vec4 side; // height, first radius, slope, along
void main() {
  vec3 d = b.xyz - a.xyz;
  float size = length(d), along = (a.w - b.w) / max(size, 1e-30), across = sqrt(max(1.0 - along * along, 0.0));
  axis = d / max(size, 1e-30);
  foot = a.xyz + a.w * along * axis;
  side = vec4(size * across * across, a.w * across, -along / max(across, 1e-30), along);
  float radius = max(a.w, b.w) * across;
  vec3 v = normalize(cross(axis, abs(axis.x) < 0.6 ? vec3(1, 0, 0) : vec3(0, 1, 0))), w = cross(axis, v), c = corner();
  at = foot + (0.5 + 0.5 * c.z) * side.x * axis + radius * (c.x * v + c.y * w);
  gl_Position = across > 0.0 && size > abs(a.w - b.w) ? project(at) : vec4(2, 2, 2, 1);
}`, `${COMMON}${PROJECT}${SHADE}${RAY}
flat in vec3 foot, axis;
flat in vec4 side;
void main() {
  vec3 near;
  float t = approach(foot + 0.5 * side.x * axis, near);
  float h = dot(near, axis) + 0.5 * side.x, dh = dot(ray, axis);
  vec3 w = near - (h - 0.5 * side.x) * axis, dw = ray - dh * axis;
  float r = side.y + side.z * h, dr = side.z * dh;
  float a = dot(dw, dw) - dr * dr, b = dot(w, dw) - r * dr, c = dot(w, w) - r * r, d = b * b - a * c;
  if (d < 0.0) discard;
  float q = -(b + (b < 0.0 ? -sqrt(d) : sqrt(d))), one = q != 0.0 ? c / q : 1e30, two = a != 0.0 ? q / a : 1e30;
  float s = min(one, two), radius = side.y + side.z * (h + s * dh), across = sqrt(1.0 - side.w * side.w);
  if (!(h + s * dh >= 0.0 && h + s * dh <= side.x && radius > 0.0 && t + s > 0.0)) {
    s = max(one, two);
    radius = side.y + side.z * (h + s * dh);
    if (!(h + s * dh >= 0.0 && h + s * dh <= side.x && radius > 0.0 && t + s > 0.0)) discard;
  }
  finish(t + s, across * (w + s * dw) / radius + side.w * axis);
}`];

class Drawing {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = (this.gl = canvas.getContext('webgl2', { antialias: false, alpha: true, premultipliedAlpha: true }));
    if (!gl) return;
    this.programs = { surface: this.program(SURFACE), face: this.program(FACE), sphere: this.program(SPHERE), cone: this.program(CONE) };
    this.surface = gl.createVertexArray();
    this.primitives = { sphere: gl.createVertexArray(), cone: gl.createVertexArray(), slab: gl.createVertexArray() };
    this.buffers = { positions: gl.createBuffer(), normals: gl.createBuffer(), errors: gl.createBuffer(), corners: gl.createBuffer(),
      sphere: gl.createBuffer(), cone: gl.createBuffer(), slab: gl.createBuffer() };
    this.counts = { corners: 0, sphere: 0, cone: 0, slab: 0 };
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }
  program([vertex, fragment]) {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      gl.deleteShader(shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      const said = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error(`a shader cannot be compiled: ${gl.getProgramInfoLog(program)} ${said.join(' ')}`);
    }
    const uniforms = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(program, i);
      uniforms[name.replace('[0]', '')] = gl.getUniformLocation(program, name);
    }
    return { program, uniforms };
  }
  /** Fills a buffer and describes it: rows of [location, numbers, type, normalized, stride, offset, divisor]. */
  fill(array, buffer, data, rows) {
    const gl = this.gl;
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    for (const [location, size, type, normalized, stride, offset, divisor] of rows) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, type, normalized, stride, offset);
      gl.vertexAttribDivisor(location, divisor);
    }
  }
  setSurface(mesh) {
    const gl = this.gl;
    this.fill(this.surface, this.buffers.positions, mesh.positions, [[0, 3, gl.SHORT, true, 6, 0, 0]]);
    this.fill(this.surface, this.buffers.normals, mesh.normals, [[1, 3, gl.BYTE, true, 3, 0, 0]]);
    this.fill(this.surface, this.buffers.errors, mesh.errors, [[2, 1, gl.SHORT, true, 2, 0, 0]]);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers.corners);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.corners, gl.STATIC_DRAW);
    this.counts.corners = mesh.corners.length;
  }
  setMedial(complex) {
    const gl = this.gl, ends = new Float32Array(4 * complex.edges.length);
    complex.edges.forEach((id, i) => ends.set(complex.spheres.subarray(4 * id, 4 * id + 4), 4 * i));
    const faces = slabFaces(complex);
    this.fill(this.primitives.sphere, this.buffers.sphere, complex.spheres, [[0, 4, gl.FLOAT, false, 16, 0, 1]]);
    this.fill(this.primitives.cone, this.buffers.cone, ends, [[0, 4, gl.FLOAT, false, 32, 0, 1], [1, 4, gl.FLOAT, false, 32, 16, 1]]);
    this.fill(this.primitives.slab, this.buffers.slab, faces, [[0, 3, gl.FLOAT, false, 24, 0, 0], [1, 3, gl.FLOAT, false, 24, 12, 0]]);
    Object.assign(this.counts, { sphere: complex.spheres.length / 4, cone: complex.edges.length / 2, slab: faces.length / 6 });
  }
  use({ program, uniforms }, camera, aspect) {
    const gl = this.gl;
    gl.useProgram(program);
    for (const name of ['right', 'up', 'towards', 'target']) gl.uniform3fv(uniforms[name], camera[name]);
    gl.uniform1f(uniforms.away, camera.away);
    gl.uniform1f(uniforms.aspect, aspect);
    gl.uniform1f(uniforms.reach, camera.reach);
    return uniforms;
  }
  drawMedial(camera, aspect, hidden) {
    const gl = this.gl;
    gl.enable(gl.CULL_FACE);
    gl.cullFace(gl.FRONT);
    for (const [k, kind] of ['sphere', 'cone'].entries()) {
      if (hidden[kind] || this.counts[kind] === 0) continue;
      gl.uniform3fv(this.use(this.programs[kind], camera, aspect).colour, page.look.kinds[k]);
      gl.bindVertexArray(this.primitives[kind]);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 14, this.counts[kind]);
    }
    gl.disable(gl.CULL_FACE);
    if (hidden.slab || this.counts.slab === 0) return;
    gl.uniform3fv(this.use(this.programs.face, camera, aspect).colour, page.look.kinds[2]);
    gl.bindVertexArray(this.primitives.slab);
    gl.drawArrays(gl.TRIANGLES, 0, this.counts.slab);
  }
  drawSurface(camera, aspect, look) {
    const gl = this.gl, uniforms = this.use(this.programs.surface, camera, aspect);
    gl.uniform1i(uniforms.look, look);
    gl.uniform3fv(uniforms.map, page.look.map.flat());
    gl.uniform3fv(uniforms.plain, page.look.surface);
    gl.bindVertexArray(this.surface);
    const draw = () => gl.drawElements(gl.TRIANGLES, this.counts.corners, gl.UNSIGNED_INT, 0);
    if (look !== 1) return draw();
    gl.colorMask(false, false, false, false); // only the nearest layer of the glass is seen
    draw();
    gl.colorMask(true, true, true, true);
    gl.enable(gl.BLEND);
    draw();
    gl.disable(gl.BLEND);
  }
  /** Draws the panels [{view, x, y, width, height}] of an image of that size; y is from the bottom. */
  draw(width, height, panels, cameraOf, state) {
    const gl = this.gl;
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    for (const panel of panels) {
      const aspect = panel.width / panel.height, camera = cameraOf(aspect);
      gl.viewport(panel.x, panel.y, panel.width, panel.height);
      if (panel.view !== 'surface') this.drawMedial(camera, aspect, state.hidden);
      if (panel.view !== 'medial') this.drawSurface(camera, aspect, panel.view === 'overlay' ? 1 : state.spheres === null ? 0 : 2);
    }
  }
}

// ---- the page ----

const meshes = await Promise.all(page.meshes.map((json) => Mesh.read(json.same === undefined ? json : { ...page.meshes[json.same], name: json.name })));
const state = { mesh: meshes.find((mesh) => !mesh.failure), view: 'both', spheres: null, hidden: {}, turn: page.camera.turn, tilt: page.camera.tilt,
  zoom: 1, pan: [0, 0, 0], worst: -1 };
let drawing = null;
let waiting = false;
let complex = null;

function panelsOf(width, height) {
  if (state.view !== 'both') return [{ view: state.view, x: 0, y: 0, width, height }];
  if (width < 0.9 * height) {
    const low = Math.floor(height / 2);
    return [{ view: 'surface', x: 0, y: low, width, height: height - low }, { view: 'medial', x: 0, y: 0, width, height: low }];
  }
  const left = Math.floor(width / 2);
  return [{ view: 'surface', x: 0, y: 0, width: left, height }, { view: 'medial', x: left, y: 0, width: width - left, height }];
}

/** The fitting distance of the first view, so that turning does not zoom. */
const fits = new Map();
function cameraOf(aspect) {
  const key = `${meshes.indexOf(state.mesh)} ${aspect.toFixed(4)}`;
  if (!fits.has(key)) fits.set(key, fittingDistance(state.mesh, axesOf(page.camera), aspect));
  return { ...axesOf(state), target: state.pan, away: fits.get(key) * state.zoom, reach: state.mesh.reach + Math.hypot(...state.pan) };
}

/** Where a place is seen, in pixels from the top left of a stage of that height; null: it is out of view. */
function seenAt(panel, p, height) {
  const aspect = panel.width / panel.height, camera = cameraOf(aspect), d = minus(p, camera.target), w = camera.away - dot(d, camera.towards);
  const x = dot(d, camera.right) / (HALF_VIEW * aspect * w), y = dot(d, camera.up) / (HALF_VIEW * w);
  if (!(w > 0) || Math.abs(x) > 1 || Math.abs(y) > 1) return null;
  return { left: panel.x + ((x + 1) / 2) * panel.width, top: height - panel.y - ((y + 1) / 2) * panel.height, flip: x > 0.3 };
}

const places = () => (state.spheres === null ? [['surface', 'surface'], ['envelope', 'envelope']] : []).flatMap(([key, text]) =>
  state.mesh.worst[key] ? [{ key, text: `${text}: ${percent(state.mesh.worst[key][3])}`, at: state.mesh.worst[key] }] : []);

function drawLabels(panels, height) {
  const captions = { surface: state.spheres === null ? 'Surface, coloured by its error' : 'Surface', medial: 'Medial mesh', overlay: 'Medial mesh in the surface' };
  const labels = panels.map((panel) => {
    const caption = make('div', { class: 'caption' }, captions[panel.view]);
    caption.style.left = `${panel.x}px`;
    caption.style.top = `${height - panel.y - panel.height}px`;
    return caption;
  });
  const shown = places()[state.worst];
  for (const panel of shown ? panels : []) {
    const at = seenAt(panel, shown.at, height);
    if (!at) continue;
    const mark = make('div', { class: `mark ${shown.key}${at.flip ? ' left' : ''}` }, make('span', {}, shown.text));
    mark.style.left = `${at.left}px`;
    mark.style.top = `${at.top}px`;
    labels.push(mark);
  }
  $('labels').replaceChildren(...labels);
}

// While the view moves it is drawn with fewer pixels where frames take too long, and with all of them once it rests.
const pace = { quality: 1, last: 0, moving: false, rest: 0 };

function paced() {
  const now = performance.now(), gap = now - pace.last;
  pace.last = now;
  clearTimeout(pace.rest);
  if (!pace.moving && gap > 400) return 1;
  if (gap > 40) pace.quality = Math.max(0.05, pace.quality * Math.max(0.25, 30 / gap));
  if (gap < 22) pace.quality = Math.min(1, 1.1 * pace.quality);
  if (pace.quality < 1) pace.rest = setTimeout(() => {
    pace.last = 0;
    if (!pace.moving) redraw();
  }, 300);
  return Math.sqrt(pace.quality);
}

function draw() {
  waiting = false;
  const stage = $('stage'), width = stage.clientWidth, height = stage.clientHeight;
  if (!drawing || width === 0 || height === 0) return;
  // Four pixels are drawn for each that is shown, as far as a screen of 4K needs.
  const ratio = devicePixelRatio || 1, scale = paced() * Math.min(ratio < 2 ? 2 * ratio : ratio, Math.sqrt(9e6 / (width * height)));
  const panels = panelsOf(width, height);
  const scaled = panels.map((p) => ({ view: p.view, x: Math.round(scale * p.x), y: Math.round(scale * p.y),
    width: Math.round(scale * (p.x + p.width)) - Math.round(scale * p.x), height: Math.round(scale * (p.y + p.height)) - Math.round(scale * p.y) }));
  drawing.draw(Math.round(scale * width), Math.round(scale * height), scaled, cameraOf, state);
  drawLabels(panels, height);
}

function redraw() {
  if (!waiting) requestAnimationFrame(draw);
  waiting = true;
}

/** The view as a canvas of that size, as report.picture draws it: each pixel is the mean of four. */
function picture(width, height, background) {
  drawing.draw(2 * width, 2 * height, panelsOf(2 * width, 2 * height), cameraOf, state);
  const image = Object.assign(document.createElement('canvas'), { width, height }), pen = image.getContext('2d');
  if (background) {
    pen.fillStyle = background;
    pen.fillRect(0, 0, width, height);
  }
  pen.drawImage(drawing.canvas, 0, 0, width, height);
  redraw();
  return image;
}

function save() {
  if (!drawing) return;
  const stage = $('stage'), background = getComputedStyle(stage).backgroundColor;
  picture(2 * stage.clientWidth, 2 * stage.clientHeight, background).toBlob((blob) => {
    const link = make('a', { download: `${state.mesh.name}.png`, href: URL.createObjectURL(blob) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }, 'image/png');
}

// ---- what is beside the view ----

function table(title, head, rows) {
  const cells = (tag, row) => make('tr', {}, ...row.map((cell, i) => {
    const td = make(i === 0 ? 'th' : tag, i === 0 ? { scope: tag === 'th' ? 'col' : 'row' } : {}, cell?.text ?? cell);
    if (cell?.kind) td.className = cell.kind;
    return td;
  }));
  const body = make('table', {}, ...(head ? [make('thead', {}, cells('th', head))] : []), make('tbody', {}, ...rows.map((row) => cells('td', row))));
  return make('section', {}, make('h2', {}, title), body);
}

function certificate(report) {
  if (typeof report?.certified !== 'boolean') return null;
  if (report.certified) return { text: 'certified', kind: 'good' };
  return { text: report.estimate ? 'estimate: the surface is open' : 'not certified', kind: 'bad' };
}

function showNumbers() {
  const mesh = state.mesh, report = mesh.report, sections = [];
  const counts = [counted(mesh.spheres, 'sphere'), counted(mesh.cones, 'cone'), counted(mesh.slabs, 'slab')].join(', ');
  const both = Math.max(report?.surface_to_envelope, report?.envelope_to_surface), judged = certificate(report);
  $('lead').textContent = `${counts} describe ${counted(mesh.surface.triangles, 'triangle')}` +
    (both >= 0 ? ` to within ${percent(both)} of the diagonal${judged ? `: ${judged.text}` : ''}.` : '.');
  const failed = meshes.filter((one) => one.failure).map((one) => `${one.name} cannot be described: ${one.failure}.`);
  if (failed.length > 0) $('lead').textContent += ` ${failed.join(' ')}`;
  if (both >= 0) {
    const row = (name, x) => [name, percent(x), length(mesh, x)];
    sections.push(table('Errors, at most', ['', 'of the diagonal', 'length'], [
      row('surface to envelope', report.surface_to_envelope), row('envelope to surface', report.envelope_to_surface),
      ...(report.epsilon > 0 ? [row('epsilon', report.epsilon)] : []), ...(judged ? [['', '', judged]] : [])]));
  }
  const betti = (suffix) => ['components', 'loops', 'voids'].map((key) => report?.[key + suffix]);
  if (betti('').every((n) => n !== undefined)) {
    const solid = betti('_of_solid'), own = betti('');
    sections.push(table('Topology', ['', 'solid', 'medial mesh'], ['components', 'loops', 'voids'].map((name, i) =>
      [name, solid[i] === undefined ? 'not known' : count(solid[i]),
        { text: count(own[i]), kind: solid[i] === undefined || solid[i] === own[i] ? '' : 'bad' }])));
  }
  const rows = [['triangles', count(mesh.surface.triangles)], ['vertices', count(mesh.surface.vertices)], ['spheres', count(mesh.spheres)],
    ['cones', count(mesh.cones)], ['slabs', count(mesh.slabs)], ['diagonal', length(mesh, 1)]];
  if (page.format) rows.unshift(['file', `${page.title} (${page.format})`]);
  sections.push(table('Model', null, rows));
  $('numbers').replaceChildren(...sections);
  $('bar').style.background = `linear-gradient(90deg, ${page.look.map.map(css).join(', ')})`;
  $('ticks').replaceChildren(...[-1, -0.5, 0, 0.5, 1].map((x) =>
    make('span', {}, x === 0 ? '0' : `${x < 0 ? '\u2212' : '+'}${percent(Math.abs(x) * mesh.range)}`)));
}

/** The colour bar is there where the surface has its colours. */
function showBar() {
  $('bar-section').hidden = !drawing || state.spheres !== null || !['both', 'surface'].includes(state.view);
}

function showLevel() {
  const chain = state.mesh.chain;
  $('levels').hidden = !chain || !drawing;
  if (!canRead) return;
  complex = state.spheres === null ? state.mesh.result : chain.level(state.spheres);
  drawing?.setMedial(complex);
  $('result').disabled = state.spheres === null;
  showBar();
  $('worst').disabled = places().length === 0;
  const slabs = complex.slabs.length / 3, cones = complex.edges.length / 2;
  const numbers = [complex.spheres.length / 4, cones, slabs];
  [...$('kinds').children].forEach((button, k) => (button.lastChild.textContent = counted(numbers[k], KINDS[k])));
  if (chain) {
    const n = state.spheres ?? state.mesh.spheres;
    $('slider').max = String(chain.stops.length - 1);
    $('slider').value = String(chain.place(Math.min(Math.max(n, chain.least), chain.most)));
    const proved = chain.proved.get(n);
    $('level').textContent = state.spheres === null ? `The result: ${counted(n, 'sphere')}` :
      proved ? `${counted(n, 'sphere')}: surface to envelope at most ${percent(proved[0])}, ${length(state.mesh, proved[0])}; envelope to surface at most ${percent(proved[1])}, ${length(state.mesh, proved[1])}` :
      `${counted(n, 'sphere')}: both errors at most ${percent(chain.error(n))}, ${length(state.mesh, chain.error(n))}, at the constraint points`;
    $('slider').setAttribute('aria-valuetext', $('level').textContent);
  }
  redraw();
}

/** Sets the level of that number of spheres; null: the result. */
function setLevel(spheres) {
  const chain = state.mesh.chain;
  state.spheres = spheres === null || !chain ? null : Math.min(Math.max(Math.round(spheres), chain.least), chain.most);
  state.worst = -1;
  showLevel();
}

function showMesh() {
  Object.assign(state, { spheres: null, worst: -1, pan: [0, 0, 0], zoom: 1 });
  drawing?.setSurface(state.mesh);
  showNumbers();
  showLevel();
}

function setView(view) {
  state.view = view;
  for (const button of $('views').children) button.setAttribute('aria-pressed', String(button.dataset.view === view));
  showBar();
  redraw();
}

function reset() {
  Object.assign(state, { turn: page.camera.turn, tilt: page.camera.tilt, zoom: 1, pan: [0, 0, 0], worst: -1 });
  redraw();
}

/** Turns to the next of the worst places. */
function nextWorst() {
  const all = places();
  state.worst = state.worst + 1 < all.length ? state.worst + 1 : -1;
  const place = all[state.worst];
  if (place) {
    const [x, y, z] = page.camera.z_up ? [place.at[0], place.at[2], -place.at[1]] : place.at;
    Object.assign(state, { turn: (Math.atan2(x, z) * 180) / Math.PI, tilt: (Math.atan2(y, Math.hypot(x, z)) * 180) / Math.PI, pan: [0, 0, 0] });
  }
  redraw();
}

function isDark() {
  const chosen = document.documentElement.dataset.theme;
  return chosen ? chosen === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches;
}

function showTheme() {
  $('theme').textContent = isDark() ? 'Light' : 'Dark';
}

function toggleTheme() {
  document.documentElement.dataset.theme = isDark() ? 'light' : 'dark';
  showTheme();
}

function toggleKeys() {
  $('keys').hidden = !$('keys').hidden;
  $('help').setAttribute('aria-expanded', String(!$('keys').hidden));
}

// ---- times ----

async function showReport(file) {
  const times = $('times');
  try {
    const report = JSON.parse(await file.text());
    const nodes = report.nodes.map(({ id, type, seconds, cache }) => ({ id, type, seconds: Number(seconds) || 0, cached: cache === 'hit' }));
    const most = Math.max(...nodes.map((node) => node.seconds), 1e-9);
    const rows = nodes.map((node) => {
      const bar = make('div', { class: 'time' });
      bar.style.width = `${(100 * node.seconds) / most}%`;
      return make('tr', {}, make('th', { scope: 'row' }, node.id), make('td', {}, node.type), make('td', { width: '40%' }, bar),
        make('td', {}, node.cached ? 'from cache' : `${node.seconds.toFixed(2)} s`));
    });
    times.replaceChildren(make('p', {}, `${report.graph}: ${Number(report.seconds).toFixed(1)} s`), make('table', {}, make('tbody', {}, ...rows)));
  } catch {
    times.replaceChildren(make('p', { class: 'bad' }, `${file.name} is not a report of a run.`));
  }
}

// ---- hands ----

function turn(dx, dy) {
  state.turn -= dx;
  state.tilt = Math.min(Math.max(state.tilt + dy, -90), 90);
  redraw();
}

function move(dx, dy) {
  const { width, height } = panelsOf($('stage').clientWidth, $('stage').clientHeight)[0], camera = cameraOf(width / height), size = (2 * HALF_VIEW * camera.away) / height;
  state.pan = state.pan.map((x, k) => Math.min(Math.max(x - size * (dx * camera.right[k] - dy * camera.up[k]), -1), 1));
  redraw();
}

function zoom(factor) {
  state.zoom = Math.min(Math.max(state.zoom * factor, 0.05), 6);
  redraw();
}

function listen() {
  const stage = $('stage'), fingers = new Map();
  stage.addEventListener('pointerdown', (event) => {
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    stage.setPointerCapture(event.pointerId);
    stage.classList.add('turning');
    pace.moving = true;
  });
  stage.addEventListener('pointermove', (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY], dx = now[0] - before[0], dy = now[1] - before[1];
    const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
    fingers.set(event.pointerId, now);
    if (other) {
      const apart = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]);
      zoom(apart(before) / Math.max(apart(now), 1));
      move(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons === 2 || event.buttons === 4) {
      move(dx, dy);
    } else {
      turn(0.4 * dx, 0.4 * dy);
    }
  });
  for (const name of ['pointerup', 'pointercancel']) {
    stage.addEventListener(name, (event) => {
      fingers.delete(event.pointerId);
      pace.moving = fingers.size > 0;
      stage.classList.toggle('turning', pace.moving);
      redraw();
    });
  }
  stage.addEventListener('contextmenu', (event) => {
    if (drawing) event.preventDefault();
  });
  stage.addEventListener('wheel', (event) => {
    if (!drawing || event.target.closest('#keys')) return;
    event.preventDefault();
    zoom(Math.exp(0.0015 * Math.min(Math.max(event.deltaY, -200), 200)));
  }, { passive: false });
  const keys = { 1: () => setView('both'), 2: () => setView('overlay'), 3: () => setView('surface'), 4: () => setView('medial'), r: reset, s: save,
    t: toggleTheme, w: nextWorst, '?': toggleKeys, '+': () => zoom(0.9), '=': () => zoom(0.9), '-': () => zoom(1 / 0.9),
    '[': () => setLevel((state.spheres ?? state.mesh.spheres) - 1), ']': () => setLevel((state.spheres ?? state.mesh.spheres) + 1) };
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = arrows[event.key], on = event.target;
    if (arrow && drawing && (on === stage || on === document.body)) {
      if (event.shiftKey) move(16 * arrow[0], 16 * arrow[1]);
      else turn(5 * arrow[0], 5 * arrow[1]);
      event.preventDefault();
    } else if (!(on instanceof HTMLSelectElement) && keys[event.key.toLowerCase()]) {
      keys[event.key.toLowerCase()]();
    }
  });
  for (const [id, act] of [['theme', toggleTheme], ['help', toggleKeys], ['reset', reset], ['save', save], ['worst', nextWorst], ['result', () => setLevel(null)]])
    $(id).addEventListener('click', act);
  for (const button of $('views').children) button.addEventListener('click', () => setView(button.dataset.view));
  $('slider').addEventListener('input', () => {
    setLevel(state.mesh.chain.stops[Number($('slider').value)]);
  });
  $('mesh').addEventListener('change', () => {
    state.mesh = meshes[$('mesh').value];
    showMesh();
  });
  $('report').addEventListener('change', () => $('report').files[0] && showReport($('report').files[0]));
  addEventListener('dragover', (event) => event.preventDefault());
  addEventListener('drop', (event) => {
    event.preventDefault();
    if (event.dataTransfer.files[0]) showReport(event.dataTransfer.files[0]);
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', showTheme);
  new ResizeObserver(redraw).observe(stage);
}

/** null: there is no WebGL, or it fails. */
function newDrawing() {
  try {
    const made = canRead ? new Drawing($('canvas')) : {};
    return made.gl ? made : null;
  } catch (error) {
    console.error(error);
    return null;
  }
}

/** Shows the drawing; without one, the still picture. */
function setDrawing(made) {
  drawing = made;
  $('stage').classList.toggle('still', !drawing);
  for (const id of ['canvas', 'labels', 'tools']) $(id).hidden = !drawing;
  for (const id of ['still', 'without']) $(id).hidden = Boolean(drawing);
}

function start() {
  $('footer').textContent = `Made by qmat ${page.version}. Lengths in percent are shares of the diagonal of the bounding box.`;
  $('run').hidden = false;
  KINDS.forEach((kind, k) => {
    const dot = make('i'), button = make('button', { type: 'button', 'aria-pressed': 'true' }, dot, make('span'));
    dot.style.background = css(page.look.kinds[k]);
    button.addEventListener('click', () => {
      state.hidden[kind] = !state.hidden[kind];
      button.setAttribute('aria-pressed', String(!state.hidden[kind]));
      redraw();
    });
    $('kinds').append(button);
  });
  meshes.forEach((mesh, i) => {
    const option = make('option', { value: String(i), ...(mesh.failure ? { disabled: '' } : {}) }, mesh.name);
    if (mesh === state.mesh) option.selected = true;
    $('mesh').append(option);
  });
  $('mesh-choice').hidden = meshes.length < 2;
  setDrawing(newDrawing());
  $('canvas').addEventListener('webglcontextlost', (event) => {
    event.preventDefault(); // it may come back
    setDrawing(null);
    showLevel();
  });
  $('canvas').addEventListener('webglcontextrestored', () => {
    setDrawing(newDrawing());
    drawing?.setSurface(state.mesh);
    showLevel();
  });
  listen();
  setView('both');
  showMesh();
  showTheme();
}

start();

/** For tests. */
globalThis.qmatPage = { state, pace, setLevel, setView, picture, redraw, draw, level: () => complex, meshes };
