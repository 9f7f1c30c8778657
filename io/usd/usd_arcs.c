/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_arcs.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>

#include "io/usd/usd_list.h"

/* A scene may be composed of this many nodes, and more for each spec of its layers. */
#define FREE_NODES ((size_t)1 << 22)
#define NODES_PER_SPEC 64

enum { MOST_ARCS_OF_PRIM = 4096 };

typedef qmat_usd_node node;

/* ---- nodes ---- */

qmat_status qmat_usd_new_node(qmat_usd_composer *c, node *parent, qmat_usd_arc arc, size_t stack, size_t most_specs,
                              node **made) {
  if (*c->nodes_made >= FREE_NODES + NODES_PER_SPEC * c->files->specs_read || c->node_count >= MOST_ARCS_OF_PRIM)
    return qmat_usd_prim_fail(c->prim, "the scene is larger than its files justify: references multiply");
  qmat_arena *arena = &c->prim->arena;
  *made = qmat_arena_calloc(arena, 1, sizeof **made);
  if (!*made) return qmat_usd_fail_prim_memory(c->prim);
  **made = (node){.arc = arc,
                  .introduced = c->prim->depth,
                  .arcs_deep = parent ? parent->arcs_deep + 1 : 0,
                  .time = parent ? parent->time : (qmat_usd_time){.scale = 1},
                  .stack = stack,
                  .variant = parent ? parent->variant : NULL,
                  .specs = qmat_arena_alloc(arena, most_specs, sizeof(qmat_usd_spec *)),
                  .layers = qmat_arena_alloc(arena, most_specs, sizeof(qmat_usd_layer *)),
                  .parent = parent};
  if (!(*made)->specs || !(*made)->layers) return qmat_usd_fail_prim_memory(c->prim);
  ++*c->nodes_made;
  c->node_count++;
  return QMAT_OK;
}

void qmat_usd_add_spec(node *to, const qmat_usd_layer *layer, const qmat_usd_spec *spec) {
  to->layers[to->spec_count] = layer;
  to->specs[to->spec_count++] = spec;
}

/* Inserts a child by its strength: by its arc, then arcs of the prim itself before arcs of prims above it. */
static void link_node(node *parent, node *child) {
  node **place = &parent->first_child;
  while (*place &&
         ((*place)->arc < child->arc || ((*place)->arc == child->arc && (*place)->introduced >= child->introduced))) {
    place = &(*place)->next;
  }
  child->next = *place;
  *place = child;
}

enum { NAME_SIZE = 256 };

/* Takes the next name of a prim in a path. False: there is none, or no prim has it. */
static bool take_name(const char **path, char name[NAME_SIZE]) {
  if (**path == '/') ++*path;
  const size_t length = strcspn(*path, "/{.[");
  if (length == 0 || length >= NAME_SIZE || (*path)[length] == '.' || (*path)[length] == '[') return false;
  memcpy(name, *path, length);
  name[length] = '\0';
  *path += length;
  return true;
}

const qmat_usd_spec *qmat_usd_spec_at(const qmat_usd_layer *layer, const char *path) {
  const qmat_usd_spec *spec = layer->root;
  if (*path != '/') return NULL;
  while (*path && spec) {
    char name[NAME_SIZE], variant[NAME_SIZE];
    if (*path == '{') {
      const char *equals = strchr(path, '='), *end = strchr(path, '}');
      if (!equals || !end || equals > end || equals - path > 255 || end - equals > 255) return NULL;
      snprintf(name, sizeof name, "%.*s", (int)(equals - path - 1), path + 1);
      snprintf(variant, sizeof variant, "%.*s", (int)(end - equals - 1), equals + 1);
      spec = qmat_usd_child(layer, spec, QMAT_USD_VARIANT_SET, name);
      if (spec) spec = qmat_usd_child(layer, spec, QMAT_USD_VARIANT, variant);
      path = end + 1;
      continue;
    }
    if (!take_name(&path, name)) return NULL;
    spec = qmat_usd_child(layer, spec, QMAT_USD_PRIM, name);
  }
  return spec;
}

/* A prim may have thousands of arcs, each of which is compared with the others: they count as steps, too. */
static qmat_status report_work(const qmat_usd_composer *c) {
  return qmat_progress(c->prim->log->context, *c->nodes_made + 1, 0, "opinions");
}

/* ---- trees of children ---- */

