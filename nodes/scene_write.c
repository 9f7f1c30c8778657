/* SPDX-License-Identifier: GPL-3.0-or-later */
/* scene.write: a medial mesh and its skin as a file in memory. */
#include <math.h>

#include "core/geometry/joint_weights.h"
#include "core/json_text.h"
#include "core/node.h"
#include "core/text.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_colliders.h"
#include "io/gltf/gltf_write.h"
#include "io/mesh/ma.h"
#include "io/mesh/ply_medial.h"
#include "io/robot_write.h"
#include "io/usd/usd_write.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/descriptor/medial_summary.h"
#include "nodes/measure/storage_share.h"
#include "nodes/page/certificate.h"
#include "nodes/page/shown.h"
#include "nodes/page/skin_colours.h"

/* Without a report, epsilon is taken for this share of the diagonal. */
#define DEFAULT_EPSILON 1e-3
/* Quantisation is never held to less than this share of the diagonal, which is near single precision. */
#define LEAST_QUANTISATION 1e-7

typedef enum file_format {
  FORMAT_GLB,
  FORMAT_GLTF,
  FORMAT_MA,
  FORMAT_PLY,
  FORMAT_USDA,
  FORMAT_USDC,
  FORMAT_USDZ,
  FORMAT_URDF,
  FORMAT_XML,
  FORMAT_YAML
} file_format;

typedef struct scene_write_params {
  int format; /* a file_format */
  bool draco, draco_meshes, skin_beside, skin_colours, side_files;
  int64_t position_bits, radius_bits;
  int flat;    /* a qmat_flat_form */
  int require; /* a qmat_requirement */
  bool khr_physics, omi_physics, unreal_hulls, godot_hulls, fixed;
} scene_write_params;

enum { IN_SCENE, IN_MEDIAL, IN_SKIN, IN_REPORT, IN_COLLIDERS };
enum { OUT_FILE, OUT_REPORT };

/* The diagonal of the box around all spheres, which is the model's up to the error of the medial mesh. */
static double diagonal_of(const qmat_medial *medial) {
  double square = 0;
  for (size_t axis = 0; axis < 3; axis++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < medial->sphere_count; i++) {
      const double *sphere = medial->spheres + 4 * i;
      low = fmin(low, sphere[axis] - sphere[3]);
      high = fmax(high, sphere[axis] + sphere[3]);
    }
    if (high > low) square += (high - low) * (high - low);
  }
  return sqrt(square);
}

/* What the report says of one medial mesh. */
static qmat_stated_errors errors_of(const qmat_medial *medial, const qmat_report *report) {
  qmat_stated_errors errors = qmat_errors_of_report(report);
  if (!(errors.diagonal > 0) && medial) errors.diagonal = diagonal_of(medial);
  return errors;
}

/* The errors of the spheres that the report has, in model units and in the arena; NULL: none. */
static const double *sphere_errors_of(qmat_context *context, const qmat_medial *medial, const qmat_report *report,
                                      double diagonal) {
  const json_t *list = report ? json_object_get(report->root, "sphere_errors") : NULL;
  if (!medial || json_array_size(list) != medial->sphere_count) return NULL;
  double *errors = qmat_arena_alloc(&context->arena, medial->sphere_count, sizeof *errors);
  for (size_t i = 0; errors && i < medial->sphere_count; i++) {
    const double error = json_number_value(json_array_get(list, i));
    errors[i] = diagonal * error;
    if (!(error >= 0) || !isfinite(errors[i])) return NULL;
  }
  return errors;
}

/* How far storage may move the solid, in model units. What is certified stays so where that is possible. */
static double storage_of(const qmat_stated_errors *errors) {
  const double allowed = QMAT_STORAGE_SHARE / 2 * (errors->epsilon > 0 ? errors->epsilon : DEFAULT_EPSILON);
  const double left = errors->epsilon - fmax(errors->error_out, errors->error_in);
  const bool is_tight = errors->certified == QMAT_CERTIFICATE_YES && left < allowed;
  return errors->diagonal * (is_tight ? fmax(0.99 * left, LEAST_QUANTISATION) : allowed);
}

