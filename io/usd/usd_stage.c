/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_stage.h"

#include <string.h>

#include "io/usd/usd_arcs.h"

typedef qmat_usd_node node;
typedef qmat_usd_composer composer;

struct qmat_usd_stage {
  qmat_usd_log log;
  qmat_usd_files files;
  char *path;
  size_t nodes_made;
};

/* ---- opening and closing ---- */

qmat_status qmat_usd_stage_open(qmat_context *context, const qmat_bytes *bytes, const char *path,
                                qmat_usd_stage **stage) {
  *stage = NULL;
  qmat_usd_stage *made = qmat_calloc(1, sizeof *made);
  if (!made) return qmat_fail_memory(context, "a USD stage");
  made->path = qmat_strdup(path);
  made->log = (qmat_usd_log){.context = context, .file = made->path, .warnings = json_array()};
  const qmat_usd_prim root = {.log = &made->log, .name = ""};
  qmat_status status = made->path && made->log.warnings ? QMAT_OK : qmat_fail_memory(context, "a USD stage");
  if (status == QMAT_OK) status = qmat_usd_files_open(&made->files, &root, bytes, path);
  if (status == QMAT_OK) {
    *stage = made;
  } else {
    qmat_usd_stage_close(made);
  }
  return status;
}

void qmat_usd_stage_close(qmat_usd_stage *stage) {
  if (!stage) return;
  qmat_usd_files_uninit(&stage->files);
  json_decref(stage->log.warnings);
  qmat_free(stage->path);
  qmat_free(stage);
}

const qmat_usd_layer *qmat_usd_stage_root_layer(const qmat_usd_stage *stage) {
  return stage->files.stacks[0].layers[0];
}

size_t qmat_usd_stage_layer_count(const qmat_usd_stage *stage) {
  return stage->files.layers_read;
}

size_t qmat_usd_stage_bytes(const qmat_usd_stage *stage) {
  return stage->files.bytes_read;
}

const qmat_usd_files *qmat_usd_stage_files(const qmat_usd_stage *stage) {
  return &stage->files;
}

json_t *qmat_usd_stage_warnings(const qmat_usd_stage *stage) {
  return stage->log.warnings;
}

void qmat_usd_stage_forget_warnings(qmat_usd_stage *stage) {
  json_array_clear(stage->log.warnings);
  stage->log.count = 0;
}

/* ---- prims ---- */

static size_t count_specs(const node *at) {
  size_t count = at->spec_count;
  for (const node *child = at->first_child; child; child = child->next) count += count_specs(child);
  return count;
}

/* Lists the opinions of a tree from strong to weak: with `wanted` those through a specialize arc, else the others. */
static void list_opinions(const qmat_usd_files *files, const node *at, bool inherited, bool specialized, bool wanted,
                          int introduced, qmat_usd_opinion *opinions, size_t *count) {
  inherited = inherited || at->arc == QMAT_USD_ARC_INHERIT || at->arc == QMAT_USD_ARC_SPECIALIZE;
  specialized = specialized || at->arc == QMAT_USD_ARC_SPECIALIZE;
  if (at->arc != QMAT_USD_ARC_VARIANT) introduced = at->introduced; /* variants have the paths of their prim */
  for (size_t i = 0; i < at->spec_count && specialized == wanted; i++)
    opinions[(*count)++] = (qmat_usd_opinion){
        .layer = at->layers[i],
        .spec = at->specs[i],
        .is_inherited = inherited,
        .introduced = introduced,
        .arc_depth = at->introduced,
        .variant = at->variant,
        .time = qmat_usd_time_through(at->time, qmat_usd_stack_time(&files->stacks[at->stack], at->layers[i]))};
  for (const node *child = at->first_child; child; child = child->next)
    list_opinions(files, child, inherited, specialized, wanted, introduced, opinions, count);
}

