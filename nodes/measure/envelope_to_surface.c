/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/envelope_to_surface.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

/* One piece of a primitive: its corners, each with a lower bound of its depth. */
typedef struct piece {
  double spheres[3][4], depths[3];
  int count;
} piece;

/* The least bound of h over a piece that follows from the depth at one corner by the Lipschitz constant. It is convex,
 * so its maximum is at a corner. For an edge the crossing of the bounds from both ends is tighter. */
static double bound_from_corners(const piece *p) {
  if (p->count == 2) {
    const double length = qmat_point_distance(p->spheres[0], p->spheres[1]),
                 change = p->spheres[1][3] - p->spheres[0][3];
    const double a = p->spheres[0][3] - p->depths[0], b = p->spheres[1][3] - p->depths[1];
    /* The maximum of the minimum of a + t (length + change) and b + (1 - t) (length - change) is at an end or where
     * they cross. */
    const double ends = qmat_larger(qmat_smaller(a, b + length - change), qmat_smaller(b, a + length + change));
    const double t = length > 0 ? (b - a + length - change) / (2 * length) : 0;
    return t > 0 && t < 1 ? qmat_larger(ends, a + t * (length + change)) : ends;
  }
  double sides[3], bound = INFINITY; /* each opposite a corner */
  for (int k = 0; k < 3; k++) sides[k] = qmat_point_distance(p->spheres[(k + 1) % 3], p->spheres[(k + 2) % 3]);
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double own = p->spheres[i][3] - p->depths[i];
    const double one = p->spheres[j][3] - p->depths[i] + sides[k];
    const double other = p->spheres[k][3] - p->depths[i] + sides[j];
    bound = qmat_smaller(bound, qmat_larger(own, qmat_larger(one, other)));
  }
  return bound;
}

/* The least of a l + b m - l m w over l + m = 1, l and m >= 0. */
static double least_on_side(double a, double b, double w) {
  const double l = w > 0 ? (w + b - a) / (2 * w) : 0;
  return l > 0 && l < 1 ? b - w * l * l : qmat_smaller(a, b);
}

/* The normal equations of a triangle are solved where their determinant is above this share of its largest value. */
static const double least_determinant = 1e-6;

/* Whether h <= level over the piece, by its `depths`. The square of the distance d to any set is |x|^2 less a convex
 * function. At the point with the weights l_i of the corners x_i, then, d^2 >= sum l_i d_i^2 - sum l_i l_j |x_i -
 * x_j|^2: a bound of second order. With the radius r_i = level + t_i it is at least the square of sum l_i t_i where
 * sum l_i (d_i^2 - t_i^2) - sum l_i l_j (|x_i - x_j|^2 - (t_i - t_j)^2) >= 0, a convex function of the weights. A
 * positive distance keeps the piece on the side of its corners. */
static bool is_below_by_squares(const piece *p, double level) {
  double t[3], g[3], w[3]; /* w: each between corners k and k + 1 */
  for (int k = 0; k < p->count; k++) {
    t[k] = qmat_larger(p->spheres[k][3] - level, 0);
    g[k] = p->depths[k] * p->depths[k] - t[k] * t[k];
    if (!(p->depths[k] > 0 && g[k] > 0)) return false;
  }
  double widest = 0;
  for (int k = 0; k < p->count; k++) {
    const int j = (k + 1) % p->count;
    double square = -(t[k] - t[j]) * (t[k] - t[j]);
    for (int i = 0; i < 3; i++) square += (p->spheres[k][i] - p->spheres[j][i]) * (p->spheres[k][i] - p->spheres[j][i]);
    w[k] = qmat_larger(square, 0);
    widest = qmat_larger(widest, w[k]);
    if (!(least_on_side(g[k], g[j], w[k]) > 0)) return false;
  }
  if (p->count < 3) return true;
  const double s = w[0] + w[2] - w[1], a = w[0] + g[0] - g[1], b = w[2] + g[0] - g[2];
  const double determinant = 4 * w[0] * w[2] - s * s;
  if (!(determinant > least_determinant * widest * widest)) /* a thin triangle */
    return qmat_smaller(g[0], qmat_smaller(g[1], g[2])) > widest / 3;
  const double u = (2 * w[2] * a - s * b) / determinant, v = (2 * w[0] * b - s * a) / determinant;
  return !(u > 0 && v > 0 && u + v < 1) || g[0] - 0.5 * (u * a + v * b) > 0;
}