/* What is written of one medial mesh; NULL: none. */
static qmat_gltf_addition addition_of(qmat_context *context, const scene_write_params *params, const qmat_scene *scene,
                                      const qmat_medial *medial, const qmat_mesh *skin, const qmat_report *report,
                                      const char *name, qmat_stated_errors *stated) {
  const qmat_stated_errors errors = errors_of(medial, report);
  return (qmat_gltf_addition){.medial = medial,
                              .skin = skin,
                              .options = {.binary = params->format == FORMAT_GLB,
                                          .embed = !params->side_files,
                                          .compress_skin = params->draco,
                                          .position_bits = (int)params->position_bits,
                                          .radius_bits = (int)params->radius_bits,
                                          .flat = (qmat_flat_form)params->flat,
                                          .quantisation = storage_of(&errors),
                                          .name = name,
                                          .meters_per_unit = scene ? scene->meters_per_unit : 0,
                                          .is_z_up = scene && scene->is_z_up,
                                          .sphere_errors = sphere_errors_of(context, medial, report, errors.diagonal),
                                          .errors = errors,
                                          .stated = stated}};
}

static bool is_usd(const scene_write_params *params) {
  return params->format >= FORMAT_USDA && params->format <= FORMAT_USDZ;
}

static bool holds_no_scene(const scene_write_params *params) {
  return params->format >= FORMAT_URDF || params->format == FORMAT_MA || params->format == FORMAT_PLY;
}

/* Whether the scene itself is written, with its own meshes: a glTF scene as glTF, or a USD scene as USD. */
static bool keeps_scene(const scene_write_params *params, const qmat_scene *scene) {
  return scene && scene->part_count > 0 && (scene->placement_count > 0) == is_usd(params);
}

/* The name of a mesh in a list, else that of the scene; NULL: none. */
static const char *name_of(const qmat_scene *scene, const qmat_value *medial, size_t index) {
  if (medial->type == QMAT_LIST) return ((const qmat_list *)medial)->names[index];
  return scene ? scene->name : NULL;
}

/* Without a choice, colliders are written as Khronos defines them. */
static unsigned collider_forms(const scene_write_params *params) {
  const unsigned forms = (params->khr_physics ? QMAT_GLTF_KHR : 0U) | (params->omi_physics ? QMAT_GLTF_OMI : 0U) |
                         (params->unreal_hulls ? QMAT_GLTF_UNREAL : 0U) | (params->godot_hulls ? QMAT_GLTF_GODOT : 0U);
  return forms ? forms : QMAT_GLTF_KHR;
}

/* Whether a place of the mesh has a skin. */
static bool is_skinned(const qmat_scene *scene, size_t mesh) {
  for (size_t i = 0; i < scene->rig.placed_count; i++)
    if (scene->placed[i] == mesh && scene->rig.placed_skins[i] != UINT32_MAX) return true;
  return false;
}

/* What the vertices of a skin have besides their places, in the arena. */
static qmat_status add_vertex_data(qmat_context *context, const scene_write_params *params, bool has_joints,
                                   qmat_gltf_addition *addition) {
  const qmat_medial *medial = addition->medial;
  const qmat_mesh *skin = addition->skin;
  if (!medial || !skin) return QMAT_OK;
  if (params->skin_colours) {
    const qmat_status status = qmat_skin_colours(context, medial, skin, &addition->vertices.colours);
    if (status != QMAT_OK) return status;
  }
  if (has_joints && skin->skinned_count > 0) {
    addition->vertices.joints = skin->joints;
    addition->vertices.weights = skin->weights;
    return QMAT_OK;
  }
  if (!has_joints || medial->skinned_count == 0) return QMAT_OK;
  uint32_t *joints = qmat_arena_alloc(&context->arena, 4 * skin->vertex_count, sizeof *joints);
  double *weights = qmat_arena_alloc(&context->arena, 4 * skin->vertex_count, sizeof *weights);
  if (!joints || !weights) return qmat_fail_memory(context, "the joints of a skin");
  addition->vertices.joints = joints;
  addition->vertices.weights = weights;
  return qmat_joints_of_envelope(context, medial, skin, joints, weights);
}

