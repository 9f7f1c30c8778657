/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/robot_write.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "core/text.h"
#include "io/bytes.h"
#include "io/collider_frames.h"

enum { LONGEST_NAME = 100, STL_HEADER = 80 };

typedef struct output {
  qmat_writer writer;
  const qmat_colliders *colliders;
  char name[LONGEST_NAME + 1];
  double unit;
} output;

static void set_name(const char *name, char made[LONGEST_NAME + 1]) {
  size_t length = 0;
  if (!name || !*name) name = "model";
  for (; *name && length < LONGEST_NAME; name++) {
    const char c = *name;
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    if ((c & 0xC0) == 0x80) continue; /* one underscore for each character */
    made[length++] = plain ? c : '_';
  }
  made[length] = '\0';
}

/* Text with %s for the name and %z for the number of the shape, from 1. */
static void put(output *o, const char *text, size_t shape) {
  char number[24];
  for (; *text; text++) {
    if (*text != '%') {
      qmat_put_bytes(&o->writer, text, 1);
    } else if (*++text == 's') {
      qmat_put_text(&o->writer, o->name);
    } else {
      snprintf(number, sizeof number, "%02zu", shape + 1);
      qmat_put_text(&o->writer, number);
    }
  }
}

static void put_numbers(output *o, const double *numbers, size_t count, double factor) {
  for (size_t i = 0; i < count; i++) {
    if (i > 0) qmat_put_text(&o->writer, " ");
    qmat_put_number(&o->writer, factor * numbers[i]);
  }
}

static void range_of(const qmat_colliders *c, size_t shape, size_t points[2], size_t rows[2]) {
  points[0] = shape > 0 ? c->hull_ends[2 * shape - 2] : 0;
  points[1] = c->hull_ends[2 * shape];
  rows[0] = shape > 0 ? c->hull_ends[2 * shape - 1] : 0;
  rows[1] = c->hull_ends[2 * shape + 1];
}

static bool is_sphere(const qmat_colliders *c, size_t shape) {
  return qmat_collider_width(&c->shapes[3 * shape]) == 1;
}

static const double *sphere_of(const qmat_colliders *c, size_t shape, int corner) {
  return &c->spheres[4 * (size_t)c->shapes[3 * shape + (size_t)corner]];
}

/* ---- URDF ---- */

/* Single precision is too coarse for a hull that is farther from zero than this many times its size. */
static const double farthest = 1000;

/* The origin of the coordinates of a hull in STL: zero, or far from it one of its points. */
static void find_origin(const qmat_colliders *c, size_t shape, double origin[3]) {
  size_t points[2], rows[2];
  range_of(c, shape, points, rows);
  const double *first = &c->points[3 * points[0]];
  double size = 0, distance = 0;
  for (size_t i = points[0]; i < points[1]; i++)
    size = qmat_larger(size, qmat_point_distance(first, &c->points[3 * i]));
  for (int k = 0; k < 3; k++) distance = qmat_larger(distance, fabs(first[k]));
  for (int k = 0; k < 3; k++) origin[k] = distance > farthest * size ? first[k] : 0;
}

/* A hull as binary STL. */
static void put_stl(qmat_writer *writer, const qmat_colliders *c, size_t shape, double unit) {
  static const char header[STL_HEADER] = "qmat " QMAT_VERSION;
  size_t points[2], rows[2];
  double origin[3];
  range_of(c, shape, points, rows);
  find_origin(c, shape, origin);
  qmat_put_bytes(writer, header, sizeof header);
  qmat_put_u32(writer, (uint32_t)(rows[1] - rows[0]));
  for (size_t t = rows[0]; t < rows[1]; t++) {
    const double *corners[3];
    double u[3], v[3], normal[3];
    for (int k = 0; k < 3; k++) corners[k] = &c->points[3 * (size_t)c->triangles[3 * t + (size_t)k]];
    qmat_subtract(corners[1], corners[0], u);
    qmat_subtract(corners[2], corners[0], v);
    qmat_cross(u, v, normal);
    qmat_normalize(normal);
    for (int k = 0; k < 3; k++) qmat_put_f32(writer, (float)normal[k]);
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 3; k++) qmat_put_f32(writer, (float)(unit * (corners[i][k] - origin[k])));
    qmat_put_u16(writer, 0);
  }
}

