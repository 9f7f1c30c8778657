/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/value_table.h"

#include <math.h>

#include "core/text.h"
#include "core/value_check.h"

#define ARRAY(type, field, kind, count, components) \
  { #field, QMAT_ROW_##kind, offsetof(type, field), offsetof(type, count), components }
#define SCALAR(type, field, kind) \
  { #field, QMAT_ROW_##kind, offsetof(type, field), 0, 0 }
#define END \
  { NULL, QMAT_ROW_U32, 0, 0, 0 }

/* One block per type: rows, then rules. The table of all types is at the end. */

static const qmat_value_row scene_rows[] = {SCALAR(qmat_scene, name, TEXT),
                                            SCALAR(qmat_scene, format, TEXT),
                                            SCALAR(qmat_scene, meters_per_unit, NUMBER),
                                            SCALAR(qmat_scene, is_z_up, BOOL),
                                            ARRAY(qmat_scene, parts, PARTS, part_count, 1),
                                            ARRAY(qmat_scene, meshes, U32, mesh_count, 1),
                                            ARRAY(qmat_scene, placed, U32, placement_count, 1),
                                            ARRAY(qmat_scene, placements, F64, placement_count, 16),
                                            ARRAY(qmat_scene, placement_paths, NAMES, placement_count, 1),
                                            ARRAY(qmat_scene, placement_bodies, U32, placement_count, 1),
                                            SCALAR(qmat_scene, has_instances, BOOL),
                                            ARRAY(qmat_scene, rig.skeleton_paths, NAMES, rig.skeleton_count, 1),
                                            ARRAY(qmat_scene, rig.skeleton_placements, F64, rig.skeleton_count, 16),
                                            ARRAY(qmat_scene, rig.joint_skeletons, U32, rig.joint_count, 1),
                                            ARRAY(qmat_scene, rig.joint_parents, U32, rig.joint_count, 1),
                                            ARRAY(qmat_scene, rig.joint_names, NAMES, rig.joint_count, 1),
                                            ARRAY(qmat_scene, rig.joint_poses, F64, rig.joint_count, QMAT_RIG_POSE),
                                            ARRAY(qmat_scene, rig.skin_skeletons, U32, rig.skin_count, 1),
                                            ARRAY(qmat_scene, rig.skin_ends, U32, rig.skin_count, 1),
                                            ARRAY(qmat_scene, rig.bound_joints, U32, rig.bound_count, 1),
                                            ARRAY(qmat_scene, rig.bound_matrices, F64, rig.bound_count, 16),
                                            ARRAY(qmat_scene, rig.placed_skins, U32, rig.placed_count, 1),
                                            ARRAY(qmat_scene, rig.curves, U32, rig.curve_count, 3),
                                            ARRAY(qmat_scene, rig.key_times, F64, rig.key_count, 1),
                                            ARRAY(qmat_scene, rig.moved_joints, U32, rig.moved_count, 1),
                                            ARRAY(qmat_scene, rig.values, F64, rig.value_count, 1),
                                            END};

/* Ids below `count`, or UINT32_MAX for none. */
static qmat_status check_ids_or_none(qmat_context *context, const uint32_t *ids, size_t length, size_t count,
                                     const char *kind, const char *of) {
  for (size_t i = 0; i < length; i++) {
    if (ids[i] < count || ids[i] == UINT32_MAX) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it names %s %u of %zu", of, ids[i], count);
    return qmat_fail_element(context, kind, (int64_t)i);
  }
  return QMAT_OK;
}

/* Parents come before their joints and are of the same skeleton. The joints of skins end in order. */
static qmat_status check_skeletons(qmat_context *context, const qmat_rig *rig) {
  for (size_t i = 0; i < rig->joint_count; i++) {
    const uint32_t parent = rig->joint_parents[i], skeleton = rig->joint_skeletons[i];
    const bool rises = i == 0 || rig->joint_skeletons[i - 1] <= skeleton;
    if (rises && skeleton < rig->skeleton_count &&
        (parent == UINT32_MAX || (parent < i && rig->joint_skeletons[parent] == skeleton)))
      continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "its parent or its skeleton is out of order");
    return qmat_fail_element(context, "joint", (int64_t)i);
  }
  for (size_t i = 0; i < rig->skin_count; i++) {
    const size_t start = i > 0 ? rig->skin_ends[i - 1] : 0, end = rig->skin_ends[i];
    if (start <= end && end <= rig->bound_count && (i + 1 < rig->skin_count || end == rig->bound_count)) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it ends at joint %zu of %zu", end, rig->bound_count);
    return qmat_fail_element(context, "skin", (int64_t)i);
  }
  if (rig->skin_count == 0 && rig->bound_count > 0)
    return qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu joints of skins, and no skin", rig->bound_count);
  return QMAT_OK;
}

/* The curves use up all times, joints and values, and their times rise. */
static qmat_status check_curves(qmat_context *context, const qmat_rig *rig) {
  size_t keys = 0, joints = 0, values = 0, bad = SIZE_MAX;
  for (size_t i = 0; i < rig->curve_count && bad == SIZE_MAX; i++) {
    const uint32_t part = rig->curves[3 * i], of_curve = rig->curves[3 * i + 1], moved = rig->curves[3 * i + 2];
    if (part >= QMAT_RIG_PART_COUNT || of_curve > rig->key_count - keys || moved > rig->moved_count - joints) bad = i;
    for (size_t k = 0; k < of_curve && bad == SIZE_MAX; k++)
      if (!(rig->key_times[keys + k] >= 0) || (k > 0 && !(rig->key_times[keys + k] > rig->key_times[keys + k - 1])))
        bad = i;
    keys += of_curve;
    joints += moved;
    values += (size_t)of_curve * moved * (part == QMAT_RIG_ROTATION ? 4 : 3);
  }
  if (bad == SIZE_MAX && keys == rig->key_count && joints == rig->moved_count && values == rig->value_count)
    return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "its times, joints and values do not match");
  return qmat_fail_element(context, "curve", bad == SIZE_MAX ? (int64_t)rig->curve_count - 1 : (int64_t)bad);
}

