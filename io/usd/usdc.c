/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc.h"

#include <string.h>

#include "io/usd/usdc_types.h"
#include "io/usd/usdc_value.h"

enum { OLDEST_VERSION = 6, NEWEST_VERSION = 10, HEADER_BYTES = 24 };

static qmat_status fail(const qmat_usdc *c, const char *what) {
  return qmat_usd_layer_fail(c->layer, what);
}

/* ---- fields ---- */

/* Fields that repeat the tree of specs. */
static bool repeats_tree(const char *name) {
  static const char *const names[] = {"properties",     "variantSetChildren", "variantChildren",
                                      "targetChildren", "connectionChildren", "mapperChildren"};
  for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
    if (strcmp(names[i], name) == 0) return true;
  }
  return false;
}

/* Sorts the prims among the children by the list; the others follow in their order. No child may be added afterwards.
 */
static void order_children(const qmat_usdc *c, qmat_usd_spec *spec, const qmat_usd_value *names) {
  size_t count = 0;
  for (const qmat_usd_spec *child = spec->first_child; child; child = child->next) count++;
  /* Several specs may share one long list: only as many names are looked up as there are children. */
  if (count > names->count) count = names->count;
  for (size_t i = 0; i < count; i++) {
    qmat_usd_spec *child = qmat_usd_child(c->layer, spec, QMAT_USD_PRIM, names->texts[i]);
    if (child) child->line = 1; /* marks children in the list */
  }
  qmat_usd_spec *rest = NULL, **rest_end = &rest, *listed = NULL, **listed_end = &listed;
  for (qmat_usd_spec *child = spec->first_child, *next; child; child = next) {
    next = child->next;
    if (child->line != 0) continue;
    *rest_end = child;
    rest_end = &child->next;
  }
  *rest_end = NULL;
  for (size_t i = 0; i < count; i++) {
    qmat_usd_spec *child = qmat_usd_child(c->layer, spec, QMAT_USD_PRIM, names->texts[i]);
    if (!child || child->line == 0) continue;
    child->line = 0;
    *listed_end = child;
    listed_end = &child->next;
  }
  *listed_end = rest;
  spec->first_child = listed;
}

/* Reads the fields of a spec; `*names` becomes the list of its prims, if it has one. */
static qmat_status read_fields(qmat_usdc_values *v, uint32_t set, qmat_usd_spec *spec, const qmat_usd_value **names) {
  const qmat_usdc *c = v->crate;
  size_t count = 0;
  while (c->field_sets[set + count] != QMAT_USDC_NONE) {
    if (++count > QMAT_USD_MOST_FIELDS) return fail(c, "a spec has too many fields");
  }
  if (spec->fields) return fail(c, "two specs have the same path"); /* a set of variants may have two elements */
  spec->fields = qmat_usd_alloc(c->layer, count, sizeof *spec->fields);
  if (!spec->fields) return qmat_usd_layer_error(c->layer);
  spec->field_capacity = count;
  for (size_t i = 0; i < count; i++) {
    const uint32_t field = c->field_sets[set + i];
    const char *name = c->tokens[c->field_names[field]];
    if (repeats_tree(name)) continue;
    const qmat_usd_value *value;
    qmat_status status = qmat_usdc_value(v, c->field_reps[field], &value);
    if (status != QMAT_OK) return status;
    if (strcmp(name, "primChildren") == 0) {
      if (value->is_array && qmat_usd_is_text(value->type)) *names = value;
      continue;
    }
    spec->fields[spec->field_count++] = (qmat_usd_field){.name = name, .value = value};
  }
  return QMAT_OK;
}

/* ---- specs ---- */

/* Makes the spec of "{set=variant}", and that of the set; of "{set=}" the set only. NULL with the error recorded. */
static qmat_usd_spec *make_variant(const qmat_usdc *c, qmat_usd_spec *parent, const char *element) {
  const char *equals = strchr(element, '='), *end = element + strlen(element) - 1;
  if (!equals || *end != '}') {
    fail(c, "the path of a variant does not have the form {set=variant}");
    return NULL;
  }
  const char *set_name = qmat_usd_copy(c->layer, element + 1, (size_t)(equals - element) - 1);
  const char *name = set_name ? qmat_usd_copy(c->layer, equals + 1, (size_t)(end - equals) - 1) : NULL;
  if (!name) return NULL;
  qmat_usd_spec *set = qmat_usd_child(c->layer, parent, QMAT_USD_VARIANT_SET, set_name);
  if (!set) set = qmat_usd_add_child(c->layer, parent, QMAT_USD_VARIANT_SET, set_name);
  if (!set || !*name) return set;
  if (!qmat_usd_child(c->layer, set, QMAT_USD_VARIANT, name))
    return qmat_usd_add_child(c->layer, set, QMAT_USD_VARIANT, name);
  fail(c, "two specs have the same path");
  return NULL;
}

