/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/envelope.h"
#include "core/geometry/frame.h"
#include "core/geometry/joint_weights.h"
#include "core/json_text.h"
#include "core/node.h"
#include "core/text.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/skin/envelope_surface.h"
#include "nodes/skin/flat_primitives.h"
#include "nodes/skin/skin_decimate.h"
#include "nodes/skin/skin_distance.h"
#include "nodes/skin/skin_joints.h"
#include "nodes/skin/skin_surface_cgal.h"
#include "nodes/skin/skin_topology.h"

/* The limit of balls for CGAL: so many may take 45 seconds. */
static const size_t MOST_BALLS = 3000;
/* In the unit frame: the spacing of balls is relative to their radius, but at least to the first. Balls smaller than
 * the second are left out. */
static const double SPACING_RADIUS = 2e-3, LEAST_BALL = 1e-6;

enum { METHOD_ENVELOPE, METHOD_SKIN_SURFACE };

/* Cells are halved at most so often. */
enum { MOST_DETAIL = 6 };

typedef struct medial_skin_params {
  int method;
  int64_t resolution, detail, subdivisions, triangles;
  double shrink, spacing, error;
} medial_skin_params;

/* Whether edges of the surface collapse, so that its error is one that was asked for. */
static bool is_decimated(const medial_skin_params *params) {
  return params->method == METHOD_ENVELOPE && params->error > 0;
}

typedef struct skin {
  qmat_context *context;
  const medial_skin_params *params;
  const qmat_medial *medial;
  const qmat_mesh *skinned; /* the surface with joints; NULL: none */
  qmat_medial solid, flat;  /* its slabs and cones with a positive radius, and the others; spheres in model units */
  qmat_frame frame;
  double *spheres;         /* in the unit frame */
  qmat_envelope *envelope; /* of `solid` */
  qmat_skin_triangles surface;
  qmat_envelope_grid grid;
  int detail;                    /* of the grid: less than asked for where that would be too many cells */
  size_t contour_triangle_count; /* before decimation */
  size_t joint_vertex_count;     /* added where joints change */
  qmat_skin_errors errors;
  double to_envelope, from_envelope; /* upper bounds of the distances between the mesh and the envelope */
  qmat_cell_mark *marks;             /* where cells are halved; freed at the end */
  size_t mark_count, mark_capacity;
  size_t ball_count;
} skin;

/* Spheres that are the end of an edge. */
static bool *joined_spheres(const qmat_medial *medial, qmat_arena *arena) {
  bool *joined = qmat_arena_calloc(arena, medial->sphere_count, sizeof *joined);
  for (size_t i = 0; joined && i < 2 * medial->edge_count; i++) joined[medial->edges[i]] = true;
  return joined;
}

/* The frame of the envelope itself: of every sphere that takes part in it. */
static qmat_status find_frame(skin *s) {
  const qmat_medial *medial = s->medial;
  if (medial->sphere_count == 0) {
    qmat_fail(s->context, QMAT_ERROR_GEOMETRY, "the medial mesh has no sphere");
    return qmat_fail_field(s->context, "medial");
  }
  const bool *joined = joined_spheres(medial, &s->context->arena);
  if (!joined) return qmat_fail_memory(s->context, "medial spheres");
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, largest = 0;
  const size_t flat_count = s->flat.triangle_count + s->flat.edge_count;
  for (size_t i = 0; i < medial->sphere_count; i++) {
    const double *sphere = medial->spheres + 4 * i;
    largest = fmax(largest, sphere[3]);
    if (!joined[i] && !(sphere[3] > 0)) continue;
    for (int k = 0; k < 3; k++) {
      low[k] = fmin(low[k], sphere[k] - sphere[3]);
      high[k] = fmax(high[k], sphere[k] + sphere[3]);
    }
  }
  if (!(largest > 0) && (flat_count == 0 || s->params->method != METHOD_ENVELOPE)) {
    qmat_fail(s->context, QMAT_ERROR_GEOMETRY, "every sphere has radius 0, so the medial mesh encloses nothing");
    return qmat_fail_field(s->context, "medial");
  }
  for (int k = 0; k < 3; k++) s->frame.centre[k] = 0.5 * low[k] + 0.5 * high[k];
  s->frame.diagonal = hypot(hypot(high[0] - low[0], high[1] - low[1]), high[2] - low[2]);
  if (!isfinite(s->frame.diagonal) || !isnormal(s->frame.diagonal)) {
    qmat_fail(s->context, QMAT_ERROR_GEOMETRY, "the medial mesh is too large or too small for double precision");
    return qmat_fail_field(s->context, "medial");
  }
  s->spheres = qmat_arena_alloc(&s->context->arena, 4 * medial->sphere_count, sizeof *s->spheres);
  if (!s->spheres) return qmat_fail_memory(s->context, "medial spheres");
  qmat_frame_spheres_to_unit(&s->frame, medial->spheres, medial->sphere_count, s->spheres);
  return QMAT_OK;
}

