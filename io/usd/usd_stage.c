/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_stage.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "io/usd/usdz.h"

enum { MOST_WARNINGS = 100, MOST_LAYERS = 4096, DEEPEST_ARCS = 64, MOST_ARCS_OF_PRIM = 4096, PATH_TEXT = 256 };
/* How many prims and arcs a scene may be composed of: this many, and more for each spec that its layers have. */
#define FREE_NODES ((size_t)1 << 18)
#define NODES_PER_SPEC 64

/* An archive, opened once. */
typedef struct package {
  char *path;
  qmat_bytes file; /* empty for the one that the caller owns */
  qmat_usdz archive;
} package;

typedef struct open_layer {
  char *path;  /* of the file, or of the member in its package */
  int package; /* -1: a file of its own */
  bool is_missing;
  qmat_usd_layer layer;
} open_layer;

/* A layer with all its sublayers, strongest first: numbers of layers. */
typedef struct layer_stack {
  size_t count, capacity;
  size_t *layers;
} layer_stack;

struct qmat_usd_stage {
  char *path;
  size_t layer_count, layer_capacity, package_count, package_capacity, stack_count, stack_capacity;
  open_layer **layers;
  package *packages;
  layer_stack *stacks; /* the one of layer i is looked for among them by its first layer */
  size_t bytes;
  size_t nodes_left, warning_count;
  json_t *warnings;
};

/* From strong to weak. */
typedef enum arc { ARC_ROOT, ARC_INHERIT, ARC_VARIANT, ARC_REFERENCE, ARC_PAYLOAD, ARC_SPECIALIZE } arc;

/* A place where opinions about a prim come from: one prim (or variant) in one layer stack. */
typedef struct qmat_usd_node {
  arc arc;
  int introduced;    /* the depth of the prim at which the arc stands */
  int arcs_deep;     /* arcs between this and the root */
  size_t stack;      /* its layer stack */
  size_t spec_count; /* of the layers of the stack that have one, strongest first */
  const qmat_usd_spec **specs;
  const qmat_usd_layer **layers;
  bool has_variants_done;
  struct qmat_usd_node *parent, *first_child, *next; /* children strongest first */
} node;

/* ---- texts ---- */

/* The path of a prim, cut at the left to what fits, without what is not UTF-8. */
static const char *path_of(const qmat_usd_prim *prim, char text[PATH_TEXT]) {
  char *at = text + PATH_TEXT - 1;
  *at = '\0';
  if (!prim || !prim->parent) return "/";
  for (; prim->parent; prim = prim->parent) {
    const char *name = qmat_is_utf8(prim->name) ? prim->name : "?";
    size_t length = strlen(name);
    if ((size_t)(at - text) < length + 5) {
      at -= 4;
      memcpy(at, ".../", 4);
      break;
    }
    at -= length;
    memcpy(at, name, length);
    *--at = '/';
  }
  return at;
}

static const char *shown(const char *text) {
  return qmat_is_utf8(text) ? text : "?";
}

/* Takes out what a terminal would act on, and the rest of a character that was cut. */
static void clean_text(char *text) {
  for (char *c = text; *c; c++) {
    if ((unsigned char)*c < ' ' || *c == 127) *c = '?';
  }
  for (size_t end = strlen(text); end > 0 && !qmat_is_utf8(text); end--) text[end - 1] = '\0';
}

qmat_status qmat_usd_warn(qmat_context *context, qmat_usd_stage *stage, const qmat_usd_prim *prim, const char *format,
                          ...) {
  char text[1024], path[PATH_TEXT];
  size_t used = 0;
  if (++stage->warning_count > MOST_WARNINGS) {
    snprintf(text, sizeof text, "and %zu more warnings", stage->warning_count - MOST_WARNINGS);
  } else {
    used = (size_t)snprintf(text, sizeof text, "%s: ", path_of(prim, path));
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + used, sizeof text - used, format, arguments);
    va_end(arguments);
  }
  clean_text(text);
  json_t *warning = json_string(text);
  int failed = stage->warning_count > MOST_WARNINGS + 1 ? json_array_set_new(stage->warnings, MOST_WARNINGS, warning)
                                                        : json_array_append_new(stage->warnings, warning);
  return failed == 0 ? QMAT_OK : qmat_fail_memory(context, "the warnings");
}

qmat_status qmat_usd_prim_fail(qmat_context *context, const qmat_usd_stage *stage, const qmat_usd_prim *prim,
                               const char *format, ...) {
  char text[512], path[PATH_TEXT];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  qmat_fail(context, QMAT_ERROR_FORMAT, "%s: %s", path_of(prim, path), text);
  clean_text(context->error.message);
  return qmat_fail_at(context, stage->path, 0, 0);
}

/* ---- finding files ---- */

/* The path that `asset` stands for when a layer at `from` names it; "." and ".." are worked out where they can be.
 * qmat_free frees it. */
