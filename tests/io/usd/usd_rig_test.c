/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Skeletons of UsdSkel: as the rig of a scene, and as nodes, skin and animation of glTF. */
#include "io/usd/usd_rig.h"

#include "core/value.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_write.h"
#include "io/usd/usd_model.h"
#include "tests/io/files.h"
#include "tests/medial_meshes.h"
#include "tests/shapes.h"

#define MOVED(x, y, z) "((1,0,0,0),(0,1,0,0),(0,0,1,0),(" #x "," #y "," #z ",1))"
#define TURNED(x, y, z) "((0,1,0,0),(-1,0,0,0),(0,0,1,0),(" #x "," #y "," #z ",1))" /* by 90 degrees about z */
#define MESH(more)                                                                             \
  "def Mesh \"m\" {\nuniform token subdivisionScheme = \"none\"\npoint3f[] points = [(0,0,0)," \
  "(1,0,0),(0,1,0),(0,0,1)]\nint[] faceVertexCounts = [3,3,3,3]\nint[] faceVertexIndices = "   \
  "[0,2,1,0,1,3,1,2,3,0,3,2]\n" more "}\n"
#define BINDING                                                              \
  "int[] primvars:skel:jointIndices = [0,1,0,1,0,1,0,1] (elementSize = 2)\n" \
  "float[] primvars:skel:jointWeights = [1,0,1,0,.5,.5,0,1] (elementSize = 2)\n"
#define JOINTS "uniform token[] joints = [\"hip\", \"hip/knee\"]\n"
#define BINDS "uniform matrix4d[] bindTransforms = [" MOVED(0, 0, 1) ", " MOVED(0, 2, 1) "]\n"
#define RESTS "uniform matrix4d[] restTransforms = [" MOVED(0, 0, 1) ", " TURNED(0, 2, 0) "]\n"
#define SKELETON(contents) "def Skeleton \"s\" {\n" contents "}\n"
#define ROOT(contents) "#usda 1.0\ndef SkelRoot \"r\" {\nrel skel:skeleton = </r/s>\n" contents "}\n"

static const double half = 0.70710678118654752;

/* A scene that was read. */
typedef struct reading {
  qmat_context context;
  qmat_scene *scene;
  qmat_usd_meshes meshes;
  json_t *report;
} reading;

static reading read_file(const char *text, const char *path) {
  reading r = {.scene = qmat_scene_new(), .report = json_object()};
  qmat_bytes bytes = memory_file(text, strlen(text));
  assert_true(r.scene && r.report);
  r.scene->name = qmat_strdup("thing");
  r.scene->format = qmat_strdup("usd");
  qmat_status status = qmat_usd_read_meshes(&r.context, &bytes, path, "all", 16, r.scene, &r.meshes, r.report);
  if (status == QMAT_OK) status = qmat_value_seal(&r.context, &r.scene->base);
  if (status != QMAT_OK) {
    char line[1024];
    qmat_error_format(&r.context.error, line, sizeof line);
    fail_msg("%s", line);
  }
  free(bytes.data);
  return r;
}

static reading read_text(const char *text) {
  return read_file(text, "file.usda");
}

static void release(reading *r) {
  qmat_usd_meshes_uninit(&r->meshes);
  qmat_value_release(&r->scene->base);
  json_decref(r->report);
  qmat_context_uninit(&r->context);
}

static bool has_warning(const reading *r, const char *text) {
  const json_t *warnings = json_object_get(r->report, "warnings");
  for (size_t i = 0; i < json_array_size(warnings); i++)
    if (strstr(json_string_value(json_array_get(warnings, i)), text)) return true;
  return false;
}

static void assert_no_warning(const reading *r) {
  const json_t *warnings = json_object_get(r->report, "warnings");
  if (json_array_size(warnings) > 0) fail_msg("%s", json_string_value(json_array_get(warnings, 0)));
}

static void assert_numbers(const double *numbers, const double *expected, size_t count) {
  for (size_t i = 0; i < count; i++)
    if (!(fabs(numbers[i] - expected[i]) < 1e-7)) fail_msg("number %zu is %g, not %g", i, numbers[i], expected[i]);
}

