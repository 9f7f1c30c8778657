/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_STATUS_H
#define QMAT_CORE_STATUS_H

#ifdef __cplusplus
extern "C" {
#endif

/* The result of a call. Every status but QMAT_OK leaves an error record in the context. */
typedef enum qmat_status {
  QMAT_OK = 0,
  QMAT_ERROR_USAGE,      /* a bad option, graph, parameter or wiring */
  QMAT_ERROR_IO,         /* a file that cannot be opened, read, written or renamed */
  QMAT_ERROR_FORMAT,     /* a file whose bytes break its format */
  QMAT_ERROR_GEOMETRY,   /* a well-formed value that the node cannot process */
  QMAT_ERROR_MEMORY,     /* an allocation failed, or a size is out of range */
  QMAT_ERROR_DEPENDENCY, /* a library (CGAL, Draco, Embree, ...) failed */
  QMAT_ERROR_INTERNAL,   /* a bug in qmat */
  QMAT_CANCELLED         /* the progress function asked for a stop */
} qmat_status;

/* The short lower-case name of a status ("usage", "format", ...). Never NULL. */
const char *qmat_status_name(qmat_status status);

/* The exit code of the process: 0 ok, 1 a run failed, 2 bad usage or bad graph, 3 cancelled. */
int qmat_status_exit_code(qmat_status status);

#ifdef __cplusplus
}
#endif

#endif
