/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_medial_text.h"

#include <math.h>

#include "io/base64.h"
#include "io/draco.h"
#include "io/flat_medial.h"
#include "io/gltf/gltf_asset.h"

/* Encodes the medial mesh, decodes it again, and measures the loss. */
static qmat_status encode_and_measure(qmat_context *context, const qmat_medial *medial, qmat_gltf_medial_text *text,
                                      uint8_t **bytes, size_t *size) {
  qmat_medial *decoded = NULL;
  qmat_status status =
      qmat_draco_encode_medial(context, medial, text->origin, text->position_bits, text->radius_bits, bytes, size);
  if (status != QMAT_OK) return status;
  status = qmat_draco_decode_medial(context, *bytes, *size, text->origin, &decoded);
  if (status == QMAT_OK &&
      (decoded->sphere_count != medial->sphere_count || decoded->edge_count != medial->edge_count ||
       decoded->triangle_count != medial->triangle_count)) {
    status = qmat_fail(context, QMAT_ERROR_INTERNAL, "the medial mesh that Draco decodes differs from the encoded one");
  }
  if (status == QMAT_OK) text->loss = qmat_medial_move(medial, decoded);
  if (decoded) qmat_value_release(&decoded->base);
  return status;
}

/* Encodes the plain form, decodes it again, and measures the loss. */
static qmat_status encode_flat(qmat_context *context, const qmat_medial *medial, const double *errors,
                               qmat_gltf_medial_text *text) {
  uint8_t *bytes = NULL;
  size_t size = 0;
  qmat_medial *decoded = NULL;
  uint16_t *joints = text->has_joints ? qmat_alloc(4 * medial->sphere_count, sizeof *joints) : NULL;
  if (text->has_joints && !joints) return qmat_fail_memory(context, "the medial mesh as text");
  for (size_t i = 0; joints && i < 4 * medial->sphere_count; i++) joints[i] = (uint16_t)medial->joints[i];
  const qmat_sphere_data data = {.errors = errors, .joints = joints, .weights = medial->weights};
  qmat_status status = qmat_flat_encode(context, medial, &data, text->origin, text->flat_floats, &bytes, &size);
  if (status == QMAT_OK) status = qmat_flat_decode(context, bytes, size, text->origin, &decoded);
  if (status == QMAT_OK) {
    qmat_free(text->flat);
    text->flat_loss = qmat_medial_move(medial, decoded);
    text->flat = qmat_base64_encode(bytes, size);
    if (!text->flat) status = qmat_fail_memory(context, "the medial mesh as text");
  }
  if (decoded) qmat_value_release(&decoded->base);
  qmat_free(bytes);
  qmat_free(joints);
  return status;
}

static qmat_status make_flat_text(qmat_context *context, const qmat_medial *medial, const qmat_gltf_options *options,
                                  qmat_gltf_medial_text *text) {
  if (options->flat == QMAT_FLAT_NONE) return QMAT_OK;
  text->flat_floats = options->flat == QMAT_FLAT_FLOAT;
  qmat_status status = encode_flat(context, medial, options->sphere_errors, text);
  if (status == QMAT_OK && options->flat == QMAT_FLAT_AUTO && text->flat_loss > options->quantisation) {
    text->flat_floats = true;
    status = encode_flat(context, medial, options->sphere_errors, text);
  }
  return status;
}