static void put_urdf(output *o) {
  static const char *const names[] = {"\" iyy=\"", "\" izz=\"", "\" ixy=\"", "\" ixz=\"", "\" iyz=\""};
  const qmat_colliders *c = o->colliders;
  put(o, "<?xml version=\"1.0\"?>\n<robot name=\"%s\">\n  <link name=\"%s\">\n", 0);
  if (c->body_count > 0) {
    put(o, "    <inertial>\n      <origin xyz=\"", 0);
    put_numbers(o, &c->body[1], 3, o->unit);
    put(o, "\" rpy=\"0 0 0\"/>\n      <mass value=\"", 0);
    put_numbers(o, c->body, 1, 1);
    put(o, "\"/>\n      <inertia ixx=\"", 0);
    for (int k = 0; k < 6; k++) {
      if (k > 0) put(o, names[k - 1], 0);
      put_numbers(o, &c->body[4 + k], 1, o->unit * o->unit);
    }
    put(o, "\"/>\n    </inertial>\n", 0);
  }
  for (size_t i = 0; i < c->shape_count; i++) {
    const double *sphere = sphere_of(c, i, 0);
    put(o, "    <collision name=\"%s_%z\">\n      <origin xyz=\"", i);
    if (is_sphere(c, i)) {
      put_numbers(o, sphere, 3, o->unit);
      put(o, "\" rpy=\"0 0 0\"/>\n      <geometry>\n        <sphere radius=\"", i);
      put_numbers(o, &sphere[3], 1, o->unit);
    } else {
      double origin[3];
      find_origin(c, i, origin);
      put_numbers(o, origin, 3, o->unit);
      put(o, "\" rpy=\"0 0 0\"/>\n      <geometry>\n        <mesh filename=\"%s_hull_%z.stl", i);
    }
    put(o, "\"/>\n      </geometry>\n    </collision>\n", i);
  }
  put(o, "  </link>\n</robot>\n", 0);
}

/* ---- MJCF ---- */

/* Whether MJCF has the shape: a sphere, or a capsule of one radius. */
static bool is_plain(const qmat_colliders *c, size_t shape) {
  return is_sphere(c, shape) ||
         (qmat_collider_width(&c->shapes[3 * shape]) == 2 && sphere_of(c, shape, 0)[3] == sphere_of(c, shape, 1)[3]);
}

static void put_mjcf(output *o) {
  const qmat_colliders *c = o->colliders;
  put(o, "<mujoco model=\"%s\">\n  <asset>\n", 0);
  for (size_t i = 0; i < c->shape_count; i++) {
    size_t points[2], rows[2];
    if (is_plain(c, i)) continue;
    range_of(c, i, points, rows);
    put(o, "    <mesh name=\"%s_hull_%z\" vertex=\"", i);
    put_numbers(o, &c->points[3 * points[0]], 3 * (points[1] - points[0]), o->unit);
    put(o, "\"/>\n", i);
  }
  put(o, "  </asset>\n  <worldbody>\n    <body name=\"%s\">\n      <freejoint/>\n", 0);
  if (c->body_count > 0) {
    put(o, "      <inertial pos=\"", 0);
    put_numbers(o, &c->body[1], 3, o->unit);
    put(o, "\" mass=\"", 0);
    put_numbers(o, c->body, 1, 1);
    put(o, "\" fullinertia=\"", 0);
    put_numbers(o, &c->body[4], 6, o->unit * o->unit);
    put(o, "\"/>\n", 0);
  }
  for (size_t i = 0; i < c->shape_count; i++) {
    put(o, "      <geom name=\"%s_%z\" ", i);
    if (is_plain(c, i)) {
      put(o, is_sphere(c, i) ? "type=\"sphere\" size=\"" : "type=\"capsule\" size=\"", i);
      put_numbers(o, &sphere_of(c, i, 0)[3], 1, o->unit);
      put(o, is_sphere(c, i) ? "\" pos=\"" : "\" fromto=\"", i);
      put_numbers(o, sphere_of(c, i, 0), 3, o->unit);
      if (!is_sphere(c, i)) {
        put(o, " ", i);
        put_numbers(o, sphere_of(c, i, 1), 3, o->unit);
      }
    } else {
      put(o, "type=\"mesh\" mesh=\"%s_hull_%z", i);
    }
    put(o, "\"/>\n", i);
  }
  put(o, "    </body>\n  </worldbody>\n</mujoco>\n", 0);
}

