/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_shape.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

/* The shapes, with the sizes that their schemas give them. A size that a shape lacks is 0. */
typedef enum kind { SPHERE, CUBE, CYLINDER, CYLINDER_1, CONE, CAPSULE, CAPSULE_1, PLANE, KIND_COUNT } kind;

enum { MOST_SIZES = 3 };

static const struct {
  const char *type;
  struct {
    const char *name;
    double usual;
  } sizes[MOST_SIZES];
} shapes[KIND_COUNT] = {
    [SPHERE] = {"Sphere", {{"radius", 1}}},
    [CUBE] = {"Cube", {{"size", 2}}},
    [CYLINDER] = {"Cylinder", {{"height", 2}, {"radius", 1}}},
    [CYLINDER_1] = {"Cylinder_1", {{"height", 2}, {"radiusBottom", 1}, {"radiusTop", 1}}},
    [CONE] = {"Cone", {{"height", 2}, {"radius", 1}}},
    [CAPSULE] = {"Capsule", {{"height", 1}, {"radius", 0.5}}},
    [CAPSULE_1] = {"Capsule_1", {{"height", 1}, {"radiusBottom", 0.5}, {"radiusTop", 0.5}}},
    [PLANE] = {"Plane", {{"width", 2}, {"length", 2}}},
};

static size_t kind_of(const char *type) {
  size_t found = 0;
  while (found < KIND_COUNT && strcmp(type, shapes[found].type) != 0) found++;
  return found;
}

bool qmat_usd_is_shape(const char *type) {
  return kind_of(type) < KIND_COUNT;
}

/* A mesh that is being made: its arrays have room. */
typedef struct maker {
  double *points;
  int64_t *counts, *indices;
  size_t point_count, face_count, index_count;
  int axes[3]; /* the coordinates of a point of the shape along its own x, y and z; the axis is z */
} maker;

static int64_t add_point(maker *m, double x, double y, double z) {
  double *point = m->points + 3 * m->point_count;
  point[m->axes[0]] = x;
  point[m->axes[1]] = y;
  point[m->axes[2]] = z;
  return (int64_t)m->point_count++;
}

static void add_face(maker *m, const int64_t *corners, size_t count) {
  memcpy(m->indices + m->index_count, corners, count * sizeof *corners);
  m->index_count += count;
  m->counts[m->face_count++] = (int64_t)count;
}

/* Revolves a profile of (radius, z), upward; its first and last radius are 0. */
static void revolve(maker *m, const double (*profile)[2], size_t count, size_t segments) {
  int64_t below = add_point(m, 0, 0, profile[0][1]);
  for (size_t row = 1; row < count; row++) {
    const bool from_pole = row == 1, to_pole = row + 1 == count;
    const int64_t above = (int64_t)m->point_count;
    for (size_t i = 0; i < (to_pole ? 1 : segments); i++) {
      const double angle = 2 * QMAT_PI * (double)i / (double)segments, radius = profile[row][0];
      add_point(m, radius * cos(angle), radius * sin(angle), profile[row][1]);
    }
    for (size_t i = 0; i < segments; i++) {
      const int64_t a = (int64_t)i, b = (int64_t)((i + 1) % segments);
      if (from_pole) {
        add_face(m, (const int64_t[]){below, above + b, above + a}, 3);
      } else if (to_pole) {
        add_face(m, (const int64_t[]){below + a, below + b, above}, 3);
      } else {
        add_face(m, (const int64_t[]){below + a, below + b, above + b, above + a}, 4);
      }
    }
    below = above;
  }
}

/* Adds a point of the profile; none where it is the last one again. */
static size_t add_row(double (*profile)[2], size_t count, double radius, double z) {
  if (count > 0 && profile[count - 1][0] == radius && profile[count - 1][1] == z) return count;
  profile[count][0] = radius;
  profile[count][1] = z;
  return count + 1;
}

/* Adds a quarter of a circle about (0, z): from the pole below to the rim, or with `falling` from the rim to the pole
 * above. */
