/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/page_data.h"

#include <math.h>

#include "core/json_text.h"
#include "io/bytes.h"
#include "io/flat_medial.h"
#include "io/page/page_array.h"
#include "nodes/measure/unit_spheres.h"
#include "nodes/page/worst_places.h"
#include "nodes/simplify/collapse_chain.h"

static const double one = 32767, one_of_normals = 127;
/* Spheres of the chain are rounded to this share of the diagonal, so that they take fewer bytes. */
static const double chain_step = 1.0 / (1 << 18);
/* Stored errors end at this many ranges. */
static const double error_span = 4;

static void put_share(qmat_writer *writer, double share) {
  qmat_put_u16(writer, (uint16_t)(int16_t)lround(one * fmin(fmax(share, -1), 1)));
}

/* Sets the written numbers of `width` bytes as a page's array, `row` numbers a row; the writer is empty afterwards. */
static bool set_array(json_t *object, const char *key, size_t width, size_t row, qmat_writer *writer) {
  char *text = writer->failed ? NULL : qmat_page_array_encode(writer->bytes, writer->size / width, width, row);
  const bool done = text && json_object_set_new(object, key, json_string(text)) == 0;
  qmat_free(text);
  qmat_writer_uninit(writer);
  return done;
}

static json_t *surface_json(const qmat_shown *shown) {
  const qmat_display_mesh *display = &shown->display;
  qmat_writer positions = {0}, normals = {0}, errors = {0}, corners = {0};
  for (size_t i = 0; i < 3 * display->vertex_count; i++) {
    put_share(&positions, display->positions[i]);
    qmat_put_u8(&normals, (uint8_t)(int8_t)lround(one_of_normals * display->normals[i]));
  }
  for (size_t i = 0; i < display->vertex_count; i++)
    put_share(&errors, display->errors[i] / (error_span * shown->range));
  for (size_t i = 0; i < 3 * display->triangle_count; i++) qmat_put_u32(&corners, display->triangles[i]);
  json_t *surface = json_object();
  bool done = set_array(surface, "positions", 2, 3, &positions);
  done = set_array(surface, "normals", 1, 3, &normals) && done;
  done = set_array(surface, "errors", 2, 1, &errors) && done;
  done = set_array(surface, "corners", 4, 1, &corners) && done;
  done = qmat_json_set_count(surface, "vertices", shown->mesh->vertex_count) == 0 && done;
  done = qmat_json_set_count(surface, "triangles", shown->mesh->triangle_count) == 0 && done;
  if (done) return surface;
  json_decref(surface);
  return NULL;
}

/* Sets a medial mesh and its counts; `unit` has the arrays of a sealed medial mesh. */
static qmat_status set_medial(qmat_context *context, json_t *object, const qmat_medial *unit) {
  uint8_t *bytes;
  size_t size;
  const qmat_sphere_data none = {0};
  const qmat_status status = qmat_flat_encode(context, unit, &none, NULL, true, &bytes, &size);
  if (status != QMAT_OK) return status;
  char *text = qmat_page_array_encode(bytes, size / 4, 4, 0); /* all parts of qmat_flat have multiples of 4 bytes */
  qmat_free(bytes);
  bool done = text && json_object_set_new(object, "medial", json_string(text)) == 0;
  qmat_free(text);
  done = qmat_json_set_count(object, "spheres", unit->sphere_count) == 0 && done;
  done = qmat_json_set_count(object, "cones", unit->edge_count) == 0 && done;
  done = qmat_json_set_count(object, "slabs", unit->triangle_count) == 0 && done;
  return done ? QMAT_OK : qmat_fail_memory(context, "the page");
}

/* ---- the chain ---- */

static double rounded(double x) {
  return chain_step * round(x / chain_step);
}

/* Proved bounds of levels: [spheres, surface to envelope, envelope to surface], the finest first. */
static bool set_bounds(json_t *object, const qmat_chain *chain, size_t skipped) {
  json_t *rows = json_array();
  bool done = json_object_set_new(object, "bounds", rows) == 0;
  for (size_t i = 0; i < chain->bounded_count; i++) {
    if (chain->bounded[i] < skipped) continue;
    json_t *row = json_pack("[I, f, f]", (json_int_t)(chain->sphere_count - chain->bounded[i]), chain->bounds[2 * i],
                            chain->bounds[2 * i + 1]);
    done = json_array_append_new(rows, row) == 0 && done;
  }
  return done;
}