static qmat_status check_rig(qmat_context *context, const qmat_scene *scene) {
  const qmat_rig *rig = &scene->rig;
  const struct {
    const double *numbers;
    size_t count, components;
    const char *kind, *what;
  } arrays[] = {{rig->skeleton_placements, rig->skeleton_count, 16, "skeleton", "transform"},
                {rig->joint_poses, rig->joint_count, QMAT_RIG_POSE, "joint", "pose"},
                {rig->bound_matrices, rig->bound_count, 16, "joint of a skin", "matrix"},
                {rig->key_times, rig->key_count, 1, "key", "time"},
                {rig->values, rig->value_count, 1, "value of a curve", "number"}};
  if (rig->placed_count != 0 && rig->placed_count != scene->placement_count)
    return qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu skins for %zu placements", rig->placed_count,
                     scene->placement_count);
  qmat_status status = check_skeletons(context, rig);
  for (size_t i = 0; i < sizeof arrays / sizeof *arrays && status == QMAT_OK; i++)
    status = qmat_check_finite(context, arrays[i].numbers, arrays[i].count, arrays[i].components, arrays[i].kind,
                               arrays[i].what);
  for (size_t i = 0; i < rig->skeleton_count && status == QMAT_OK; i++)
    status = qmat_check_utf8(context, rig->skeleton_paths[i], "path of a skeleton");
  for (size_t i = 0; i < rig->joint_count && status == QMAT_OK; i++)
    status = qmat_check_utf8(context, rig->joint_names[i], "name of a joint");
  if (status == QMAT_OK)
    status = qmat_check_ids(context, rig->skin_skeletons, rig->skin_count, rig->skeleton_count, "skin", 1, "skeleton");
  if (status == QMAT_OK)
    status =
        check_ids_or_none(context, rig->bound_joints, rig->bound_count, rig->joint_count, "joint of a skin", "joint");
  if (status == QMAT_OK)
    status = check_ids_or_none(context, rig->placed_skins, rig->placed_count, rig->skin_count, "placement", "skin");
  if (status == QMAT_OK)
    status =
        qmat_check_ids(context, rig->moved_joints, rig->moved_count, rig->joint_count, "joint of a curve", 1, "joint");
  return status == QMAT_OK ? check_curves(context, rig) : status;
}

static qmat_status check_scene(qmat_context *context, const qmat_value *value) {
  const qmat_scene *scene = (const qmat_scene *)value;
  const qmat_status status = qmat_check_utf8(context, scene->name, "name of the scene");
  if (status == QMAT_OK && !(scene->meters_per_unit >= 0 && isfinite(scene->meters_per_unit)))
    return qmat_fail(context, QMAT_ERROR_GEOMETRY, "the unit of the scene is negative or not finite");
  if (status != QMAT_OK) return status;
  qmat_status of_rows = qmat_check_utf8(context, scene->format, "format of the scene");
  if (of_rows == QMAT_OK)
    of_rows = qmat_check_ids(context, scene->placed, scene->placement_count, scene->mesh_count, "placement", 1, "mesh");
  if (of_rows == QMAT_OK)
    of_rows = qmat_check_finite(context, scene->placements, scene->placement_count, 16, "placement", "transform");
  for (size_t i = 0; i < scene->placement_count && of_rows == QMAT_OK; i++)
    of_rows = qmat_check_utf8(context, scene->placement_paths[i], "path of a mesh");
  if (of_rows == QMAT_OK)
    of_rows = qmat_check_ids(context, scene->placement_bodies, scene->placement_count, 2, "placement", 1, "body");
  if (of_rows == QMAT_OK) of_rows = check_rig(context, scene);
  return of_rows != QMAT_OK ? of_rows : qmat_check_parts(context, scene->parts, scene->part_count);
}

