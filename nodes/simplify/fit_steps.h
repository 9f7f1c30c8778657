/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_FIT_STEPS_H
#define QMAT_NODES_SIMPLIFY_FIT_STEPS_H

/* Both fits (sphere_fit.c, neighbourhood_fit.c) lower the largest error by least squares whose weights are powers of
 * the errors before: norms of the order 2 + power. A full step overshoots, because the weights decrease with the
 * errors, so a step is divided by 1 + power / 2 (Fletcher, Grant and Hebden 1971, "The calculation of linear best Lp
 * approximations"). */
static const int qmat_fit_powers[] = {0, 4, 6, 8};
enum { QMAT_FIT_STEPS = sizeof qmat_fit_powers / sizeof *qmat_fit_powers };

/* The weight that keeps spheres near their places, as a share of the points' weight. */
static const double qmat_fit_damping = 1e-3;

/* The weight of an error in a step, by its share of the largest one before. */
static inline double qmat_fit_weight(double share, int step) {
  double weight = 1;
  for (int p = 0; p < qmat_fit_powers[step]; p += 2) weight *= share * share;
  return weight;
}

/* The share of a step that is taken. */
static inline double qmat_fit_step_share(int step) {
  return 1 / (1 + 0.5 * qmat_fit_powers[step]);
}

#endif