qmat_status qmat_usd_copy_tree(qmat_usd_composer *c, const node *from, node *parent, const char *name, int least,
                               node **made) {
  qmat_status status = qmat_usd_new_node(c, parent, from->arc, from->stack, from->spec_count, made);
  if (status != QMAT_OK) return status;
  (*made)->introduced = from->introduced;
  (*made)->time = from->time;
  (*made)->variant = from->variant;
  for (size_t i = 0; i < from->spec_count && from->introduced >= least; i++) {
    const qmat_usd_spec *spec = qmat_usd_child(from->layers[i], from->specs[i], QMAT_USD_PRIM, name);
    if (spec) qmat_usd_add_spec(*made, from->layers[i], spec);
  }
  node **end = &(*made)->first_child;
  for (const node *child = from->first_child; child; child = child->next) {
    node *copy;
    status = qmat_usd_copy_tree(c, child, *made, name, least, &copy);
    if (status != QMAT_OK) return status;
    if (!copy) continue;
    *end = copy;
    end = &copy->next;
  }
  if ((*made)->spec_count == 0 && !(*made)->first_child) {
    *made = NULL;
    --*c->nodes_made;
    c->node_count--;
  }
  return QMAT_OK;
}

qmat_status qmat_usd_add_arcs_of_copies(qmat_usd_composer *c, node *at) {
  /* New arcs are inserted between the copies: these are listed first. */
  size_t count = 0;
  for (const node *child = at->first_child; child; child = child->next) count++;
  node **copies = qmat_arena_alloc(&c->prim->arena, count, sizeof *copies);
  if (!copies) return qmat_usd_fail_prim_memory(c->prim);
  count = 0;
  for (node *child = at->first_child; child; child = child->next) copies[count++] = child;
  qmat_status status = qmat_usd_add_arcs(c, at);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) status = qmat_usd_add_arcs_of_copies(c, copies[i]);
  return status;
}

/* ---- edits of lists ---- */

/* Applies one edit of a layer. False when memory is short. */
static bool apply_edit(qmat_usd_list *list, qmat_usd_edit edit, const qmat_usd_value *value,
                       const qmat_usd_layer *layer) {
  qmat_usd_item *items = qmat_alloc(value->count, sizeof *items);
  for (size_t i = 0; items && i < value->count; i++) {
    const void *item = value->type == QMAT_USD_REFERENCE ? (const void *)&value->references[i] : value->texts[i];
    items[i] = (qmat_usd_item){.value = item, .layer = layer};
  }
  const bool good = items && qmat_usd_list_edit(list, edit, items, value->count);
  qmat_free(items);
  return good;
}

/* Applies the edits of a field in the node's specs, weakest first. The caller frees the list. */
static qmat_status edit_list(const qmat_usd_composer *c, const node *at, const char *field, qmat_usd_type wanted,
                             qmat_usd_list *list) {
  static const qmat_usd_edit order[] = {QMAT_USD_DELETED, QMAT_USD_ADDED, QMAT_USD_PREPENDED, QMAT_USD_APPENDED};
  *list = (qmat_usd_list){.has_references = wanted == QMAT_USD_REFERENCE};
  for (size_t i = at->spec_count; i-- > 0;) {
    const qmat_usd_layer *layer = at->layers[i];
    const qmat_usd_value *value = qmat_usd_field_value(at->specs[i], field);
    if (!value || value->type != QMAT_USD_LIST_OP) continue;
    const qmat_usd_list_op *op = value->list_op;
    bool good = true;
    size_t total = 0;
    for (int edit = 0; edit < QMAT_USD_EDIT_COUNT; edit++) {
      const qmat_usd_value *items = &op->lists[edit];
      bool is_text = qmat_usd_is_text(items->type) && qmat_usd_is_text(wanted);
      if (items->count > 0 && items->type != wanted && !is_text) good = false;
      total += items->count;
    }
    if (!good) return qmat_usd_prim_fail(c->prim, "%s has a value of the wrong type", field);
    if (total + list->count > MOST_ARCS_OF_PRIM)
      return qmat_usd_prim_fail(c->prim, "%s has more than %d items", field, MOST_ARCS_OF_PRIM);
    const qmat_status status = report_work(c);
    if (status != QMAT_OK) return status;
    if (op->is_explicit) good = apply_edit(list, QMAT_USD_EXPLICIT, &op->lists[QMAT_USD_EXPLICIT], layer);
    for (size_t k = 0; k < sizeof order / sizeof *order && good && !op->is_explicit; k++)
      if (op->lists[order[k]].count > 0) good = apply_edit(list, order[k], &op->lists[order[k]], layer);
    if (!good) return qmat_usd_fail_prim_memory(c->prim);
  }
  return QMAT_OK;
}

