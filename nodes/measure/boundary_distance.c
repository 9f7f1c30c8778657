/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/boundary_distance.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/measure/area_samples.h"
#include "nodes/measure/boundary_pieces.h"

/* Points no deeper in the envelope than this are on its boundary, and upper bounds are raised by it: more than
 * rounding. */
static const double rounding = 1e-9;

/* As a share of the tolerance: pieces of that reach are not split, and where lo is just below epsilon it is the
 * tolerance. */
static const double smallest_share = 1.0 / 16;

/* Below this many times the tolerance at epsilon, the error is not resolved: queries explode where the boundary nearly
 * coincides with the surface. */
static const double floor_tolerances = 5;

static const double least_tolerance = 1e-5;

/* As a share of epsilon: once a place beyond epsilon is known, pieces of that reach are not split in a search for
 * places. */
static const double place_share = 0.1;

/* Points deeper in the envelope than this are off its boundary where a certificate depends on it: far more than
 * rounding. */
static const double certain_skin = 1e-6;

/* Cells of space are searched instead of features where there are more features than this: most of these are buried. */
enum { MANY_FEATURES = 1 << 16 };

/* After so many queries pieces are not split any more. F is slow where hundreds of primitives contain a point. */
enum { MOST_QUERIES = 1 << 21, MOST_QUERIES_OF_MANY = 1 << 17 };

static double tolerated(double lo, double epsilon, double tolerance) {
  return qmat_larger(tolerance * qmat_larger(epsilon, lo), least_tolerance);
}

double qmat_bound_target(double lo, double epsilon, double tolerance) {
  const double allowed = tolerated(lo, epsilon, tolerance), target = lo + allowed;
  return lo < epsilon && target > epsilon ? qmat_larger(epsilon, lo + smallest_share * allowed) : target;
}

/* ---- samples ---- */

typedef struct boundary_samples {
  const qmat_boundary_features *features;
  const qmat_surface *surface;
  const qmat_envelope *envelope;
} boundary_samples;

/* Sum 0 is the distance to the surface; maximum 1 is that outside of the solid. */
static void add_sample(const void *data, size_t feature, double x, double y, qmat_area_sums *sums) {
  const boundary_samples *s = data;
  double point[3] = {0, 0, 0};
  qmat_boundary_feature_point(s->features, feature, x, y, point);
  if (qmat_envelope_holds(s->envelope, point, rounding)) return;
  const double d = qmat_surface_distance(s->surface, point, INFINITY, NULL, NULL);
  sums->sum[0] += d;
  sums->count++;
  sums->largest[0] = qmat_larger(sums->largest[0], d);
  if (d > sums->largest[1] && !qmat_surface_inside(s->surface, point)) sums->largest[1] = d;
}

static qmat_status sample_boundary(qmat_context *context, const qmat_boundary_features *f, const qmat_surface *surface,
                                   const qmat_envelope *envelope, size_t sample_count, qmat_boundary_distance *result) {
  const size_t count = qmat_boundary_features_count(f);
  double *areas = qmat_arena_alloc(&context->arena, count, sizeof *areas), area = 0;
  if (!areas) return qmat_fail_memory(context, "the envelope's boundary");
  for (size_t i = 0; i < count; i++) areas[i] = area += qmat_boundary_feature_area(f, i);
  const boundary_samples data = {f, surface, envelope};
  const qmat_area_samples samples = {.areas = areas,
                                     .element_count = count,
                                     .sample_count = sample_count,
                                     .stream = 1,
                                     .progress = "samples of the envelope",
                                     .add = add_sample,
                                     .data = &data};
  qmat_area_sums sums;
  const qmat_status status = qmat_area_samples_sum(context, &samples, &sums);
  result->sample_count = sums.count;
  if (sums.count > 0) result->mean = sums.sum[0] / (double)sums.count;
  result->either_side.lo = result->largest = sums.largest[0];
  result->outside.lo = sums.largest[1];
  return status;
}

