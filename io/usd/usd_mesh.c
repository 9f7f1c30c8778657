/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_mesh.h"

#include <math.h>
#include <string.h>

#include "core/geometry/joint_weights.h"
#include "io/placement.h"

/* ---- reading ---- */

static qmat_status read_array(const qmat_usd_prim *prim, const char *name, bool numbers, unsigned components,
                              const qmat_usd_value **value) {
  qmat_status status = qmat_usd_prim_attribute(prim, name, value);
  if (status != QMAT_OK || !*value) return status;
  const qmat_usd_value *v = *value;
  bool good = v->is_array && v->components == components &&
              (numbers ? qmat_usd_is_number(v->type) : qmat_usd_is_integer(v->type));
  if (good) return QMAT_OK;
  return qmat_usd_prim_fail(prim, "%s has a value of the wrong type", name);
}

/* One of the words. */
static qmat_status read_choice(const qmat_usd_prim *prim, const char *name, const char *const *words, unsigned count,
                               unsigned otherwise, unsigned *choice) {
  const char *word;
  qmat_status status = qmat_usd_prim_token(prim, name, words[otherwise], &word);
  for (*choice = 0; status == QMAT_OK && *choice < count; ++*choice) {
    if (strcmp(word, words[*choice]) == 0) return QMAT_OK;
  }
  if (status != QMAT_OK) return status;
  return qmat_usd_prim_fail(prim, "%s is '%.40s', which is unknown", name, qmat_usd_shown(word));
}

static size_t count_of(const qmat_usd_value *value) {
  return value ? value->count : 0;
}

/* Reads creases and sharp vertices. A crease of n vertices has n - 1 edges, and one sharpness or n - 1 of them. */
static qmat_status read_sharpness(const qmat_usd_prim *prim, qmat_usd_mesh *mesh) {
  const struct {
    const char *name;
    bool numbers;
    const qmat_usd_value **value;
  } arrays[] = {{"creaseLengths", false, &mesh->crease_lengths},
                {"creaseIndices", false, &mesh->crease_indices},
                {"creaseSharpnesses", true, &mesh->crease_sharpness},
                {"cornerIndices", false, &mesh->sharp_vertices},
                {"cornerSharpnesses", true, &mesh->vertex_sharpness}};
  for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++) {
    qmat_status status = read_array(prim, arrays[i].name, arrays[i].numbers, 1, arrays[i].value);
    if (status != QMAT_OK) return status;
  }
  const size_t lengths = count_of(mesh->crease_lengths), indices = count_of(mesh->crease_indices),
               values = count_of(mesh->crease_sharpness);
  size_t total = 0;
  for (size_t i = 0; i < lengths; i++) {
    const int64_t length = mesh->crease_lengths->integers[i];
    if (length < 2 || (uint64_t)length > indices - total)
      return qmat_usd_prim_fail(prim, "crease %zu has %lld vertices", i, (long long)length);
    total += (size_t)length;
  }
  if (total != indices || (values != lengths && values != indices - lengths)) {
    return qmat_usd_prim_fail(prim, "%zu creases of %zu vertices do not match %zu indices and %zu sharpnesses", lengths,
                              total, indices, values);
  }
  if (count_of(mesh->sharp_vertices) != count_of(mesh->vertex_sharpness)) {
    return qmat_usd_prim_fail(prim, "%zu corners do not match %zu sharpnesses", count_of(mesh->sharp_vertices),
                              count_of(mesh->vertex_sharpness));
  }
  const qmat_usd_value *const ids[] = {mesh->crease_indices, mesh->sharp_vertices}, *const sharpness[] = {
                                                                                        mesh->crease_sharpness,
                                                                                        mesh->vertex_sharpness};
  for (size_t k = 0; k < 2; k++) {
    for (size_t i = 0; i < count_of(ids[k]); i++) {
      if (ids[k]->integers[i] >= 0 && (uint64_t)ids[k]->integers[i] < count_of(mesh->points)) continue;
      return qmat_usd_prim_fail(prim, "a %s refers to vertex %lld, but there are %zu points", k ? "corner" : "crease",
                                (long long)ids[k]->integers[i], count_of(mesh->points));
    }
    for (size_t i = 0; i < count_of(sharpness[k]); i++) {
      if (sharpness[k]->numbers[i] >= 0 && isfinite(sharpness[k]->numbers[i])) continue;
      return qmat_usd_prim_fail(prim, "the sharpness of %s %zu is negative or not finite", k ? "corner" : "crease", i);
    }
  }
  return QMAT_OK;
}

