/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/yaml_tree.h"

#include <string.h>
#include <yaml.h>

typedef struct tree_reader {
  qmat_context *context;
  qmat_arena *arena;
  const char *file, *text;
  size_t size;
  yaml_parser_t parser;
} tree_reader;

qmat_shown qmat_show(const char *text) {
  qmat_shown shown;
  size_t length = 0;
  for (; text[length] && length < 60; length++) {
    unsigned char c = (unsigned char)text[length];
    shown.text[length] = c < 0x20 || c == 0x7f ? '?' : (char)c;
  }
  if (text[length]) {
    /* Never cut inside a UTF-8 character. */
    while (length > 0 && ((unsigned char)text[length] & 0xc0) == 0x80) length--;
    memcpy(shown.text + length, "...", 3);
    length += 3;
  }
  shown.text[length] = 0;
  return shown;
}

static qmat_mark mark_of(yaml_mark_t mark) {
  return (qmat_mark){(int)mark.line + 1, (int)mark.column + 1};
}

static qmat_status fail_at(tree_reader *reader, qmat_mark mark) {
  return qmat_fail_at(reader->context, reader->file, mark.line, mark.column);
}

static qmat_status fail_syntax(tree_reader *reader) {
  const yaml_parser_t *parser = &reader->parser;
  if (parser->error == YAML_MEMORY_ERROR) return qmat_fail_memory(reader->context, "graph");
  qmat_mark mark = mark_of(parser->problem_mark);
  if (parser->error == YAML_READER_ERROR) {
    /* libyaml gives this error a byte offset and no mark. */
    mark = (qmat_mark){1, 1};
    for (size_t i = 0; i < parser->problem_offset && i < reader->size; i++) {
      mark.column++;
      if (reader->text[i] == '\n') mark = (qmat_mark){mark.line + 1, 1};
    }
  }
  const char *problem = parser->problem ? parser->problem : "unknown error";
  if (parser->context)
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "this is not YAML: %s, %s", parser->context, problem);
  else
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "this is not YAML: %s", problem);
  return fail_at(reader, mark);
}

/* Reads the next event, which the caller deletes. Refuses anchors, aliases, tags and lists. */
static qmat_status next_event(tree_reader *reader, yaml_event_t *event) {
  if (!yaml_parser_parse(&reader->parser, event)) return fail_syntax(reader);
  const char *refused = NULL;
  switch (event->type) {
    case YAML_ALIAS_EVENT:
      refused = "aliases (*name) are not part of the graph language";
      break;
    case YAML_SCALAR_EVENT:
      if (event->data.scalar.anchor) refused = "anchors (&name) are not part of the graph language";
      if (event->data.scalar.tag) refused = "tags (!name) are not part of the graph language";
      break;
    case YAML_MAPPING_START_EVENT:
      if (event->data.mapping_start.anchor) refused = "anchors (&name) are not part of the graph language";
      if (event->data.mapping_start.tag) refused = "tags (!name) are not part of the graph language";
      break;
    case YAML_SEQUENCE_START_EVENT:
      refused = "lists are not part of the graph language; use a mapping or a single value";
      break;
    default:
      break;
  }
  if (!refused) return QMAT_OK;
  qmat_mark mark = mark_of(event->start_mark);
  yaml_event_delete(event);
  qmat_fail(reader->context, QMAT_ERROR_USAGE, "%s", refused);
  return fail_at(reader, mark);
}

static qmat_status copy_text(tree_reader *reader, const yaml_event_t *event, const char **text) {
  size_t length = event->data.scalar.length;
  const char *value = (const char *)event->data.scalar.value;
  if (memchr(value, 0, length)) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "the text has a zero character");
    return fail_at(reader, mark_of(event->start_mark));
  }
  char *copy = qmat_arena_alloc(reader->arena, length + 1, 1);
  if (!copy) return qmat_fail_memory(reader->context, "graph");
  memcpy(copy, value, length);
  copy[length] = 0;
  *text = copy;
  return QMAT_OK;
}

static qmat_status read_value(tree_reader *reader, const yaml_event_t *event, int depth, const qmat_tree **result);

