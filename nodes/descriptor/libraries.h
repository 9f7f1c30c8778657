/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_DESCRIPTOR_LIBRARIES_H
#define QMAT_NODES_DESCRIPTOR_LIBRARIES_H

#include "core/node.h"

/* The libraries that nodes name in their descriptors. The version of Embree is the loaded one, with the instruction set
 * that it uses on this processor. The others are the versions that the program was built with. */
extern const qmat_library qmat_library_cgal, qmat_library_draco, qmat_library_embree, qmat_library_meshoptimizer,
    qmat_library_opensubdiv, qmat_library_png, qmat_library_tinygltf;

#endif
