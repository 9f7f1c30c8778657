/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usda.h"

#include <string.h>

#include "io/usd/usda_value.h"

/* ---- fields ---- */

static qmat_status set_text(qmat_usda *p, qmat_usd_spec *spec, const char *name, const char *text) {
  qmat_usd_value value;
  qmat_status status = qmat_usd_make_text(p->layer, QMAT_USD_TOKEN, text, &value);
  return status == QMAT_OK ? qmat_usd_set_field(p->layer, spec, name, &value) : status;
}

/* Takes the word before a list that says how it edits the list of weaker layers. */
static bool accept_edit(qmat_usda *p, qmat_usd_edit *edit) {
  static const char *const words[] = {[QMAT_USD_ADDED] = "add",
                                      [QMAT_USD_PREPENDED] = "prepend",
                                      [QMAT_USD_APPENDED] = "append",
                                      [QMAT_USD_DELETED] = "delete",
                                      [QMAT_USD_ORDERED] = "reorder"};
  for (*edit = QMAT_USD_ADDED; *edit < QMAT_USD_EDIT_COUNT; ++*edit) {
    if (qmat_usda_accept_word(p, words[*edit])) return true;
  }
  *edit = QMAT_USD_EXPLICIT;
  return false;
}

/* Takes a list and adds it to the field's other edits. */
static qmat_status take_edit(qmat_usda *p, qmat_usd_spec *spec, const char *name, qmat_usd_edit edit,
                             qmat_usd_type type) {
  const qmat_usd_value *older = qmat_usd_field_value(spec, name);
  qmat_usd_list_op *op = qmat_usd_alloc(p->layer, 1, sizeof *op);
  if (!op) return qmat_usd_layer_error(p->layer);
  if (older && older->type == QMAT_USD_LIST_OP && edit != QMAT_USD_EXPLICIT) {
    *op = *older->list_op;
  } else {
    for (int i = 0; i < QMAT_USD_EDIT_COUNT; i++)
      op->lists[i] = (qmat_usd_value){.type = type, .is_array = true, .components = 1};
  }
  if (edit == QMAT_USD_EXPLICIT) op->is_explicit = true;
  const qmat_usd_value value = {.type = QMAT_USD_LIST_OP, .components = 1, .count = 1, .list_op = op};
  qmat_status status = qmat_usda_take_list(p, type, &op->lists[edit]);
  return status == QMAT_OK ? qmat_usd_set_field(p->layer, spec, name, &value) : status;
}

/* = [names of prims or properties in their order] */
static qmat_status take_order(qmat_usda *p, qmat_usd_spec *spec, const char *name) {
  qmat_usd_value value;
  qmat_status status = qmat_usda_expect(p, '=');
  if (status == QMAT_OK) status = qmat_usda_take_names(p, &value);
  return status == QMAT_OK ? qmat_usd_set_field(p->layer, spec, name, &value) : status;
}

/* ---- metadata ---- */

/* Fields whose binary name differs from their name in text, or whose list has a known type. */
static const struct {
  const char *word, *name;
  qmat_usd_type list;
} known_fields[] = {
    {"doc", "documentation", QMAT_USD_BLOCK},         {"references", "references", QMAT_USD_REFERENCE},
    {"payload", "payload", QMAT_USD_REFERENCE},       {"inherits", "inheritPaths", QMAT_USD_PATH},
    {"specializes", "specializes", QMAT_USD_PATH},    {"variantSets", "variantSetNames", QMAT_USD_STRING},
    {"variants", "variantSelection", QMAT_USD_BLOCK}, {"apiSchemas", "apiSchemas", QMAT_USD_TOKEN},
    {"inactiveIds", "inactiveIds", QMAT_USD_INT64},
};

