/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_MESH_PARTS_REPORT_H
#define QMAT_NODES_MESH_PARTS_REPORT_H

#include <jansson.h>

#include "nodes/mesh/parts.h"

/* Adds `components` to a report: what each of the first 64 parts was taken for, its triangles and area, and its first
 * 16 caps. `components_not_listed` counts the others. `facing` has a qmat_facing per part, `cap_areas` an area per
 * loop. 0, or another number when memory is short. Any thread. */
int qmat_parts_report(const qmat_parts *parts, const uint8_t *facing, const double *cap_areas, json_t *root);

#endif
