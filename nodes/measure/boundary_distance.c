/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/boundary_distance.h"

#include <math.h>
#include <string.h>

#include "core/geometry/medial_distance.h"
#include "core/hash.h"

/* What lies no deeper in the envelope than this lies on its boundary, and what hi is raised by: more than rounding. */
static const double rounding = 1e-9;

/* A sixteenth of what is tolerated: what is undecided in a piece of that reach stays so, and where lo is close below
 * epsilon that much is tolerated. */
static const double smallest_share = 1.0 / 16;

/* Errors are not told from this many times what is tolerated at epsilon: where the boundary lies close to the surface
 * all over, looks would be without number. */
static const double least_told = 5;

static const double least_tolerance = 1e-5;

/* Where less of the features' surfaces than this share lies on the boundary, or there are more features than that,
 * space is searched instead of them. */
static const double least_exposed = 0.05;
enum { MANY_FEATURES = 10000 };

/* After so many looks nothing is split any more; F is slow where hundreds of primitives hold a point. */
enum { MOST_LOOKS = 1 << 21, MOST_LOOKS_OF_MANY = 1 << 17 };

static double maximum(double a, double b) {
  return a > b ? a : b;
}

static double minimum(double a, double b) {
  return a < b ? a : b;
}

static double dot(const double *a, const double *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double distance(const double *a, const double *b) {
  const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return sqrt(dot(d, d));
}

static void normalize(double *v) {
  const double length = sqrt(dot(v, v));
  for (int k = 0; k < 3; k++) v[k] /= length;
}

static void cross(const double *a, const double *b, double *c) {
  for (int k = 0; k < 3; k++) c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static double tolerated(double lo, double epsilon, double tolerance) {
  return maximum(tolerance * maximum(epsilon, lo), least_tolerance);
}

double qmat_bound_target(double lo, double epsilon, double tolerance) {
  const double allowed = tolerated(lo, epsilon, tolerance), target = lo + allowed;
  return lo < epsilon && target > epsilon ? maximum(epsilon, lo + smallest_share * allowed) : target;
}

/* ---- the features whose surfaces make the boundary: spheres, then mantles of edges, then both sheets of triangles
 * ---- */

typedef struct features {
  const double *spheres; /* 4 a sphere */
  const uint32_t *edges, *triangles;
  size_t sphere_count, edge_count, triangle_count;
  /* In compressed rows: the spheres joined to a sphere, and those joined to an edge by a triangle. */
  size_t *neighbour_offsets, *apex_offsets;
  uint32_t *neighbours, *apexes;
} features;

static size_t feature_count(const features *f) {
  return f->sphere_count + f->edge_count + 2 * f->triangle_count;
}

/* The row of the edge a < b; the rows are sorted and hold every side of a triangle. */
static size_t find_edge(const features *f, uint32_t a, uint32_t b) {
  size_t low = 0, high = f->edge_count;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    const uint32_t *row = &f->edges[2 * middle];
    if (row[0] < a || (row[0] == a && row[1] < b))
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

/* Turns counts at [row + 2] into the places where rows are filled, which end up as offsets. */
static void sum_counts(size_t *offsets, size_t rows) {
  for (size_t i = 0; i < rows; i++) offsets[i + 2] += offsets[i + 1];
}

static qmat_status join_features(qmat_context *context, const qmat_medial *unit, features *f) {
  qmat_arena *arena = &context->arena;
  *f = (features){.spheres = unit->spheres,
                  .edges = unit->edges,
                  .triangles = unit->triangles,
                  .sphere_count = unit->sphere_count,
                  .edge_count = unit->edge_count,
                  .triangle_count = unit->triangle_count};
  f->neighbour_offsets = qmat_arena_calloc(arena, f->sphere_count + 2, sizeof *f->neighbour_offsets);
  f->apex_offsets = qmat_arena_calloc(arena, f->edge_count + 2, sizeof *f->apex_offsets);
  f->neighbours = qmat_arena_alloc(arena, f->edge_count, 2 * sizeof *f->neighbours);
  f->apexes = qmat_arena_alloc(arena, f->triangle_count, 3 * sizeof *f->apexes);
  size_t *sides = qmat_arena_alloc(arena, f->triangle_count, 3 * sizeof *sides);
  if (!f->neighbour_offsets || !f->apex_offsets || !f->neighbours || !f->apexes || !sides)
    return qmat_fail_memory(context, "the envelope's boundary");
  for (size_t i = 0; i < 2 * f->edge_count; i++) f->neighbour_offsets[f->edges[i] + 2]++;
  sum_counts(f->neighbour_offsets, f->sphere_count);
  for (size_t i = 0; i < 2 * f->edge_count; i++)
    f->neighbours[f->neighbour_offsets[f->edges[i] + 1]++] = f->edges[i ^ 1];
  for (size_t t = 0; t < f->triangle_count; t++) {
    const uint32_t *row = &f->triangles[3 * t];
    for (size_t k = 0; k < 3; k++) { /* side k lies opposite to corner k; corners rise */
      sides[3 * t + k] = find_edge(f, row[k == 0], row[k == 2 ? 1 : 2]);
      f->apex_offsets[sides[3 * t + k] + 2]++;
    }
  }
  sum_counts(f->apex_offsets, f->edge_count);
  for (size_t i = 0; i < 3 * f->triangle_count; i++) f->apexes[f->apex_offsets[sides[i] + 1]++] = f->triangles[i];
  return QMAT_OK;
}

/* The mantle of a cone: what its tangent planes touch. At an angle around the axis the normal is the same all along. */
typedef struct cone_side {
  const double *a, *b;        /* the ends */
  double length;              /* of the mantle along itself */
  double axis[3], v[3], w[3]; /* orthonormal */
  double along, across;       /* the normal's parts along the axis and at right angles to it */
} cone_side;

/* False where one end holds the other: there is none. */
static bool make_cone_side(const double *a, const double *b, cone_side *m) {
  *m = (cone_side){.a = a, .b = b};
  const double length = distance(a, b), growth = b[3] - a[3];
  if (!(length > fabs(growth)) || !(fabs(growth / length) < 1)) return false;
  for (int k = 0; k < 3; k++) m->axis[k] = (b[k] - a[k]) / length;
  m->along = -growth / length;
  m->across = sqrt((1 - m->along) * (1 + m->along));
  m->length = length * m->across;
  int least = 0;
  for (int k = 1; k < 3; k++)
    if (fabs(m->axis[k]) < fabs(m->axis[least])) least = k;
  double unit[3] = {0, 0, 0};
  unit[least] = 1;
  cross(m->axis, unit, m->v);
  normalize(m->v);
  cross(m->axis, m->v, m->w);
  return true;
}

/* The medial sphere at t in [0, 1]. */
static void cone_side_sphere(const cone_side *m, double t, double sphere[4]) {
  for (int k = 0; k < 4; k++) sphere[k] = (1 - t) * m->a[k] + t * m->b[k];
}

static void cone_side_normal(const cone_side *m, double angle, double normal[3]) {
  const double x = m->across * cos(angle), y = m->across * sin(angle);
  for (int k = 0; k < 3; k++) normal[k] = m->along * m->axis[k] + x * m->v[k] + y * m->w[k];
}

/* The corners of a slab's sheet on side 0 or 1; false where it has none. */
static bool make_sheet(const features *f, size_t triangle, int side, double corners[9]) {
  const double *s[3];
  for (size_t i = 0; i < 3; i++) s[i] = &f->spheres[4 * (size_t)f->triangles[3 * triangle + i]];
  qmat_slab slab;
  qmat_slab_prepare(&slab, s[0], s[1], s[2]);
  if (!slab.solid) return false;
  for (size_t k = 0; k < 3; k++) {
    const double rise = side ? -slab.rise * slab.normal[k] : slab.rise * slab.normal[k];
    const double normal = rise - slab.gradient[0] * slab.u[k] - slab.gradient[1] * slab.v[k];
    for (size_t i = 0; i < 3; i++) corners[3 * i + k] = s[i][k] + s[i][3] * normal;
  }
  return true;
}

/* ---- samples ---- */

static double triangle_area(const double corners[9]) {
  double a[3], b[3], c[3];
  for (int k = 0; k < 3; k++) {
    a[k] = corners[3 + k] - corners[k];
    b[k] = corners[6 + k] - corners[k];
  }
  cross(a, b, c);
  return 0.5 * sqrt(dot(c, c));
}

static const double pi = 3.14159265358979323846;

static double feature_area(const features *f, size_t feature) {
  if (feature < f->sphere_count) return 4 * pi * f->spheres[4 * feature + 3] * f->spheres[4 * feature + 3];
  feature -= f->sphere_count;
  if (feature < f->edge_count) {
    cone_side m;
    const uint32_t *ends = &f->edges[2 * feature];
    if (!make_cone_side(&f->spheres[4 * (size_t)ends[0]], &f->spheres[4 * (size_t)ends[1]], &m)) return 0;
    return pi * (m.a[3] + m.b[3]) * m.across * m.length;
  }
  feature -= f->edge_count;
  double corners[9];
  return make_sheet(f, feature / 2, (int)(feature % 2), corners) ? triangle_area(corners) : 0;
}

/* A point of a feature's surface, even in its area, from two numbers in [0, 1). */
static void feature_point(const features *f, size_t feature, double x, double y, double point[3]) {
  if (feature < f->sphere_count) {
    const double *s = &f->spheres[4 * feature], z = 2 * x - 1, ring = sqrt(1 - z * z);
    const double normal[3] = {ring * cos(2 * pi * y), ring * sin(2 * pi * y), z};
    for (int k = 0; k < 3; k++) point[k] = s[k] + s[3] * normal[k];
    return;
  }
  feature -= f->sphere_count;
  if (feature < f->edge_count) {
    cone_side m;
    double sphere[4], normal[3];
    const uint32_t *ends = &f->edges[2 * feature];
    if (!make_cone_side(&f->spheres[4 * (size_t)ends[0]], &f->spheres[4 * (size_t)ends[1]], &m)) return;
    /* The radius is even in its square: r(t)^2 = (1 - x) ra^2 + x rb^2. */
    const double ra = m.a[3], rb = m.b[3], sum = ra + sqrt((1 - x) * ra * ra + x * rb * rb);
    const double t = sum > 0 ? x * (ra + rb) / sum : x;
    cone_side_sphere(&m, t, sphere);
    cone_side_normal(&m, 2 * pi * y, normal);
    for (int k = 0; k < 3; k++) point[k] = sphere[k] + sphere[3] * normal[k];
    return;
  }
  feature -= f->edge_count;
  double corners[9];
  if (!make_sheet(f, feature / 2, (int)(feature % 2), corners)) return;
  const double root = sqrt(x);
  for (int k = 0; k < 3; k++)
    point[k] = (1 - root) * corners[k] + root * (1 - y) * corners[3 + k] + root * y * corners[6 + k];
}

/* The feature that the running sum of areas reaches `wanted` in. */
static size_t feature_at(const double *areas, size_t count, double wanted) {
  size_t low = 0, high = count - 1;
  while (low < high) {
    const size_t middle = low + (high - low) / 2;
    if (areas[middle] > wanted)
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

enum { SAMPLES_AT_ONCE = 512 };

typedef struct sample_sum {
  double largest, outside, sum;
  size_t count;
} sample_sum;

static qmat_status sample_boundary(qmat_context *context, const features *f, const qmat_surface *surface,
                                   const qmat_envelope *envelope, size_t sample_count, qmat_boundary_distance *result) {
  const size_t count = feature_count(f), rows = (sample_count + SAMPLES_AT_ONCE - 1) / SAMPLES_AT_ONCE, slice = 256;
  double *areas = qmat_arena_alloc(&context->arena, count, sizeof *areas);
  sample_sum *sums = qmat_arena_calloc(&context->arena, slice, sizeof *sums);
  if (!areas || !sums) return qmat_fail_memory(context, "the envelope's boundary");
  double area = 0, total = 0;
  for (size_t i = 0; i < count; i++) areas[i] = area += feature_area(f, i);
  if (count == 0 || !(area > 0)) return QMAT_OK;
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < rows; first += slice) {
    const qmat_status status = qmat_progress(context, first, rows, "samples of the envelope");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < rows ? first + slice : rows;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (size_t row = first; row < last; row++) {
      sample_sum sum = {0, 0, 0, 0};
      for (size_t i = row * SAMPLES_AT_ONCE; i < sample_count && i < (row + 1) * SAMPLES_AT_ONCE; i++) {
        double point[3] = {0, 0, 0};
        const double wanted = area * (((double)i + 0.5) / (double)sample_count);
        feature_point(f, feature_at(areas, count, wanted), qmat_hash_unit(qmat_hash3(1, i, 0)),
                      qmat_hash_unit(qmat_hash3(1, i, 1)), point);
        if (qmat_envelope_holds(envelope, point, rounding)) continue;
        const double d = qmat_surface_distance(surface, point, INFINITY, NULL, NULL);
        sum.sum += d;
        sum.count++;
        sum.largest = maximum(sum.largest, d);
        if (d > sum.outside && !qmat_surface_inside(surface, point)) sum.outside = d;
      }
      sums[row - first] = sum;
    }
    for (size_t row = first; row < last; row++) {
      const sample_sum *sum = &sums[row - first];
      total += sum->sum;
      result->sample_count += sum->count;
      result->largest = maximum(result->largest, sum->largest);
      result->outside.lo = maximum(result->outside.lo, sum->outside);
    }
  }
  if (result->sample_count > 0) result->mean = total / (double)result->sample_count;
  result->either_side.lo = result->largest;
  return QMAT_OK;
}

/* ---- branch and bound ---- */

enum { SIDES_EITHER = 1, SIDES_OUT = 2 };

/* Stands for a feature: a cube of space. */
#define CELL UINT32_MAX

/* A piece of a feature's surface, or of space. `at` is, of a sphere, three unit vectors: what is between them; of a
 * mantle, t from and to and the angle from and to; of a sheet, three corners; of a cell, the centre and half the side.
 */
typedef struct patch {
  double at[9];
  uint32_t feature;
  uint8_t sides; /* which bounds it is still wanted for */
} patch;

typedef struct patch_list {
  patch *items;
  size_t count, capacity;
} patch_list;

typedef struct search {
  const features *features;
  const qmat_surface *surface;
  const qmat_envelope *envelope;
  double epsilon;
  double lo[2], target[2], smallest; /* either side, outside */
  uint8_t sides;                     /* what is wanted */
  bool last;                         /* nothing is split any more */
} search;

/* What a look at a patch says. */
typedef struct finding {
  double place[3];           /* where found[0] is attained, unless that is 0, or what is undecided */
  double found[2], bound[2]; /* either side, outside: an attained distance, and a bound of what is done with */
  int children;
  bool doubtful;  /* whether `place` is tolerated, but may be farther than epsilon */
  bool undecided; /* whether `place`, farther than epsilon, may or may not lie on the boundary */
  uint8_t sides;  /* what the children are wanted for */
} finding;

/* How deep all points c + r n lie at least in the hull of the spheres a = (c, r) and b, for the unit vectors n within
 * `spread` of `normal`; 0 when they may lie on its boundary. `square` is the squared distance of the centres. With
 * e = n.(cb - ca) - (ra - rb), the sphere at t between a and b holds the point to a depth of at least
 * t e - t^2 |cb - ca|^2 / (2 ra): sqrt(1 + x) <= 1 + x / 2. */
static double buried(double excess, double radius, double square) {
  if (!(excess > 0) || !(radius > 0)) return 0;
  const double t = square > 0 ? minimum(1, excess * radius / square) : 1;
  return t * excess - t * t * square / (2 * radius);
}

static double buried_in_neighbour(const double a[4], const double normal[3], double spread, const double b[4]) {
  const double d[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, square = dot(d, d);
  return buried(dot(normal, d) - spread * sqrt(square) - (a[3] - b[3]), a[3], square);
}

/* A patch's middle, how far its points are from it, and whether a neighbour holds it. */
static bool look_at_sphere(const search *s, const patch *p, double middle[3], double *reach) {
  const double *sphere = &s->features->spheres[4 * (size_t)p->feature];
  double normal[3], spread = 0;
  for (int k = 0; k < 3; k++) normal[k] = p->at[k] + p->at[3 + k] + p->at[6 + k];
  normalize(normal);
  for (int i = 0; i < 3; i++) spread = maximum(spread, distance(normal, &p->at[3 * i]));
  for (int k = 0; k < 3; k++) middle[k] = sphere[k] + sphere[3] * normal[k];
  *reach = sphere[3] * spread;
  for (size_t i = s->features->neighbour_offsets[p->feature]; i < s->features->neighbour_offsets[p->feature + 1]; i++) {
    const double *other = &s->features->spheres[4 * (size_t)s->features->neighbours[i]];
    if (buried_in_neighbour(sphere, normal, spread, other) > QMAT_BOUNDARY_SKIN) return false;
  }
  return true;
}

/* The patch's halves along the mantle and around it. */
static void cone_side_reach(const cone_side *m, const patch *p, double *along, double *around) {
  double sphere[4];
  cone_side_sphere(m, 0.5 * (p->at[0] + p->at[1]), sphere);
  *along = 0.5 * m->length * (p->at[1] - p->at[0]);
  *around = 2 * sphere[3] * m->across * sin(0.25 * (p->at[3] - p->at[2]));
}

static cone_side cone_side_of(const features *f, const patch *p) {
  cone_side m;
  const uint32_t *ends = &f->edges[2 * (p->feature - f->sphere_count)];
  make_cone_side(&f->spheres[4 * (size_t)ends[0]], &f->spheres[4 * (size_t)ends[1]], &m);
  return m;
}

static bool query_cone_side(const search *s, const patch *p, double middle[3], double *reach) {
  const features *f = s->features;
  const size_t edge = p->feature - f->sphere_count;
  const cone_side m = cone_side_of(f, p);
  double sphere[4], ends[2][4], normal[3], along, around;
  cone_side_sphere(&m, 0.5 * (p->at[0] + p->at[1]), sphere);
  cone_side_normal(&m, 0.5 * (p->at[2] + p->at[3]), normal);
  for (int k = 0; k < 3; k++) middle[k] = sphere[k] + sphere[3] * normal[k];
  cone_side_reach(&m, p, &along, &around);
  *reach = along + around;
  const double spread = 2 * m.across * sin(0.25 * (p->at[3] - p->at[2]));
  for (int e = 0; e < 2; e++) cone_side_sphere(&m, p->at[e], ends[e]);
  for (size_t i = f->apex_offsets[edge]; i < f->apex_offsets[edge + 1]; i++) {
    /* n.c + r is the same all along: so is the excess, and the ends have the least radius and the largest distance. */
    const double *apex = &f->spheres[4 * (size_t)f->apexes[i]];
    double excess = INFINITY, radius = INFINITY, square = 0;
    for (int e = 0; e < 2; e++) {
      const double d[3] = {apex[0] - ends[e][0], apex[1] - ends[e][1], apex[2] - ends[e][2]};
      square = maximum(square, dot(d, d));
      radius = minimum(radius, ends[e][3]);
      excess = minimum(excess, dot(normal, d) - spread * sqrt(dot(d, d)) - (ends[e][3] - apex[3]));
    }
    if (buried(excess, radius, square) > QMAT_BOUNDARY_SKIN) return false;
  }
  return true;
}

static void look_at_sheet(const patch *p, double middle[3], double *reach) {
  for (int k = 0; k < 3; k++) middle[k] = (p->at[k] + p->at[3 + k] + p->at[6 + k]) / 3;
  *reach = 0;
  for (int i = 0; i < 3; i++) *reach = maximum(*reach, distance(middle, &p->at[3 * i]));
}

static void look_at_cell(const patch *p, double middle[3], double *reach) {
  memcpy(middle, p->at, 3 * sizeof *middle);
  *reach = sqrt(3) * p->at[3];
}

static int cone_side_children(const features *f, const patch *p) {
  double along, around;
  const cone_side m = cone_side_of(f, p);
  cone_side_reach(&m, p, &along, &around);
  return along > 2 * around || around > 2 * along ? 2 : 4;
}

/* Whether no point within `reach` of the middle lies on the boundary. A patch's own middle is never out of it. */
static bool is_off_boundary(const search *s, bool is_cell, const double middle[3], double reach) {
  if (qmat_envelope_holds(s->envelope, middle, reach + QMAT_BOUNDARY_SKIN)) return true;
  return is_cell && qmat_envelope_distance_within(s->envelope, middle, reach) > reach;
}

/* Moves a cell's middle to the surface of its nearest medial sphere. */
static void move_to_sphere(const search *s, double middle[3]) {
  double sphere[4];
  qmat_envelope_nearest(s->envelope, middle, NULL, sphere);
  const double length = distance(middle, sphere);
  for (int k = 0; k < 3 && length > 0; k++) middle[k] = sphere[k] + sphere[3] / length * (middle[k] - sphere[k]);
}

/* Asks at the middle, when it lies on the boundary. */
static void find(const search *s, bool is_cell, double middle[3], uint8_t sides, finding *result) {
  if (is_cell) move_to_sphere(s, middle);
  if (qmat_envelope_holds(s->envelope, middle, rounding)) return;
  result->found[0] = qmat_surface_distance(s->surface, middle, INFINITY, NULL, NULL);
  memcpy(result->place, middle, sizeof result->place);
  if ((sides & SIDES_OUT) && !qmat_surface_inside(s->surface, middle)) result->found[1] = result->found[0];
}

static finding look_at(const search *s, const patch *p) {
  const features *f = s->features;
  finding result = {.found = {0, 0}, .bound = {0, 0}};
  double middle[3], reach;
  const bool is_cell = p->feature == CELL, is_sphere = !is_cell && p->feature < f->sphere_count;
  const bool is_cone_side = !is_cell && !is_sphere && p->feature < f->sphere_count + f->edge_count;
  bool open = true;
  if (is_sphere)
    open = look_at_sphere(s, p, middle, &reach);
  else if (is_cone_side)
    open = query_cone_side(s, p, middle, &reach);
  else if (is_cell)
    look_at_cell(p, middle, &reach);
  else
    look_at_sheet(p, middle, &reach);
  if (!open) return result;
  uint8_t sides = p->sides;
  if (s->last || reach < s->target[0]) {
    /* Where only one bound is wanted the surface is not looked for farther than that allows. */
    const bool is_short = !s->last && sides == SIDES_EITHER;
    double d = qmat_surface_distance(s->surface, middle, is_short ? s->target[0] - reach : INFINITY, NULL, NULL);
    const double bound = d + reach;
    result.doubtful = bound > s->epsilon && bound <= s->target[0] && s->lo[0] <= s->epsilon && (sides & SIDES_EITHER);
    for (int side = 0; side < 2; side++)
      if ((sides >> side & 1) && bound <= s->target[side]) {
        result.bound[side] = bound;
        sides &= (uint8_t) ~(1 << side);
      }
    if (!sides && !result.doubtful) return result;
    if (is_off_boundary(s, is_cell, middle, reach)) return (finding){.found = {0, 0}};
    if (result.doubtful) memcpy(result.place, middle, sizeof result.place);
    if (!sides) return result;
    if (!(d < INFINITY)) d = qmat_surface_distance(s->surface, middle, INFINITY, NULL, NULL);
    const bool inside = (sides & SIDES_OUT) && qmat_surface_inside(s->surface, middle);
    if (inside && d > reach) sides &= SIDES_EITHER;
    if (d > minimum(s->lo[0], s->epsilon) || ((sides & SIDES_OUT) && !inside && d > s->lo[1]))
      find(s, is_cell, middle, sides, &result);
    if (s->last || reach <= s->smallest) {
      for (int side = 0; side < 2; side++)
        if (sides >> side & 1) result.bound[side] = d + reach;
      result.undecided = !(result.found[0] > s->epsilon) && d > s->epsilon;
      if (result.undecided) memcpy(result.place, middle, sizeof result.place);
      return result;
    }
  } else if (is_off_boundary(s, is_cell, middle, reach)) {
    return result;
  }
  result.sides = sides;
  if (sides) result.children = is_sphere ? 4 : is_cone_side ? cone_side_children(f, p) : is_cell ? 8 : 2;
  return result;
}

static void split_triangle_in_two(const patch *p, patch children[2]) {
  int a = 0;
  double longest = -1;
  for (int i = 0; i < 3; i++) {
    const double length = distance(&p->at[3 * i], &p->at[3 * ((i + 1) % 3)]);
    if (length > longest) {
      longest = length;
      a = i;
    }
  }
  const int b = (a + 1) % 3;
  for (int k = 0; k < 3; k++)
    children[0].at[3 * b + k] = children[1].at[3 * a + k] = 0.5 * (p->at[3 * a + k] + p->at[3 * b + k]);
}

static void split_sphere(const patch *p, patch children[4]) {
  double middles[3][3]; /* opposite to each corner */
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++) middles[i][k] = p->at[3 * ((i + 1) % 3) + k] + p->at[3 * ((i + 2) % 3) + k];
    normalize(middles[i]);
  }
  for (int i = 0; i < 3; i++) { /* child i keeps corner i */
    memcpy(&children[i].at[3 * ((i + 1) % 3)], middles[(i + 2) % 3], sizeof middles[0]);
    memcpy(&children[i].at[3 * ((i + 2) % 3)], middles[(i + 1) % 3], sizeof middles[0]);
  }
  memcpy(children[3].at, middles, sizeof middles);
}

static void split_cone_side(const features *f, const patch *p, int count, patch children[]) {
  double along, around;
  const cone_side m = cone_side_of(f, p);
  cone_side_reach(&m, p, &along, &around);
  const double t = 0.5 * (p->at[0] + p->at[1]), angle = 0.5 * (p->at[2] + p->at[3]);
  for (int i = 0; i < count; i++) {
    if (along >= around || count == 4) children[i].at[i & 1 ? 0 : 1] = t;
    if (along < around && count == 2) children[i].at[i & 1 ? 2 : 3] = angle;
    if (count == 4) children[i].at[i & 2 ? 2 : 3] = angle;
  }
}

static void split_cell(const patch *p, patch children[8]) {
  for (int i = 0; i < 8; i++) {
    children[i].at[3] = 0.5 * p->at[3];
    for (int k = 0; k < 3; k++) children[i].at[k] = p->at[k] + (i >> k & 1 ? 0.5 : -0.5) * p->at[3];
  }
}

static void split(const features *f, const patch *p, const finding *found, patch children[]) {
  for (int i = 0; i < found->children; i++) {
    children[i] = *p;
    children[i].sides = found->sides;
  }
  if (p->feature == CELL)
    split_cell(p, children);
  else if (p->feature < f->sphere_count)
    split_sphere(p, children);
  else if (p->feature < f->sphere_count + f->edge_count)
    split_cone_side(f, p, found->children, children);
  else
    split_triangle_in_two(p, children);
}

static void add_roots(const features *f, size_t feature, uint8_t sides, patch_list *list) {
  patch root = {.feature = (uint32_t)feature, .sides = sides};
  if (feature < f->sphere_count) {
    for (int octant = 0; octant < 8; octant++) {
      for (int i = 0; i < 3; i++) root.at[4 * i] = octant >> i & 1 ? -1 : 1;
      list->items[list->count++] = root;
    }
  } else if (feature < f->sphere_count + f->edge_count) {
    cone_side m;
    const uint32_t *ends = &f->edges[2 * (feature - f->sphere_count)];
    if (!make_cone_side(&f->spheres[4 * (size_t)ends[0]], &f->spheres[4 * (size_t)ends[1]], &m)) return;
    root.at[1] = 1;
    for (int quarter = 0; quarter < 4; quarter++) {
      root.at[2] = 0.5 * pi * quarter;
      root.at[3] = 0.5 * pi * (quarter + 1);
      list->items[list->count++] = root;
    }
  } else {
    const size_t sheet = feature - f->sphere_count - f->edge_count;
    if (make_sheet(f, sheet / 2, (int)(sheet % 2), root.at)) list->items[list->count++] = root;
  }
}

static int add_point(double **points, size_t *count, size_t *capacity, const double point[3]) {
  if (qmat_grow((void **)points, capacity, *count + 1, 3 * sizeof **points)) return -1;
  memcpy(&(*points)[3 * (*count)++], point, 3 * sizeof **points);
  return 0;
}

/* Keeps the place of a finding that is, or may be, farther than epsilon. */
static int take_place(qmat_boundary_distance *result, const finding *found, double epsilon) {
  if (found->found[0] > epsilon || found->undecided)
    return add_point(&result->far_points, &result->far_count, &result->far_capacity, found->place);
  return found->doubtful ? add_point(&result->doubts, &result->doubt_count, &result->doubt_capacity, found->place) : 0;
}

void qmat_boundary_distance_uninit(qmat_boundary_distance *result) {
  qmat_free(result->far_points);
  qmat_free(result->doubts);
  result->far_points = result->doubts = NULL;
  result->far_count = result->far_capacity = result->doubt_count = result->doubt_capacity = 0;
}

/* One level: looks at every patch of `from` and puts the children into `to`. */
static qmat_status search_level(qmat_context *context, const search *s, const patch_list *from, patch_list *to,
                                finding *findings, qmat_boundary_distance *result) {
  const int threads = qmat_threads(context);
  const size_t slice = 1 << 13;
  for (size_t first = 0; first < from->count; first += slice) {
    const qmat_status status = qmat_progress(context, first, from->count, "pieces of the envelope");
    if (status != QMAT_OK) return status;
    const size_t last = first + slice < from->count ? first + slice : from->count;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 64)
    for (size_t i = first; i < last; i++) findings[i] = look_at(s, &from->items[i]);
  }
  result->looks += from->count;
  qmat_bounds *const bounds[2] = {&result->either_side, &result->outside};
  to->count = 0;
  for (size_t i = 0; i < from->count; i++) {
    for (int side = 0; side < 2; side++) {
      bounds[side]->lo = maximum(bounds[side]->lo, findings[i].found[side]);
      bounds[side]->hi = maximum(bounds[side]->hi, findings[i].bound[side]);
    }
    to->count += (size_t)findings[i].children;
    if (take_place(result, &findings[i], s->epsilon)) return qmat_fail_memory(context, "the envelope's boundary");
  }
  if (qmat_grow((void **)&to->items, &to->capacity, to->count, sizeof *to->items))
    return qmat_fail_memory(context, "pieces of the envelope's boundary");
  size_t filled = 0;
  for (size_t i = 0; i < from->count; i++) {
    if (findings[i].children) split(s->features, &from->items[i], &findings[i], &to->items[filled]);
    filled += (size_t)findings[i].children;
  }
  return QMAT_OK;
}

/* The cube around all spheres. */
static patch whole_space(const features *f, uint8_t sides) {
  patch root = {.feature = CELL, .sides = sides};
  for (int k = 0; k < 3; k++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < f->sphere_count; i++) {
      const double *sphere = &f->spheres[4 * i];
      low = minimum(low, sphere[k] - sphere[3]);
      high = maximum(high, sphere[k] + sphere[3]);
    }
    root.at[k] = 0.5 * (low + high);
    root.at[3] = maximum(root.at[3], 0.5 * (high - low));
  }
  root.at[3] *= 1 + rounding;
  return root;
}

static qmat_status search_pieces(qmat_context *context, search *s, double epsilon, double tolerance,
                                 size_t sample_count, qmat_boundary_distance *result) {
  const size_t count = feature_count(s->features);
  const size_t most_looks = count > MANY_FEATURES ? MOST_LOOKS_OF_MANY : MOST_LOOKS;
  const bool in_space = count > MANY_FEATURES || (double)result->sample_count < least_exposed * (double)sample_count;
  patch_list lists[2] = {{0}, {0}};
  finding *findings = NULL;
  size_t capacity = 0;
  qmat_status status = QMAT_OK;
  if (qmat_grow((void **)&lists[0].items, &lists[0].capacity, 8 * (in_space ? 1 : count), sizeof *lists[0].items))
    status = qmat_fail_memory(context, "pieces of the envelope's boundary");
  for (size_t i = 0; !in_space && i < count && status == QMAT_OK; i++) add_roots(s->features, i, s->sides, &lists[0]);
  if (in_space && status == QMAT_OK) lists[0].items[lists[0].count++] = whole_space(s->features, s->sides);
  for (int level = 0; status == QMAT_OK && lists[level & 1].count > 0; level++) {
    const patch_list *from = &lists[level & 1];
    const double lo = result->either_side.lo;
    s->lo[0] = lo;
    s->lo[1] = result->outside.lo;
    for (int side = 0; side < 2; side++)
      s->target[side] =
          maximum(qmat_bound_target(s->lo[side], epsilon, tolerance), minimum(1, least_told * tolerance) * epsilon) -
          rounding;
    s->smallest = smallest_share * minimum(tolerated(lo, epsilon, tolerance), s->target[0] - lo);
    s->last = result->looks + 4 * from->count > most_looks;
    if (qmat_grow((void **)&findings, &capacity, from->count, sizeof *findings))
      status = qmat_fail_memory(context, "pieces of the envelope's boundary");
    if (status == QMAT_OK) status = search_level(context, s, from, &lists[1 - (level & 1)], findings, result);
  }
  qmat_free(lists[0].items);
  qmat_free(lists[1].items);
  qmat_free(findings);
  return status;
}

static qmat_bounds closed_bounds(qmat_bounds b) {
  return (qmat_bounds){b.lo, maximum(b.lo, b.hi) + rounding};
}

qmat_status qmat_boundary_distance_measure(qmat_context *context, const qmat_surface *surface,
                                           const qmat_envelope *envelope, const qmat_medial *unit, double epsilon,
                                           double tolerance, bool outside, size_t sample_count,
                                           qmat_boundary_distance *result) {
  *result = (qmat_boundary_distance){.sample_count = 0};
  features f;
  qmat_status status = join_features(context, unit, &f);
  if (status == QMAT_OK && feature_count(&f) > UINT32_MAX)
    status = qmat_fail_memory(context, "the envelope's boundary");
  if (status == QMAT_OK) status = sample_boundary(context, &f, surface, envelope, sample_count, result);
  search s = {.features = &f,
              .surface = surface,
              .envelope = envelope,
              .epsilon = epsilon,
              .sides = outside ? SIDES_EITHER | SIDES_OUT : SIDES_EITHER};
  if (status == QMAT_OK) status = search_pieces(context, &s, epsilon, tolerance, sample_count, result);
  result->either_side = closed_bounds(result->either_side);
  result->outside = closed_bounds(result->outside);
  return status;
}
