/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/skin/envelope_surface.h"

#include <math.h>

#include "nodes/skin/contour.h"

/* A sphere of this radius, in finest cells, always has a cell corner inside; as it moves, the corners nearest to its
 * centre form a connected path. (Half a cell's diagonal is 0.866.) */
static const double RADIUS_FLOOR = 0.9;

static void contour_uninit(qmat_contour *c) {
  qmat_cells_uninit(&c->cells);
  qmat_key_table_uninit(&c->cell_table);
  qmat_key_table_uninit(&c->corner_table);
  qmat_free(c->corners);
  qmat_free(c->owners);
  qmat_free(c->values);
  qmat_free(c->cell_corners);
  qmat_free(c->split_edges);
  qmat_free(c->owned_edges);
  qmat_free(c->first_crossing);
  qmat_free(c->crossings);
  qmat_free(c->crossing_at);
  qmat_free(c->sheet_cells);
  qmat_free(c->sheet_items);
  qmat_free(c->items);
  qmat_free(c->positions);
}

qmat_status qmat_envelope_surface(qmat_context *context, const qmat_envelope *envelope,
                                  const qmat_cell_request *request, qmat_skin_triangles *surface,
                                  qmat_envelope_grid *grid) {
  *surface = (qmat_skin_triangles){0};
  qmat_contour c = {.context = context, .threads = qmat_threads(context)};
  *grid = (qmat_envelope_grid){.base = request->base, .finest = ldexp(request->base, -request->detail)};
  grid->smallest_radius = RADIUS_FLOOR * grid->finest;
  for (size_t i = 0; i < request->sphere_count; i++)
    grid->raised_sphere_count += request->spheres[4 * i + 3] < grid->smallest_radius;
  qmat_status status = qmat_cells_find(context, envelope, request, grid->smallest_radius, &c.cells);
  grid->is_too_fine = c.cells.is_incomplete;
  if (grid->is_too_fine) {
    contour_uninit(&c);
    return status;
  }
  if (status == QMAT_OK && c.cells.count == 0)
    status = qmat_fail(context, QMAT_ERROR_GEOMETRY, "the medial mesh encloses no volume");
  grid->cell_count = c.cells.count;
  grid->refined_cell_count = c.cells.refined_count;
  qmat_status (*const steps[])(qmat_contour *) = {qmat_contour_number_corners,   qmat_contour_find_split_edges,
                                                  qmat_contour_evaluate_corners, qmat_contour_find_crossings,
                                                  qmat_contour_find_partners,    qmat_contour_find_sheets,
                                                  qmat_contour_place_sheets,     qmat_contour_part_doubled_edges};
  const size_t count = sizeof steps / sizeof *steps;
  for (size_t i = 0; status == QMAT_OK && i < count; i++) {
    status = steps[i](&c);
    if (status == QMAT_OK) status = qmat_progress(context, i + 1, count + 1, "contouring steps");
  }
  if (status == QMAT_OK) status = qmat_contour_make_triangles(&c, surface);
  contour_uninit(&c);
  return status;
}
