/* SPDX-License-Identifier: GPL-3.0-or-later */
/* scene.write: a medial mesh, and what shows it, as a file in memory. */
#include <math.h>

#include "core/node.h"
#include "io/gltf_write.h"
#include "io/ma.h"
#include "io/mesh_formats.h"
#include "io/usd_write.h"
#include "nodes/libraries.h"

/* Quantisation spends this part of epsilon at most; without a report epsilon is taken for this part of the diagonal. */
#define PART_OF_EPSILON 0.05
#define USUAL_EPSILON 1e-3

typedef enum file_format { FORMAT_GLB, FORMAT_GLTF, FORMAT_MA, FORMAT_PLY, FORMAT_USDA, FORMAT_USDZ } file_format;

typedef struct scene_write_params {
  int format; /* a file_format */
  bool draco;
  int64_t position_bits, radius_bits;
} scene_write_params;

enum { IN_SCENE, IN_MEDIAL, IN_SKIN, IN_REPORT };

/* The diagonal of the box around all spheres: the model's own, up to the error of the medial mesh. */
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

/* A number of the report; NAN when there is none. */
static double reported(const qmat_report *report, const char *key) {
  const json_t *value = report ? json_object_get(report->root, key) : NULL;
  return json_is_number(value) ? json_number_value(value) : NAN;
}

static qmat_certificate certificate_of(const qmat_report *report) {
  const json_t *certified = report ? json_object_get(report->root, "certified") : NULL;
  if (!json_is_boolean(certified)) return QMAT_CERTIFICATE_UNKNOWN;
  return json_is_true(certified) ? QMAT_CERTIFICATE_YES : QMAT_CERTIFICATE_NO;
}

static qmat_status write_gltf(qmat_context *context, const scene_write_params *params, const qmat_value *const inputs[],
                              qmat_file **file) {
  const qmat_scene *scene = (const qmat_scene *)inputs[IN_SCENE];
  const qmat_medial *medial = (const qmat_medial *)inputs[IN_MEDIAL];
  const qmat_report *report = (const qmat_report *)inputs[IN_REPORT];
  double epsilon = reported(report, "epsilon");
  qmat_gltf_options options = {
      .binary = params->format == FORMAT_GLB,
      .compress_skin = params->draco,
      .position_bits = (int)params->position_bits,
      .radius_bits = (int)params->radius_bits,
      .quantisation = PART_OF_EPSILON * (epsilon > 0 ? epsilon : USUAL_EPSILON) * diagonal_of(medial),
      .name = scene ? scene->name : NULL,
      .epsilon = epsilon,
      .error_out = reported(report, "surface_to_envelope"),
      .error_in = reported(report, "envelope_to_surface"),
      .certified = certificate_of(report),
  };
  return qmat_gltf_write(context, medial, (const qmat_mesh *)inputs[IN_SKIN], &options, file);
}

static qmat_status write_usd(qmat_context *context, const scene_write_params *params, const qmat_value *const inputs[],
                             qmat_file **file) {
  const qmat_scene *scene = (const qmat_scene *)inputs[IN_SCENE];
  const qmat_report *report = (const qmat_report *)inputs[IN_REPORT];
  const qmat_usd_options options = {
      .package = params->format == FORMAT_USDZ,
      .name = scene ? scene->name : NULL,
      .meters_per_unit = scene ? scene->meters_per_unit : 0,
      .is_z_up = scene && scene->is_z_up,
      .epsilon = reported(report, "epsilon"),
      .error_out = reported(report, "surface_to_envelope"),
      .error_in = reported(report, "envelope_to_surface"),
      .certified = certificate_of(report),
  };
  return qmat_usd_write(context, (const qmat_medial *)inputs[IN_MEDIAL], (const qmat_mesh *)inputs[IN_SKIN], &options,
                        file);
}

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const scene_write_params *params = data;
  const qmat_medial *medial = (const qmat_medial *)inputs[IN_MEDIAL];
  qmat_file *file = NULL;
  qmat_status status;
  if (medial->sphere_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "it has no sphere");
    return qmat_fail_field(context, "medial");
  }
  switch ((file_format)params->format) {
    case FORMAT_MA:
      status = qmat_ma_write(context, medial, &file);
      break;
    case FORMAT_PLY:
      status = qmat_ply_write_medial(context, medial, &file);
      break;
    case FORMAT_USDA:
    case FORMAT_USDZ:
      status = write_usd(context, params, inputs, &file);
      break;
    default:
      status = write_gltf(context, params, inputs, &file);
      break;
  }
  if (status == QMAT_OK) outputs[0] = &file->base;
  return status;
}