enum { MOST_INFLUENCES = 256 }; /* of a point; choosing the strongest is quadratic */

/* Reads the joints and weights of UsdSkel. Each point has as many influences as elementSize says, or all points share
 * them (a rigid binding). A skin that is no such thing is left out with a warning: the surface does not need it. */
static qmat_status read_skin(const qmat_usd_prim *prim, qmat_usd_mesh *mesh) {
  static const char *const names[] = {"primvars:skel:jointIndices", "primvars:skel:jointWeights"};
  const qmat_usd_value *joints, *weights;
  qmat_status status = qmat_usd_prim_attribute(prim, names[0], &joints);
  if (status == QMAT_OK) status = qmat_usd_prim_attribute(prim, names[1], &weights);
  if (status != QMAT_OK || !joints || !weights || !mesh->points || mesh->points->count == 0) return status;
  const bool typed = joints->is_array && weights->is_array && qmat_usd_is_integer(joints->type) &&
                     qmat_usd_is_number(weights->type) && joints->components == 1 && weights->components == 1 &&
                     joints->count == weights->count && joints->count > 0;
  if (!typed) return qmat_usd_warn(prim, "its joints are left out: %s and %s do not match", names[0], names[1]);
  const qmat_usd_value *size = qmat_usd_prim_metadata(prim, names[0], "elementSize");
  const char *interpolation = qmat_usd_text(qmat_usd_prim_metadata(prim, names[0], "interpolation"));
  const size_t points = mesh->points->count;
  const bool is_rigid = interpolation && strcmp(interpolation, "constant") == 0;
  size_t influences = is_rigid ? joints->count : joints->count / points;
  if (size && qmat_usd_is_integer(size->type) && !size->is_array && size->integers[0] > 0)
    influences = (size_t)size->integers[0];
  if (influences == 0 || influences > MOST_INFLUENCES || joints->count % influences != 0 ||
      joints->count / influences != (is_rigid ? 1 : points)) {
    return qmat_usd_warn(prim, "its joints are left out: %zu values do not make %zu for each of %zu points",
                         joints->count, influences, is_rigid ? (size_t)1 : points);
  }
  mesh->joints = joints;
  mesh->weights = weights;
  mesh->influences = influences;
  return QMAT_OK;
}

