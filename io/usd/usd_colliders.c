/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_colliders.h"

#include <stdio.h>

#include "core/geometry/vector.h"
#include "io/collider_frames.h"

static void put_tuple(qmat_writer *writer, const double *numbers, int count) {
  for (int k = 0; k < count; k++) {
    qmat_put_text(writer, k > 0 ? ", " : "(");
    qmat_put_number(writer, numbers[k]);
  }
  qmat_put_text(writer, ")");
}

/* A quaternion x y z w as USD has it: w first. */
static void put_rotation(qmat_writer *writer, const double q[4]) {
  put_tuple(writer, (const double[]){q[3], q[0], q[1], q[2]}, 4);
}

static void put_attribute(qmat_writer *writer, const char *declaration, double number) {
  qmat_put_text(writer, declaration);
  qmat_put_number(writer, number);
  qmat_put_text(writer, "\n");
}

void qmat_usd_put_body_schemas(qmat_writer *writer, size_t depth) {
  qmat_put_indent(writer, depth);
  qmat_put_text(writer, "prepend apiSchemas = [\"PhysicsRigidBodyAPI\", \"PhysicsMassAPI\"]\n");
}

void qmat_usd_put_body(qmat_writer *writer, size_t depth, const double body[10], const double origin[3],
                       double kilograms, bool is_kinematic) {
  double moments[3], rotation[4], centre[3];
  qmat_principal_inertia(body, moments, rotation);
  for (int k = 0; k < 3; k++) moments[k] /= kilograms;
  qmat_subtract(&body[1], origin, centre);
  if (is_kinematic) {
    qmat_put_indent(writer, depth);
    qmat_put_text(writer, "bool physics:kinematicEnabled = true\n");
  }
  qmat_put_indent(writer, depth);
  put_attribute(writer, "float physics:mass = ", body[0] / kilograms);
  qmat_put_indent(writer, depth);
  qmat_put_text(writer, "point3f physics:centerOfMass = ");
  put_tuple(writer, centre, 3);
  qmat_put_text(writer, "\n");
  qmat_put_indent(writer, depth);
  qmat_put_text(writer, "float3 physics:diagonalInertia = ");
  put_tuple(writer, moments, 3);
  qmat_put_text(writer, "\n");
  qmat_put_indent(writer, depth);
  qmat_put_text(writer, "quatf physics:principalAxes = ");
  put_rotation(writer, rotation);
  qmat_put_text(writer, "\n");
}

/* The points and triangles of a hull. */
static void put_hull(qmat_writer *writer, const qmat_colliders *c, size_t shape, const double origin[3]) {
  const size_t first = shape > 0 ? c->hull_ends[2 * shape - 2] : 0, last = c->hull_ends[2 * shape];
  const size_t row = shape > 0 ? c->hull_ends[2 * shape - 1] : 0, end = c->hull_ends[2 * shape + 1];
  qmat_put_text(writer, "            int[] faceVertexCounts = [");
  for (size_t t = row; t < end; t++) qmat_put_text(writer, t > row ? ", 3" : "3");
  qmat_put_text(writer, "]\n            int[] faceVertexIndices = [");
  for (size_t i = 3 * row; i < 3 * end; i++) {
    if (i > 3 * row) qmat_put_text(writer, ", ");
    qmat_put_integer(writer, (int64_t)(c->triangles[i] - first));
  }
  qmat_put_text(writer, "]\n            point3f[] points = [");
  for (size_t i = first; i < last; i++) {
    double point[3];
    qmat_subtract(&c->points[3 * i], origin, point);
    if (i > first) qmat_put_text(writer, ", ");
    put_tuple(writer, point, 3);
  }
  qmat_put_text(writer, "]\n            uniform token subdivisionScheme = \"none\"\n");
  qmat_put_text(writer, "            uniform token physics:approximation = \"convexHull\"\n");
}

static void put_shape(qmat_writer *writer, const qmat_colliders *c, size_t shape, const double origin[3]) {
  static const char *const types[] = {"Sphere", "Capsule_1", "Mesh"};
  const uint32_t *ids = &c->shapes[3 * shape];
  const int width = qmat_collider_width(ids);
  const double *a = &c->spheres[4 * (size_t)ids[0]], *b = &c->spheres[4 * (size_t)ids[1]];
  double middle[3], rotation[4], length;
  char head[160];
  snprintf(head, sizeof head,
           "        def %s \"shape_%02zu\" (\n            prepend apiSchemas = [%s]\n        )\n        {\n",
           types[width - 1], shape + 1,
           width == 3 ? "\"PhysicsCollisionAPI\", \"PhysicsMeshCollisionAPI\"" : "\"PhysicsCollisionAPI\"");
  qmat_put_text(writer, head);
  if (width == 3) put_hull(writer, c, shape, origin);
  if (width == 1) put_attribute(writer, "            double radius = ", a[3]);
  if (width < 3) {
    qmat_capsule_frame(a, b, middle, &length, rotation);
    qmat_subtract(middle, origin, middle);
    if (width == 2) {
      qmat_put_text(writer, "            uniform token axis = \"Y\"\n");
      put_attribute(writer, "            double height = ", length);
      put_attribute(writer, "            double radiusBottom = ", a[3]);
      put_attribute(writer, "            double radiusTop = ", b[3]);
      qmat_put_text(writer, "            quatd xformOp:orient = ");
      put_rotation(writer, rotation);
      qmat_put_text(writer, "\n");
    }
    qmat_put_text(writer, "            double3 xformOp:translate = ");
    put_tuple(writer, middle, 3);
    qmat_put_text(writer, "\n            uniform token[] xformOpOrder = [\"xformOp:translate\"");
    qmat_put_text(writer, width == 2 ? ", \"xformOp:orient\"]\n" : "]\n");
  }
  qmat_put_text(writer, "            uniform token purpose = \"guide\"\n        }\n");
}

void qmat_usd_put_colliders(qmat_writer *writer, const qmat_colliders *colliders, const double origin[3]) {
  qmat_put_text(writer, "\n    def Scope \"colliders\"\n    {\n");
  for (size_t i = 0; i < colliders->shape_count; i++) put_shape(writer, colliders, i, origin);
  qmat_put_text(writer, "    }\n");
}