/* ---- branch and bound ---- */

/* The bounds, as numbers and as bits of what is wanted. */
enum { EITHER_SIDE, OUTSIDE, BOUND_COUNT };
enum { WANT_EITHER_SIDE = 1 << EITHER_SIDE, WANT_OUTSIDE = 1 << OUTSIDE };

typedef struct piece_list {
  qmat_boundary_piece *items;
  size_t count, capacity;
} piece_list;

typedef struct search {
  const qmat_boundary_features *features;
  const qmat_surface *surface;
  const qmat_envelope *envelope;
  double epsilon;
  double lo[BOUND_COUNT], target[BOUND_COUNT], smallest, skin;
  uint8_t wanted;
  bool last;        /* pieces are not split any more */
  bool only_places; /* the search is for places beyond epsilon, not for a bound */
  bool has_place;   /* it has found one */
} search;

/* The evaluation of a piece. */
typedef struct finding {
  double place[3];           /* where found[0] is attained, or a place of one of the two flags */
  double found[BOUND_COUNT]; /* distances attained on the boundary */
  double bound[BOUND_COUNT]; /* upper bounds over the piece, where it is finished */
  int children;
  uint32_t near;      /* the triangle nearest to the piece's middle, where that is known */
  uint8_t wanted;     /* what the children count for */
  bool undecided;     /* `place` is tolerated, but the distance near it may exceed epsilon */
  bool maybe_exposed; /* `place` is farther than epsilon, and may or may not be on the boundary */
} finding;

/* Points whose hull comes within `bulge` of a piece; none of a cell. */
typedef struct hull {
  double points[4][3], bulge;
  int count;
} hull;

static hull hull_of(const search *s, const qmat_boundary_piece *p) {
  hull h;
  h.count = qmat_boundary_piece_hull(s->features, p, h.points, &h.bulge);
  return h;
}

/* Whether no point of the piece lies on the boundary. The middle of a piece of a feature is never outside of the
 * envelope. */
static bool is_off_boundary(const search *s, const hull *h, const double middle[3], double reach) {
  if (h->count == 0)
    return qmat_envelope_holds(s->envelope, middle, reach + s->skin) ||
           qmat_envelope_distance_within(s->envelope, middle, reach) > reach;
  double bound;
  const double f =
      qmat_envelope_bound(s->envelope, middle, (const double(*)[3])h->points, h->count, -(reach + s->skin), &bound);
  return qmat_smaller(f + reach, bound + h->bulge) < -s->skin;
}

/* Moves a cell's middle to the surface of its nearest medial sphere. */
static void move_to_sphere(const search *s, double middle[3]) {
  double sphere[4];
  qmat_envelope_nearest(s->envelope, middle, NULL, sphere);
  const double length = qmat_point_distance(middle, sphere);
  for (int k = 0; k < 3 && length > 0; k++) middle[k] = sphere[k] + sphere[3] / length * (middle[k] - sphere[k]);
}

/* Takes the distance at the middle as a lower bound if the middle is on the boundary. */
static void raise_lower_bound(const search *s, bool is_cell, double middle[3], uint8_t wanted, finding *result) {
  if (is_cell) move_to_sphere(s, middle);
  if (qmat_envelope_holds(s->envelope, middle, rounding)) return;
  result->found[EITHER_SIDE] = qmat_surface_distance(s->surface, middle, INFINITY, NULL, NULL);
  memcpy(result->place, middle, sizeof result->place);
  if ((wanted & WANT_OUTSIDE) && !qmat_surface_inside(s->surface, middle))
    result->found[OUTSIDE] = result->found[EITHER_SIDE];
}

/* An upper bound over a piece: the distance to one triangle is convex, so over a hull its maximum is at a corner. Above
 * `enough` any value above. */
