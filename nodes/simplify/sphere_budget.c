/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/simplify/sphere_budget.h"

#include <math.h>

#include "nodes/descriptor/epsilon.h"
#include "nodes/simplify/starts.h"

/* The search ends when it knows the epsilon to this factor, or after so many runs. */
static const double precision = 1.04;
enum { MOST_RUNS = 14 };

/* Without an error that is too small, or one that is enough, the next one differs by this factor. */
static const double step = 2;

/* The largest error there is, in diagonals. */
static const double most_error = 1;

/* The number of spheres falls about as fast as epsilon rises. The next epsilon keeps away from both ends of the known
 * interval by this share of its logarithm, since the number is not that regular. */
static const double least_share = 0.2;

/* The number of spheres rises here and there where epsilon does. Below an epsilon that leaves few too many, so many
 * smaller ones are tried, this factor apart. */
static const double few_too_many = 1.1, probe_step = 1.06;
enum { MOST_PROBES = 4 };

/* One run, down to `vertices` spheres (0: as few as possible). */
static qmat_status run_at(const qmat_simplification *prepared, double epsilon, int64_t vertices,
                          qmat_simplified *result) {
  qmat_simplify_params params = prepared->params;
  params.epsilon = epsilon;
  params.vertices = vertices;
  return qmat_simplification_run_starts(prepared, &params, result);
}

/* The epsilon to try between one that is too small, which leaves `spheres`, and one that is enough. */
static double next_between(double low, double high, double spheres, double wanted) {
  const double share = log(spheres / wanted) / log(high / low);
  return low * pow(high / low, fmin(fmax(share, least_share), 1 - least_share));
}

/* Tries smaller epsilons than `low`, which leaves `at_low` spheres; what is enough becomes `*best` and `*high`. */
static qmat_status probe_below(const qmat_simplification *s, double low, size_t at_low, qmat_simplified *best,
                               double *high) {
  const size_t wanted = (size_t)s->params.vertices;
  double tried = low / probe_step;
  for (int i = 0; i < MOST_PROBES && (double)at_low <= few_too_many * (double)wanted && tried > s->params.finest; i++) {
    qmat_simplified result;
    const qmat_status status = run_at(s, tried, 0, &result);
    if (status != QMAT_OK) return status;
    at_low = result.medial->sphere_count;
    if (at_low <= wanted && result.within_epsilon) {
      qmat_simplified_uninit(best);
      *best = result;
      *high = tried;
    } else {
      qmat_simplified_uninit(&result);
    }
    tried /= probe_step;
  }
  return QMAT_OK;
}

qmat_status qmat_simplification_run_to_count(const qmat_simplification *s, qmat_simplified *best, double *epsilon) {
  const size_t wanted = (size_t)s->params.vertices;
  const double least = s->params.finest;
  double low = 0, high = INFINITY, tried = fmax(QMAT_DEFAULT_EPSILON, least);
  size_t at_low = 0;
  bool again = false;
  *best = (qmat_simplified){.fault = INFINITY};
  for (int i = 0; i < MOST_RUNS && high > least && low < most_error && !(high <= precision * low); i++) {
    qmat_simplified result;
    const qmat_status status = run_at(s, tried, 0, &result);
    const bool few = status == QMAT_OK && result.medial->sphere_count <= wanted;
    const bool enough = few && result.within_epsilon;
    if (few && !enough && !again) { /* few spheres just beyond epsilon: not yet too small */
      qmat_simplified_uninit(&result);
      tried *= precision;
      again = true;
      continue;
    }
    again = false;
    *(enough ? &high : &low) = tried;
    if (status == QMAT_OK && !enough) at_low = result.medial->sphere_count;
    if (status == QMAT_OK && (enough || high == INFINITY)) {
      qmat_simplified_uninit(best);
      *best = result;
      *epsilon = tried;
    } else {
      qmat_simplified_uninit(&result);
    }
    if (status != QMAT_OK) return status;
    tried = high == INFINITY ? fmin(step * low, most_error)
            : low == 0       ? fmax(high / step, least)
                             : next_between(low, high, (double)at_low, (double)wanted);
  }
  if (high == INFINITY) return QMAT_OK;
  const qmat_status probed = low > 0 ? probe_below(s, low, at_low, best, &high) : QMAT_OK;
  *epsilon = high;
  if (probed != QMAT_OK || best->medial->sphere_count == wanted) return probed;
  /* Fewer are left. As many as wanted are nearer still. */
  qmat_simplified result;
  const qmat_status status = run_at(s, high, s->params.vertices, &result);
  /* Spheres that fill cavities come on top of the number. */
  if (status == QMAT_OK && result.within_epsilon && result.medial->sphere_count <= wanted) {
    qmat_simplified_uninit(best);
    *best = result;
  } else {
    qmat_simplified_uninit(&result);
  }
  return status;
}
