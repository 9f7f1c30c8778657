/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_CONTEXT_H
#define QMAT_CORE_CONTEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/arena.h"
#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Where and what went wrong. Empty strings, element -1 and line 0 mean "does not apply". */
typedef struct qmat_error {
  qmat_status status;
  char node_id[64];      /* the node's id in the graph */
  char node_type[64];    /* "medial.simplify" */
  char field[64];        /* parameter, port or option */
  char element_kind[32]; /* "vertex", "facet", "accessor", ... */
  int64_t element;
  char file[512];
  int line, column; /* from 1 */
  char message[512];
  char hint[256];
} qmat_error;

/* Called with the progress of the running node: `done` of `total` units; total is 0 when it is unknown. Returns false
 * to cancel the run. Called from the thread that runs the node, never from two threads at once. */
typedef bool qmat_progress_fn(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                              const char *unit);

/* Called for every file that a node reads: its `size` bytes, or NULL for a file that could not be read. Called from the
 * thread that runs the node. The cache keys a result by the files that were read, so a reader that bypasses
 * qmat_bytes_read_file must call qmat_note_file_read. */
typedef void qmat_file_read_fn(void *user, const char *path, const uint8_t *bytes, size_t size);

/* What a run needs besides its data: errors, progress, scratch memory, thread count. A zeroed context is valid: no
 * progress, all processors. One thread at a time may use it; parallel nodes report from the calling thread only. */
typedef struct qmat_context {
  qmat_error error;
  qmat_progress_fn *progress;
  void *progress_user;
  qmat_file_read_fn *file_read; /* NULL: not needed */
  void *file_read_user;
  int threads;                     /* 0: one per processor */
  qmat_arena arena;                /* scratch memory, freed after each node */
  const char *node_id, *node_type; /* of the running node; NULL when none runs */
  int64_t progress_time;           /* of the last progress call, in monotonic nanoseconds; 0: none yet */
} qmat_context;

/* Frees the context's scratch memory. Works on a zeroed and on a failed context. */
void qmat_context_uninit(qmat_context *context);

/* The number of OpenMP threads to use: context->threads or the number of processors, at least 1. */
int qmat_threads(const qmat_context *context);

/* Passes a file to the context's file_read; see qmat_file_read_fn. */
void qmat_note_file_read(const qmat_context *context, const char *path, const uint8_t *bytes, size_t size);

/* Records an error (status, message, and the running node's names) and returns `status`. It replaces the previous error
 * completely, so add field, element, file and hint afterwards. */
qmat_status qmat_fail(qmat_context *context, qmat_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Additions to the newest error. Each returns its status, for use in a return statement. */
qmat_status qmat_fail_field(qmat_context *context, const char *field);
qmat_status qmat_fail_element(qmat_context *context, const char *kind, int64_t element);
qmat_status qmat_fail_at(qmat_context *context, const char *file, int line, int column);
qmat_status qmat_fail_hint(qmat_context *context, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Prefixes the newest error's message with "what: ", which names one of several items. */
qmat_status qmat_fail_within(qmat_context *context, const char *what);

/* Records QMAT_ERROR_MEMORY; `what` names the data that did not fit ("samples"). */
qmat_status qmat_fail_memory(qmat_context *context, const char *what);

/* Reports progress. QMAT_CANCELLED, recorded, when the progress function asks for a stop; else QMAT_OK. It may be
 * called hundreds of thousands of times a second: the progress function is called at most every 50 ms, and always for
 * done == 0 and done == total. */
qmat_status qmat_progress(qmat_context *context, uint64_t done, uint64_t total, const char *unit);

/* Writes the error on one line: "file:line:column: node 'id' (type): field: element 7: message (hint)".
 * `text` holds `size` bytes; always terminated when size > 0. */
void qmat_error_format(const qmat_error *error, char *text, size_t size);

#ifdef __cplusplus
}
#endif

#endif