static double hull_bound(const search *s, const hull *h, uint32_t triangle, double enough) {
  double bound = h->count > 0 ? 0 : INFINITY;
  for (int i = 0; i < h->count && bound + h->bulge <= enough; i++)
    bound = qmat_larger(bound, qmat_surface_distance_to_triangle(s->surface, h->points[i], triangle));
  return bound + h->bulge;
}

/* Finishes what the piece is wanted for and `bound` proves. */
static void finish_with(const search *s, double bound, uint8_t *wanted, finding *result) {
  result->undecided |=
      bound > s->epsilon && bound <= s->target[0] && s->lo[0] <= s->epsilon && (*wanted & WANT_EITHER_SIDE);
  for (int i = 0; i < BOUND_COUNT; i++)
    if ((*wanted >> i & 1) && bound <= s->target[i]) {
      result->bound[i] = bound;
      *wanted &= (uint8_t) ~(1 << i);
    }
}

/* Compares the piece, in a ball around `middle`, with the targets. What is still wanted afterwards is `*wanted`; a
 * piece off the boundary counts for nothing. */
static finding evaluate_ball(const search *s, const qmat_boundary_piece *p, double middle[3], double reach,
                             uint8_t *wanted) {
  finding result = {.near = QMAT_NONE};
  const bool is_cell = p->feature == QMAT_CELL;
  const hull h = hull_of(s, p);
  /* With one bound to prove, a distance beyond the target need not be exact. */
  const bool is_short = !s->last && *wanted == WANT_EITHER_SIDE;
  double known = INFINITY; /* by the triangle that is nearest to what the piece is a part of */
  if (p->near != QMAT_NONE) {
    const double enough = qmat_smaller(s->epsilon, s->target[EITHER_SIDE]);
    const double bound = is_short ? hull_bound(s, &h, p->near, enough) : INFINITY;
    if (bound <= enough) {
      result.bound[EITHER_SIDE] = bound;
      *wanted = 0;
      return result;
    }
    known = qmat_surface_distance_to_triangle(s->surface, middle, p->near) + rounding;
  }
  const double limit = is_short ? qmat_smaller(s->target[EITHER_SIDE] - reach, known) : known;
  double d = limit > 0 ? qmat_surface_distance(s->surface, middle, limit, NULL, &result.near) : INFINITY;
  finish_with(s, d + reach, wanted, &result);
  if (!*wanted && !result.undecided) return result;
  if (is_off_boundary(s, &h, middle, reach)) {
    *wanted = 0;
    return (finding){.children = 0};
  }
  if (!(d < INFINITY)) d = qmat_surface_distance(s->surface, middle, known, NULL, &result.near);
  const double largest = qmat_larger(s->target[EITHER_SIDE], s->target[OUTSIDE]);
  if (*wanted) finish_with(s, hull_bound(s, &h, result.near, largest), wanted, &result);
  if (result.undecided) memcpy(result.place, middle, sizeof result.place);
  if (!*wanted) return result;
  const bool inside = (*wanted & WANT_OUTSIDE) && qmat_surface_inside(s->surface, middle);
  if (inside && d > reach) *wanted &= WANT_EITHER_SIDE;
  if (d > qmat_smaller(s->lo[0], s->epsilon) || ((*wanted & WANT_OUTSIDE) && !inside && d > s->lo[1]))
    raise_lower_bound(s, is_cell, middle, *wanted, &result);
  if (s->only_places && result.found[EITHER_SIDE] > s->epsilon) {
    *wanted = 0;
    return result;
  }
  if (!s->last && reach > s->smallest) return result;
  for (int i = 0; i < BOUND_COUNT; i++)
    if (*wanted >> i & 1) result.bound[i] = d + reach;
  *wanted = 0;
  result.maybe_exposed = !(result.found[0] > s->epsilon) && d > s->epsilon && !s->has_place;
  if (result.maybe_exposed) memcpy(result.place, middle, sizeof result.place);
  return result;
}

