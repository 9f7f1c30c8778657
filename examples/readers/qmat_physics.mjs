// SPDX-FileCopyrightText: 2026 the qmat authors
// SPDX-License-Identifier: MIT
//
// Reads the colliders in glTF files (KHR_implicit_shapes and KHR_physics_rigid_bodies), as qmat and others write them, and
// gives them to a physics engine: Rapier, Jolt or Bullet (ammo.js). Nothing is imported. Lengths are those of the file
// times `scale`, masses those of the file.

// ---- matrices, by columns ----

const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

function product(a, b) {
  return Array.from({ length: 16 }, (_, i) => [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + (i % 4)] * b[4 * (i >> 2) + k], 0));
}

function local({ matrix, translation: t = [0, 0, 0], rotation: [x, y, z, w] = [0, 0, 0, 1], scale: s = [1, 1, 1] }) {
  if (matrix) return matrix;
  return [
    s[0] * (1 - 2 * (y * y + z * z)), s[0] * 2 * (x * y + z * w), s[0] * 2 * (x * z - y * w), 0,
    s[1] * 2 * (x * y - z * w), s[1] * (1 - 2 * (x * x + z * z)), s[1] * 2 * (y * z + x * w), 0,
    s[2] * 2 * (x * z + y * w), s[2] * 2 * (y * z - x * w), s[2] * (1 - 2 * (x * x + y * y)), 0, ...t, 1];
}

/** A point by a matrix. */
export function moved(m, [x, y, z]) {
  return [0, 1, 2].map((k) => m[k] * x + m[4 + k] * y + m[8 + k] * z + m[12 + k]);
}

const size = (m) => Math.cbrt(Math.abs(m[0] * (m[5] * m[10] - m[6] * m[9]) - m[4] * (m[1] * m[10] - m[2] * m[9]) +
  m[8] * (m[1] * m[6] - m[2] * m[5])));

// ---- the file ----

/** The JSON of a .glb (an ArrayBuffer or a Uint8Array), and its binary chunk. */
export function openGlb(data) {
  const bytes = data instanceof Uint8Array ? data : new Uint8Array(data);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 20 || view.getUint32(0, true) !== 0x46546c67) throw new Error('not a .glb');
  const length = view.getUint32(12, true), start = 28 + length;
  if (start - 8 > bytes.length) throw new Error('the .glb is damaged');
  return { json: JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + length))),
    binary: start < bytes.length ? bytes.subarray(start, start + view.getUint32(20 + length, true)) : null };
}

/** The positions of a mesh that keeps them as floats in the binary chunk. */
export function positionsOf({ json, binary }, mesh) {
  const points = [];
  for (const primitive of json.meshes[mesh].primitives) {
    const accessor = json.accessors[primitive.attributes.POSITION], view = json.bufferViews[accessor.bufferView];
    const at = (view.byteOffset ?? 0) + (accessor.byteOffset ?? 0), step = view.byteStride ?? 12;
    const data = new DataView(binary.buffer, binary.byteOffset);
    for (let i = 0; i < accessor.count; i++) points.push([0, 4, 8].map((k) => data.getFloat32(at + step * i + k, true)));
  }
  return points;
}

/** The bodies of a file that openGlb opened. Each has its `node`, its `matrix` into the scene, its `motion` (null: it does
 * not move; `isKinematic`, `mass`, `centerOfMass`, `inertiaDiagonal`, `inertiaOrientation`) and its `shapes` in the space of the node:
 * { center, radius }, a capsule { ends: [[x, y, z, radius], ...] }, or a convex hull { points }. */