/* The least of some levels up to `most` that the bound of second order proves; INFINITY if it proves none. */
static double bound_by_squares(const piece *p, double most) {
  static const double shares[] = {0.25, 0.5, 0.65, 0.8, 0.9};
  if (!is_below_by_squares(p, most)) return INFINITY;
  for (size_t i = 0; i < sizeof shares / sizeof *shares; i++)
    if (is_below_by_squares(p, shares[i] * most)) return shares[i] * most;
  return most;
}

/* Branch and bound over one primitive, depth first, to at most this level. */
enum { DEEPEST = 40 };

typedef struct search {
  const qmat_surface *surface;
  qmat_depth_lattice *lattice; /* NULL: every depth is a query to the surface */
  bool by_squares;             /* whether bounds of second order hold */
  double accepted;             /* a piece with a bound up to this is finished */
  double limit;                /* an h above this ends the search */
  double smallest;  /* pieces up to this size are not split for a better bound; with a lattice, larger pieces are not
                       worth a query */
  double found;     /* the largest h found */
  double bound;     /* the largest bound of a finished piece */
  double place[4];  /* the centre of the piece evaluated last */
  uint32_t failed;  /* of the newest closed formula */
  double tolerance; /* a piece whose bound exceeds `found` by less is finished too */
  size_t queries;   /* of the surface, so far */
  size_t patience;  /* so many queries double the tolerance; 0: none do */
} search;

static bool is_done(search *s, double bound, double size, bool last) {
  if (!(bound <= s->accepted || bound <= s->found + s->tolerance ||
        (bound <= s->limit && (last || size <= s->smallest))))
    return false;
  s->bound = qmat_larger(s->bound, bound);
  return true;
}

/* Pieces larger than `squares_size` limits are worth a bound of second order, where the depth is a distance.
 * Pieces larger than `flat_size` limits are worth a closed formula.
 * The bound of the formula need not be lower than `flat_share` of the limit.
 * Without a limit, pieces larger than `flat_tolerances` tolerances are worth the formula: a piece that touches flat
 * surface would end as thousands. */
static const double squares_size = 0.3, flat_size = 1, flat_share = 0.25, flat_tolerances = 4;

/* Whether a closed formula accepts a piece with a point inside the solid. It need not be lower than `lowest`. */
static bool is_flat(search *s, const piece *p, double lowest, double accepted) {
  const double *const spheres[3] = {p->spheres[0], p->spheres[1], p->spheres[2]};
  const double bound = qmat_surface_excess_bound(s->surface, spheres, p->count, lowest, accepted, &s->failed);
  if (!(bound <= accepted)) return false;
  s->bound = qmat_larger(s->bound, bound);
  return true;
}

/* A lower bound of the depth at a point: of second order where the lattice proves the point inside. */
static double least_depth(qmat_depth_lattice *lattice, const double *point) {
  double gap;
  const double near = qmat_depth_lattice_near(lattice, point, &gap);
  return near > gap ? qmat_larger(near - gap, qmat_depth_lattice_least(lattice, point)) : near - gap;
}

/* Halves a piece across its longest side. The depth at the new corner is bounded where it will be used. */
static void split(search *s, const piece *p, bool is_large, piece *low, piece *high) {
  int a = 0, b = 1;
  if (p->count == 3) {
    double longest = -1;
    for (int i = 0; i < 3; i++) {
      double square = 0;
      for (int k = 0; k < 3; k++) {
        const double d = p->spheres[i][k] - p->spheres[(i + 1) % 3][k];
        square += d * d;
      }
      if (square > longest) {
        longest = square;
        a = i;
        b = (i + 1) % 3;
      }
    }
  }
  double middle[4];
  for (int k = 0; k < 4; k++) middle[k] = 0.5 * (p->spheres[a][k] + p->spheres[b][k]);
  *low = *high = *p;
  memcpy(low->spheres[b], middle, sizeof low->spheres[b]);
  memcpy(high->spheres[a], middle, sizeof high->spheres[a]);
  low->depths[b] = high->depths[a] = is_large && s->by_squares ? least_depth(s->lattice, middle) : -INFINITY;
}