/* Makes the spec of a path; it stays NULL for targets and connections, which the layer does not have. */
static qmat_status make_spec(const qmat_usdc *c, qmat_usdc_path *path, uint32_t type) {
  if (path->parent == QMAT_USDC_NONE) {
    if (type != QMAT_USDC_SPEC_PSEUDO_ROOT) return fail(c, "the root of the file has the wrong type");
    path->spec = c->layer->root;
    return QMAT_OK;
  }
  if (path->is_below_target || path->element[0] == '.') return QMAT_OK;
  qmat_usd_spec *parent = c->paths[path->parent].spec;
  if (!parent) return fail(c, "a spec has no parent");
  const bool is_variant = !path->is_property && path->element[0] == '{',
             is_relationship = type == QMAT_USDC_SPEC_RELATIONSHIP;
  const bool matches = path->is_property ? is_relationship || type == QMAT_USDC_SPEC_ATTRIBUTE
                       : is_variant      ? type == QMAT_USDC_SPEC_VARIANT || type == QMAT_USDC_SPEC_SET
                                         : type == QMAT_USDC_SPEC_PRIM;
  if (!matches) return fail(c, "the type of a spec does not match its path");
  if (is_variant) {
    path->spec = make_variant(c, parent, path->element);
  } else {
    const qmat_usd_kind kind = !path->is_property ? QMAT_USD_PRIM
                               : is_relationship  ? QMAT_USD_RELATIONSHIP
                                                  : QMAT_USD_ATTRIBUTE;
    if (qmat_usd_child(c->layer, parent, kind, path->element)) return fail(c, "two specs have the same path");
    path->spec = qmat_usd_add_child(c->layer, parent, kind, path->element);
  }
  return path->spec ? QMAT_OK : qmat_usd_layer_error(c->layer);
}

/* Makes all specs, parents before children. */
static qmat_status make_specs(qmat_usdc *c, qmat_usdc_values *v) {
  const qmat_usdc_spec **spec_of_path = qmat_arena_calloc(&c->scratch, c->path_count, sizeof *spec_of_path);
  const qmat_usd_value **orders = qmat_arena_calloc(&c->scratch, c->path_count, sizeof *orders);
  qmat_status status = spec_of_path && orders ? QMAT_OK : qmat_usd_layer_fail_memory(c->layer);
  for (size_t i = 0; i < c->spec_count && status == QMAT_OK; i++) {
    if (spec_of_path[c->specs[i].path]) return fail(c, "two specs have the same path");
    spec_of_path[c->specs[i].path] = &c->specs[i];
  }
  for (size_t k = 0; k < c->path_order_count && status == QMAT_OK; k++) {
    qmat_usdc_path *path = &c->paths[c->path_order[k]];
    const qmat_usdc_spec *spec = spec_of_path[c->path_order[k]];
    if (!spec) continue;
    status = make_spec(c, path, spec->type);
    if (status == QMAT_OK && path->spec) status = read_fields(v, spec->set, path->spec, &orders[c->path_order[k]]);
  }
  for (size_t k = 0; k < c->path_order_count && status == QMAT_OK; k++) {
    const uint32_t path = c->path_order[k];
    if (orders[path]) order_children(c, c->paths[path].spec, orders[path]);
  }
  return status;
}

/* ---- files ---- */

bool qmat_usdc_is_crate(const qmat_bytes *bytes) {
  return bytes->size >= 8 && memcmp(bytes->data, "PXR-USDC", 8) == 0;
}

static qmat_status check_header(qmat_usdc *c, const qmat_bytes *bytes) {
  if (bytes->size < HEADER_BYTES || !qmat_usdc_is_crate(bytes))
    return fail(c, "a binary layer of USD must start with PXR-USDC");
  const int major = bytes->data[8], minor = bytes->data[9];
  c->version = minor;
  if (major == 0 && minor >= OLDEST_VERSION && minor <= NEWEST_VERSION) return QMAT_OK;
  qmat_fail_file(c->layer->context, QMAT_ERROR_FORMAT, c->layer->path,
                 "the crate has version %d.%d; only 0.%d to 0.%d are supported", major, minor, OLDEST_VERSION,
                 NEWEST_VERSION);
  return qmat_fail_hint(c->layer->context, "convert it with usdcat to .usda");
}

qmat_status qmat_usdc_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_usd_layer *layer) {
  qmat_usdc c = {.layer = layer, .bytes = bytes->data, .size = bytes->size};
  qmat_usdc_values values = {.crate = &c};
  qmat_status status = qmat_usd_layer_init(context, layer, path, bytes->size);
  if (status == QMAT_OK) status = check_header(&c, bytes);
  if (status == QMAT_OK) status = qmat_usdc_read_tables(&c);
  if (status == QMAT_OK && qmat_key_table_init(&values.known, 0) != 0) status = qmat_usd_layer_fail_memory(layer);
  if (status == QMAT_OK) status = make_specs(&c, &values);
  qmat_key_table_uninit(&values.known);
  qmat_arena_uninit(&c.scratch);
  return status;
}
