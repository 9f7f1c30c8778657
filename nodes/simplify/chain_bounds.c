/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/chain_bounds.h"

#include <math.h>

#include "nodes/measure/boundary_distance.h"
#include "nodes/measure/medial_errors.h"
#include "nodes/measure/unit_spheres.h"
#include "nodes/simplify/collapse_chain.h"

/* The gap between a bound and an attained error, as a share of the level's threshold. */
static const double tolerance = 0.05;
enum { LEVELS_PER_DOUBLING = 4, BOUNDARY_SAMPLES = 2000 };

/* The next finer bounded level. */
static size_t next_level(size_t spheres) {
  if (spheres < QMAT_BOUNDED_EACH) return spheres + 1;
  const double doublings = log2((double)spheres / QMAT_BOUNDED_EACH), step = 1.0 / LEVELS_PER_DOUBLING;
  return (size_t)lround(QMAT_BOUNDED_EACH * exp2((round(doublings / step) + 1) * step));
}

static qmat_status bound_level(qmat_context *context, const qmat_surface *surface, const qmat_chain *chain,
                               size_t collapses, double threshold, double bounds[2]) {
  qmat_medial *medial = qmat_medial_new();
  qmat_medial_errors errors = {0};
  qmat_envelope *envelope = NULL;
  qmat_boundary_distance boundary = {0};
  qmat_status status = medial ? QMAT_OK : qmat_fail_memory(context, "a level of the chain");
  if (status == QMAT_OK) status = qmat_chain_extract(context, chain, collapses, medial);
  if (status == QMAT_OK) {
    qmat_medial unit = *medial;
    status = qmat_unit_spheres(context, qmat_surface_frame(surface), medial, &unit.spheres);
    if (status == QMAT_OK)
      status = qmat_medial_surface_bound_measure(context, surface, &unit, qmat_surface_positions(surface),
                                                 qmat_surface_mesh(surface)->vertex_count, tolerance * threshold,
                                                 tolerance * threshold, INFINITY, &errors);
    if (status == QMAT_OK) status = qmat_envelope_of_medial(context, &unit, &envelope);
    if (status == QMAT_OK)
      status = qmat_boundary_distance_measure(
          context, surface, envelope, &unit,
          &(qmat_boundary_request){.epsilon = threshold, .tolerance = tolerance, .sample_count = BOUNDARY_SAMPLES},
          &boundary);
  }
  bounds[0] = errors.surface_to_envelope;
  bounds[1] = boundary.either_side.hi;
  qmat_boundary_distance_uninit(&boundary);
  qmat_envelope_free(envelope);
  qmat_medial_errors_uninit(&errors);
  qmat_value_release(medial ? &medial->base : NULL);
  return status;
}

/* The recorded error of a level, `finest` at least. */
static double level_error(const qmat_chain *chain, size_t spheres, double finest) {
  const size_t collapses = chain->sphere_count - spheres;
  return fmax(collapses > 0 ? chain->errors[collapses - 1] : 0, finest);
}

/* The coarsest bounded level of a chain that ends with `least` spheres. */
static size_t first_level(size_t least) {
  size_t n = 1;
  while (n < least) n = next_level(n);
  return n;
}

qmat_status qmat_chain_set_bounds(qmat_context *context, const qmat_surface *surface, size_t most, double finest,
                                  double deviation, qmat_chain *chain) {
  const size_t first = first_level(chain->sphere_count - chain->collapse_count);
  const size_t last = most < chain->sphere_count ? most : chain->sphere_count;
  const double finest_recorded = finest + qmat_constraint_share * deviation;
  size_t count = 0;
  for (size_t n = first; n <= last; n = next_level(n)) {
    count++;
    if (level_error(chain, n, finest) <= finest_recorded) break;
  }
  chain->bounded = qmat_alloc(count, sizeof *chain->bounded);
  chain->bounds = qmat_alloc(2 * count, sizeof *chain->bounds);
  if (!chain->bounded || !chain->bounds) return qmat_fail_memory(context, "the bounds of the chain");
  chain->bounded_count = count;
  qmat_status status = QMAT_OK;
  for (size_t i = count, n = first; i > 0 && status == QMAT_OK; n = next_level(n)) {
    const size_t collapses = chain->sphere_count - n;
    const qmat_arena aside = qmat_arena_set_aside(&context->arena); /* each level frees its scratch memory */
    chain->bounded[--i] = (uint32_t)collapses;
    status = bound_level(context, surface, chain, collapses, level_error(chain, n, finest), &chain->bounds[2 * i]);
    qmat_arena_put_back(&context->arena, aside);
    for (size_t k = 0; k < 2; k++) chain->bounds[2 * i + k] += deviation;
  }
  return status;
}