typedef struct ball_list {
  double *balls; /* 4 each */
  size_t count, capacity;
  double spacing;
  bool short_of_memory;
} ball_list;

/* Beyond this, removing duplicates and hidden balls cannot help. */
static bool full(const ball_list *list) {
  return list->short_of_memory || list->count > 16 * MOST_BALLS;
}

static void add_ball(ball_list *list, const double ball[4]) {
  if (!(ball[3] > LEAST_BALL)) return;
  if (qmat_grow((void **)&list->balls, &list->capacity, 4 * (list->count + 1), sizeof *list->balls)) {
    list->short_of_memory = true;
    return;
  }
  memcpy(list->balls + 4 * list->count++, ball, 4 * sizeof *ball);
}

static double squared_length(const double a[4], const double b[4]) {
  double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return x * x + y * y + z * z;
}

/* Whether two balls on a primitive are so close that their union approximates the primitive between them. */
static bool close_enough(const ball_list *list, const double a[4], const double b[4]) {
  double step = list->spacing * fmax(fmin(a[3], b[3]), SPACING_RADIUS);
  return squared_length(a, b) <= step * step;
}

/* Independent of the order of the ends, so that neighbours share their balls. */
static void middle(const double a[4], const double b[4], double m[4]) {
  for (int k = 0; k < 4; k++) m[k] = 0.5 * (a[k] + b[k]);
}

/* Balls between the ends of a cone. */
static void fill_cone(ball_list *list, const double a[4], const double b[4]) {
  if (full(list) || close_enough(list, a, b)) return;
  double m[4];
  middle(a, b, m);
  add_ball(list, m);
  fill_cone(list, a, m);
  fill_cone(list, m, b);
}

/* Balls between the corners of a slab: halves the longest side that is too long. */
static void fill_slab(ball_list *list, const double a[4], const double b[4], const double c[4]) {
  const double *corners[3] = {a, b, c};
  int longest = -1;
  double length2 = 0;
  for (int i = 0; i < 3 && !full(list); i++) {
    const double *p = corners[i], *q = corners[(i + 1) % 3];
    double side2 = squared_length(p, q);
    if (side2 <= length2 || close_enough(list, p, q)) continue;
    length2 = side2;
    longest = i;
  }
  if (longest < 0) return;
  const double *p = corners[longest], *q = corners[(longest + 1) % 3], *r = corners[(longest + 2) % 3];
  double m[4];
  middle(p, q, m);
  add_ball(list, m);
  fill_slab(list, p, m, r);
  fill_slab(list, m, q, r);
}

static int by_place(const void *left, const void *right) {
  const double *a = left, *b = right;
  for (int k = 0; k < 4; k++) {
    if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
  }
  return 0;
}

/* Removes duplicates and balls inside others. */
static qmat_status remove_hidden(skin *s, ball_list *list) {
  qsort(list->balls, list->count, 4 * sizeof *list->balls, by_place);
  size_t kept = 0;
  for (size_t i = 0; i < list->count; i++) {
    if (i > 0 && by_place(list->balls + 4 * i, list->balls + 4 * (i - 1)) == 0) continue;
    memmove(list->balls + 4 * kept++, list->balls + 4 * i, 4 * sizeof *list->balls);
  }
  list->count = kept;
  if (list->count > 4 * MOST_BALLS) return QMAT_OK; /* too many in any case */
  qmat_envelope *all;
  qmat_status status = qmat_envelope_new(s->context, list->balls, list->count, NULL, 0, NULL, 0, &all);
  if (status != QMAT_OK) return status;
  kept = 0;
  for (size_t i = 0; i < list->count && status == QMAT_OK; i++) {
    double *ball = list->balls + 4 * i;
    if (i % 256 == 0) status = qmat_progress(s->context, i, list->count, "balls");
    /* At its own centre a ball is the deepest, unless another ball contains it. */
    if (qmat_envelope_distance(all, ball, NULL) < -ball[3] * (1 + 1e-12)) continue;
    memmove(list->balls + 4 * kept++, ball, 4 * sizeof *ball);
  }
  list->count = kept;
  qmat_envelope_free(all);
  return status;
}

