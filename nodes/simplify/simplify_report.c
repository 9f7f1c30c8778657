/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/simplify_report.h"

#include <stdio.h>

#include "core/json_text.h"
#include "nodes/measure/topology_report.h"

void qmat_simplify_figures_of(const qmat_decimation *run, qmat_simplify_figures *figures) {
  figures->counts = run->counts;
  figures->constraint_points = run->constraints->count;
  figures->features = run->creases.left;
  figures->crease_error = qmat_crease_guard_error(&run->creases);
  figures->moves = run->moves;
}

static int add_warning(json_t *root, const qmat_simplify_figures *f, const qmat_medial *unit, double epsilon) {
  char text[160];
  snprintf(text, sizeof text, "%zu spheres are left instead of %zu: fewer are farther than %.3g %% from the surface",
           unit->sphere_count, f->wanted_spheres, 100 * epsilon);
  return json_object_set_new(root, "warnings", json_pack("[s]", text));
}

qmat_status qmat_simplify_report(qmat_context *context, const qmat_simplify_figures *f, const qmat_medial *unit,
                                 const qmat_surface *surface, double epsilon, double deviation, qmat_report *report) {
  const struct {
    const char *key;
    size_t count;
    bool shown;
  } counts[] = {{"initial_spheres", f->initial_spheres, true},
                {"spheres", unit->sphere_count, true},
                {"edges", unit->edge_count, true},
                {"triangles", unit->triangle_count, true},
                {"collapses", f->counts.collapses, true},
                {"constraint_points", f->constraint_points, true},
                {"refused_by_inside_test", f->counts.refused_by_inside_test, true},
                {"refused_by_surface_to_envelope", f->counts.refused_by_surface_to_envelope, true},
                {"refused_by_envelope_to_surface", f->counts.refused_by_envelope_to_surface, true},
                {"refused_by_protection", f->counts.refused_by_protection, true},
                {"refused_by_topology", f->counts.refused_by_topology, true},
                {"features", f->features, f->features > 0},
                {"rounds", f->rounds, !f->in_order},
                {"cavity_filling_spheres", f->filled, !f->in_order},
                {"sphere_moves", f->moves, !f->in_order}};
  /* Errors with respect to the surface that the mesh approximates. */
  const struct {
    const char *key;
    double value;
    bool shown;
  } numbers[] = {{"crease_error", f->crease_error, f->features > 0},
                 {"threshold", f->threshold, f->in_order},
                 {"epsilon", epsilon, true},
                 {"surface_to_envelope", f->surface_to_envelope + deviation, true},
                 {"envelope_to_surface", f->envelope_to_surface + deviation, true}};
  json_t *root = report->root;
  int bad = 0;
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (counts[i].shown) bad |= qmat_json_set_count(root, counts[i].key, counts[i].count);
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
    if (numbers[i].shown) bad |= json_object_set_new(root, numbers[i].key, json_real(numbers[i].value));
  if (f->wanted_spheres > 0 && unit->sphere_count > f->wanted_spheres) bad |= add_warning(root, f, unit, epsilon);
  return bad ? qmat_fail_memory(context, "the report") : qmat_topology_report(context, unit, surface, root);
}
