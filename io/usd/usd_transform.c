/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_transform.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

typedef qmat_usd_transform transform;

/* ---- matrices ---- */

transform qmat_usd_identity(void) {
  return (transform){.m = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
}

transform qmat_usd_product(const transform *a, const transform *b) {
  transform result;
  for (int i = 0; i < 4; i++) {
    for (int j = 0; j < 4; j++) {
      double sum = 0;
      for (int k = 0; k < 4; k++) sum += a->m[4 * i + k] * b->m[4 * k + j];
      result.m[4 * i + j] = sum;
    }
  }
  return result;
}

double qmat_usd_volume(const transform *t) {
  double cross[3];
  qmat_cross(&t->m[4], &t->m[8], cross);
  return qmat_dot(t->m, cross);
}

bool qmat_usd_mirrors(const transform *t) {
  return qmat_usd_volume(t) < 0;
}

/* Gauss-Jordan elimination with partial pivoting. */
bool qmat_usd_inverse(const transform *t, transform *result) {
  double a[4][8];
  for (int i = 0; i < 4; i++) {
    for (int j = 0; j < 4; j++) {
      a[i][j] = t->m[4 * i + j];
      a[i][4 + j] = i == j;
    }
  }
  for (int k = 0; k < 4; k++) {
    int best = k;
    for (int i = k + 1; i < 4; i++) {
      if (fabs(a[i][k]) > fabs(a[best][k])) best = i;
    }
    if (!(fabs(a[best][k]) > 0)) return false;
    for (int j = 0; j < 8; j++) {
      double other = a[k][j];
      a[k][j] = a[best][j];
      a[best][j] = other;
    }
    for (int j = 7; j >= k; j--) a[k][j] /= a[k][k];
    for (int i = 0; i < 4; i++) {
      if (i == k) continue;
      for (int j = 7; j >= k; j--) a[i][j] -= a[i][k] * a[k][j];
    }
  }
  for (int i = 0; i < 4; i++) {
    for (int j = 0; j < 4; j++) result->m[4 * i + j] = a[i][4 + j];
  }
  return true;
}

/* A rotation about the x, y or z axis, counter-clockwise as seen from its end. */
static transform rotation(int axis, double degrees) {
  transform result = qmat_usd_identity();
  const double turns = degrees / 90;
  double c = cos(degrees * QMAT_PI / 180), s = sin(degrees * QMAT_PI / 180);
  if (turns == floor(turns) && fabs(turns) < 0x1p52) { /* right angles are exact */
    static const double cosines[] = {1, 0, -1, 0}, sines[] = {0, 1, 0, -1};
    const int quarter = (int)(turns - 4 * floor(turns / 4));
    c = cosines[quarter];
    s = sines[quarter];
  }
  const int i = (axis + 1) % 3, j = (axis + 2) % 3;
  result.m[5 * i] = c;
  result.m[4 * i + j] = s;
  result.m[4 * j + i] = -s;
  result.m[5 * j] = c;
  return result;
}

transform qmat_usd_orientation(const double q[4]) {
  transform result = qmat_usd_identity();
  const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 0)) return result;
  const double w = q[0] / length, x = q[1] / length, y = q[2] / length, z = q[3] / length;
  const double rows[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (z * x - y * w)},
                             {2 * (x * y - z * w), 1 - 2 * (z * z + x * x), 2 * (y * z + x * w)},
                             {2 * (z * x + y * w), 2 * (y * z - x * w), 1 - 2 * (y * y + x * x)}};
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) result.m[4 * i + j] = rows[i][j];
  }
  return result;
}

/* ---- operations ---- */

typedef enum op_kind { OP_TRANSLATE, OP_SCALE, OP_ROTATE, OP_EULER, OP_ORIENT, OP_TRANSFORM } op_kind;

/* The operations by the second part of their names. `axes`: of a translation, scale or rotation about one axis; of
 * Euler angles, in their order. */
static const struct {
  const char *name;
  op_kind kind;
  uint8_t components;
  int axes[3];
} operations[] = {
    {"translate", OP_TRANSLATE, 3, {0}},   {"translateX", OP_TRANSLATE, 1, {0}},  {"translateY", OP_TRANSLATE, 1, {1}},
    {"translateZ", OP_TRANSLATE, 1, {2}},  {"scale", OP_SCALE, 3, {0}},           {"scaleX", OP_SCALE, 1, {0}},
    {"scaleY", OP_SCALE, 1, {1}},          {"scaleZ", OP_SCALE, 1, {2}},          {"rotateX", OP_ROTATE, 1, {0}},
    {"rotateY", OP_ROTATE, 1, {1}},        {"rotateZ", OP_ROTATE, 1, {2}},        {"rotateXYZ", OP_EULER, 3, {0, 1, 2}},
    {"rotateXZY", OP_EULER, 3, {0, 2, 1}}, {"rotateYXZ", OP_EULER, 3, {1, 0, 2}}, {"rotateYZX", OP_EULER, 3, {1, 2, 0}},
    {"rotateZXY", OP_EULER, 3, {2, 0, 1}}, {"rotateZYX", OP_EULER, 3, {2, 1, 0}}, {"orient", OP_ORIENT, 4, {0}},
    {"transform", OP_TRANSFORM, 16, {0}},
};

