/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_RAY_SCENE_H
#define QMAT_NODES_PAGE_RAY_SCENE_H

#include "nodes/page/display_mesh.h"
#include "nodes/page/look.h"

/* A surface and a medial mesh for rays (Embree). Spheres and the sides of cones are intersected by formulas, faces of
 * slabs as triangles. Immutable after it is made, so any number of threads may cast rays at once; the hits do not
 * depend on threads. */
typedef struct qmat_ray_scene qmat_ray_scene;

/* The first hit of a ray. */
typedef struct qmat_ray_hit {
  double distance;     /* INFINITY: nothing is hit */
  double normal[3];    /* unit vector towards the origin of the ray */
  double error;        /* of the surface, interpolated; 0 without errors */
  qmat_look_kind kind; /* of a primitive of the medial mesh */
} qmat_ray_hit;

/* Makes the scene. `unit` has the arrays of a sealed medial mesh in the unit frame. Both have to live as long as the
 * scene; each may be NULL. Free it with qmat_ray_scene_free, which allows NULL. On failure `*scene` is NULL:
 * QMAT_ERROR_MEMORY, QMAT_ERROR_DEPENDENCY. Cost: O(n log n) on one thread. */
qmat_status qmat_ray_scene_new(qmat_context *context, const qmat_display_mesh *display, const qmat_medial *unit,
                               qmat_ray_scene **scene);
void qmat_ray_scene_free(qmat_ray_scene *scene);

/* Casts a ray at the surface, or at the medial mesh. `direction` is a unit vector. */
qmat_ray_hit qmat_ray_scene_surface(const qmat_ray_scene *scene, const double origin[3], const double direction[3]);
qmat_ray_hit qmat_ray_scene_medial(const qmat_ray_scene *scene, const double origin[3], const double direction[3]);

#endif
