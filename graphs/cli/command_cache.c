/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "graphs/cli/command.h"
#include "graphs/graph_names.h"
#include "graphs/run/run_report.h"

/* One call of `qmat cache`. */
typedef struct cache_call {
  qmat_context *context;
  const qmat_invocation *invocation;
  qmat_cache *cache;
  qmat_cache_entry *entries;
  size_t count;
  bool json;
} cache_call;

static void format_time(int64_t nanoseconds, char *text, size_t size) {
  time_t seconds = (time_t)(nanoseconds / 1000000000);
  struct tm date;
  if (!localtime_r(&seconds, &date) || strftime(text, size, "%Y-%m-%d %H:%M:%S", &date) == 0) snprintf(text, size, "?");
}

static qmat_status stats(cache_call *call) {
  static const char *const names[QMAT_CACHE_KIND_COUNT] = {"records", "blobs", "temporaries", "bad"};
  size_t counts[QMAT_CACHE_KIND_COUNT] = {0};
  uint64_t sizes[QMAT_CACHE_KIND_COUNT] = {0}, total = 0;
  for (size_t i = 0; i < call->count; i++) {
    counts[call->entries[i].kind]++;
    sizes[call->entries[i].kind] += call->entries[i].size;
    total += call->entries[i].size;
  }
  if (call->json) {
    json_t *json = json_pack("{s:s, s:b, s:I, s:I}", "folder", call->cache->folder, "read_only", call->cache->read_only,
                             "size", (json_int_t)total, "most_size", (json_int_t)call->cache->most_size);
    for (int kind = 0; kind < QMAT_CACHE_KIND_COUNT; kind++)
      json_object_set_new(json, names[kind],
                          json_pack("{s:I, s:I}", "count", (json_int_t)counts[kind], "size", (json_int_t)sizes[kind]));
    return qmat_print_json(call->context, json);
  }
  char size[32], most[32];
  qmat_format_bytes(total, size);
  qmat_format_bytes(call->cache->most_size, most);
  printf("%s%s\n%s of %s\n", call->cache->folder, call->cache->read_only ? " (read only)" : "", size, most);
  for (int kind = 0; kind < QMAT_CACHE_KIND_COUNT; kind++) {
    if (kind > QMAT_CACHE_BLOB && counts[kind] == 0) continue;
    qmat_format_bytes(sizes[kind], size);
    printf("%6zu %s, %s\n", counts[kind], names[kind], size);
  }
  return QMAT_OK;
}

/* The key item of a record's node: its name and version. */
static const json_t *node_item(const json_t *record) {
  const json_t *items = json_object_get(record, "key");
  for (size_t i = 0; i < json_array_size(items); i++) {
    const json_t *item = json_array_get(items, i);
    if (strcmp(json_string_value(json_array_get(item, 0)), "node") == 0) return item;
  }
  return NULL;
}

static qmat_status list(cache_call *call) {
  json_t *rows = json_array();
  for (size_t i = 0; i < call->count; i++) {
    const qmat_cache_entry *entry = &call->entries[i];
    json_t *record = entry->kind == QMAT_CACHE_RECORD ? qmat_cache_record(call->cache, &entry->digest) : NULL;
    const json_t *outputs = json_object_get(record, "outputs"), *node = node_item(record);
    if (outputs && node) {
      json_int_t bytes = 0;
      for (size_t k = 0; k < json_array_size(outputs); k++)
        bytes += (json_int_t)qmat_cache_stored_size(json_array_get(outputs, k));
      double seconds = json_real_value(json_object_get(record, "seconds"));
      const char *type = json_string_value(json_array_get(node, 1)),
                 *version = json_string_value(json_array_get(node, 2));
      char used[32], size[32];
      format_time(entry->used, used, sizeof used);
      qmat_format_bytes((uint64_t)bytes, size);
      if (!call->json) printf("%.12s  %-18s %3s  %9s  %8.2f s  %s\n", entry->name, type, version, size, seconds, used);
      json_array_append_new(rows, json_pack("{s:s, s:s, s:s, s:I, s:f, s:s}", "key", entry->name, "type", type,
                                            "version", version, "bytes", bytes, "seconds", seconds, "used", used));
    }
    json_decref(record);
  }
  if (call->json) return qmat_print_json(call->context, rows);
  json_decref(rows);
  return QMAT_OK;
}

