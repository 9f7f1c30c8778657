/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/picture.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/page/ray_scene.h"

enum { RAYS_PER_SIDE = 2, ROWS_AT_A_TIME = 16 };

/* One view: a rectangle of the picture with its own camera. */
typedef struct panel {
  const qmat_shown *shown;
  const qmat_ray_scene *scene;
  qmat_picture_view view; /* not both */
  qmat_camera camera;
  const double *background;
  size_t x, y, width, height;
} panel;

qmat_status qmat_picture_init(qmat_context *context, size_t width, size_t height, qmat_picture *picture) {
  *picture = (qmat_picture){.width = width, .height = height, .pixels = qmat_calloc(width * height, 4)};
  return picture->pixels ? QMAT_OK : qmat_fail_memory(context, "the picture");
}

void qmat_picture_uninit(qmat_picture *picture) {
  qmat_free(picture->pixels);
  *picture = (qmat_picture){0};
}

static void shade(const qmat_camera *camera, const double normal[3], double colour[3]) {
  const double seen[3] = {qmat_dot(normal, camera->right), qmat_dot(normal, camera->up),
                          qmat_dot(normal, camera->towards)};
  qmat_look_shade(seen, colour);
}

/* Puts a colour over a premultiplied one. */
static void put_over(const double colour[3], double opacity, double sum[4]) {
  for (int k = 0; k < 3; k++) sum[k] = opacity * colour[k] + (1 - opacity) * sum[k];
  sum[3] = opacity + (1 - opacity) * sum[3];
}

/* The colour that one ray sees, premultiplied. */
static void see(const panel *p, const double direction[3], double sum[4]) {
  double origin[3], colour[3];
  for (int k = 0; k < 3; k++) {
    origin[k] = p->camera.distance * p->camera.towards[k];
    sum[k] = p->background[k] * p->background[3];
  }
  sum[3] = p->background[3];
  double depth = INFINITY;
  if (p->view != QMAT_VIEW_SURFACE) {
    const qmat_ray_hit hit = qmat_ray_scene_medial(p->scene, origin, direction);
    depth = hit.distance;
    if (depth < INFINITY) {
      qmat_look_of_kind(hit.kind, colour);
      shade(&p->camera, hit.normal, colour);
      put_over(colour, 1, sum);
    }
  }
  if (p->view == QMAT_VIEW_MEDIAL) return;
  const qmat_ray_hit hit = qmat_ray_scene_surface(p->scene, origin, direction);
  if (!(hit.distance < depth)) return;
  const bool is_glass = p->view == QMAT_VIEW_OVERLAY;
  if (is_glass)
    qmat_look_of_surface(colour);
  else
    qmat_look_of_error(hit.error, p->shown->range, colour);
  shade(&p->camera, hit.normal, colour);
  put_over(colour, is_glass ? qmat_look_glass(qmat_dot(hit.normal, p->camera.towards)) : 1, sum);
}

static void draw_pixel(const panel *p, size_t column, size_t row, uint8_t pixel[4]) {
  const double aspect = (double)p->width / (double)p->height;
  double mean[4] = {0, 0, 0, 0};
  for (int i = 0; i < RAYS_PER_SIDE * RAYS_PER_SIDE; i++) {
    const double dx = (i % RAYS_PER_SIDE + 0.5) / RAYS_PER_SIDE, dy = (i / RAYS_PER_SIDE + 0.5) / RAYS_PER_SIDE;
    double direction[3], sum[4];
    qmat_camera_ray(&p->camera, aspect, 2 * ((double)column + dx) / (double)p->width - 1,
                    1 - 2 * ((double)row + dy) / (double)p->height, direction);
    see(p, direction, sum);
    for (int k = 0; k < 4; k++) mean[k] += sum[k] / (RAYS_PER_SIDE * RAYS_PER_SIDE);
  }
  for (int k = 0; k < 3; k++) pixel[k] = (uint8_t)lround(255 * fmin(mean[3] > 0 ? mean[k] / mean[3] : 0, 1));
  pixel[3] = (uint8_t)lround(255 * fmin(mean[3], 1));
}

static qmat_status draw_panel(qmat_context *context, const panel *p, qmat_picture *picture) {
  const int threads = qmat_threads(context);
  for (size_t first = 0; first < p->height; first += ROWS_AT_A_TIME) {
    const qmat_status status = qmat_progress(context, first, p->height, "rows of the picture");
    if (status != QMAT_OK) return status;
    const size_t last = first + ROWS_AT_A_TIME < p->height ? first + ROWS_AT_A_TIME : p->height;
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1)
    for (size_t row = first; row < last; row++)
      for (size_t column = 0; column < p->width; column++)
        draw_pixel(p, column, row, &picture->pixels[4 * ((p->y + row) * picture->width + p->x + column)]);
  }
  return QMAT_OK;
}

qmat_status qmat_picture_draw(qmat_context *context, const qmat_shown *shown, const qmat_picture_options *options,
                              size_t x, size_t y, size_t width, size_t height, qmat_picture *picture) {
  const bool is_both = options->view == QMAT_VIEW_BOTH;
  panel p = {.shown = shown,
             .view = is_both ? QMAT_VIEW_SURFACE : options->view,
             .camera = qmat_camera_of(options->turn, options->tilt, options->is_z_up),
             .background = options->background,
             .x = x,
             .y = y,
             .width = is_both ? width / 2 : width,
             .height = height};
  const double aspect = (double)p.width / (double)p.height;
  qmat_camera_fit(&p.camera, shown->display.positions, shown->display.vertex_count, 3, aspect);
  qmat_camera_fit(&p.camera, shown->unit.spheres, shown->unit.sphere_count, 4, aspect);
  qmat_ray_scene *scene;
  qmat_status status = qmat_ray_scene_new(context, &shown->display, &shown->unit, &scene);
  if (status != QMAT_OK) return status;
  p.scene = scene;
  status = draw_panel(context, &p, picture);
  if (status == QMAT_OK && is_both) {
    p.view = QMAT_VIEW_MEDIAL;
    p.x += p.width;
    p.width = width - p.width;
    status = draw_panel(context, &p, picture);
  }
  qmat_ray_scene_free(scene);
  return status;
}
