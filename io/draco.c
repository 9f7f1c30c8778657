/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/draco.h"

#include <math.h>

#include "core/geometry/medial_build.h"
#include "core/node.h"
#include "io/draco_draco.h"
#include "io/stored_medial.h"

/* ---- quantisation bits ---- */

int qmat_draco_bits_for(int components, double range, double error) {
  if (!isfinite(range) || !(error > 0)) return 30;
  double half = sqrt(components) / 2 * fabs(range);
  int bits = 1;
  while (bits < 30 && half / (double)((1u << bits) - 1) > error) bits++;
  return bits;
}

void qmat_draco_medial_ranges(const qmat_medial *medial, double *position_range, double *radius_range) {
  double low[4] = {INFINITY, INFINITY, INFINITY, INFINITY}, high[4] = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
  *position_range = *radius_range = 0;
  if (medial->sphere_count == 0) return;
  for (size_t i = 0; i < 4 * medial->sphere_count; i++) {
    low[i % 4] = fmin(low[i % 4], medial->spheres[i]);
    high[i % 4] = fmax(high[i % 4], medial->spheres[i]);
  }
  *position_range = fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
  *radius_range = high[3] - low[3];
}

static qmat_status check_bits(qmat_context *context, const char *field, int bits) {
  if (bits >= 1 && bits <= 30) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "%d quantisation bits: must be 1 to 30", bits);
  return qmat_fail_field(context, field);
}

/* ---- medial meshes ---- */

qmat_status qmat_draco_encode_medial(qmat_context *context, const qmat_medial *medial, const double *origin,
                                     int position_bits, int radius_bits, uint8_t **bytes, size_t *size) {
  *bytes = NULL;
  *size = 0;
  qmat_status status = check_bits(context, "position_bits", position_bits);
  if (status == QMAT_OK) status = check_bits(context, "radius_bits", radius_bits);
  if (status != QMAT_OK) return status;
  size_t count = medial->sphere_count;
  if (count == 0) return qmat_fail(context, QMAT_ERROR_GEOMETRY, "the medial mesh has no spheres");

  float *centres = qmat_alloc(count, 3 * sizeof *centres);
  float *radii = qmat_alloc(count, sizeof *radii);
  uint32_t *faces = NULL;
  size_t counts[3];
  if (!centres || !radii) {
    status = qmat_fail_memory(context, "the Draco form of a medial mesh");
    goto done;
  }
  for (size_t i = 0; i < count; i++) {
    const double *sphere = medial->spheres + 4 * i;
    for (size_t k = 0; k < 3; k++) centres[3 * i + k] = (float)(sphere[k] - (origin ? origin[k] : 0));
    radii[i] = (float)sphere[3];
    for (size_t k = 0; k < 4; k++) {
      if (isfinite(k < 3 ? centres[3 * i + k] : radii[i])) continue;
      char number[32];
      qmat_format_number(sphere[k], number, sizeof number);
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "%s does not fit into single precision", number);
      status = qmat_fail_element(context, "sphere", (int64_t)i);
      goto done;
    }
  }
  status = qmat_medial_faces(context, medial, &faces, counts);
  if (status != QMAT_OK) goto done;
  const qmat_draco_attribute attributes[2] = {
      {.meaning = QMAT_DRACO_POSITION, .components = 3, .bits = position_bits, .values = centres},
      {.meaning = QMAT_DRACO_GENERIC, .components = 1, .bits = radius_bits, .values = radii},
  };
  status =
      qmat_draco_encode(context, attributes, 2, count, faces, counts[0] + counts[1] + counts[2], true, bytes, size);

done:
  qmat_free(faces);
  qmat_free(radii);
  qmat_free(centres);
  return status;
}

static void set_face(uint32_t *faces, size_t *count, uint32_t a, uint32_t b, uint32_t c) {
  faces[3 * *count] = a;
  faces[3 * *count + 1] = b;
  faces[3 * *count + 2] = c;
  (*count)++;
}

/* Separates triangles from edges: `faces` keeps the triangles; `edges` has room for one edge per face. */
static void split_faces(uint32_t *faces, size_t face_count, size_t *triangle_count, uint32_t *edges,
                        size_t *edge_count) {
  *triangle_count = *edge_count = 0;
  for (size_t f = 0; f < face_count; f++) {
    uint32_t a = faces[3 * f], b = faces[3 * f + 1], c = faces[3 * f + 2];
    if (a != b && b != c && a != c) {
      set_face(faces, triangle_count, a, b, c);
    } else if (a != b || b != c) {
      edges[2 * *edge_count] = a;
      edges[2 * *edge_count + 1] = a == b ? c : b;
      (*edge_count)++;
    }
  }
}

