/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_scene.h"

#include <math.h>
#include <string.h>

#include "io/usd/usd_stage.h"
#include "io/usd/usd_transform.h"

#define FREE_ELEMENTS ((size_t)1 << 24)
#define ELEMENTS_PER_BYTE 16

/* What a prim inherits from its parent. */
typedef struct inherited {
  qmat_usd_transform world;
  const char *purpose; /* "default" when no prim above has one */
} inherited;

typedef struct reader {
  qmat_context *context;
  qmat_usd_stage *stage;
  qmat_soup *soup;
  size_t elements;      /* vertices and corners that were placed */
  bool takes_undefined; /* also reads prims that only have an 'over' */
  bool has_undefined;   /* such a prim was found */
  size_t prims, meshes, cages, holes, instances, prims_skipped, shapes_skipped;
} reader;

/* ---- meshes ---- */

/* The arrays of a mesh; NULL for those that it lacks. */
typedef struct usd_mesh {
  const qmat_usd_value *points, *counts, *indices, *holes;
  const qmat_usd_value *crease_lengths, *crease_indices, *crease_sharpness, *sharp_vertices, *vertex_sharpness;
  bool is_left_handed;
  qmat_scheme scheme;
  qmat_boundary boundary;
} usd_mesh;

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

static qmat_status read_token(const qmat_usd_prim *prim, const char *name, const char *otherwise, const char **token) {
  const qmat_usd_value *value;
  qmat_status status = qmat_usd_prim_attribute(prim, name, &value);
  *token = value && qmat_usd_text(value) ? qmat_usd_text(value) : otherwise;
  return status;
}