static void assert_matrix(const double *m, double x, double y, double z) {
  const double expected[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1};
  assert_numbers(m, expected, 16);
}

static void test_a_skeleton_its_skin_and_its_rest_are_those_of_the_file(void **state) {
  (void)state;
  reading r = read_text(
      ROOT("double3 xformOp:translate = (10, 0, 0)\nuniform token[] xformOpOrder = [\"xformOp:translate\"]\n" SKELETON(
          JOINTS BINDS RESTS) MESH(BINDING "matrix4d primvars:skel:geomBindTransform = " MOVED(3, 0, 0) "\n")));
  assert_no_warning(&r);
  const qmat_rig *rig = &r.scene->rig;
  assert_int_equal(rig->skeleton_count, 1);
  assert_string_equal(rig->skeleton_paths[0], "/r/s");
  assert_matrix(rig->skeleton_placements, 10, 0, 0);
  assert_int_equal(rig->joint_count, 2);
  assert_int_equal(rig->joint_parents[0], UINT32_MAX);
  assert_int_equal(rig->joint_parents[1], 0);
  assert_string_equal(rig->joint_names[1], "knee");
  const double poses[] = {0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 0, 2, 0, 0, 0, half, half, 1, 1, 1};
  assert_numbers(rig->joint_poses, poses, 20);
  assert_int_equal(rig->skin_count, 1);
  assert_int_equal(rig->bound_count, 2);
  assert_int_equal(rig->bound_joints[1], 1);
  assert_matrix(rig->bound_matrices, 3, 0, -1); /* the mesh's point goes to the scene at binding, and to the joint */
  assert_matrix(rig->bound_matrices + 16, 3, -2, -1);
  assert_int_equal(rig->placed_count, 1);
  assert_int_equal(rig->placed_skins[0], 0);
  assert_int_equal(rig->curve_count, 0);
  release(&r);
}

static void test_a_mirrored_and_scaled_rest_is_a_pose_that_gives_it_back(void **state) {
  (void)state;
  reading r = read_text(ROOT(SKELETON("uniform token[] joints = [\"a\"]\nuniform matrix4d[] bindTransforms = [" MOVED(
      0, 0, 0) "]\nuniform matrix4d[] restTransforms = [((0,0,2,0),(0,3,0,0),(4,0,0,0),(5,6,7,1))]\n")
                                 MESH("int[] primvars:skel:jointIndices = [0] (interpolation = \"constant\")\n"
                                      "float[] primvars:skel:jointWeights = [1] (interpolation = \"constant\")\n")));
  assert_no_warning(&r);
  const double *p = r.scene->rig.joint_poses;
  const double rows[3][3] = {{0, 0, 2}, {0, 3, 0}, {4, 0, 0}};
  for (int i = 0; i < 3; i++) {
    /* The scaled axis, rotated: v + 2 w (u x v) + 2 u x (u x v). */
    double v[3] = {0, 0, 0}, c[3], d[3];
    v[i] = p[7 + i];
    for (int k = 0; k < 3; k++) c[k] = p[3 + (k + 1) % 3] * v[(k + 2) % 3] - p[3 + (k + 2) % 3] * v[(k + 1) % 3];
    for (int k = 0; k < 3; k++) d[k] = p[3 + (k + 1) % 3] * c[(k + 2) % 3] - p[3 + (k + 2) % 3] * c[(k + 1) % 3];
    for (int k = 0; k < 3; k++) v[k] += 2 * p[6] * c[k] + 2 * d[k];
    assert_numbers(v, rows[i], 3);
  }
  assert_numbers(p, (const double[]){5, 6, 7}, 3);
  release(&r);
}

