/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_NODES_H
#define QMAT_NODES_NODES_H

#include "core/node.h"

/* Every node, sorted by name. CMake writes the table from the list in nodes/CMakeLists.txt. */
extern const qmat_node *const qmat_nodes[];
extern const size_t qmat_node_count;

/* The node with that name, or NULL. */
const qmat_node *qmat_node_find(const char *name);

#endif