/* The collapses after the first `skipped`, with the numbers that the spheres have after those. */
static qmat_status set_collapses(qmat_context *context, json_t *object, const qmat_chain *chain, size_t skipped,
                                 const double *merged) {
  const size_t spheres = chain->sphere_count;
  uint32_t *roots = qmat_arena_alloc(&context->arena, spheres, sizeof *roots), next = 0;
  uint32_t *ids = qmat_arena_alloc(&context->arena, spheres, sizeof *ids);
  if (!roots || !ids) return qmat_fail_memory(context, "the page");
  qmat_collapse_roots(chain->ends, skipped, spheres, roots);
  for (size_t v = 0; v < spheres; v++) ids[v] = roots[v] == v ? next++ : UINT32_MAX;
  qmat_writer ends = {0}, placed = {0}, errors = {0};
  qmat_put_f32(&errors,
               (float)(skipped > 0 ? chain->errors[skipped - 1] : 0)); /* of the level that the chain starts at */
  for (size_t i = skipped; i < chain->collapse_count; i++) {
    for (size_t k = 0; k < 2; k++) qmat_put_u32(&ends, ids[chain->ends[2 * i + k]]);
    for (size_t k = 0; k < 4; k++) qmat_put_f32(&placed, (float)rounded(merged[4 * i + k]));
    qmat_put_f32(&errors, (float)chain->errors[i]);
  }
  bool done = set_array(object, "ends", 4, 0, &ends);
  done = set_array(object, "merged", 4, 0, &placed) && done;
  done = set_array(object, "errors", 4, 1, &errors) && done;
  return done ? QMAT_OK : qmat_fail_memory(context, "the page");
}

static qmat_status set_chain(qmat_context *context, const qmat_shown *shown, const qmat_chain *chain, size_t levels,
                             json_t *object) {
  if (chain->sphere_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the chain has no sphere");
    return qmat_fail_field(context, "chain");
  }
  const size_t most = chain->sphere_count > levels ? chain->sphere_count - levels : 0;
  const size_t skipped = most < chain->collapse_count ? most : chain->collapse_count;
  qmat_medial *start = qmat_medial_new();
  double *merged = qmat_arena_alloc(&context->arena, chain->collapse_count, 4 * sizeof *merged);
  qmat_status status = start && merged ? QMAT_OK : qmat_fail_memory(context, "the page");
  if (status == QMAT_OK) status = qmat_chain_extract(context, chain, skipped, start);
  qmat_medial unit = {.sphere_count = 0};
  if (status == QMAT_OK) {
    unit = *start;
    status = qmat_unit_spheres(context, &shown->frame, start, &unit.spheres);
    if (status != QMAT_OK) qmat_fail_field(context, "chain");
  }
  for (size_t i = 0; i < 4 * unit.sphere_count && status == QMAT_OK; i++) unit.spheres[i] = rounded(unit.spheres[i]);
  if (status == QMAT_OK) status = set_medial(context, object, &unit);
  if (status == QMAT_OK && !set_bounds(object, chain, skipped)) status = qmat_fail_memory(context, "the page");
  if (status == QMAT_OK) {
    qmat_frame_spheres_to_unit(&shown->frame, chain->merged, chain->collapse_count, merged);
    status = set_collapses(context, object, chain, skipped, merged);
  }
  qmat_value_release(start ? &start->base : NULL);
  return status;
}

/* ---- all of it ---- */

static json_t *place_json(const qmat_worst_place *place) {
  if (!(place->error > 0)) return json_null();
  return json_pack("[f,f,f,f]", place->at[0], place->at[1], place->at[2], place->error);
}

static qmat_status fill(qmat_context *context, const qmat_shown *shown, const qmat_report *report,
                        const qmat_chain *chain, size_t levels, json_t *root) {
  qmat_worst_place of_surface, of_envelope;
  qmat_status status =
      qmat_worst_places_find(context, shown, qmat_shown_number(report, "surface_to_envelope_at_least"),
                             qmat_shown_number(report, "envelope_to_surface_at_least"), &of_surface, &of_envelope);
  if (status == QMAT_OK) status = set_medial(context, root, &shown->unit);
  if (status != QMAT_OK) return status;
  json_t *worst = json_object(), *chain_json = chain ? json_object() : json_null();
  int bad = json_object_set_new(worst, "surface", place_json(&of_surface));
  bad |= json_object_set_new(worst, "envelope", place_json(&of_envelope));
  bad |= json_object_set_new(root, "worst", worst);
  bad |= json_object_set_new(root, "chain", chain_json);
  bad |= json_object_set_new(root, "surface", surface_json(shown));
  bad |= json_object_set(root, "report", report ? report->root : json_null());
  bad |= json_object_set_new(root, "range", json_real(shown->range));
  bad |= json_object_set_new(root, "diagonal", json_real(shown->frame.diagonal));
  bad |= json_object_set_new(root, "meters_per_unit", json_real(shown->mesh->meters_per_unit));
  if (bad) return qmat_fail_memory(context, "the page");
  return chain ? set_chain(context, shown, chain, levels, chain_json) : QMAT_OK;
}

json_t *qmat_page_data(qmat_context *context, const qmat_shown *shown, const qmat_report *report,
                       const qmat_chain *chain, size_t levels) {
  json_t *root = json_object();
  const qmat_status status =
      root ? fill(context, shown, report, chain, levels, root) : qmat_fail_memory(context, "the page");
  if (status == QMAT_OK) return root;
  json_decref(root);
  return NULL;
}
