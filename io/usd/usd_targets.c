/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Targets of relationships: paths of layers become paths of the scene. */
#include <string.h>

#include "io/usd/usd_list.h"
#include "io/usd/usd_prim.h"

enum { MOST_TARGETS = 1 << 16, MOST_EDITED = 4096 };

/* Paths of a relationship may have this many bytes together. */
#define MOST_PATH_BYTES ((size_t)1 << 26)

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

/* Turns the targets of one opinion into paths of the scene. */
typedef struct mapper {
  const qmat_usd_prim *prim;
  qmat_arena *arena;
  const char *own, *placed; /* the path of the spec in its layer, and that of the prim in the scene */
  size_t from, to;          /* what an arc replaces: this much of `own` by so much of `placed` */
  size_t capacity;
  char *absolute;     /* the absolute path of a target in the layer */
  size_t *bytes_left; /* that paths may still have */
} mapper;

/* Free the mapper's absolute path, also after a failure. */
static qmat_status start_mapper(mapper *m, const qmat_usd_opinion *opinion) {
  m->own = spec_path(opinion->spec, m->arena);
  m->placed = qmat_usd_prim_path(m->prim, m->arena);
  if (!m->own || !m->placed) return qmat_usd_fail_prim_memory(m->prim);
  /* The prim with the arc and the prim that the arc leads to are equally far above. */
  m->from = length_above(m->own, m->prim->depth - opinion->introduced);
  m->to = length_above(m->placed, m->prim->depth - opinion->introduced);
  return QMAT_OK;
}

/* The absolute path that `target` is below the spec, until the next call. NULL when memory is short. */
static const char *make_absolute(mapper *m, const char *target) {
  if (target[0] == '/') return target;
  int up = 0;
  while (strncmp(target, "../", 3) == 0) {
    target += 3;
    up++;
  }
  const size_t length = length_above(m->own, up), rest = strlen(target);
  if (qmat_grow((void **)&m->absolute, &m->capacity, length + rest + 2, 1) != 0) return NULL;
  memcpy(m->absolute, m->own, length);
  m->absolute[length] = '/';
  memcpy(m->absolute + length + 1, target, rest + 1);
  return m->absolute;
}

/* Turns a target that an opinion names into a path of the scene. `*mapped` is NULL where it has none. */
static qmat_status map_target(mapper *m, const char *target, const char **mapped) {
  const char *path = make_absolute(m, target);
  *mapped = NULL;
  if (!path) return qmat_usd_fail_prim_memory(m->prim);
  const size_t rest = strlen(path);
  if (rest < m->from || memcmp(path, m->own, m->from) != 0 || (path[m->from] != '/' && path[m->from] != '\0'))
    return qmat_usd_warn(m->prim, "the target <%s> is skipped: it is outside of what is referred to",
                         qmat_usd_shown(target));
  const size_t size = m->to + rest - m->from + 1;
  if (size > *m->bytes_left)
    return qmat_usd_prim_fail(m->prim, "the targets of a relationship have paths of more than %zu bytes",
                              MOST_PATH_BYTES);
  *m->bytes_left -= size;
  char *made = qmat_arena_alloc(m->arena, size, 1);
  if (!made) return qmat_usd_fail_prim_memory(m->prim);
  memcpy(made, m->placed, m->to);
  memcpy(made + m->to, path + m->from, rest - m->from + 1);
  *mapped = made;
  return QMAT_OK;
}

/* Applies one edit of one opinion. */
static qmat_status apply_edit(mapper *m, const qmat_usd_value *items, qmat_usd_edit edit, qmat_usd_list *list) {
  const qmat_usd_prim *prim = m->prim;
  if (items->count > 0 && !qmat_usd_is_text(items->type))
    return qmat_usd_prim_fail(prim, "a relationship has a value of the wrong type");
  const size_t before = edit == QMAT_USD_EXPLICIT ? 0 : list->count;
  if (items->count > MOST_TARGETS - before || (edit != QMAT_USD_EXPLICIT && items->count > MOST_EDITED))
    return qmat_usd_prim_fail(prim, "a relationship has too many targets");
  qmat_status status = items->count > 0 ? qmat_progress(prim->log->context, before + 1, 0, "targets") : QMAT_OK;
  if (status != QMAT_OK) return status;
  qmat_usd_item *mapped = qmat_alloc(items->count, sizeof *mapped);
  if (!mapped) return qmat_usd_fail_prim_memory(prim);
  size_t count = 0;
  for (size_t i = 0; i < items->count && status == QMAT_OK; i++) {
    const char *path;
    status = map_target(m, items->texts[i], &path);
    if (status == QMAT_OK && path) mapped[count++] = (qmat_usd_item){.value = path};
  }
  if (status == QMAT_OK && !qmat_usd_list_edit(list, edit, mapped, count)) status = qmat_usd_fail_prim_memory(prim);
  qmat_free(mapped);
  return status;
}

/* Applies what an opinion says. */
static qmat_status apply_opinion(const qmat_usd_prim *prim, const qmat_usd_opinion *opinion, const qmat_usd_list_op *op,
                                 qmat_arena *arena, size_t *bytes_left, qmat_usd_list *list) {
  static const qmat_usd_edit order[] = {QMAT_USD_DELETED, QMAT_USD_ADDED, QMAT_USD_PREPENDED, QMAT_USD_APPENDED};
  mapper m = {.prim = prim, .arena = arena, .bytes_left = bytes_left};
  qmat_status status = start_mapper(&m, opinion);
  if (status == QMAT_OK && op->is_explicit)
    status = apply_edit(&m, &op->lists[QMAT_USD_EXPLICIT], QMAT_USD_EXPLICIT, list);
  for (size_t k = 0; k < sizeof order / sizeof *order && status == QMAT_OK && !op->is_explicit; k++)
    status = apply_edit(&m, &op->lists[order[k]], order[k], list);
  qmat_free(m.absolute);
  return status;
}

qmat_status qmat_usd_prim_targets(const qmat_usd_prim *prim, const char *name, qmat_arena *arena,
                                  const char *const **targets, size_t *count) {
  qmat_usd_list list = {0};
  size_t bytes_left = MOST_PATH_BYTES;
  qmat_status status = QMAT_OK;
  for (size_t i = prim->opinion_count; i-- > 0 && status == QMAT_OK;) {
    const qmat_usd_opinion *opinion = &prim->opinions[i];
    const qmat_usd_spec *spec = qmat_usd_child(opinion->layer, opinion->spec, QMAT_USD_RELATIONSHIP, name);
    const qmat_usd_value *value = spec ? qmat_usd_field_value(spec, "targetPaths") : NULL;
    if (value && value->type == QMAT_USD_LIST_OP)
      status = apply_opinion(prim, opinion, value->list_op, arena, &bytes_left, &list);
  }
  const char **made = status == QMAT_OK ? qmat_arena_alloc(arena, list.count, sizeof *made) : NULL;
  if (status == QMAT_OK && !made) status = qmat_usd_fail_prim_memory(prim);
  for (size_t i = 0; made && i < list.count; i++) made[i] = list.items[i].value;
  *targets = made;
  *count = list.count;
  qmat_usd_list_uninit(&list);
  return status;
}