static const qmat_value_row mesh_rows[] = {ARRAY(qmat_mesh, positions, F64, vertex_count, 3),
                                           ARRAY(qmat_mesh, triangles, U32, triangle_count, 3),
                                           SCALAR(qmat_mesh, sheet_triangle_count, SIZE),
                                           SCALAR(qmat_mesh, flap_triangle_count, SIZE),
                                           SCALAR(qmat_mesh, sheet_thickness, NUMBER),
                                           SCALAR(qmat_mesh, closed, BOOL),
                                           SCALAR(qmat_mesh, oriented, BOOL),
                                           SCALAR(qmat_mesh, deviation, NUMBER),
                                           ARRAY(qmat_mesh, cage.surface_faces, U32, cage.surface_count, 1),
                                           ARRAY(qmat_mesh, cage.schemes, U32, cage.surface_count, 1),
                                           ARRAY(qmat_mesh, cage.boundaries, U32, cage.surface_count, 1),
                                           ARRAY(qmat_mesh, cage.positions, F64, cage.vertex_count, 3),
                                           ARRAY(qmat_mesh, cage.face_sizes, U32, cage.face_count, 1),
                                           ARRAY(qmat_mesh, cage.corners, U32, cage.corner_count, 1),
                                           ARRAY(qmat_mesh, cage.holes, U32, cage.hole_count, 1),
                                           ARRAY(qmat_mesh, cage.creases, U32, cage.crease_count, 2),
                                           ARRAY(qmat_mesh, cage.crease_sharpness, F64, cage.crease_count, 1),
                                           ARRAY(qmat_mesh, cage.sharp_vertices, U32, cage.sharp_count, 1),
                                           ARRAY(qmat_mesh, cage.vertex_sharpness, F64, cage.sharp_count, 1),
                                           SCALAR(qmat_mesh, meters_per_unit, NUMBER),
                                           ARRAY(qmat_mesh, joints, U32, skinned_count, 4),
                                           ARRAY(qmat_mesh, weights, F64, skinned_count, 4),
                                           END};

static qmat_status check_sharpness(qmat_context *context, const double *sharpness, size_t count, const char *kind) {
  for (size_t i = 0; i < count; i++) {
    if (sharpness[i] >= 0 && isfinite(sharpness[i])) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "its sharpness is negative or not finite");
    return qmat_fail_element(context, kind, (int64_t)i);
  }
  return QMAT_OK;
}

static qmat_status check_cage(qmat_context *context, const qmat_cage *cage) {
  const struct {
    const uint32_t *ids;
    size_t length, count, components;
    const char *kind, *of;
  } arrays[] = {
      {cage->schemes, cage->surface_count, QMAT_SCHEME_COUNT, 1, "surface", "scheme"},
      {cage->boundaries, cage->surface_count, QMAT_BOUNDARY_COUNT, 1, "surface", "boundary rule"},
      {cage->corners, cage->corner_count, cage->vertex_count, 1, "cage corner", "vertex"},
      {cage->holes, cage->hole_count, cage->face_count, 1, "hole", "face"},
      {cage->creases, 2 * cage->crease_count, cage->vertex_count, 2, "crease", "vertex"},
      {cage->sharp_vertices, cage->sharp_count, cage->vertex_count, 1, "sharp vertex", "vertex"},
  };
  qmat_status status = qmat_check_u32_count(context, cage->vertex_count, "vertices of a cage");
  if (status == QMAT_OK) status = qmat_check_u32_count(context, cage->face_count, "faces of a cage");
  if (status == QMAT_OK)
    status = qmat_check_finite(context, cage->positions, cage->vertex_count, 3, "cage vertex", "position");
  for (size_t i = 0; i < sizeof arrays / sizeof *arrays && status == QMAT_OK; i++) {
    status = qmat_check_ids(context, arrays[i].ids, arrays[i].length, arrays[i].count, arrays[i].kind,
                            arrays[i].components, arrays[i].of);
  }
  if (status == QMAT_OK) status = check_sharpness(context, cage->crease_sharpness, cage->crease_count, "crease");
  if (status == QMAT_OK) status = check_sharpness(context, cage->vertex_sharpness, cage->sharp_count, "sharp vertex");
  if (status != QMAT_OK) return status;
  size_t faces = 0, corners = 0;
  for (size_t i = 0; i < cage->surface_count; i++) faces += cage->surface_faces[i];
  for (size_t i = 0; i < cage->face_count; i++) corners += cage->face_sizes[i];
  if (faces == cage->face_count && corners == cage->corner_count) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_GEOMETRY,
                   "a cage has %zu faces and %zu corners, but its surfaces and faces add up to %zu and %zu",
                   cage->face_count, cage->corner_count, faces, corners);
}