qmat_status qmat_draco_decode_medial(qmat_context *context, const uint8_t *bytes, size_t size, const double *origin,
                                     qmat_medial **medial) {
  *medial = NULL;
  qmat_draco_mesh *mesh = NULL;
  double *values = NULL;
  uint32_t *faces = NULL, *edges = NULL;
  qmat_medial *made = NULL;
  qmat_status status = qmat_draco_mesh_new(context, bytes, size, &mesh);
  if (status != QMAT_OK) goto done;
  uint32_t position = 0, radius = 0;
  if (!qmat_draco_mesh_find(mesh, QMAT_DRACO_POSITION, 3, &position) ||
      !qmat_draco_mesh_find(mesh, QMAT_DRACO_GENERIC, 1, &radius)) {
    status = qmat_fail(context, QMAT_ERROR_FORMAT,
                       "the Draco data are not a medial mesh: it needs one POSITION of 3 floats and one "
                       "GENERIC attribute of 1 float");
    goto done;
  }

  size_t count = qmat_draco_mesh_point_count(mesh), face_count = qmat_draco_mesh_face_count(mesh);
  values = qmat_alloc(count, 4 * sizeof *values);
  faces = qmat_alloc(face_count, 3 * sizeof *faces);
  edges = qmat_alloc(face_count, 2 * sizeof *edges);
  made = qmat_medial_new();
  if (made) made->spheres = qmat_alloc(count, 4 * sizeof *made->spheres);
  if (!values || !faces || !edges || !made || !made->spheres) {
    status = qmat_fail_memory(context, "a medial mesh");
    goto done;
  }
  made->sphere_count = count;
  status = qmat_draco_mesh_attribute(context, mesh, position, 3, values);
  if (status == QMAT_OK) status = qmat_draco_mesh_attribute(context, mesh, radius, 1, values + 3 * count);
  if (status != QMAT_OK) goto done;
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < 3; k++) made->spheres[4 * i + k] = values[3 * i + k] + (origin ? origin[k] : 0);
    made->spheres[4 * i + 3] = values[3 * count + i];
  }
  qmat_draco_mesh_faces(mesh, faces);
  size_t triangle_count, edge_count;
  split_faces(faces, face_count, &triangle_count, edges, &edge_count);
  status = qmat_medial_set_simplices(context, made, edges, edge_count, faces, triangle_count);
  if (status == QMAT_OK) status = qmat_value_seal(context, &made->base);
  if (status == QMAT_OK) {
    *medial = made;
    made = NULL;
  }

done:
  if (made) qmat_value_release(&made->base);
  qmat_free(edges);
  qmat_free(faces);
  qmat_free(values);
  qmat_draco_mesh_free(mesh);
  return status;
}

/* ---- triangle meshes for display ---- */

/* Decodes the skin to get the counts and bounds that a viewer will see. */
static qmat_status measure_skin(qmat_context *context, qmat_draco_skin *skin) {
  double *positions = NULL;
  qmat_draco_mesh *mesh = NULL;
  qmat_status status = qmat_draco_mesh_new(context, skin->bytes, skin->size, &mesh);
  if (status != QMAT_OK) goto done;
  if (!qmat_draco_mesh_find(mesh, QMAT_DRACO_POSITION, 3, &skin->position_id) ||
      !qmat_draco_mesh_find(mesh, QMAT_DRACO_NORMAL, 3, &skin->normal_id)) {
    status = qmat_fail(context, QMAT_ERROR_INTERNAL, "the attributes that Draco decodes differ from the encoded ones");
    goto done;
  }
  size_t count = qmat_draco_mesh_point_count(mesh);
  skin->vertex_count = (uint32_t)count;
  skin->triangle_count = (uint32_t)qmat_draco_mesh_face_count(mesh);
  positions = qmat_alloc(count, 3 * sizeof *positions);
  if (!positions) {
    status = qmat_fail_memory(context, "the decoded skin");
    goto done;
  }
  status = qmat_draco_mesh_attribute(context, mesh, skin->position_id, 3, positions);
  if (status != QMAT_OK) goto done;
  for (int k = 0; k < 3; k++) skin->min[k] = skin->max[k] = (float)positions[k];
  for (size_t i = 0; i < 3 * count; i++) {
    skin->min[i % 3] = fminf(skin->min[i % 3], (float)positions[i]);
    skin->max[i % 3] = fmaxf(skin->max[i % 3], (float)positions[i]);
  }

done:
  qmat_free(positions);
  qmat_draco_mesh_free(mesh);
  return status;
}

qmat_status qmat_draco_encode_mesh(qmat_context *context, const float *positions, const float *normals,
                                   size_t vertex_count, const uint32_t *triangles, size_t triangle_count,
                                   int position_bits, int normal_bits, qmat_draco_skin *skin) {
  *skin = (qmat_draco_skin){0};
  const qmat_draco_attribute attributes[2] = {
      {.meaning = QMAT_DRACO_POSITION, .components = 3, .bits = position_bits, .values = positions},
      {.meaning = QMAT_DRACO_NORMAL, .components = 3, .bits = normal_bits, .values = normals},
  };
  qmat_status status = qmat_draco_encode(context, attributes, 2, vertex_count, triangles, triangle_count, false,
                                         &skin->bytes, &skin->size);
  if (status == QMAT_OK) status = measure_skin(context, skin);
  if (status != QMAT_OK) qmat_draco_skin_uninit(skin);
  return status;
}

void qmat_draco_skin_uninit(qmat_draco_skin *skin) {
  qmat_free(skin->bytes);
  *skin = (qmat_draco_skin){0};
}
