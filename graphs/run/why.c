/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/why.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "graphs/cache/cache_key.h"

json_t *qmat_cache_records(qmat_cache *cache) {
  qmat_cache_entry *entries;
  size_t count;
  json_t *records = json_array();
  if (!records || !qmat_cache_list(cache, &entries, &count)) {
    json_decref(records);
    return NULL;
  }
  for (size_t i = 0; i < count; i++) {
    json_t *record = entries[i].kind == QMAT_CACHE_RECORD ? qmat_cache_record(cache, &entries[i].digest) : NULL;
    /* Records without outputs list side files. */
    if (json_object_get(record, "outputs"))
      json_array_append_new(records, record);
    else
      json_decref(record);
  }
  qmat_free(entries);
  return records;
}

/* ---- items ---- */

static const char *text_of(const json_t *item, size_t index) {
  const char *text = json_string_value(json_array_get(item, index));
  return text ? text : "";
}

/* The tag that items are compared by: "unset" is a parameter too. */
static const char *group_of(const json_t *item) {
  return strcmp(text_of(item, 0), "unset") == 0 ? "param" : text_of(item, 0);
}

static bool same_subject(const json_t *a, const json_t *b) {
  return strcmp(group_of(a), group_of(b)) == 0 && strcmp(text_of(a, 1), text_of(b, 1)) == 0;
}

static const json_t *find_item(const json_t *items, const json_t *like) {
  for (size_t i = 0; i < json_array_size(items); i++)
    if (same_subject(json_array_get(items, i), like)) return json_array_get(items, i);
  return NULL;
}

static const char *node_type_of(const json_t *items) {
  for (size_t i = 0; i < json_array_size(items); i++)
    if (strcmp(text_of(json_array_get(items, i), 0), "node") == 0) return text_of(json_array_get(items, i), 1);
  return "";
}

static size_t count_differences(const json_t *now, const json_t *before) {
  size_t count = 0;
  for (size_t i = 0; i < json_array_size(now); i++) {
    const json_t *item = json_array_get(now, i), *other = find_item(before, item);
    if (!other || !json_equal(item, other)) count++;
  }
  for (size_t i = 0; i < json_array_size(before); i++)
    if (!find_item(now, json_array_get(before, i))) count++;
  return count;
}

static json_int_t made_at(const json_t *record) {
  return json_integer_value(json_object_get(record, "made"));
}

/* The record of the same node type with the fewest different items, made before `until`. */
static const json_t *nearest(const json_t *records, const json_t *items, json_int_t until) {
  const json_t *best = NULL;
  size_t least = SIZE_MAX;
  for (size_t i = 0; i < json_array_size(records); i++) {
    const json_t *record = json_array_get(records, i), *key = json_object_get(record, "key");
    if (made_at(record) >= until || strcmp(node_type_of(key), node_type_of(items)) != 0) continue;
    size_t differences = count_differences(items, key);
    if (differences == 0 || differences > least) continue;
    if (differences == least && made_at(record) <= made_at(best)) continue;
    least = differences;
    best = record;
  }
  return best;
}

/* ---- sentences ---- */

__attribute__((format(printf, 1, 2))) static json_t *sentence(const char *format, ...) {
  char text[1024];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  /* A text that was cut may end inside a character. */
  json_t *json = json_string(text);
  for (size_t length = strlen(text); !json && length > 0; json = json_string(text)) text[--length] = 0;
  return json;
}

static const char *shown_value(const json_t *item) {
  return !item || strcmp(text_of(item, 0), "unset") == 0 ? "not set" : text_of(item, 2);
}

/* The node and port that an input takes its value from, or NULL and "". */
static const qmat_graph_node *maker_of(const qmat_run *run, const qmat_run_step *step, const char *input,
                                       const char **port) {
  const qmat_graph_node *node = &run->graph->nodes[step->node];
  size_t index = qmat_input_find(node->type, input);
  *port = "";
  if (index == SIZE_MAX || node->links[index].node == SIZE_MAX) return NULL;
  const qmat_graph_node *maker = &run->graph->nodes[node->links[index].node];
  *port = maker->type->outputs[node->links[index].port].name;
  return maker;
}