/* All inputs of one mesh, or lists of one length. `stated` has one element a medial mesh. */
static qmat_status write_gltf(qmat_context *context, const scene_write_params *params, const qmat_value *const inputs[],
                              json_t *report, qmat_stated_errors *stated, qmat_file **file) {
  const qmat_scene *scene = (const qmat_scene *)inputs[IN_SCENE];
  const bool placed = scene && scene->placement_count > 0, kept = keeps_scene(params, scene);
  const size_t count = qmat_value_count(inputs[IN_MEDIAL]),
               expected = (kept || placed) && scene->mesh_count > 0 ? scene->mesh_count : 1;
  if (params->skin_colours && params->draco) {
    qmat_fail(context, QMAT_ERROR_USAGE, "a skin that Draco compresses has no colours");
    return qmat_fail_field(context, "skin_colours");
  }
  if (count != expected) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%zu medial meshes for %zu meshes", count, expected);
    return qmat_fail_field(context, "medial");
  }
  qmat_gltf_addition *additions = qmat_calloc(count, sizeof *additions);
  if (!additions) return qmat_fail_memory(context, "a glTF file");
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count; i++) {
    const bool shows = !kept || params->skin_beside;
    additions[i] = addition_of(context, params, scene, (const qmat_medial *)qmat_shown_given(inputs[IN_MEDIAL], i),
                               shows ? (const qmat_mesh *)qmat_shown_given(inputs[IN_SKIN], i) : NULL,
                               (const qmat_report *)qmat_shown_given(inputs[IN_REPORT], i),
                               name_of(scene, inputs[IN_MEDIAL], i), &stated[i]);
    additions[i].colliders = (const qmat_colliders *)qmat_shown_given(inputs[IN_COLLIDERS], i);
    additions[i].collider_forms = collider_forms(params);
    additions[i].dynamic = !params->fixed;
    if (status == QMAT_OK)
      status = add_vertex_data(context, params, kept || (placed && is_skinned(scene, i)), &additions[i]);
  }
  if (status == QMAT_OK)
    status = kept     ? qmat_gltf_enrich(context, scene, additions, count, params->draco_meshes, report, file)
             : placed ? qmat_gltf_write_places(context, scene, additions, count, file)
                      : qmat_gltf_write_addition(context, &additions[0], file);
  qmat_free(additions);
  return status;
}

static qmat_usd_options usd_options_of(const scene_write_params *params, const qmat_scene *scene,
                                       const qmat_medial *medial, const qmat_report *report,
                                       qmat_stated_errors *stated) {
  const qmat_stated_errors errors = errors_of(medial, report);
  return (qmat_usd_options){
      .form = (qmat_usd_form)(params->format - FORMAT_USDA + QMAT_USD_TEXT),
      .name = scene ? scene->name : NULL,
      .meters_per_unit = scene ? scene->meters_per_unit : 0,
      .is_z_up = scene && scene->is_z_up,
      .moved = storage_of(&errors),
      .dynamic = !params->fixed,
      .errors = errors,
      .stated = stated,
  };
}

/* The first place of a mesh. */
static const char *first_path(const qmat_scene *scene, size_t mesh) {
  for (size_t i = 0; i < scene->placement_count; i++)
    if (scene->placed[i] == mesh) return scene->placement_paths[i];
  return NULL;
}

/* A layer over a USD scene that was kept. */
static qmat_status write_layer(qmat_context *context, const scene_write_params *params,
                               const qmat_value *const inputs[], json_t *report, qmat_stated_errors *stated,
                               qmat_file **file) {
  const qmat_scene *scene = (const qmat_scene *)inputs[IN_SCENE];
  const size_t count = qmat_value_count(inputs[IN_MEDIAL]);
  if (count != scene->mesh_count) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%zu medial meshes for %zu meshes", count, scene->mesh_count);
    return qmat_fail_field(context, "medial");
  }
  qmat_usd_addition *additions = qmat_calloc(count, sizeof *additions);
  if (!additions) return qmat_fail_memory(context, "a USD file");
  for (size_t i = 0; i < count; i++) {
    const qmat_medial *medial = (const qmat_medial *)qmat_shown_given(inputs[IN_MEDIAL], i);
    additions[i] = (qmat_usd_addition){
        .medial = medial,
        .skin = params->skin_beside ? (const qmat_mesh *)qmat_shown_given(inputs[IN_SKIN], i) : NULL,
        .options = usd_options_of(params, scene, medial, (const qmat_report *)qmat_shown_given(inputs[IN_REPORT], i),
                                  &stated[i]),
    };
    additions[i].options.prim = first_path(scene, i);
    if (!is_skinned(scene, i))
      additions[i].options.colliders = (const qmat_colliders *)qmat_shown_given(inputs[IN_COLLIDERS], i);
  }
  const qmat_status status = qmat_usd_write_layer(context, scene, additions, count, report, file);
  qmat_free(additions);
  return status;
}