static qmat_status read_entries(tree_reader *reader, int depth, qmat_tree *mapping) {
  qmat_tree_entry **last = &mapping->entries;
  for (size_t count = 0;; count++) {
    yaml_event_t event;
    qmat_status status = next_event(reader, &event);
    if (status != QMAT_OK) return status;
    if (event.type == YAML_MAPPING_END_EVENT) {
      yaml_event_delete(&event);
      return QMAT_OK;
    }
    qmat_mark mark = mark_of(event.start_mark);
    const char *key = NULL;
    if (event.type != YAML_SCALAR_EVENT) {
      qmat_fail(reader->context, QMAT_ERROR_USAGE, "a key must be a single name");
      status = fail_at(reader, mark);
    } else if (count == QMAT_TREE_MAX_ENTRIES) {
      qmat_fail(reader->context, QMAT_ERROR_USAGE, "a mapping has more than %d entries", QMAT_TREE_MAX_ENTRIES);
      status = fail_at(reader, mark);
    } else {
      status = copy_text(reader, &event, &key);
    }
    yaml_event_delete(&event);
    if (status != QMAT_OK) return status;
    for (const qmat_tree_entry *other = mapping->entries; other; other = other->next)
      if (strcmp(other->key, key) == 0) {
        qmat_fail(reader->context, QMAT_ERROR_USAGE, "'%s' is given twice; the first is on line %d",
                  qmat_show(key).text, other->mark.line);
        return fail_at(reader, mark);
      }
    qmat_tree_entry *entry = qmat_arena_calloc(reader->arena, 1, sizeof *entry);
    if (!entry) return qmat_fail_memory(reader->context, "graph");
    entry->key = key;
    entry->mark = mark;
    status = next_event(reader, &event);
    if (status != QMAT_OK) return status;
    status = read_value(reader, &event, depth, &entry->value);
    yaml_event_delete(&event);
    if (status != QMAT_OK) return status;
    *last = entry;
    last = &entry->next;
  }
}

/* Reads the value that starts with `event`; the caller keeps the event. */
static qmat_status read_value(tree_reader *reader, const yaml_event_t *event, int depth, const qmat_tree **result) {
  qmat_tree *value = qmat_arena_calloc(reader->arena, 1, sizeof *value);
  if (!value) return qmat_fail_memory(reader->context, "graph");
  value->mark = mark_of(event->start_mark);
  *result = value;
  if (event->type == YAML_SCALAR_EVENT) {
    qmat_status status = copy_text(reader, event, &value->text);
    if (status != QMAT_OK) return status;
    value->empty = event->data.scalar.style == YAML_PLAIN_SCALAR_STYLE &&
                   (!*value->text || strcmp(value->text, "~") == 0 || strcmp(value->text, "null") == 0);
    return QMAT_OK;
  }
  value->is_mapping = true;
  if (depth == QMAT_TREE_MAX_DEPTH) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "mappings are nested more than %d deep", QMAT_TREE_MAX_DEPTH);
    return fail_at(reader, value->mark);
  }
  return read_entries(reader, depth + 1, value);
}

static qmat_status read_document(tree_reader *reader, const qmat_tree **tree) {
  bool done = false;
  while (!done) {
    yaml_event_t event;
    qmat_status status = next_event(reader, &event);
    if (status != QMAT_OK) return status;
    switch (event.type) {
      case YAML_STREAM_END_EVENT:
        done = true;
        break;
      case YAML_SCALAR_EVENT:
      case YAML_MAPPING_START_EVENT:
        status = read_value(reader, &event, 0, tree);
        break;
      case YAML_DOCUMENT_START_EVENT:
        if (*tree) {
          qmat_fail(reader->context, QMAT_ERROR_USAGE, "a graph file holds one document; a second one starts here");
          status = fail_at(reader, mark_of(event.start_mark));
        }
        break;
      default:
        break;
    }
    yaml_event_delete(&event);
    if (status != QMAT_OK) return status;
  }
  if (!*tree || (*tree)->empty) {
    qmat_fail(reader->context, QMAT_ERROR_USAGE, "the graph file is empty; it starts with 'qmat: 1'");
    return fail_at(reader, (qmat_mark){1, 1});
  }
  return QMAT_OK;
}

qmat_status qmat_tree_read(qmat_context *context, qmat_arena *arena, const char *file, const char *text, size_t size,
                           const qmat_tree **tree) {
  *tree = NULL;
  if (size > QMAT_TREE_MAX_BYTES) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the graph file has more than %d bytes", QMAT_TREE_MAX_BYTES);
    return qmat_fail_at(context, file, 0, 0);
  }
  tree_reader reader = {.context = context, .arena = arena, .file = file, .text = text, .size = size};
  if (!yaml_parser_initialize(&reader.parser)) return qmat_fail_memory(context, "graph");
  yaml_parser_set_input_string(&reader.parser, (const unsigned char *)text, size);
  const qmat_tree *result = NULL;
  qmat_status status = read_document(&reader, &result);
  yaml_parser_delete(&reader.parser);
  if (status == QMAT_OK) *tree = result;
  return status;
}