export function bodiesOf(file) {
  const { json } = file, nodes = json.nodes ?? [];
  const shapes = json.extensions?.KHR_implicit_shapes?.shapes ?? [], bodies = [];
  const physics = (node) => node.extensions?.KHR_physics_rigid_bodies;
  const shapeOf = (geometry, m) => {
    if (geometry.node !== undefined || geometry.mesh !== undefined) {
      if (!geometry.convexHull) throw new Error('only convex hulls of meshes are read');
      const mesh = geometry.mesh ?? nodes[geometry.node].mesh;
      return { points: positionsOf(file, mesh).map((p) => moved(m, p)) };
    }
    const shape = shapes[geometry.shape], of = shape[shape.type];
    if (shape.type === 'sphere') return { center: moved(m, [0, 0, 0]), radius: size(m) * (of.radius ?? 0.5) };
    if (shape.type === 'capsule') {
      const [height, bottom, top] = [of.height ?? 0.5, of.radiusBottom ?? 0.25, of.radiusTop ?? 0.25];
      return { ends: [[...moved(m, [0, -height / 2, 0]), size(m) * bottom], [...moved(m, [0, height / 2, 0]), size(m) * top]] };
    }
    throw new Error(`shapes of type ${shape.type} are not read`);
  };
  const visit = (id, above, body, within) => {
    const node = nodes[id], own = physics(node), matrix = product(above, local(node));
    let inner = product(within, local(node));
    if (own?.motion || (own?.collider && !body)) {
      body = { node: id, matrix, motion: own.motion ?? null, shapes: [] };
      bodies.push(body);
      inner = identity;
    }
    if (own?.collider) body.shapes.push(shapeOf(own.collider.geometry, inner));
    for (const child of node.children ?? []) visit(child, matrix, body, inner);
  };
  const children = new Set(nodes.flatMap((node) => node.children ?? []));
  const roots = json.scenes?.[json.scene ?? 0]?.nodes ?? nodes.keys();
  for (const id of roots) if (!children.has(id)) visit(id, identity, null, identity);
  return bodies;
}

// ---- shapes ----

/** Points whose convex hull contains a sphere [x, y, z, radius] and is at most 4.5 % larger: a cube's face grid, thrown onto
 * the sphere. */
function around([x, y, z, r]) {
  const points = [], grid = [-1, -0.45, 0, 0.45, 1];
  for (const a of grid) for (const b of grid) for (const c of grid) {
    if (Math.max(Math.abs(a), Math.abs(b), Math.abs(c)) < 1) continue;
    const s = (1.045 * r) / Math.hypot(a, b, c);
    points.push([x + s * a, y + s * b, z + s * c]);
  }
  return points;
}

const isCapsule = ([a, b]) => Math.abs(a[3] - b[3]) < 1e-3 * Math.max(a[3], b[3]);
const axisOf = ([a, b]) => [0, 1, 2].map((k) => b[k] - a[k]);

/** The rotation of the y axis onto `d`, as a quaternion. */
function turn(d) {
  const length = Math.hypot(...d);
  if (!(length > 0)) return [0, 0, 0, 1];
  const [x, y, z] = d.map((v) => v / length);
  if (y < -0.999999) return [1, 0, 0, 0];
  const w = Math.sqrt((1 + y) / 2);
  return [z / (2 * w), 0, -x / (2 * w), w];
}

const middle = ([a, b]) => [0, 1, 2].map((k) => (a[k] + b[k]) / 2);
const grown = (shape, s) => (shape.points ? { points: shape.points.map((p) => p.map((v) => s * v)) } :
  shape.ends ? { ends: shape.ends.map((p) => p.map((v) => s * v)) } :
    { center: shape.center.map((v) => s * v), radius: s * shape.radius });

/** Mass, centre and inertia about it for a body in other units of length, `s` of them to one of its node. A stated inertia is
 * in kg m^2, whatever the scale of the node. A body whose file states no mass has mass 1 and the inertia of the box around its
 * shapes. A body that forces do not move keeps the frame of its node. */
function motionOf(body, s) {
  const m = body.motion, mass = m?.mass ?? 1, low = [Infinity, Infinity, Infinity], high = low.map((v) => -v);
  const reach = (p, r) => p.forEach((v, k) => { low[k] = Math.min(low[k], v - r); high[k] = Math.max(high[k], v + r); });
  for (const { points = [], ends = [], center, radius } of body.shapes) {
    for (const p of points) reach(p, 0);
    for (const [x, y, z, r] of ends) reach([x, y, z], r);
    if (center) reach(center, radius);
  }
  const sides = high.map((v, k) => (v - low[k]) ** 2), total = sides[0] + sides[1] + sides[2];
  const meters = size(body.matrix); // of a unit of the node
  const inertia = (m?.inertiaDiagonal?.map((v) => v / meters ** 2) ?? sides.map((v) => (mass * (total - v)) / 12)).map((v) => v * s * s);
  if (!isDynamic(body)) return { mass, inertia, centre: [0, 0, 0], frame: [0, 0, 0, 1] };
  const centre = m?.centerOfMass ?? (m?.mass === undefined ? high.map((v, k) => (v + low[k]) / 2) : [0, 0, 0]);
  return { mass, inertia, centre: centre.map((v) => s * v), frame: m?.inertiaOrientation ?? [0, 0, 0, 1] };
}