/* Bounds of second order are used up to this share of the limit: what is nearer is searched finely. A piece with a
 * corner above the second share, in spite of its depth, gains nothing from a lower aim. */
static const double squares_share = 0.97, high_share = 0.6;

/* Whether the bound of second order accepts a piece. */
static bool is_below(search *s, const piece *p) {
  double highest = -INFINITY;
  for (int k = 0; k < p->count; k++) highest = qmat_larger(highest, p->spheres[k][3] - p->depths[k]);
  const double bound = bound_by_squares(p, highest > high_share * s->limit ? squares_share * s->limit : s->accepted);
  if (!(bound < INFINITY)) return false;
  s->bound = qmat_larger(s->bound, bound);
  return true;
}

/* Whether the centre of a wide piece is inside and the closed formula may save more than it takes. Where bounds of
 * second order hold it does so for whole primitives only. The lattice does not see the inside of thin walls. */
static bool is_worth_formula(const search *s, const double *centre, double near, double gap, int level) {
  if (near > gap) return level == 0 || !s->by_squares;
  return near + gap > 0 && qmat_depth_lattice_exact_near(s->lattice, centre, near, gap) > 0;
}

static bool search_piece(search *s, const piece *p, int level) {
  double centre[4] = {0, 0, 0, 0}, size = 0, farthest = -INFINITY;
  const double share = 1.0 / p->count;
  for (int i = 0; i < p->count; i++)
    for (int k = 0; k < 4; k++) centre[k] += share * p->spheres[i][k];
  for (int i = 0; i < p->count; i++) {
    const double d = qmat_point_distance(p->spheres[i], centre);
    size = qmat_larger(size, d);
    farthest = qmat_larger(farthest, p->spheres[i][3] + d);
  }
  /* h over the piece is at most `farthest` less the depth at the centre: convex, so largest at a corner. */
  const bool last = p->count == 1 || level == DEEPEST;
  bool ask = true, is_large = false;
  double near = 0, gap = 0;
  if (s->lattice) {
    near = qmat_depth_lattice_near(s->lattice, centre, &gap);
    if (centre[3] - near - gap > s->limit) {
      s->found = centre[3] - near - gap;
      memcpy(s->place, centre, sizeof centre);
      return false;
    }
    if (is_done(s, farthest - near + gap, size, last)) return true;
    is_large = size > squares_size * s->limit && near > gap;
    if (is_large && s->by_squares && is_below(s, p)) return true;
    if (size > flat_size * s->limit && is_worth_formula(s, centre, near, gap, level) &&
        is_flat(s, p, flat_share * s->limit, s->accepted))
      return true;
    ask = size <= s->smallest || last;
  }
  if (ask) {
    const double depth = s->lattice
                             ? qmat_depth_lattice_exact_up_to(s->lattice, centre, near, gap, farthest - s->accepted)
                             : -qmat_surface_signed_distance(s->surface, centre);
    if (s->patience > 0 && ++s->queries % s->patience == 0) s->tolerance *= 2, s->smallest *= 2;
    if (depth == INFINITY) { /* the depth is larger: accepted */
      s->bound = qmat_larger(s->bound, s->accepted);
      return true;
    }
    const double h = centre[3] - depth;
    s->found = qmat_larger(s->found, h);
    memcpy(s->place, centre, sizeof centre);
    if (h > s->limit) return false;
    if (is_done(s, farthest - depth, size, last)) return true;
    if (last || size <= 0.1 * s->smallest) { /* undecided at this size: the bound counts */
      s->bound = qmat_larger(s->bound, farthest - depth);
      return farthest - depth <= s->limit;
    }
    if (!s->lattice && depth > 0 && size > flat_tolerances * s->tolerance &&
        is_flat(s, p, s->found, qmat_larger(s->accepted, s->found + s->tolerance)))
      return true;
  }
  piece low, high;
  split(s, p, is_large, &low, &high);
  return search_piece(s, &low, level + 1) && search_piece(s, &high, level + 1);
}