/* ---- cuRobo ---- */

static void put_yaml(output *o) {
  const qmat_colliders *c = o->colliders;
  put(o, "collision_spheres:\n  \"%s\":\n", 0);
  for (size_t i = 0; i < c->shape_count; i++) {
    const double *sphere = sphere_of(c, i, 0);
    put(o, "    - \"center\": [", i);
    for (int k = 0; k < 3; k++) {
      if (k > 0) put(o, ", ", i);
      put_numbers(o, &sphere[k], 1, o->unit);
    }
    put(o, "]\n      \"radius\": ", i);
    put_numbers(o, &sphere[3], 1, o->unit);
    put(o, "\n", i);
  }
}

/* ---- the file ---- */

/* Makes the parts of the URDF file: itself, and a file for each hull. */
static qmat_status add_hulls(qmat_context *context, output *o, qmat_file *file) {
  const qmat_colliders *c = o->colliders;
  size_t part = 1;
  for (size_t i = 0; i < c->shape_count; i++) {
    if (is_sphere(c, i)) continue;
    char name[LONGEST_NAME + 32];
    snprintf(name, sizeof name, "%s_hull_%02zu.stl", o->name, i + 1);
    qmat_writer writer = {0};
    put_stl(&writer, c, i, o->unit);
    const qmat_status status = qmat_writer_to_part(context, &writer, file, part++, name);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

qmat_status qmat_robot_write(qmat_context *context, const qmat_colliders *colliders, qmat_robot_format format,
                             const char *name, double meters_per_unit, qmat_file **file) {
  static const char *const endings[] = {"urdf", "xml", "yaml"};
  output o = {.colliders = colliders, .unit = meters_per_unit > 0 ? meters_per_unit : 1};
  size_t hulls = 0;
  *file = NULL;
  set_name(name, o.name);
  for (size_t i = 0; i < colliders->shape_count; i++) {
    if (is_sphere(colliders, i)) continue;
    hulls++;
    if (format != QMAT_ROBOT_YAML) continue;
    qmat_fail(context, QMAT_ERROR_USAGE, "cuRobo's YAML holds spheres only");
    qmat_fail_field(context, "colliders");
    return qmat_fail_hint(context, "set kind of medial.colliders to spheres; qmat mat: --kind spheres");
  }
  qmat_file *made = qmat_file_new();
  qmat_status status = made ? QMAT_OK : qmat_fail_memory(context, "the output file");
  if (status == QMAT_OK) {
    const size_t parts = 1 + (format == QMAT_ROBOT_URDF ? hulls : 0);
    made->format = qmat_strdup(endings[format]);
    made->parts = qmat_calloc(parts, sizeof *made->parts);
    if (made->parts) made->part_count = parts;
    if (!made->format || !made->parts) status = qmat_fail_memory(context, "the output file");
  }
  if (status == QMAT_OK) {
    if (format == QMAT_ROBOT_URDF) put_urdf(&o);
    if (format == QMAT_ROBOT_MJCF) put_mjcf(&o);
    if (format == QMAT_ROBOT_YAML) put_yaml(&o);
    status = qmat_writer_to_part(context, &o.writer, made, 0, "");
  }
  if (status == QMAT_OK && format == QMAT_ROBOT_URDF) status = add_hulls(context, &o, made);
  if (status == QMAT_OK) status = qmat_value_seal(context, &made->base);
  qmat_writer_uninit(&o.writer);
  if (status == QMAT_OK) {
    *file = made;
  } else if (made) {
    qmat_value_release(&made->base);
  }
  return status;
}
