// SPDX-FileCopyrightText: 2026 the qmat authors
// SPDX-License-Identifier: MIT
//
// Reads the medial meshes that qmat writes into glTF files (qmat_flat, see FORMAT.md), for browsers and Node.js, and
// answers questions about the solid. Points and directions are arrays of three numbers, in the space of the glTF node.
// Nothing is imported; README.md shows how three.js, Babylon.js and glTF-Transform use it.

// ---- decoding ----

function bytesOf(data) {
  if (typeof data !== 'string') return new Uint8Array(data.buffer ?? data, data.byteOffset ?? 0, data.byteLength);
  return Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
}

/** Decodes qmat_flat: its base64 string or its bytes. Spheres have four numbers each (x, y, z, radius), slabs three ids,
 * cones two, points one; `errors`, `joints` (four a sphere) and `weights` (four a sphere, of sum 1) are null where the
 * file has none. Throws an Error that says what is wrong. */
export function decode(data) {
  const bytes = bytesOf(data);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 64 || view.getUint32(0) !== 0x514d4154) throw new Error('not the medial mesh of qmat');
  if (view.getUint16(4, true) !== 1) throw new Error('a later version of qmat_flat');
  const flags = view.getUint16(6, true);
  const [n, s, c, p] = [8, 12, 16, 20].map((at) => view.getUint32(at, true));
  const aligned = (size) => Math.ceil(size / 4) * 4;
  const [real, width] = [flags & 1 ? 4 : 2, flags & 2 ? 4 : 2];
  const needed = 64 + 4 * real * n + (flags & 4 ? aligned(real * n) : 0) + aligned(3 * width * s) +
    aligned(2 * width * c) + aligned(width * p) + (flags & 8 ? 16 * n : 0);
  if (flags > 15 || n === 0 || needed !== bytes.length) throw new Error('the medial mesh is damaged: its size');
  let at = 64;
  const number = (place) => (flags & 1 ? view.getFloat32(place, true) : view.getUint16(place, true));
  const spheres = new Float64Array(4 * n);
  for (let i = 0; i < 4 * n; i++, at += real) {
    const k = 4 * (i % 4);
    spheres[i] = view.getFloat32(24 + k, true) + view.getFloat32(40 + k, true) * number(at);
    if (!Number.isFinite(spheres[i]) || (i % 4 === 3 && spheres[i] < 0)) {
      throw new Error(`the medial mesh is damaged: sphere ${Math.floor(i / 4)}`);
    }
  }
  let errors = null, joints = null, weights = null;
  if (flags & 4) {
    const scale = flags & 1 ? 1 : view.getFloat32(56, true);
    errors = Float64Array.from({ length: n }, (_, i) => scale * number(at + real * i));
    at += aligned(real * n);
  }
  const ids = (count) => {
    const list = new Uint32Array(count);
    for (let i = 0; i < count; i++) {
      list[i] = flags & 2 ? view.getUint32(at + 4 * i, true) : view.getUint16(at + 2 * i, true);
      if (list[i] >= n) throw new Error(`the medial mesh is damaged: there is no sphere ${list[i]}`);
    }
    at += aligned(width * count);
    return list;
  };
  const [slabs, cones, points] = [ids(3 * s), ids(2 * c), ids(p)];
  if (flags & 8) {
    joints = Uint16Array.from({ length: 4 * n }, (_, i) => view.getUint16(at + 2 * i, true));
    weights = Float64Array.from({ length: 4 * n }, (_, i) => view.getUint16(at + 8 * n + 2 * i, true) / 65535);
  }
  return { spheres, slabs, cones, points, errors, joints, weights };
}

/** The medial mesh in the extras of a glTF node; null where there is none. */
export function ofExtras(extras) {
  return typeof extras?.qmat_flat === 'string' ? decode(extras.qmat_flat) : null;
}

// ---- geometry ----

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const mix = (a, b, t) => a.map((x, k) => x + t * (b[k] - x));
const nearer = (a, b) => (b.distance < a.distance ? b : a);

