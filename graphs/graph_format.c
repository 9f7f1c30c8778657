/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/graph_format.h"

#include <string.h>
#include <yaml.h>

#include "graphs/yaml_tree.h"
#include "io/scanner.h"

/* libyaml's tokens say where each name, value and brace stands. Comments and line breaks are what is between them. */
typedef struct token {
  yaml_token_type_t type;
  size_t start, end; /* bytes */
  int column;        /* of its start, in characters from 0 */
} token;

/* A line of the result. */
typedef struct line {
  qmat_writer text;
  const char *comment; /* behind the text, or alone; NULL: none */
  size_t comment_size;
  int indent;
  bool after_empty; /* an empty line is before it */
  bool continues;   /* a comment below that of the line before, in its column */
} line;

/* An open mapping. */
typedef struct frame {
  bool flow, broken; /* in braces; one entry a line */
  bool first;        /* no entry yet */
  int indent;        /* of its entries */
  int column;        /* of its entries in the source */
} frame;

enum { MOST_FRAMES = QMAT_TREE_MAX_DEPTH + 2 };

typedef struct formatter {
  const char *text;
  size_t size;
  token *tokens;
  size_t token_count, token_capacity;
  line *lines;
  size_t line_count, line_capacity;
  size_t content; /* the newest line that is not a comment alone, plus one; 0: none */
  frame frames[MOST_FRAMES];
  int depth;
  bool value, comma; /* a value comes next; a comma before the next entry */
  bool empty;        /* an empty line before the next entry */
  bool failed;       /* memory is short */
} formatter;

/* ---- tokens ---- */

/* Whether a value is a block of text: after '|' or '>'. */
static bool is_block(const formatter *f, const token *t) {
  return t->type == YAML_SCALAR_TOKEN && t->start < t->end && (f->text[t->start] == '|' || f->text[t->start] == '>');
}

/* Leaves the empty lines behind a block of text to what follows. */
static void trim_block(const formatter *f, token *t) {
  for (size_t at = t->end; is_block(f, t) && at > t->start && strchr(" \t\r\n", f->text[at - 1]); at--)
    if (f->text[at - 1] == '\n') t->end = at - 1;
}

/* The characters of a comment, without blanks behind them. */
static size_t comment_size(const char *comment, const char *end) {
  size_t size = 0, kept = 1;
  for (; comment + size < end && comment[size] != '\n' && comment[size] != '\r'; size++)
    if (comment[size] != ' ' && comment[size] != '\t') kept = size + 1;
  return kept;
}

/* Reads all tokens. The text has been read as a tree before. */
static bool read_tokens(formatter *f) {
  yaml_parser_t parser;
  size_t at = 0, index = 0;
  if (!yaml_parser_initialize(&parser)) return false;
  yaml_parser_set_input_string(&parser, (const unsigned char *)f->text, f->size);
  bool more = true;
  while (more) {
    yaml_token_t read;
    if (!yaml_parser_scan(&parser, &read)) break;
    const size_t marks[2] = {read.start_mark.index, read.end_mark.index};
    size_t bytes[2];
    for (int i = 0; i < 2; i++) { /* libyaml counts characters */
      if (marks[i] < index) at = index = 0;
      for (; index < marks[i] && at < f->size; index++)
        for (at++; at < f->size && ((unsigned char)f->text[at] & 0xc0) == 0x80;) at++;
      bytes[i] = at;
    }
    more = read.type != YAML_STREAM_END_TOKEN;
    if (qmat_grow((void **)&f->tokens, &f->token_capacity, f->token_count + 1, sizeof *f->tokens) != 0)
      f->failed = true;
    if (!f->failed) {
      f->tokens[f->token_count] = (token){read.type, bytes[0], bytes[1], (int)read.start_mark.column};
      trim_block(f, &f->tokens[f->token_count++]);
    }
    yaml_token_delete(&read);
    if (f->failed) break;
  }
  yaml_parser_delete(&parser);
  return !more && !f->failed;
}