static char *resolve(const char *from, const char *asset) {
  const char *slash = strrchr(from, '/');
  const size_t folder = slash ? (size_t)(slash - from) + 1 : 0, length = strlen(asset);
  char *path = qmat_alloc(folder + length + 1, 1);
  if (!path) return NULL;
  memcpy(path, from, folder);
  size_t used = folder;
  for (const char *part = asset; *part;) {
    size_t size = strcspn(part, "/\\");
    const char *next = part + size + (part[size] != '\0');
    bool last = *next == '\0';
    if (size == 0 || (size == 1 && part[0] == '.')) {
      part = next;
      continue;
    }
    if (size == 2 && part[0] == '.' && part[1] == '.' && used > 0) {
      size_t start = used - 1; /* the folder ends in a slash */
      while (start > 0 && path[start - 1] != '/') start--;
      bool is_dots = used - start == 3 && path[start] == '.' && path[start + 1] == '.';
      bool is_dot = used - start == 2 && path[start] == '.';
      if (!is_dots && !is_dot && used - start > 1) {
        used = start;
        part = next;
        continue;
      }
    }
    memcpy(path + used, part, size);
    used += size;
    if (!last) path[used++] = '/';
    part = next;
  }
  path[used] = '\0';
  return path;
}

static bool is_elsewhere(const char *asset) {
  return asset[0] == '/' || strstr(asset, "://") || (asset[0] && asset[1] == ':') || strchr(asset, '[');
}

static size_t find_layer(const qmat_usd_stage *stage, const char *path, int package) {
  for (size_t i = 0; i < stage->layer_count; i++) {
    if (stage->layers[i]->package == package && strcmp(stage->layers[i]->path, path) == 0) return i;
  }
  return SIZE_MAX;
}

/* Makes room for a layer at `path`, which it takes over. */
static qmat_status add_layer(qmat_context *context, qmat_usd_stage *stage, char *path, int package,
                             open_layer **added) {
  open_layer *layer = qmat_calloc(1, sizeof *layer);
  if (!layer ||
      qmat_grow((void **)&stage->layers, &stage->layer_capacity, stage->layer_count + 1, sizeof *stage->layers) != 0) {
    qmat_free(layer);
    qmat_free(path);
    return qmat_fail_memory(context, "a USD stage");
  }
  layer->path = path;
  layer->package = package;
  stage->layers[stage->layer_count++] = layer;
  *added = layer;
  return QMAT_OK;
}

static qmat_status parse_layer(qmat_context *context, qmat_usd_stage *stage, const qmat_bytes *bytes,
                               const char *shown_path, open_layer *into) {
  qmat_status status = qmat_usd_layer_read(context, bytes, shown_path, &into->layer);
  stage->nodes_left += NODES_PER_SPEC * into->layer.spec_count;
  return status;
}

/* Reads a member of a package as a layer. */
static qmat_status parse_member(qmat_context *context, qmat_usd_stage *stage, const package *from,
                                const qmat_usdz_member *member, open_layer *into) {
  enum { PADDING = 16 };
  const size_t size = strlen(from->path) + strlen(member->name) + 3;
  char *name = qmat_alloc(size, 1);
  /* Text is read with zeros behind it, which a member does not have. */
  qmat_bytes copy = {.size = member->size, .data = qmat_calloc(member->size + PADDING, 1)};
  qmat_status status = QMAT_OK;
  if (!name || !copy.data) {
    status = qmat_fail_memory(context, "a USD stage");
  } else {
    memcpy(copy.data, member->bytes, member->size);
    snprintf(name, size, "%s[%s]", from->path, member->name);
    status = parse_layer(context, stage, &copy, name, into);
  }
  qmat_bytes_uninit(&copy);
  qmat_free(name);
  return status;
}

/* Opens the archive in `bytes` and its first member as a layer. */
static qmat_status open_package(qmat_context *context, qmat_usd_stage *stage, const qmat_bytes *bytes, qmat_bytes owned,
                                const char *path, size_t *layer) {
  open_layer *opened = NULL;
  if (qmat_grow((void **)&stage->packages, &stage->package_capacity, stage->package_count + 1,
                sizeof *stage->packages) != 0) {
    qmat_bytes_uninit(&owned);
    return qmat_fail_memory(context, "a USD stage");
  }
  package *made = &stage->packages[stage->package_count++];
  *made = (package){.path = qmat_strdup(path), .file = owned};
  if (!made->path) return qmat_fail_memory(context, "a USD stage");
  qmat_status status = qmat_usdz_open(context, bytes, path, &made->archive);
  if (status != QMAT_OK) return status;
  if (made->archive.member_count == 0) {
    qmat_fail(context, QMAT_ERROR_FORMAT, "the archive is empty");
    return qmat_fail_at(context, path, 0, 0);
  }
  const qmat_usdz_member *first = &made->archive.members[0];
  char *name = qmat_strdup(first->name);
  if (!name) return qmat_fail_memory(context, "a USD stage");
  *layer = stage->layer_count;
  status = add_layer(context, stage, name, (int)stage->package_count - 1, &opened);
  if (status != QMAT_OK) return status;
  return parse_member(context, stage, made, first, opened);
}

static bool is_package(const qmat_bytes *bytes) {
  return bytes->size >= 4 && memcmp(bytes->data, "PK\3\4", 4) == 0;
}

/* Finds the layer that the layer `from` calls `asset`; SIZE_MAX with a warning that `what` ("reference") is left out
 * when it is not at hand. */
