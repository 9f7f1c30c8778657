/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_MODEL_H
#define QMAT_IO_MODEL_H

#include "io/bytes.h"
#include "io/soup.h"

/* Files that hold models, told apart by their first bytes and by the endings of their names. */
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

/* The name of a format as people write it ("PLY", "glTF binary"). Never NULL. */
const char *qmat_format_title(qmat_format format);

/* The format that the ending of `path` stands for, in any case. */
qmat_format qmat_format_of_name(const char *path);

/* The format that the bytes of a whole file show, or QMAT_FORMAT_UNKNOWN where they could be several. */
qmat_format qmat_format_of_bytes(const qmat_bytes *bytes);

/* The format of the file: what its bytes show, else what its ending says. QMAT_ERROR_FORMAT when the two disagree or
 * neither is known. `path` is for the ending and for errors. */
qmat_status qmat_format_choose(qmat_context *context, const char *path, const qmat_bytes *bytes, qmat_format *format);

/* The base name of `path` without its ending, as valid UTF-8 (other bytes become U+FFFD); "model" when nothing is left.
 * qmat_free frees it; NULL when memory is short. */
char *qmat_model_name(const char *path);

/* Reads the surface in the file `path` (OFF, OBJ, PLY, STL, glTF, USD): all of its polygons as one mesh, and a report
 * with "format" and what qmat_soup_to_mesh, qmat_gltf_read or qmat_usd_read report. The three values are sealed; the
 * caller releases them; all are NULL on failure, and the error names the file and the place in it. */
qmat_status qmat_model_read(qmat_context *context, const char *path, const qmat_read_options *options,
                            qmat_scene **scene, qmat_mesh **mesh, qmat_report **report);

/* The same, mesh by mesh where the file is glTF: `choice` is "merged" (as qmat_model_read has it), or what
 * qmat_gltf_choose_meshes takes; of other formats, "all" and "merged" are both the whole surface. `*mesh` is a mesh or,
 * of several, a list of them with their names, each in its own space. The scene keeps a glTF asset with the files that
 * it refers to, and which of its meshes these are. Of several meshes the report has a list "meshes", each with its
 * "name", its number "mesh", the number of "nodes" that carry it, and what qmat_soup_to_mesh reports; "warnings" names
 * files that are not copied. QMAT_ERROR_USAGE for a choice that is none. */
qmat_status qmat_model_read_meshes(qmat_context *context, const char *path, const qmat_read_options *options,
                                   const char *choice, qmat_scene **scene, qmat_value **mesh, qmat_report **report);

/* Reads the medial mesh in the .ma file `path`; otherwise as qmat_model_read. */
qmat_status qmat_medial_read(qmat_context *context, const char *path, qmat_medial **medial);

#endif
