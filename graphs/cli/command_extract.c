/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>

#include "graphs/cli/command.h"
#include "graphs/run/run_paths.h"
#include "io/extract.h"
#include "io/mesh/ma.h"
#include "io/mesh/ply_medial.h"
#include "io/model.h"
#include "io/save.h"

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  const char *from = invocation->arguments[0], *to = qmat_invocation_value(invocation, "output");
  if (!to) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the output path is missing");
    return qmat_fail_hint(context, "-o PATH");
  }
  if (qmat_is_stream(to)) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the medial mesh needs the path of a file, not '%s'", qmat_show(to).text);
    return qmat_fail_hint(context, "-o FILE.ma");
  }
  const qmat_format format = qmat_format_of_name(to);
  if (format != QMAT_FORMAT_MA && format != QMAT_FORMAT_PLY) {
    qmat_fail(context, QMAT_ERROR_USAGE, "'%s' has none of the known endings: .ma, .ply", qmat_show(to).text);
    return qmat_fail_field(context, "--output");
  }
  if (qmat_same_file(from, to))
    return qmat_fail(context, QMAT_ERROR_USAGE, "'%s' would overwrite the file that is read", qmat_show(to).text);
  qmat_medial *medial;
  qmat_file *file = NULL;
  qmat_status status = qmat_medial_extract(context, from, qmat_invocation_value(invocation, "node"), &medial, NULL);
  if (status != QMAT_OK) return status;
  status = format == QMAT_FORMAT_MA ? qmat_ma_write(context, medial, &file)
                                    : qmat_ply_write_medial(context, medial, NULL, &file);
  if (status == QMAT_OK) status = qmat_file_save(context, file, to);
  if (status == QMAT_OK && !qmat_invocation_value(invocation, "quiet")) {
    printf("%s: %zu spheres, %zu cones, %zu slabs -> %s\n", qmat_show(from).text, medial->sphere_count,
           medial->edge_count, medial->triangle_count, qmat_show(to).text);
  }
  if (file) qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  return status;
}

static const qmat_option options[] = {
    {"output", 'o', "PATH", "Save the medial mesh; the ending chooses the format: .ma or .ply"},
    {"node", 0, "NAME", "The node or prim whose medial mesh to extract, if several have one; a prim also by its path"},
    {"quiet", 'q', NULL, "Print nothing but errors"},
    {0},
};

const qmat_command qmat_command_extract = {
    .name = "extract",
    .arguments = "FILE -o OUTPUT",
    .summary = "Extract a medial mesh from a glTF or USD file",
    .doc =
        "Reads a glTF or USD file that qmat wrote, even if other programs have changed the rest of it, and saves its "
        "medial mesh in the space of the node that carries it. The counts that the file states are checked.",
    .options = options,
    .least = 1,
    .most = 1,
    .run = run,
};