static const char *const formats[] = {"glb", "gltf", "ma", "ply", "usda", "usdz", NULL};

static const qmat_param params[] = {
    {.name = "format",
     .unit = "",
     .doc = "What file to make; the ending of an output path sets it",
     .type = QMAT_PARAM_ENUM,
     .default_number = FORMAT_GLB,
     .choices = formats,
     .flags = QMAT_PARAM_OUTPUT_FORMAT,
     .offset = offsetof(scene_write_params, format)},
    {.name = "draco",
     .unit = "",
     .doc = "Compress the skin too: smaller, but some engines refuse the file or show nothing (glb and gltf)",
     .type = QMAT_PARAM_BOOL,
     .offset = offsetof(scene_write_params, draco)},
    {.name = "position_bits",
     .unit = "bits",
     .doc = "Quantisation of the spheres' centres (glb and gltf); 0 takes what epsilon asks for",
     .type = QMAT_PARAM_INT,
     .min = 0,
     .max = 30,
     .offset = offsetof(scene_write_params, position_bits)},
    {.name = "radius_bits",
     .unit = "bits",
     .doc = "Quantisation of the spheres' radii (glb and gltf); 0 takes what epsilon asks for",
     .type = QMAT_PARAM_INT,
     .min = 0,
     .max = 30,
     .offset = offsetof(scene_write_params, radius_bits)},
    {0},
};

static const qmat_port inputs[] = {
    {.name = "scene", .type = QMAT_SCENE, .optional = true, .doc = "Where the model came from: names the node; its unit (usda and usdz)"},
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The medial mesh"},
    {.name = "skin", .type = QMAT_MESH, .optional = true, .doc = "The surface that viewers show (not ma and ply)"},
    {.name = "report", .type = QMAT_REPORT, .optional = true, .doc = "From medial.evaluate or medial.simplify: epsilon and the errors"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "file", .type = QMAT_FILE, .doc = "The finished file"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_draco, NULL};

const qmat_node qmat_node_scene_write = {
    .name = "scene.write",
    .version = 1,
    .summary = "Makes a file of a medial mesh and its skin",
    .doc =
        "glb and gltf hold the skin as an ordinary mesh, so that every client shows something, and the medial mesh as "
        "a Draco blob in base64, in the extras of the same node, where clients keep it (qmat_data; triangles first, "
        "then "
        "edges on no triangle as (i, j, j), then lone spheres as (i, i, i); the order of spheres is kept). Without "
        "bits given, quantisation moves the solid by at most 5 % of the report's epsilon, or of 0.1 % of the diagonal "
        "without a report; the measured move is in the extras as qmat_quantisation, in model units. The report's "
        "epsilon, surface_to_envelope, envelope_to_surface and certified go into the extras as they are: "
        "qmat_epsilon, qmat_error_out and qmat_error_in are fractions of the diagonal, before quantisation. usda and "
        "usdz hold the skin as a Mesh, and as guides the spheres as Points, the edges as BasisCurves and the triangles "
        "as a Mesh, all with primvars:radius in single precision, and the same facts in the prim's customData. ma and "
        "ply hold the medial mesh alone, unquantised. draco and the bits apply to glb and gltf only.",
    .citation = "",
    .params_size = sizeof(scene_write_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