/* The end of the mapping in braces that starts at token `i`. */
static size_t flow_end(const formatter *f, size_t i) {
  int depth = 0;
  for (;; i++) {
    depth += f->tokens[i].type == YAML_FLOW_MAPPING_START_TOKEN;
    depth -= f->tokens[i].type == YAML_FLOW_MAPPING_END_TOKEN;
    if (depth == 0 || i + 1 == f->token_count) return i;
  }
}

static bool gap_has(const formatter *f, size_t i, char c) {
  const size_t start = f->tokens[i].end, end = f->tokens[i + 1].start;
  return end > start && memchr(f->text + start, c, end - start);
}

/* Whether a mapping in braces has one entry a line; else `*width` is that of its one line. */
static bool is_broken(const formatter *f, size_t start, int *width) {
  const size_t end = flow_end(f, start);
  *width = 0;
  for (size_t i = start; i <= end; i++) {
    const token *t = &f->tokens[i];
    if (i < end && gap_has(f, i, '#')) return true;
    if (t->type == YAML_FLOW_MAPPING_START_TOKEN && f->tokens[i + 1].type != YAML_FLOW_MAPPING_END_TOKEN &&
        gap_has(f, i, '\n'))
      return true;
    if (memchr(f->text + t->start, '\n', t->end - t->start)) return true;
    *width += (int)(t->end - t->start);
    if (t->type != YAML_KEY_TOKEN && t->type != YAML_SCALAR_TOKEN) (*width)++;
  }
  return false;
}

/* ---- lines ---- */

static line *new_line(formatter *f, int indent) {
  static line none;
  if (qmat_grow((void **)&f->lines, &f->line_capacity, f->line_count + 1, sizeof *f->lines) != 0) {
    f->failed = true;
    none = (line){.text = {.failed = true}};
    return &none;
  }
  f->lines[f->line_count] = (line){.indent = indent};
  return &f->lines[f->line_count++];
}

/* Starts a line with content. */
static void content_line(formatter *f, int indent, bool after_empty) {
  line *of = new_line(f, indent);
  of->after_empty = after_empty && f->line_count > 1;
  f->content = f->line_count;
  f->empty = false;
}

static void put(formatter *f, const char *text, size_t size) {
  if (f->content == 0) content_line(f, 0, false);
  qmat_put_bytes(&f->lines[f->content - 1].text, text, size);
}

/* The column of a comment of the gap that ends at token `next`: that of the innermost mapping it is written in. */
static int comment_indent(const formatter *f, size_t next, int column) {
  int depth = f->depth, least = 0;
  size_t i = next;
  for (; i < f->token_count && f->tokens[i].type == YAML_BLOCK_END_TOKEN; i++) depth--;
  const int parent = depth > 0 ? f->frames[depth - 1].indent : 0;
  least = parent;
  if (i == next && i < f->token_count) {
    const token *t = &f->tokens[i];
    if (t->type == YAML_BLOCK_MAPPING_START_TOKEN && f->depth > 0) return parent + 2;
    if (t->type == YAML_FLOW_MAPPING_START_TOKEN || (f->value && t->type == YAML_SCALAR_TOKEN))
      return parent + (f->depth > 0 ? 2 : 0);
    if (depth > 0 && f->frames[depth - 1].flow) return parent;
  }
  for (int k = depth; k < f->depth; k++)
    if (f->frames[k].column <= column) least = f->frames[k].indent;
  return least;
}

