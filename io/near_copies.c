/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/near_copies.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"

/* Vertices of copies are at most so many diagonals apart. Single precision has 2^-24 of a coordinate; the transforms
 * that copies went through lose some bits. */
static const double nearness = 2e-6;

static bool are_equal(const void *a, const void *b, size_t bytes) {
  return bytes == 0 || memcmp(a, b, bytes) == 0;
}

/* Whether two meshes have the same counts and marks. A subdivision surface has a cage with positions of its own. */
static bool count_alike(const qmat_mesh *a, const qmat_mesh *b) {
  return a->vertex_count == b->vertex_count && a->triangle_count == b->triangle_count &&
         a->sheet_triangle_count == b->sheet_triangle_count && a->flap_triangle_count == b->flap_triangle_count &&
         a->sheet_thickness == b->sheet_thickness && a->closed == b->closed && a->oriented == b->oriented &&
         a->deviation == b->deviation && a->meters_per_unit == b->meters_per_unit &&
         a->skinned_count == b->skinned_count && a->cage.face_count == 0 && b->cage.face_count == 0;
}

/* Whether two meshes that count alike have the same triangles and skins. */
static bool are_joined_alike(const qmat_mesh *a, const qmat_mesh *b) {
  return are_equal(a->triangles, b->triangles, 3 * a->triangle_count * sizeof *a->triangles) &&
         are_equal(a->joints, b->joints, 4 * a->skinned_count * sizeof *a->joints) &&
         are_equal(a->weights, b->weights, 4 * a->skinned_count * sizeof *a->weights);
}

/* The largest distance between vertices with the same number. One beyond `most` ends the search. */
static double largest_move(const qmat_mesh *a, const qmat_mesh *b, double most) {
  double largest = 0;
  for (size_t v = 0; v < a->vertex_count && largest <= most; v++)
    largest = fmax(largest, qmat_point_distance(&a->positions[3 * v], &b->positions[3 * v]));
  return largest;
}

/* A mesh without a cage again, with another deviation; NULL on failure. */
static qmat_mesh *with_deviation(qmat_context *context, const qmat_mesh *mesh, double deviation) {
  qmat_mesh *made = qmat_mesh_new();
  if (!made) return NULL;
  const struct {
    void **to;
    const void *from;
    size_t bytes;
  } arrays[] = {
      {(void **)&made->positions, mesh->positions, 3 * mesh->vertex_count * sizeof *mesh->positions},
      {(void **)&made->triangles, mesh->triangles, 3 * mesh->triangle_count * sizeof *mesh->triangles},
      {(void **)&made->joints, mesh->joints, 4 * mesh->skinned_count * sizeof *mesh->joints},
      {(void **)&made->weights, mesh->weights, 4 * mesh->skinned_count * sizeof *mesh->weights},
  };
  made->vertex_count = mesh->vertex_count;
  made->triangle_count = mesh->triangle_count;
  made->sheet_triangle_count = mesh->sheet_triangle_count;
  made->flap_triangle_count = mesh->flap_triangle_count;
  made->sheet_thickness = mesh->sheet_thickness;
  made->closed = mesh->closed;
  made->oriented = mesh->oriented;
  made->deviation = deviation;
  made->meters_per_unit = mesh->meters_per_unit;
  made->skinned_count = mesh->skinned_count;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < sizeof arrays / sizeof arrays[0] && status == QMAT_OK; i++) {
    if (!arrays[i].from) continue;
    *arrays[i].to = qmat_alloc(arrays[i].bytes, 1);
    if (*arrays[i].to)
      memcpy(*arrays[i].to, arrays[i].from, arrays[i].bytes);
    else
      status = qmat_fail_memory(context, "the meshes of a scene");
  }
  if (status == QMAT_OK) status = qmat_value_seal(context, &made->base);
  if (status == QMAT_OK) return made;
  qmat_value_release(&made->base);
  return NULL;
}