static qmat_status take_field(qmat_usda *p, qmat_usd_spec *spec) {
  qmat_usd_edit edit;
  qmat_usd_value value, offsets;
  const char *name = "comment"; /* of a text without a name */
  qmat_usd_type list = QMAT_USD_BLOCK;
  qmat_status status = QMAT_OK;
  if (!qmat_usda_at_string(p)) {
    const bool edits = accept_edit(p, &edit);
    status = qmat_usda_take_name(p, "the name of a field", &name);
    if (status == QMAT_OK) status = qmat_usda_expect(p, '=');
    if (status != QMAT_OK) return status;
    for (size_t i = 0; i < sizeof known_fields / sizeof known_fields[0]; i++) {
      if (strcmp(name, known_fields[i].word) != 0) continue;
      name = known_fields[i].name;
      list = known_fields[i].list;
      break;
    }
    if (edits || list != QMAT_USD_BLOCK) return take_edit(p, spec, name, edit, list);
  }
  if (spec->kind == QMAT_USD_ROOT && strcmp(name, "subLayers") == 0) {
    status = qmat_usda_take_sublayers(p, &value, &offsets);
    if (status == QMAT_OK) status = qmat_usd_set_field(p->layer, spec, "subLayerOffsets", &offsets);
  } else if (strcmp(name, "relocates") == 0 || strcmp(name, "prefixSubstitutions") == 0 ||
             strcmp(name, "suffixSubstitutions") == 0) {
    status = qmat_usda_skip(p, name, &value);
  } else {
    status = qmat_usda_take_any(p, &value);
  }
  return status == QMAT_OK ? qmat_usd_set_field(p->layer, spec, name, &value) : status;
}

/* ( ... ), which may be missing. */
static qmat_status take_metadata(qmat_usda *p, qmat_usd_spec *spec) {
  if (!qmat_usda_accept(p, '(')) return QMAT_OK;
  qmat_status status = QMAT_OK;
  while (status == QMAT_OK && !qmat_usda_accept(p, ')')) {
    status = take_field(p, spec);
    while (status == QMAT_OK && qmat_usda_accept(p, ';')) continue;
  }
  return status;
}

/* ---- properties ---- */

/* A statement that is being read. */
typedef struct statement {
  qmat_scanner start;
  qmat_usd_spec *owner; /* the prim or variant that it is in */
} statement;

/* Finds the child of this name, or adds it at the start of the statement. */
static qmat_status find_or_add(qmat_usda *p, const statement *s, qmat_usd_kind kind, const char *name,
                               qmat_usd_spec **spec) {
  *spec = qmat_usd_child(p->layer, s->owner, kind, name);
  if (*spec) return QMAT_OK;
  *spec = qmat_usd_add_child(p->layer, s->owner, kind, name);
  if (!*spec) return qmat_fail_at(p->layer->context, s->start.file, s->start.line, 0);
  (*spec)->line = s->start.line;
  (*spec)->column = (int)(s->start.at - s->start.line_start) + 1;
  return QMAT_OK;
}

/* What precedes the type of a property. */
typedef struct qualifiers {
  bool edits, custom, uniform, varying;
  qmat_usd_edit edit;
} qualifiers;

/* Takes the name of a property and finds its spec. */
static qmat_status take_property_name(qmat_usda *p, const statement *s, const qualifiers *q, qmat_usd_kind kind,
                                      qmat_usd_spec **spec) {
  const char *name;
  qmat_status status = qmat_usda_take_name(p, "the name of a property", &name);
  if (status == QMAT_OK) status = find_or_add(p, s, kind, name, spec);
  if (status == QMAT_OK && q->custom) {
    qmat_usd_value yes;
    status = qmat_usd_make_bool(p->layer, true, &yes);
    if (status == QMAT_OK) status = qmat_usd_set_field(p->layer, *spec, "custom", &yes);
  }
  const bool uniform = kind == QMAT_USD_RELATIONSHIP ? !q->varying : q->uniform;
  return status == QMAT_OK && uniform ? set_text(p, *spec, "variability", "uniform") : status;
}

static qmat_status take_relationship(qmat_usda *p, const statement *s, const qualifiers *q) {
  qmat_usd_spec *spec;
  qmat_status status = take_property_name(p, s, q, QMAT_USD_RELATIONSHIP, &spec);
  if (status != QMAT_OK) return status;
  if (p->scanner.at[0] == '[') return qmat_scan_fail(&p->scanner, "attributes of relationships are not supported");
  if (p->scanner.at[0] == '.') {
    p->scanner.at++;
    if (!qmat_usda_accept_word(p, "timeSamples") && !qmat_usda_accept_word(p, "default"))
      return qmat_usda_expected(p, "timeSamples or default");
    qmat_usd_value value;
    status = qmat_usda_expect(p, '=');
    if (status == QMAT_OK) status = qmat_usda_skip(p, "targets over time", &value);
    return status == QMAT_OK ? qmat_usd_set_field(p->layer, spec, "timeSamples", &value) : status;
  }
  if (qmat_usda_accept(p, '=')) status = take_edit(p, spec, "targetPaths", q->edit, QMAT_USD_PATH);
  return status == QMAT_OK ? take_metadata(p, spec) : status;
}