static qmat_status check_mesh(qmat_context *context, const qmat_value *value) {
  const qmat_mesh *mesh = (const qmat_mesh *)value;
  qmat_status status = qmat_check_u32_count(context, mesh->vertex_count, "vertices");
  if (status == QMAT_OK) status = qmat_check_u32_count(context, mesh->triangle_count, "facets");
  if (status == QMAT_OK)
    status = qmat_check_finite(context, mesh->positions, mesh->vertex_count, 3, "vertex", "position");
  if (status != QMAT_OK) return status;
  status = qmat_check_length(context, mesh->deviation, "deviation");
  if (status == QMAT_OK) status = qmat_check_length(context, mesh->sheet_thickness, "sheet_thickness");
  if (status == QMAT_OK) status = qmat_check_length(context, mesh->meters_per_unit, "meters_per_unit");
  if (status != QMAT_OK) return status;
  if (mesh->sheet_triangle_count > (mesh->cage.face_count > 0 ? 0 : mesh->triangle_count)) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu of %zu triangles%s", mesh->sheet_triangle_count, mesh->triangle_count,
              mesh->cage.face_count > 0 ? " of a mesh that is to be subdivided" : "");
    return qmat_fail_field(context, "sheet_triangle_count");
  }
  if (mesh->flap_triangle_count > mesh->sheet_triangle_count) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu of %zu triangles of sheets", mesh->flap_triangle_count,
              mesh->sheet_triangle_count);
    return qmat_fail_field(context, "flap_triangle_count");
  }
  for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
    if (mesh->triangles[i] < mesh->vertex_count) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "corner %zu names vertex %u of %zu", i % 3, mesh->triangles[i],
              mesh->vertex_count);
    return qmat_fail_element(context, "facet", (int64_t)(i / 3));
  }
  status = check_cage(context, &mesh->cage);
  if (status != QMAT_OK) return status;
  return qmat_check_skin(context, mesh->joints, mesh->weights, mesh->skinned_count, mesh->vertex_count, "vertex");
}

static const qmat_value_row field_rows[] = {ARRAY(qmat_field, values, F64, count, 1), SCALAR(qmat_field, domain, ENUM),
                                            SCALAR(qmat_field, unit, TEXT), END};

static qmat_status check_field(qmat_context *context, const qmat_value *value) {
  const qmat_field *field = (const qmat_field *)value;
  if (field->domain != QMAT_PER_FACET && field->domain != QMAT_PER_VERTEX) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the domain of a field is neither facets nor vertices");
    return qmat_fail_field(context, "domain");
  }
  const char *kind = field->domain == QMAT_PER_FACET ? "facet" : "vertex";
  const qmat_status status = qmat_check_utf8(context, field->unit, "unit of the field");
  return status != QMAT_OK ? status : qmat_check_finite(context, field->values, field->count, 1, kind, "value");
}

static const qmat_value_row samples_rows[] = {
    ARRAY(qmat_samples, positions, F64, count, 3), ARRAY(qmat_samples, facets, U32, count, 1),
    ARRAY(qmat_samples, barycentrics, F64, count, 3), SCALAR(qmat_samples, vertex_count, SIZE), END};

static qmat_status check_samples(qmat_context *context, const qmat_value *value) {
  const qmat_samples *samples = (const qmat_samples *)value;
  qmat_status status = qmat_check_u32_count(context, samples->count, "samples");
  if (status != QMAT_OK) return status;
  if (samples->vertex_count > samples->count) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "there are %zu vertices among %zu samples", samples->vertex_count,
              samples->count);
    return qmat_fail_field(context, "vertex_count");
  }
  status = qmat_check_finite(context, samples->positions, samples->count, 3, "sample", "position");
  if (status == QMAT_OK)
    status = qmat_check_finite(context, samples->barycentrics, samples->count, 3, "sample", "barycentric coordinate");
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < samples->count; i++) {
    const double *weights = samples->barycentrics + 3 * i;
    const double sum = weights[0] + weights[1] + weights[2];
    if (fabs(sum - 1) <= 1e-9) continue;
    char number[32];
    qmat_format_number(sum, number, sizeof number);
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the barycentric coordinates sum to %s, not 1", number);
    return qmat_fail_element(context, "sample", (int64_t)i);
  }
  return QMAT_OK;
}

