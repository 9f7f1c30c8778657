/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_kept_scene.h"

#include <string.h>

#include "io/usd/usd_files.h"
#include "io/usd/usdz.h"

qmat_status qmat_usd_kept_scene_open(qmat_context *context, const qmat_file_part *part, qmat_usd_kept_scene *kept) {
  *kept = (qmat_usd_kept_scene){.prims = qmat_calloc(QMAT_USD_DEEPEST + 1, sizeof *kept->prims)};
  if (!kept->prims) return qmat_fail_memory(context, "the output file");
  qmat_bytes bytes = {.data = part->bytes, .size = part->size};
  if (!qmat_usdz_is_package(part->bytes, part->size)) {
    /* A package refers to nothing outside of it. */
    qmat_usdz_put(&kept->package, "scene.usd", part->bytes, part->size);
    if (kept->package.failed) return qmat_fail_memory(context, "the output file");
    bytes = (qmat_bytes){.data = kept->package.bytes, .size = kept->package.size};
  }
  const qmat_status status = qmat_usd_stage_open(context, &bytes, "the scene", &kept->stage);
  return status == QMAT_OK ? qmat_usd_stage_root(kept->stage, &kept->prims[0]) : status;
}

/* Closes the prims below a depth. */
static void close_prims(qmat_usd_kept_scene *kept, size_t depth) {
  for (; kept->depth > depth; kept->depth--) qmat_usd_prim_uninit(&kept->prims[kept->depth]);
}

void qmat_usd_kept_scene_close(qmat_usd_kept_scene *kept) {
  if (kept->prims) {
    close_prims(kept, 0);
    qmat_usd_prim_uninit(&kept->prims[0]);
  }
  qmat_free(kept->prims);
  qmat_usd_stage_close(kept->stage);
  qmat_writer_uninit(&kept->package);
  qmat_arena_uninit(&kept->arena);
  *kept = (qmat_usd_kept_scene){0};
}

/* Composes the prims of a path, but for those that are open. `*found`: all of them are there. */
static qmat_status open_prims(qmat_usd_kept_scene *kept, const char *path, bool *found) {
  size_t depth = 0;
  *found = true;
  while (*path && *found) {
    const size_t length = strcspn(++path, "/");
    const char *open = depth < kept->depth ? kept->prims[depth + 1].name : NULL;
    if (!open || strncmp(open, path, length) != 0 || open[length] != '\0') {
      const char *name;
      close_prims(kept, depth);
      qmat_status status = qmat_usd_prim_find_child(&kept->prims[depth], path, length, &name);
      if (status != QMAT_OK) return status;
      *found = name && depth < QMAT_USD_DEEPEST;
      if (!*found) return QMAT_OK;
      kept->depth = depth + 1;
      status = qmat_usd_prim_child(kept->stage, &kept->prims[depth], name, &kept->prims[depth + 1]);
      if (status != QMAT_OK) return status;
    }
    path += length;
    depth++;
  }
  close_prims(kept, depth);
  return QMAT_OK;
}

/* Lists the children that are active medial meshes. */
static qmat_status list_medials(qmat_usd_kept_scene *kept, qmat_usd_prim *prim, qmat_usd_kept_prim *kept_prim) {
  const char *const *names;
  size_t count;
  qmat_status status = qmat_usd_prim_children(prim, &names, &count);
  const char **medials = status == QMAT_OK ? qmat_arena_alloc(&kept->arena, count, sizeof *medials) : NULL;
  if (status == QMAT_OK && !medials) status = qmat_usd_fail_prim_memory(prim);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    qmat_usd_prim child;
    status = qmat_usd_prim_child(kept->stage, prim, names[i], &child);
    if (status == QMAT_OK && qmat_usd_prim_is_medial(&child) &&
        qmat_usd_truth(qmat_usd_prim_field(&child, "active"), true))
      medials[kept_prim->medial_count++] = names[i];
    qmat_usd_prim_uninit(&child);
  }
  kept_prim->medials = medials;
  return status;
}