/** Whether forces move a body. The colliders of a skinned mesh are kinematic: their joints move them. */
const isDynamic = ({ motion }) => Boolean(motion) && !motion.isKinematic;

// ---- Rapier ----

const xyz = ([x, y, z]) => ({ x, y, z });

/** Adds a body to a world of Rapier at a place. Tapered capsules become hulls. */
export function addToRapier(RAPIER, world, body, { at = [0, 0, 0], rotation = [0, 0, 0, 1], scale = 1, friction = 0.7 } = {}) {
  const { mass, inertia, centre, frame } = motionOf(body, scale), quaternion = ([x, y, z, w]) => ({ x, y, z, w });
  const desc = isDynamic(body) ? RAPIER.RigidBodyDesc.dynamic() :
    body.motion ? RAPIER.RigidBodyDesc.kinematicPositionBased() : RAPIER.RigidBodyDesc.fixed();
  desc.setTranslation(...at).setRotation(quaternion(rotation)).setCcdEnabled(true);
  if (isDynamic(body)) desc.setAdditionalMassProperties(mass, xyz(centre), xyz(inertia), quaternion(frame));
  const made = world.createRigidBody(desc);
  for (const shape of body.shapes.map((one) => grown(one, scale))) {
    let of;
    if (shape.radius) of = RAPIER.ColliderDesc.ball(shape.radius).setTranslation(...shape.center);
    else if (shape.ends && isCapsule(shape.ends)) {
      of = RAPIER.ColliderDesc.capsule(Math.hypot(...axisOf(shape.ends)) / 2, shape.ends[0][3])
        .setTranslation(...middle(shape.ends)).setRotation(quaternion(turn(axisOf(shape.ends))));
    } else of = RAPIER.ColliderDesc.convexHull(new Float32Array((shape.points ?? shape.ends.flatMap(around)).flat()));
    if (!of) throw new Error('Rapier refuses a shape');
    world.createCollider(of.setDensity(0).setFriction(friction), made);
  }
  return made;
}

// ---- Jolt ----

/** Adds a body to a PhysicsSystem of Jolt at a place; `layer` is the object layer. */
export function addToJolt(Jolt, system, body, { at = [0, 0, 0], rotation = [0, 0, 0, 1], scale = 1, friction = 0.7, layer = 1 } = {}) {
  const { mass, inertia, centre, frame } = motionOf(body, scale), compound = new Jolt.StaticCompoundShapeSettings();
  const vec = (p) => new Jolt.Vec3(...p), add = (p, q, settings) => compound.AddShape(vec(p), new Jolt.Quat(...q), settings, 0);
  for (const shape of body.shapes.map((one) => grown(one, scale))) {
    if (shape.radius) add(shape.center, [0, 0, 0, 1], new Jolt.SphereShapeSettings(shape.radius));
    else if (shape.ends) {
      const [a, b] = shape.ends, half = Math.hypot(...axisOf(shape.ends)) / 2;
      add(middle(shape.ends), turn(axisOf(shape.ends)), isCapsule(shape.ends) ? new Jolt.CapsuleShapeSettings(half, a[3]) :
        new Jolt.TaperedCapsuleShapeSettings(half, b[3], a[3]));
    } else {
      const hull = new Jolt.ConvexHullShapeSettings();
      for (const p of shape.points) hull.mPoints.push_back(vec(p));
      hull.mMaxConvexRadius = 0;
      add([0, 0, 0], [0, 0, 0, 1], hull);
    }
  }
  const result = compound.Create();
  if (result.HasError()) throw new Error(`Jolt refuses a shape: ${result.GetError().c_str()}`);
  const inner = result.Get(), own = inner.GetCenterOfMass();
  const shape = isDynamic(body) ? new Jolt.OffsetCenterOfMassShape(inner, vec([centre[0] - own.GetX(), centre[1] - own.GetY(), centre[2] - own.GetZ()])) : inner;
  const settings = new Jolt.BodyCreationSettings(shape, new Jolt.RVec3(...at), new Jolt.Quat(...rotation),
    isDynamic(body) ? Jolt.EMotionType_Dynamic : body.motion ? Jolt.EMotionType_Kinematic : Jolt.EMotionType_Static, body.motion ? layer : 0);
  if (isDynamic(body)) {
    // The tensor R diag(inertia) R^T, by columns.
    const r = local({ rotation: frame }), column = (j) => [0, 1, 2].map((i) => [0, 1, 2].reduce((sum, k) => sum + r[4 * k + i] * inertia[k] * r[4 * k + j], 0));
    const tensor = Jolt.Mat44.prototype.sIdentity();
    [0, 1, 2].forEach((j) => tensor.SetColumn4(j, new Jolt.Vec4(...column(j), 0)));
    settings.mOverrideMassProperties = Jolt.EOverrideMassProperties_MassAndInertiaProvided;
    settings.mMassPropertiesOverride.mMass = mass;
    settings.mMassPropertiesOverride.mInertia = tensor;
    settings.mMotionQuality = Jolt.EMotionQuality_LinearCast;
  }
  settings.mFriction = friction;
  settings.mUseManifoldReduction = false; // it leaves four contacts of a whole compound, and the body sinks between them
  const made = system.GetBodyInterface().CreateBody(settings);
  system.GetBodyInterface().AddBody(made.GetID(), Jolt.EActivation_Activate);
  return made;
}