static void test_transforms_that_are_missing_come_from_the_others(void **state) {
  (void)state;
  reading r = read_text(ROOT(SKELETON(JOINTS RESTS) MESH(BINDING)));
  assert_true(has_warning(&r, "/r/s: no bindTransforms: the joints are bound where they rest"));
  /* The knee is at (0, 2, 1) and turned: (x, y, z) goes to (y - 2, -x, z - 1). */
  const double knee[16] = {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, -2, 0, -1, 1};
  assert_numbers(r.scene->rig.bound_matrices + 16, knee, 16);
  release(&r);
  r = read_text(ROOT(SKELETON(JOINTS BINDS) MESH(BINDING)));
  assert_true(has_warning(&r, "/r/s: no restTransforms: the joints rest where they are bound"));
  assert_numbers(r.scene->rig.joint_poses + 10, (const double[]){0, 2, 0, 0, 0, 0, 1, 1, 1, 1}, 10);
  release(&r);
}

static void test_skins_number_joints_as_the_mesh_does_and_equal_ones_are_one(void **state) {
  (void)state;
  reading r =
      read_text(ROOT(SKELETON(JOINTS BINDS RESTS)
                         MESH(BINDING) "def Xform \"x\" {\nuniform token[] skel:joints = [\"hip/knee\", \"hip\","
                                       "\"tail\"]\n" MESH(BINDING) "}\ndef Xform \"y\" {\n" MESH(BINDING) "}\n"));
  const qmat_rig *rig = &r.scene->rig;
  assert_true(has_warning(&r, "/r/x/m: its joint 'tail' is none of its skeleton's, and stays where it is bound"));
  assert_int_equal(rig->skin_count, 2);
  assert_int_equal(rig->placed_count, 3);
  const uint32_t skins[] = {0, 1, 0}, bound[] = {0, 1, 1, 0, UINT32_MAX};
  for (size_t i = 0; i < 3; i++) assert_int_equal(rig->placed_skins[i], skins[i]);
  assert_int_equal(rig->bound_count, 5);
  for (size_t i = 0; i < 5; i++) assert_int_equal(rig->bound_joints[i], bound[i]);
  assert_matrix(rig->bound_matrices + 64, 0, 0, 0);
  release(&r);
}

#define ANIMATION(contents) "def SkelAnimation \"walk\" {\n" contents "}\n"
#define MOVING(contents) \
  ROOT("rel skel:animationSource = </r/walk>\n" SKELETON(JOINTS BINDS RESTS) ANIMATION(contents) MESH(BINDING))

static void test_motion_has_the_times_and_parts_of_the_animation(void **state) {
  (void)state;
  /* The times are not in order, one is blocked, and the animation has a joint more. */
  reading r =
      read_text(MOVING("uniform token[] joints = [\"hip/knee\", \"tail\"]\n"
                       "float3[] translations.timeSamples = {48: [(1,2,3),(0,0,0)], 24: [(4,5,6),(0,0,0)], 30: None}\n"
                       "quatf[] rotations.timeSamples = {24: [(0,0,2,0),(1,0,0,0)], 36: [(1,0,0,-1),(1,0,0,0)]}\n"
                       "half3[] scales = [(2,3,4),(1,1,1)]\n"));
  assert_no_warning(&r);
  const qmat_rig *rig = &r.scene->rig;
  const uint32_t curves[] = {QMAT_RIG_TRANSLATION, 2, 1, QMAT_RIG_ROTATION, 2, 1};
  assert_int_equal(rig->curve_count, 2);
  for (size_t i = 0; i < 6; i++) assert_int_equal(rig->curves[i], curves[i]);
  assert_int_equal(rig->key_count, 4);
  assert_numbers(rig->key_times, (const double[]){0, 1, 0, 0.5}, 4); /* 24 codes a second, from the first */
  assert_int_equal(rig->moved_joints[0], 1);
  assert_int_equal(rig->value_count, 14);
  assert_numbers(rig->values, (const double[]){4, 5, 6, 1, 2, 3, 0, 1, 0, 0, 0, 0, -half, half}, 14);
  assert_numbers(rig->joint_poses + 17, (const double[]){2, 3, 4}, 3); /* without samples it is a pose */
  release(&r);
}

/* A file walk.usda beside a scene of 60 time codes a second that starts at code 30: a second of its animation takes two
 * in the scene, from code 60 on, which is half a second after the start. */
