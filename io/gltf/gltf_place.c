/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_place.h"

#include "io/gltf/gltf_asset.h"
#include "io/placement.h"

/* Sets a node's matrix, unless it is the identity. */
static bool set_matrix(json_t *node, const double m[16]) {
  bool is_identity = true;
  json_t *matrix = json_array();
  bool done = matrix != NULL;
  for (int i = 0; i < 16 && done; i++) {
    is_identity = is_identity && m[i] == (i % 5 == 0);
    done = json_array_append_new(matrix, json_real(m[i])) == 0;
  }
  if (done && !is_identity) return qmat_gltf_set(node, "matrix", matrix);
  json_decref(matrix);
  return done;
}

bool qmat_gltf_place(json_t *root, json_t *node, const double m[16], json_int_t *number, json_int_t *top) {
  double inner[16], outer[16];
  const bool is_plain = qmat_placement_is_plain(m);
  if (!is_plain) qmat_placement_split(m, inner, outer);
  bool done = node && set_matrix(node, is_plain ? m : inner);
  done = qmat_gltf_add(root, "nodes", node, number) && done;
  if (!done) return false;
  *top = *number;
  if (is_plain) return true;
  json_t *above = json_pack("{s:[I]}", "children", *number);
  done = above && set_matrix(above, outer);
  return qmat_gltf_add(root, "nodes", above, top) && done;
}