static qmat_status finish_prim(composer *c) {
  qmat_usd_prim *prim = c->prim;
  qmat_usd_opinion *opinions = qmat_arena_alloc(&prim->arena, count_specs(prim->tree), sizeof *opinions);
  if (!opinions) return qmat_usd_fail_prim_memory(c->prim);
  /* Opinions through specialize arcs are the weakest of all. */
  list_opinions(c->files, prim->tree, false, false, false, 0, opinions, &prim->opinion_count);
  list_opinions(c->files, prim->tree, false, false, true, 0, opinions, &prim->opinion_count);
  prim->opinions = opinions;
  /* Instances share what their own arcs bring. What layers above say of the prims below an instance does not count. */
  bool has_arcs = false;
  for (size_t i = 0; i < prim->opinion_count; i++) has_arcs = has_arcs || opinions[i].arc_depth == prim->depth;
  if (has_arcs && qmat_usd_truth(qmat_usd_prim_field(prim, "instanceable"), false)) prim->least_arc_depth = prim->depth;
  return QMAT_OK;
}

qmat_status qmat_usd_stage_root(qmat_usd_stage *stage, qmat_usd_prim *prim) {
  *prim = (qmat_usd_prim){.log = &stage->log, .name = ""};
  composer c = {.files = &stage->files, .prim = prim, .nodes_made = &stage->nodes_made};
  const qmat_usd_stack *stack = &stage->files.stacks[0];
  qmat_status status = qmat_usd_new_node(&c, NULL, QMAT_USD_ARC_ROOT, 0, stack->count, &prim->tree);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < stack->count; i++) qmat_usd_add_spec(prim->tree, stack->layers[i], stack->layers[i]->root);
  return finish_prim(&c);
}

qmat_status qmat_usd_prim_child(qmat_usd_stage *stage, const qmat_usd_prim *parent, const char *name,
                                qmat_usd_prim *child) {
  *child = (qmat_usd_prim){.log = &stage->log, .parent = parent, .name = name, .depth = parent->depth + 1};
  composer c = {.files = &stage->files, .prim = child, .nodes_made = &stage->nodes_made};
  if (child->depth > QMAT_USD_DEEPEST)
    return qmat_usd_prim_fail(child, "prims are nested more than %d deep", QMAT_USD_DEEPEST);
  qmat_status status = qmat_usd_copy_tree(&c, parent->tree, NULL, name, parent->least_arc_depth, &child->tree);
  if (status == QMAT_OK && !child->tree)
    return qmat_fail(stage->log.context, QMAT_ERROR_INTERNAL, "a prim of USD has no opinions");
  if (status == QMAT_OK) status = qmat_usd_add_arcs_of_copies(&c, child->tree);
  if (status == QMAT_OK) status = qmat_usd_add_variants(&c);
  return status == QMAT_OK ? finish_prim(&c) : status;
}

/* ---- prims by path ---- */

/* Visits the prim at the rest of a path below `above`. */
static qmat_status visit_below(qmat_usd_stage *stage, qmat_usd_prim *above, const char *path, qmat_usd_visit visit,
                               void *user, bool *found) {
  if (*path == '\0') {
    *found = true;
    return visit(user, above);
  }
  const size_t length = strcspn(++path, "/");
  const char *name;
  qmat_status status = qmat_usd_prim_find_child(above, path, length, &name);
  if (status != QMAT_OK || !name) return status;
  qmat_usd_prim child;
  status = qmat_usd_prim_child(stage, above, name, &child);
  if (status == QMAT_OK) status = visit_below(stage, &child, path + length, visit, user, found);
  qmat_usd_prim_uninit(&child);
  return status;
}

qmat_status qmat_usd_stage_visit(qmat_usd_stage *stage, const char *path, qmat_usd_visit visit, void *user,
                                 bool *found) {
  qmat_usd_prim root = {0};
  *found = false;
  qmat_status status = qmat_usd_stage_root(stage, &root);
  if (status == QMAT_OK && *path == '/') status = visit_below(stage, &root, path, visit, user, found);
  qmat_usd_prim_uninit(&root);
  return status;
}
