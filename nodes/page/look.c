/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/look.h"

#include <math.h>

#include "core/geometry/vector.h"

/* The tangent of half the vertical field of view, and the share of the view that a model fills. */
static const double half_view = 0.26794919243112270647;
static const double filled = 0.92;

/* Okabe and Ito's colours, which people with any colour vision tell apart. */
static const double kind_colours[QMAT_LOOK_KINDS][3] = {{0xe6 / 255.0, 0x9f / 255.0, 0x00 / 255.0},
                                                        {0x56 / 255.0, 0xb4 / 255.0, 0xe9 / 255.0},
                                                        {0, 0x9e / 255.0, 0x73 / 255.0}};
static const double surface_colour[3] = {0xc3 / 255.0, 0xca / 255.0, 0xd4 / 255.0};

/* From blue, inside of the envelope, to red, outside of it (ColorBrewer RdBu). */
enum { STOPS = 5 };
static const double error_colours[STOPS][3] = {{0x21 / 255.0, 0x66 / 255.0, 0xac / 255.0},
                                               {0x84 / 255.0, 0xbb / 255.0, 0xdb / 255.0},
                                               {0xf4 / 255.0, 0xf2 / 255.0, 0xee / 255.0},
                                               {0xf2 / 255.0, 0x9a / 255.0, 0x78 / 255.0},
                                               {0xb2 / 255.0, 0x18 / 255.0, 0x2b / 255.0}};

qmat_camera qmat_camera_of(double turn, double tilt, bool is_z_up) {
  const double a = turn * QMAT_PI / 180, b = tilt * QMAT_PI / 180;
  if (is_z_up)
    return (qmat_camera){.right = {cos(a), sin(a), 0},
                         .up = {-sin(a) * sin(b), cos(a) * sin(b), cos(b)},
                         .towards = {sin(a) * cos(b), -cos(a) * cos(b), sin(b)}};
  return (qmat_camera){.right = {cos(a), 0, -sin(a)},
                       .up = {-sin(a) * sin(b), cos(b), -cos(a) * sin(b)},
                       .towards = {sin(a) * cos(b), sin(b), cos(a) * cos(b)}};
}

void qmat_camera_fit(qmat_camera *camera, const double *spheres, size_t count, size_t stride, double aspect) {
  const double tall = half_view * filled, wide = tall * aspect;
  for (size_t i = 0; i < count; i++) {
    const double *s = &spheres[stride * i], radius = stride > 3 ? s[3] : 0, depth = qmat_dot(s, camera->towards);
    const double x = fabs(qmat_dot(s, camera->right)), y = fabs(qmat_dot(s, camera->up));
    /* a sphere touches the side of the view where its centre is radius / sin(half the angle) behind a point */
    const double of_width = depth + x / wide + radius * sqrt(1 + 1 / (wide * wide));
    const double of_height = depth + y / tall + radius * sqrt(1 + 1 / (tall * tall));
    camera->distance = fmax(camera->distance, fmax(of_width, of_height));
  }
}

void qmat_camera_ray(const qmat_camera *camera, double aspect, double x, double y, double direction[3]) {
  for (int k = 0; k < 3; k++)
    direction[k] = half_view * (x * aspect * camera->right[k] + y * camera->up[k]) - camera->towards[k];
  qmat_normalize(direction);
}

void qmat_look_of_kind(qmat_look_kind kind, double colour[3]) {
  for (int k = 0; k < 3; k++) colour[k] = kind_colours[kind][k];
}

void qmat_look_of_surface(double colour[3]) {
  for (int k = 0; k < 3; k++) colour[k] = surface_colour[k];
}

void qmat_look_of_error(double error, double range, double colour[3]) {
  const double at = fmin(fmax((error / range + 1) / 2, 0), 1) * (STOPS - 1);
  const int low = at < STOPS - 2 ? (int)at : STOPS - 2;
  for (int k = 0; k < 3; k++)
    colour[k] = error_colours[low][k] + (at - low) * (error_colours[low + 1][k] - error_colours[low][k]);
}

void qmat_look_shade(const double normal[3], double colour[3]) {
  static const double key[3] = {-0.448, 0.647, 0.617}, fill[3] = {0.703, -0.201, 0.683},
                      half[3] = {-0.249, 0.360, 0.899};
  const double edge = 1 - fmax(normal[2], 0);
  const double light = (0.52 + 0.48 * fmax(qmat_dot(normal, key), 0) + 0.16 * fmax(qmat_dot(normal, fill), 0)) *
                       (1 - 0.38 * edge * edge * edge);
  const double gloss = 0.12 * pow(fmax(qmat_dot(normal, half), 0), 28);
  for (int k = 0; k < 3; k++) colour[k] = fmin(colour[k] * light + gloss, 1);
}

double qmat_look_glass(double facing) {
  const double edge = 1 - fmin(fmax(facing, 0), 1);
  return 0.2 + 0.55 * edge * edge;
}

static json_t *json_colour(const double colour[3]) {
  return json_pack("[f,f,f]", colour[0], colour[1], colour[2]);
}

json_t *qmat_look_json(void) {
  json_t *map = json_array(), *kinds = json_array(), *look = json_object();
  int bad = !map || !kinds || !look;
  for (int i = 0; i < STOPS; i++) bad |= json_array_append_new(map, json_colour(error_colours[i]));
  for (int i = 0; i < QMAT_LOOK_KINDS; i++) bad |= json_array_append_new(kinds, json_colour(kind_colours[i]));
  bad |= json_object_set_new(look, "surface", json_colour(surface_colour));
  bad |= json_object_set_new(look, "kinds", kinds);
  bad |= json_object_set_new(look, "map", map);
  if (!bad) return look;
  json_decref(look);
  return NULL;
}