static qmat_status fail_several(qmat_context *context, size_t count) {
  qmat_fail(context, QMAT_ERROR_USAGE, "this format holds one medial mesh, not %zu", count);
  qmat_fail_field(context, "medial");
  return qmat_fail_hint(
      context,
      "write .glb or .gltf, or choose a mesh: qmat mat: --set model.mesh=merged, or =0 or another number or name");
}

static qmat_status write_usd(qmat_context *context, const scene_write_params *params, const qmat_value *const inputs[],
                             json_t *report, qmat_stated_errors *stated, qmat_file **file) {
  const qmat_scene *scene = (const qmat_scene *)inputs[IN_SCENE];
  if (keeps_scene(params, scene)) return write_layer(context, params, inputs, report, stated, file);
  const size_t count = qmat_value_count(inputs[IN_MEDIAL]);
  if (count > 1) return fail_several(context, count);
  qmat_usd_options options = usd_options_of(params, scene, (const qmat_medial *)inputs[IN_MEDIAL],
                                            (const qmat_report *)inputs[IN_REPORT], stated);
  options.colliders = (const qmat_colliders *)inputs[IN_COLLIDERS];
  return qmat_usd_write(context, (const qmat_medial *)inputs[IN_MEDIAL], (const qmat_mesh *)inputs[IN_SKIN], &options,
                        file);
}

/* Colliders alone, as robot simulators read them, in metres. `own`: metres of a unit of the mesh, by its report. */
static qmat_status write_robot(qmat_context *context, const scene_write_params *params,
                               const qmat_value *const inputs[], double own, qmat_file **file) {
  const qmat_scene *scene = (const qmat_scene *)inputs[IN_SCENE];
  const double of_scene = scene ? scene->meters_per_unit : 0;
  if (inputs[IN_COLLIDERS])
    return qmat_robot_write(context, (const qmat_colliders *)inputs[IN_COLLIDERS],
                            (qmat_robot_format)(params->format - FORMAT_URDF + QMAT_ROBOT_URDF),
                            scene ? scene->name : NULL, own > 0 ? own : of_scene, file);
  qmat_fail(context, QMAT_ERROR_USAGE, "urdf, xml and yaml hold only colliders, but the graph makes none");
  qmat_fail_field(context, "colliders");
  return qmat_fail_hint(context, "qmat mat: --colliders; in a graph: connect medial.colliders, as in colliders.yaml");
}

/* Writes what the file states of one medial mesh into a report; nothing where no errors are known. */
static bool put_stated(json_t *report, const qmat_medial *medial, const qmat_stated_errors *stated) {
  const struct {
    const char *key;
    double value;
  } numbers[] = {{"epsilon", stated->epsilon},
                 {"surface_to_envelope", stated->error_out},
                 {"envelope_to_surface", stated->error_in}};
  bool done = true;
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
    if (!isfinite(numbers[i].value)) return done;
    done = json_object_set_new(report, numbers[i].key, json_real(numbers[i].value)) == 0 && done;
  }
  const double meters = stated->meters_per_unit * stated->diagonal;
  if (meters > 0) {
    done =
        json_object_set_new(report, "surface_to_envelope_meters", json_real(meters * stated->error_out)) == 0 && done;
    done = json_object_set_new(report, "envelope_to_surface_meters", json_real(meters * stated->error_in)) == 0 && done;
  }
  if (stated->certified != QMAT_CERTIFICATE_UNKNOWN)
    done =
        json_object_set_new(report, "certified", json_boolean(stated->certified == QMAT_CERTIFICATE_YES)) == 0 && done;
  return json_object_set_new(report, "spheres", json_integer((json_int_t)medial->sphere_count)) == 0 && done;
}

/* The errors that the file states: one mesh's in the report itself, of several a list as a step has it that runs once
 * for each. */