/* The paper's method. CGAL's skin surface takes balls only, so cones and slabs are filled with balls. */
static qmat_status make_skin_surface(skin *s) {
  ball_list list = {.spacing = s->params->spacing};
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < s->medial->sphere_count && !full(&list); i++) add_ball(&list, s->spheres + 4 * i);
  for (size_t i = 0; i < qmat_envelope_primitive_count(s->envelope) && !full(&list); i++) {
    uint32_t ids[3];
    int count = qmat_envelope_primitive(s->envelope, i, ids);
    const double *ends[3] = {NULL, NULL, NULL};
    for (int k = 0; k < count; k++) ends[k] = s->spheres + 4 * (size_t)ids[k];
    if (count == 2) fill_cone(&list, ends[0], ends[1]);
    if (count == 3) fill_slab(&list, ends[0], ends[1], ends[2]);
  }
  if (list.short_of_memory) status = qmat_fail_memory(s->context, "balls");
  if (status == QMAT_OK && !full(&list)) status = remove_hidden(s, &list);
  if (status == QMAT_OK && list.count > MOST_BALLS) {
    char spacing[32];
    qmat_format_number(list.spacing, spacing, sizeof spacing);
    qmat_fail(s->context, QMAT_ERROR_GEOMETRY, "spacing %s needs more than %zu balls, too many for a skin surface",
              spacing, MOST_BALLS);
    qmat_fail_hint(s->context, "a larger spacing, a simpler medial mesh, or qmat mat: --set skin.method=envelope");
    status = qmat_fail_field(s->context, "spacing");
  }
  if (status == QMAT_OK) status = qmat_progress(s->context, 0, list.count, "balls");
  if (status == QMAT_OK) {
    s->ball_count = list.count;
    status = qmat_skin_surface(s->context, list.balls, list.count, s->params->shrink, (int)s->params->subdivisions,
                               &s->surface);
  }
  qmat_free(list.balls);
  return status;
}

/* A contour of more cells is made with cells twice as large instead: the decimation would take long for shells that are
 * thin everywhere. */
enum { MOST_CONTOUR_CELLS = 300000 };
/* The share of the error that the contour may have. Crevices narrower than a cell fill, so that some need finer cells.
 */
static const double CONTOUR_SHARE = 0.3;
/* The multiple of the error that bending may add between the vertices of a skinned model: it is hardly seen, and less
 * takes many more vertices. */
static const double BEND_SHARE = 5;
/* So many contours are decimated, each with finer cells where the one before exceeds the error. */
enum { MOST_CONTOURS = 4 };
/* Beyond this multiple of the error the contour itself is too far, in crevices narrower than the finest cells. Only the
 * second contour is tried then. */
static const double HOPELESS_EXCESS = 1.5;

static void drop_triangles(qmat_skin_triangles *surface) {
  qmat_free(surface->positions);
  qmat_free(surface->triangles);
  *surface = (qmat_skin_triangles){.vertex_count = 0};
}

static qmat_status copy_triangles(skin *s, const qmat_skin_triangles *from, qmat_skin_triangles *to) {
  *to = (qmat_skin_triangles){from->vertex_count, from->triangle_count,
                              qmat_alloc(3 * from->vertex_count, sizeof *to->positions),
                              qmat_alloc(3 * from->triangle_count, sizeof *to->triangles)};
  if (!to->positions || !to->triangles) return qmat_fail_memory(s->context, "the skin");
  memcpy(to->positions, from->positions, 3 * from->vertex_count * sizeof *to->positions);
  memcpy(to->triangles, from->triangles, 3 * from->triangle_count * sizeof *to->triangles);
  return QMAT_OK;
}

/* Bounds both distances between the surface and the envelope; `far` gets the places beyond the error. */
static qmat_status bound_distance(skin *s, double error, qmat_skin_distance *far) {
  qmat_medial unit = s->solid;
  unit.spheres = s->spheres;
  const qmat_status status = qmat_skin_distance_measure(s->context, &unit, &s->surface, error, far);
  s->to_envelope = far->to_envelope;
  s->from_envelope = far->from_envelope;
  return status;
}

