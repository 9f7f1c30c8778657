/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_MODEL_H
#define QMAT_IO_MODEL_H

#include "io/bytes.h"
#include "io/soup.h"

/* The formats of model files. */
typedef enum qmat_format {
  QMAT_FORMAT_UNKNOWN,
  QMAT_FORMAT_OFF,
  QMAT_FORMAT_OBJ,
  QMAT_FORMAT_PLY,
  QMAT_FORMAT_STL,
  QMAT_FORMAT_GLTF,
  QMAT_FORMAT_GLB,
  QMAT_FORMAT_MA,
  QMAT_FORMAT_USD, /* all of usd, usda, usdc and usdz */
  QMAT_FORMAT_ZIP, /* any other archive */
  QMAT_FORMAT_COUNT
} qmat_format;

/* The usual name of a format ("PLY", "binary glTF"). Never NULL. */
const char *qmat_format_title(qmat_format format);

/* The format of the file extension of `path`, in upper or lower case; QMAT_FORMAT_UNKNOWN: none. */
qmat_format qmat_format_of_name(const char *path);

/* The format recognised from the content of a file; QMAT_FORMAT_UNKNOWN: none. */
qmat_format qmat_format_of_bytes(const qmat_bytes *bytes);

/* The format of a file, from its content, or else from its extension. QMAT_ERROR_FORMAT if the two disagree or the
 * format is not supported. `path` is for the extension and for errors. */
qmat_status qmat_format_choose(qmat_context *context, const char *path, const qmat_bytes *bytes, qmat_format *format);

/* The base name of `path` without its extension, as valid UTF-8 (invalid bytes become U+FFFD); "model" if that is
 * empty. The caller frees it with qmat_free; NULL if memory is short. */
char *qmat_model_name(const char *path);

/* Reads all polygons of the file `path` (OFF, OBJ, PLY, STL, glTF, USD) as one mesh. The report has "format" and the
 * keys of qmat_soup_to_mesh, qmat_gltf_read or qmat_usd_read. The three values are sealed; the caller releases them.
 * All are NULL on failure. Errors name the file and the place in it. */
qmat_status qmat_model_read(qmat_context *context, const char *path, const qmat_read_options *options,
                            qmat_scene **scene, qmat_mesh **mesh, qmat_report **report);

/* The same, with the meshes of a glTF or USD file read separately. `choice` is "merged" (one mesh, as in
 * qmat_model_read) or a choice of qmat_gltf_choose_meshes or qmat_usd_read_meshes. Other formats accept "all" and
 * "merged", with the same result. `*mesh` is a mesh, or a list of several named meshes, each in its local frame. The
 * scene stores a glTF asset with the files that it refers to, the numbers of the chosen meshes, and the places of USD
 * meshes. For several meshes the report has a list "meshes", each with its "name", its number "mesh", the number of
 * "nodes" that carry it, and the keys of qmat_soup_to_mesh and qmat_near_copies_merge. "warnings" lists files that are
 * not copied and nodes with unusual extras. QMAT_ERROR_USAGE: an invalid choice. */
qmat_status qmat_model_read_meshes(qmat_context *context, const char *path, const qmat_read_options *options,
                                   const char *choice, qmat_scene **scene, qmat_value **mesh, qmat_report **report);

#endif