static qmat_status report_stated(qmat_context *context, const qmat_value *given, const qmat_stated_errors *stated,
                                 json_t *report) {
  const size_t count = qmat_value_count(given);
  json_t *meshes = given->type == QMAT_LIST ? json_array() : NULL;
  bool done = given->type != QMAT_LIST || json_object_set_new(report, "meshes", meshes) == 0;
  for (size_t i = 0; i < count && done; i++) {
    const qmat_medial *medial = (const qmat_medial *)qmat_shown_given(given, i);
    if (!meshes) {
      done = put_stated(report, medial, &stated[i]);
      continue;
    }
    const qmat_list *list = (const qmat_list *)given;
    json_t *of_mesh = json_pack("{s:s}", "name", list->names[i]), *own = medial ? json_object() : NULL;
    if (medial) {
      done = put_stated(own, medial, &stated[i]);
      done = json_object_set_new(of_mesh, "report", own) == 0 && done;
    } else {
      done = json_object_set_new(of_mesh, "failure", json_string(qmat_value_failure(list->items[i]))) == 0;
    }
    done = json_array_append_new(meshes, of_mesh) == 0 && done;
  }
  return done ? QMAT_OK : qmat_fail_memory(context, "the report");
}

/* The other lists have as many elements as that of medial meshes. Only scenes hold several. */
static qmat_status check_counts(qmat_context *context, const void *data, const size_t counts[]) {
  static const int others[] = {IN_SKIN, IN_REPORT, IN_COLLIDERS};
  static const char *const names[] = {"skin", "report", "colliders"};
  const scene_write_params *params = data;
  const size_t count = counts[IN_MEDIAL];
  if (holds_no_scene(params) && count > 1) return fail_several(context, count);
  for (size_t i = 0; i < 3; i++) {
    const size_t of_other = counts[others[i]];
    if (of_other == 0 || of_other == count) continue;
    qmat_fail(context, QMAT_ERROR_USAGE, "%zu values for %zu medial meshes", of_other, count);
    return qmat_fail_field(context, names[i]);
  }
  return QMAT_OK;
}

/* A medial mesh alone needs no skin, nor does a scene that keeps its own meshes. Colliders alone need neither that nor
 * errors. */
static bool reads(const void *data, const qmat_value *const *known, size_t input) {
  const scene_write_params *params = data;
  const qmat_scene *scene = known ? (const qmat_scene *)known[IN_SCENE] : NULL;
  const bool is_robot = params->format >= FORMAT_URDF,
             is_plain = params->format == FORMAT_MA || params->format == FORMAT_PLY;
  if (input == IN_SKIN) return !is_robot && !is_plain && (params->skin_beside || !keeps_scene(params, scene));
  return input != IN_COLLIDERS || !is_plain;
}

static qmat_status check_spheres(qmat_context *context, const qmat_value *const inputs[]) {
  const size_t count = qmat_value_count(inputs[IN_MEDIAL]);
  for (size_t i = 0; i < count; i++) {
    const qmat_medial *medial = (const qmat_medial *)qmat_shown_given(inputs[IN_MEDIAL], i);
    if (!medial || medial->sphere_count > 0) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the medial mesh has no sphere");
    if (count > 1) qmat_fail_within(context, ((const qmat_list *)inputs[IN_MEDIAL])->names[i]);
    return qmat_fail_field(context, "medial");
  }
  return QMAT_OK;
}

static const char *const formats[] = {"glb", "gltf", "ma", "ply", "usda", "usdc", "usdz", "urdf", "xml", "yaml", NULL};

/* Scales that differ by less come from rounding. */
static const double same_scale = 1e-6;

/* Whether a file without a scene has the coordinates of one of its meshes. */
static bool is_alone(const scene_write_params *params, const qmat_scene *scene) {
  return scene && scene->mesh_count > 0 && (holds_no_scene(params) || (is_usd(params) && !keeps_scene(params, scene)));
}

/* Whether its units are not the scene's, since nodes scale the mesh. Files for robots are in metres. */
static bool has_own_units(const scene_write_params *params, const qmat_scene *scene, double own) {
  return is_alone(params, scene) && params->format < FORMAT_URDF && own > 0 && scene->meters_per_unit > 0 &&
         fabs(own / scene->meters_per_unit - 1) > same_scale;
}