/* The variant with the strongest opinion about the prim's type, or about an attribute that its shape depends on. */
static const qmat_usd_spec *find_variant(const qmat_usd_prim *prim) {
  static const char *const names[] = {"points", "faceVertexCounts", "faceVertexIndices", "size", "radius", "height"};
  enum { NAMES = sizeof names / sizeof *names };
  bool is_known[NAMES + 1] = {false};
  for (size_t i = 0; i < prim->opinion_count; i++) {
    const qmat_usd_opinion *opinion = &prim->opinions[i];
    for (size_t k = 0; k <= NAMES; k++) {
      const bool has = k < NAMES ? qmat_usd_child(opinion->layer, opinion->spec, QMAT_USD_ATTRIBUTE, names[k]) != NULL
                                 : qmat_usd_field_value(opinion->spec, "typeName") != NULL;
      if (has && !is_known[k] && opinion->variant) return opinion->variant;
      is_known[k] = is_known[k] || has;
    }
  }
  return NULL;
}

/* Whether samples of a transform operation differ. Exporters write a sample per frame of what stays, too. */
static bool has_changing_samples(const qmat_usd_samples *samples) {
  const qmat_usd_value *first = NULL;
  for (size_t i = 0; i < samples->count; i++) {
    const qmat_usd_value *value = samples->values[i];
    if (value->is_array || !qmat_usd_is_number(value->type)) continue;
    if (!first) first = value;
    if (value->components != first->components) return true;
    for (size_t k = 0; k < value->components; k++)
      if (value->numbers[k] != first->numbers[k]) return true;
  }
  return false;
}

/* Whether an operation of the prim's own transform changes over time. `*resets`: what is above does not matter. */
static qmat_status find_motion(const qmat_usd_prim *prim, bool *moves, bool *resets) {
  static const char invert[] = "!invert!";
  const qmat_usd_value *order;
  const qmat_status status = qmat_usd_prim_attribute(prim, "xformOpOrder", &order);
  if (status != QMAT_OK || !order || !order->is_array || !qmat_usd_is_text(order->type)) return status;
  for (size_t i = order->count; i-- > 0 && !*resets;) { /* operations before a reset do not matter either */
    const char *name = order->texts[i];
    const qmat_usd_samples *samples;
    const qmat_usd_value *fixed;
    qmat_usd_time time;
    *resets = strcmp(name, "!resetXformStack!") == 0;
    if (strncmp(name, invert, sizeof invert - 1) == 0) name += sizeof invert - 1;
    qmat_usd_prim_samples(prim, name, &samples, &time, &fixed);
    *moves = *moves || (samples && has_changing_samples(samples));
  }
  return QMAT_OK;
}

/* Whether the transform of the prim, or of one above it, changes over time. */
static qmat_status find_animated(const qmat_usd_prim *prim, bool *is_animated) {
  qmat_status status = QMAT_OK;
  bool resets = false;
  for (; prim && !resets && !*is_animated && status == QMAT_OK; prim = prim->parent)
    status = find_motion(prim, is_animated, &resets);
  return status;
}

qmat_status qmat_usd_kept_scene_find(qmat_usd_kept_scene *kept, const char *path, qmat_usd_kept_prim *kept_prim) {
  bool found;
  *kept_prim = (qmat_usd_kept_prim){0};
  qmat_status status = open_prims(kept, path, &found);
  if (status != QMAT_OK || !found) return status;
  qmat_usd_prim *prim = &kept->prims[kept->depth];
  status = qmat_progress(prim->log->context, 1, 0, "prims");
  if (status != QMAT_OK) return status;
  kept_prim->variant = find_variant(prim);
  status = find_animated(prim, &kept_prim->is_animated);
  if (status != QMAT_OK) return status;
  return list_medials(kept, prim, kept_prim);
}

/* Whether a prim in a layer has a name that begins so. */
static bool has_stem(const qmat_usd_spec *root, const char *stem) {
  const size_t length = strlen(stem);
  for (const qmat_usd_spec *spec = root; spec;) {
    if (spec->kind == QMAT_USD_PRIM && strncmp(spec->name, stem, length) == 0) return true;
    const qmat_usd_spec *next = spec->first_child;
    for (; !next && spec != root; spec = spec->parent) next = spec->next;
    if (spec == root && !next) return false;
    spec = next;
  }
  return false;
}

bool qmat_usd_kept_scene_has_stem(const qmat_usd_kept_scene *kept, const char *stem) {
  const qmat_usd_files *files = qmat_usd_stage_files(kept->stage);
  for (size_t i = 0; i < files->file_count; i++) {
    const char *path;
    const qmat_usd_layer *layer;
    bool is_member;
    qmat_usd_files_at(files, i, &path, &layer, &is_member);
    if (layer && has_stem(layer->root, stem)) return true;
  }
  return false;
}