static void centroid_of(const qmat_skin_triangles *surface, size_t triangle, double centroid[3]) {
  for (int k = 0; k < 3; k++) centroid[k] = 0;
  for (size_t c = 0; c < 3; c++)
    for (size_t k = 0; k < 3; k++)
      centroid[k] += surface->positions[3 * (size_t)surface->triangles[3 * triangle + c] + k] / 3;
}

static double distance_of(const skin *s) {
  return fmax(s->to_envelope, s->from_envelope);
}

static qmat_status make_contour(skin *s, int detail, size_t most_cells, qmat_skin_triangles *surface,
                                qmat_envelope_grid *grid) {
  const qmat_cell_request request = {.spheres = s->spheres,
                                     .sphere_count = s->solid.sphere_count,
                                     .base = 1 / (double)s->params->resolution,
                                     .detail = detail,
                                     .marks = s->marks,
                                     .mark_count = s->mark_count,
                                     .most = most_cells};
  return qmat_envelope_surface(s->context, s->envelope, &request, surface, grid);
}

/* So many points are measured between two questions whether to go on. */
static const size_t MEASURED_SLICE = 1 << 15;

/* The largest |F| at the vertices and at the centroids of the triangles: the error of the mesh there. */
static qmat_status measure(skin *s, double *at_vertices, double *at_centroids) {
  const qmat_skin_triangles *surface = &s->surface;
  const int threads = qmat_threads(s->context);
  const size_t total = surface->vertex_count + surface->triangle_count;
  double vertices = 0, centroids = 0;
  for (size_t begin = 0; begin < total; begin += MEASURED_SLICE) {
    const size_t end = total - begin < MEASURED_SLICE ? total : begin + MEASURED_SLICE;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256) reduction(max : vertices, centroids)
    for (size_t i = begin; i < end; i++) {
      if (i < surface->vertex_count) {
        vertices = fmax(vertices, fabs(qmat_envelope_distance(s->envelope, surface->positions + 3 * i, NULL)));
        continue;
      }
      double centroid[3];
      centroid_of(surface, i - surface->vertex_count, centroid);
      centroids = fmax(centroids, fabs(qmat_envelope_distance(s->envelope, centroid, NULL)));
    }
    qmat_status status = qmat_progress(s->context, end, total, "measured points");
    if (status != QMAT_OK) return status;
  }
  *at_vertices = vertices;
  *at_centroids = centroids;
  return QMAT_OK;
}

/* Marks places where cells are to be halved `level` times. `points` has 3 doubles a place. */
static qmat_status mark_places(skin *s, const double *points, size_t count, int level) {
  if (qmat_grow((void **)&s->marks, &s->mark_capacity, s->mark_count + count, sizeof *s->marks))
    return qmat_fail_memory(s->context, "places far from the skin");
  for (size_t i = 0; i < count; i++) {
    qmat_cell_mark *mark = &s->marks[s->mark_count++];
    memcpy(mark->point, points + 3 * i, sizeof mark->point);
    mark->level = level;
  }
  return QMAT_OK;
}

/* Marks the triangles whose centroid is farther from the envelope than the share of the error. */
static qmat_status mark_far_triangles(skin *s, int level, size_t *far) {
  const qmat_skin_triangles *surface = &s->surface;
  const size_t count = surface->triangle_count;
  double *distances = qmat_alloc(count, sizeof *distances), centroid[3];
  const int threads = qmat_threads(s->context);
  *far = 0;
  if (!distances) return qmat_fail_memory(s->context, "places far from the skin");
  qmat_status status = QMAT_OK;
  for (size_t begin = 0; begin < count && status == QMAT_OK; begin += MEASURED_SLICE) {
    const size_t end = count - begin < MEASURED_SLICE ? count : begin + MEASURED_SLICE;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 256) private(centroid)
    for (size_t t = begin; t < end; t++) {
      centroid_of(surface, t, centroid);
      distances[t] = fabs(qmat_envelope_distance(s->envelope, centroid, NULL));
    }
    status = qmat_progress(s->context, end, count, "measured points");
  }
  for (size_t t = 0; t < count && status == QMAT_OK; t++) {
    if (!(distances[t] > CONTOUR_SHARE * s->params->error)) continue;
    centroid_of(surface, t, centroid);
    status = mark_places(s, centroid, 1, level);
    ++*far;
  }
  qmat_free(distances);
  return status;
}