static void assert_walk(const char *walk, const char *scene) {
  char folder[64], path[96], name[96];
  make_folder(folder);
  snprintf(name, sizeof name, "%s/walk.usda", folder);
  snprintf(path, sizeof path, "%s/file.usda", folder);
  write_file(name, walk, strlen(walk));
  reading r = read_file(scene, path);
  assert_no_warning(&r);
  assert_int_equal(r.scene->rig.key_count, 2);
  assert_numbers(r.scene->rig.key_times, (const double[]){0.5, 2.5}, 2);
  release(&r);
  unlink(name);
  rmdir(folder);
}

#define WALK                                                           \
  "def SkelAnimation \"walk\" {\nuniform token[] joints = [\"hip\"]\n" \
  "float3[] translations.timeSamples = {0: [(0,0,0)], 12: [(0,0,1)]}\n}\n"

static void test_times_go_through_references_and_start_at_the_scenes_start(void **state) {
  (void)state;
  assert_walk("#usda 1.0\n(timeCodesPerSecond = 12)\n" WALK,
              "#usda 1.0\n(timeCodesPerSecond = 60\nstartTimeCode = 30)\ndef SkelRoot \"r\" {\n"
              "rel skel:skeleton = </r/s>\nrel skel:animationSource = </r/walk>\n"
              "def \"walk\" (references = @./walk.usda@</walk> (offset = 60; scale = 2)) {}\n" SKELETON(
                  JOINTS BINDS RESTS) MESH(BINDING) "}\n");
}

static void test_times_go_through_sublayers(void **state) {
  (void)state;
  assert_walk("#usda 1.0\n(timeCodesPerSecond = 12)\nover \"r\" { " WALK "}\n",
              "#usda 1.0\n(timeCodesPerSecond = 60\nstartTimeCode = 30\n"
              "subLayers = [@./walk.usda@ (offset = 60; scale = 2)])\ndef SkelRoot \"r\" {\n"
              "rel skel:skeleton = </r/s>\nrel skel:animationSource = </r/walk>\n" SKELETON(JOINTS BINDS RESTS)
                  MESH(BINDING) "}\n");
}