/* Whether the scene has its mesh elsewhere, or turned. */
static qmat_status find_moved(qmat_context *context, const qmat_scene *scene, bool *moved) {
  *moved = false;
  for (size_t i = 0; i < scene->placement_count; i++)
    for (size_t k = 0; k < 15; k++) *moved = *moved || (k % 5 != 0 && scene->placements[16 * i + k] != 0);
  if (scene->placement_count > 0 || scene->part_count == 0) return QMAT_OK;
  qmat_gltf_asset asset;
  const qmat_status status =
      qmat_gltf_asset_init(context, scene->parts[0].bytes, scene->parts[0].size, "the scene", &asset);
  if (status == QMAT_OK) *moved = qmat_gltf_moves_mesh(asset.root, scene->meshes[0]);
  qmat_gltf_asset_uninit(&asset);
  return status;
}

/* How many nodes with one of the scene's meshes are instanced, and so have one body for all instances. */
static qmat_status count_instanced(qmat_context *context, const qmat_scene *scene, size_t *count) {
  qmat_gltf_asset asset;
  *count = 0;
  const qmat_status status =
      qmat_gltf_asset_init(context, scene->parts[0].bytes, scene->parts[0].size, "the scene", &asset);
  const json_t *nodes = status == QMAT_OK ? json_object_get(asset.root, "nodes") : NULL;
  for (size_t i = 0; i < json_array_size(nodes); i++) {
    const json_t *node = json_array_get(nodes, i);
    const int64_t mesh = qmat_gltf_mesh_of(node);
    if (!json_object_get(json_object_get(node, "extensions"), "EXT_mesh_gpu_instancing")) continue;
    for (size_t k = 0; k < scene->mesh_count; k++) *count += mesh == (int64_t)scene->meshes[k];
  }
  qmat_gltf_asset_uninit(&asset);
  return status;
}

/* The first parameter that is set for colliders; NULL: none. */
static const char *idle_collider_param(const scene_write_params *params) {
  if (params->fixed) return "fixed";
  if (is_usd(params)) return NULL; /* the others are of glTF */
  return params->khr_physics    ? "khr_physics"
         : params->omi_physics  ? "omi_physics"
         : params->unreal_hulls ? "unreal_hulls"
         : params->godot_hulls  ? "godot_hulls"
                                : NULL;
}

/* Warns of places and units that are not the scene's, and of colliders that a layer over a USD scene leaves out, since
 * no prim in it moves with a joint. */
