/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_CHECK_DATA_H
#define QMAT_IO_GLTF_GLTF_CHECK_DATA_H

#include "io/gltf/gltf_checker.h"

/* Loads the buffers of an asset and checks the types and byte ranges of its buffer views and accessors. Sets
 * check->views and check->accessors. QMAT_ERROR_FORMAT with the element, QMAT_ERROR_IO, QMAT_ERROR_MEMORY. */
qmat_status qmat_gltf_check_data(qmat_gltf_checker *check);

/* The component types that a use of an accessor allows, as bits. */
enum {
  QMAT_GLTF_ALLOW_BYTES = 1,
  QMAT_GLTF_ALLOW_SHORTS = 2,
  QMAT_GLTF_ALLOW_SIGNED = 4,
  QMAT_GLTF_ALLOW_UINTS = 8,
  QMAT_GLTF_ALLOW_FLOATS = 16
};

/* Checks that accessor `id` has that number of components and an allowed component type. `what` names its use in
 * errors. With `compressed`, its data come from Draco. QMAT_ERROR_FORMAT. */
qmat_status qmat_gltf_check_use(const qmat_gltf_checker *check, int64_t id, const char *what, int64_t components,
                                unsigned allowed, bool compressed);

#endif
