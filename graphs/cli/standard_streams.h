/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CLI_STANDARD_STREAMS_H
#define QMAT_GRAPHS_CLI_STANDARD_STREAMS_H

#include <jansson.h>

#include "core/context.h"

/* "-" as the name of a file: the standard input or output, through a temporary folder. A file that is read several
 * times, or written with others, cannot be a pipe. */
typedef struct qmat_streams {
  char folder[4096]; /* "": none is needed yet */
  char input[4110];  /* "": the standard input has not been read */
  char output[4170]; /* "": nothing goes to the standard output */
} qmat_streams;

/* What messages call the standard input. */
#define QMAT_STREAM_NAME "standard input"

/* Whether a path names a standard stream: "-", or "-.ma" for one with a format. */
bool qmat_is_stream(const char *path);

/* Copies the standard input to a file; a second call gives the same file. QMAT_ERROR_IO; QMAT_CANCELLED
 * by a signal. */
qmat_status qmat_streams_read(qmat_context *context, qmat_streams *streams, const char **path);

/* The file that goes to the standard output, of that name in the temporary folder. QMAT_ERROR_USAGE: there is one
 * already. */
qmat_status qmat_streams_write(qmat_context *context, qmat_streams *streams, const char *ending, const char **path);

/* Copies that file to the standard output. */
qmat_status qmat_streams_flush(qmat_context *context, const qmat_streams *streams);

/* Names the stream in an error about its file, whose path nobody knows. */
void qmat_streams_name(const qmat_streams *streams, qmat_error *error);

/* The same for each text of a report that is the path of that file: "-". */
void qmat_streams_name_in(const qmat_streams *streams, json_t *report);

/* Removes the folder, and names the stream in an error about its file. */
void qmat_streams_close(qmat_context *context, qmat_streams *streams);

#endif