/* Takes the comments and empty lines before token `next`. */
static void take_gap(formatter *f, size_t next) {
  const char *at = f->text + (next > 0 ? f->tokens[next - 1].end : 0), *end = f->text + f->tokens[next].start;
  bool fresh = next == 0 || f->content == 0; /* nothing is on the line yet */
  int breaks = fresh ? 1 : 0, column = 0, trailing = -1;
  if (at < end && memchr(at, '#', (size_t)(end - at)))
    for (const char *from = at; from > f->text && from[-1] != '\n'; from--)
      column += ((unsigned char)from[-1] & 0xc0) != 0x80;
  for (; at < end; at++) {
    if (*at == '\n') {
      breaks++;
      column = 0;
      fresh = true;
      continue;
    }
    if (*at != '#') {
      column += ((unsigned char)*at & 0xc0) != 0x80;
      continue;
    }
    const char *comment = at;
    const size_t size = comment_size(comment, end);
    while (at + 1 < end && at[1] != '\n') at++;
    line *of = fresh || f->lines[f->content - 1].comment ? NULL : &f->lines[f->content - 1];
    if (of) {
      trailing = column;
    } else {
      const bool continues = breaks == 1 && column == trailing;
      of = new_line(f, comment_indent(f, next, column));
      of->after_empty = (breaks > 1 || f->empty) && f->line_count > 1;
      f->empty = false;
      of->continues = continues;
      if (!continues) trailing = -1;
    }
    of->comment = comment;
    of->comment_size = size;
    breaks = 0;
  }
  f->empty |= breaks > 1;
}

/* ---- layout ---- */

/* Adds a name or value as it is written. Its further lines move with its first. */
static void put_scalar(formatter *f, const token *t, int indent) {
  const char *at = f->text + t->start, *end = f->text + t->end;
  const bool block = is_block(f, t);
  int source = -1;
  for (bool first = true; at < end; first = false) {
    const char *stop = memchr(at, '\n', (size_t)(end - at));
    size_t size = (size_t)((stop ? stop : end) - at), blanks = 0;
    if (size > 0 && at[size - 1] == '\r') size--;
    while (!first && blanks < size && (at[blanks] == ' ' || (!block && at[blanks] == '\t'))) blanks++;
    if (first) {
      put(f, at, size);
    } else {
      if (source < 0 && blanks < size) source = (int)blanks;
      content_line(f, blanks < size ? indent + (block ? (int)blanks - source : 0) : 0, false);
      put(f, at + blanks, size - blanks);
    }
    at = stop ? stop + 1 : end;
  }
}

static int line_width(const formatter *f) {
  return f->content > 0 ? f->lines[f->content - 1].indent + (int)f->lines[f->content - 1].text.size : 0;
}

/* Starts the place of a value of `width` columns: behind its key, or on a line of its own. */
static void place_value(formatter *f, int width, size_t lines_before) {
  const int indent = f->depth > 0 ? f->frames[f->depth - 1].indent : 0;
  if (f->depth == 0 && !f->value) {
    content_line(f, 0, false);
  } else if (f->line_count > lines_before || (f->content > 0 && f->lines[f->content - 1].comment) ||
             (width > 0 && line_width(f) + 1 + width > QMAT_GRAPH_LINE_WIDTH)) {
    content_line(f, indent + 2, false);
  } else {
    put(f, " ", 1);
  }
  f->value = false;
}

/* Starts an entry of the innermost mapping. */
static void start_entry(formatter *f) {
  frame *of = &f->frames[f->depth - 1];
  if (f->comma && of->flow) put(f, ",", 1);
  if (of->broken)
    content_line(f, of->indent, f->empty && !of->first);
  else
    put(f, " ", 1);
  of->first = f->comma = f->value = false;
}

static void open_flow(formatter *f, size_t i, size_t lines_before) {
  int width = 0;
  const bool in_flow = f->depth > 0 && f->frames[f->depth - 1].flow, empty = flow_end(f, i) == i + 1;
  const bool inside_one_line = in_flow && !f->frames[f->depth - 1].broken;
  bool broken = !inside_one_line && is_broken(f, i, &width) && !empty;
  const int indent = f->depth > 0 ? f->frames[f->depth - 1].indent : 0;
  if (inside_one_line || empty) width = 0;
  if (!broken && !inside_one_line && indent + 2 + width > QMAT_GRAPH_LINE_WIDTH &&
      line_width(f) + 1 + width > QMAT_GRAPH_LINE_WIDTH)
    broken = !empty;
  /* In a mapping without braces one that is broken needs none either. */
  const bool plain = broken && !in_flow && f->depth > 0;
  if (plain) {
    f->value = false;
  } else {
    place_value(f, broken ? 0 : width, lines_before);
    put(f, "{", 1);
  }
  const int base = f->depth == 0 || plain ? indent : f->lines[f->content - 1].indent;
  f->frames[f->depth++] = (frame){.flow = !plain, .broken = broken, .first = true, .indent = base + 2, .column = 0};
}