double qmat_envelope_to_surface_of_sphere(const qmat_surface *surface, const double sphere[4]) {
  return sphere[3] + qmat_surface_signed_distance(surface, sphere);
}

double qmat_envelope_to_surface_bound_soon(const qmat_surface *surface, const double *const spheres[], int count,
                                           double enough, double tolerance, size_t patience) {
  piece p = {.count = count};
  search s = {.surface = surface,
              .accepted = enough,
              .limit = INFINITY,
              .smallest = 0.01 * tolerance,
              .failed = QMAT_NONE,
              .found = -INFINITY,
              .bound = enough,
              .tolerance = tolerance,
              .patience = patience};
  for (int i = 0; i < count; i++) {
    memcpy(p.spheres[i], spheres[i], 4 * sizeof(double));
    p.depths[i] = -qmat_surface_signed_distance(surface, spheres[i]);
    s.found = qmat_larger(s.found, spheres[i][3] - p.depths[i]);
  }
  if (count > 1) search_piece(&s, &p, 0);
  return qmat_larger(s.bound, s.found);
}

double qmat_envelope_to_surface_bound(const qmat_surface *surface, const double *const spheres[], int count,
                                      double enough, double tolerance) {
  return qmat_envelope_to_surface_bound_soon(surface, spheres, count, enough, tolerance, 0);
}

/* The lattice's spacing as a share of the limit, and the largest spacing. A node is then at most 0.44 of the limit
 * away. */
static const double lattice_share = 0.5, widest_spacing = 0.005;

qmat_status qmat_envelope_to_surface_init(qmat_context *context, qmat_envelope_to_surface *tracker,
                                          const qmat_surface *surface, const qmat_complex *complex,
                                          const double *depths, double limit) {
  *tracker =
      (qmat_envelope_to_surface){.limit = limit, .by_squares = limit < INFINITY && qmat_surface_is_watertight(surface)};
  const double spacing = limit < INFINITY ? lattice_share * limit : widest_spacing;
  const qmat_status status =
      qmat_depth_lattice_init(context, &tracker->lattice, surface, spacing < widest_spacing ? spacing : widest_spacing);
  if (status != QMAT_OK) return status;
  tracker->depths = qmat_alloc(complex->vertex_count, sizeof(double));
  tracker->edge_bounds = qmat_alloc(complex->edge_count, sizeof(double));
  tracker->triangle_bounds = qmat_alloc(complex->triangle_count, sizeof(double));
  if (!tracker->depths || !tracker->edge_bounds || !tracker->triangle_bounds)
    return qmat_fail_memory(context, "envelope-to-surface bounds");
  memcpy(tracker->depths, depths, complex->vertex_count * sizeof *depths);
  const int threads = qmat_threads(context);
#pragma omp parallel for num_threads(threads)
  for (size_t i = 0; i < complex->edge_count + complex->triangle_count; i++) {
    const bool is_edge = i < complex->edge_count;
    const size_t id = is_edge ? i : i - complex->edge_count;
    piece p = {.count = is_edge ? 2 : 3};
    for (int k = 0; k < p.count; k++) {
      const size_t v = is_edge ? complex->edges[2 * id + (size_t)k] : complex->triangles[3 * id + (size_t)k];
      memcpy(p.spheres[k], &complex->spheres[4 * v], sizeof p.spheres[k]);
      p.depths[k] = depths[v];
    }
    *(is_edge ? &tracker->edge_bounds[id] : &tracker->triangle_bounds[id]) =
        qmat_smaller(bound_from_corners(&p), tracker->by_squares ? bound_by_squares(&p, limit) : INFINITY);
  }
  return QMAT_OK;
}

