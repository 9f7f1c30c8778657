/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_prim.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MOST_WARNINGS = 100, PATH_TEXT = 256 };

/* ---- messages ---- */

bool qmat_usd_is_medial_data(const qmat_usd_value *custom_data) {
  return qmat_usd_text(qmat_usd_entry(custom_data, "qmat_version")) != NULL;
}

bool qmat_usd_prim_is_medial(const qmat_usd_prim *prim) {
  return qmat_usd_is_medial_data(qmat_usd_prim_field(prim, "customData"));
}

const char *qmat_usd_shown(const char *text) {
  return qmat_is_utf8(text) ? text : "?";
}

/* The path of a prim, shortened at its start if necessary. */
static const char *path_of(const qmat_usd_prim *prim, char text[PATH_TEXT]) {
  char *at = text + PATH_TEXT - 1;
  *at = '\0';
  if (!prim->parent) return "/";
  for (; prim->parent; prim = prim->parent) {
    const char *name = qmat_usd_shown(prim->name);
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

/* Replaces control characters, and removes a character that was cut. */
static void clean_text(char *text) {
  for (char *c = text; *c; c++) {
    if ((unsigned char)*c < ' ' || *c == 127) *c = '?';
  }
  for (size_t end = strlen(text); end > 0 && !qmat_is_utf8(text); end--) text[end - 1] = '\0';
}

qmat_status qmat_usd_warn(const qmat_usd_prim *prim, const char *format, ...) {
  qmat_usd_log *log = prim->log;
  char text[1024], path[PATH_TEXT];
  size_t used = 0;
  if (++log->count > MOST_WARNINGS) {
    snprintf(text, sizeof text, "and %zu more warnings", log->count - MOST_WARNINGS);
  } else {
    used = (size_t)snprintf(text, sizeof text, "%s: ", path_of(prim, path));
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + used, sizeof text - used, format, arguments);
    va_end(arguments);
  }
  clean_text(text);
  json_t *warning = json_string(text);
  int failed = log->count > MOST_WARNINGS + 1 ? json_array_set_new(log->warnings, MOST_WARNINGS, warning)
                                              : json_array_append_new(log->warnings, warning);
  return failed == 0 ? QMAT_OK : qmat_fail_memory(log->context, "the warnings");
}

qmat_status qmat_usd_prim_fail(const qmat_usd_prim *prim, const char *format, ...) {
  qmat_context *context = prim->log->context;
  char text[512], path[PATH_TEXT];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  qmat_fail(context, QMAT_ERROR_FORMAT, "%s: %s", path_of(prim, path), text);
  clean_text(context->error.message);
  return qmat_fail_at(context, prim->log->file, 0, 0);
}

qmat_status qmat_usd_warn_of_error(const qmat_usd_prim *prim, const char *what, const qmat_error *before) {
  qmat_context *context = prim->log->context;
  char message[sizeof context->error.message], path[PATH_TEXT];
  const char *shown = path_of(prim, path), *text = message;
  memcpy(message, context->error.message, sizeof message);
  if (strncmp(text, shown, strlen(shown)) == 0 && strncmp(text + strlen(shown), ": ", 2) == 0)
    text += strlen(shown) + 2;
  context->error = *before;
  return qmat_usd_warn(prim, "%s: %s", what, text);
}

qmat_status qmat_usd_fail_prim_memory(const qmat_usd_prim *prim) {
  return qmat_fail_memory(prim->log->context, "a composed prim");
}

bool qmat_usd_path_ends_in(const char *path, const char *end) {
  const size_t length = strlen(path), wanted = strlen(end);
  if (wanted == 0 || wanted > length || strcmp(path + length - wanted, end) != 0) return false;
  return wanted == length || path[length - wanted - 1] == '/';
}

void qmat_usd_prim_uninit(qmat_usd_prim *prim) {
  qmat_arena_uninit(&prim->arena);
  *prim = (qmat_usd_prim){0};
}

/* ---- opinions ---- */

/* Whether opinion `i` counts for the children, too. */
static bool is_of_children(const qmat_usd_prim *prim, size_t i) {
  return prim->opinions[i].arc_depth >= prim->least_arc_depth;
}

/* Whether an opinion from number `first_opinion` on, or a weaker one, has the child. */
static bool is_below(const qmat_usd_prim *prim, size_t first_opinion, const char *name) {
  for (size_t i = first_opinion; i < prim->opinion_count; i++) {
    if (!is_of_children(prim, i)) continue;
    if (qmat_usd_child(prim->opinions[i].layer, prim->opinions[i].spec, QMAT_USD_PRIM, name)) return true;
  }
  return false;
}

qmat_status qmat_usd_prim_children(qmat_usd_prim *prim, const char *const **names, size_t *count) {
  size_t most = 0;
  for (size_t i = 0; i < prim->opinion_count; i++) {
    for (const qmat_usd_spec *child = prim->opinions[i].spec->first_child; child; child = child->next)
      most += child->kind == QMAT_USD_PRIM;
  }
  const char **made = qmat_arena_alloc(&prim->arena, most, sizeof *made);
  if (!made) return qmat_usd_fail_prim_memory(prim);
  *count = 0;
  /* From the weakest opinion to the strongest: each adds its new children at the end. */
  for (size_t i = prim->opinion_count; i-- > 0;) {
    if (!is_of_children(prim, i)) continue;
    for (const qmat_usd_spec *child = prim->opinions[i].spec->first_child; child; child = child->next) {
      if (child->kind == QMAT_USD_PRIM && !is_below(prim, i + 1, child->name)) made[(*count)++] = child->name;
    }
  }
  *names = made;
  return QMAT_OK;
}

qmat_status qmat_usd_prim_find_child(qmat_usd_prim *prim, const char *name, size_t length, const char **found) {
  *found = NULL;
  char *copy = qmat_arena_alloc(&prim->arena, length + 1, 1);
  if (!copy) return qmat_usd_fail_prim_memory(prim);
  memcpy(copy, name, length);
  copy[length] = '\0';
  for (size_t i = 0; i < prim->opinion_count && !*found; i++) {
    const qmat_usd_opinion *opinion = &prim->opinions[i];
    const qmat_usd_spec *child =
        is_of_children(prim, i) ? qmat_usd_child(opinion->layer, opinion->spec, QMAT_USD_PRIM, copy) : NULL;
    if (child) *found = child->name;
  }
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
    /* Inheriting from a class does not make the heir a class. */
    if (strcmp(word, "class") == 0 && !prim->opinions[i].is_inherited) return "class";
    return "def";
  }
  return "over";
}