static json_t *describe_difference(const qmat_run *run, const qmat_run_step *step, const json_t *now,
                                   const json_t *before) {
  const json_t *any = now ? now : before;
  const char *tag = group_of(any), *name = text_of(any, 1), *port;
  static const struct {
    const char *tag, *subject;
  } simple[] = {{"key", "the key"},
                {"node", "the version of"},
                {"library", "library"},
                {"param", "parameter"},
                {"name", "the file name of parameter"}};
  for (size_t i = 0; i < sizeof simple / sizeof *simple; i++)
    if (strcmp(tag, simple[i].tag) == 0)
      return sentence("%s %s is %s, was %s", simple[i].subject, name, shown_value(now), shown_value(before));
  if (strcmp(tag, "program") == 0 && strcmp(name, "version") == 0)
    return sentence("the version of qmat is %s, was %s", shown_value(now), shown_value(before));
  if (strcmp(tag, "program") == 0) return sentence("the program was built from other sources");
  if (strcmp(tag, "file") == 0) {
    const json_t *like = now ? json_pack("[s, s, s]", "name", name, "") : NULL;
    const json_t *file = like ? find_item(step->key_items, like) : NULL;
    json_t *text = sentence("the file of parameter %s changed%s%s%s", name, file ? " (" : "",
                            file ? text_of(file, 2) : "", file ? ")" : "");
    json_decref((json_t *)like);
    return text;
  }
  if (strcmp(tag, "side") == 0) {
    const char *path = strchr(name, ':') ? strchr(name, ':') + 1 : name;
    if (now && strcmp(text_of(now, 2), "absent") == 0) return sentence("the side file %s is missing", path);
    if (!before) return sentence("the side file %s was not read before", path);
    return sentence(now ? "the side file %s changed" : "the side file %s is no longer read", path);
  }
  if (strcmp(tag, "input") == 0) {
    const qmat_graph_node *maker = maker_of(run, step, name, &port);
    if (!maker) return sentence("input %s was connected and is not now", name);
    return sentence("input %s gets other bytes from %s.%s", name, maker->id, port);
  }
  return sentence("%s %s is %s, was %s", tag, name, shown_value(now), shown_value(before));
}

static json_t *value_json(const json_t *item) {
  return item ? json_string(text_of(item, 2)) : json_null();
}

static void add_difference(const qmat_run *run, const qmat_run_step *step, const json_t *now, const json_t *before,
                           json_t *causes) {
  const json_t *any = now ? now : before;
  const char *port;
  json_t *cause =
      json_pack("{s:s, s:s, s:o, s:o, s:o}", "tag", group_of(any), "name", text_of(any, 1), "now", value_json(now),
                "before", value_json(before), "text", describe_difference(run, step, now, before));
  const qmat_graph_node *maker =
      strcmp(group_of(any), "input") == 0 ? maker_of(run, step, text_of(any, 1), &port) : NULL;
  if (maker) json_object_set_new(cause, "from", json_string(maker->id));
  json_array_append_new(causes, cause);
}

static void add_differences(const qmat_run *run, const qmat_run_step *step, const json_t *before, json_t *causes) {
  const json_t *items = step->key_items;
  for (size_t i = 0; i < json_array_size(items); i++) {
    const json_t *item = json_array_get(items, i), *other = find_item(before, item);
    if (!other || !json_equal(item, other)) add_difference(run, step, item, other, causes);
  }
  /* Which side files follow those that changed is known when the node has run. */
  const bool all_known = step->state == QMAT_STEP_HIT || json_array_size(causes) == 0;
  for (size_t i = 0; i < json_array_size(before); i++) {
    const json_t *item = json_array_get(before, i);
    if (!find_item(items, item) && (all_known || strcmp(text_of(item, 0), "side") != 0))
      add_difference(run, step, NULL, item, causes);
  }
}