/* One of the words. */
static qmat_status read_choice(const qmat_usd_prim *prim, const char *name, const char *const *words, unsigned count,
                               unsigned otherwise, unsigned *choice) {
  const char *word;
  qmat_status status = read_token(prim, name, words[otherwise], &word);
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
static qmat_status read_sharpness(const qmat_usd_prim *prim, usd_mesh *mesh) {
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

static qmat_status read_mesh(const qmat_usd_prim *prim, usd_mesh *mesh) {
  static const char *const schemes[] = {"none", "catmullClark", "loop", "bilinear"}, *const boundaries[] = {
                                                                                         "none", "edgeOnly",
                                                                                         "edgeAndCorner"};
  const char *handedness;
  unsigned scheme = 0, boundary = 0;
  qmat_status status = read_array(prim, "points", true, 3, &mesh->points);
  if (status == QMAT_OK) status = read_array(prim, "faceVertexCounts", false, 1, &mesh->counts);
  if (status == QMAT_OK) status = read_array(prim, "faceVertexIndices", false, 1, &mesh->indices);
  if (status == QMAT_OK) status = read_array(prim, "holeIndices", false, 1, &mesh->holes);
  if (status == QMAT_OK) status = read_token(prim, "orientation", "rightHanded", &handedness);
  if (status == QMAT_OK)
    status = read_choice(prim, "subdivisionScheme", schemes, QMAT_SCHEME_COUNT, QMAT_SCHEME_CATMULL_CLARK, &scheme);
  if (status == QMAT_OK) {
    status = read_choice(prim, "interpolateBoundary", boundaries, QMAT_BOUNDARY_COUNT, QMAT_BOUNDARY_EDGE_AND_CORNER,
                         &boundary);
  }
  if (status == QMAT_OK && scheme != QMAT_SCHEME_NONE) status = read_sharpness(prim, mesh);
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

static qmat_status add_points(reader *r, const usd_mesh *mesh, const qmat_usd_transform *world) {
  const double *m = world->m;
  qmat_status status = QMAT_OK;
  for (size_t v = 0; v < mesh->points->count && status == QMAT_OK; v++) {
    const double *p = mesh->points->numbers + 3 * v;
    double point[3];
    for (int k = 0; k < 3; k++) point[k] = p[0] * m[k] + p[1] * m[4 + k] + p[2] * m[8 + k] + m[12 + k];
    status = qmat_soup_add_vertices(r->context, r->soup, point, 1);
  }
  return status;
}

static qmat_status add_faces(reader *r, const usd_mesh *mesh, size_t first_vertex, bool turned) {
  const size_t faces = mesh->counts->count;
  size_t most = 1, at = 0;
  for (size_t f = 0; f < faces; f++) {
    if ((size_t)mesh->counts->integers[f] > most) most = (size_t)mesh->counts->integers[f];
  }
  bool *is_hole = qmat_calloc(faces, sizeof *is_hole);
  uint32_t *corners = qmat_alloc(most, sizeof *corners);
  qmat_status status = is_hole && corners ? QMAT_OK : qmat_fail_memory(r->context, "the faces of a mesh");
  for (size_t i = 0; status == QMAT_OK && mesh->holes && i < mesh->holes->count; i++)
    is_hole[mesh->holes->integers[i]] = true;
  for (size_t f = 0; f < faces && status == QMAT_OK; f++) {
    const size_t count = (size_t)mesh->counts->integers[f];
    for (size_t k = 0; k < count; k++) {
      const size_t corner = at + (turned ? count - 1 - k : k);
      corners[k] = (uint32_t)(first_vertex + (size_t)mesh->indices->integers[corner]);
    }
    at += count;
    if (is_hole[f]) {
      r->holes++;
    } else {
      status = qmat_soup_add_facet(r->context, r->soup, corners, count, (uint32_t)r->soup->facet_count, 0);
    }
  }
  qmat_free(corners);
  qmat_free(is_hole);
  return status;
}

/* Adds the polygons of the mesh to the soup's cage. Its points are in the soup from `first_vertex` on. */
static qmat_status add_cage(reader *r, const usd_mesh *mesh, size_t first_vertex, bool turned) {
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
      .positions = r->soup->positions + 3 * first_vertex,
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
    status = qmat_fail_memory(r->context, "the cage of a subdivision surface");
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
  status = qmat_soup_add_cage(r->context, r->soup, &cage);
done:
  qmat_arena_uninit(&arena);
  return status;
}

static qmat_status place_mesh(reader *r, const qmat_usd_prim *prim, const inherited *state) {
  usd_mesh mesh = {0};
  qmat_status status = read_mesh(prim, &mesh);
  if (status != QMAT_OK) return status;
  if (!mesh.points || !mesh.counts || !mesh.indices || mesh.counts->count == 0) {
    return qmat_usd_warn(prim, "the mesh has no %s",
                         !mesh.points    ? "points"
                         : !mesh.indices ? "faceVertexIndices"
                                         : "faces");
  }
  const size_t elements = mesh.points->count + mesh.indices->count, first = r->soup->vertex_count;
  const size_t justified = FREE_ELEMENTS + ELEMENTS_PER_BYTE * qmat_usd_stage_bytes(r->stage);
  if (elements > justified - r->elements || mesh.points->count > UINT32_MAX - first) {
    qmat_usd_prim_fail(prim, "the copies of meshes have more vertices than the files justify");
    r->context->error.status = QMAT_ERROR_GEOMETRY;
    return QMAT_ERROR_GEOMETRY;
  }
  r->elements += elements;
  if (mesh.scheme != QMAT_SCHEME_NONE) r->cages++;
  if (qmat_usd_prim_has_relationship(prim, "skel:skeleton"))
    status = qmat_usd_warn(prim, "its skeleton is ignored: the mesh keeps its modelled pose");
  r->meshes++;
  if (status == QMAT_OK)
    status = qmat_soup_reserve(r->context, r->soup, mesh.points->count, mesh.counts->count, mesh.indices->count);
  if (status == QMAT_OK) status = add_points(r, &mesh, &state->world);
  /* A mirror turns a left-handed mesh into a right-handed one. */
  const bool turned = mesh.is_left_handed != qmat_usd_mirrors(&state->world);
  if (status == QMAT_OK) status = add_faces(r, &mesh, first, turned);
  return status == QMAT_OK ? add_cage(r, &mesh, first, turned) : status;
}

/* ---- prims ---- */

/* Whether the type is geometry other than a mesh. */
static bool is_other_shape(const char *type) {
  static const char *const types[] = {
      "Sphere", "Cube",        "Cylinder",   "Cylinder_1", "Cone",        "Capsule",       "Capsule_1", "Plane",
      "Points", "BasisCurves", "NurbsPatch", "TetMesh",    "NurbsCurves", "HermiteCurves", "Volume",    "Field3DAsset"};
  for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
    if (strcmp(type, types[i]) == 0) return true;
  }
  return false;
}

/* Whether the prim and all prims below it are skipped. Updates the inherited purpose. */
static qmat_status find_skipped(reader *r, const qmat_usd_prim *prim, inherited *state, bool *skipped) {
  const char *visibility, *purpose;
  *skipped = true;
  if (!qmat_usd_truth(qmat_usd_prim_field(prim, "active"), true)) {
    r->prims_skipped++;
    return QMAT_OK;
  }
  const char *specifier = qmat_usd_prim_specifier(prim);
  qmat_status status = QMAT_OK;
  if (strcmp(specifier, "class") == 0) return QMAT_OK;
  if (strcmp(specifier, "over") == 0) {
    r->has_undefined = true;
    status =
        qmat_usd_warn(prim, r->takes_undefined ? "read although nothing defines it: the scene has only an 'over' of it"
                                               : "skipped with all prims below it: nothing defines this 'over'");
    if (status != QMAT_OK || !r->takes_undefined) return status;
  }
  status = read_token(prim, "visibility", "inherited", &visibility);
  if (status == QMAT_OK) status = read_token(prim, "purpose", state->purpose, &purpose);
  if (status != QMAT_OK) return status;
  state->purpose = purpose;
  *skipped = strcmp(visibility, "invisible") == 0;
  if (*skipped) r->prims_skipped++;
  return QMAT_OK;
}

static bool is_for_rendering(const char *purpose) {
  return strcmp(purpose, "default") == 0 || strcmp(purpose, "render") == 0;
}

static qmat_status read_shape(reader *r, const qmat_usd_prim *prim, const char *type, const inherited *state) {
  const bool is_mesh = strcmp(type, "Mesh") == 0;
  if (!is_mesh && !is_other_shape(type)) return QMAT_OK;
  if (!is_for_rendering(state->purpose)) {
    r->prims_skipped++;
    return QMAT_OK;
  }
  if (is_mesh) return place_mesh(r, prim, state);
  r->shapes_skipped++;
  return qmat_usd_warn(prim, "skipped: a %s is not a mesh", type);
}

static qmat_status read_prim(reader *r, qmat_usd_prim *prim, inherited state);

static qmat_status read_children(reader *r, qmat_usd_prim *prim, const inherited *state) {
  const char *const *names;
  size_t count;
  qmat_status status = qmat_usd_prim_children(prim, &names, &count);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    qmat_usd_prim child;
    status = qmat_usd_prim_child(r->stage, prim, names[i], &child);
    if (status == QMAT_OK) status = read_prim(r, &child, *state);
    qmat_usd_prim_uninit(&child);
  }
  return status;
}

static qmat_status read_prim(reader *r, qmat_usd_prim *prim, inherited state) {
  bool skipped;
  r->prims++;
  if (r->prims % 1024 == 0) {
    qmat_status status = qmat_progress(r->context, r->prims, 0, "prims");
    if (status != QMAT_OK) return status;
  }
  qmat_status status = find_skipped(r, prim, &state, &skipped);
  if (status != QMAT_OK || skipped) return status;
  const char *type = qmat_usd_text(qmat_usd_prim_field(prim, "typeName"));
  if (!type) type = "";
  if (qmat_usd_truth(qmat_usd_prim_field(prim, "instanceable"), false)) r->instances++;
  status = qmat_usd_read_transform(prim, type, &state.world);
  if (status != QMAT_OK) return status;
  if (strcmp(type, "PointInstancer") == 0) {
    r->shapes_skipped++;
    return qmat_usd_warn(prim, "skipped with all prims below it: a PointInstancer is not expanded");
  }
  status = read_shape(r, prim, type, &state);
  return status == QMAT_OK ? read_children(r, prim, &state) : status;
}

static qmat_status fill_report(const reader *r, json_t *report) {
  const qmat_usd_spec *root = qmat_usd_stage_root_layer(r->stage)->root;
  const struct {
    const char *key;
    size_t count;
  } rows[] = {
      {"layers_read", qmat_usd_stage_layer_count(r->stage)},
      {"prims_read", r->prims},
      {"meshes_placed", r->meshes},
      {"cages", r->cages},
      {"holes", r->holes},
      {"instances", r->instances},
      {"prims_skipped", r->prims_skipped},
      {"shapes_skipped", r->shapes_skipped},
  };
  for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
    if (json_object_set_new(report, rows[i].key, json_integer((json_int_t)rows[i].count)) != 0)
      return qmat_fail_memory(r->context, "a report");
  }
  /* The defaults are those of USD. */
  const double unit = qmat_usd_number(qmat_usd_field_value(root, "metersPerUnit"), 0.01);
  const char *up = qmat_usd_text(qmat_usd_field_value(root, "upAxis"));
  const bool is_z = up && strcmp(up, "Z") == 0;
  if (json_object_set_new(report, "meters_per_unit", json_real(isfinite(unit) ? unit : 0.01)) != 0 ||
      json_object_set_new(report, "up_axis", json_string(is_z ? "Z" : "Y")) != 0 ||
      json_object_set(report, "warnings", qmat_usd_stage_warnings(r->stage)) != 0) {
    return qmat_fail_memory(r->context, "a report");
  }
  return QMAT_OK;
}