qmat_status qmat_usd_prim_attribute(const qmat_usd_prim *prim, const char *name, const qmat_usd_value **value) {
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
      status = qmat_usd_warn(prim, "%s changes over time: its first sample is used", qmat_usd_shown(name));
    } else if (sampled || spline) {
      status = qmat_usd_warn(prim, "%s changes over time: %s", qmat_usd_shown(name),
                             fixed ? "its default is used" : "it is skipped");
    }
    if (*value && (*value)->type == QMAT_USD_BLOCK) *value = NULL;
    return status;
  }
  return QMAT_OK;
}

void qmat_usd_prim_samples(const qmat_usd_prim *prim, const char *name, const qmat_usd_samples **samples,
                           qmat_usd_time *time, const qmat_usd_value **fixed) {
  *samples = NULL;
  *fixed = NULL;
  for (size_t i = 0; i < prim->opinion_count; i++) {
    const qmat_usd_opinion *opinion = &prim->opinions[i];
    const qmat_usd_spec *spec = qmat_usd_child(opinion->layer, opinion->spec, QMAT_USD_ATTRIBUTE, name);
    const qmat_usd_value *value = spec ? qmat_usd_field_value(spec, "default") : NULL,
                         *sampled = spec ? qmat_usd_field_value(spec, "timeSamples") : NULL;
    *time = opinion->time;
    if (sampled && sampled->type == QMAT_USD_TIME_SAMPLES && sampled->samples->count > 0) {
      *samples = sampled->samples;
      return;
    }
    if (!value) continue;
    if (value->type != QMAT_USD_BLOCK) *fixed = value;
    return;
  }
}

const qmat_usd_prim *qmat_usd_prim_above(const qmat_usd_prim *prim, qmat_usd_kind kind, const char *name) {
  for (; prim; prim = prim->parent) {
    for (size_t i = 0; i < prim->opinion_count; i++)
      if (qmat_usd_child(prim->opinions[i].layer, prim->opinions[i].spec, kind, name)) return prim;
  }
  return NULL;
}

const qmat_usd_value *qmat_usd_prim_metadata(const qmat_usd_prim *prim, const char *attribute, const char *field) {
  for (size_t i = 0; i < prim->opinion_count; i++) {
    const qmat_usd_opinion *opinion = &prim->opinions[i];
    const qmat_usd_spec *spec = qmat_usd_child(opinion->layer, opinion->spec, QMAT_USD_ATTRIBUTE, attribute);
    const qmat_usd_value *value = spec ? qmat_usd_field_value(spec, field) : NULL;
    if (value) return value;
  }
  return NULL;
}

qmat_status qmat_usd_prim_token(const qmat_usd_prim *prim, const char *name, const char *otherwise,
                                const char **token) {
  const qmat_usd_value *value;
  qmat_status status = qmat_usd_prim_attribute(prim, name, &value);
  *token = value && qmat_usd_text(value) ? qmat_usd_text(value) : otherwise;
  return status;
}

static bool holds_text(const qmat_usd_value *list, const char *text) {
  for (size_t i = 0; qmat_usd_is_text(list->type) && i < list->count; i++)
    if (strcmp(list->texts[i], text) == 0) return true;
  return false;
}

bool qmat_usd_prim_has_schema(const qmat_usd_prim *prim, const char *name) {
  for (size_t i = 0; i < prim->opinion_count; i++) {
    const qmat_usd_value *value = qmat_usd_field_value(prim->opinions[i].spec, "apiSchemas");
    if (!value || value->type != QMAT_USD_LIST_OP) continue;
    const qmat_usd_list_op *op = value->list_op;
    static const qmat_usd_edit givers[] = {QMAT_USD_EXPLICIT, QMAT_USD_ADDED, QMAT_USD_PREPENDED, QMAT_USD_APPENDED};
    for (size_t k = 0; k < sizeof givers / sizeof *givers; k++)
      if (holds_text(&op->lists[givers[k]], name)) return true;
    if (op->is_explicit || holds_text(&op->lists[QMAT_USD_DELETED], name)) return false; /* weaker ones do not count */
  }
  return false;
}

bool qmat_usd_prim_has_relationship(const qmat_usd_prim *prim, const char *name) {
  for (size_t i = 0; i < prim->opinion_count; i++) {
    if (qmat_usd_child(prim->opinions[i].layer, prim->opinions[i].spec, QMAT_USD_RELATIONSHIP, name)) return true;
  }
  return false;
}