static qmat_status take_attribute(qmat_usda *p, const statement *s, const qualifiers *q) {
  qmat_usda_type type;
  qmat_usd_spec *spec;
  qmat_usd_value value;
  qmat_status status = qmat_usda_take_type(p, &type);
  if (status == QMAT_OK) status = take_property_name(p, s, q, QMAT_USD_ATTRIBUTE, &spec);
  if (status == QMAT_OK) status = set_text(p, spec, "typeName", type.name);
  if (status != QMAT_OK) return status;
  if (p->scanner.at[0] == '.') {
    p->scanner.at++;
    const bool connect = qmat_usda_accept_word(p, "connect"),
               samples = !connect && qmat_usda_accept_word(p, "timeSamples");
    if (!connect && !samples && !qmat_usda_accept_word(p, "spline"))
      return qmat_usda_expected(p, "connect, timeSamples or spline");
    status = qmat_usda_expect(p, '=');
    if (status == QMAT_OK && connect) {
      status = take_edit(p, spec, "connectionPaths", q->edit, QMAT_USD_PATH);
    } else if (status == QMAT_OK) {
      status = samples ? qmat_usda_take_samples(p, &type, &value) : qmat_usda_skip(p, "spline", &value);
      if (status == QMAT_OK) status = qmat_usd_set_field(p->layer, spec, samples ? "timeSamples" : "spline", &value);
    }
  } else if (qmat_usda_accept(p, '=')) {
    status = qmat_usda_take_typed(p, &type, &value);
    if (status == QMAT_OK) status = qmat_usd_set_field(p->layer, spec, "default", &value);
  }
  return status == QMAT_OK ? take_metadata(p, spec) : status;
}

/* A property, or the order of children or properties. */
static qmat_status take_property(qmat_usda *p, const statement *s) {
  qualifiers q = {0};
  q.edits = accept_edit(p, &q.edit);
  if (q.edits && q.edit == QMAT_USD_ORDERED) {
    if (qmat_usda_accept_word(p, "nameChildren")) return take_order(p, s->owner, "primOrder");
    if (qmat_usda_accept_word(p, "properties")) return take_order(p, s->owner, "propertyOrder");
  }
  q.custom = qmat_usda_accept_word(p, "custom");
  q.varying = qmat_usda_accept_word(p, "varying");
  q.uniform = !q.varying && (qmat_usda_accept_word(p, "uniform") || qmat_usda_accept_word(p, "config"));
  return qmat_usda_accept_word(p, "rel") ? take_relationship(p, s, &q) : take_attribute(p, s, &q);
}

/* ---- prims ---- */

static qmat_status take_contents(qmat_usda *p, qmat_usd_spec *spec);

/* Takes a specifier; NULL when there is none. */
static const char *accept_specifier(qmat_usda *p) {
  static const char *const specifiers[] = {"def", "over", "class"};
  for (size_t i = 0; i < 3; i++) {
    if (qmat_usda_accept_word(p, specifiers[i])) return specifiers[i];
  }
  return NULL;
}

static qmat_status take_prim(qmat_usda *p, const statement *s, const char *specifier) {
  const char *name, *type_name = NULL;
  qmat_usd_spec *spec;
  if (!qmat_usda_at_string(p)) {
    size_t length;
    const char *text = qmat_usda_peek_name(p, &length);
    while (p->scanner.at + length < p->scanner.end && (qmat_usda_is_name_part(text[length]) || text[length] == '.'))
      length++;
    if (length == 0) return qmat_usda_expected(p, "the type or the name of a prim");
    type_name = qmat_usd_copy(p->layer, text, length);
    if (!type_name) return qmat_usd_layer_error(p->layer);
    p->scanner.at += length;
  }
  qmat_status status = qmat_usda_take_string(p, &name);
  if (status != QMAT_OK) return status;
  bool good = qmat_usda_is_name_start(*name) || (*name >= '0' && *name <= '9');
  for (const char *c = name; *c && good; c++) good = qmat_usda_is_name_part(*c);
  const char *shown = qmat_is_utf8(name) ? name : "?";
  if (!good) return qmat_scan_fail(&s->start, "'%.40s' is not a valid name of a prim", shown);
  if (qmat_usd_child(p->layer, s->owner, QMAT_USD_PRIM, name))
    return qmat_scan_fail(&s->start, "duplicate prim '%.200s'", shown);
  status = find_or_add(p, s, QMAT_USD_PRIM, name, &spec);
  if (status == QMAT_OK) status = set_text(p, spec, "specifier", specifier);
  if (status == QMAT_OK && type_name) status = set_text(p, spec, "typeName", type_name);
  if (status == QMAT_OK) status = take_metadata(p, spec);
  return status == QMAT_OK ? take_contents(p, spec) : status;
}