// ---- Bullet ----

const times = ([ax, ay, az, aw], [bx, by, bz, bw]) => [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
  aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz];
const opposite = ([x, y, z, w]) => [-x, -y, -z, w];
const rotated = (q, p) => moved(local({ rotation: q }), p);

/** Adds a body to a btDiscreteDynamicsWorld of ammo.js at a place. Bullet's frame of a body is that of its inertia:
 * `pose()` gives the position and rotation of the file's frame, each as an array. */
export function addToBullet(Ammo, world, body, { at = [0, 0, 0], rotation = [0, 0, 0, 1], scale = 1, friction = 0.7 } = {}) {
  const { mass, inertia, centre, frame } = motionOf(body, scale), back = opposite(frame), compound = new Ammo.btCompoundShape(true);
  const vec = (p) => new Ammo.btVector3(...p);
  const reaches = body.shapes.map(({ points, ends, radius }) => (points ?? ends ?? [[radius]]).flat().reduce((most, v) => Math.max(most, Math.abs(v)), 0));
  const margin = 1e-4 * scale * reaches.reduce((most, v) => Math.max(most, v), 0);
  const transform = (p, q) => new Ammo.btTransform(new Ammo.btQuaternion(...q), vec(p));
  const inner = (p) => rotated(back, p.map((v, k) => v - centre[k]));
  for (const shape of body.shapes.map((one) => grown(one, scale))) {
    if (shape.radius) compound.addChildShape(transform(inner(shape.center), [0, 0, 0, 1]), new Ammo.btSphereShape(shape.radius));
    else if (shape.ends && isCapsule(shape.ends)) {
      const of = new Ammo.btCapsuleShape(shape.ends[0][3], Math.hypot(...axisOf(shape.ends)));
      compound.addChildShape(transform(inner(middle(shape.ends)), times(back, turn(axisOf(shape.ends)))), of);
    } else {
      const hull = new Ammo.btConvexHullShape(), points = shape.points ?? shape.ends.flatMap(around);
      points.forEach((p, i) => hull.addPoint(vec(inner(p)), i === points.length - 1));
      hull.setMargin(margin);
      compound.addChildShape(transform([0, 0, 0], [0, 0, 0, 1]), hull);
    }
  }
  const turned = times(rotation, frame), start = rotated(rotation, centre).map((v, k) => v + at[k]);
  const info = new Ammo.btRigidBodyConstructionInfo(isDynamic(body) ? mass : 0, new Ammo.btDefaultMotionState(transform(start, turned)),
    compound, vec(isDynamic(body) ? inertia : [0, 0, 0]));
  info.set_m_friction(friction);
  const made = new Ammo.btRigidBody(info);
  if (body.motion?.isKinematic) {
    made.setCollisionFlags(made.getCollisionFlags() | 2); // CF_KINEMATIC_OBJECT
    made.setActivationState(4); // DISABLE_DEACTIVATION
  }
  world.addRigidBody(made);
  const pose = () => {
    const of = made.getWorldTransform(), p = of.getOrigin(), q = of.getRotation();
    const whole = times([q.x(), q.y(), q.z(), q.w()], back), away = rotated(whole, centre);
    return [[p.x() - away[0], p.y() - away[1], p.z() - away[2]], whole];
  };
  return { body: made, pose };
}