/* ---- arcs ---- */

/* Whether a spec is, or is above, a spec of a node from this one to the root: an arc to it would never end. */
static bool is_on_the_way(const node *at, const qmat_usd_spec *spec) {
  for (; at; at = at->parent) {
    for (size_t i = 0; i < at->spec_count; i++) {
      for (const qmat_usd_spec *s = at->specs[i]; s; s = s->parent) {
        if (s == spec) return true;
      }
    }
  }
  return false;
}

static qmat_status add_variants(qmat_usd_composer *c, node *tree);

/* Whether a prim above the one at a path has arcs or variants, which may bring opinions about it. */
static bool has_arcs_above(const qmat_usd_stack *layers, const char *path) {
  static const char *const fields[] = {"inheritPaths", "references", "payload", "specializes", "variantSetNames"};
  for (size_t i = 0; i < layers->count; i++) {
    const qmat_usd_spec *spec = layers->layers[i]->root;
    char name[NAME_SIZE];
    for (const char *rest = path; spec && take_name(&rest, name) && *rest == '/';) {
      spec = qmat_usd_child(layers->layers[i], spec, QMAT_USD_PRIM, name);
      for (size_t k = 0; spec && k < sizeof fields / sizeof *fields; k++)
        if (qmat_usd_field_value(spec, fields[k])) return true;
    }
  }
  return false;
}

/* All nodes of a tree came with an arc of the prim of this depth. */
static void set_introduced(node *at, int depth) {
  at->introduced = depth;
  for (node *child = at->first_child; child; child = child->next) set_introduced(child, depth);
}

/* Composes the prim at a path from the root of its layer stack on, since prims above it have arcs; all but its own arcs
 * and variants. `*made` is NULL when there is no such prim. */
static qmat_status compose_target(qmat_usd_composer *c, node *at, qmat_usd_arc arc, size_t stack, const char *path,
                                  qmat_usd_time time, node **made) {
  const qmat_usd_stack *layers = &c->files->stacks[stack];
  const int depth = c->prim->depth;
  int levels = 0;
  for (const char *slash = path; slash; slash = strchr(slash + 1, '/')) levels++;
  qmat_status status = QMAT_OK;
  node *above = NULL;
  char name[NAME_SIZE];
  const char *rest = path;
  *made = NULL;
  while (take_name(&rest, name)) {
    c->prim->depth = depth - --levels; /* arcs of prims above are weaker */
    if (!above) {
      status = qmat_usd_new_node(c, at, arc, stack, layers->count, made);
      if (status == QMAT_OK) (*made)->time = time;
      for (size_t i = 0; i < layers->count && status == QMAT_OK; i++) {
        const qmat_usd_spec *spec = qmat_usd_child(layers->layers[i], layers->layers[i]->root, QMAT_USD_PRIM, name);
        if (spec) qmat_usd_add_spec(*made, layers->layers[i], spec);
      }
    } else {
      status = qmat_usd_copy_tree(c, above, at, name, INT_MIN, made);
    }
    if (status != QMAT_OK || !*made || levels == 0) break;
    above = *made;
    status = qmat_usd_add_arcs_of_copies(c, above);
    if (status == QMAT_OK) status = add_variants(c, above);
    if (status != QMAT_OK) break;
  }
  if (*rest) *made = NULL;
  c->prim->depth = depth;
  if (status == QMAT_OK && *made) set_introduced(*made, depth);
  return status;
}

/* Adds the prim at `path` in a layer stack as a child of `at`, with its own arcs and what prims above it bring. `time`
 * turns its times into those of `at`; NULL: they are the same. */