static void test_what_cannot_be_used_is_left_out_with_one_warning(void **state) {
  (void)state;
  static const struct {
    const char *text, *warning;
    size_t skins, curves;
  } cases[] = {
      {ROOT(MESH(BINDING)), "/r/m: not bound to its skeleton: there is no prim </r/s>", 0, 0},
      {ROOT("def Xform \"s\" {}\n" MESH(BINDING)), "/r/s: the skeleton is left out: the prim is no Skeleton", 0, 0},
      {ROOT(SKELETON("") MESH(BINDING)), "/r/s: the skeleton is left out: it has no joints", 0, 0},
      {ROOT(SKELETON(JOINTS) MESH(BINDING)), "/r/s: the skeleton is left out: it has neither bindTransforms nor", 0, 0},
      {ROOT(SKELETON("uniform token[] joints = [\"a\", \"a\"]\n" BINDS RESTS) MESH(BINDING)),
       "/r/s: the skeleton is left out: two joints have the same path", 0, 0},
      {ROOT(SKELETON("uniform token[] joints = [\"a/b\", \"a\"]\n" BINDS RESTS) MESH(BINDING)),
       "/r/s: the skeleton is left out: a joint comes before its parent", 0, 0},
      {ROOT(SKELETON(JOINTS "uniform matrix4d[] bindTransforms = [" MOVED(
           0, 0, 0) ", ((0,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]\n" RESTS) MESH(BINDING)),
       "/r/s: the skeleton is left out: a bind transform has no inverse", 0, 0},
      {ROOT(SKELETON(JOINTS BINDS "uniform matrix4d[] restTransforms = [" MOVED(0, 0, 0) "]\n") MESH(BINDING)),
       "/r/s: its restTransforms are left out: they are not finite, or not one for each of 2 joints", 1, 0},
      {ROOT(SKELETON(JOINTS BINDS "uniform matrix4d[] restTransforms = [" MOVED(
           0, 0, 0) ", ((1,1,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]\n") MESH(BINDING)),
       "/r/s: a rest transform shears: it is read as a rotation and a scale", 1, 0},
      {ROOT(SKELETON(JOINTS BINDS RESTS)
                MESH("int[] primvars:skel:jointIndices = [2] (interpolation = \"constant\")\n"
                     "float[] primvars:skel:jointWeights = [1] (interpolation = \"constant\")\n")),
       "/r/m: not bound to its skeleton: it names joint 2 of 2", 0, 0},
      {ROOT(SKELETON(JOINTS BINDS RESTS)
                MESH(BINDING "matrix4d primvars:skel:geomBindTransform = " MOVED(1e300, 0, 0) "\n")),
       "/r/m: not bound to its skeleton: its bind transform is not finite", 0, 0},
      {ROOT(SKELETON(JOINTS "uniform matrix4d[] bindTransforms = [" MOVED(
           0, 0, 0) ", ((1e-30,0,0,0),(0,1e-30,0,0),(0,0,1e-300,0),(0,0,0,1))]\n" RESTS) MESH(BINDING)),
       "/r/s: the skeleton is left out: a bind transform has no inverse", 0, 0},
      {ROOT(SKELETON(JOINTS BINDS RESTS "rel skel:animationSource = </r/none>\n") MESH(BINDING)),
       "/r/s: it does not move: there is no prim </r/none>", 1, 0},
      {ROOT(SKELETON(JOINTS BINDS RESTS "rel skel:animationSource = </r/m>\n") MESH(BINDING)),
       "/r/m: no animation is read from it: the prim is no SkelAnimation", 1, 0},
      {MOVING("uniform token[] joints = [\"tail\"]\n"), "/r/walk: it moves no joint of the skeleton", 1, 0},
      {MOVING("uniform token[] joints = [\"hip\"]\nfloat3[] translations = [(1,1,1),(2,2,2)]\n"),
       "/r/walk: its translations are left out: they do not match its 1 joints", 1, 0},
      {MOVING("uniform token[] joints = [\"hip\"]\nquatf[] rotations.timeSamples = {0: [(1,0,0,0)], 1: []}\n"
              "float3[] translations.timeSamples = {0: [(0,0,0)], 1: [(0,0,1)]}\n"),
       "/r/walk: its rotations are left out: a sample does not match its 1 joints", 1, 1},
      {"#usda 1.0\ndef PointInstancer \"i\" {\nrel prototypes = </i/p>\nint[] protoIndices = [0]\n"
       "point3f[] positions = [(0,0,0)]\ndef SkelRoot \"p\" {\nrel skel:skeleton = </i/p/s>\n" SKELETON(
           JOINTS BINDS RESTS) MESH(BINDING) "}\n}\n",
       "/i/p/m: its skeleton is ignored where a point instancer places it", 0, 0},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    reading r = read_text(cases[i].text);
    if (!has_warning(&r, cases[i].warning)) {
      const char *first = json_string_value(json_array_get(json_object_get(r.report, "warnings"), 0));
      fail_msg("case %zu has '%s', not '%s'", i, first ? first : "no warning", cases[i].warning);
    }
    assert_int_equal(r.scene->rig.skin_count, cases[i].skins);
    assert_int_equal(r.scene->rig.curve_count, cases[i].curves);
    assert_int_equal(r.scene->placement_count, 1); /* the mesh itself stays */
    release(&r);
  }
}

