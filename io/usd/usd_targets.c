/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Targets of relationships: paths of layers become paths of the scene. */
#include <string.h>

#include "io/usd/usd_prim.h"

/* A list of paths that is edited. */
typedef struct path_list {
  size_t count, capacity;
  const char **paths;
} path_list;

enum { MOST_TARGETS = 1 << 16, MOST_EDITED = 4096 };

const char *qmat_usd_prim_path(const qmat_usd_prim *prim, qmat_arena *arena) {
  size_t size = prim->parent ? 1 : 2;
  for (const qmat_usd_prim *p = prim; p->parent; p = p->parent) size += strlen(p->name) + 1;
  char *path = qmat_arena_alloc(arena, size, 1);
  if (!path) return NULL;
  char *at = path + size - 1;
  *at = '\0';
  if (!prim->parent) *--at = '/';
  for (const qmat_usd_prim *p = prim; p->parent; p = p->parent) {
    at -= strlen(p->name);
    memcpy(at, p->name, strlen(p->name));
    *--at = '/';
  }
  return path;
}

/* The path of a spec in its layer, without variants; NULL when memory is short. */
static const char *spec_path(const qmat_usd_spec *spec, qmat_arena *arena) {
  size_t size = 1;
  for (const qmat_usd_spec *s = spec; s; s = s->parent) size += s->kind == QMAT_USD_PRIM ? strlen(s->name) + 1 : 0;
  char *path = qmat_arena_alloc(arena, size, 1);
  if (!path) return NULL;
  char *at = path + size - 1;
  *at = '\0';
  for (const qmat_usd_spec *s = spec; s; s = s->parent) {
    if (s->kind != QMAT_USD_PRIM) continue;
    at -= strlen(s->name);
    memcpy(at, s->name, strlen(s->name));
    *--at = '/';
  }
  return path;
}

/* The length of a path without its last `count` names. */
static size_t length_above(const char *path, int count) {
  size_t length = strlen(path);
  for (; count > 0 && length > 0; count--) do
      length--;
    while (length > 0 && path[length] != '/');
  return length;
}

/* The absolute path that `target` is below the prim `from`. NULL when memory is short. */
static const char *absolute(const char *from, const char *target, qmat_arena *arena) {
  if (target[0] == '/') return target;
  int up = 0;
  while (strncmp(target, "../", 3) == 0) {
    target += 3;
    up++;
  }
  const size_t length = length_above(from, up), rest = strlen(target);
  char *path = qmat_arena_alloc(arena, length + rest + 2, 1);
  if (!path) return NULL;
  memcpy(path, from, length);
  path[length] = '/';
  memcpy(path + length + 1, target, rest + 1);
  return path;
}

/* Turns a target that an opinion names into a path of the scene. `*mapped` is NULL where it has none. */
static qmat_status map_target(const qmat_usd_prim *prim, const qmat_usd_opinion *opinion, const char *target,
                              qmat_arena *arena, const char **mapped) {
  const char *own = spec_path(opinion->spec, arena), *placed = qmat_usd_prim_path(prim, arena);
  const char *path = own ? absolute(own, target, arena) : NULL;
  *mapped = NULL;
  if (!own || !placed || !path) return qmat_usd_fail_prim_memory(prim);
  /* The prim with the arc and the prim that the arc leads to are equally far above. */
  const size_t from = length_above(own, prim->depth - opinion->introduced),
               to = length_above(placed, prim->depth - opinion->introduced), rest = strlen(path);
  if (rest < from || memcmp(path, own, from) != 0 || (path[from] != '/' && path[from] != '\0'))
    return qmat_usd_warn(prim, "the target <%s> is skipped: it is outside of what is referred to",
                         qmat_usd_shown(target));
  char *made = qmat_arena_alloc(arena, to + rest - from + 1, 1);
  if (!made) return qmat_usd_fail_prim_memory(prim);
  memcpy(made, placed, to);
  memcpy(made + to, path + from, rest - from + 1);
  *mapped = made;
  return QMAT_OK;
}

static void remove_path(path_list *list, const char *path) {
  size_t kept = 0;
  for (size_t i = 0; i < list->count; i++)
    if (strcmp(list->paths[i], path) != 0) list->paths[kept++] = list->paths[i];
  list->count = kept;
}

/* Applies one edit of one opinion. */
static qmat_status apply_edit(const qmat_usd_prim *prim, const qmat_usd_opinion *opinion, const qmat_usd_value *items,
                              qmat_usd_edit edit, qmat_arena *arena, path_list *list) {
  if (items->count > 0 && !qmat_usd_is_text(items->type))
    return qmat_usd_prim_fail(prim, "a relationship has a value of the wrong type");
  if (items->count > MOST_TARGETS - list->count || (edit != QMAT_USD_EXPLICIT && items->count > MOST_EDITED))
    return qmat_usd_prim_fail(prim, "a relationship has too many targets");
  if (qmat_grow((void **)&list->paths, &list->capacity, list->count + items->count, sizeof *list->paths) != 0)
    return qmat_usd_fail_prim_memory(prim);
  size_t front = 0;
  for (size_t i = 0; i < items->count; i++) {
    const char *path;
    const qmat_status status = map_target(prim, opinion, items->texts[i], arena, &path);
    if (status != QMAT_OK) return status;
    if (!path) continue;
    if (edit != QMAT_USD_EXPLICIT) remove_path(list, path);
    if (edit == QMAT_USD_DELETED) continue;
    const size_t at = edit == QMAT_USD_PREPENDED ? front++ : list->count;
    memmove(list->paths + at + 1, list->paths + at, (list->count - at) * sizeof *list->paths);
    list->paths[at] = path;
    list->count++;
  }
  return QMAT_OK;
}

qmat_status qmat_usd_prim_targets(const qmat_usd_prim *prim, const char *name, qmat_arena *arena,
                                  const char *const **targets, size_t *count) {
  static const qmat_usd_edit order[] = {QMAT_USD_DELETED, QMAT_USD_ADDED, QMAT_USD_PREPENDED, QMAT_USD_APPENDED};
  path_list list = {0};
  qmat_status status = QMAT_OK;
  for (size_t i = prim->opinion_count; i-- > 0 && status == QMAT_OK;) {
    const qmat_usd_opinion *opinion = &prim->opinions[i];
    const qmat_usd_spec *spec = qmat_usd_child(opinion->layer, opinion->spec, QMAT_USD_RELATIONSHIP, name);
    const qmat_usd_value *value = spec ? qmat_usd_field_value(spec, "targetPaths") : NULL;
    if (!value || value->type != QMAT_USD_LIST_OP) continue;
    const qmat_usd_list_op *op = value->list_op;
    if (op->is_explicit) {
      list.count = 0;
      status = apply_edit(prim, opinion, &op->lists[QMAT_USD_EXPLICIT], QMAT_USD_EXPLICIT, arena, &list);
      continue;
    }
    for (size_t k = 0; k < sizeof order / sizeof *order && status == QMAT_OK; k++)
      status = apply_edit(prim, opinion, &op->lists[order[k]], order[k], arena, &list);
  }
  const char **made = status == QMAT_OK ? qmat_arena_alloc(arena, list.count, sizeof *made) : NULL;
  if (status == QMAT_OK && !made) status = qmat_usd_fail_prim_memory(prim);
  if (made && list.count > 0) memcpy(made, list.paths, list.count * sizeof *made);
  *targets = made;
  *count = list.count;
  qmat_free(list.paths);
  return status;
}