/* "set" = { "variant" (...) { ... } ... } */
static qmat_status take_variant_set(qmat_usda *p, const statement *s) {
  const char *name;
  qmat_usd_spec *set, *variant;
  qmat_status status = qmat_usda_take_string(p, &name);
  if (status == QMAT_OK) status = qmat_usda_expect(p, '=');
  if (status == QMAT_OK) status = qmat_usda_expect(p, '{');
  if (status == QMAT_OK) status = find_or_add(p, s, QMAT_USD_VARIANT_SET, name, &set);
  while (status == QMAT_OK && !qmat_usda_accept(p, '}')) {
    const statement inner = {.start = p->scanner, .owner = set};
    status = qmat_usda_take_string(p, &name);
    if (status == QMAT_OK) status = find_or_add(p, &inner, QMAT_USD_VARIANT, name, &variant);
    if (status == QMAT_OK) status = take_metadata(p, variant);
    if (status == QMAT_OK) status = take_contents(p, variant);
    while (status == QMAT_OK && qmat_usda_accept(p, ';')) continue;
  }
  return status;
}

/* { ... } of a prim or a variant. */
static qmat_status take_contents(qmat_usda *p, qmat_usd_spec *spec) {
  qmat_status status = qmat_usda_expect(p, '{');
  while (status == QMAT_OK && !qmat_usda_accept(p, '}')) {
    if (qmat_usda_accept(p, ';')) continue;
    const statement s = {.start = p->scanner, .owner = spec};
    const char *specifier = accept_specifier(p);
    if (specifier) {
      status = take_prim(p, &s, specifier);
    } else if (qmat_usda_accept_word(p, "variantSet")) {
      status = take_variant_set(p, &s);
    } else {
      status = take_property(p, &s);
    }
  }
  return status;
}

static qmat_status take_layer(qmat_usda *p) {
  qmat_scanner *scanner = &p->scanner;
  qmat_usd_spec *root = p->layer->root;
  if (qmat_scan_left(scanner) < 6 || memcmp(scanner->at, "#usda ", 6) != 0)
    return qmat_scan_fail(scanner, "a text layer of USD must start with '#usda 1.0'");
  double version;
  const char *end = qmat_scan_double(scanner->at + 6, scanner->end, &version);
  if (!end || !(version >= 1 && version < 2))
    return qmat_scan_fail(scanner, "only version 1 of the text form of USD is supported");
  scanner->at = end;
  qmat_scan_next_line(scanner);

  qmat_status status = take_metadata(p, root);
  while (status == QMAT_OK && qmat_usda_peek(p) != 0) {
    const statement s = {.start = *scanner, .owner = root};
    const char *specifier = accept_specifier(p);
    if (specifier) {
      status = take_prim(p, &s, specifier);
    } else if (qmat_usda_accept_word(p, "reorder")) {
      status =
          qmat_usda_accept_word(p, "rootPrims") ? take_order(p, root, "primOrder") : qmat_usda_expected(p, "rootPrims");
    } else if (!qmat_usda_accept(p, ';')) {
      status = qmat_usda_expected(p, "def, over or class");
    }
  }
  /* A zero byte looks like the end of the text. */
  if (status == QMAT_OK && scanner->at < scanner->end) status = qmat_usda_expected(p, "def, over or class");
  return status;
}

qmat_status qmat_usda_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_usd_layer *layer) {
  qmat_usda p = {.layer = layer};
  qmat_status status = qmat_usd_layer_init(context, layer, path, bytes->size);
  if (status != QMAT_OK) return status;
  qmat_scanner_init(&p.scanner, context, layer->path, (const char *)bytes->data, bytes->size, '#');
  status = take_layer(&p);
  qmat_free(p.text.items);
  qmat_free(p.numbers.items);
  return status;
}