static const double *single_numbers(const qmat_usd_value *value, unsigned components) {
  bool good = value && !value->is_array && qmat_usd_is_number(value->type) && value->components == components;
  return good ? value->numbers : NULL;
}

static transform make_operation(size_t row, const double *numbers) {
  transform result = qmat_usd_identity();
  const unsigned components = operations[row].components;
  const int *axes = operations[row].axes;
  switch (operations[row].kind) {
    case OP_TRANSLATE:
      for (unsigned i = 0; i < components; i++) result.m[12 + (components == 1 ? (unsigned)axes[0] : i)] = numbers[i];
      break;
    case OP_SCALE:
      for (unsigned i = 0; i < components; i++) result.m[5 * (components == 1 ? (unsigned)axes[0] : i)] = numbers[i];
      break;
    case OP_ROTATE:
      return rotation(axes[0], numbers[0]);
    case OP_EULER:
      for (int i = 0; i < 3; i++) {
        const transform turn = rotation(axes[i], numbers[axes[i]]);
        result = qmat_usd_product(&result, &turn);
      }
      break;
    case OP_ORIENT:
      return qmat_usd_orientation(numbers);
    case OP_TRANSFORM:
      memcpy(result.m, numbers, sizeof result.m);
      break;
  }
  return result;
}

/* The operation of this name, say "!invert!xformOp:rotateX:tilt". Its attribute has the name without "!invert!". */
static qmat_status read_operation(const qmat_usd_prim *prim, const char *name, transform *result) {
  static const char invert[] = "!invert!", prefix[] = "xformOp:";
  const bool inverted = strncmp(name, invert, sizeof invert - 1) == 0;
  if (inverted) name += sizeof invert - 1;
  *result = qmat_usd_identity();
  if (strncmp(name, prefix, sizeof prefix - 1) != 0)
    return qmat_usd_prim_fail(prim, "'%.80s' is not a transform operation", qmat_usd_shown(name));
  const char *kind = name + sizeof prefix - 1;
  const size_t length = strcspn(kind, ":"), count = sizeof operations / sizeof operations[0];
  size_t row = 0;
  while (row < count && (strlen(operations[row].name) != length || memcmp(kind, operations[row].name, length) != 0))
    row++;
  if (row == count) return qmat_usd_prim_fail(prim, "'%.80s' is not a transform operation", qmat_usd_shown(name));
  const qmat_usd_value *value;
  qmat_status status = qmat_usd_prim_attribute(prim, name, &value);
  if (status != QMAT_OK) return status;
  if (!value) return qmat_usd_warn(prim, "%s has no value and is ignored", name);
  const double *numbers = single_numbers(value, operations[row].components);
  if (!numbers) return qmat_usd_prim_fail(prim, "%s has a value of the wrong type", name);
  *result = make_operation(row, numbers);
  if (!inverted) return QMAT_OK;
  const transform forward = *result;
  if (qmat_usd_inverse(&forward, result)) return QMAT_OK;
  return qmat_usd_prim_fail(prim, "%s has no inverse", name);
}

qmat_status qmat_usd_read_transform(const qmat_usd_prim *prim, const char *type, transform *world) {
  const qmat_usd_value *order;
  qmat_status status = qmat_usd_prim_attribute(prim, "xformOpOrder", &order);
  if (status != QMAT_OK || !order || order->count == 0) return status;
  if (!order->is_array || !qmat_usd_is_text(order->type))
    return qmat_usd_prim_fail(prim, "xformOpOrder has a value of the wrong type");
  if (type[0] == '\0' || strcmp(type, "Scope") == 0)
    return qmat_usd_warn(prim, "its transform is ignored: %s has none", type[0] ? "a Scope" : "a prim without a type");
  transform local = qmat_usd_identity();
  for (size_t i = 0; i < order->count && status == QMAT_OK; i++) {
    if (strcmp(order->texts[i], "!resetXformStack!") == 0) {
      local = *world = qmat_usd_identity();
      continue;
    }
    transform operation;
    status = read_operation(prim, order->texts[i], &operation);
    local = qmat_usd_product(&operation, &local);
  }
  *world = qmat_usd_product(&local, world);
  return status;
}