/* Makes the contour again with the marks of now. It stays where no cell is halved, or where that is too much. */
static qmat_status make_finer_contour(skin *s, int detail, qmat_skin_triangles *contour, bool *is_finer) {
  qmat_skin_triangles finer;
  qmat_envelope_grid grid;
  *is_finer = false;
  if (2 * s->grid.cell_count > MOST_CONTOUR_CELLS) return QMAT_OK;
  const qmat_status status = make_contour(s, detail, MOST_CONTOUR_CELLS, &finer, &grid);
  if (status != QMAT_OK || grid.cell_count == s->grid.cell_count || grid.is_too_fine) {
    drop_triangles(&finer);
    return status;
  }
  drop_triangles(contour);
  *contour = finer;
  s->grid = grid;
  *is_finer = true;
  return QMAT_OK;
}

/* Halves cells where the contour is too far from the envelope, one step a round. */
static qmat_status refine_contour(skin *s, int detail) {
  bool is_finer = true;
  qmat_status status = QMAT_OK;
  for (int level = 1; level <= detail && is_finer && status == QMAT_OK; level++) {
    size_t far;
    status = mark_far_triangles(s, level, &far);
    if (status != QMAT_OK || far == 0) break;
    status = make_finer_contour(s, detail, &s->surface, &is_finer);
  }
  return status;
}

/* Decimates a copy of the contour, and bounds the errors of what is left, which becomes the surface. `far` gets the
 * places beyond the error; free it with qmat_skin_distance_uninit, also after a failure. */
static qmat_status decimate_copy(skin *s, const qmat_skin_triangles *contour, qmat_skin_distance *far) {
  const medial_skin_params *p = s->params;
  const size_t most = (size_t)p->triangles, spared = s->skinned ? most / 3 : 0; /* for bending */
  *far = (qmat_skin_distance){0};
  drop_triangles(&s->surface);
  qmat_status status = copy_triangles(s, contour, &s->surface);
  if (status == QMAT_OK)
    status = qmat_skin_decimate(s->context, s->envelope, p->error, most - spared, &s->surface, &s->errors);
  return status == QMAT_OK ? bound_distance(s, p->error, far) : status;
}

/* Makes the contour again with the finest cells at the places. */
static qmat_status refine_places(skin *s, const qmat_skin_distance *far, int detail, qmat_skin_triangles *contour,
                                 bool *is_finer) {
  *is_finer = false;
  const qmat_status status = mark_places(s, far->far_points, far->far_count, detail);
  return status == QMAT_OK && far->far_count > 0 ? make_finer_contour(s, detail, contour, is_finer) : status;
}

/* Whether finer cells may bring the surface within the error. */
static bool may_come_closer(const skin *s, int attempt) {
  return attempt == 1 || (attempt < MOST_CONTOURS && distance_of(s) <= HOPELESS_EXCESS * s->params->error);
}

/* Decimates the contour. Where the result exceeds the error, the contour gets the finest cells. */
static qmat_status decimate_contour(skin *s, int detail) {
  qmat_skin_triangles contour = s->surface;
  qmat_status status = QMAT_OK;
  s->surface = (qmat_skin_triangles){.vertex_count = 0};
  bool exceeds = true, is_finer = true;
  for (int attempt = 1; status == QMAT_OK && exceeds && is_finer; attempt++) {
    qmat_skin_distance far;
    s->contour_triangle_count = contour.triangle_count;
    status = decimate_copy(s, &contour, &far);
    exceeds = s->params->triangles == 0 && distance_of(s) > s->params->error;
    is_finer = false;
    if (status == QMAT_OK && exceeds && may_come_closer(s, attempt))
      status = refine_places(s, &far, detail, &contour, &is_finer);
    qmat_skin_distance_uninit(&far);
  }
  drop_triangles(&contour);
  return status;
}

static qmat_status make_envelope_surface(skin *s) {
  const medial_skin_params *p = s->params;
  qmat_status status = QMAT_OK;
  int detail = (int)p->detail;
  for (;; detail--) {
    const bool may_be_coarser = detail > 0 && p->error > 0;
    status = make_contour(s, detail, may_be_coarser ? MOST_CONTOUR_CELLS : SIZE_MAX, &s->surface, &s->grid);
    if (status != QMAT_OK || !s->grid.is_too_fine) break;
  }
  s->detail = detail;
  s->contour_triangle_count = s->surface.triangle_count;
  if (status == QMAT_OK && p->error > 0) status = refine_contour(s, detail);
  return status == QMAT_OK && p->error > 0 ? decimate_contour(s, detail) : status;
}