static void test_a_rig_that_does_not_fit_together_is_refused(void **state) {
  (void)state;
  static const struct {
    uint32_t parent, bound, skin, keys;
    double second;
    uint32_t moved, placed;
    bool lacks_skin;
  } cases[] = {{UINT32_MAX, 0, 0, 2, 1, 0, 0, false}, {0, 0, 0, 2, 1, 0, 0, false},
               {UINT32_MAX, 1, 0, 2, 1, 0, 0, false}, {UINT32_MAX, 0, 1, 2, 1, 0, 0, false},
               {UINT32_MAX, 0, 0, 1, 1, 0, 0, false}, {UINT32_MAX, 0, 0, 2, 0, 0, 0, false},
               {UINT32_MAX, 0, 0, 2, 1, 1, 0, false}, {UINT32_MAX, 0, 0, 2, 1, 0, 1, false},
               {UINT32_MAX, 0, 0, 2, 1, 0, 0, true}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    qmat_context context = {0};
    qmat_scene *scene = qmat_scene_new();
    qmat_rig *rig = &scene->rig;
    scene->name = qmat_strdup("thing");
    scene->format = qmat_strdup("usd");
    *rig = (qmat_rig){.skeleton_count = 1,
                      .joint_count = 1,
                      .skin_count = !cases[i].lacks_skin,
                      .placed_count = cases[i].placed,
                      .bound_count = 1,
                      .curve_count = 1,
                      .key_count = 2,
                      .moved_count = 1,
                      .value_count = 6};
    rig->skeleton_paths = qmat_calloc(1, sizeof *rig->skeleton_paths);
    rig->skeleton_paths[0] = qmat_strdup("/s");
    rig->skeleton_placements = qmat_calloc(16, sizeof(double));
    rig->joint_skeletons = qmat_calloc(1, sizeof(uint32_t));
    rig->joint_parents = qmat_calloc(1, sizeof(uint32_t));
    rig->joint_parents[0] = cases[i].parent;
    rig->joint_names = qmat_calloc(1, sizeof *rig->joint_names);
    rig->joint_names[0] = qmat_strdup("hip");
    rig->joint_poses = qmat_calloc(QMAT_RIG_POSE, sizeof(double));
    rig->skin_skeletons = qmat_calloc(1, sizeof(uint32_t));
    rig->skin_skeletons[0] = cases[i].skin;
    rig->skin_ends = qmat_calloc(1, sizeof(uint32_t));
    rig->skin_ends[0] = 1;
    rig->bound_joints = qmat_calloc(1, sizeof(uint32_t));
    rig->bound_joints[0] = cases[i].bound;
    rig->bound_matrices = qmat_calloc(16, sizeof(double));
    rig->curves = qmat_calloc(3, sizeof(uint32_t));
    rig->curves[1] = cases[i].keys;
    rig->curves[2] = 1;
    rig->key_times = qmat_calloc(2, sizeof(double));
    rig->key_times[1] = cases[i].second;
    rig->moved_joints = qmat_calloc(1, sizeof(uint32_t));
    rig->moved_joints[0] = cases[i].moved;
    rig->placed_skins = qmat_calloc(1, sizeof(uint32_t));
    rig->values = qmat_calloc(6, sizeof(double));
    assert_int_equal(qmat_value_seal(&context, &scene->base), i == 0 ? QMAT_OK : QMAT_ERROR_GEOMETRY);
    qmat_value_release(&scene->base);
    qmat_context_uninit(&context);
  }
}

/* ---- glTF ---- */

static double number_at(const json_t *array, size_t i) {
  return json_number_value(json_array_get(array, i));
}

/* Number `i` of an accessor of single-precision numbers in the asset's chunk. */
static double accessed(const qmat_gltf_asset *asset, const json_t *number, size_t i) {
  const json_t *accessor = json_array_get(json_object_get(asset->root, "accessors"), (size_t)json_number_value(number));
  const json_t *view = json_array_get(json_object_get(asset->root, "bufferViews"),
                                      (size_t)json_number_value(json_object_get(accessor, "bufferView")));
  const size_t at = (size_t)json_number_value(json_object_get(accessor, "byteOffset")) +
                    (size_t)json_number_value(json_object_get(view, "byteOffset")) + 4 * i;
  assert_true(at + 4 <= asset->chunk_size);
  float value;
  memcpy(&value, asset->chunk + at, sizeof value);
  return (double)value;
}