static finding evaluate(const search *s, const qmat_boundary_piece *p) {
  finding result = {.near = QMAT_NONE};
  double middle[3], reach;
  uint8_t wanted = p->wanted;
  if (!qmat_boundary_piece_ball(s->features, p, middle, &reach)) return result;
  if (s->last || reach < s->target[0] || p->feature != QMAT_CELL)
    result = evaluate_ball(s, p, middle, reach, &wanted);
  else if (is_off_boundary(s, &(hull){.count = 0}, middle, reach))
    return result;
  result.wanted = wanted;
  if (wanted) result.children = qmat_boundary_piece_child_count(s->features, p);
  return result;
}

static int add_point(double **points, size_t *count, size_t *capacity, const double point[3]) {
  if (qmat_grow((void **)points, capacity, *count + 1, 3 * sizeof **points)) return -1;
  memcpy(&(*points)[3 * (*count)++], point, 3 * sizeof **points);
  return 0;
}

/* Keeps the place of a finding whose distance is, or may be, above epsilon. */
static int add_place(qmat_boundary_distance *result, const finding *found, double epsilon) {
  if (found->found[EITHER_SIDE] > epsilon || found->maybe_exposed)
    return add_point(&result->far_points, &result->far_count, &result->far_capacity, found->place);
  if (!found->undecided) return 0;
  return add_point(&result->undecided_points, &result->undecided_count, &result->undecided_capacity, found->place);
}

void qmat_boundary_distance_uninit(qmat_boundary_distance *result) {
  qmat_free(result->far_points);
  qmat_free(result->undecided_points);
  result->far_points = result->undecided_points = NULL;
  result->far_count = result->far_capacity = result->undecided_count = result->undecided_capacity = 0;
}

/* One level: evaluates every piece of `from` and puts the children into `to`. */
static qmat_status search_level(qmat_context *context, const search *s, const piece_list *from, piece_list *to,
                                finding *findings, qmat_boundary_distance *result) {
  const int threads = qmat_threads(context);
  const size_t slice = 1 << 13;
  for (size_t first = 0; first < from->count; first += slice) {
    const qmat_status status = qmat_progress(context, first, from->count, "pieces of the envelope");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < from->count ? first + slice : from->count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t i = first; i < last; i++) findings[i] = evaluate(s, &from->items[i]);
  }
  result->query_count += from->count;
  qmat_bounds *const bounds[BOUND_COUNT] = {&result->either_side, &result->outside};
  to->count = 0;
  for (size_t i = 0; i < from->count; i++) {
    for (int k = 0; k < BOUND_COUNT; k++) {
      bounds[k]->lo = qmat_larger(bounds[k]->lo, findings[i].found[k]);
      bounds[k]->hi = qmat_larger(bounds[k]->hi, findings[i].bound[k]);
    }
    to->count += (size_t)findings[i].children;
    if (add_place(result, &findings[i], s->epsilon)) return qmat_fail_memory(context, "the envelope's boundary");
  }
  if (qmat_grow((void **)&to->items, &to->capacity, to->count, sizeof *to->items))
    return qmat_fail_memory(context, "pieces of the envelope's boundary");
  size_t filled = 0;
  for (size_t i = 0; i < from->count; i++) {
    if (findings[i].children == 0) continue;
    qmat_boundary_piece piece = from->items[i];
    piece.near = findings[i].near;
    piece.wanted = findings[i].wanted;
    qmat_boundary_piece_split(s->features, &piece, &to->items[filled]);
    filled += (size_t)findings[i].children;
  }
  return QMAT_OK;
}