static qmat_status open_asset(qmat_context *context, qmat_usd_stage *stage, const qmat_usd_prim *prim, size_t from,
                              const char *asset, const char *what, size_t *layer) {
  *layer = SIZE_MAX;
  if (is_elsewhere(asset)) {
    return qmat_usd_warn(context, stage, prim, "the %s @%s@ is left out: only files beside the layer are looked for",
                         what, shown(asset));
  }
  const int archive = stage->layers[from]->package;
  char *path = resolve(stage->layers[from]->path, asset);
  if (!path) return qmat_fail_memory(context, "a USD stage");
  *layer = find_layer(stage, path, archive);
  if (*layer != SIZE_MAX) {
    qmat_free(path);
    if (stage->layers[*layer]->is_missing) *layer = SIZE_MAX;
    if (*layer != SIZE_MAX) return QMAT_OK;
    return qmat_usd_warn(context, stage, prim, "the %s @%s@ is left out: there is no such file", what, shown(asset));
  }
  if (stage->layer_count >= MOST_LAYERS) {
    qmat_free(path);
    return qmat_usd_prim_fail(context, stage, prim, "the scene has more than %d layers", MOST_LAYERS);
  }
  open_layer *opened = NULL;
  qmat_status status;
  if (archive >= 0) {
    const qmat_usdz_member *member = qmat_usdz_find(&stage->packages[archive].archive, path);
    *layer = stage->layer_count;
    status = add_layer(context, stage, path, archive, &opened);
    if (status != QMAT_OK) return status;
    if (member && !is_package(&(qmat_bytes){.size = member->size, .data = (uint8_t *)member->bytes})) {
      return parse_member(context, stage, &stage->packages[archive], member, opened);
    }
    opened->is_missing = true;
    *layer = SIZE_MAX;
    return qmat_usd_warn(context, stage, prim, "the %s @%s@ is left out: it is not in the package", what, shown(asset));
  }
  qmat_bytes bytes = {0};
  status = qmat_bytes_read_file(context, path, &bytes);
  if (status == QMAT_ERROR_IO) { /* not there, or not for us: the scene can do without */
    char reason[sizeof context->error.message];
    memcpy(reason, context->error.message, sizeof reason);
    context->error = (qmat_error){.element = -1};
    status = add_layer(context, stage, path, -1, &opened);
    if (status != QMAT_OK) return status;
    opened->is_missing = true;
    return qmat_usd_warn(context, stage, prim, "the %s @%s@ is left out: %s", what, shown(asset), reason);
  }
  if (status != QMAT_OK) {
    qmat_free(path);
    return status;
  }
  stage->bytes += bytes.size;
  if (is_package(&bytes)) {
    status = open_package(context, stage, &bytes, bytes, path, layer);
    qmat_free(path);
    return status;
  }
  *layer = stage->layer_count;
  status = add_layer(context, stage, path, -1, &opened);
  if (status == QMAT_OK) status = parse_layer(context, stage, &bytes, path, opened);
  qmat_bytes_uninit(&bytes);
  return status;
}

/* ---- layer stacks ---- */

static qmat_status add_to_stack(qmat_context *context, qmat_usd_stage *stage, layer_stack *stack, size_t layer,
                                int depth) {
  for (size_t i = 0; i < stack->count; i++) {
    if (stack->layers[i] == layer) return QMAT_OK; /* it has its place already, and cannot be its own sublayer */
  }
  if (depth > DEEPEST_ARCS) {
    return qmat_usd_prim_fail(context, stage, NULL, "sublayers are nested more than %d deep", DEEPEST_ARCS);
  }
  if (qmat_grow((void **)&stack->layers, &stack->capacity, stack->count + 1, sizeof *stack->layers) != 0) {
    return qmat_fail_memory(context, "a USD stage");
  }
  stack->layers[stack->count++] = layer;
  const qmat_usd_value *names = qmat_usd_field_value(stage->layers[layer]->layer.root, "subLayers");
  if (!names || !names->is_array || !qmat_usd_is_text(names->type)) return QMAT_OK;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < names->count && status == QMAT_OK; i++) {
    size_t sublayer;
    status = open_asset(context, stage, NULL, layer, names->texts[i], "sublayer", &sublayer);
    if (status == QMAT_OK && sublayer != SIZE_MAX) status = add_to_stack(context, stage, stack, sublayer, depth + 1);
  }
  return status;
}

/* The layer stack whose strongest layer is `layer`. */
static qmat_status find_stack(qmat_context *context, qmat_usd_stage *stage, size_t layer, size_t *found) {
  for (*found = 0; *found < stage->stack_count; ++*found) {
    if (stage->stacks[*found].layers[0] == layer) return QMAT_OK;
  }
  if (qmat_grow((void **)&stage->stacks, &stage->stack_capacity, stage->stack_count + 1, sizeof *stage->stacks) != 0) {
    return qmat_fail_memory(context, "a USD stage");
  }
  layer_stack *stack = &stage->stacks[stage->stack_count++];
  *stack = (layer_stack){0};
  return add_to_stack(context, stage, stack, layer, 0);
}

/* ---- opening and closing ---- */