static void test_gltf_has_the_skeleton_its_skin_and_its_motion(void **state) {
  (void)state;
  reading r =
      read_text(MOVING("uniform token[] joints = [\"hip/knee\"]\n"
                       "quatf[] rotations.timeSamples = {0: [(1,0,0,0)], 48: [(1,0,0,1)]}\n"));
  r.scene->meters_per_unit = 0.01;
  r.scene->is_z_up = true;
  qmat_medial *ball = sealed_medial_mesh((const double[]){0, 0, 0, 1}, 1, NULL, 0, NULL, 0);
  qmat_mesh *skin = shape_seal(shape_box(1, 1, 1));
  const uint32_t joints[4 * 8] = {0, 1, 0, 0, 1};
  double weights[4 * 8] = {0.75, 0.25, 0, 0, 1};
  for (size_t i = 2; i < 8; i++) weights[4 * i] = 1;
  const qmat_gltf_addition addition = {.medial = ball,
                                       .skin = skin,
                                       .vertices = {.joints = joints, .weights = weights},
                                       .options = {.binary = true,
                                                   .quantisation = 0.001,
                                                   .meters_per_unit = 0.01,
                                                   .is_z_up = true,
                                                   .compress_skin = true,
                                                   .errors = {.diagonal = 1}}};
  qmat_file *file;
  qmat_gltf_asset asset;
  assert_int_equal(qmat_gltf_write_places(&r.context, r.scene, &addition, 1, &file), QMAT_OK);
  assert_int_equal(qmat_gltf_asset_init(&r.context, file->parts[0].bytes, file->parts[0].size, "file.glb", &asset),
                   QMAT_OK);
  const json_t *nodes = json_object_get(asset.root, "nodes"), *knee = json_array_get(nodes, 2);
  assert_string_equal(json_string_value(json_object_get(json_array_get(nodes, 0), "name")), "s");
  assert_string_equal(json_string_value(json_object_get(knee, "name")), "knee");
  assert_near(number_at(json_object_get(knee, "translation"), 1), 2, 0);
  assert_near(number_at(json_object_get(knee, "rotation"), 2), half, 1e-15);
  /* The skeleton is converted to metres with y up, the mesh's node is where joints leave it. */
  const json_t *converter = json_array_get(nodes, 3), *carrier = json_array_get(nodes, 5),
               *place = json_array_get(nodes, 4);
  assert_near(number_at(json_object_get(converter, "scale"), 0), 0.01, 0);
  assert_near(number_at(json_object_get(converter, "children"), 0), 0, 0);
  assert_null(json_object_get(carrier, "matrix"));
  assert_near(json_number_value(json_object_get(carrier, "skin")), 0, 0);
  assert_near(number_at(json_object_get(carrier, "children"), 0), 4, 0);
  assert_near(number_at(json_object_get(place, "matrix"), 6), -0.01, 0); /* y goes to -z */
  assert_near(number_at(json_object_get(place, "matrix"), 9), 0.01, 0);
  assert_string_equal(json_string_value(json_object_get(json_object_get(place, "extras"), "qmat_prim")), "/r/m");
  /* The skin, and the joints of its vertices, which Draco does not compress. */
  const json_t *of_skin = json_array_get(json_object_get(asset.root, "skins"), 0);
  assert_near(number_at(json_object_get(of_skin, "joints"), 0), 1, 0);
  assert_near(number_at(json_object_get(of_skin, "joints"), 1), 2, 0);
  assert_near(accessed(&asset, json_object_get(of_skin, "inverseBindMatrices"), 16 + 13), -2, 0);
  const json_t *mesh = json_array_get(json_object_get(asset.root, "meshes"), 0);
  const json_t *attributes = json_object_get(json_array_get(json_object_get(mesh, "primitives"), 0), "attributes");
  assert_non_null(json_object_get(attributes, "JOINTS_0"));
  assert_near(accessed(&asset, json_object_get(attributes, "WEIGHTS_0"), 1), 0.25, 0);
  assert_null(json_object_get(asset.root, "extensionsUsed"));
  /* The motion. */
  const json_t *animation = json_array_get(json_object_get(asset.root, "animations"), 0);
  const json_t *channel = json_array_get(json_object_get(animation, "channels"), 0);
  const json_t *sampler = json_array_get(json_object_get(animation, "samplers"), 0);
  assert_int_equal(json_array_size(json_object_get(animation, "channels")), 1);
  assert_near(json_number_value(json_object_get(json_object_get(channel, "target"), "node")), 2, 0);
  assert_string_equal(json_string_value(json_object_get(json_object_get(channel, "target"), "path")), "rotation");
  assert_near(accessed(&asset, json_object_get(sampler, "input"), 1), 2, 0);
  assert_near(accessed(&asset, json_object_get(sampler, "output"), 3), 1, 0);
  assert_near(accessed(&asset, json_object_get(sampler, "output"), 6), half, 1e-7);
  qmat_gltf_asset_uninit(&asset);
  qmat_value_release(&file->base);
  qmat_value_release(&ball->base);
  qmat_value_release(&skin->base);
  release(&r);
}