qmat_status qmat_usd_mesh_read(const qmat_usd_prim *prim, qmat_usd_mesh *mesh) {
  static const char *const schemes[] = {"none", "catmullClark", "loop", "bilinear"}, *const boundaries[] = {
                                                                                         "none", "edgeOnly",
                                                                                         "edgeAndCorner"};
  const char *handedness;
  unsigned scheme = 0, boundary = 0;
  qmat_status status = read_array(prim, "points", true, 3, &mesh->points);
  if (status == QMAT_OK) status = read_array(prim, "faceVertexCounts", false, 1, &mesh->counts);
  if (status == QMAT_OK) status = read_array(prim, "faceVertexIndices", false, 1, &mesh->indices);
  if (status == QMAT_OK) status = read_array(prim, "holeIndices", false, 1, &mesh->holes);
  if (status == QMAT_OK) status = qmat_usd_prim_token(prim, "orientation", "rightHanded", &handedness);
  if (status == QMAT_OK)
    status = read_choice(prim, "subdivisionScheme", schemes, QMAT_SCHEME_COUNT, QMAT_SCHEME_CATMULL_CLARK, &scheme);
  if (status == QMAT_OK) {
    status = read_choice(prim, "interpolateBoundary", boundaries, QMAT_BOUNDARY_COUNT, QMAT_BOUNDARY_EDGE_AND_CORNER,
                         &boundary);
  }
  if (status == QMAT_OK && scheme != QMAT_SCHEME_NONE) status = read_sharpness(prim, mesh);
  if (status == QMAT_OK) status = read_skin(prim, mesh);
  if (status != QMAT_OK) return status;
  mesh->is_left_handed = strcmp(handedness, "leftHanded") == 0;
  mesh->scheme = (qmat_scheme)scheme;
  mesh->boundary = (qmat_boundary)boundary;
  if (!mesh->points || !mesh->counts || !mesh->indices) return QMAT_OK;
  size_t corners = 0;
  for (size_t f = 0; f < mesh->counts->count; f++) {
    const int64_t count = mesh->counts->integers[f];
    if (count < 0 || (uint64_t)count > mesh->indices->count - corners) {
      return qmat_usd_prim_fail(prim,
                                count < 0 ? "face %zu has a negative number of corners"
                                          : "face %zu has more corners than there are faceVertexIndices",
                                f);
    }
    corners += (size_t)count;
  }
  if (corners != mesh->indices->count) {
    return qmat_usd_prim_fail(prim, "the faces have %zu corners, but there are %zu faceVertexIndices", corners,
                              mesh->indices->count);
  }
  for (size_t i = 0; i < corners; i++) {
    const int64_t index = mesh->indices->integers[i];
    if (index < 0 || (uint64_t)index >= mesh->points->count) {
      return qmat_usd_prim_fail(prim, "corner %zu refers to vertex %lld, but there are %zu points", i, (long long)index,
                                mesh->points->count);
    }
  }
  for (size_t i = 0; mesh->holes && i < mesh->holes->count; i++) {
    const int64_t hole = mesh->holes->integers[i];
    if (hole >= 0 && (uint64_t)hole < mesh->counts->count) continue;
    return qmat_usd_prim_fail(prim, "hole %zu refers to face %lld, but there are %zu faces", i, (long long)hole,
                              mesh->counts->count);
  }
  return QMAT_OK;
}

const char *qmat_usd_mesh_lacks(const qmat_usd_mesh *mesh) {
  if (!mesh->points) return "points";
  if (!mesh->indices) return "faceVertexIndices";
  return mesh->counts && mesh->counts->count > 0 ? NULL : "faces";
}

size_t qmat_usd_mesh_holes(const qmat_usd_mesh *mesh) {
  return count_of(mesh->holes);
}

qmat_status qmat_usd_mesh_digest(const qmat_usd_mesh *mesh, qmat_digest *digest) {
  const qmat_usd_value *const arrays[] = {
      mesh->points,           mesh->counts,         mesh->indices,          mesh->holes,
      mesh->crease_lengths,   mesh->crease_indices, mesh->crease_sharpness, mesh->sharp_vertices,
      mesh->vertex_sharpness, mesh->joints,         mesh->weights};
  qmat_hasher hasher;
  qmat_status status = qmat_hasher_init(&hasher);
  for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
    const size_t count = count_of(arrays[i]);
    qmat_hasher_add(&hasher, &count, sizeof count);
    /* Integers and numbers have 8 bytes each. */
    if (count > 0) qmat_hasher_add(&hasher, arrays[i]->numbers, 8 * count * arrays[i]->components);
  }
  const double rest[] = {mesh->is_left_handed, mesh->scheme, mesh->boundary, mesh->deviation, (double)mesh->influences};
  qmat_hasher_add(&hasher, rest, sizeof rest);
  const qmat_status finished = qmat_hasher_finish(&hasher, digest);
  return status == QMAT_OK ? finished : status;
}

/* ---- adding to a soup ---- */