qmat_status qmat_usd_stage_open(qmat_context *context, const qmat_bytes *bytes, const char *path,
                                qmat_usd_stage **stage) {
  *stage = NULL;
  qmat_usd_stage *made = qmat_calloc(1, sizeof *made);
  if (!made) return qmat_fail_memory(context, "a USD stage");
  made->path = qmat_strdup(path);
  made->warnings = json_array();
  made->nodes_left = FREE_NODES;
  made->bytes = bytes->size;
  qmat_status status = made->path && made->warnings ? QMAT_OK : qmat_fail_memory(context, "a USD stage");
  size_t layer = 0, stack;
  if (status == QMAT_OK && is_package(bytes)) {
    status = open_package(context, made, bytes, (qmat_bytes){0}, path, &layer);
  } else if (status == QMAT_OK) {
    open_layer *opened = NULL;
    char *copy = qmat_strdup(path);
    status = copy ? add_layer(context, made, copy, -1, &opened) : qmat_fail_memory(context, "a USD stage");
    if (status == QMAT_OK) status = parse_layer(context, made, bytes, path, opened);
  }
  if (status == QMAT_OK) status = find_stack(context, made, layer, &stack);
  if (status == QMAT_OK) {
    *stage = made;
  } else {
    qmat_usd_stage_close(made);
  }
  return status;
}

void qmat_usd_stage_close(qmat_usd_stage *stage) {
  if (!stage) return;
  for (size_t i = 0; i < stage->layer_count; i++) {
    qmat_usd_layer_uninit(&stage->layers[i]->layer);
    qmat_free(stage->layers[i]->path);
    qmat_free(stage->layers[i]);
  }
  for (size_t i = 0; i < stage->package_count; i++) {
    qmat_usdz_uninit(&stage->packages[i].archive);
    qmat_bytes_uninit(&stage->packages[i].file);
    qmat_free(stage->packages[i].path);
  }
  for (size_t i = 0; i < stage->stack_count; i++) qmat_free(stage->stacks[i].layers);
  qmat_free(stage->layers);
  qmat_free(stage->packages);
  qmat_free(stage->stacks);
  qmat_free(stage->path);
  json_decref(stage->warnings);
  qmat_free(stage);
}

const qmat_usd_layer *qmat_usd_stage_root_layer(const qmat_usd_stage *stage) {
  return &stage->layers[0]->layer;
}

size_t qmat_usd_stage_layer_count(const qmat_usd_stage *stage) {
  size_t count = 0;
  for (size_t i = 0; i < stage->layer_count; i++) count += !stage->layers[i]->is_missing;
  return count;
}

size_t qmat_usd_stage_bytes(const qmat_usd_stage *stage) {
  return stage->bytes;
}

json_t *qmat_usd_stage_warnings(const qmat_usd_stage *stage) {
  return stage->warnings;
}

void qmat_usd_stage_forget_warnings(qmat_usd_stage *stage) {
  json_array_clear(stage->warnings);
  stage->warning_count = 0;
}

/* ---- nodes ---- */

/* What the making of a prim needs. */
typedef struct composer {
  qmat_context *context;
  qmat_usd_stage *stage;
  qmat_usd_prim *prim;
  size_t node_count; /* of this prim */
} composer;

static qmat_status fail_memory(const composer *c) {
  return qmat_fail_memory(c->context, "a composed prim");
}

static qmat_status new_node(composer *c, node *parent, arc arc, size_t stack, size_t most_specs, node **made) {
  if (c->stage->nodes_left == 0 || ++c->node_count > MOST_ARCS_OF_PRIM) {
    return qmat_usd_prim_fail(c->context, c->stage, c->prim,
                              "the scene has become larger than its files justify: references of references");
  }
  c->stage->nodes_left--;
  *made = qmat_arena_calloc(&c->prim->arena, 1, sizeof **made);
  if (!*made) return fail_memory(c);
  (*made)->specs = qmat_arena_alloc(&c->prim->arena, most_specs, sizeof(qmat_usd_spec *));
  (*made)->layers = qmat_arena_alloc(&c->prim->arena, most_specs, sizeof(qmat_usd_layer *));
  if (!(*made)->specs || !(*made)->layers) return fail_memory(c);
  (*made)->arc = arc;
  (*made)->stack = stack;
  (*made)->introduced = c->prim->depth;
  (*made)->parent = parent;
  (*made)->arcs_deep = parent ? parent->arcs_deep + 1 : 0;
  return QMAT_OK;
}

static void add_spec(node *to, const qmat_usd_layer *layer, const qmat_usd_spec *spec) {
  to->layers[to->spec_count] = layer;
  to->specs[to->spec_count++] = spec;
}

/* Puts a child among the others by strength: by its arc, and arcs of the prim itself before those of prims above it. */
static void link_node(node *parent, node *child) {
  node **place = &parent->first_child;
  while (*place &&
         ((*place)->arc < child->arc || ((*place)->arc == child->arc && (*place)->introduced >= child->introduced))) {
    place = &(*place)->next;
  }
  child->next = *place;
  *place = child;
}

