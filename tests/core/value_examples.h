/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_CORE_VALUE_EXAMPLES_H
#define QMAT_TESTS_CORE_VALUE_EXAMPLES_H

/* Unsealed values of every type for tests; release them. Include after cmocka. */

#include <string.h>

#include "core/value.h"
#include "tests/shapes.h"

#define ASSIGN(field, ...) ((field) = shape_copy((__VA_ARGS__), sizeof(__VA_ARGS__)))

static inline qmat_scene *scene_example(void) {
  qmat_scene *scene = qmat_scene_new();
  assert_non_null(scene);
  scene->name = qmat_strdup("Kr\xc3\xa4he");
  scene->format = qmat_strdup("off");
  scene->meters_per_unit = 0.01;
  scene->is_z_up = true;
  return scene;
}

static inline char **names_of(size_t count, const char *const *texts) {
  char **names = qmat_calloc(count, sizeof *names);
  assert_non_null(names);
  for (size_t i = 0; i < count; i++) names[i] = qmat_strdup(texts[i]);
  return names;
}

/* A skeleton of two joints, to which a placed mesh is bound. */
static inline qmat_scene *rigged_scene_example(void) {
  qmat_scene *scene = scene_example();
  scene->mesh_count = scene->placement_count = 1;
  ASSIGN(scene->meshes, (uint32_t[]){0});
  ASSIGN(scene->placed, (uint32_t[]){0});
  ASSIGN(scene->placements, (double[]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1});
  scene->placement_paths = names_of(1, (const char *const[]){"/Root/Mesh"});
  ASSIGN(scene->placement_bodies, (uint32_t[]){1});
  qmat_rig *rig = &scene->rig;
  rig->skeleton_count = 1;
  rig->skeleton_paths = names_of(1, (const char *const[]){"/Root/Skeleton"});
  ASSIGN(rig->skeleton_placements, (double[]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  rig->joint_count = 2;
  ASSIGN(rig->joint_skeletons, (uint32_t[]){0, 0});
  ASSIGN(rig->joint_parents, (uint32_t[]){UINT32_MAX, 0});
  rig->joint_names = names_of(2, (const char *const[]){"hip", ""});
  ASSIGN(rig->joint_poses, (double[]){0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 0, 2, 0, 0, 0, 0, 1, 1, 1, 1});
  return scene;
}

/* A tetrahedron. */
static inline qmat_mesh *mesh_example(void) {
  qmat_mesh *mesh = qmat_mesh_new();
  assert_non_null(mesh);
  mesh->vertex_count = 4;
  mesh->triangle_count = 4;
  ASSIGN(mesh->positions, (double[]){0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
  ASSIGN(mesh->triangles, (uint32_t[]){0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
  mesh->closed = mesh->oriented = true;
  mesh->meters_per_unit = 0.01;
  mesh->skinned_count = 4;
  ASSIGN(mesh->joints, (uint32_t[]){0, 0, 0, 0, 7, 1, 0, 0, 65535, 0, 0, 0, 3, 2, 1, 0});
  ASSIGN(mesh->weights, (double[]){1, 0, 0, 0, 0.75, 0.25, 0, 0, 1, 0, 0, 0, 0.25, 0.25, 0.25, 0.25});
  return mesh;
}

static inline qmat_field *field_example(void) {
  qmat_field *field = qmat_field_new();
  assert_non_null(field);
  field->count = 3;
  ASSIGN(field->values, (double[]){0.5, -0.0, 1e300});
  field->domain = QMAT_PER_VERTEX;
  field->unit = qmat_strdup("model unit");
  return field;
}

static inline qmat_samples *samples_example(void) {
  qmat_samples *samples = qmat_samples_new();
  assert_non_null(samples);
  samples->count = 2;
  samples->vertex_count = 1;
  ASSIGN(samples->positions, (double[]){0, 0, 0, 0.25, 0.5, 0});
  ASSIGN(samples->facets, (uint32_t[]){0, 3});
  ASSIGN(samples->barycentrics, (double[]){1, 0, 0, 0.25, 0.25, 0.5});
  return samples;
}

/* A slab, a cone on sphere 3, and regions of which that of sphere 1 is empty. */
static inline qmat_medial *medial_example(void) {
  qmat_medial *medial = qmat_medial_new();
  assert_non_null(medial);
  medial->sphere_count = 4;
  medial->edge_count = 4;
  medial->triangle_count = 1;
  medial->region_offset_count = 5;
  medial->region_sample_count = 6;
  ASSIGN(medial->spheres, (double[]){0, 0, 0, 1, 1, 0, 0, 0.5, 0, 1, 0, 0.25, 0, 0, 9, 0});
  ASSIGN(medial->edges, (uint32_t[]){0, 1, 0, 2, 1, 2, 1, 3});
  ASSIGN(medial->triangles, (uint32_t[]){0, 1, 2});
  ASSIGN(medial->region_offsets, (uint32_t[]){0, 2, 2, 5, 6});
  ASSIGN(medial->region_samples, (uint32_t[]){4, 1, 0, 2, 3, 5});
  medial->skinned_count = 4;
  ASSIGN(medial->joints, (uint32_t[]){0, 0, 0, 0, 7, 1, 0, 0, 65535, 0, 0, 0, 3, 2, 1, 0});
  ASSIGN(medial->weights, (double[]){1, 0, 0, 0, 0.75, 0.25, 0, 0, 1, 0, 0, 0, 0.25, 0.25, 0.25, 0.25});
  return medial;
}

/* Sphere 3 joins sphere 1, then that sphere 0; nobody answers for the last sample. */
static inline qmat_chain *chain_example(void) {
  qmat_chain *chain = qmat_chain_new();
  assert_non_null(chain);
  chain->sphere_count = 4;
  chain->edge_count = 4;
  chain->triangle_count = 1;
  chain->sample_count = 3;
  chain->collapse_count = 2;
  ASSIGN(chain->spheres, (double[]){0, 0, 0, 1, 1, 0, 0, 0.5, 0, 1, 0, 0.25, 0, 0, 9, 0});
  ASSIGN(chain->edges, (uint32_t[]){0, 1, 0, 2, 1, 2, 1, 3});
  ASSIGN(chain->triangles, (uint32_t[]){0, 1, 2});
  ASSIGN(chain->owners, (uint32_t[]){3, 0, UINT32_MAX});
  ASSIGN(chain->ends, (uint32_t[]){1, 3, 0, 1});
  ASSIGN(chain->merged, (double[]){1, 0, 4, 0.25, 0.5, 0, 0, 1});
  ASSIGN(chain->errors, (double[]){0.25, 0.5});
  chain->meters_per_diagonal = 2.5;
  return chain;
}

static inline qmat_report *report_example(void) {
  qmat_report *report = qmat_report_new();
  assert_non_null(report);
  assert_int_equal(json_object_set_new(report->root, "spheres", json_integer(100)), 0);
  assert_int_equal(json_object_set_new(report->root, "error", json_real(0.1)), 0);
  assert_int_equal(json_object_set_new(report->root, "steps", json_pack("[i, f, s]", 1, 2.0, "a\"b")), 0);
  return report;
}

static inline qmat_file *file_example(void) {
  qmat_file *file = qmat_file_new();
  assert_non_null(file);
  file->format = qmat_strdup("gltf");
  file->part_count = 3;
  file->parts = qmat_calloc(3, sizeof *file->parts);
  file->parts[0] = (qmat_file_part){qmat_strdup(""), 5, shape_copy("{...}", 5)};
  file->parts[1] = (qmat_file_part){qmat_strdup("medial.bin"), 3, shape_copy("\0\1\2", 3)};
  file->parts[2] = (qmat_file_part){qmat_strdup("empty.bin"), 0, NULL};
  return file;
}

static inline qmat_failure *failure_example(void) {
  qmat_failure *failure = qmat_failure_new();
  assert_non_null(failure);
  failure->reason = qmat_strdup("it is flat");
  return failure;
}

/* Of two fields. */
static inline qmat_list *list_example(void) {
  qmat_context context = {0};
  qmat_list *list = qmat_list_new(2);
  assert_non_null(list);
  list->names[0] = qmat_strdup("K\xc3\xb6rper");
  list->names[1] = qmat_strdup("");
  for (size_t i = 0; i < 2; i++) {
    list->items[i] = &field_example()->base;
    assert_int_equal(qmat_value_seal(&context, list->items[i]), QMAT_OK);
  }
  return list;
}

/* A capsule with a hull of a tetrahedron, its joint, and its mass properties. */
static inline qmat_colliders *colliders_example(void) {
  qmat_colliders *colliders = qmat_colliders_new();
  assert_non_null(colliders);
  colliders->sphere_count = 2;
  colliders->shape_count = 1;
  colliders->point_count = 4;
  colliders->triangle_count = 4;
  colliders->body_count = 1;
  ASSIGN(colliders->spheres, (double[]){0, 0, 0, 1, 1, 0, 0, 0.5});
  ASSIGN(colliders->shapes, (uint32_t[]){0, 1, 1});
  ASSIGN(colliders->points, (double[]){0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
  ASSIGN(colliders->triangles, (uint32_t[]){0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
  ASSIGN(colliders->hull_ends, (uint32_t[]){4, 4});
  ASSIGN(colliders->joints, (uint32_t[]){3});
  colliders->joint_count = 1;
  ASSIGN(colliders->body, (double[]){5, 0.5, 0, 0, 1, 2, 3, 0, 0, 0});
  return colliders;
}

/* Two surfaces: a quad with everything that a cage can have, and a triangle. */
static inline qmat_mesh *cage_example(void) {
  qmat_mesh *mesh = mesh_example();
  qmat_cage *cage = &mesh->cage;
  cage->surface_count = 2;
  cage->vertex_count = 7;
  cage->face_count = 2;
  cage->corner_count = 7;
  cage->hole_count = cage->crease_count = cage->sharp_count = 1;
  ASSIGN(cage->surface_faces, (uint32_t[]){1, 1});
  ASSIGN(cage->schemes, (uint32_t[]){QMAT_SCHEME_LOOP, QMAT_SCHEME_NONE});
  ASSIGN(cage->boundaries, (uint32_t[]){QMAT_BOUNDARY_EDGE, QMAT_BOUNDARY_NONE});
  ASSIGN(cage->positions, (double[]){0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 5, 0, 0, 6, 0, 0, 5, 1, 0});
  ASSIGN(cage->face_sizes, (uint32_t[]){4, 3});
  ASSIGN(cage->corners, (uint32_t[]){0, 1, 2, 3, 4, 5, 6});
  ASSIGN(cage->holes, (uint32_t[]){0});
  ASSIGN(cage->creases, (uint32_t[]){0, 1});
  ASSIGN(cage->crease_sharpness, (double[]){2.5});
  ASSIGN(cage->sharp_vertices, (uint32_t[]){3});
  ASSIGN(cage->vertex_sharpness, (double[]){10});
  return mesh;
}

/* The example above that comes first for each type, then others, so that every field is set in one of them. */
enum {
  EXAMPLE_WHOLE_SCENE = QMAT_VALUE_TYPE_COUNT,
  EXAMPLE_CAGE,
  EXAMPLE_SHEETS,
  EXAMPLE_FACET_FIELD,
  EXAMPLE_BARE_MEDIAL,
  EXAMPLE_BOUNDED_CHAIN,
  EXAMPLE_COLLIDERS_WITHOUT_BODY,
  EXAMPLE_LIST_WITH_FAILURE,
  EXAMPLE_COUNT
};

/* A scene that was kept, of two skeletons and two skins, whose joints move. */
static inline qmat_scene *whole_scene_example(void) {
  qmat_scene *scene = rigged_scene_example();
  qmat_rig *rig = &scene->rig;
  scene->has_instances = true;
  scene->part_count = 2;
  scene->parts = qmat_calloc(2, sizeof *scene->parts);
  assert_non_null(scene->parts);
  scene->parts[0] = (qmat_file_part){qmat_strdup(""), 5, shape_copy("{...}", 5)};
  scene->parts[1] = (qmat_file_part){qmat_strdup("a/b.png"), 3, shape_copy("\0\1\2", 3)};
  scene->mesh_count = 2;
  qmat_free(scene->meshes);
  ASSIGN(scene->meshes, (uint32_t[]){0, 5});
  for (size_t i = 0; i < rig->skeleton_count; i++) qmat_free(rig->skeleton_paths[i]);
  qmat_free(rig->skeleton_paths);
  qmat_free(rig->skeleton_placements);
  qmat_free(rig->joint_parents);
  rig->skeleton_count = 2;
  rig->skeleton_paths = names_of(2, (const char *const[]){"/Root/A", "/Root/B"});
  ASSIGN(rig->skeleton_placements, (double[32]){1, [5] = 1, [10] = 1, [15] = 1, 2, [21] = 2, [26] = 2, [31] = 1});
  ASSIGN(rig->joint_parents, (uint32_t[]){UINT32_MAX, UINT32_MAX});
  rig->skin_count = 2;
  rig->bound_count = 3;
  ASSIGN(rig->skin_skeletons, (uint32_t[]){0, 1});
  ASSIGN(rig->skin_ends, (uint32_t[]){2, 3});
  ASSIGN(rig->bound_joints, (uint32_t[]){0, 1, UINT32_MAX});
  ASSIGN(rig->bound_matrices, (double[48]){1, 2, 3, [16] = 4, [32] = 5, [47] = 6});
  rig->placed_count = 1;
  ASSIGN(rig->placed_skins, (uint32_t[]){1});
  rig->curve_count = 2;
  rig->key_count = 3;
  rig->moved_count = 2;
  rig->value_count = 10;
  ASSIGN(rig->curves, (uint32_t[]){QMAT_RIG_TRANSLATION, 2, 1, QMAT_RIG_ROTATION, 1, 1});
  ASSIGN(rig->key_times, (double[]){0, 0.5, 2});
  ASSIGN(rig->moved_joints, (uint32_t[]){0, 1});
  ASSIGN(rig->values, (double[]){1, 2, 3, 4, 5, 6, 0, 0, 0, 1});
  return scene;
}

/* Four triangles, the last three of sheets, the last two flaps; no skin and no unit. */
static inline qmat_mesh *sheets_example(void) {
  qmat_mesh *mesh = mesh_example();
  mesh->sheet_triangle_count = 3;
  mesh->flap_triangle_count = 2;
  mesh->sheet_thickness = 0.125;
  mesh->deviation = 0.5;
  mesh->closed = mesh->oriented = false;
  mesh->meters_per_unit = 0;
  mesh->skinned_count = 0;
  qmat_free(mesh->joints);
  qmat_free(mesh->weights);
  mesh->joints = NULL;
  mesh->weights = NULL;
  return mesh;
}

static inline qmat_field *facet_field_example(void) {
  qmat_field *field = field_example();
  field->domain = QMAT_PER_FACET;
  qmat_free(field->unit);
  field->unit = qmat_strdup("");
  return field;
}

/* A triangle and the sides of three more; two spheres of sheets, no regions and no skin. */
static inline qmat_medial *bare_medial_example(void) {
  qmat_medial *medial = qmat_medial_new();
  assert_non_null(medial);
  medial->sphere_count = 4;
  medial->edge_count = 6;
  medial->triangle_count = 1;
  medial->sheet_sphere_count = 2;
  ASSIGN(medial->spheres, (double[]){0, 0, 0, 1, 1, 0, 0, 0.5, 0, 1, 0, 0.25, 0, 0, 9, 0});
  ASSIGN(medial->edges, (uint32_t[]){0, 1, 0, 2, 0, 3, 1, 2, 1, 3, 2, 3});
  ASSIGN(medial->triangles, (uint32_t[]){0, 1, 2});
  return medial;
}

/* The bounds of two of its levels are known. */
static inline qmat_chain *bounded_chain_example(void) {
  qmat_chain *chain = chain_example();
  chain->sheet_sphere_count = 3;
  chain->edge_count = 6;
  qmat_free(chain->edges);
  ASSIGN(chain->edges, (uint32_t[]){0, 1, 0, 2, 0, 3, 1, 2, 1, 3, 2, 3});
  chain->bounded_count = 2;
  ASSIGN(chain->bounded, (uint32_t[]){0, 2});
  ASSIGN(chain->bounds, (double[]){0.125, 0.25, 0.5, 0.0625});
  return chain;
}

/* Two spheres, of which the second has a hull of one point. */
static inline qmat_colliders *bodiless_colliders_example(void) {
  qmat_colliders *colliders = colliders_example();
  colliders->shape_count = 2;
  colliders->point_count = 5;
  colliders->body_count = 0;
  qmat_free(colliders->shapes);
  qmat_free(colliders->points);
  qmat_free(colliders->hull_ends);
  qmat_free(colliders->body);
  colliders->body = NULL;
  qmat_free(colliders->joints);
  colliders->joints = NULL;
  colliders->joint_count = 0;
  ASSIGN(colliders->shapes, (uint32_t[]){0, 0, 0, 1, 1, 1});
  ASSIGN(colliders->points, (double[]){0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 2, 2, 2});
  ASSIGN(colliders->hull_ends, (uint32_t[]){4, 4, 5, 4});
  return colliders;
}

static inline qmat_list *list_with_failure_example(void) {
  qmat_context context = {0};
  qmat_list *list = list_example();
  qmat_value_release(list->items[0]);
  list->items[0] = &failure_example()->base;
  assert_int_equal(qmat_value_seal(&context, list->items[0]), QMAT_OK);
  return list;
}

/* Example `index` of EXAMPLE_COUNT; those below QMAT_VALUE_TYPE_COUNT are of the type of that number. */
static inline qmat_value *example_of(int index) {
  switch (index) {
    case QMAT_SCENE:
      return &scene_example()->base;
    case QMAT_MESH:
      return &mesh_example()->base;
    case QMAT_FIELD:
      return &field_example()->base;
    case QMAT_SAMPLES:
      return &samples_example()->base;
    case QMAT_MEDIAL:
      return &medial_example()->base;
    case QMAT_CHAIN:
      return &chain_example()->base;
    case QMAT_REPORT:
      return &report_example()->base;
    case QMAT_FILE:
      return &file_example()->base;
    case QMAT_FAILURE:
      return &failure_example()->base;
    case QMAT_COLLIDERS:
      return &colliders_example()->base;
    case QMAT_LIST:
      return &list_example()->base;
    case EXAMPLE_WHOLE_SCENE:
      return &whole_scene_example()->base;
    case EXAMPLE_CAGE:
      return &cage_example()->base;
    case EXAMPLE_SHEETS:
      return &sheets_example()->base;
    case EXAMPLE_FACET_FIELD:
      return &facet_field_example()->base;
    case EXAMPLE_BARE_MEDIAL:
      return &bare_medial_example()->base;
    case EXAMPLE_BOUNDED_CHAIN:
      return &bounded_chain_example()->base;
    case EXAMPLE_COLLIDERS_WITHOUT_BODY:
      return &bodiless_colliders_example()->base;
    case EXAMPLE_LIST_WITH_FAILURE:
      return &list_with_failure_example()->base;
    default:
      fail_msg("there is no example %d", index);
      return NULL;
  }
}

#endif