static qmat_status add_warnings(qmat_context *context, const scene_write_params *params,
                                const qmat_value *const inputs[], double own, json_t *report) {
  const qmat_scene *scene = (const qmat_scene *)inputs[IN_SCENE];
  const char *format = formats[params->format];
  bool moved = false;
  int bad = 0;
  size_t instanced = 0;
  qmat_status status = is_alone(params, scene) ? find_moved(context, scene, &moved) : QMAT_OK;
  const bool in_scene = inputs[IN_COLLIDERS] && params->format <= FORMAT_GLTF && keeps_scene(params, scene);
  const bool is_merged = in_scene && scene->mesh_count == 0;
  if (status == QMAT_OK && in_scene) status = count_instanced(context, scene, &instanced);
  if (status != QMAT_OK) return status;
  if (instanced > 0)
    bad |= qmat_json_add_warning(
        report,
        "colliders are not repeated for the instances of EXT_mesh_gpu_instancing: %s%zu node%s with instances has one "
        "body",
        instanced == 1 ? "" : "each of ", instanced, instanced == 1 ? "" : "s");
  if (is_merged && !params->fixed && ((const qmat_colliders *)inputs[IN_COLLIDERS])->body_count > 0)
    bad |= qmat_json_add_warning(report,
                                 "the body of all meshes together moves alone: the scene's own meshes stay where their "
                                 "nodes are; --set asset.fixed=true makes a body that does not move");
  const char *idle = inputs[IN_COLLIDERS] || holds_no_scene(params) ? NULL : idle_collider_param(params);
  if (idle) bad |= qmat_json_add_warning(report, "%s has no effect without colliders; qmat mat: --colliders", idle);
  if (moved)
    bad |= qmat_json_add_warning(report,
                                 "the .%s file has the mesh where its own coordinates are, not where the scene's nodes "
                                 "put it: a run that saves no glTF or USD scene, or has model.mesh=merged, does that",
                                 format);
  if (has_own_units(params, scene, own))
    bad |= qmat_json_add_warning(report,
                                 "the .%s file is in the mesh's own units of %.4g m, not in the scene's of %.4g m: a "
                                 "run that saves no glTF or USD scene, or has model.mesh=merged, uses the scene's",
                                 format, own, scene->meters_per_unit);
  size_t skinned = 0;
  if (inputs[IN_COLLIDERS] && is_usd(params) && keeps_scene(params, scene))
    for (size_t i = 0; i < scene->mesh_count; i++) skinned += is_skinned(scene, i);
  if (skinned > 0)
    bad |= qmat_json_add_warning(report,
                                 "the .%s file holds no colliders of %zu meshes that move with joints: save them as "
                                 "glTF, or use model.mesh=merged",
                                 format, skinned);
  return bad ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const scene_write_params *params = data;
  const qmat_medial *medial = (const qmat_medial *)inputs[IN_MEDIAL];
  qmat_file *file = NULL;
  qmat_status status = check_spheres(context, inputs);
  if (status != QMAT_OK) return status;
  qmat_report *report = qmat_report_new();
  qmat_stated_errors *stated = qmat_calloc(qmat_value_count(inputs[IN_MEDIAL]), sizeof *stated);
  if (!report || !stated) status = qmat_fail_memory(context, "the report");
  if (status == QMAT_OK) {
    switch ((file_format)params->format) {
      case FORMAT_MA:
      case FORMAT_PLY:
        stated[0] = errors_of(medial, (const qmat_report *)inputs[IN_REPORT]);
        status = params->format == FORMAT_MA ? qmat_ma_write(context, medial, &file)
                                             : qmat_ply_write_medial(context, medial, &stated[0], &file);
        break;
      case FORMAT_URDF:
      case FORMAT_XML:
      case FORMAT_YAML:
        stated[0] = errors_of(medial, (const qmat_report *)inputs[IN_REPORT]);
        status = write_robot(context, params, inputs, stated[0].meters_per_unit, &file);
        break;
      case FORMAT_USDA:
      case FORMAT_USDC:
      case FORMAT_USDZ:
        status = write_usd(context, params, inputs, report->root, stated, &file);
        break;
      default:
        status = write_gltf(context, params, inputs, report->root, stated, &file);
        break;
    }
  }
  if (status == QMAT_OK && params->require == QMAT_REQUIRE_CERTIFIED)
    status = qmat_check_certified(context, inputs[IN_MEDIAL], stated);
  if (status == QMAT_OK) status = report_stated(context, inputs[IN_MEDIAL], stated, report->root);
  if (status == QMAT_OK) status = add_warnings(context, params, inputs, stated->meters_per_unit, report->root);
  if (status == QMAT_OK) status = qmat_value_seal(context, &report->base);
  qmat_free(stated);
  if (status == QMAT_OK) {
    outputs[OUT_FILE] = &file->base;
    outputs[OUT_REPORT] = &report->base;
    return QMAT_OK;
  }
  if (file) qmat_value_release(&file->base);
  qmat_value_release(report ? &report->base : NULL);
  return status;
}

static const char *const flat_forms[] = {"auto", "short", "float", "none", NULL};