/* Where a path leads in a layer; variants may be in it, properties not. NULL when it leads nowhere. */
static const qmat_usd_spec *follow_path(const qmat_usd_layer *layer, const char *path) {
  const qmat_usd_spec *spec = layer->root;
  if (*path != '/') return NULL;
  while (*path && spec) {
    char name[256], variant[256];
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
    if (*path == '/') path++;
    size_t length = strcspn(path, "/{.[");
    if (length == 0 || length >= sizeof name || path[length] == '.' || path[length] == '[') return NULL;
    memcpy(name, path, length);
    name[length] = '\0';
    spec = qmat_usd_child(layer, spec, QMAT_USD_PRIM, name);
    path += length;
  }
  return spec;
}

/* ---- edits of lists ---- */

/* A list of items that edits are applied to, as pointers into values. */
typedef struct edited_list {
  size_t count, capacity;
  const void **items;
} edited_list;

static bool same_item(qmat_usd_type type, const void *a, const void *b) {
  if (type != QMAT_USD_REFERENCE) return strcmp(a, b) == 0;
  const qmat_usd_reference *x = a, *y = b;
  return strcmp(x->asset, y->asset) == 0 && strcmp(x->path, y->path) == 0;
}

static const void *item_at(const qmat_usd_value *list, size_t i) {
  return list->type == QMAT_USD_REFERENCE ? (const void *)&list->references[i] : (const void *)list->texts[i];
}

static void remove_item(edited_list *list, qmat_usd_type type, const void *item) {
  size_t kept = 0;
  for (size_t i = 0; i < list->count; i++) {
    if (!same_item(type, list->items[i], item)) list->items[kept++] = list->items[i];
  }
  list->count = kept;
}

/* Puts items to the front or the end of a list, where those that are in it already move, or with `only_new` stay. */
static bool insert_items(edited_list *list, const qmat_usd_value *items, bool at_front, bool only_new) {
  if (qmat_grow((void **)&list->items, &list->capacity, list->count + items->count, sizeof *list->items) != 0) {
    return false;
  }
  for (size_t i = 0; i < items->count && !only_new; i++) remove_item(list, items->type, item_at(items, i));
  size_t at = at_front ? 0 : list->count;
  memmove(list->items + at + items->count, list->items + at, (list->count - at) * sizeof *list->items);
  for (size_t i = 0; i < items->count; i++) {
    const void *item = item_at(items, i);
    bool known = false;
    for (size_t k = 0; k < at && only_new; k++) known = known || same_item(items->type, list->items[k], item);
    if (known) continue;
    list->items[at++] = item;
    list->count++;
  }
  return true;
}

/* The list that the node's specs give a field together, weakest first. The caller frees list->items. */
static qmat_status edit_list(const composer *c, const node *at, const char *field, qmat_usd_type wanted,
                             edited_list *list) {
  *list = (edited_list){0};
  for (size_t i = at->spec_count; i-- > 0;) {
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
    if (!good || total > MOST_ARCS_OF_PRIM) {
      return qmat_usd_prim_fail(c->context, c->stage, c->prim, "its %s are not what they have to be", field);
    }
    if (op->is_explicit) {
      list->count = 0;
      good = insert_items(list, &op->lists[QMAT_USD_EXPLICIT], false, false);
    } else {
      for (size_t k = 0; k < op->lists[QMAT_USD_DELETED].count; k++) {
        remove_item(list, wanted, item_at(&op->lists[QMAT_USD_DELETED], k));
      }
      good = insert_items(list, &op->lists[QMAT_USD_ADDED], false, true) &&
             insert_items(list, &op->lists[QMAT_USD_PREPENDED], true, false) &&
             insert_items(list, &op->lists[QMAT_USD_APPENDED], false, false);
    }
    if (!good) return fail_memory(c);
  }
  return QMAT_OK;
}

/* ---- arcs ---- */

static qmat_status add_arcs(composer *c, node *at);

/* Whether a spec is, or is above, one on the way from this node to the root: then an arc to it would never end. */
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

/* Adds the prim at `path` in a layer stack as a child of `at`, with its own arcs. */
static qmat_status add_target(composer *c, node *at, arc arc, size_t stack, const char *path, const char *what) {
  const layer_stack *layers = &c->stage->stacks[stack];
  node *made;
  qmat_status status = new_node(c, at, arc, stack, layers->count, &made);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < layers->count; i++) {
    const qmat_usd_layer *layer = &c->stage->layers[layers->layers[i]]->layer;
    const qmat_usd_spec *spec = follow_path(layer, path);
    if (spec) add_spec(made, layer, spec);
  }
  if (made->spec_count == 0) {
    return qmat_usd_warn(c->context, c->stage, c->prim, "the %s of <%s> is left out: there is no such prim", what,
                         shown(path));
  }
  if (made->arcs_deep > DEEPEST_ARCS || is_on_the_way(at, made->specs[0])) {
    return qmat_usd_warn(c->context, c->stage, c->prim, "the %s of <%s> is left out: it leads back to itself", what,
                         shown(path));
  }
  link_node(at, made);
  return add_arcs(c, made);
}

/* The number of the layer that the strongest of the node's specs with this field stands in. */
static size_t layer_with(const composer *c, const node *at, const char *field) {
  for (size_t i = 0; i < at->spec_count; i++) {
    if (!qmat_usd_field_value(at->specs[i], field)) continue;
    const layer_stack *stack = &c->stage->stacks[at->stack];
    for (size_t k = 0; k < stack->count; k++) {
      if (&c->stage->layers[stack->layers[k]]->layer == at->layers[i]) return stack->layers[k];
    }
  }
  return c->stage->stacks[at->stack].layers[0];
}

