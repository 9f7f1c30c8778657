/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_VALUE_CHECK_H
#define QMAT_CORE_VALUE_CHECK_H

#include "core/context.h"
#include "core/value_types.h"

/* Checks that several types of value share. Each returns QMAT_OK, or records an error that names the first bad element:
 * `kind` is what the error calls an element ("vertex"). Cost: linear unless stated. */

/* All count * components numbers are finite. */
qmat_status qmat_check_finite(qmat_context *context, const double *numbers, size_t count, size_t components,
                              const char *kind, const char *what);

/* The number is finite and not negative. `field` names it. */
qmat_status qmat_check_length(qmat_context *context, double length, const char *field);

/* Joints and weights of none of the elements or of all: 4 joints below 65536 each, and weights that are not negative
 * and sum to 1. */
qmat_status qmat_check_skin(qmat_context *context, const uint32_t *joints, const double *weights, size_t skinned_count,
                            size_t count, const char *kind);

/* 32-bit indices can address `count` elements; QMAT_ERROR_MEMORY otherwise. */
qmat_status qmat_check_u32_count(qmat_context *context, size_t count, const char *what);

/* All `length` ids are below `count`. An element is a group of `components` ids; `of` names what an id stands for. */
qmat_status qmat_check_ids(qmat_context *context, const uint32_t *ids, size_t length, size_t count, const char *kind,
                           size_t components, const char *of);

/* `text` is valid UTF-8, as JSON requires; QMAT_ERROR_FORMAT. */
qmat_status qmat_check_utf8(qmat_context *context, const char *text, const char *what);

/* The first part has no name; the others have different names that qmat_is_part_name accepts. O(n log n). */
qmat_status qmat_check_parts(qmat_context *context, const qmat_file_part *parts, size_t part_count);

/* All numbers of `count` spheres are finite, and no radius is negative. */
qmat_status qmat_check_spheres(qmat_context *context, const double *spheres, size_t count, const char *kind);

/* `count` edges (width 2) or triangles (width 3): every id is below `sphere_count`, ids rise within a simplex, and the
 * simplices rise strictly. */
qmat_status qmat_check_simplices(qmat_context *context, const uint32_t *simplices, size_t count, size_t width,
                                 size_t sphere_count, const char *kind);

/* The place of `row` (`width` ids, ascending) among `count` sorted rows of simplices; SIZE_MAX where it is not there.
 * Cost: logarithmic. */
size_t qmat_simplex_find(const uint32_t *rows, size_t count, size_t width, const uint32_t *row);

/* The three sides of every triangle are among the sorted edges. O(triangles * log edges). */
qmat_status qmat_check_sides(qmat_context *context, const uint32_t *edges, size_t edge_count, const uint32_t *triangles,
                             size_t triangle_count);

#endif