/** The signed distance |p - c| - r to a sphere [x, y, z, radius], and that sphere. */
function toSphere(sphere, p) {
  const d = minus(p, sphere);
  return { distance: Math.sqrt(dot(d, d)) - sphere[3], sphere };
}

/** The least of these over the spheres that interpolate a and b. */
function toCone(a, b, p) {
  const axis = minus(b, a), d = minus(p, a), square = dot(axis, axis), slope = b[3] - a[3];
  if (!(square > slope * slope)) return nearer(toSphere(a, p), toSphere(b, p));
  const t = dot(d, axis) / square, w = d.map((x, k) => x - t * axis[k]);
  const x = t + (Math.sqrt(dot(w, w)) * slope) / Math.sqrt(square * (square - slope * slope));
  return toSphere(mix(a, b, Math.min(Math.max(x, 0), 1)), p);
}

function toSlab(a, b, c, p) {
  const u = b.map((x, k) => x - a[k]), v = c.map((x, k) => x - a[k]), d = minus(p, a);
  const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), area = dot(n, n);
  if (area > 1e-20 * uu * vv) {
    // The gradient of the radius over the plane is i u + j v. Where it is below 1 there are two tangent planes.
    const i = (vv * u[3] - uv * v[3]) / area, j = (uu * v[3] - uv * u[3]) / area, steep = 1 - (i * u[3] + j * v[3]);
    if (steep > 0) {
      const lean = Math.abs(dot(d, n)) / Math.sqrt(area * steep), du = dot(d, u), dv = dot(d, v);
      const x = (vv * du - uv * dv) / area + i * lean, y = (uu * dv - uv * du) / area + j * lean;
      if (x >= 0 && y >= 0 && x + y <= 1) return toSphere(a.map((q, k) => q + x * u[k] + y * v[k]), p);
    }
  }
  return nearer(nearer(toCone(a, b, p), toCone(b, c, p)), toCone(a, c, p));
}

const sphereOf = (medial, id) => Array.from(medial.spheres.subarray(4 * id, 4 * id + 4));

/** The slabs, cones and points, each as an array of its spheres [x, y, z, radius]. */
export function simplices(medial) {
  const list = [];
  for (const [ids, size] of [[medial.slabs, 3], [medial.cones, 2], [medial.points, 1]]) {
    for (let i = 0; i < ids.length; i += size) list.push(Array.from(ids.subarray(i, i + size), (id) => sphereOf(medial, id)));
  }
  return list;
}

function toSimplex(spheres, p) {
  if (spheres.length === 3) return toSlab(...spheres, p);
  return spheres.length === 2 ? toCone(...spheres, p) : toSphere(spheres[0], p);
}

function unit(d) {
  const length = Math.sqrt(dot(d, d));
  return length > 0 ? d.map((x) => x / length) : [0, 0, 1];
}

/** The signed distance from p: outside exact; inside below 0, and the solid is at least as deep. `closest` is the point
 * of the envelope nearest to an outside point; of an inside point, one at that depth. */
export function distance(medial, p) {
  let best = { distance: Infinity, sphere: [0, 0, 0, 0] };
  for (const spheres of simplices(medial)) best = nearer(best, toSimplex(spheres, p));
  const normal = unit(minus(p, best.sphere));
  return { distance: best.distance, closest: normal.map((x, k) => best.sphere[k] + best.sphere[3] * x) };
}

/** The point of the solid's convex hull that is farthest along `direction`, and its product with it. */
export function support(medial, direction) {
  const length = Math.sqrt(dot(direction, direction));
  let best = { distance: -Infinity, point: null };
  for (let id = 0; id < medial.spheres.length / 4; id++) {
    const sphere = sphereOf(medial, id), reach = dot(sphere, direction) + sphere[3] * length;
    if (!(reach > best.distance)) continue;
    best = { distance: reach, point: direction.map((x, k) => sphere[k] + (length > 0 ? (sphere[3] * x) / length : 0)) };
  }
  return best;
}

/** How far along the unit vector `direction` a ray meets the solid (0 from within), with the outward normal; null: not
 * within `most`. Newton's steps on the convex distance to a simplex never step over its surface. */