static const qmat_value_row medial_rows[] = {ARRAY(qmat_medial, spheres, F64, sphere_count, 4),
                                             ARRAY(qmat_medial, edges, U32, edge_count, 2),
                                             ARRAY(qmat_medial, triangles, U32, triangle_count, 3),
                                             SCALAR(qmat_medial, sheet_sphere_count, SIZE),
                                             ARRAY(qmat_medial, region_offsets, U32, region_offset_count, 1),
                                             ARRAY(qmat_medial, region_samples, U32, region_sample_count, 1),
                                             ARRAY(qmat_medial, joints, U32, skinned_count, 4),
                                             ARRAY(qmat_medial, weights, F64, skinned_count, 4),
                                             END};

static qmat_status check_regions(qmat_context *context, const qmat_medial *medial) {
  if (medial->region_offset_count == 0) {
    if (!medial->region_offsets && medial->region_sample_count == 0) return QMAT_OK;
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "a medial mesh without region rows holds region data");
  }
  if (medial->region_offset_count != medial->sphere_count + 1) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu spheres need %zu region offsets, not %zu", medial->sphere_count,
              medial->sphere_count + 1, medial->region_offset_count);
    return qmat_fail_field(context, "region_offsets");
  }
  const qmat_status status = qmat_check_u32_count(context, medial->region_sample_count, "region samples");
  if (status != QMAT_OK) return status;
  const uint32_t *offsets = medial->region_offsets;
  if (offsets[0] != 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the first region starts at %u, not 0", offsets[0]);
    return qmat_fail_element(context, "region", 0);
  }
  for (size_t i = 0; i < medial->sphere_count; i++) {
    if (offsets[i] <= offsets[i + 1]) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it ends at %u, before its start at %u", offsets[i + 1], offsets[i]);
    return qmat_fail_element(context, "region", (int64_t)i);
  }
  if (offsets[medial->sphere_count] != medial->region_sample_count) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the regions end at %u of %zu samples", offsets[medial->sphere_count],
              medial->region_sample_count);
    return qmat_fail_field(context, "region_offsets");
  }
  return QMAT_OK;
}

static qmat_status check_medial(qmat_context *context, const qmat_value *value) {
  const qmat_medial *medial = (const qmat_medial *)value;
  qmat_status status = qmat_check_u32_count(context, medial->sphere_count, "spheres");
  if (status == QMAT_OK) status = qmat_check_u32_count(context, medial->edge_count, "edges");
  if (status == QMAT_OK) status = qmat_check_u32_count(context, medial->triangle_count, "triangles");
  if (status == QMAT_OK) status = qmat_check_spheres(context, medial->spheres, medial->sphere_count, "sphere");
  if (status == QMAT_OK)
    status = qmat_check_simplices(context, medial->edges, medial->edge_count, 2, medial->sphere_count, "edge");
  if (status == QMAT_OK) {
    status =
        qmat_check_simplices(context, medial->triangles, medial->triangle_count, 3, medial->sphere_count, "triangle");
  }
  if (status == QMAT_OK)
    status = qmat_check_sides(context, medial->edges, medial->edge_count, medial->triangles, medial->triangle_count);
  if (status == QMAT_OK && medial->sheet_sphere_count > medial->sphere_count) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu of %zu spheres", medial->sheet_sphere_count, medial->sphere_count);
    return qmat_fail_field(context, "sheet_sphere_count");
  }
  if (status == QMAT_OK) status = check_regions(context, medial);
  if (status != QMAT_OK) return status;
  return qmat_check_skin(context, medial->joints, medial->weights, medial->skinned_count, medial->sphere_count,
                         "sphere");
}

static const qmat_value_row chain_rows[] = {
    ARRAY(qmat_chain, spheres, F64, sphere_count, 4),     ARRAY(qmat_chain, edges, U32, edge_count, 2),
    ARRAY(qmat_chain, triangles, U32, triangle_count, 3), SCALAR(qmat_chain, sheet_sphere_count, SIZE),
    ARRAY(qmat_chain, owners, U32, sample_count, 1),      ARRAY(qmat_chain, ends, U32, collapse_count, 2),
    ARRAY(qmat_chain, merged, F64, collapse_count, 4),    ARRAY(qmat_chain, errors, F64, collapse_count, 1),
    SCALAR(qmat_chain, meters_per_diagonal, NUMBER),      ARRAY(qmat_chain, bounded, U32, bounded_count, 1),
    ARRAY(qmat_chain, bounds, F64, bounded_count, 2),     END};