/* A larger `detail` that may bring the mesh closer; 0: none. */
static int finer_detail(const skin *s) {
  const int given = (int)s->params->detail;
  if (s->detail < given || given == MOST_DETAIL || 2 * s->grid.cell_count > MOST_CONTOUR_CELLS) return 0;
  return given + 2 < MOST_DETAIL ? given + 2 : MOST_DETAIL;
}

/* Says that the mesh has more triangles, or is farther from the envelope, than it should. Nonzero when memory is
 * short. */
static int add_warning(const skin *s, json_t *root) {
  const int64_t most = s->params->triangles, count = (int64_t)s->surface.triangle_count;
  if (most > 0 && count > most)
    return qmat_json_add_warning(root,
                                 "the visible mesh has %lld triangles, not %lld: fewer would turn over, or change "
                                 "its topology",
                                 (long long)count, (long long)most);
  if (most > 0 || distance_of(s) <= s->params->error) return 0;
  char distance[48], advice[48] = "";
  const int detail = finer_detail(s);
  qmat_format_bound(distance_of(s), distance);
  if (detail > 0) snprintf(advice, sizeof advice, "; a finer one: --set skin.detail=%d", detail);
  return qmat_json_add_warning(root, "the visible mesh is up to %s of the diagonal from the envelope, not %.2g %%%s",
                               distance, 100 * s->params->error, advice);
}

/* Bounds the distances of a surface for which no error was asked, as sharply as for one of the largest distance found:
 * that is in proportion to the mesh's own error. */
static qmat_status bound_undecimated(skin *s, double largest) {
  static const double least = 1e-6;
  if (is_decimated(s->params) || s->surface.triangle_count == 0) return QMAT_OK;
  qmat_skin_distance far;
  const qmat_status status = bound_distance(s, fmax(largest, least), &far);
  qmat_skin_distance_uninit(&far);
  return status;
}

static qmat_status fill_report(skin *s, qmat_report *report) {
  const qmat_skin_triangles *surface = &s->surface;
  size_t components = 0;
  int64_t euler = 0;
  double at_vertices = 0, at_centroids = 0;
  qmat_status status = qmat_skin_topology(s->context, surface->triangles, surface->triangle_count,
                                          surface->vertex_count, &components, &euler);
  if (status == QMAT_OK) status = measure(s, &at_vertices, &at_centroids);
  if (status == QMAT_OK) status = bound_undecimated(s, fmax(at_vertices, at_centroids));
  if (status != QMAT_OK) return status;
  json_int_t vertices = (json_int_t)surface->vertex_count, triangles = (json_int_t)surface->triangle_count;
  bool envelope = s->params->method == METHOD_ENVELOPE;
  json_t *root = json_pack("{s:s, s:I, s:I, s:I, s:I, s:f, s:f, s:f, s:f, s:f, s:I, s:I}", "method",
                           envelope ? "envelope" : "skin_surface", "vertices", vertices, "triangles", triangles,
                           "components", (json_int_t)components, "euler_characteristic", (json_int_t)euler, "diagonal",
                           s->frame.diagonal, "error_at_vertices", at_vertices, "error_at_centroids", at_centroids,
                           "mesh_to_envelope", s->to_envelope, "envelope_to_mesh", s->from_envelope, "flat_slabs",
                           (json_int_t)s->flat.triangle_count, "flat_cones", (json_int_t)s->flat.edge_count);
  json_t *details = envelope
                        ? json_pack("{s:f, s:f, s:f, s:I, s:I, s:f, s:I}", "cell_size", s->grid.base, "cell_size_model",
                                    s->grid.base * s->frame.diagonal, "finest_cell_size", s->grid.finest, "cells",
                                    (json_int_t)s->grid.cell_count, "refined_cells",
                                    (json_int_t)s->grid.refined_cell_count, "smallest_radius", s->grid.smallest_radius,
                                    "raised_radii", (json_int_t)s->grid.raised_sphere_count)
                        : json_pack("{s:I}", "balls", (json_int_t)s->ball_count);
  if (details && is_decimated(s->params)) {
    json_t *decimated =
        json_pack("{s:I, s:f, s:f}", "contour_triangles", (json_int_t)s->contour_triangle_count, "error_at_samples",
                  s->errors.to_envelope, "error_from_contour", s->errors.from_original);
    if (!decimated || json_object_update(details, decimated) || add_warning(s, report->root))
      status = qmat_fail_memory(s->context, "the report");
    json_decref(decimated);
  }
  if (details && s->skinned && is_decimated(s->params) &&
      json_object_set_new(details, "joint_vertices", json_integer((json_int_t)s->joint_vertex_count)) != 0)
    status = qmat_fail_memory(s->context, "the report");
  if (!root || !details || json_object_update(report->root, root) || json_object_update(report->root, details))
    status = qmat_fail_memory(s->context, "the report");
  json_decref(root);
  json_decref(details);
  return status;
}

