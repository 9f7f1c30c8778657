/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SIMPLIFY_THRESHOLDS_H
#define QMAT_NODES_SIMPLIFY_THRESHOLDS_H

/* The thresholds of the passes of medial.simplify in one table, whether one file uses them or several. "Derived" ones
 * follow from another number; the others were measured on the models of the ablation table (README.md). Steps within a
 * solver, a search or a repair are constants of its file. Chains and nodes share qmat_constraint_share
 * (collapse_chain.h): the share of epsilon that constraint points may use. */

/* ---- shares of epsilon ---- */

/* The reported surface-to-envelope error exceeds the true one by at most the first share, but is never below the
 * second: the maximum over a plateau of small errors takes too many queries. */
static const double qmat_error_tolerance = 0.01, qmat_least_reported = 0.5;

/* The dense collapse uses this share of the error; the rest is for the constraint points that are found later. */
static const double qmat_dense_share = 0.9;

/* In the dense collapse edges between spheres with radii up to this share of its error may leave the model, as far as
 * the error allows: in a curved shell as thin as that only short ones lie inside. Edges of larger spheres may not,
 * which leads to better collapses. After the dense collapse all may. */
static const double qmat_thin_share = 0.5;

/* After QMAT_DENSE_AGAIN_ROUND each round uses this share of the error that the one before used: more points alone move
 * the places beyond epsilon elsewhere. */
static const double qmat_late_round_share = 0.9;

/* A joint refit whose boundary hovers just beyond epsilon finds no points: the next one, which would end the same, uses
 * this share of the error. */
static const double qmat_hovering_share = 0.99;

/* Found points inside the solid need half of their present depth in the envelope, at most this share. Those that a
 * repair has to reach need all of it. */
static const double qmat_required_depth_share = 0.05;

/* ---- repetitions: but for damaged models no limit was reached on a model that ended within epsilon ---- */

enum {
  QMAT_MOST_ROUNDS = 8,        /* of collapses, each with the points found in the one before */
  QMAT_DENSE_AGAIN_ROUND = 3,  /* the first round before which the dense collapse starts over */
  QMAT_MOST_REPAIRS = 4,       /* of a round, each with the points found after the one before */
  QMAT_MOST_REFIT_TRIES = 6,   /* of one joint refit, each with the points found in the one before */
  QMAT_MOST_REFITS = 4,        /* joint refits after each other, while each removes spheres */
  QMAT_MOST_FILLINGS = 6,      /* of cavities: filling one can expose another */
  QMAT_MOST_WALLS = 12,        /* slabs and edges tried with each share, for a void or loop */
  QMAT_MOST_FITS = 6,          /* of a neighbourhood, each with the newest failure as a target */
  QMAT_MOST_MOVE_FITS = 16,    /* the same where spheres only move, to repair a place beyond epsilon */
  QMAT_MOST_FAILED_REPAIRS = 3 /* of places within epsilon of each other */
};

/* ---- points of a fit: the tests use all of them, so that a fit may use fewer ---- */

enum {
  QMAT_FITTED_POINTS = 256,        /* of one sphere */
  QMAT_FINAL_REFIT_POINTS = 1024,  /* of one sphere, where the error itself counts */
  QMAT_FITTED_TARGETS = 512,       /* of a neighbourhood */
  QMAT_NEIGHBOURHOOD_SPHERES = 12, /* 48 unknowns: a solve costs about as much as a pass over the targets */
  /* Fitted jointly by a collapse. Of 1,729 joint fits of at most five spheres 54 removed one. Of 2,257 larger fits only
   * 6 did, and those took twice as long. */
  QMAT_COLLAPSE_SPHERES = 5
};

/* ---- multiples of the threshold at which a fit goes on ---- */

/* A fitted sphere is tested up to the first multiple: the fit knows only part of the points. An edge whose fit is worse
 * than the second is tried again only when a sphere nearby disappears, not when one moves. */
static const double qmat_test_ratio = 1.1, qmat_retry_ratio = 2;

/* A neighbourhood is fitted up to the first multiple, of the fit of the single sphere, and tested up to the second. */
static const double qmat_neighbourhood_ratio = 1.3, qmat_placement_ratio = 1.02;

/* A fit of one sphere gives up where its least error exceeds this multiple, before the first step and after each but
 * the last: none of 837 collapses that fits allowed had a larger one. */
static const double qmat_give_up_ratios[] = {2.5, 2, 1.5, 1.2};

/* The margin, in thresholds, of a refused point that becomes a target. Derived: qmat_placement_ratio less 1. */
static const double qmat_target_margin = 0.02;

/* Starts after the first multiply each cost by a factor between 1 and this one. */
static const double qmat_most_cost_factor = 1.65;

/* Where the initial medial mesh without creases is not within epsilon, it is tried only if keeping the creases takes
 * more than this multiple of the least number of spheres. */
static const double qmat_few_kept = 1.75;

/* Keeping the creases is tried only if the result without them has more than this multiple of the least number. Only
 * cubes and boxes near one came below it. */
static const double qmat_least_kept = 1.125;

/* A move of a sphere has to lower its error by at least this share of the error. */
static const double qmat_least_gain = 0.02;

/* ---- sizes ---- */

/* The largest number of vertices of a piece of the dense medial mesh, and the share that remains. A
 * piece whose vertices coincide may be larger. */
enum { QMAT_MOST_PIECE_VERTICES = 1 << 14 };
static const double qmat_piece_share = 0.06;

/* The later stage of protection: one sphere in so many initial ones is left, or this number. */
enum { QMAT_LATE_DIVISOR = 50, QMAT_LATE_SPHERES = 100 };

/* Thresholds that rise double every so many levels: steps of 6 %. */
enum { QMAT_LEVELS_TO_A_DOUBLING = 12 };

/* Collapses in order do not depend on epsilon: their constraint points are made for this multiple of the finest
 * threshold. */
static const double qmat_constraint_error = 2;

#endif