static qmat_status add_points(qmat_context *context, const qmat_usd_mesh *mesh, const qmat_usd_transform *world,
                              qmat_soup *soup) {
  const double *m = world->m;
  qmat_status status = QMAT_OK;
  for (size_t v = 0; v < mesh->points->count && status == QMAT_OK; v++) {
    const double *p = mesh->points->numbers + 3 * v;
    double point[3];
    for (int k = 0; k < 3; k++) point[k] = p[0] * m[k] + p[1] * m[4 + k] + p[2] * m[8 + k] + m[12 + k];
    status = qmat_soup_add_vertices(context, soup, point, 1);
  }
  return status;
}

static qmat_status add_faces(qmat_context *context, const qmat_usd_mesh *mesh, size_t first_vertex, bool turned,
                             qmat_soup *soup) {
  const size_t faces = mesh->counts->count;
  size_t most = 1, at = 0;
  for (size_t f = 0; f < faces; f++) {
    if ((size_t)mesh->counts->integers[f] > most) most = (size_t)mesh->counts->integers[f];
  }
  bool *is_hole = qmat_calloc(faces, sizeof *is_hole);
  uint32_t *corners = qmat_alloc(most, sizeof *corners);
  qmat_status status = is_hole && corners ? QMAT_OK : qmat_fail_memory(context, "the faces of a mesh");
  for (size_t i = 0; status == QMAT_OK && mesh->holes && i < mesh->holes->count; i++)
    is_hole[mesh->holes->integers[i]] = true;
  for (size_t f = 0; f < faces && status == QMAT_OK; f++) {
    const size_t count = (size_t)mesh->counts->integers[f];
    for (size_t k = 0; k < count; k++) {
      const size_t corner = at + (turned ? count - 1 - k : k);
      corners[k] = (uint32_t)(first_vertex + (size_t)mesh->indices->integers[corner]);
    }
    at += count;
    if (!is_hole[f]) {
      status = qmat_soup_add_facet(context, soup, corners, count, (uint32_t)soup->facet_count, 0);
    }
  }
  qmat_free(corners);
  qmat_free(is_hole);
  return status;
}

/* Adds the polygons of the mesh to the soup's cage. Its points are in the soup from `first_vertex` on. */
static qmat_status add_cage(qmat_context *context, const qmat_usd_mesh *mesh, size_t first_vertex, bool turned,
                            qmat_soup *soup) {
  const size_t faces = mesh->counts->count, corners = mesh->indices->count, holes = count_of(mesh->holes),
               creases = count_of(mesh->crease_indices) - count_of(mesh->crease_lengths),
               sharp = count_of(mesh->sharp_vertices);
  uint32_t scheme = mesh->scheme, boundary = mesh->boundary, face_count = (uint32_t)faces;
  qmat_arena arena = {0};
  qmat_cage cage = {
      .surface_count = 1,
      .surface_faces = &face_count,
      .schemes = &scheme,
      .boundaries = &boundary,
      .vertex_count = mesh->points->count,
      .positions = soup->positions + 3 * first_vertex,
      .face_count = faces,
      .face_sizes = qmat_arena_alloc(&arena, faces, sizeof(uint32_t)),
      .corner_count = corners,
      .corners = qmat_arena_alloc(&arena, corners, sizeof(uint32_t)),
      .hole_count = holes,
      .holes = qmat_arena_alloc(&arena, holes, sizeof(uint32_t)),
      .crease_count = creases,
      .creases = qmat_arena_alloc(&arena, creases, 2 * sizeof(uint32_t)),
      .crease_sharpness = qmat_arena_alloc(&arena, creases, sizeof(double)),
      .sharp_count = sharp,
      .sharp_vertices = qmat_arena_alloc(&arena, sharp, sizeof(uint32_t)),
      .vertex_sharpness = qmat_arena_alloc(&arena, sharp, sizeof(double)),
  };
  qmat_status status = QMAT_OK;
  if (!cage.face_sizes || !cage.corners || !cage.holes || !cage.creases || !cage.crease_sharpness ||
      !cage.sharp_vertices || !cage.vertex_sharpness || faces > UINT32_MAX) {
    status = qmat_fail_memory(context, "the cage of a subdivision surface");
    goto done;
  }
  size_t at = 0;
  for (size_t f = 0; f < faces; f++) {
    const size_t count = (size_t)mesh->counts->integers[f];
    cage.face_sizes[f] = (uint32_t)count;
    for (size_t k = 0; k < count; k++)
      cage.corners[at + k] = (uint32_t)mesh->indices->integers[at + (turned ? count - 1 - k : k)];
    at += count;
  }
  for (size_t i = 0; i < holes; i++) cage.holes[i] = (uint32_t)mesh->holes->integers[i];
  size_t edge = 0, vertex = 0;
  const bool per_edge = creases > 0 && mesh->crease_sharpness->count == creases;
  for (size_t i = 0; i < count_of(mesh->crease_lengths); i++) {
    for (int64_t k = 1; k < mesh->crease_lengths->integers[i]; k++, vertex++, edge++) {
      cage.creases[2 * edge] = (uint32_t)mesh->crease_indices->integers[vertex];
      cage.creases[2 * edge + 1] = (uint32_t)mesh->crease_indices->integers[vertex + 1];
      cage.crease_sharpness[edge] = mesh->crease_sharpness->numbers[per_edge ? edge : i];
    }
    vertex++;
  }
  for (size_t i = 0; i < sharp; i++) {
    cage.sharp_vertices[i] = (uint32_t)mesh->sharp_vertices->integers[i];
    cage.vertex_sharpness[i] = mesh->vertex_sharpness->numbers[i];
  }
  status = qmat_soup_add_cage(context, soup, &cage);
done:
  qmat_arena_uninit(&arena);
  return status;
}

