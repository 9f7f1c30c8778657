/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_GLTF_GLTF_MEDIAL_TEXT_H
#define QMAT_IO_GLTF_GLTF_MEDIAL_TEXT_H

#include <jansson.h>
#include <stdbool.h>

#include "io/stored_medial.h"

/* How the plain form of a medial mesh (qmat_flat) stores coordinates and radii. */
typedef enum qmat_flat_form {
  QMAT_FLAT_AUTO,  /* 16 bits where they suffice for `quantisation`, else single precision */
  QMAT_FLAT_SHORT, /* 16 bits */
  QMAT_FLAT_FLOAT, /* single precision */
  QMAT_FLAT_NONE   /* there is no plain form */
} qmat_flat_form;

/* How to write a medial mesh, and its known errors. */
typedef struct qmat_gltf_options {
  bool binary;                 /* write a .glb; else a .gltf with its data as base64 */
  bool embed;                  /* for a .glb: embed the files that a scene refers to */
  bool compress_skin;          /* require KHR_draco_mesh_compression: smaller, but some engines reject it */
  int position_bits;           /* 1 to 30; 0: chosen from `quantisation` */
  int radius_bits;             /* the same */
  qmat_flat_form flat;         /* of qmat_flat */
  double quantisation;         /* allowed error of storage, model units; used if bits are 0, and by QMAT_FLAT_AUTO */
  const char *name;            /* of the node and the mesh, UTF-8; NULL or "": none */
  double meters_per_unit;      /* of the medial mesh, for a new asset; 0: unknown, taken for 1 */
  bool is_z_up;                /* the same; else y is up */
  const double *sphere_errors; /* as in qmat_sphere_data; NULL: not known */
  qmat_stated_errors errors;   /* of the given medial mesh */
  qmat_stated_errors *stated;  /* gets the errors that the file states; may be NULL */
} qmat_gltf_options;

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