static qmat_status add_reference(composer *c, node *at, arc arc, const char *field, const qmat_usd_reference *reference,
                                 const char *what) {
  const layer_stack *own = &c->stage->stacks[at->stack];
  size_t stack = at->stack;
  if (reference->asset[0]) {
    size_t layer;
    qmat_status status =
        open_asset(c->context, c->stage, c->prim, layer_with(c, at, field), reference->asset, what, &layer);
    if (status != QMAT_OK || layer == SIZE_MAX) return status;
    status = find_stack(c->context, c->stage, layer, &stack);
    if (status != QMAT_OK) return status;
    own = &c->stage->stacks[stack];
  }
  const char *path = reference->path;
  char default_path[256];
  if (!path[0]) {
    const qmat_usd_layer *layer = &c->stage->layers[own->layers[0]]->layer;
    const char *name = qmat_usd_text(qmat_usd_field_value(layer->root, "defaultPrim"));
    if (!name || !*name || strlen(name) > 254) {
      return qmat_usd_warn(c->context, c->stage, c->prim,
                           "the %s @%s@ is left out: it names no prim, and the file no "
                           "default one",
                           what, shown(reference->asset));
    }
    snprintf(default_path, sizeof default_path, "%s%s", name[0] == '/' ? "" : "/", name);
    path = default_path;
  }
  return add_target(c, at, arc, stack, path, what);
}

static qmat_status add_references(composer *c, node *at, arc arc, const char *field, const char *what) {
  edited_list list;
  qmat_status status = edit_list(c, at, field, QMAT_USD_REFERENCE, &list);
  for (size_t i = 0; i < list.count && status == QMAT_OK; i++) {
    status = add_reference(c, at, arc, field, list.items[i], what);
  }
  qmat_free(list.items);
  return status;
}

static qmat_status add_classes(composer *c, node *at, arc arc, const char *field, const char *what) {
  edited_list list;
  qmat_status status = edit_list(c, at, field, QMAT_USD_PATH, &list);
  for (size_t i = 0; i < list.count && status == QMAT_OK; i++) {
    status = add_target(c, at, arc, at->stack, list.items[i], what);
    /* A layer that refers to this one may have a say about the class, too: the strongest of these is not composed. */
    for (const node *above = at->parent; above && status == QMAT_OK; above = above->parent) {
      if (above->stack == at->stack) continue;
      const layer_stack *layers = &c->stage->stacks[above->stack];
      const char *path = list.items[i];
      for (size_t k = 0; k < layers->count && status == QMAT_OK; k++) {
        if (!follow_path(&c->stage->layers[layers->layers[k]]->layer, path)) continue;
        status = qmat_usd_warn(c->context, c->stage, c->prim,
                               "what a referring layer says of the class <%s> is left out", shown(path));
      }
    }
  }
  qmat_free(list.items);
  return status;
}

/* Everything but variants, which wait until the rest is known. */
static qmat_status add_arcs(composer *c, node *at) {
  for (size_t i = 0; i < at->spec_count; i++) {
    static const char *const not_composed[] = {"relocates", "clips"};
    for (size_t k = 0; k < sizeof not_composed / sizeof not_composed[0]; k++) {
      if (!qmat_usd_field_value(at->specs[i], not_composed[k])) continue;
      qmat_status status = qmat_usd_warn(c->context, c->stage, c->prim, "its %s are left out", not_composed[k]);
      if (status != QMAT_OK) return status;
    }
  }
  qmat_status status = add_classes(c, at, ARC_INHERIT, "inheritPaths", "inherit");
  if (status == QMAT_OK) status = add_references(c, at, ARC_REFERENCE, "references", "reference");
  if (status == QMAT_OK) status = add_references(c, at, ARC_PAYLOAD, "payload", "payload");
  return status == QMAT_OK ? add_classes(c, at, ARC_SPECIALIZE, "specializes", "specialize") : status;
}

/* The strongest selection of a variant in a tree, or NULL. */
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

/* Whether any node of a tree has this variant. */
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

static qmat_status add_variant(composer *c, node *at, const char *set) {
  bool is_there = false;
  for (size_t i = 0; i < at->spec_count; i++) {
    is_there = is_there || qmat_usd_child(at->layers[i], at->specs[i], QMAT_USD_VARIANT_SET, set);
  }
  if (!is_there) return QMAT_OK;
  const char *selection = find_selection(c->prim->tree, set);
  if (!selection) {
    return qmat_usd_warn(c->context, c->stage, c->prim, "no variant of '%s' is selected: all are left out", shown(set));
  }
  node *made;
  qmat_status status = new_node(c, at, ARC_VARIANT, at->stack, at->spec_count, &made);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < at->spec_count; i++) {
    const qmat_usd_spec *variants = qmat_usd_child(at->layers[i], at->specs[i], QMAT_USD_VARIANT_SET, set);
    const qmat_usd_spec *spec = variants ? qmat_usd_child(at->layers[i], variants, QMAT_USD_VARIANT, selection) : NULL;
    if (spec) add_spec(made, at->layers[i], spec);
  }
  if (made->spec_count == 0) {
    if (has_variant(c->prim->tree, set, selection)) return QMAT_OK;
    return qmat_usd_warn(c->context, c->stage, c->prim, "there is no variant '%s' of '%s'", shown(selection),
                         shown(set));
  }
  link_node(at, made);
  return add_arcs(c, made);
}