void qmat_envelope_to_surface_uninit(qmat_envelope_to_surface *tracker) {
  qmat_depth_lattice_uninit(&tracker->lattice);
  qmat_free(tracker->depths);
  qmat_free(tracker->edge_bounds);
  qmat_free(tracker->triangle_bounds);
  qmat_free(tracker->new_edge_bounds);
  qmat_free(tracker->new_triangle_bounds);
  *tracker = (qmat_envelope_to_surface){0};
}

/* Prefetches what the tests of a star read, all at once. */
static void fetch_bounds(const qmat_envelope_to_surface *tracker, const qmat_complex *complex, const qmat_collapse *c) {
  for (size_t t = 0; t < c->triangle_count; t++) {
    if (c->kept_triangles[t] != QMAT_NONE) __builtin_prefetch(&tracker->triangle_bounds[c->kept_triangles[t]]);
    if (c->removed_triangles[t] != QMAT_NONE) __builtin_prefetch(&tracker->triangle_bounds[c->removed_triangles[t]]);
  }
  for (size_t n = 0; n < c->neighbour_count; n++) {
    __builtin_prefetch(&tracker->depths[c->neighbours[n]]);
    __builtin_prefetch(&complex->spheres[4 * (size_t)c->neighbours[n]]);
    if (c->kept_edges[n] != QMAT_NONE) __builtin_prefetch(&tracker->edge_bounds[c->kept_edges[n]]);
    if (c->removed_edges[n] != QMAT_NONE) __builtin_prefetch(&tracker->edge_bounds[c->removed_edges[n]]);
  }
}

bool qmat_envelope_to_surface_test_sphere(qmat_envelope_to_surface *tracker, const qmat_complex *complex,
                                          const qmat_collapse *collapse, const double sphere[4]) {
  const uint32_t ends[2] = {collapse->kept, collapse->removed};
  const double least = collapse->kept < tracker->sheet_vertices ? -INFINITY : 0;
  double depth = -INFINITY, gap;
  fetch_bounds(tracker, complex, collapse);
  for (int e = 0; e < 2 && ends[e] != QMAT_NONE; e++)
    depth = qmat_larger(depth,
                        tracker->depths[ends[e]] - qmat_point_distance(sphere, &complex->spheres[4 * (size_t)ends[e]]));
  if (!(depth > least && sphere[3] - depth <= tracker->limit)) {
    const double near = qmat_depth_lattice_near(&tracker->lattice, sphere, &gap);
    depth = qmat_larger(depth, near - gap);
    if (!(depth > least && sphere[3] - depth <= tracker->limit))
      depth = qmat_depth_lattice_exact_near(&tracker->lattice, sphere, near, gap);
  }
  tracker->sphere_depth = depth;
  return depth > least && sphere[3] - depth <= tracker->limit;
}

/* Whether a point, `gap` from a place at the depth `near`, is inside the solid or a thick sheet. */
static bool is_inside(qmat_depth_lattice *lattice, const double *point, double near, double gap) {
  return qmat_surface_half_thickness(lattice->surface) > 0
             ? qmat_depth_lattice_exact_near(lattice, point, near, gap) > 0
             : qmat_surface_inside(lattice->surface, point);
}

bool qmat_envelope_to_surface_test_midpoints(qmat_envelope_to_surface *tracker, const qmat_complex *complex,
                                             const qmat_collapse *collapse, const double sphere[4],
                                             double exempt_radius) {
  if (collapse->kept < tracker->sheet_vertices) return true;
  for (size_t n = 0; n < collapse->neighbour_count; n++) {
    const double *other = &complex->spheres[4 * (size_t)collapse->neighbours[n]];
    if (sphere[3] <= exempt_radius && other[3] <= exempt_radius) continue;
    const double half = 0.5 * qmat_point_distance(sphere, other);
    if (half < tracker->sphere_depth || half < tracker->depths[collapse->neighbours[n]]) continue;
    double middle[3], gap;
    for (int k = 0; k < 3; k++) middle[k] = 0.5 * (sphere[k] + other[k]);
    const double near = qmat_depth_lattice_near(&tracker->lattice, middle, &gap);
    if (near > gap) continue;
    if (near < -gap || !is_inside(&tracker->lattice, middle, near, gap)) return false;
  }
  return true;
}

