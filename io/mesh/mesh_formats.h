/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_MESH_MESH_FORMATS_H
#define QMAT_IO_MESH_MESH_FORMATS_H

#include "io/bytes.h"
#include "io/soup.h"

/* Readers of surface files. Each fills an empty soup from `bytes`, a whole file followed by 16 zero bytes, as
 * qmat_bytes_read_file returns it. `path` is for errors, which have the line and column in text files. Counts in
 * headers are checked against the size of the file before memory is taken. Materials, colours, normals and texture
 * coordinates are skipped. QMAT_ERROR_FORMAT or QMAT_ERROR_MEMORY; the soup then holds part of the file. One thread.
 * Cost: linear. */

/* ASCII OFF, also with normals, colours and texture coordinates (NOFF, COFF, STOFF and combinations). Binary OFF, 4OFF
 * and nOFF are refused. */
qmat_status qmat_off_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup);

/* Wavefront OBJ: all vertices and faces of the file as one surface. Free-form surfaces and calls of other files are
 * refused. */
qmat_status qmat_obj_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup);

/* PLY 1.0, ASCII and binary of either byte order: the elements vertex, face and tristrips; others are skipped. */
qmat_status qmat_ply_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup);

/* STL, ASCII and binary; every facet has three vertices of its own. */
qmat_status qmat_stl_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup);

/* Whether the bytes are a binary STL file: their number matches the facet count in the header. */
bool qmat_stl_is_binary(const qmat_bytes *bytes);

#endif
