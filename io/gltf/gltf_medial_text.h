/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_MEDIAL_TEXT_H
#define QMAT_IO_GLTF_GLTF_MEDIAL_TEXT_H

#include <jansson.h>

#include "io/gltf/gltf_write.h"

/* A medial mesh as the texts of its extras. */
typedef struct qmat_gltf_medial_text {
  char *base64;
  int position_bits, radius_bits;
  const double *origin; /* the spheres are relative to it */
  double loss;          /* measured error of the encoding, model units */
  char *flat;           /* base64 of the plain form; NULL: none */
  bool flat_floats;
  double flat_loss; /* as `loss` */
  bool has_joints;  /* the plain form has the joints of the spheres */
} qmat_gltf_medial_text;

/* Makes the texts. `has_skin`: a node with the mesh has one, which joints refer to. Free with
 * qmat_gltf_medial_text_uninit, also after a failure. QMAT_ERROR_MEMORY, QMAT_ERROR_USAGE, QMAT_ERROR_GEOMETRY. */
qmat_status qmat_gltf_medial_text_init(qmat_context *context, const qmat_medial *medial, const double *origin,
                                       bool has_skin, const qmat_gltf_options *options, qmat_gltf_medial_text *text);
void qmat_gltf_medial_text_uninit(qmat_gltf_medial_text *text);

/* The extras that describe a medial mesh; NULL when out of memory. */
json_t *qmat_gltf_medial_extras(const qmat_medial *medial, const qmat_gltf_medial_text *text,
                                const qmat_stated_errors *stated);

#endif
