/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_INITIAL_CREASE_SPHERES_H
#define QMAT_NODES_INITIAL_CREASE_SPHERES_H

#include "core/geometry/frame.h"

/* A sphere of radius zero on a crease of the surface. */
typedef struct qmat_crease_sphere {
  double centre[3]; /* model units */
  uint32_t vertex;  /* of the mesh; QMAT_NONE between two vertices */
} qmat_crease_sphere;

/* Spheres of radius zero on creases (section 5, future work), and the segments of creases between them. Start with
 * {0}. */
typedef struct qmat_crease_spheres {
  qmat_crease_sphere *spheres;
  uint32_t *segments; /* 2 spheres each */
  size_t count, segment_count, capacity, segment_capacity;
} qmat_crease_spheres;

void qmat_crease_spheres_uninit(qmat_crease_spheres *creases);

/* Append a sphere, whose number becomes `*id`, and a segment between two spheres. QMAT_ERROR_MEMORY. */
qmat_status qmat_crease_spheres_add(qmat_context *context, const double centre[3], uint32_t vertex,
                                    qmat_crease_spheres *creases, uint32_t *id);
qmat_status qmat_crease_spheres_add_segment(qmat_context *context, uint32_t from, uint32_t to,
                                            qmat_crease_spheres *creases);

/* The number of spheres before those of creases, which are the last ones and have radius zero. Spheres of sheets, the
 * first ones, are no spheres of creases. */
size_t qmat_medial_count_without_creases(const qmat_medial *medial);

/* Appends the spheres of creases that a medial mesh ends with, and the edges between them. QMAT_ERROR_MEMORY. */
qmat_status qmat_crease_spheres_of_medial(qmat_context *context, const qmat_medial *medial,
                                          qmat_crease_spheres *creases);

typedef struct qmat_crease_links {
  size_t gaps;    /* segments whose ends are not linked: no path in the medial mesh, or only a long detour */
  double longest; /* of the paths, unit frame */
} qmat_crease_links;

/* Makes a sealed medial mesh of `bare` followed by the spheres of the creases (at least one). Each is linked by an edge
 * to its anchor, and by slabs to the shortest path between the anchors of a segment. The anchor is the nearest sphere
 * of the component that is nearest to most spheres of the joined creases. The homotopy type is that of `bare`. A sphere
 * at a vertex is responsible for it: the first samples are the vertices. The caller releases `*linked`, which is NULL
 * on failure. QMAT_ERROR_MEMORY, QMAT_CANCELLED. Anchors are found on all threads, but for the few in another
 * component. Cost: a search around each anchor (Dijkstra 1959). */
qmat_status qmat_crease_spheres_link(qmat_context *context, const qmat_frame *frame, const qmat_medial *bare,
                                     const qmat_crease_spheres *creases, qmat_medial **linked,
                                     qmat_crease_links *links);

#endif
