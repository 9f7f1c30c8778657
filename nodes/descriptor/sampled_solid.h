/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_DESCRIPTOR_SAMPLED_SOLID_H
#define QMAT_NODES_DESCRIPTOR_SAMPLED_SOLID_H

/* The first inputs of the nodes that make or change a medial mesh of a sampled solid. */
#define QMAT_SAMPLED_SOLID_INPUTS                                                               \
  {.name = "mesh", .type = QMAT_MESH, .doc = "The closed surface"},                             \
      {.name = "thickness", .type = QMAT_FIELD, .doc = "Thickness per facet, from mesh.sdf"}, { \
    .name = "samples", .type = QMAT_SAMPLES, .doc = "Points on the surface, from mesh.sample"   \
  }

#endif