/* Adds the files that cannot be read, without which the step has no key. */
static void add_unreadable(const qmat_run *run, const qmat_run_step *step, json_t *causes) {
  const qmat_node *type = run->graph->nodes[step->node].type;
  for (size_t row = 0; row < qmat_param_count(type); row++) {
    const char *path = qmat_param_input_file(type, row, step->params);
    qmat_digest digest;
    if (!path || qmat_digest_of_file(path, &digest) == QMAT_OK) continue;
    json_array_append_new(
        causes, json_pack("{s:s, s:s, s:n, s:n, s:o}", "tag", "file", "name", type->params[row].name, "now", "before",
                          "text", sentence("the file of parameter %s cannot be read", type->params[row].name)));
  }
}

/* Adds the nodes that have to run before the step's key is known. */
static void add_waiting(const qmat_run *run, const qmat_run_step *step, json_t *causes) {
  const qmat_graph_node *node = &run->graph->nodes[step->node];
  for (size_t port = 0; port < qmat_input_count(node->type); port++) {
    if (step->inputs[port] == SIZE_MAX || run->slots[step->inputs[port]].known) continue;
    const char *from;
    const qmat_graph_node *maker = maker_of(run, step, node->type->inputs[port].name, &from);
    if (!maker) continue;
    json_array_append_new(
        causes,
        json_pack("{s:s, s:s, s:n, s:n, s:o, s:s}", "tag", "input", "name", node->type->inputs[port].name, "now",
                  "before", "text", sentence("input %s comes from %s", node->type->inputs[port].name, maker->id),
                  "from", maker->id));
  }
}

static void format_date(json_int_t milliseconds, char *text, size_t size) {
  time_t seconds = (time_t)(milliseconds / 1000);
  struct tm date;
  if (!localtime_r(&seconds, &date) || strftime(text, size, "%Y-%m-%d %H:%M:%S", &date) == 0) snprintf(text, size, "?");
}

json_t *qmat_why(const qmat_run *run, const json_t *records, size_t index) {
  const qmat_run_step *step = &run->steps[index];
  const qmat_graph_node *node = &run->graph->nodes[step->node];
  char key[65] = "", date[32] = "";
  if (step->keyed) qmat_digest_hex(&step->key, key);
  json_t *causes = json_array(), *record = step->keyed ? qmat_cache_record(run->cache, &step->key) : NULL;
  json_t *why = json_pack("{s:s, s:s, s:s, s:s?, s:O}", "node", node->id, "type", node->type->name, "state",
                          qmat_step_state_name(step->state), "key", step->keyed ? key : NULL, "causes", causes);
  const char *text = NULL;
  bool hit = step->state == QMAT_STEP_HIT;
  const json_t *before = step->keyed ? nearest(records, step->key_items, hit ? made_at(record) : INT64_MAX) : NULL;
  json_t *sentence_text = NULL;
  if (step->missing) {
    char missing[256];
    qmat_step_describe_missing(run->graph, step, missing, sizeof missing);
    sentence_text = sentence("cannot run: %s", missing);
  } else if (step->state == QMAT_STEP_DEPENDS) {
    add_waiting(run, step, causes);
    text = "not known yet: it runs unless the nodes before it make the same bytes as before";
  } else if (!step->keyed) {
    add_unreadable(run, step, causes);
    text = "would run: a file cannot be read";
  } else if (hit) {
    format_date(made_at(record), date, sizeof date);
    json_object_set_new(why, "made", json_integer(made_at(record)));
    sentence_text = sentence("in the cache since %s, made in %.2f s; it ran then %s", date,
                             json_real_value(json_object_get(record, "seconds")),
                             before ? "because" : "because the cache had no similar result");
  } else if (step->forced) {
    text = "would run: --force";
  } else if (record && json_object_get(record, "outputs")) {
    text = "would run: a part of its result is missing from the cache";
    before = NULL;
  } else {
    text = before ? "would run:" : "would run: the cache has no result of this node type";
  }
  if (before && !step->forced) add_differences(run, step, json_object_get(before, "key"), causes);
  json_object_set_new(why, "text", sentence_text ? sentence_text : json_string(text));
  json_decref(record);
  json_decref(causes);
  return why;
}