static void print_record(const json_t *record) {
  const json_t *items = json_object_get(record, "key"), *outputs = json_object_get(record, "outputs");
  const json_t *sides = json_object_get(record, "sides");
  for (size_t i = 0; i < json_array_size(items); i++) {
    const json_t *item = json_array_get(items, i);
    printf("%-8s %-16s %s\n", json_string_value(json_array_get(item, 0)), json_string_value(json_array_get(item, 1)),
           json_string_value(json_array_get(item, 2)));
  }
  for (size_t i = 0; i < json_array_size(sides); i++)
    printf("reads    %-16s %s\n", json_string_value(json_array_get(json_array_get(sides, i), 0)),
           json_string_value(json_array_get(json_array_get(sides, i), 1)));
  for (size_t i = 0; i < json_array_size(outputs); i++) {
    const json_t *output = json_array_get(outputs, i);
    char size[32];
    qmat_format_bytes(qmat_cache_stored_size(output), size);
    printf("output   %-16s %s %s (%s)\n", json_string_value(json_object_get(output, "port")),
           json_string_value(json_object_get(output, "type")), json_string_value(json_object_get(output, "digest")),
           size);
  }
}

static qmat_status show(cache_call *call) {
  const char *prefix = call->invocation->argument_count > 1 ? call->invocation->arguments[1] : "";
  const qmat_cache_entry *found = NULL;
  for (size_t i = 0; i < call->count; i++) {
    const qmat_cache_entry *entry = &call->entries[i];
    if (entry->kind != QMAT_CACHE_RECORD || strncmp(entry->name, prefix, strlen(prefix)) != 0) continue;
    if (found || !*prefix) {
      qmat_fail(call->context, QMAT_ERROR_USAGE, *prefix ? "several keys start with this" : "expected a key");
      return qmat_fail_hint(call->context, "'qmat cache ls' lists them");
    }
    found = entry;
  }
  json_t *record = found ? qmat_cache_record(call->cache, &found->digest) : NULL;
  if (!record) {
    qmat_fail(call->context, QMAT_ERROR_USAGE, "the cache has no record of key '%s'", qmat_show(prefix).text);
    return qmat_fail_hint(call->context, "'qmat cache ls' lists them");
  }
  if (call->json) return qmat_print_json(call->context, record);
  print_record(record);
  json_decref(record);
  return QMAT_OK;
}

static qmat_status verify(cache_call *call) {
  static const char *const words[] = {[QMAT_CACHE_INCOMPLETE] = "incomplete, never used",
                                      [QMAT_CACHE_BROKEN] = "broken, set aside",
                                      [QMAT_CACHE_STUCK] = "broken, and it cannot be set aside",
                                      [QMAT_CACHE_UNREADABLE] = "cannot be read"};
  size_t broken = 0, incomplete = 0, unreadable = 0, checked = 0;
  /* From the end, where the blobs are: a record of a broken blob is then found incomplete. */
  for (size_t i = call->count; i-- > 0;) {
    const qmat_cache_entry *entry = &call->entries[i];
    if (entry->kind > QMAT_CACHE_BLOB) continue;
    qmat_cache_health health = qmat_cache_check(call->cache, entry);
    checked++;
    broken += health == QMAT_CACHE_BROKEN || health == QMAT_CACHE_STUCK;
    unreadable += health == QMAT_CACHE_UNREADABLE;
    incomplete += health == QMAT_CACHE_INCOMPLETE;
    if (health != QMAT_CACHE_SOUND && !call->json)
      printf("%s %s: %s\n", entry->kind == QMAT_CACHE_RECORD ? "record" : "blob", entry->name, words[health]);
  }
  qmat_status status = QMAT_OK;
  if (call->json)
    status = qmat_print_json(
        call->context, json_pack("{s:I, s:I, s:I, s:I}", "checked", (json_int_t)checked, "broken", (json_int_t)broken,
                                 "incomplete", (json_int_t)incomplete, "unreadable", (json_int_t)unreadable));
  else if (unreadable > 0)
    printf("%zu checked, %zu broken, %zu incomplete, %zu that cannot be read\n", checked, broken, incomplete,
           unreadable);
  else
    printf("%zu checked, %zu broken, %zu incomplete\n", checked, broken, incomplete);
  if (status == QMAT_OK && broken > 0)
    status = qmat_fail(call->context, QMAT_ERROR_IO, "%zu file%s of the cache %s damaged", broken,
                       broken == 1 ? "" : "s", broken == 1 ? "was" : "were");
  if (status == QMAT_OK && unreadable > 0)
    status = qmat_fail(call->context, QMAT_ERROR_IO, "%zu file%s of the cache cannot be read", unreadable,
                       unreadable == 1 ? "" : "s");
  return status;
}