/* Every collapse joins two different spheres that no earlier collapse has removed. */
static qmat_status check_ends(qmat_context *context, const qmat_chain *chain) {
  uint8_t *removed = qmat_calloc(chain->sphere_count, 1);
  if (!removed) return qmat_fail_memory(context, "the spheres of a chain");
  size_t i = 0;
  const char *fault = NULL;
  for (; i < chain->collapse_count; i++) {
    const uint32_t stays = chain->ends[2 * i], goes = chain->ends[2 * i + 1];
    if (stays >= chain->sphere_count || goes >= chain->sphere_count)
      fault = "it names a sphere that does not exist";
    else if (stays == goes)
      fault = "it joins a sphere to itself";
    else if (removed[stays] || removed[goes])
      fault = "it names a sphere that an earlier collapse removed";
    if (fault) break;
    removed[goes] = 1;
  }
  qmat_free(removed);
  if (!fault) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "%s", fault);
  return qmat_fail_element(context, "collapse", (int64_t)i);
}

static qmat_status check_chain(qmat_context *context, const qmat_value *value) {
  const qmat_chain *chain = (const qmat_chain *)value;
  const qmat_medial initial = {.base.type = QMAT_MEDIAL,
                               .sphere_count = chain->sphere_count,
                               .edge_count = chain->edge_count,
                               .triangle_count = chain->triangle_count,
                               .spheres = chain->spheres,
                               .edges = chain->edges,
                               .triangles = chain->triangles,
                               .sheet_sphere_count = chain->sheet_sphere_count};
  qmat_status status = check_medial(context, &initial.base);
  if (status == QMAT_OK) status = qmat_check_u32_count(context, chain->sample_count, "samples");
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < chain->sample_count; i++) {
    if (chain->owners[i] < chain->sphere_count || chain->owners[i] == UINT32_MAX) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "its owner is sphere %u of %zu", chain->owners[i], chain->sphere_count);
    return qmat_fail_element(context, "sample", (int64_t)i);
  }
  status = check_ends(context, chain);
  if (status == QMAT_OK) status = qmat_check_spheres(context, chain->merged, chain->collapse_count, "collapse");
  if (status == QMAT_OK)
    status = qmat_check_finite(context, chain->errors, chain->collapse_count, 1, "collapse", "error");
  if (status == QMAT_OK) status = qmat_check_length(context, chain->meters_per_diagonal, "meters_per_diagonal");
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < chain->collapse_count; i++) {
    if (chain->errors[i] >= (i == 0 ? 0 : chain->errors[i - 1])) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the error is below that of the previous collapse, or negative");
    return qmat_fail_element(context, "collapse", (int64_t)i);
  }
  for (size_t i = 0; i < chain->bounded_count; i++) {
    const bool rises = i == 0 || chain->bounded[i] > chain->bounded[i - 1];
    if (rises && chain->bounded[i] <= chain->collapse_count &&
        fmin(chain->bounds[2 * i], chain->bounds[2 * i + 1]) >= 0)
      continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "its bounds are negative, or its number of collapses is out of order");
    return qmat_fail_element(context, "bounded level", (int64_t)i);
  }
  return qmat_check_finite(context, chain->bounds, chain->bounded_count, 2, "bounded level", "bound");
}

static const qmat_value_row report_rows[] = {SCALAR(qmat_report, root, JSON), END};

static qmat_status check_report(qmat_context *context, const qmat_value *value) {
  const qmat_report *report = (const qmat_report *)value;
  if (json_is_object(report->root)) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_INTERNAL, "the root of a report is not a JSON object");
}

static const qmat_value_row file_rows[] = {SCALAR(qmat_file, format, TEXT),
                                           ARRAY(qmat_file, parts, PARTS, part_count, 1), END};

static qmat_status check_file(qmat_context *context, const qmat_value *value) {
  const qmat_file *file = (const qmat_file *)value;
  if (file->part_count == 0) return qmat_fail(context, QMAT_ERROR_INTERNAL, "a file has no main part");
  return qmat_check_parts(context, file->parts, file->part_count);
}

static const qmat_value_row failure_rows[] = {SCALAR(qmat_failure, reason, TEXT), END};

static qmat_status check_failure(qmat_context *context, const qmat_value *value) {
  return qmat_check_utf8(context, ((const qmat_failure *)value)->reason, "reason");
}

static const qmat_value_row list_rows[] = {ARRAY(qmat_list, items, ITEMS, count, 1),
                                           ARRAY(qmat_list, names, NAMES, count, 1), END};

