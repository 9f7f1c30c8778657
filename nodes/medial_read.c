/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.read: a medial mesh from a file. */
#include "core/node.h"
#include "io/extract.h"

typedef struct medial_read_params {
  const char *path, *node;
} medial_read_params;

static const qmat_param params[] = {{.name = "path",
                                     .doc = "The medial mesh: a .ma file, or a glTF, USD or PLY file that has one",
                                     .unit = "",
                                     .type = QMAT_PARAM_PATH,
                                     .flags = QMAT_PARAM_REQUIRED | QMAT_PARAM_INPUT_FILE,
                                     .offset = offsetof(medial_read_params, path)},
                                    {.name = "node",
                                     .doc = "The name or number of the node or prim, if several have a medial mesh",
                                     .unit = "",
                                     .type = QMAT_PARAM_STRING,
                                     .default_text = "",
                                     .offset = offsetof(medial_read_params, node)},
                                    {0}};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "Its spheres, edges and triangles, sorted"}, {0}};

static qmat_status run(qmat_context *context, const void *raw_params, const qmat_value *const inputs[],
                       qmat_value *made[]) {
  (void)inputs;
  const medial_read_params *p = raw_params;
  qmat_medial *medial;
  const qmat_status status =
      qmat_medial_extract(context, p->path, p->node && p->node[0] ? p->node : NULL, &medial, NULL);
  if (status == QMAT_OK) made[0] = &medial->base;
  return status;
}

const qmat_node qmat_node_medial_read = {
    .name = "medial.read",
    .version = 4,
    .summary = "Reads a medial mesh from a .ma, glTF, USD or PLY file",
    .doc =
        "Checks numbers and indices. Sorts edges and triangles, leaves out duplicates, and adds the edges of triangles "
        "that the file lacks. In glTF it reads qmat_data in the extras of a node, or qmat_flat where there is no "
        "qmat_data; "
        "where a node has both, they must agree.",
    .citation = "",
    .params_size = sizeof(medial_read_params),
    .params = params,
    .outputs = outputs,
    .run = run,
};