/* An upper bound of the growth of h over a primitive when a corner moves to another sphere. */
static double growth(const double *from, const double *to) {
  return qmat_larger(0, qmat_point_distance(from, to) + to[3] - from[3]);
}

/* A search aims at this share of the limit while pieces are larger than the second share: the margin is slack for later
 * moves. */
static const double accepted_share = 0.8, smallest_share = 0.15;

qmat_status qmat_envelope_to_surface_test(qmat_context *context, qmat_envelope_to_surface *tracker,
                                          const qmat_complex *complex, const qmat_collapse *collapse,
                                          const double sphere[4], bool *kept) {
  if (qmat_grow((void **)&tracker->new_edge_bounds, &tracker->new_edge_capacity, collapse->neighbour_count,
                sizeof(double)) ||
      qmat_grow((void **)&tracker->new_triangle_bounds, &tracker->new_triangle_capacity, collapse->triangle_count,
                sizeof(double)))
    return qmat_fail_memory(context, "envelope-to-surface bounds");
  const double kept_growth = growth(&complex->spheres[4 * (size_t)collapse->kept], sphere);
  const double removed_growth =
      collapse->removed == QMAT_NONE ? 0 : growth(&complex->spheres[4 * (size_t)collapse->removed], sphere);
  search s = {.surface = tracker->lattice.surface,
              .lattice = &tracker->lattice,
              .by_squares = tracker->by_squares,
              .accepted = accepted_share * tracker->limit,
              .limit = tracker->limit,
              .smallest = smallest_share * tracker->limit,
              .failed = QMAT_NONE,
              .tolerance = 0};
  piece p;
  memcpy(p.spheres[0], sphere, sizeof p.spheres[0]);
  p.depths[0] = tracker->sphere_depth;
  *kept = true;
  bool is_known = false; /* whether p.depths[0] is the best that the lattice gives */
  for (size_t t = 0; t < collapse->triangle_count + collapse->neighbour_count && *kept; t++) {
    const bool is_edge = t >= collapse->triangle_count;
    const size_t id = is_edge ? t - collapse->triangle_count : t;
    const uint32_t mine = is_edge ? collapse->kept_edges[id] : collapse->kept_triangles[id];
    const uint32_t theirs = is_edge ? collapse->removed_edges[id] : collapse->removed_triangles[id];
    const double *bounds = is_edge ? tracker->edge_bounds : tracker->triangle_bounds;
    double *result = is_edge ? &tracker->new_edge_bounds[id] : &tracker->new_triangle_bounds[id];
    double bound = INFINITY;
    if (mine != QMAT_NONE) bound = bounds[mine] + kept_growth;
    if (theirs != QMAT_NONE) bound = qmat_smaller(bound, bounds[theirs] + removed_growth);
    p.count = is_edge ? 2 : 3;
    for (int k = 1; k < p.count; k++) {
      const uint32_t v = is_edge ? collapse->neighbours[id] : collapse->triangle_pairs[2 * id + (size_t)k - 1];
      memcpy(p.spheres[k], &complex->spheres[4 * (size_t)v], sizeof p.spheres[k]);
      p.depths[k] = tracker->depths[v];
    }
    bound = qmat_smaller(bound, bound_from_corners(&p));
    if (is_edge) /* a bound of the triangle is a bound of its edge */
      for (size_t i = 0; i < 2 * collapse->triangle_count && bound > tracker->limit; i++)
        if (collapse->triangle_pairs[i] == collapse->neighbours[id])
          bound = qmat_smaller(bound, tracker->new_triangle_bounds[i / 2]);
    if (bound > tracker->limit && tracker->by_squares) {
      for (int k = 0; k < p.count; k++)
        if (k > 0 || !is_known) p.depths[k] = qmat_larger(p.depths[k], least_depth(&tracker->lattice, p.spheres[k]));
      is_known = true;
      bound = qmat_smaller(bound, bound_by_squares(&p, squares_share * tracker->limit));
    }
    if (bound > tracker->limit) {
      s.found = s.bound = -INFINITY;
      memcpy(s.place, sphere, sizeof s.place);
      *kept = search_piece(&s, &p, 0);
      bound = s.bound;
      tracker->failed = qmat_larger(s.found, tracker->limit);
      memcpy(tracker->failed_place, s.place, sizeof s.place);
    }
    *result = bound;
  }
  return QMAT_OK;
}