static void close_flow(formatter *f) {
  const frame *of = &f->frames[--f->depth];
  f->comma = false;
  if (!of->flow) return;
  if (of->broken) content_line(f, of->indent - 2, false);
  put(f, of->first ? "}" : of->broken ? "}" : " }", of->first || of->broken ? 1 : 2);
}

static void lay_out(formatter *f) {
  bool entry = false; /* an entry of braces starts with the next token */
  for (size_t i = 0; i < f->token_count && !f->failed; i++) {
    const token *t = &f->tokens[i];
    const size_t lines_before = f->line_count;
    take_gap(f, i);
    const bool opens_entry = entry && (t->type == YAML_KEY_TOKEN || t->type == YAML_SCALAR_TOKEN);
    if (opens_entry) start_entry(f);
    if (opens_entry) entry = false;
    if (t->type == YAML_BLOCK_MAPPING_START_TOKEN) {
      const int indent = f->depth > 0 ? f->frames[f->depth - 1].indent + 2 : 0;
      f->frames[f->depth++] = (frame){.broken = true, .first = true, .indent = indent, .column = t->column};
      f->value = false;
    } else if (t->type == YAML_BLOCK_END_TOKEN) {
      f->depth--;
    } else if (t->type == YAML_KEY_TOKEN && !opens_entry) {
      start_entry(f);
    } else if (t->type == YAML_VALUE_TOKEN) {
      put(f, ":", 1);
      f->value = true;
    } else if (t->type == YAML_SCALAR_TOKEN) {
      if (f->value || f->depth == 0) place_value(f, 0, lines_before);
      put_scalar(f, t, (f->depth > 0 ? f->frames[f->depth - 1].indent : 0) + 2);
      /* A name alone in braces has no value. */
      if (opens_entry && t->type == YAML_SCALAR_TOKEN && !f->frames[f->depth - 1].flow) put(f, ":", 1);
    } else if (t->type == YAML_FLOW_MAPPING_START_TOKEN) {
      open_flow(f, i, lines_before);
      entry = true;
    } else if (t->type == YAML_FLOW_ENTRY_TOKEN) {
      if (f->value) put(f, " ", 1); /* "a:," is a name */
      f->comma = entry = true;
      f->value = false;
    } else if (t->type == YAML_FLOW_MAPPING_END_TOKEN) {
      close_flow(f);
      entry = f->value = false;
    }
    if (f->depth >= MOST_FRAMES) return;
  }
}

/* ---- the result ---- */

static int characters(const qmat_writer *text) {
  int count = 0;
  for (size_t i = 0; i < text->size; i++) count += (text->bytes[i] & 0xc0) != 0x80;
  return count;
}

static void put_blanks(qmat_writer *writer, int count) {
  for (int i = 0; i < count; i++) qmat_put_u8(writer, ' ');
}

/* Comments behind entries stand in one column up to the next empty line; behind long entries where these end. */
static void write_lines(const formatter *f, qmat_writer *out) {
  enum { SHORT = 64 };
  for (size_t first = 0, end; first < f->line_count; first = end) {
    int column = 0;
    for (end = first; end < f->line_count && (end == first || !f->lines[end].after_empty); end++) {
      const line *of = &f->lines[end];
      const int width = of->indent + characters(&of->text) + 2;
      if (of->comment && of->text.size && width <= SHORT && width > column) column = width;
    }
    if (f->lines[first].after_empty) qmat_put_u8(out, '\n');
    int behind = 0; /* the column of the newest comment behind an entry */
    for (size_t i = first; i < end; i++) {
      const line *of = &f->lines[i];
      const int width = of->indent + characters(&of->text);
      if (of->text.size) {
        put_blanks(out, of->indent);
        qmat_put_bytes(out, of->text.bytes, of->text.size);
      }
      if (of->comment) {
        if (of->text.size) behind = width + 2 <= SHORT ? column : width + 2;
        put_blanks(out, of->text.size ? behind - width : of->continues ? behind : of->indent);
        qmat_put_bytes(out, of->comment, of->comment_size);
      }
      qmat_put_u8(out, '\n');
    }
  }
}