qmat_status qmat_usd_mesh_add_skin(qmat_context *context, const qmat_usd_mesh *mesh, qmat_soup *soup) {
  if (!mesh->joints) return QMAT_OK;
  const size_t points = mesh->points->count, influences = mesh->influences;
  const bool is_rigid = mesh->joints->count == influences;
  uint32_t *joints = qmat_alloc(4 * points, sizeof *joints), *own = qmat_alloc(influences, sizeof *own);
  double *weights = qmat_alloc(4 * points, sizeof *weights);
  qmat_status status = joints && own && weights ? QMAT_OK : qmat_fail_memory(context, "the joints of a mesh");
  for (size_t v = 0; v < points && status == QMAT_OK; v++) {
    const size_t first = is_rigid ? 0 : influences * v;
    for (size_t i = 0; i < influences; i++) {
      const int64_t joint = mesh->joints->integers[first + i];
      own[i] = joint >= 0 && joint < UINT32_MAX ? (uint32_t)joint : UINT32_MAX;
    }
    qmat_strongest_joints(own, mesh->weights->numbers + first, influences, joints + 4 * v, weights + 4 * v);
  }
  if (status == QMAT_OK) status = qmat_soup_add_skin(context, soup, joints, weights, points);
  qmat_free(joints);
  qmat_free(own);
  qmat_free(weights);
  return status;
}

qmat_status qmat_usd_mesh_add(qmat_context *context, const qmat_usd_mesh *mesh, const qmat_usd_transform *world,
                              qmat_soup *soup) {
  const size_t first = soup->vertex_count;
  /* A mirror turns a left-handed mesh into a right-handed one. */
  const bool turned = mesh->is_left_handed != qmat_usd_mirrors(world);
  qmat_status status = qmat_soup_reserve(context, soup, mesh->points->count, mesh->counts->count, mesh->indices->count);
  if (status == QMAT_OK) status = add_points(context, mesh, world, soup);
  if (status == QMAT_OK) status = add_faces(context, mesh, first, turned, soup);
  if (mesh->deviation > 0) soup->deviation = fmax(soup->deviation, mesh->deviation * qmat_placement_stretch(world->m));
  return status == QMAT_OK ? add_cage(context, mesh, first, turned, soup) : status;
}
