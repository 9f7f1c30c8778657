/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_VERTEX_FACETS_H
#define QMAT_CORE_GEOMETRY_VERTEX_FACETS_H

#include "core/value.h"

/* The facets around each vertex of a mesh, in rising order: those of vertex v are facets[offsets[v] .. offsets[v + 1]).
 * Both arrays live in the context's arena. */
typedef struct qmat_vertex_facets {
  size_t *offsets;  /* vertex_count + 2, of which the last is scratch */
  uint32_t *facets; /* 3 per triangle */
} qmat_vertex_facets;

/* Finds them. QMAT_ERROR_MEMORY. One thread. Cost: linear. */
qmat_status qmat_vertex_facets_find(qmat_context *context, const qmat_mesh *mesh, qmat_vertex_facets *around);

#endif