void qmat_envelope_to_surface_commit(qmat_envelope_to_surface *tracker, const qmat_collapse *collapse) {
  tracker->depths[collapse->kept] = tracker->sphere_depth;
  for (size_t n = 0; n < collapse->neighbour_count; n++) {
    const uint32_t edge = collapse->kept_edges[n] != QMAT_NONE ? collapse->kept_edges[n] : collapse->removed_edges[n];
    tracker->edge_bounds[edge] = tracker->new_edge_bounds[n];
  }
  for (size_t t = 0; t < collapse->triangle_count; t++) {
    const uint32_t triangle =
        collapse->kept_triangles[t] != QMAT_NONE ? collapse->kept_triangles[t] : collapse->removed_triangles[t];
    tracker->triangle_bounds[triangle] = tracker->new_triangle_bounds[t];
  }
}

void qmat_envelope_to_surface_carry(qmat_envelope_to_surface *tracker, const qmat_complex *complex, const uint32_t *ids,
                                    size_t width, const uint32_t *rows, const uint8_t *alive, const double *bounds,
                                    size_t count) {
  for (size_t i = 0; i < count; i++) {
    if (alive && !alive[i]) continue;
    const uint32_t *row = &rows[width * i], a = ids[row[0]], b = ids[row[1]];
    double *known = width == 2 ? &tracker->edge_bounds[qmat_complex_find_edge(complex, a, b)]
                               : &tracker->triangle_bounds[qmat_complex_find_triangle(complex, a, b, ids[row[2]])];
    *known = qmat_smaller(*known, bounds[i]);
  }
}

static double tightened(const qmat_envelope_to_surface *tracker, const qmat_complex *complex, const uint32_t *vertices,
                        int count, double bound) {
  const double *spheres[3];
  for (int k = 0; k < count; k++) spheres[k] = &complex->spheres[4 * (size_t)vertices[k]];
  return qmat_smaller(
      bound, qmat_envelope_to_surface_bound(tracker->lattice.surface, spheres, count, accepted_share * tracker->limit,
                                            (1 - squares_share) * tracker->limit));
}

void qmat_envelope_to_surface_tighten(qmat_envelope_to_surface *tracker, const qmat_complex *complex) {
  for (size_t e = 0; e < complex->edge_count; e++)
    if (complex->edge_alive[e] && tracker->edge_bounds[e] > tracker->limit)
      tracker->edge_bounds[e] = tightened(tracker, complex, &complex->edges[2 * e], 2, tracker->edge_bounds[e]);
  for (size_t t = 0; t < complex->triangle_count; t++)
    if (complex->triangle_alive[t] && tracker->triangle_bounds[t] > tracker->limit)
      tracker->triangle_bounds[t] =
          tightened(tracker, complex, &complex->triangles[3 * t], 3, tracker->triangle_bounds[t]);
}

double qmat_envelope_to_surface_largest_bound(const qmat_envelope_to_surface *tracker, const qmat_complex *complex) {
  double largest = 0;
  for (size_t v = 0; v < complex->vertex_count; v++)
    if (complex->vertex_alive[v]) largest = qmat_larger(largest, complex->spheres[4 * v + 3] - tracker->depths[v]);
  for (size_t e = 0; e < complex->edge_count; e++)
    if (complex->edge_alive[e]) largest = qmat_larger(largest, tracker->edge_bounds[e]);
  for (size_t t = 0; t < complex->triangle_count; t++)
    if (complex->triangle_alive[t]) largest = qmat_larger(largest, tracker->triangle_bounds[t]);
  return largest;
}