qmat_status qmat_gltf_medial_text_init(qmat_context *context, const qmat_medial *medial, const double *origin,
                                       bool has_skin, const qmat_gltf_options *options, qmat_gltf_medial_text *text) {
  double position_range, radius_range, allowed = options->quantisation;
  bool choose_position = options->position_bits == 0, choose_radius = options->radius_bits == 0;
  qmat_draco_medial_ranges(medial, &position_range, &radius_range);
  *text = (qmat_gltf_medial_text){.position_bits = options->position_bits,
                                  .radius_bits = options->radius_bits,
                                  .origin = origin,
                                  .has_joints = has_skin && medial->skinned_count > 0};
  if (choose_position) text->position_bits = qmat_draco_bits_for(3, position_range, allowed / 2);
  if (choose_radius) text->radius_bits = qmat_draco_bits_for(1, radius_range, allowed / 2);

  uint8_t *bytes = NULL;
  size_t size = 0;
  qmat_status status = encode_and_measure(context, medial, text, &bytes, &size);
  /* The bound ignores single-precision rounding; a few more bits may compensate for it. */
  for (int tries = 0; tries < 3 && status == QMAT_OK && text->loss > allowed; tries++) {
    bool more_position = choose_position && text->position_bits < 30,
         more_radius = choose_radius && text->radius_bits < 30;
    if (!more_position && !more_radius) break;
    text->position_bits += more_position;
    text->radius_bits += more_radius;
    qmat_free(bytes);
    status = encode_and_measure(context, medial, text, &bytes, &size);
  }
  if (status == QMAT_OK) {
    text->base64 = qmat_base64_encode(bytes, size);
    if (!text->base64) status = qmat_fail_memory(context, "the medial mesh as text");
  }
  qmat_free(bytes);
  if (status == QMAT_OK) status = make_flat_text(context, medial, options, text);
  return status;
}

static bool set_count(json_t *object, const char *key, size_t count) {
  return qmat_gltf_set(object, key, json_integer((json_int_t)count));
}

static bool is_zero(const double *origin) {
  return origin[0] == 0 && origin[1] == 0 && origin[2] == 0;
}

json_t *qmat_gltf_medial_extras(const qmat_medial *medial, const qmat_gltf_medial_text *text,
                                const qmat_stated_errors *stated) {
  json_t *extras = json_object();
  bool done = extras && qmat_gltf_set(extras, "qmat_version", json_string(QMAT_VERSION)) &&
              qmat_gltf_set(extras, "qmat_data_format", json_string("draco")) &&
              qmat_gltf_set(extras, "qmat_data", json_string(text->base64)) &&
              set_count(extras, "qmat_vertices", medial->sphere_count) &&
              set_count(extras, "qmat_edges", medial->edge_count) &&
              set_count(extras, "qmat_triangles", medial->triangle_count);
  const struct {
    const char *key;
    double value;
  } errors[] = {
      {"qmat_epsilon", stated->epsilon}, {"qmat_error_out", stated->error_out}, {"qmat_error_in", stated->error_in}};
  bool any = false;
  for (size_t i = 0; i < sizeof errors / sizeof *errors && done; i++) {
    if (!isfinite(errors[i].value)) continue;
    done = qmat_gltf_set(extras, errors[i].key, json_real(errors[i].value));
    any = true;
  }
  if (any) done = done && qmat_gltf_set(extras, "qmat_error_unit", json_string("diagonal"));
  if (stated->certified != QMAT_CERTIFICATE_UNKNOWN)
    done = done && qmat_gltf_set(extras, "qmat_certified", json_boolean(stated->certified == QMAT_CERTIFICATE_YES));
  done = done && qmat_gltf_set(extras, "qmat_quantisation", json_real(text->loss)) &&
         qmat_gltf_set(extras, "qmat_quantisation_unit", json_string("model")) &&
         set_count(extras, "qmat_position_bits", (size_t)text->position_bits) &&
         set_count(extras, "qmat_radius_bits", (size_t)text->radius_bits) &&
         qmat_gltf_set(extras, "qmat_frame", json_string("node"));
  if (text->flat) {
    done = done && qmat_gltf_set(extras, "qmat_flat", json_string(text->flat)) &&
           qmat_gltf_set(extras, "qmat_flat_format", json_string(text->flat_floats ? "f32" : "u16")) &&
           qmat_gltf_set(extras, "qmat_flat_quantisation", json_real(text->flat_loss));
    if (text->has_joints) done = done && qmat_gltf_set(extras, "qmat_skinned", json_true());
  }
  static const char *const axes[] = {"qmat_origin_x", "qmat_origin_y", "qmat_origin_z"};
  for (int k = 0; k < 3 && done && !is_zero(text->origin); k++)
    done = qmat_gltf_set(extras, axes[k], json_real(text->origin[k]));
  if (done) return extras;
  json_decref(extras);
  return NULL;
}

void qmat_gltf_medial_text_uninit(qmat_gltf_medial_text *text) {
  qmat_free(text->base64);
  qmat_free(text->flat);
}