static qmat_status check_list(qmat_context *context, const qmat_value *value) {
  const qmat_list *list = (const qmat_list *)value;
  if (list->count < 2)
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "a list has %zu items; it needs at least two", list->count);
  size_t first = 0; /* the first item that is no failure gives the type */
  while (first < list->count && list->items[first]->type == QMAT_FAILURE) first++;
  if (first == list->count) return qmat_fail(context, QMAT_ERROR_INTERNAL, "a list holds only failures");
  const qmat_value_type type = list->items[first]->type;
  for (size_t i = 0; i < list->count; i++) {
    const qmat_value *item = list->items[i];
    if (!item->sealed || item->type == QMAT_LIST || (item->type != type && item->type != QMAT_FAILURE)) {
      qmat_fail(context, QMAT_ERROR_INTERNAL, "it is a list, is not sealed, or differs in type from the other items");
      return qmat_fail_element(context, "item", (int64_t)i);
    }
    if (qmat_check_utf8(context, list->names[i], "name") != QMAT_OK)
      return qmat_fail_element(context, "item", (int64_t)i);
  }
  return QMAT_OK;
}

static const qmat_value_row colliders_rows[] = {
    ARRAY(qmat_colliders, spheres, F64, sphere_count, 4),  ARRAY(qmat_colliders, shapes, U32, shape_count, 3),
    ARRAY(qmat_colliders, points, F64, point_count, 3),    ARRAY(qmat_colliders, triangles, U32, triangle_count, 3),
    ARRAY(qmat_colliders, hull_ends, U32, shape_count, 2), ARRAY(qmat_colliders, body, F64, body_count, 10),
    ARRAY(qmat_colliders, joints, U32, joint_count, 1),    END};

/* The hulls follow each other, and each names only its own points. */
static qmat_status check_hulls(qmat_context *context, const qmat_colliders *c) {
  size_t points = 0, triangles = 0;
  for (size_t i = 0; i < c->shape_count; i++) {
    const size_t next_points = c->hull_ends[2 * i], next_triangles = c->hull_ends[2 * i + 1];
    bool fits = next_points >= points && next_points <= c->point_count && next_triangles >= triangles &&
                next_triangles <= c->triangle_count;
    for (size_t k = 3 * triangles; fits && k < 3 * next_triangles; k++)
      fits = c->triangles[k] >= points && c->triangles[k] < next_points;
    if (!fits) {
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "its hull is not within its points and triangles");
      return qmat_fail_element(context, "shape", (int64_t)i);
    }
    points = next_points;
    triangles = next_triangles;
  }
  if (points == c->point_count && triangles == c->triangle_count) return QMAT_OK;
  return qmat_fail(context, QMAT_ERROR_GEOMETRY, "points or triangles follow the last hull");
}

/* A capsule repeats its second sphere, a sphere its first. */
static qmat_status check_shapes(qmat_context *context, const qmat_colliders *c) {
  for (size_t i = 0; i < c->shape_count; i++) {
    const uint32_t *s = &c->shapes[3 * i];
    if (s[0] == s[1] ? s[1] == s[2] : s[0] != s[2]) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it repeats its spheres in another order");
    return qmat_fail_element(context, "shape", (int64_t)i);
  }
  return QMAT_OK;
}

static qmat_status check_colliders(qmat_context *context, const qmat_value *value) {
  const qmat_colliders *c = (const qmat_colliders *)value;
  qmat_status status = qmat_check_u32_count(context, c->sphere_count, "spheres");
  if (status == QMAT_OK) status = qmat_check_u32_count(context, c->point_count, "points");
  if (status == QMAT_OK) status = qmat_check_u32_count(context, c->triangle_count, "triangles");
  if (status == QMAT_OK) status = qmat_check_spheres(context, c->spheres, c->sphere_count, "sphere");
  if (status == QMAT_OK)
    status = qmat_check_ids(context, c->shapes, 3 * c->shape_count, c->sphere_count, "shape", 3, "sphere");
  if (status == QMAT_OK) status = qmat_check_finite(context, c->points, c->point_count, 3, "point", "position");
  if (status == QMAT_OK) status = check_shapes(context, c);
  if (status == QMAT_OK && c->body_count > 1)
    status = qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu bodies, but colliders are one", c->body_count);
  if (status == QMAT_OK) status = qmat_check_finite(context, c->body, c->body_count, 10, "body", "mass property");
  for (size_t i = 0; i < c->sphere_count && status == QMAT_OK; i++) {
    if (c->spheres[4 * i + 3] > 0) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "its radius is 0");
    status = qmat_fail_element(context, "sphere", (int64_t)i);
  }
  if (status == QMAT_OK && c->joint_count > 0 && c->joint_count != c->shape_count)
    status = qmat_fail(context, QMAT_ERROR_GEOMETRY, "%zu joints for %zu shapes", c->joint_count, c->shape_count);
  return status == QMAT_OK ? check_hulls(context, c) : status;
}