/* The strongest node whose variants have not been looked at, or NULL. */
static node *find_undone(node *at) {
  if (!at->has_variants_done) return at;
  for (node *child = at->first_child; child; child = child->next) {
    node *found = find_undone(child);
    if (found) return found;
  }
  return NULL;
}

static qmat_status add_variants(composer *c) {
  node *at;
  while ((at = find_undone(c->prim->tree)) != NULL) {
    at->has_variants_done = true;
    edited_list sets;
    qmat_status status = edit_list(c, at, "variantSetNames", QMAT_USD_STRING, &sets);
    for (size_t i = 0; i < sets.count && status == QMAT_OK; i++) status = add_variant(c, at, sets.items[i]);
    qmat_free(sets.items);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

/* ---- prims ---- */

/* The tree of the child `name` as far as the arcs of its parent's tree bring it; `*made` is NULL where nothing is. */
static qmat_status copy_tree(composer *c, const node *from, node *parent, const char *name, node **made) {
  qmat_status status = new_node(c, parent, from->arc, from->stack, from->spec_count, made);
  if (status != QMAT_OK) return status;
  (*made)->introduced = from->introduced;
  for (size_t i = 0; i < from->spec_count; i++) {
    const qmat_usd_spec *spec = qmat_usd_child(from->layers[i], from->specs[i], QMAT_USD_PRIM, name);
    if (spec) add_spec(*made, from->layers[i], spec);
  }
  node **end = &(*made)->first_child;
  for (const node *child = from->first_child; child; child = child->next) {
    node *copy;
    status = copy_tree(c, child, *made, name, &copy);
    if (status != QMAT_OK) return status;
    if (!copy) continue;
    *end = copy;
    end = &copy->next;
  }
  if ((*made)->spec_count == 0 && !(*made)->first_child) {
    *made = NULL;
    c->stage->nodes_left++;
    c->node_count--;
  }
  return QMAT_OK;
}

static qmat_status add_arcs_of_copies(composer *c, node *at) {
  /* Arcs are linked in among the copies while this goes on: the copies are listed first. */
  size_t count = 0;
  for (const node *child = at->first_child; child; child = child->next) count++;
  node **copies = qmat_arena_alloc(&c->prim->arena, count, sizeof *copies);
  if (!copies) return fail_memory(c);
  count = 0;
  for (node *child = at->first_child; child; child = child->next) copies[count++] = child;
  qmat_status status = add_arcs(c, at);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) status = add_arcs_of_copies(c, copies[i]);
  return status;
}

static size_t count_specs(const node *at) {
  size_t count = at->spec_count;
  for (const node *child = at->first_child; child; child = child->next) count += count_specs(child);
  return count;
}

/* Lists the opinions of a tree from strong to weak; those of specializes come last of all. */
static void list_opinions(const node *at, bool inherited, bool specialized, bool wanted, qmat_usd_opinion *opinions,
                          size_t *count) {
  inherited = inherited || at->arc == ARC_INHERIT || at->arc == ARC_SPECIALIZE;
  specialized = specialized || at->arc == ARC_SPECIALIZE;
  for (size_t i = 0; i < at->spec_count && specialized == wanted; i++) {
    opinions[(*count)++] = (qmat_usd_opinion){.layer = at->layers[i], .spec = at->specs[i], .is_inherited = inherited};
  }
  for (const node *child = at->first_child; child; child = child->next) {
    list_opinions(child, inherited, specialized, wanted, opinions, count);
  }
}

static qmat_status finish_prim(composer *c) {
  qmat_usd_prim *prim = c->prim;
  qmat_usd_opinion *opinions = qmat_arena_alloc(&prim->arena, count_specs(prim->tree), sizeof *opinions);
  if (!opinions) return fail_memory(c);
  list_opinions(prim->tree, false, false, false, opinions, &prim->opinion_count);
  list_opinions(prim->tree, false, false, true, opinions, &prim->opinion_count);
  prim->opinions = opinions;
  return QMAT_OK;
}

qmat_status qmat_usd_stage_root(qmat_context *context, qmat_usd_stage *stage, qmat_usd_prim *prim) {
  *prim = (qmat_usd_prim){.name = ""};
  composer c = {.context = context, .stage = stage, .prim = prim};
  const layer_stack *layers = &stage->stacks[0];
  qmat_status status = new_node(&c, NULL, ARC_ROOT, 0, layers->count, &prim->tree);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < layers->count; i++) {
    const qmat_usd_layer *layer = &stage->layers[layers->layers[i]]->layer;
    add_spec(prim->tree, layer, layer->root);
  }
  return finish_prim(&c);
}