static size_t add_quarter(double (*profile)[2], size_t count, double radius, double z, size_t steps, bool falling) {
  for (size_t i = 0; i <= steps; i++) {
    const size_t step = falling ? i : steps - i; /* from the rim */
    const double angle = 0.5 * QMAT_PI * (double)step / (double)steps;
    const double along = step == steps ? radius : radius * sin(angle);
    count = add_row(profile, count, step == steps ? 0 : radius * cos(angle), falling ? z + along : z - along);
  }
  return count;
}

/* The profile of a shape that is round about its axis. */
static size_t make_profile(kind kind, const double *sizes, size_t segments, double (*profile)[2]) {
  const double bottom = -0.5 * sizes[0], top = 0.5 * sizes[0];
  const size_t steps = segments / 4;
  size_t count = 0;
  if (kind == SPHERE) {
    count = add_quarter(profile, count, sizes[0], 0, steps, false);
    return add_quarter(profile, count, sizes[0], 0, steps, true);
  }
  const double below = sizes[1], above = kind == CONE ? 0 : sizes[shapes[kind].sizes[2].name ? 2 : 1];
  if (kind == CAPSULE || kind == CAPSULE_1) {
    count = add_quarter(profile, count, below, bottom, steps, false);
    return add_quarter(profile, count, above, top, steps, true);
  }
  count = add_row(profile, count, 0, bottom);
  count = add_row(profile, count, below, bottom);
  count = add_row(profile, count, above, top);
  return add_row(profile, count, 0, top);
}