/* Takes the bounds found so far for the next level. */
static void set_targets(search *s, double tolerance, const qmat_boundary_distance *result) {
  s->lo[EITHER_SIDE] = result->either_side.lo;
  s->lo[OUTSIDE] = result->outside.lo;
  const double floor = qmat_smaller(1, floor_tolerances * tolerance) * s->epsilon;
  for (int k = 0; k < BOUND_COUNT; k++)
    s->target[k] = qmat_larger(qmat_bound_target(s->lo[k], s->epsilon, tolerance), floor) - rounding;
  s->smallest = smallest_share * qmat_smaller(tolerated(s->lo[0], s->epsilon, tolerance), s->target[0] - s->lo[0]);
  s->has_place = s->only_places && result->either_side.lo > s->epsilon;
  if (!s->has_place) return;
  s->target[EITHER_SIDE] = s->epsilon;
  s->smallest = place_share * s->epsilon;
}

static qmat_status search_pieces(qmat_context *context, search *s, double tolerance, qmat_boundary_distance *result) {
  const size_t count = qmat_boundary_features_count(s->features);
  const bool in_space = count > MANY_FEATURES;
  const size_t most_queries = in_space ? MOST_QUERIES_OF_MANY : MOST_QUERIES;
  piece_list lists[2] = {{0}, {0}};
  finding *findings = NULL;
  size_t capacity = 0;
  qmat_status status = QMAT_OK;
  if (qmat_grow((void **)&lists[0].items, &lists[0].capacity, in_space ? 1 : QMAT_MOST_PIECES * count,
                sizeof *lists[0].items))
    status = qmat_fail_memory(context, "pieces of the envelope's boundary");
  for (size_t i = 0; !in_space && i < count && status == QMAT_OK; i++)
    lists[0].count += qmat_boundary_pieces_of_feature(s->features, i, s->wanted, &lists[0].items[lists[0].count]);
  if (in_space && status == QMAT_OK)
    lists[0].items[lists[0].count++] = qmat_boundary_piece_of_space(s->features, s->wanted);
  for (int level = 0; status == QMAT_OK && lists[level & 1].count > 0; level++) {
    const piece_list *from = &lists[level & 1];
    set_targets(s, tolerance, result);
    s->last = result->query_count + 4 * from->count > most_queries;
    if (qmat_grow((void **)&findings, &capacity, from->count, sizeof *findings))
      status = qmat_fail_memory(context, "pieces of the envelope's boundary");
    if (status == QMAT_OK) status = search_level(context, s, from, &lists[1 - (level & 1)], findings, result);
  }
  qmat_free(lists[0].items);
  qmat_free(lists[1].items);
  qmat_free(findings);
  if (s->only_places && result->either_side.lo > s->epsilon) result->either_side.hi = INFINITY;
  return status;
}

static qmat_bounds raised(qmat_bounds b) {
  return (qmat_bounds){b.lo, qmat_larger(b.lo, b.hi) + rounding};
}

qmat_status qmat_boundary_distance_measure(qmat_context *context, const qmat_surface *surface,
                                           const qmat_envelope *envelope, const qmat_medial *unit,
                                           const qmat_boundary_request *request, qmat_boundary_distance *result) {
  *result = (qmat_boundary_distance){.sample_count = 0};
  qmat_boundary_features f;
  qmat_status status = qmat_boundary_features_init(context, unit, &f);
  if (status == QMAT_OK && qmat_boundary_features_count(&f) > UINT32_MAX)
    status = qmat_fail_memory(context, "the envelope's boundary");
  if (status == QMAT_OK) status = sample_boundary(context, &f, surface, envelope, request->sample_count, result);
  search s = {.features = &f,
              .surface = surface,
              .envelope = envelope,
              .epsilon = request->epsilon,
              .only_places = request->only_places,
              .skin = request->outside ? certain_skin : QMAT_BOUNDARY_SKIN,
              .wanted = request->outside ? WANT_EITHER_SIDE | WANT_OUTSIDE : WANT_EITHER_SIDE};
  if (status == QMAT_OK) status = search_pieces(context, &s, request->tolerance, result);
  result->either_side = raised(result->either_side);
  result->outside = raised(result->outside);
  return status;
}