export function ray(medial, origin, direction, most = Infinity) {
  const size = Math.sqrt(dot(origin, origin)) + 1e-300;
  let hit = null;
  for (const spheres of simplices(medial)) {
    let before = null;
    for (let step = 0, t = 0; step < 100 && t <= most; step++) {
      const p = origin.map((x, k) => x + t * direction[k]), near = toSimplex(spheres, p);
      const gradient = unit(minus(p, near.sphere));
      if (near.distance <= 1e-14 * (size + t)) {
        // On a sphere of no radius rounding decides the gradient: that of the step before is taken.
        hit = { distance: t, normal: before && near.sphere[3] <= 1e-9 * (size + t) ? before : gradient };
        most = t;
        break;
      }
      before = gradient;
      const slope = dot(gradient, direction);
      if (slope >= 0) break;
      t -= near.distance / slope;
    }
  }
  return hit;
}

/** The medial mesh of a node. One that cannot be read is told on the console, and the rest of the model is loaded. */
function ofNode(extras, name) {
  try {
    return ofExtras(extras);
  } catch (error) {
    console.warn(`${name}: ${error.message}`);
    return null;
  }
}

// ---- three.js ----

/** A plugin of GLTFLoader: `loader.register(() => new ThreePlugin())`. Objects of nodes that have a medial mesh get it as
 * `object.medial`. */
export class ThreePlugin {
  name = 'QMAT_medial';
  async afterRoot(gltf) {
    for (const scene of gltf.scenes) {
      scene.traverse((object) => {
        const medial = ofNode(object.userData, object.name);
        if (medial) object.medial = medial;
      });
    }
  }
}

/** A group of meshes that show the spheres (one instanced mesh) and the cones (truncated, from tangent circle to tangent
 * circle); `THREE` is the module. */
export function threeGroup(THREE, medial, material = new THREE.MeshStandardMaterial({ color: 0x7799bb })) {
  const group = new THREE.Group(), n = medial.spheres.length / 4;
  const spheres = new THREE.InstancedMesh(new THREE.IcosahedronGeometry(1, 3), material, n);
  for (let id = 0; id < n; id++) {
    const [x, y, z, r] = sphereOf(medial, id);
    spheres.setMatrixAt(id, new THREE.Matrix4().makeScale(r, r, r).setPosition(x, y, z));
  }
  group.add(spheres);
  const sides = Array.from({ length: medial.slabs.length }, (_, i) => [medial.slabs[i], medial.slabs[i % 3 === 2 ? i - 2 : i + 1]]);
  for (let i = 0; i < medial.cones.length; i += 2) sides.push([medial.cones[i], medial.cones[i + 1]]);
  for (const [i, k] of sides) {
    const a = sphereOf(medial, i), b = sphereOf(medial, k), axis = minus(b, a), length = Math.sqrt(dot(axis, axis));
    const slope = (a[3] - b[3]) / length, rise = Math.sqrt(1 - slope * slope);
    if (!(Math.abs(slope) < 1)) continue; // one sphere is within the other
    const height = length + (b[3] - a[3]) * slope;
    const cone = new THREE.Mesh(new THREE.CylinderGeometry(b[3] * rise, a[3] * rise, height, 24, 1, true), material);
    cone.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...axis).divideScalar(length));
    cone.position.set(...a.slice(0, 3).map((x, q) => x + (axis[q] / length) * (a[3] * slope + height / 2)));
    group.add(cone);
  }
  return group;
}

// ---- Babylon.js ----

/** Makes an extension of Babylon's glTF loader: `registerGLTFExtension('QMAT_medial', false, babylonExtension)`. Nodes
 * that have a medial mesh get it as `node.metadata.medial`. */
export function babylonExtension(loader) {
  return {
    name: 'QMAT_medial',
    enabled: true,
    dispose() {},
    loadNodeAsync(context, node, assign) {
      return loader.loadNodeAsync(context, node, (transformNode) => {
        const medial = ofNode(node.extras, node.name);
        if (medial) transformNode.metadata = { ...transformNode.metadata, medial };
        assign(transformNode);
      });
    },
  };
}

// ---- glTF-Transform ----