static bool has_volume(const skin *s) {
  for (size_t i = 0; i < s->medial->sphere_count; i++)
    if (s->medial->spheres[4 * i + 3] > 0) return true;
  return false;
}

/* The surface of all that has a volume. */
static qmat_status make_closed_surface(skin *s) {
  const qmat_medial *solid = &s->solid;
  const medial_skin_params *params = s->params;
  const qmat_status status =
      qmat_envelope_new(s->context, s->spheres, solid->sphere_count, solid->edges, solid->edge_count, solid->triangles,
                        solid->triangle_count, &s->envelope);
  if (status != QMAT_OK) return status;
  if (params->method != METHOD_ENVELOPE) return make_skin_surface(s);
  return make_envelope_surface(s);
}

/* Decimation leaves long edges on straight limbs, which could not bend. */
static qmat_status divide_at_joints(skin *s) {
  if (!s->skinned || !is_decimated(s->params)) return QMAT_OK;
  const size_t before = s->surface.vertex_count;
  const qmat_status status = qmat_skin_divide_at_joints(
      s->context, s->skinned, &s->frame, BEND_SHARE * s->params->error, (size_t)s->params->triangles, &s->surface);
  s->joint_vertex_count += s->surface.vertex_count - before;
  return status;
}

static qmat_status run(qmat_context *context, const void *raw_params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const medial_skin_params *params = raw_params;
  const qmat_mesh *model = (const qmat_mesh *)inputs[1];
  skin s = {.context = context, .params = params, .medial = (const qmat_medial *)inputs[0]};
  if (model && model->skinned_count > 0 && model->triangle_count > 0) s.skinned = model;
  qmat_mesh *mesh = qmat_mesh_new();
  qmat_report *report = qmat_report_new();
  qmat_status status = mesh && report ? QMAT_OK : qmat_fail_memory(context, "the skin");
  if (status == QMAT_OK) status = qmat_flat_primitives_separate(context, s.medial, &s.solid, &s.flat);
  if (status == QMAT_OK) status = find_frame(&s);
  if (status == QMAT_OK && has_volume(&s)) status = make_closed_surface(&s);
  if (status == QMAT_OK) status = divide_at_joints(&s);
  if (status == QMAT_OK) status = fill_report(&s, report);
  if (status == QMAT_OK)
    status = qmat_flat_primitives_append(context, &s.flat, s.spheres,
                                         ldexp(1 / (double)params->resolution, -(int)params->detail), &s.surface);
  if (status == QMAT_OK && s.flat.triangle_count > 0) status = divide_at_joints(&s);
  if (status == QMAT_OK) {
    qmat_frame_to_model(&s.frame, s.surface.positions, s.surface.vertex_count, s.surface.positions);
    mesh->vertex_count = s.surface.vertex_count;
    mesh->triangle_count = s.surface.triangle_count;
    mesh->positions = s.surface.positions;
    mesh->triangles = s.surface.triangles;
    mesh->closed = s.flat.triangle_count == 0;
    mesh->oriented = true;
    mesh->deviation = s.frame.diagonal * distance_of(&s);
    s.surface = (qmat_skin_triangles){0};
    if (s.skinned) status = qmat_joints_of_surface(context, s.skinned, mesh);
  }
  drop_triangles(&s.surface);
  qmat_free(s.marks);
  qmat_envelope_free(s.envelope);
  return qmat_hand_over(context, status, (qmat_value *[]){(qmat_value *)mesh, (qmat_value *)report}, 2, outputs);
}

/* Without an error there is no decimation, so that a number of triangles would do nothing. */
static qmat_status check(qmat_context *context, const void *raw_params) {
  const medial_skin_params *p = raw_params;
  if (p->method != METHOD_ENVELOPE || p->triangles == 0 || p->error > 0) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "triangles %lld needs an error above 0: with error 0 the mesh is not decimated",
            (long long)p->triangles);
  qmat_fail_hint(context, "the number of triangles comes before the error, so that any error will do");
  return qmat_fail_field(context, "triangles");
}