static qmat_status print_sweep(cache_call *call, qmat_cache_sweep sweep) {
  if (call->cache->read_only) return qmat_fail(call->context, QMAT_ERROR_IO, "the cache is read only");
  if (call->json)
    return qmat_print_json(
        call->context, json_pack("{s:I, s:I}", "deleted", (json_int_t)sweep.deleted, "freed", (json_int_t)sweep.freed));
  char size[32];
  qmat_format_bytes(sweep.freed, size);
  printf("%zu file%s deleted, %s\n", sweep.deleted, sweep.deleted == 1 ? "" : "s", size);
  return QMAT_OK;
}

static qmat_status collect(cache_call *call) {
  return print_sweep(call, qmat_cache_collect(call->cache, call->cache->most_size, true));
}

static qmat_status clear(cache_call *call) {
  return print_sweep(call, qmat_cache_clear(call->cache));
}

static const struct {
  const char *name;
  qmat_status (*run)(cache_call *call);
} actions[] = {{"stats", stats}, {"ls", list}, {"show", show}, {"verify", verify}, {"gc", collect}, {"clear", clear}};

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  const char *names[sizeof actions / sizeof *actions], *name = invocation->arguments[0];
  size_t action = 0, count = sizeof actions / sizeof *actions;
  for (size_t i = 0; i < count; i++) names[i] = actions[i].name;
  while (action < count && strcmp(names[action], name) != 0) action++;
  if (action == count) {
    qmat_fail(context, QMAT_ERROR_USAGE, "there is no cache action '%s'", qmat_show(name).text);
    return qmat_suggest_nearest(context, name, names, count, "stats, ls, show KEY, verify, gc or clear");
  }
  if (invocation->argument_count > 1 && actions[action].run != show)
    return qmat_fail(context, QMAT_ERROR_USAGE, "'%s' is one argument too many",
                     qmat_show(invocation->arguments[1]).text);
  qmat_cache cache;
  bool open;
  qmat_status status = qmat_open_cache(context, invocation, &cache, &open);
  if (status == QMAT_OK && !open) {
    qmat_fail(context, QMAT_ERROR_USAGE, "there is no cache");
    status = qmat_fail_hint(context, "--cache DIR");
  }
  cache_call call = {.context = context,
                     .invocation = invocation,
                     .cache = &cache,
                     .json = qmat_invocation_value(invocation, "json") != NULL};
  if (status == QMAT_OK && !qmat_cache_list(&cache, &call.entries, &call.count))
    status = qmat_fail_memory(context, "listing");
  if (status == QMAT_OK) status = actions[action].run(&call);
  qmat_free(call.entries);
  qmat_cache_close(&cache);
  return status;
}

static const qmat_option options[] = {
    {"json", 0, NULL, "Print JSON"},
    {0},
};

const qmat_command qmat_command_cache = {
    .name = "cache",
    .arguments = "stats|ls|show KEY|verify|gc|clear",
    .summary = "List, check and clean the cache",
    .doc =
        "stats: folder and size.\n"
        "ls: the results, with the start of their keys.\n"
        "show KEY: what a result depends on, and its outputs; the start of the key is enough.\n"
        "verify: checks every file; the exit code is 1 if one was damaged or cannot be read.\n"
        "gc: deletes unused files, and the least recently used results above the size.\n"
        "clear: deletes everything.",
    .options = options,
    .caching = qmat_cache_option_rows,
    .least = 1,
    .most = 2,
    .run = run,
};