/* A mesh that is no copy of an earlier one, and whether a copy differs from it. */
typedef struct original {
  size_t item;
  double nearest; /* the distance up to which a mesh is a copy */
  bool is_varied;
} original;

/* Lists the meshes that are no copies. `of` gets for each item the number of its original, SIZE_MAX for a failure. */
static size_t find_originals(const qmat_list *list, original *originals, size_t *of) {
  size_t count = 0;
  for (size_t i = 0; i < list->count; i++) {
    of[i] = SIZE_MAX;
    if (list->items[i]->type != QMAT_MESH) continue;
    const qmat_mesh *mesh = (const qmat_mesh *)list->items[i];
    for (size_t k = 0; k < count && of[i] == SIZE_MAX; k++) {
      const qmat_mesh *first = (const qmat_mesh *)list->items[originals[k].item];
      if (!count_alike(first, mesh)) continue;
      /* Positions first: those of other meshes mostly differ from the first vertex on. */
      const double move = largest_move(first, mesh, originals[k].nearest);
      if (!(move <= originals[k].nearest) || !are_joined_alike(first, mesh)) continue;
      of[i] = k;
      originals[k].is_varied |= move > 0;
    }
    if (of[i] < SIZE_MAX) continue;
    of[i] = count;
    originals[count++] = (original){.item = i, .nearest = nearness * qmat_mesh_diagonal(mesh)};
  }
  return count;
}

/* The mesh that most copies equal, and of several such ones the first. */
static size_t most_common(const qmat_list *list, size_t first, const size_t *of) {
  size_t best = first, most = 0;
  for (size_t i = first; i < list->count; i++) {
    size_t equal = 0;
    for (size_t k = i; k < list->count && of[i] == of[first]; k++)
      equal += of[k] == of[i] && qmat_digest_equal(&list->items[k]->digest, &list->items[i]->digest);
    if (equal > most) best = i;
    most = equal > most ? equal : most;
  }
  return best;
}

static qmat_status note_copy(qmat_context *context, const json_t *reports, size_t copy, const char *name) {
  const int failed = json_object_set_new(json_array_get(reports, copy), "near_copy_of", json_string(name));
  return failed ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

/* Puts one mesh, with a deviation that covers its copies, in the place of all of them. */
static qmat_status unite(qmat_context *context, qmat_list *list, const json_t *reports, size_t first,
                         const size_t *of) {
  const size_t number = of[first], chosen = most_common(list, first, of);
  const qmat_mesh *kept = (const qmat_mesh *)list->items[chosen];
  qmat_status status = QMAT_OK;
  double farthest = 0;
  for (size_t i = first; i < list->count && status == QMAT_OK; i++) {
    if (of[i] != number || qmat_digest_equal(&list->items[i]->digest, &kept->base.digest)) continue;
    farthest = fmax(farthest, largest_move(kept, (const qmat_mesh *)list->items[i], INFINITY));
    status = note_copy(context, reports, i, list->names[chosen]);
  }
  qmat_mesh *made = status == QMAT_OK ? with_deviation(context, kept, kept->deviation + farthest) : NULL;
  if (!made) return context->error.status;
  for (size_t i = first; i < list->count; i++) {
    if (of[i] != number) continue;
    qmat_value_release(list->items[i]);
    list->items[i] = qmat_value_retain(&made->base);
  }
  qmat_value_release(&made->base);
  return QMAT_OK;
}

qmat_status qmat_near_copies_merge(qmat_context *context, qmat_list *list, const json_t *reports) {
  original *originals = qmat_alloc(list->count, sizeof *originals);
  size_t *of = qmat_alloc(list->count, sizeof *of);
  qmat_status status = originals && of ? QMAT_OK : qmat_fail_memory(context, "the meshes of a scene");
  const size_t count = status == QMAT_OK ? find_originals(list, originals, of) : 0;
  for (size_t k = 0; k < count && status == QMAT_OK; k++)
    if (originals[k].is_varied) status = unite(context, list, reports, originals[k].item, of);
  qmat_free(originals);
  qmat_free(of);
  return status;
}