static const char *const methods[] = {"envelope", "skin_surface", NULL};

static const qmat_param params[] = {
    QMAT_ENUM(medial_skin_params, method, methods, METHOD_ENVELOPE,
              "The envelope of spheres, cones and slabs, or CGAL's skin surface of balls that fill it"),
    QMAT_INT(medial_skin_params, resolution, "cells", 96, 8, 2048,
             "envelope: largest cells along the diagonal of the envelope's bounding box"),
    QMAT_INT(medial_skin_params, detail, "halvings", 4, 0, MOST_DETAIL,
             "envelope: cells are halved up to this many times where medial radii are small or crevices narrow; less "
             "often where that makes more than 300,000 cells"),
    QMAT_LENGTH(medial_skin_params, error, 2e-3, 0, 0.1,
                "envelope: the distance from the envelope that the mesh may have; 0: no decimation"),
    QMAT_INT(
        medial_skin_params, triangles, "triangles", 0, 0, 100000000,
        "envelope: at most so many, though the distance then exceeds error, which has to be above 0; 0: as many as "
        "error needs"),
    QMAT_FLOAT(medial_skin_params, shrink, "1", 0.5, 0.05, 0.95,
               "skin_surface: near 1 the union of the balls, near 0 smoother and fuller between them"),
    QMAT_FLOAT(medial_skin_params, spacing, "radius", 0.75, 0.02, 10,
               "skin_surface: the largest step between balls along cones and slabs, relative to their radius"),
    QMAT_INT(medial_skin_params, subdivisions, "steps", 0, 0, 4,
             "skin_surface: refinement steps of the mesh; each makes four times as many triangles"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "A medial mesh"},
    {.name = "mesh",
     .type = QMAT_MESH,
     .doc = "The surface that it describes: where that has joints, the mesh gets them",
     .optional = true},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "Its surface: closed and oriented, with normals outwards"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Counts, topology, and the distance from the mesh to the envelope"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_cgal, &qmat_library_embree, &qmat_library_meshoptimizer,
                                                NULL};

const qmat_node qmat_node_medial_skin = {
    .name = "medial.skin",
    .version = 21,
    .summary = "Gives a medial mesh a surface",
    .doc =
        "The method envelope meshes the boundary of the spheres, cones and slabs by dual contouring of their exact "
        "signed distance. Only cells that the surface crosses are visited. They are halved where medial radii are "
        "small, so that thin parts neither vanish nor break. Radii below 0.9 of the finest cell are raised to that; "
        "the report counts them. The mesh is a closed 2-manifold. Crevices narrower than a cell fill: cells are halved "
        "where that makes more than a third of `error`, up to `detail` times. The mesh is then thinned out "
        "(meshoptimizer), slivers are flipped, and edges are collapsed (CGAL) as far as `error` and the topology "
        "allow. Both distances between the mesh and the envelope are bounded at the end "
        "(mesh_to_envelope, envelope_to_mesh), files state the larger, and a warning says when it exceeds `error`.\n\n"
        "Slabs of radius zero, the sheets, are added as two triangles each, one a side, and loose cones of radius zero "
        "as prisms of three sides; those of length zero are left out. The counts and distances of the report are "
        "without them.\n\n"
        "Of a skinned model, whose surface is the input mesh, each vertex gets the joints and weights of the nearest "
        "point of it. Where weights change along an edge, a decimated mesh is divided without moving it, so that it "
        "bends; the report counts the vertices (joint_vertices). Of a number of triangles, a third is for that.\n\n"
        "The method skin_surface is the paper's: CGAL's skin surface, which takes balls only. Cones and slabs are "
        "filled with balls first. It takes 3 to 15 milliseconds a ball. Its distances are bounded, too.\n\n"
        "The report has the largest distance from the envelope at vertices and at triangle centroids. For a decimated "
        "mesh it has that at 15 points of each triangle, too (error_at_samples), and that from the vertices before "
        "edges collapse to the mesh (error_from_contour). All are fractions of the diagonal of the envelope's bounding "
        "box.",
    .citation =
        "Section 3.1.1; Ju et al. 2002, Dual contouring of Hermite data; Nielson 2004, Dual marching cubes; "
        "Edelsbrunner 1999, Deformable smooth surface design",
    .params_size = sizeof(medial_skin_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .effort = 6,
    .check = check,
    .run = run,
};