static qmat_status add_target(qmat_usd_composer *c, node *at, qmat_usd_arc arc, size_t stack, const char *path,
                              const qmat_usd_time *time, const char *what) {
  const qmat_usd_stack *layers = &c->files->stacks[stack];
  const qmat_usd_time own = time ? qmat_usd_time_through(at->time, *time) : at->time;
  if (at->arcs_deep >= QMAT_USD_DEEPEST_ARCS)
    return qmat_usd_warn(c->prim, "the %s of <%s> is skipped: it leads back to itself", what, qmat_usd_shown(path));
  node *made;
  qmat_status status;
  if (has_arcs_above(layers, path)) {
    status = compose_target(c, at, arc, stack, path, own, &made);
  } else {
    status = qmat_usd_new_node(c, at, arc, stack, layers->count, &made);
    if (status == QMAT_OK) made->time = own;
    for (size_t i = 0; i < layers->count && status == QMAT_OK; i++) {
      const qmat_usd_spec *spec = qmat_usd_spec_at(layers->layers[i], path);
      if (spec) qmat_usd_add_spec(made, layers->layers[i], spec);
    }
  }
  if (status != QMAT_OK) return status;
  if (!made || (made->spec_count == 0 && !made->first_child))
    return qmat_usd_warn(c->prim, "the %s of <%s> is skipped: there is no such prim", what, qmat_usd_shown(path));
  if (made->spec_count > 0 && is_on_the_way(at, made->specs[0]))
    return qmat_usd_warn(c->prim, "the %s of <%s> is skipped: it leads back to itself", what, qmat_usd_shown(path));
  link_node(at, made);
  return qmat_usd_add_arcs_of_copies(c, made);
}

static qmat_status add_reference(qmat_usd_composer *c, node *at, qmat_usd_arc arc, qmat_usd_item item,
                                 const char *what) {
  const qmat_usd_reference *reference = item.value;
  size_t stack = at->stack;
  if (reference->asset[0]) {
    qmat_status status = qmat_usd_files_find(c->files, c->prim, item.layer, reference->asset, what, &stack);
    if (status != QMAT_OK || stack == SIZE_MAX) return status;
  }
  char path[256];
  const qmat_usd_layer *layer = c->files->stacks[stack].layers[0];
  const qmat_usd_time through = {
      .offset = reference->offset,
      .scale = reference->scale * qmat_usd_codes_per_second(item.layer) / qmat_usd_codes_per_second(layer)};
  const qmat_usd_time time =
      qmat_usd_time_through(qmat_usd_stack_time(&c->files->stacks[at->stack], item.layer), through);
  if (reference->path[0]) return add_target(c, at, arc, stack, reference->path, &time, what);
  const char *name = qmat_usd_text(qmat_usd_field_value(layer->root, "defaultPrim"));
  if (!name || !*name || strlen(name) > 254) {
    return qmat_usd_warn(c->prim, "the %s @%s@ is skipped: it has no path, and the file no default prim", what,
                         qmat_usd_shown(reference->asset));
  }
  snprintf(path, sizeof path, "%s%s", name[0] == '/' ? "" : "/", name);
  return add_target(c, at, arc, stack, path, &time, what);
}

static qmat_status add_references(qmat_usd_composer *c, node *at, qmat_usd_arc arc, const char *field,
                                  const char *what) {
  qmat_usd_list list;
  qmat_status status = edit_list(c, at, field, QMAT_USD_REFERENCE, &list);
  for (size_t i = 0; i < list.count && status == QMAT_OK; i++) status = add_reference(c, at, arc, list.items[i], what);
  qmat_usd_list_uninit(&list);
  return status;
}

/* A layer that refers to this one may have opinions about the class, too: these are not composed. */
static qmat_status warn_of_class(const qmat_usd_composer *c, const node *at, const char *path) {
  for (const node *above = at->parent; above; above = above->parent) {
    if (above->stack == at->stack) continue;
    const qmat_usd_stack *layers = &c->files->stacks[above->stack];
    for (size_t k = 0; k < layers->count; k++) {
      if (!qmat_usd_spec_at(layers->layers[k], path)) continue;
      qmat_status status = qmat_usd_warn(c->prim, "the opinions of a referring layer about the class <%s> are skipped",
                                         qmat_usd_shown(path));
      if (status != QMAT_OK) return status;
    }
  }
  return QMAT_OK;
}

static qmat_status add_classes(qmat_usd_composer *c, node *at, qmat_usd_arc arc, const char *field, const char *what) {
  qmat_usd_list list;
  qmat_status status = edit_list(c, at, field, QMAT_USD_PATH, &list);
  for (size_t i = 0; i < list.count && status == QMAT_OK; i++) {
    status = add_target(c, at, arc, at->stack, list.items[i].value, NULL, what);
    if (status == QMAT_OK) status = warn_of_class(c, at, list.items[i].value);
  }
  qmat_usd_list_uninit(&list);
  return status;
}