static qmat_status check_any(const reader *r, const char *path) {
  if (r->meshes > 0) return QMAT_OK;
  const char *first = json_string_value(json_array_get(qmat_usd_stage_warnings(r->stage), 0));
  return qmat_fail_file(r->context, QMAT_ERROR_GEOMETRY, path, "the scene has no mesh that can be read%s%s",
                        first ? "; " : "", first ? first : "");
}

qmat_status qmat_usd_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup,
                          json_t *report) {
  reader r = {.context = context, .soup = soup};
  qmat_usd_prim root = {0};
  qmat_status status = qmat_usd_stage_open(context, bytes, path, &r.stage);
  if (status != QMAT_OK) return status;
  const inherited state = {.world = qmat_usd_identity(), .purpose = "default"};
  status = qmat_usd_stage_root(r.stage, &root);
  if (status == QMAT_OK) status = read_children(&r, &root, &state);
  if (status == QMAT_OK && r.meshes == 0 && r.has_undefined) {
    /* The file may be meant as a layer of another one. */
    qmat_usd_stage_forget_warnings(r.stage);
    r = (reader){.context = context, .stage = r.stage, .soup = soup, .takes_undefined = true};
    status = read_children(&r, &root, &state);
  }
  qmat_usd_prim_uninit(&root);
  if (status == QMAT_OK) status = check_any(&r, path);
  if (r.cages == 0) qmat_soup_clear_cage(soup); /* no subdivision surface */
  if (status == QMAT_OK && report) status = fill_report(&r, report);
  qmat_usd_stage_close(r.stage);
  return status;
}
