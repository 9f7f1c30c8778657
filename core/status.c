/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/status.h"

const char *qmat_status_name(qmat_status status) {
  switch (status) {
    case QMAT_OK:
      return "ok";
    case QMAT_ERROR_USAGE:
      return "usage";
    case QMAT_ERROR_IO:
      return "io";
    case QMAT_ERROR_FORMAT:
      return "format";
    case QMAT_ERROR_GEOMETRY:
      return "geometry";
    case QMAT_ERROR_MEMORY:
      return "memory";
    case QMAT_ERROR_DEPENDENCY:
      return "dependency";
    case QMAT_ERROR_INTERNAL:
      return "internal";
    case QMAT_CANCELLED:
      return "cancelled";
  }
  return "unknown";
}

int qmat_status_exit_code(qmat_status status) {
  switch (status) {
    case QMAT_OK:
      return 0;
    case QMAT_ERROR_USAGE:
      return 2;
    case QMAT_CANCELLED:
      return 3;
    default:
      return 1;
  }
}