/** Extensions that keep KHR_implicit_shapes and KHR_physics_rigid_bodies, which glTF-Transform drops otherwise:
 * `io.registerExtensions(physicsExtensions(core))`, where `core` is the module @gltf-transform/core. References to nodes
 * and meshes are renumbered. The extras with the medial mesh are kept without them; `ofExtras(node.getExtras())` reads
 * them. */
export function physicsExtensions({ Extension, ExtensionProperty, PropertyType, RefList }) {
  const SHAPES = 'KHR_implicit_shapes', BODIES = 'KHR_physics_rigid_bodies';
  // Where a node's extension refers to others; `nodes` is a list.
  const places = [['collider', 'geometry', 'node'], ['collider', 'geometry', 'mesh'], ['trigger', 'geometry', 'node'],
    ['trigger', 'geometry', 'mesh'], ['joint', 'connectedNode'], ['trigger', 'nodes']];
  const copy = (value) => JSON.parse(JSON.stringify(value));
  const ownerOf = (json, place) => place.slice(0, -1).reduce((object, key) => object?.[key], json);

  class Body extends ExtensionProperty {
    init() {
      this.extensionName = BODIES;
      this.propertyType = 'RigidBody';
      this.parentTypes = [PropertyType.NODE];
    }
    getDefaults() {
      return Object.assign(super.getDefaults(), { json: {}, node: null, mesh: null, triggerNode: null, triggerMesh: null,
        connectedNode: null, nodes: new RefList() });
    }
    getJSON() { return this.get('json'); }
    setJSON(json) { return this.set('json', json); }
  }
  const slots = ['node', 'mesh', 'triggerNode', 'triggerMesh', 'connectedNode', 'nodes'];

  class Shapes extends Extension {
    static EXTENSION_NAME = SHAPES;
    extensionName = SHAPES;
    root = null;
    read(context) {
      this.root = copy(context.jsonDoc.json.extensions?.[SHAPES] ?? {});
      return this;
    }
    write(context) {
      if (!this.root) return this;
      const json = context.jsonDoc.json;
      json.extensions = { ...json.extensions, [SHAPES]: copy(this.root) };
      return this;
    }
  }

  class Bodies extends Extension {
    static EXTENSION_NAME = BODIES;
    extensionName = BODIES;
    root = null;
    read(context) {
      const json = context.jsonDoc.json;
      if (json.extensions?.[BODIES]) this.root = copy(json.extensions[BODIES]);
      (json.nodes ?? []).forEach((node, index) => {
        const own = node.extensions?.[BODIES];
        if (!own) return;
        const body = new Body(this.document.getGraph()).setJSON(copy(own));
        places.forEach((place, k) => {
          const value = ownerOf(own, place)?.[place.at(-1)];
          const all = place.at(-1) === 'mesh' ? context.meshes : context.nodes;
          if (k === 5) (value ?? []).forEach((id) => body.addRef('nodes', all[id]));
          else if (value !== undefined) body.setRef(slots[k], all[value]);
        });
        context.nodes[index].setExtension(BODIES, body);
      });
      return this;
    }
    write(context) {
      const json = context.jsonDoc.json;
      if (this.root) json.extensions = { ...json.extensions, [BODIES]: copy(this.root) };
      for (const node of this.document.getRoot().listNodes()) {
        const body = node.getExtension(BODIES);
        if (!body) continue;
        const own = copy(body.getJSON());
        places.forEach((place, k) => {
          const owner = ownerOf(own, place), key = place.at(-1);
          if (owner?.[key] === undefined) return;
          const numbers = key === 'mesh' ? context.meshIndexMap : context.nodeIndexMap;
          if (k === 5) {
            owner[key] = body.listRefs('nodes').map((other) => numbers.get(other));
          } else {
            const other = body.getRef(slots[k]);
            if (other) owner[key] = numbers.get(other);
            else delete owner[key]; // it was disposed of
          }
        });
        const to = json.nodes[context.nodeIndexMap.get(node)];
        to.extensions = { ...to.extensions, [BODIES]: own };
      }
      return this;
    }
  }
  return [Shapes, Bodies];
}
