/* SPDX-License-Identifier: GPL-3.0-or-later */
/* mesh.scale: the same surface in another unit. */
#include <string.h>

#include "core/node.h"

typedef struct mesh_scale_params {
  double factor;
} mesh_scale_params;

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const mesh_scale_params *params = data;
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  qmat_status status;
  qmat_mesh *scaled = qmat_mesh_new();
  if (scaled) {
    scaled->positions = qmat_alloc(3 * mesh->vertex_count, sizeof *scaled->positions);
    scaled->triangles = qmat_alloc(3 * mesh->triangle_count, sizeof *scaled->triangles);
  }
  if (!scaled || !scaled->positions || !scaled->triangles) {
    status = qmat_fail_memory(context, "the scaled mesh");
    goto done;
  }
  scaled->vertex_count = mesh->vertex_count;
  scaled->triangle_count = mesh->triangle_count;
  scaled->sheet_triangle_count = mesh->sheet_triangle_count;
  scaled->flap_triangle_count = mesh->flap_triangle_count;
  scaled->sheet_thickness = params->factor * mesh->sheet_thickness;
  scaled->closed = mesh->closed;
  scaled->oriented = mesh->oriented;
  scaled->deviation = params->factor * mesh->deviation;
  scaled->meters_per_unit = mesh->meters_per_unit / params->factor;
  for (size_t i = 0; i < 3 * mesh->vertex_count; i++) scaled->positions[i] = params->factor * mesh->positions[i];
  memcpy(scaled->triangles, mesh->triangles, 3 * mesh->triangle_count * sizeof *scaled->triangles);
  status = qmat_value_seal(context, &scaled->base); /* a coordinate that overflows is found here */
done:
  if (status == QMAT_OK) {
    outputs[0] = &scaled->base;
  } else if (scaled) {
    qmat_value_release(&scaled->base);
  }
  return status;
}

static const qmat_param params[] = {
    QMAT_FLOAT(mesh_scale_params, factor, "1", 1, 1e-12, 1e12,
               "What lengths are multiplied by: 0.001 turns millimetres into metres"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "Any surface"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The same triangles in the new unit"},
    {0},
};

const qmat_node qmat_node_mesh_scale = {
    .name = "mesh.scale",
    .version = 1,
    .summary = "Multiplies the lengths of a mesh",
    .doc =
        "For models whose unit is not the one that the result is wanted in. Vertices and triangles keep their order.",
    .citation = "",
    .params_size = sizeof(mesh_scale_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .run = run,
};