/* The table. */

#define COUNT(type, field, name) \
  { name, offsetof(type, field), false }
#define DETAIL(type, field, name) \
  { name, offsetof(type, field), true }
#define TYPE(name) #name, sizeof(qmat_##name), name##_rows, check_##name

const qmat_value_layout qmat_value_layouts[QMAT_VALUE_TYPE_COUNT] = {
    [QMAT_SCENE] = {TYPE(scene), {{0}}},
    [QMAT_MESH] = {TYPE(mesh),
                   {DETAIL(qmat_mesh, vertex_count, "vertices"), COUNT(qmat_mesh, triangle_count, "triangles")}},
    [QMAT_FIELD] = {TYPE(field), {COUNT(qmat_field, count, "values")}},
    [QMAT_SAMPLES] = {TYPE(samples), {COUNT(qmat_samples, count, "samples")}},
    [QMAT_MEDIAL] = {TYPE(medial),
                     {COUNT(qmat_medial, sphere_count, "spheres"), COUNT(qmat_medial, edge_count, "cones"),
                      COUNT(qmat_medial, triangle_count, "slabs")}},
    [QMAT_CHAIN] = {TYPE(chain),
                    {COUNT(qmat_chain, sphere_count, "spheres"), COUNT(qmat_chain, collapse_count, "collapses")}},
    [QMAT_REPORT] = {TYPE(report), {{0}}},
    [QMAT_FILE] = {TYPE(file), {DETAIL(qmat_file, part_count, "parts")}},
    [QMAT_FAILURE] = {TYPE(failure), {{0}}},
    [QMAT_COLLIDERS] = {TYPE(colliders),
                        {COUNT(qmat_colliders, shape_count, "shapes"),
                         DETAIL(qmat_colliders, sphere_count, "spheres")}},
    [QMAT_LIST] = {TYPE(list), {{0}}},
};

_Static_assert(sizeof(double) == 8 && sizeof(qmat_domain) == 4, "the serialised form assumes these sizes");

/* Walking the rows. */

size_t qmat_row_element_size(const qmat_value_row *row) {
  switch (row->kind) {
    case QMAT_ROW_U32:
      return sizeof(uint32_t);
    case QMAT_ROW_F64:
      return sizeof(double);
    case QMAT_ROW_PARTS:
      return sizeof(qmat_file_part);
    case QMAT_ROW_ITEMS:
    case QMAT_ROW_NAMES:
      return sizeof(void *);
    default:
      return 0;
  }
}

/* The rows can be walked: texts and JSON are set, and arrays are as long as their counts say. Only a mistake of the
 * node that made the value can break this. */
static qmat_status check_rows(qmat_context *context, const qmat_value *value) {
  const char *type = qmat_value_layouts[value->type].name;
  for (const qmat_value_row *row = qmat_value_rows(value); row->name != NULL; row++) {
    if (!qmat_row_has_pointer(row)) continue;
    const void *pointer = qmat_row_pointer(value, row);
    if (!qmat_row_is_array(row)) {
      if (pointer) continue;
      qmat_fail(context, QMAT_ERROR_INTERNAL, "the %s of a %s is not set", row->name, type);
      return qmat_fail_field(context, row->name);
    }
    const size_t count = qmat_row_count(value, row);
    if (count > SIZE_MAX / (8 * row->components * qmat_row_element_size(row)) || (count > 0 && !pointer)) {
      qmat_fail(context, QMAT_ERROR_INTERNAL, "a %s counts %zu %s but holds none", type, count, row->name);
      return qmat_fail_field(context, row->name);
    }
    for (size_t i = 0; (row->kind == QMAT_ROW_ITEMS || row->kind == QMAT_ROW_NAMES) && i < count; i++) {
      if (((void *const *)pointer)[i] != NULL) continue;
      qmat_fail(context, QMAT_ERROR_INTERNAL, "an item of a list is missing or has no name");
      return qmat_fail_element(context, "item", (int64_t)i);
    }
    if (row->kind != QMAT_ROW_PARTS) continue;
    const qmat_file_part *parts = pointer;
    for (size_t i = 0; i < count; i++) {
      if (!parts[i].name || (parts[i].size > 0 && !parts[i].bytes)) {
        qmat_fail(context, QMAT_ERROR_INTERNAL, "a part of a %s has no name or no bytes", type);
        return qmat_fail_element(context, "part", (int64_t)i);
      }
    }
  }
  return QMAT_OK;
}

qmat_status qmat_value_check(qmat_context *context, const qmat_value *value) {
  const qmat_status status = check_rows(context, value);
  return status == QMAT_OK ? qmat_value_layouts[value->type].check(context, value) : status;
}