qmat_status qmat_usd_add_arcs(qmat_usd_composer *c, node *at) {
  for (size_t i = 0; i < at->spec_count; i++) {
    static const char *const not_composed[] = {"relocates", "clips"};
    for (size_t k = 0; k < sizeof not_composed / sizeof not_composed[0]; k++) {
      if (!qmat_usd_field_value(at->specs[i], not_composed[k])) continue;
      qmat_status status = qmat_usd_warn(c->prim, "its %s are skipped", not_composed[k]);
      if (status != QMAT_OK) return status;
    }
  }
  qmat_status status = add_classes(c, at, QMAT_USD_ARC_INHERIT, "inheritPaths", "inherit");
  if (status == QMAT_OK) status = add_references(c, at, QMAT_USD_ARC_REFERENCE, "references", "reference");
  if (status == QMAT_OK) status = add_references(c, at, QMAT_USD_ARC_PAYLOAD, "payload", "payload");
  return status == QMAT_OK ? add_classes(c, at, QMAT_USD_ARC_SPECIALIZE, "specializes", "specialize") : status;
}

/* The strongest selection of a variant set in a tree, or NULL. */
static const char *find_selection(const node *at, const char *set) {
  for (size_t i = 0; i < at->spec_count; i++) {
    const char *name = qmat_usd_text(qmat_usd_entry(qmat_usd_field_value(at->specs[i], "variantSelection"), set));
    if (name && *name) return name;
  }
  for (const node *child = at->first_child; child; child = child->next) {
    const char *name = find_selection(child, set);
    if (name) return name;
  }
  return NULL;
}

/* Whether a node of a tree has this variant. */
static bool has_variant(const node *at, const char *set, const char *name) {
  for (size_t i = 0; i < at->spec_count; i++) {
    const qmat_usd_spec *variants = qmat_usd_child(at->layers[i], at->specs[i], QMAT_USD_VARIANT_SET, set);
    if (variants && qmat_usd_child(at->layers[i], variants, QMAT_USD_VARIANT, name)) return true;
  }
  for (const node *child = at->first_child; child; child = child->next) {
    if (has_variant(child, set, name)) return true;
  }
  return false;
}

static qmat_status add_variant(qmat_usd_composer *c, node *tree, node *at, const char *set) {
  bool is_there = false;
  for (size_t i = 0; i < at->spec_count; i++)
    is_there = is_there || qmat_usd_child(at->layers[i], at->specs[i], QMAT_USD_VARIANT_SET, set);
  if (!is_there) return QMAT_OK;
  qmat_status status = report_work(c);
  if (status != QMAT_OK) return status;
  const char *selection = find_selection(tree, set);
  if (!selection) return qmat_usd_warn(c->prim, "no variant of '%s' is selected: all are skipped", qmat_usd_shown(set));
  node *made;
  status = qmat_usd_new_node(c, at, QMAT_USD_ARC_VARIANT, at->stack, at->spec_count, &made);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < at->spec_count; i++) {
    const qmat_usd_spec *variants = qmat_usd_child(at->layers[i], at->specs[i], QMAT_USD_VARIANT_SET, set);
    const qmat_usd_spec *spec = variants ? qmat_usd_child(at->layers[i], variants, QMAT_USD_VARIANT, selection) : NULL;
    if (spec) qmat_usd_add_spec(made, at->layers[i], spec);
  }
  if (made->spec_count == 0) {
    if (has_variant(tree, set, selection)) return QMAT_OK;
    return qmat_usd_warn(c->prim, "there is no variant '%s' of '%s'", qmat_usd_shown(selection), qmat_usd_shown(set));
  }
  made->variant = made->specs[0];
  link_node(at, made);
  return qmat_usd_add_arcs(c, made);
}

/* The strongest node whose variants are not composed yet, or NULL. */
static node *find_undone(node *at) {
  if (!at->has_variants_done) return at;
  for (node *child = at->first_child; child; child = child->next) {
    node *found = find_undone(child);
    if (found) return found;
  }
  return NULL;
}

/* Adds the selected variants of all nodes of a tree, and their arcs. */
static qmat_status add_variants(qmat_usd_composer *c, node *tree) {
  node *at;
  while ((at = find_undone(tree)) != NULL) {
    at->has_variants_done = true;
    qmat_usd_list sets;
    qmat_status status = edit_list(c, at, "variantSetNames", QMAT_USD_STRING, &sets);
    for (size_t i = 0; i < sets.count && status == QMAT_OK; i++) status = add_variant(c, tree, at, sets.items[i].value);
    qmat_usd_list_uninit(&sets);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

qmat_status qmat_usd_add_variants(qmat_usd_composer *c) {
  return add_variants(c, c->prim->tree);
}