static const qmat_param params[] = {
    {.name = "format",
     .unit = "",
     .doc = "The format of the file; the ending of an output path sets it",
     .type = QMAT_PARAM_ENUM,
     .default_number = FORMAT_GLB,
     .choices = formats,
     .flags = QMAT_PARAM_OUTPUT_FORMAT,
     .offset = offsetof(scene_write_params, format)},
    QMAT_BOOL(
        scene_write_params, draco,
        "Compress the skin with Draco (glb, gltf). The file is smaller, but some engines refuse it or show nothing"),
    QMAT_BOOL(scene_write_params, draco_meshes,
              "Compress the triangles of a glTF scene with Draco (glb, gltf). Its move is part of the errors"),
    QMAT_BOOL(scene_write_params, skin_beside,
              "Add the skin to a glTF scene as a further mesh beside the one that it describes"),
    QMAT_BOOL(scene_write_params, skin_colours,
              "Colour the skin's vertices by kind: sphere, cone or slab (glb, gltf; not with draco)"),
    QMAT_BOOL(scene_write_params, side_files,
              "Keep the buffers and images of a glTF scene in files beside a .glb instead of inside it"),
    QMAT_INT(scene_write_params, position_bits, "bits", 0, 0, 30,
             "Quantisation of the spheres' centres (glb, gltf); 0: chosen by epsilon"),
    QMAT_INT(scene_write_params, radius_bits, "bits", 0, 0, 30,
             "Quantisation of the spheres' radii (glb, gltf); 0: chosen by epsilon"),
    QMAT_ENUM(
        scene_write_params, flat, flat_forms, QMAT_FLAT_AUTO,
        "Numbers of the plain medial mesh (glb, gltf): 16 bits, single precision, or by epsilon; none: without it"),
    QMAT_REQUIRE_PARAM(scene_write_params),
    QMAT_BOOL(scene_write_params, khr_physics,
              "Write colliders as KHR_implicit_shapes and KHR_physics_rigid_bodies (glb, gltf); the default where no "
              "other form is chosen"),
    QMAT_BOOL(scene_write_params, omi_physics,
              "Write colliders as OMI_physics_shape and OMI_physics_body (glb, gltf), which Godot reads"),
    QMAT_BOOL(scene_write_params, unreal_hulls,
              "Write hulls of colliders as meshes named UCX_name_01 after their mesh (glb, gltf)"),
    QMAT_BOOL(scene_write_params, godot_hulls,
              "Write hulls of colliders as meshes named name_01-convcolonly (glb, gltf)"),
    QMAT_BOOL(scene_write_params, fixed, "Bodies with colliders do not move: they get no mass (glb, gltf, USD)"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "scene",
     .type = QMAT_SCENE,
     .optional = true,
     .decides = true,
     .doc = "The scene that the model was read from: a glTF scene to write back, else its name and unit"},
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The medial mesh, or one for each mesh of the scene", .list = true},
    {.name = "skin",
     .type = QMAT_MESH,
     .optional = true,
     .doc = "The surface that viewers show; not in ma and ply, nor in a scene with meshes of its own",
     .list = true},
    {.name = "report",
     .type = QMAT_REPORT,
     .optional = true,
     .doc = "Epsilon and the errors, from medial.evaluate or medial.simplify",
     .list = true},
    {.name = "colliders",
     .type = QMAT_COLLIDERS,
     .optional = true,
     .doc = "Shapes for collision detection, from medial.colliders; not in ma and ply",
     .list = true},
    {0},
};

static const qmat_port outputs[] = {
    [OUT_FILE] = {.name = "file", .type = QMAT_FILE, .doc = "The file, with its side files"},
    [OUT_REPORT] = {.name = "report",
                    .type = QMAT_REPORT,
                    .doc = "The errors that the file states, and what was compressed"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_draco, NULL};

const qmat_node qmat_node_scene_write = {
    .name = "scene.write",
    .version = 25,
    .summary = "Makes a file of a medial mesh and its skin, or adds medial meshes to a glTF scene",
    .doc =
        "A glTF scene from scene.read is written back whole, as glb or gltf: the extras of the nodes that carry a mesh "
        "gain its medial mesh. Any other model becomes a new asset that shows the skin; one in other units than "
        "metres, or "
        "with z up, below a node that converts it. The skeletons of a USD scene and their motion are in it, and move "
        "the "
        "skin as they move the spheres. A .glb contains the scene's "
        "buffers and images; those of a .gltf are files named after it.\n\n"
        "qmat_data in the extras is the medial mesh, by Draco and in base64; qmat_flat is the same as plain numbers, "
        "which "
        "the readers of examples/readers decode. qmat_error_out and qmat_error_in are the "
        "errors of the report plus the distance by which storage moves the solid, at most 0.25 % of epsilon. "
        "qmat_certified says whether both are proved to be within qmat_epsilon. Far from zero, the node is translated "
        "to qmat_origin_x, _y and _z.\n\n"
        "usda, usdc and usdz hold the skin, and as guides the spheres, edges and triangles with primvars:radius. Of a "
        "USD "
        "scene they are a layer over the original, which they keep beside or inside: each prim with a mesh gains a "
        "child with its medial mesh. ma and ply hold the medial mesh alone; "
        "urdf, xml (MJCF) and yaml (cuRobo) colliders alone.",
    .citation = "",
    .params_size = sizeof(scene_write_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .report_summary = &qmat_medial_summary,
    .check_counts = check_counts,
    .effort = 2,
    .reads = reads,
    .run = run,
};