static bool same_tree(const qmat_tree *a, const qmat_tree *b) {
  if (a->is_mapping != b->is_mapping || a->empty != b->empty) return false;
  if (!a->is_mapping) return strcmp(a->text, b->text) == 0;
  const qmat_tree_entry *x = a->entries, *y = b->entries;
  for (; x && y; x = x->next, y = y->next)
    if (strcmp(x->key, y->key) != 0 || !same_tree(x->value, y->value)) return false;
  return !x && !y;
}

/* The comments of a text, one a line. */
static bool list_comments(const char *text, size_t size, qmat_writer *list) {
  formatter f = {.text = text, .size = size};
  const bool read = read_tokens(&f);
  for (size_t i = 0; i < f.token_count && read; i++) {
    const char *at = text + (i > 0 ? f.tokens[i - 1].end : 0), *end = text + f.tokens[i].start;
    while (at && at < end && (at = memchr(at, '#', (size_t)(end - at)))) {
      const size_t kept = comment_size(at, end);
      qmat_put_bytes(list, at, kept);
      qmat_put_u8(list, '\n');
      at += kept;
      at = memchr(at, '\n', (size_t)(end - at));
      if (!at) break;
    }
  }
  qmat_free(f.tokens);
  return read && !list->failed;
}

/* Whether the new text has the values and comments of the old one, in their order. */
static bool says_the_same(qmat_context *context, const char *file, const qmat_tree *tree, qmat_arena *arena,
                          const char *text, size_t size, const qmat_writer *formatted) {
  const qmat_tree *again;
  qmat_writer before = {0}, after = {0};
  const char *made = (const char *)formatted->bytes;
  const bool same = qmat_tree_read(context, arena, file, made, formatted->size, &again) == QMAT_OK &&
                    same_tree(tree, again) && list_comments(text, size, &before) &&
                    list_comments(made, formatted->size, &after) && before.size == after.size &&
                    (before.size == 0 || memcmp(before.bytes, after.bytes, before.size) == 0);
  qmat_writer_uninit(&before);
  qmat_writer_uninit(&after);
  return same;
}

qmat_status qmat_graph_format(qmat_context *context, const char *file, const char *text, size_t size,
                              qmat_writer *formatted) {
  *formatted = (qmat_writer){0};
  const size_t mark = qmat_byte_order_mark(text, size);
  text += mark, size -= mark;
  qmat_arena arena = {0};
  const qmat_tree *tree;
  qmat_status status = qmat_tree_read(context, &arena, file, text, size, &tree);
  if (status == QMAT_OK && !tree->is_mapping) { /* almost any text is a YAML document of one value */
    qmat_fail(context, QMAT_ERROR_USAGE, "this is not a graph file; one starts with 'qmat: 1'");
    status = qmat_fail_at(context, file, tree->mark.line, tree->mark.column);
  }
  formatter f = {.text = text, .size = size};
  if (status == QMAT_OK) {
    if (read_tokens(&f)) lay_out(&f);
    if (!f.failed) write_lines(&f, formatted);
    for (size_t i = 0; i < f.line_count; i++) f.failed |= f.lines[i].text.failed;
    if (f.failed || formatted->failed) {
      status = qmat_fail_memory(context, "formatted graph");
    } else if (!says_the_same(context, file, tree, &arena, text, size, formatted)) {
      qmat_fail(context, QMAT_ERROR_USAGE, "this file cannot be laid out without a change of its values or comments");
      status = qmat_fail_at(context, file, 0, 0);
    }
  }
  for (size_t i = 0; i < f.line_count; i++) qmat_writer_uninit(&f.lines[i].text);
  qmat_free(f.lines);
  qmat_free(f.tokens);
  qmat_arena_uninit(&arena);
  if (status != QMAT_OK) qmat_writer_uninit(formatted);
  return status;
}
