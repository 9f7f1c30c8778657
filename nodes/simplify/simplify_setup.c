/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/simplify_setup.h"

#include <math.h>

#include "core/geometry/surface.h"
#include "core/geometry/thickness.h"
#include "nodes/measure/unit_spheres.h"

const char *const qmat_error_choices[] = {"two_sided", "one_sided", NULL};
const char *const qmat_cost_choices[] = {"slab", "hausdorff", "pmat", NULL};
const char *const qmat_compat_choices[] = {"off", "qmat", NULL};
const char *const qmat_topology_choices[] = {"free", "guard", "preserve", NULL};
const char *const qmat_protect_choices[] = {"off", "late", "always", NULL};
const char *const qmat_feature_choices[] = {"none", "sharp", "auto", NULL};

/* The exact depth at the centre of a medial sphere. Most spheres are inscribed: a query within the radius finds it. */
static double depth_of(const qmat_surface *surface, const double *sphere) {
  if (qmat_surface_mesh(surface)->sheet_triangle_count > 0) return -qmat_surface_signed_distance(surface, sphere);
  double depth = qmat_surface_distance(surface, sphere, sphere[3] * (1 + 1e-6) + 1e-9, NULL, NULL);
  if (!(depth < INFINITY)) depth = qmat_surface_distance(surface, sphere, INFINITY, NULL, NULL);
  return qmat_surface_inside(surface, sphere) ? depth : -depth;
}

static qmat_status measure_depths(qmat_context *context, const qmat_surface *surface, const double *spheres,
                                  size_t count, double *depths) {
  const size_t slice = 1 << 11;
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < count; first += slice) {
    const qmat_status status = qmat_progress(context, 0, 0, "depths");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < count ? first + slice : count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256)
    for (size_t v = first; v < last; v++) depths[v] = depth_of(surface, &spheres[4 * v]);
  }
  return QMAT_OK;
}

void qmat_simplify_apply_compatibility(qmat_simplify_params *p) {
  if (p->compat != QMAT_COMPAT_QMAT) return;
  p->cost = QMAT_COST_SLAB;
  p->k = 1e-5;
  p->epsilon = 0;
  p->on_exceed = QMAT_EXCEED_STOP;
  p->topology = QMAT_TOPOLOGY_FREE;
  p->protect = QMAT_PROTECT_OFF;
  p->features = QMAT_FEATURES_NONE;
}

qmat_status qmat_simplify_leave_deviation(qmat_context *context, const qmat_mesh *mesh, qmat_simplify_params *params,
                                          double *deviation) {
  *deviation = 0;
  if (mesh->deviation == 0) return QMAT_OK;
  qmat_frame frame;
  const qmat_status status = qmat_frame_of_mesh(context, mesh, &frame);
  if (status != QMAT_OK) return status;
  *deviation = mesh->deviation / frame.diagonal;
  if (params->epsilon == 0 || params->compat == QMAT_COMPAT_QMAT) return QMAT_OK;
  params->epsilon -= *deviation;
  if (params->epsilon > 0) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_GEOMETRY,
            "epsilon is not larger than the mesh's own deviation of %.2g diagonals from its surface", *deviation);
  qmat_fail_field(context, "epsilon");
  return qmat_fail_hint(context, "raise the level of mesh.subdivide, or raise epsilon");
}

qmat_status qmat_simplify_prepare(qmat_context *context, const qmat_simplify_params *params,
                                  const qmat_value *const inputs[], qmat_surface **surface,
                                  qmat_initial_medial *initial) {
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  const qmat_field *thickness = (const qmat_field *)inputs[1];
  const qmat_samples *samples = (const qmat_samples *)inputs[2];
  const qmat_medial *medial = (const qmat_medial *)inputs[3];
  qmat_status status = qmat_thickness_check(context, mesh, thickness, samples);
  if (status == QMAT_OK) status = qmat_surface_new(context, mesh, surface);
  double *spheres;
  if (status == QMAT_OK) status = qmat_unit_spheres(context, qmat_surface_frame(*surface), medial, &spheres);
  if (status != QMAT_OK) return status;
  double *depths = qmat_arena_alloc(&context->arena, medial->sphere_count, sizeof *depths);
  if (!depths) return qmat_fail_memory(context, "the medial mesh");
  *initial = (qmat_initial_medial){medial->sphere_count, spheres, depths, NULL};
  if (params->protect != QMAT_PROTECT_OFF) {
    double *values = qmat_arena_alloc(&context->arena, samples->count, sizeof *values);
    initial->thin = qmat_arena_alloc(&context->arena, samples->count, sizeof *initial->thin);
    if (!values || !initial->thin) return qmat_fail_memory(context, "thin features");
    qmat_thickness_of_samples(mesh, thickness, samples, values);
    const double theta = qmat_thickness_threshold(mesh, thickness, params->theta);
    for (size_t i = 0; i < samples->count; i++) initial->thin[i] = values[i] <= theta;
  }
  return measure_depths(context, *surface, spheres, medial->sphere_count, depths);
}

/* Late protection starts at this number of spheres (section 3.4, "a later stage"). */
static size_t late_stage(size_t initial) {
  return initial / QMAT_LATE_DIVISOR > QMAT_LATE_SPHERES ? initial / QMAT_LATE_DIVISOR : QMAT_LATE_SPHERES;
}

qmat_decimation_rules qmat_simplify_rules(const qmat_simplify_params *p, const qmat_initial_medial *initial,
                                          uint64_t seed) {
  return (qmat_decimation_rules){
      .limit = p->epsilon > 0 ? qmat_constraint_share * p->epsilon : INFINITY,
      .share = 1,
      .thin_radius = INFINITY,
      .finest = p->finest,
      .vertices = (size_t)p->vertices,
      .most_cost = p->most_cost,
      .k = p->k,
      .cost = (qmat_cost_kind)p->cost,
      .published = p->compat == QMAT_COMPAT_QMAT,
      .error = (qmat_error_kind)p->error,
      .on_exceed = (qmat_exceed_rule)p->on_exceed,
      .topology = (qmat_topology_policy)p->topology,
      .protect = (qmat_protection)p->protect,
      .late_spheres = late_stage(initial->count),
      .features = p->features == QMAT_FEATURES_NONE ? QMAT_FEATURES_NONE : QMAT_FEATURES_SHARP,
      .crease_share = p->crease,
      .seed = seed,
      .refits = (int)p->refits,
      .thin = initial->thin};
}

bool qmat_simplify_in_order(const qmat_simplify_params *params) {
  return params->on_exceed != QMAT_EXCEED_SKIP || params->compat != QMAT_COMPAT_OFF;
}