qmat_status qmat_usd_prim_child(qmat_context *context, qmat_usd_stage *stage, const qmat_usd_prim *parent,
                                const char *name, qmat_usd_prim *child) {
  *child = (qmat_usd_prim){.parent = parent, .name = name, .depth = parent->depth + 1};
  composer c = {.context = context, .stage = stage, .prim = child};
  if (child->depth > QMAT_USD_DEEPEST) {
    return qmat_usd_prim_fail(context, stage, child, "prims are nested more than %d deep", QMAT_USD_DEEPEST);
  }
  qmat_status status = copy_tree(&c, parent->tree, NULL, name, &child->tree);
  if (status == QMAT_OK && !child->tree) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "a prim of USD has no opinions");
  }
  if (status == QMAT_OK) status = add_arcs_of_copies(&c, child->tree);
  if (status == QMAT_OK) status = add_variants(&c);
  return status == QMAT_OK ? finish_prim(&c) : status;
}

void qmat_usd_prim_uninit(qmat_usd_prim *prim) {
  qmat_arena_uninit(&prim->arena);
  *prim = (qmat_usd_prim){0};
}

/* ---- what a prim says ---- */

/* Names in a table by their hash would be for thousands of children; they are looked up among the opinions instead: a
 * child is new where no weaker opinion has it. */
static bool is_below(const qmat_usd_prim *prim, size_t first_opinion, const char *name) {
  for (size_t i = first_opinion; i < prim->opinion_count; i++) {
    if (qmat_usd_child(prim->opinions[i].layer, prim->opinions[i].spec, QMAT_USD_PRIM, name)) return true;
  }
  return false;
}

qmat_status qmat_usd_prim_children(qmat_context *context, qmat_usd_prim *prim, const char *const **names,
                                   size_t *count) {
  size_t most = 0;
  for (size_t i = 0; i < prim->opinion_count; i++) {
    for (const qmat_usd_spec *child = prim->opinions[i].spec->first_child; child; child = child->next) {
      most += child->kind == QMAT_USD_PRIM;
    }
  }
  const char **made = qmat_arena_alloc(&prim->arena, most, sizeof *made);
  if (!made) return qmat_fail_memory(context, "a composed prim");
  *count = 0;
  /* Weaker opinions have their order kept; stronger ones add to its end. */
  for (size_t i = prim->opinion_count; i-- > 0;) {
    for (const qmat_usd_spec *child = prim->opinions[i].spec->first_child; child; child = child->next) {
      if (child->kind == QMAT_USD_PRIM && !is_below(prim, i + 1, child->name)) made[(*count)++] = child->name;
    }
  }
  *names = made;
  return QMAT_OK;
}

const qmat_usd_value *qmat_usd_prim_field(const qmat_usd_prim *prim, const char *name) {
  for (size_t i = 0; i < prim->opinion_count; i++) {
    const qmat_usd_value *value = qmat_usd_field_value(prim->opinions[i].spec, name);
    if (value) return value;
  }
  return NULL;
}

const char *qmat_usd_prim_specifier(const qmat_usd_prim *prim) {
  for (size_t i = 0; i < prim->opinion_count; i++) {
    const char *word = qmat_usd_text(qmat_usd_field_value(prim->opinions[i].spec, "specifier"));
    if (!word || strcmp(word, "over") == 0) continue;
    /* A class that is inherited makes no class of its heir. */
    if (strcmp(word, "class") == 0 && !prim->opinions[i].is_inherited) return "class";
    return "def";
  }
  return "over";
}

qmat_status qmat_usd_prim_attribute(qmat_context *context, qmat_usd_stage *stage, const qmat_usd_prim *prim,
                                    const char *name, const qmat_usd_value **value) {
  *value = NULL;
  for (size_t i = 0; i < prim->opinion_count; i++) {
    const qmat_usd_opinion *opinion = &prim->opinions[i];
    const qmat_usd_spec *spec = qmat_usd_child(opinion->layer, opinion->spec, QMAT_USD_ATTRIBUTE, name);
    if (!spec) continue;
    const qmat_usd_value *fixed = qmat_usd_field_value(spec, "default"),
                         *samples = qmat_usd_field_value(spec, "timeSamples"),
                         *spline = qmat_usd_field_value(spec, "spline");
    bool sampled = samples && samples->type == QMAT_USD_TIME_SAMPLES && samples->samples->count > 0;
    if (!fixed && !sampled && !spline) continue;
    *value = fixed;
    qmat_status status = QMAT_OK;
    if (sampled && !fixed) {
      size_t first = 0;
      for (size_t k = 1; k < samples->samples->count; k++) {
        if (samples->samples->times[k] < samples->samples->times[first]) first = k;
      }
      *value = samples->samples->values[first];
      status = qmat_usd_warn(context, stage, prim, "%s changes over time: its first sample is taken", shown(name));
    } else if (sampled || spline) {
      status = qmat_usd_warn(context, stage, prim, "%s changes over time: %s", shown(name),
                             fixed ? "its default is taken" : "it is left out");
    }
    if (*value && (*value)->type == QMAT_USD_BLOCK) *value = NULL;
    return status;
  }
  return QMAT_OK;
}

bool qmat_usd_prim_has_relationship(const qmat_usd_prim *prim, const char *name) {
  for (size_t i = 0; i < prim->opinion_count; i++) {
    if (qmat_usd_child(prim->opinions[i].layer, prim->opinions[i].spec, QMAT_USD_RELATIONSHIP, name)) return true;
  }
  return false;
}