static void make_cube(maker *m, double size) {
  static const int64_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                      {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  const double half = 0.5 * size;
  for (int i = 0; i < 8; i++) add_point(m, i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half);
  for (int i = 0; i < 6; i++) add_face(m, faces[i], 4);
}

/* The width of a plane across x is along z, and the length of one across y. */
static void make_plane(maker *m, double width, double length, char axis) {
  const double w = 0.5 * width, l = 0.5 * length;
  static const double corners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (int i = 0; i < 4; i++) {
    const double across = w * corners[i][0], along = l * corners[i][1];
    double *point = m->points + 3 * m->point_count++;
    point[0] = axis == 'X' ? 0 : across;
    point[1] = axis == 'Y' ? 0 : along;
    point[2] = axis == 'X' ? across : axis == 'Y' ? along : 0;
  }
  /* Counter-clockwise about the axis. */
  add_face(m, axis == 'Z' ? (const int64_t[]){0, 1, 2, 3} : (const int64_t[]){3, 2, 1, 0}, 4);
}

static qmat_status read_size(const qmat_usd_prim *prim, const char *name, double usual, double *size) {
  const qmat_usd_value *value;
  const qmat_status status = qmat_usd_prim_attribute(prim, name, &value);
  *size = usual;
  if (status != QMAT_OK || !value) return status;
  *size = qmat_usd_number(value, NAN);
  return isfinite(*size) ? QMAT_OK : qmat_usd_prim_fail(prim, "%s must be one finite number", name);
}

/* Reads the sizes. `*flat` becomes the name of a size that is not above zero, where the shape then has no volume. */
static qmat_status read_sizes(const qmat_usd_prim *prim, kind kind, double *sizes, const char **flat) {
  const bool has_two_radii = shapes[kind].sizes[2].name != NULL, is_capsule = kind == CAPSULE || kind == CAPSULE_1;
  qmat_status status = QMAT_OK;
  *flat = NULL;
  for (size_t i = 0; i < MOST_SIZES && shapes[kind].sizes[i].name && status == QMAT_OK; i++) {
    status = read_size(prim, shapes[kind].sizes[i].name, shapes[kind].sizes[i].usual, &sizes[i]);
    /* A capsule without height is a sphere, and a cylinder of two radii may taper to a point. */
    const bool may_be_zero = i == 0 ? is_capsule : has_two_radii;
    if (may_be_zero ? !(sizes[i] >= 0) : !(sizes[i] > 0)) *flat = shapes[kind].sizes[i].name;
  }
  if (has_two_radii && sizes[1] == 0 && sizes[2] == 0) *flat = shapes[kind].sizes[1].name;
  return status;
}

qmat_status qmat_usd_shape_read(const qmat_usd_prim *prim, const char *type, qmat_usd_shape *shape) {
  const char *word, *flat;
  *shape = (qmat_usd_shape){.kind = kind_of(type)};
  qmat_status status = read_sizes(prim, (enum kind)shape->kind, shape->sizes, &flat);
  if (status == QMAT_OK) status = qmat_usd_prim_token(prim, "axis", "Z", &word);
  if (status != QMAT_OK) return status;
  shape->axis = word[0];
  if (strlen(word) != 1 || word[0] < 'X' || word[0] > 'Z')
    return qmat_usd_prim_fail(prim, "axis is '%.40s', which is unknown", qmat_usd_shown(word));
  shape->is_flat = flat != NULL;
  return flat ? qmat_usd_warn(prim, "left out: the %s of this %s is not above zero", flat, type) : QMAT_OK;
}

qmat_status qmat_usd_shape_digest(const qmat_usd_shape *shape, qmat_digest *digest) {
  const double numbers[] = {(double)shape->kind, shape->sizes[0], shape->sizes[1], shape->sizes[2], shape->axis};
  return qmat_digest_of(numbers, sizeof numbers, digest);
}

/* A value of `count` elements in `arena`; NULL when memory is short. */
static qmat_usd_value *new_value(qmat_arena *arena, qmat_usd_type type, uint8_t components, size_t most) {
  qmat_usd_value *value = qmat_arena_calloc(arena, 1, sizeof *value);
  void *elements = qmat_arena_alloc(arena, most, 8 * (size_t)components);
  if (!value || !elements) return NULL;
  *value = (qmat_usd_value){.type = type, .is_array = true, .components = components};
  if (type == QMAT_USD_INT64)
    value->integers = elements;
  else
    value->numbers = elements;
  return value;
}

bool qmat_usd_shape_mesh(const qmat_usd_shape *shape, size_t segments, qmat_arena *arena, qmat_usd_mesh *mesh) {
  const kind kind = (enum kind)shape->kind;
  const double *sizes = shape->sizes;
  *mesh = (qmat_usd_mesh){.scheme = QMAT_SCHEME_NONE, .boundary = QMAT_BOUNDARY_EDGE_AND_CORNER};
  segments = (segments + 3) / 4 * 4;
  const size_t rows = segments / 2 + 3, most_faces = kind == CUBE || kind == PLANE ? 8 : rows * segments;
  double(*profile)[2] = qmat_arena_alloc(arena, rows, sizeof *profile);
  qmat_usd_value *points = new_value(arena, QMAT_USD_DOUBLE, 3, most_faces),
                 *counts = new_value(arena, QMAT_USD_INT64, 1, most_faces),
                 *indices = new_value(arena, QMAT_USD_INT64, 4, most_faces);
  if (!profile || !points || !counts || !indices) return false;
  maker m = {.points = (double *)(uintptr_t)points->numbers,
             .counts = (int64_t *)(uintptr_t)counts->integers,
             .indices = (int64_t *)(uintptr_t)indices->integers};
  for (int k = 0; k < 3; k++)
    m.axes[k] = (shape->axis - 'X' + 1 + k) % 3; /* turned about the diagonal: z to the axis */
  if (kind == CUBE) {
    make_cube(&m, sizes[0]);
  } else if (kind == PLANE) {
    make_plane(&m, sizes[0], sizes[1], shape->axis);
  } else {
    const size_t count = make_profile(kind, sizes, segments, profile);
    revolve(&m, (const double(*)[2])profile, count, segments);
    const double radius = kind == SPHERE ? sizes[0] : fmax(sizes[1], sizes[2]),
                 sine = sin(0.5 * QMAT_PI / (double)segments);
    /* The sagitta of a chord, of circles about the axis and of round profiles. */
    const bool is_round = kind == SPHERE || kind == CAPSULE || kind == CAPSULE_1;
    mesh->deviation = (is_round ? 4 : 2) * radius * sine * sine;
  }
  points->count = m.point_count;
  counts->count = m.face_count;
  indices->count = m.index_count;
  indices->components = 1;
  mesh->points = points;
  mesh->counts = counts;
  mesh->indices = indices;
  return true;
}
