/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_meshopt.h"

#include <meshoptimizer.h>

#include "core/arena.h"

/* No mode packs more decoded bytes into one byte: 256 elements whose bytes never change cost 4 bytes per byte of an
 * element. */
#define MOST_RATIO 64

static const char *const mode_names[] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};

static qmat_status check_layout(qmat_context *context, const qmat_meshopt_view *view) {
  const size_t stride = view->stride;
  const bool is_attributes = view->mode == QMAT_MESHOPT_ATTRIBUTES;
  bool fits = is_attributes ? stride > 0 && stride <= 256 && stride % 4 == 0 : stride == 2 || stride == 4;
  if (!fits) {
    return qmat_fail(context, QMAT_ERROR_FORMAT, "elements of %zu bytes are not allowed with mode %s", stride,
                     mode_names[view->mode]);
  }
  if (view->filter == QMAT_MESHOPT_OCTAHEDRAL) fits = stride == 4 || stride == 8;
  if (view->filter == QMAT_MESHOPT_QUATERNION) fits = stride == 8;
  if (!fits) return qmat_fail(context, QMAT_ERROR_FORMAT, "its filter is not for elements of %zu bytes", stride);
  if (view->filter != QMAT_MESHOPT_NONE && !is_attributes)
    return qmat_fail(context, QMAT_ERROR_FORMAT, "mode %s allows no filter", mode_names[view->mode]);
  if (view->mode == QMAT_MESHOPT_TRIANGLES && view->count % 3 != 0)
    return qmat_fail(context, QMAT_ERROR_FORMAT, "%zu indices are not whole triangles", view->count);
  if (view->count > MOST_RATIO * view->size / stride) {
    return qmat_fail(context, QMAT_ERROR_FORMAT, "%zu compressed bytes cannot hold %zu elements of %zu bytes",
                     view->size, view->count, stride);
  }
  return QMAT_OK;
}

static int decode(const qmat_meshopt_view *view, uint8_t *decoded) {
  switch (view->mode) {
    case QMAT_MESHOPT_ATTRIBUTES:
      return meshopt_decodeVertexBuffer(decoded, view->count, view->stride, view->bytes, view->size);
    case QMAT_MESHOPT_TRIANGLES:
      return meshopt_decodeIndexBuffer(decoded, view->count, view->stride, view->bytes, view->size);
    default:
      return meshopt_decodeIndexSequence(decoded, view->count, view->stride, view->bytes, view->size);
  }
}

static void apply_filter(const qmat_meshopt_view *view, uint8_t *decoded) {
  switch (view->filter) {
    case QMAT_MESHOPT_NONE:
      break;
    case QMAT_MESHOPT_OCTAHEDRAL:
      meshopt_decodeFilterOct(decoded, view->count, view->stride);
      break;
    case QMAT_MESHOPT_QUATERNION:
      meshopt_decodeFilterQuat(decoded, view->count, view->stride);
      break;
    case QMAT_MESHOPT_EXPONENTIAL:
      meshopt_decodeFilterExp(decoded, view->count, view->stride);
      break;
  }
}

qmat_status qmat_meshopt_decode(qmat_context *context, const qmat_meshopt_view *view, uint8_t **decoded) {
  *decoded = NULL;
  const qmat_status status = check_layout(context, view);
  if (status != QMAT_OK) return status;
  uint8_t *bytes = qmat_alloc(view->count, view->stride);
  if (!bytes) return qmat_fail_memory(context, "decompressed buffer views");
  if (decode(view, bytes) != 0) {
    qmat_free(bytes);
    return qmat_fail(context, QMAT_ERROR_FORMAT, "its meshopt data are damaged, or not of mode %s",
                     mode_names[view->mode]);
  }
  apply_filter(view, bytes);
  *decoded = bytes;
  return QMAT_OK;
}