/* A mesh may list a joint twice and joints that the skeleton has not; the joints of a glTF skin are different nodes. */
static void test_a_joint_that_a_mesh_lists_twice_has_a_stand_in(void **state) {
  (void)state;
  reading r = read_text(ROOT(SKELETON(JOINTS BINDS RESTS)
                                 MESH(BINDING "uniform token[] skel:joints = [\"hip\", \"hip/knee\", \"hip\"]\n")));
  qmat_medial *ball = sealed_medial_mesh((const double[]){0, 0, 0, 1}, 1, NULL, 0, NULL, 0);
  qmat_mesh *skin = shape_seal(shape_box(1, 1, 1));
  const uint32_t numbers[4 * 8] = {0, 1, 2, 0};
  double weights[4 * 8] = {0.5, 0.25, 0.25, 0};
  for (size_t v = 1; v < 8; v++) weights[4 * v] = 1;
  const qmat_gltf_addition addition = {.medial = ball,
                                       .skin = skin,
                                       .vertices = {.joints = numbers, .weights = weights},
                                       .options = {.binary = true, .quantisation = 0.001}};
  qmat_file *file;
  qmat_gltf_asset asset;
  assert_int_equal(qmat_gltf_write_places(&r.context, r.scene, &addition, 1, &file), QMAT_OK);
  assert_int_equal(qmat_gltf_asset_init(&r.context, file->parts[0].bytes, file->parts[0].size, "file.glb", &asset),
                   QMAT_OK);
  const json_t *joints = json_object_get(json_array_get(json_object_get(asset.root, "skins"), 0), "joints");
  assert_int_equal(json_array_size(joints), 3);
  const json_int_t hip = json_integer_value(json_array_get(joints, 0)),
                   stand_in = json_integer_value(json_array_get(joints, 2));
  assert_true(stand_in != hip && stand_in != json_integer_value(json_array_get(joints, 1)));
  const json_t *nodes = json_object_get(asset.root, "nodes"),
               *children = json_object_get(json_array_get(nodes, (size_t)hip), "children");
  assert_int_equal(json_array_size(children), 2);
  assert_int_equal(json_integer_value(json_array_get(children, 1)), stand_in);
  assert_int_equal(json_object_size(json_array_get(nodes, (size_t)stand_in)), 0);
  qmat_gltf_asset_uninit(&asset);
  qmat_value_release(&file->base);
  qmat_value_release(&ball->base);
  qmat_value_release(&skin->base);
  release(&r);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_skeleton_its_skin_and_its_rest_are_those_of_the_file),
      cmocka_unit_test(test_a_mirrored_and_scaled_rest_is_a_pose_that_gives_it_back),
      cmocka_unit_test(test_transforms_that_are_missing_come_from_the_others),
      cmocka_unit_test(test_skins_number_joints_as_the_mesh_does_and_equal_ones_are_one),
      cmocka_unit_test(test_motion_has_the_times_and_parts_of_the_animation),
      cmocka_unit_test(test_times_go_through_references_and_start_at_the_scenes_start),
      cmocka_unit_test(test_times_go_through_sublayers),
      cmocka_unit_test(test_what_cannot_be_used_is_left_out_with_one_warning),
      cmocka_unit_test(test_a_rig_that_does_not_fit_together_is_refused),
      cmocka_unit_test(test_gltf_has_the_skeleton_its_skin_and_its_motion),
      cmocka_unit_test(test_a_joint_that_a_mesh_lists_twice_has_a_stand_in),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
