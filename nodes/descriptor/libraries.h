/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_DESCRIPTOR_LIBRARIES_H
#define QMAT_NODES_DESCRIPTOR_LIBRARIES_H

#include "core/node.h"

/* The libraries that nodes name in their descriptors. Embree is that of the running process, with the widest
 * instruction set that it uses on this processor; the others are those that the program was built with, since they are
 * headers or keep their version there. */
extern const qmat_library qmat_library_cgal, qmat_library_draco, qmat_library_embree, qmat_library_opensubdiv,
    qmat_library_tinygltf;

#endif
