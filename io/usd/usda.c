/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The text form of USD. */
#include <math.h>
#include <string.h>

#include "io/scanner.h"
#include "io/usd/usd.h"

/* A text that grows, or numbers that do: what a value is collected in before its size is known. */
typedef struct stack {
  void *items;
  size_t count, capacity;
} stack;

typedef struct parser {
  qmat_context *context;
  qmat_usd_layer *layer;
  qmat_scanner scanner;
  int depth;    /* of brackets within values */
  stack text;   /* of char */
  stack number; /* of double or int64_t */
} parser;

/* What the name of a type stands for. */
typedef struct type_shape {
  const char *name;
  qmat_usd_type type;
  uint8_t components, rows; /* rows: of a matrix, whose rows have brackets of their own; else 0 */
  bool is_array;
} type_shape;

static const type_shape shapes[] = {
    {"bool", QMAT_USD_BOOL, 1, 0, false},
    {"uchar", QMAT_USD_UCHAR, 1, 0, false},
    {"int", QMAT_USD_INT, 1, 0, false},
    {"uint", QMAT_USD_UINT, 1, 0, false},
    {"int64", QMAT_USD_INT64, 1, 0, false},
    {"uint64", QMAT_USD_UINT64, 1, 0, false},
    {"half", QMAT_USD_HALF, 1, 0, false},
    {"float", QMAT_USD_FLOAT, 1, 0, false},
    {"double", QMAT_USD_DOUBLE, 1, 0, false},
    {"timecode", QMAT_USD_TIMECODE, 1, 0, false},
    {"string", QMAT_USD_STRING, 1, 0, false},
    {"pathExpression", QMAT_USD_STRING, 1, 0, false},
    {"token", QMAT_USD_TOKEN, 1, 0, false},
    {"asset", QMAT_USD_ASSET, 1, 0, false},
    {"dictionary", QMAT_USD_DICTIONARY, 1, 0, false},
    {"int2", QMAT_USD_INT, 2, 0, false},
    {"int3", QMAT_USD_INT, 3, 0, false},
    {"int4", QMAT_USD_INT, 4, 0, false},
    {"half2", QMAT_USD_HALF, 2, 0, false},
    {"half3", QMAT_USD_HALF, 3, 0, false},
    {"half4", QMAT_USD_HALF, 4, 0, false},
    {"float2", QMAT_USD_FLOAT, 2, 0, false},
    {"float3", QMAT_USD_FLOAT, 3, 0, false},
    {"float4", QMAT_USD_FLOAT, 4, 0, false},
    {"double2", QMAT_USD_DOUBLE, 2, 0, false},
    {"double3", QMAT_USD_DOUBLE, 3, 0, false},
    {"double4", QMAT_USD_DOUBLE, 4, 0, false},
    {"point3h", QMAT_USD_HALF, 3, 0, false},
    {"point3f", QMAT_USD_FLOAT, 3, 0, false},
    {"point3d", QMAT_USD_DOUBLE, 3, 0, false},
    {"vector3h", QMAT_USD_HALF, 3, 0, false},
    {"vector3f", QMAT_USD_FLOAT, 3, 0, false},
    {"vector3d", QMAT_USD_DOUBLE, 3, 0, false},
    {"normal3h", QMAT_USD_HALF, 3, 0, false},
    {"normal3f", QMAT_USD_FLOAT, 3, 0, false},
    {"normal3d", QMAT_USD_DOUBLE, 3, 0, false},
    {"color3h", QMAT_USD_HALF, 3, 0, false},
    {"color3f", QMAT_USD_FLOAT, 3, 0, false},
    {"color3d", QMAT_USD_DOUBLE, 3, 0, false},
    {"color4h", QMAT_USD_HALF, 4, 0, false},
    {"color4f", QMAT_USD_FLOAT, 4, 0, false},
    {"color4d", QMAT_USD_DOUBLE, 4, 0, false},
    {"texCoord2h", QMAT_USD_HALF, 2, 0, false},
    {"texCoord2f", QMAT_USD_FLOAT, 2, 0, false},
    {"texCoord2d", QMAT_USD_DOUBLE, 2, 0, false},
    {"texCoord3h", QMAT_USD_HALF, 3, 0, false},
    {"texCoord3f", QMAT_USD_FLOAT, 3, 0, false},
    {"texCoord3d", QMAT_USD_DOUBLE, 3, 0, false},
    {"quath", QMAT_USD_HALF, 4, 0, false},
    {"quatf", QMAT_USD_FLOAT, 4, 0, false},
    {"quatd", QMAT_USD_DOUBLE, 4, 0, false},
    {"matrix2d", QMAT_USD_DOUBLE, 4, 2, false},
    {"matrix3d", QMAT_USD_DOUBLE, 9, 3, false},
    {"matrix4d", QMAT_USD_DOUBLE, 16, 4, false},
    {"frame4d", QMAT_USD_DOUBLE, 16, 4, false},
};

/* ---- characters ---- */

static qmat_status fail_memory(const parser *p) {
  qmat_fail_memory(p->context, "a USD layer");
  return qmat_fail_at(p->context, p->scanner.file, 0, 0);
}

#define FAIL(...) qmat_scan_fail(&p->scanner, __VA_ARGS__)

/* Goes past one character of text that may run over lines. */
static void step(parser *p) {
  qmat_scanner *scanner = &p->scanner;
  char c = *scanner->at++;
  if (c != '\n' && (c != '\r' || *scanner->at == '\n')) return;
  scanner->line++;
  scanner->line_start = scanner->at;
}

/* The next character that is neither a blank nor part of a comment; 0 at the end of the text. */
static char peek(parser *p) {
  qmat_scanner *scanner = &p->scanner;
  while (qmat_scan_find(scanner)) {
    if (scanner->at[0] != '/' || (scanner->at[1] != '/' && scanner->at[1] != '*')) return *scanner->at;
    bool lines = scanner->at[1] == '*';
    while (scanner->at < scanner->end) {
      if (lines ? scanner->at[0] == '*' && scanner->at[1] == '/' : *scanner->at == '\n' || *scanner->at == '\r') break;
      step(p);
    }
    if (lines && scanner->at < scanner->end) scanner->at += 2;
  }
  return 0;
}

static bool accept(parser *p, char c) {
  if (peek(p) != c || c == 0) return false;
  p->scanner.at++;
  return true;
}

/* What stands here, for messages: a name, a number, or one character. */
static const char *what_is_here(parser *p, char text[32]) {
  size_t length = 0;
  if (peek(p) == 0 && p->scanner.at >= p->scanner.end) return "the end of the file";
  text[length++] = '\'';
  const char *at = p->scanner.at;
  do {
    text[length++] = *at >= ' ' && *at <= '~' ? *at : '?';
    at++;
  } while (at < p->scanner.end && length < 28 && strchr(" \t\r\n()[]{}=,;<>@\"'", *at) == NULL);
  text[length++] = '\'';
  text[length] = '\0';
  return text;
}

static qmat_status fail_expected(parser *p, const char *what) {
  char text[32];
  const char *here = what_is_here(p, text);
  return FAIL("%s should stand here, not %s", what, here);
}

static qmat_status expect(parser *p, char c) {
  if (accept(p, c)) return QMAT_OK;
  const char what[] = {'\'', c, '\'', '\0'};
  return fail_expected(p, what);
}

static bool is_name_start(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || (c & 0x80);
}

static bool is_name_part(char c) {
  return is_name_start(c) || (c >= '0' && c <= '9') || c == ':';
}

/* The name that starts here, also one with colons; length 0 when there is none. */
static const char *peek_name(parser *p, size_t *length) {
  *length = 0;
  if (!is_name_start(peek(p))) return p->scanner.at;
  const char *at = p->scanner.at;
  while (at + *length < p->scanner.end && is_name_part(at[*length])) ++*length;
  return at;
}

static bool accept_word(parser *p, const char *word) {
  size_t length;
  const char *name = peek_name(p, &length);
  if (!qmat_is_word(name, length, word)) return false;
  p->scanner.at += length;
  return true;
}

static qmat_status take_name(parser *p, const char *what, const char **name) {
  size_t length;
  const char *text = peek_name(p, &length);
  if (length == 0) return fail_expected(p, what);
  *name = qmat_usd_copy(p->context, p->layer, text, length);
  p->scanner.at += length;
  return *name ? QMAT_OK : p->context->error.status;
}

static qmat_status push_byte(parser *p, char c) {
  if (qmat_grow(&p->text.items, &p->text.capacity, p->text.count + 1, 1) != 0) return fail_memory(p);
  ((char *)p->text.items)[p->text.count++] = c;
  return QMAT_OK;
}

/* The character that an escape after a backslash stands for. */
static qmat_status take_escape(parser *p, char *c) {
  static const char letters[] = "nrtabfv", meanings[] = "\n\r\t\a\b\f\v";
  qmat_scanner *scanner = &p->scanner;
  const char *letter = *scanner->at ? strchr(letters, *scanner->at) : NULL;
  unsigned code = 0;
  if (letter) {
    *c = meanings[letter - letters];
    scanner->at++;
    return QMAT_OK;
  }
  if (*scanner->at == 'x') {
    scanner->at++;
    for (int i = 0; i < 2; i++, scanner->at++) {
      char digit = *scanner->at;
      unsigned value = digit >= '0' && digit <= '9'   ? (unsigned)(digit - '0')
                       : digit >= 'a' && digit <= 'f' ? (unsigned)(digit - 'a' + 10)
                       : digit >= 'A' && digit <= 'F' ? (unsigned)(digit - 'A' + 10)
                                                      : 16;
      if (value == 16) break;
      code = 16 * code + value;
    }
  } else if (*scanner->at >= '0' && *scanner->at <= '7') {
    for (int i = 0; i < 3 && *scanner->at >= '0' && *scanner->at <= '7'; i++) {
      code = 8 * code + (unsigned)(*scanner->at++ - '0');
    }
  } else {
    *c = *scanner->at;
    step(p);
    return QMAT_OK;
  }
  *c = (char)(code & 0xFF);
  return *c ? QMAT_OK : FAIL("a text cannot hold a zero");
}

/* A text in single or double quotes, or in three of them, which may run over lines. */
static qmat_status take_string(parser *p, const char **text) {
  qmat_scanner *scanner = &p->scanner;
  char quote = peek(p);
  if (quote != '"' && quote != '\'') return fail_expected(p, "a text in quotes");
  const qmat_scanner start = *scanner;
  bool triple = scanner->at[1] == quote && scanner->at[2] == quote;
  scanner->at += triple ? 3 : 1;
  p->text.count = 0;
  for (;;) {
    if (scanner->at >= scanner->end || (!triple && (*scanner->at == '\n' || *scanner->at == '\r'))) {
      return qmat_scan_fail(&start, "the text that begins here does not end");
    }
    char c = *scanner->at;
    if (c == quote && (!triple || (scanner->at[1] == quote && scanner->at[2] == quote))) break;
    step(p);
    if (c == '\0') return FAIL("a text cannot hold a zero");
    qmat_status status = QMAT_OK;
    if (c == '\\' && scanner->at < scanner->end) status = take_escape(p, &c);
    if (status == QMAT_OK) status = push_byte(p, c);
    if (status != QMAT_OK) return status;
  }
  scanner->at += triple ? 3 : 1;
  *text = qmat_usd_copy(p->context, p->layer, p->text.items ? p->text.items : "", p->text.count);
  return *text ? QMAT_OK : p->context->error.status;
}

/* What stands between two marks on one line, the first of which is here: <path>. */
static qmat_status take_path(parser *p, const char **path) {
  if (peek(p) != '<') return fail_expected(p, "a path in <>");
  qmat_scanner *scanner = &p->scanner;
  const char *at = scanner->at + 1;
  size_t length = 0;
  while (at + length < scanner->end && at[length] != '>' && at[length] != '\n' && at[length] != '\0') length++;
  if (at[length] != '>') return FAIL("the path that begins here does not end");
  *path = qmat_usd_copy(p->context, p->layer, at, length);
  scanner->at = at + length + 1;
  return *path ? QMAT_OK : p->context->error.status;
}

/* @asset@, or @@@asset@@@, in which \@@@ stands for three signs. */
static qmat_status take_asset(parser *p, const char **asset) {
  if (peek(p) != '@') return fail_expected(p, "an asset in @@");
  qmat_scanner *scanner = &p->scanner;
  const qmat_scanner start = *scanner;
  bool triple = scanner->at[1] == '@' && scanner->at[2] == '@';
  scanner->at += triple ? 3 : 1;
  p->text.count = 0;
  for (;;) {
    char c = *scanner->at;
    if (scanner->at >= scanner->end || c == '\0' || c == '\n') {
      return qmat_scan_fail(&start, "the asset that begins here does not end");
    }
    if (!triple && c == '@') break;
    if (triple && strncmp(scanner->at, "@@@", 3) == 0) break;
    scanner->at++;
    qmat_status status = QMAT_OK;
    if (triple && c == '\\' && strncmp(scanner->at, "@@@", 3) == 0) {
      scanner->at += 3;
      for (int i = 0; i < 3 && status == QMAT_OK; i++) status = push_byte(p, '@');
    } else {
      status = push_byte(p, c);
    }
    if (status != QMAT_OK) return status;
  }
  scanner->at += triple ? 3 : 1;
  *asset = qmat_usd_copy(p->context, p->layer, p->text.items ? p->text.items : "", p->text.count);
  return *asset ? QMAT_OK : p->context->error.status;
}

/* ---- numbers ---- */

static qmat_status push_number(parser *p, qmat_usd_type type, double number, int64_t integer) {
  if (qmat_grow(&p->number.items, &p->number.capacity, p->number.count + 1, 8) != 0) return fail_memory(p);
  if (qmat_usd_is_integer(type)) {
    ((int64_t *)p->number.items)[p->number.count++] = integer;
  } else {
    ((double *)p->number.items)[p->number.count++] = qmat_usd_round(type, number);
  }
  return QMAT_OK;
}

static const struct {
  int64_t least, most;
} ranges[] = {
    [QMAT_USD_BOOL] = {0, 1},
    [QMAT_USD_UCHAR] = {0, UINT8_MAX},
    [QMAT_USD_INT] = {INT32_MIN, INT32_MAX},
    [QMAT_USD_UINT] = {0, UINT32_MAX},
    [QMAT_USD_INT64] = {INT64_MIN, INT64_MAX},
    [QMAT_USD_UINT64] = {0, INT64_MAX},
};

/* The whole number at `text`, which ends at `end`; false when it is none. Those from 2^63 on, which only a uint64 has,
 * come out as the negative number of the same bits. */
static bool read_integer(const char *text, const char *end, qmat_usd_type type, int64_t *integer) {
  bool negative = *text == '-';
  if (*text == '-' || *text == '+') text++;
  uint64_t value = 0;
  if (text == end) return false;
  for (; text < end; text++) {
    if (*text < '0' || *text > '9') return false;
    if (__builtin_mul_overflow(value, 10, &value) || __builtin_add_overflow(value, (uint64_t)(*text - '0'), &value)) {
      return false;
    }
  }
  if (type == QMAT_USD_UINT64 && !negative) {
    *integer = (int64_t)value;
    return true;
  }
  if (value > (uint64_t)INT64_MAX + (negative ? 1 : 0)) return false;
  *integer = negative ? (int64_t)(0 - value) : (int64_t)value;
  return *integer >= ranges[type].least && *integer <= ranges[type].most;
}

/* One component of a value. */
static qmat_status take_number(parser *p, qmat_usd_type type) {
  char c = peek(p);
  qmat_scanner *scanner = &p->scanner;
  if (type == QMAT_USD_BOOL && is_name_start(c)) {
    static const struct {
      const char *word;
      int64_t truth;
    } words[] = {{"true", 1}, {"false", 0}, {"yes", 1}, {"no", 0}, {"on", 1}, {"off", 0}, {"True", 1}, {"False", 0}};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
      if (accept_word(p, words[i].word)) return push_number(p, type, 0, words[i].truth);
    }
    return fail_expected(p, "true or false");
  }
  if (type == QMAT_USD_UCHAR && (c == '\'' || c == '"')) { /* as a character */
    const char *text;
    qmat_status status = take_string(p, &text);
    return status == QMAT_OK ? push_number(p, type, 0, (uint8_t)text[0]) : status;
  }
  double number;
  const char *end = scanner->at < scanner->end ? qmat_scan_double(scanner->at, scanner->end, &number) : NULL;
  if (!end || (end < scanner->end && is_name_part(*end) && *end != ':')) return fail_expected(p, "a number");
  int64_t integer = 0;
  if (qmat_usd_is_integer(type) && !read_integer(scanner->at, end, type, &integer)) {
    if (type != QMAT_USD_BOOL && fabs(number) < 0x1p53 && number == floor(number) &&
        number >= (double)ranges[type].least && number <= (double)ranges[type].most) {
      integer = (int64_t)number;
    } else {
      return FAIL("a whole number of the type should stand here");
    }
  }
  scanner->at = end;
  return push_number(p, type, number, integer);
}

/* `count` components in brackets, in rows where it is a matrix. */
static qmat_status take_tuple(parser *p, const type_shape *shape, unsigned count, bool in_rows) {
  if (count == 1 && !in_rows) return take_number(p, shape->type);
  qmat_status status = expect(p, '(');
  unsigned items = in_rows ? shape->rows : count;
  for (unsigned i = 0; i < items && status == QMAT_OK; i++) {
    if (i > 0) status = expect(p, ',');
    if (status == QMAT_OK) {
      status = in_rows ? take_tuple(p, shape, count / shape->rows, false) : take_number(p, shape->type);
    }
  }
  if (status == QMAT_OK) accept(p, ',');
  return status == QMAT_OK ? expect(p, ')') : status;
}

/* ---- values ---- */

static qmat_status take_dictionary(parser *p, qmat_usd_value *value);
static qmat_status take_any(parser *p, qmat_usd_value *value);

static qmat_usd_value *new_value(parser *p) {
  return qmat_usd_alloc(p->context, p->layer, 1, sizeof(qmat_usd_value));
}

/* Moves what was collected into the layer's memory. */
static void *keep_collected(parser *p, const stack *items, size_t size) {
  void *kept = qmat_usd_alloc(p->context, p->layer, items->count, size);
  if (kept && items->count > 0) memcpy(kept, items->items, items->count * size);
  return kept;
}

static qmat_status take_text(parser *p, qmat_usd_type type, const char **text) {
  if (type == QMAT_USD_ASSET) return take_asset(p, text);
  if (type == QMAT_USD_PATH) return take_path(p, text);
  return take_string(p, text);
}

static qmat_status push_text(parser *p, stack *texts, const char *text) {
  if (qmat_grow(&texts->items, &texts->capacity, texts->count + 1, sizeof(const char *)) != 0) return fail_memory(p);
  ((const char **)texts->items)[texts->count++] = text;
  return QMAT_OK;
}

static bool takes_array_end(parser *p, qmat_status *status) {
  bool comma = accept(p, ',');
  if (accept(p, ']')) return true;
  if (!comma) *status = fail_expected(p, "',' or ']'");
  return *status != QMAT_OK;
}

/* A value of texts: one, or an array in []. */
static qmat_status take_texts(parser *p, qmat_usd_type type, bool is_array, qmat_usd_value *value) {
  stack texts = {0};
  const char *text;
  qmat_status status = QMAT_OK;
  if (!is_array) {
    status = take_text(p, type, &text);
    if (status == QMAT_OK) status = push_text(p, &texts, text);
  } else {
    status = expect(p, '[');
    bool ends = status == QMAT_OK && accept(p, ']');
    while (status == QMAT_OK && !ends) {
      status = take_text(p, type, &text);
      if (status == QMAT_OK) status = push_text(p, &texts, text);
      if (status == QMAT_OK) ends = takes_array_end(p, &status);
    }
  }
  if (status == QMAT_OK) {
    *value = (qmat_usd_value){.type = type, .is_array = is_array, .components = 1, .count = texts.count};
    value->texts = keep_collected(p, &texts, sizeof(const char *));
    if (!value->texts) status = p->context->error.status;
  }
  qmat_free(texts.items);
  return status;
}

static qmat_status keep_numbers(parser *p, qmat_usd_type type, bool is_array, unsigned components,
                                qmat_usd_value *value) {
  *value = (qmat_usd_value){
      .type = type, .is_array = is_array, .components = (uint8_t)components, .count = p->number.count / components};
  void *kept = keep_collected(p, &p->number, 8);
  if (!kept) return p->context->error.status;
  if (qmat_usd_is_integer(type)) {
    value->integers = kept;
  } else {
    value->numbers = kept;
  }
  return QMAT_OK;
}

/* A value of a known type. */
static qmat_status take_typed(parser *p, const type_shape *shape, qmat_usd_value *value) {
  if (accept_word(p, "None")) {
    *value = (qmat_usd_value){.type = QMAT_USD_BLOCK};
    return QMAT_OK;
  }
  if (shape->type == QMAT_USD_DICTIONARY) return take_dictionary(p, value);
  if (qmat_usd_is_text(shape->type)) return take_texts(p, shape->type, shape->is_array, value);
  p->number.count = 0;
  qmat_status status = QMAT_OK;
  if (!shape->is_array) {
    status = take_tuple(p, shape, shape->components, shape->rows > 0);
  } else {
    status = expect(p, '[');
    bool ends = status == QMAT_OK && accept(p, ']');
    while (status == QMAT_OK && !ends) {
      status = take_tuple(p, shape, shape->components, shape->rows > 0);
      if (status == QMAT_OK) ends = takes_array_end(p, &status);
    }
  }
  return status == QMAT_OK ? keep_numbers(p, shape->type, shape->is_array, shape->components, value) : status;
}

/* The type of this name, with [] or without. An unknown one is not an error here: its value is passed over. */
static qmat_status take_type(parser *p, const char **name, type_shape *shape) {
  size_t length;
  const char *text = peek_name(p, &length);
  if (length == 0) return fail_expected(p, "the name of a type");
  *shape = (type_shape){.type = QMAT_USD_UNREAD};
  for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
    if (qmat_is_word(text, length, shapes[i].name)) *shape = shapes[i];
  }
  p->scanner.at += length;
  if (p->scanner.at[0] == '[' && p->scanner.at[1] == ']') {
    shape->is_array = true;
    p->scanner.at += 2;
    length += 2;
  }
  *name = qmat_usd_copy(p->context, p->layer, text, length);
  return *name ? QMAT_OK : p->context->error.status;
}

/* Goes past a value of a kind that is not taken apart: one text, name or number, or everything up to the bracket that
 * matches the one here. */
static qmat_status pass_over(parser *p) {
  const qmat_scanner start = p->scanner;
  int open = 0;
  do {
    const char *text;
    size_t length;
    qmat_status status = QMAT_OK;
    char c = peek(p);
    if (c == 0) return qmat_scan_fail(&start, "the value that begins here does not end");
    if (c == '"' || c == '\'') {
      status = take_string(p, &text);
    } else if (c == '@') {
      status = take_asset(p, &text);
    } else if (strchr("([{", c)) {
      open++;
      p->scanner.at++;
    } else if (strchr(")]}", c)) {
      if (--open < 0) return fail_expected(p, "a value");
      p->scanner.at++;
    } else {
      peek_name(p, &length);
      if (length > 0) {
        p->scanner.at += length;
      } else {
        double number;
        const char *end = qmat_scan_double(p->scanner.at, p->scanner.end, &number);
        if (!end && open == 0) return fail_expected(p, "a value");
        p->scanner.at = end ? end : p->scanner.at + 1;
      }
    }
    if (status != QMAT_OK) return status;
  } while (open > 0);
  return QMAT_OK;
}

static qmat_status pass_over_as(parser *p, const char *kind, qmat_usd_value *value) {
  qmat_status status = pass_over(p);
  if (status != QMAT_OK) return status;
  const qmat_usd_value *text = qmat_usd_text_value(p->context, p->layer, QMAT_USD_UNREAD, kind);
  if (!text) return p->context->error.status;
  *value = *text;
  return QMAT_OK;
}

static qmat_status take_value_of(parser *p, const type_shape *shape, const char *type_name, qmat_usd_value *value) {
  if (shape->type != QMAT_USD_UNREAD) return take_typed(p, shape, value);
  return pass_over_as(p, type_name, value);
}

static bool deeper(parser *p, qmat_status *status) {
  if (++p->depth <= QMAT_USD_DEEPEST) return true;
  *status = FAIL("brackets are nested more than %d deep", QMAT_USD_DEEPEST);
  return false;
}

static qmat_status take_dictionary(parser *p, qmat_usd_value *value) {
  stack entries = {0};
  qmat_status status = QMAT_OK;
  if (!deeper(p, &status)) return status;
  status = expect(p, '{');
  while (status == QMAT_OK && !accept(p, '}')) {
    qmat_usd_field entry = {0};
    type_shape shape;
    const char *type_name;
    status = take_type(p, &type_name, &shape);
    if (status != QMAT_OK) break;
    char c = peek(p);
    status = c == '"' || c == '\'' ? take_string(p, &entry.name) : take_name(p, "the name of an entry", &entry.name);
    if (status == QMAT_OK) status = expect(p, '=');
    if (status != QMAT_OK) break;
    qmat_usd_value *made = new_value(p);
    status = made ? take_value_of(p, &shape, type_name, made) : p->context->error.status;
    entry.value = made;
    if (status == QMAT_OK && qmat_grow(&entries.items, &entries.capacity, entries.count + 1, sizeof entry) != 0) {
      status = fail_memory(p);
    }
    if (status == QMAT_OK) ((qmat_usd_field *)entries.items)[entries.count++] = entry;
    while (status == QMAT_OK && (accept(p, ';') || accept(p, ','))) continue;
  }
  if (status == QMAT_OK) {
    *value = (qmat_usd_value){.type = QMAT_USD_DICTIONARY, .components = 1, .count = entries.count};
    value->entries = keep_collected(p, &entries, sizeof(qmat_usd_field));
    if (!value->entries) status = p->context->error.status;
  }
  qmat_free(entries.items);
  p->depth--;
  return status;
}

/* A number, or numbers in round brackets, without a known type: whole numbers become int64, others double. */
static qmat_status take_untyped_number(parser *p, qmat_usd_value *value) {
  double number;
  const char *end = qmat_scan_double(p->scanner.at, p->scanner.end, &number);
  int64_t integer;
  bool whole = end && read_integer(p->scanner.at, end, QMAT_USD_INT64, &integer);
  type_shape shape = {.type = whole ? QMAT_USD_INT64 : QMAT_USD_DOUBLE, .components = 1};
  return take_typed(p, &shape, value);
}

/* A value whose type is not written: metadata. */
static qmat_status take_any(parser *p, qmat_usd_value *value) {
  size_t length;
  char c = peek(p);
  if (c == '"' || c == '\'') return take_texts(p, QMAT_USD_STRING, false, value);
  if (c == '@') return take_texts(p, QMAT_USD_ASSET, false, value);
  if (c == '<') return take_texts(p, QMAT_USD_PATH, false, value);
  if (c == '{') return take_dictionary(p, value);
  if (c == '(') return pass_over_as(p, "tuple", value);
  if (c == '[') {
    const qmat_scanner start = p->scanner;
    p->scanner.at++;
    c = peek(p);
    p->scanner = start;
    if (c == '"' || c == '\'') return take_texts(p, QMAT_USD_STRING, true, value);
    if (c == '@') return take_texts(p, QMAT_USD_ASSET, true, value);
    if (c == '<') return take_texts(p, QMAT_USD_PATH, true, value);
    if (c == '-' || c == '+' || c == '.' || (c >= '0' && c <= '9') || c == ']') {
      type_shape shape = {.type = QMAT_USD_DOUBLE, .components = 1, .is_array = true};
      return take_typed(p, &shape, value);
    }
    return pass_over_as(p, "list", value);
  }
  const char *name = peek_name(p, &length);
  if (length == 0) return take_untyped_number(p, value);
  if (qmat_is_word(name, length, "None")) {
    p->scanner.at += length;
    *value = (qmat_usd_value){.type = QMAT_USD_BLOCK};
    return QMAT_OK;
  }
  bool truth = qmat_is_word(name, length, "true");
  const qmat_usd_value *made;
  if (truth || qmat_is_word(name, length, "false")) {
    p->scanner.at += length;
    made = qmat_usd_bool_value(p->context, p->layer, truth);
  } else if (qmat_is_word(name, length, "inf") || qmat_is_word(name, length, "nan")) {
    return take_untyped_number(p, value);
  } else {
    const char *token;
    qmat_status status = take_name(p, "a value", &token);
    if (status != QMAT_OK) return status;
    made = qmat_usd_text_value(p->context, p->layer, QMAT_USD_TOKEN, token);
  }
  if (!made) return p->context->error.status;
  *value = *made;
  return QMAT_OK;
}

/* ---- references and edits of lists ---- */

/* (offset = 10; scale = 0.5; customData = {...}) after a reference or a sublayer. */
static qmat_status take_layer_offset(parser *p, double *offset, double *scale) {
  *offset = 0;
  *scale = 1;
  if (!accept(p, '(')) return QMAT_OK;
  qmat_status status = QMAT_OK;
  while (status == QMAT_OK && !accept(p, ')')) {
    const char *name;
    qmat_usd_value value;
    status = take_name(p, "offset or scale", &name);
    if (status == QMAT_OK) status = expect(p, '=');
    if (status == QMAT_OK) status = take_any(p, &value);
    if (status != QMAT_OK) break;
    if (strcmp(name, "offset") == 0) *offset = qmat_usd_number(&value, 0);
    if (strcmp(name, "scale") == 0) *scale = qmat_usd_number(&value, 1);
    while (accept(p, ';') || accept(p, ',')) continue;
  }
  return status;
}

static qmat_status take_reference(parser *p, qmat_usd_reference *reference) {
  *reference = (qmat_usd_reference){.asset = "", .path = "", .scale = 1};
  char c = peek(p);
  if (c != '@' && c != '<') return fail_expected(p, "a reference, @asset@ or <path>,");
  qmat_status status = c == '@' ? take_asset(p, &reference->asset) : QMAT_OK;
  if (status == QMAT_OK && peek(p) == '<') status = take_path(p, &reference->path);
  return status == QMAT_OK ? take_layer_offset(p, &reference->offset, &reference->scale) : status;
}

static qmat_status take_references(parser *p, qmat_usd_value *value) {
  stack references = {0};
  qmat_usd_reference reference;
  qmat_status status = QMAT_OK;
  if (!accept(p, '[')) {
    status = take_reference(p, &reference);
    if (status == QMAT_OK && qmat_grow(&references.items, &references.capacity, 1, sizeof reference) != 0) {
      status = fail_memory(p);
    }
    if (status == QMAT_OK) ((qmat_usd_reference *)references.items)[references.count++] = reference;
  } else {
    bool ends = accept(p, ']');
    while (status == QMAT_OK && !ends) {
      status = take_reference(p, &reference);
      if (status == QMAT_OK &&
          qmat_grow(&references.items, &references.capacity, references.count + 1, sizeof reference) != 0) {
        status = fail_memory(p);
      }
      if (status != QMAT_OK) break;
      ((qmat_usd_reference *)references.items)[references.count++] = reference;
      ends = takes_array_end(p, &status);
    }
  }
  if (status == QMAT_OK) {
    *value = (qmat_usd_value){.type = QMAT_USD_REFERENCE, .is_array = true, .components = 1, .count = references.count};
    value->references = keep_collected(p, &references, sizeof reference);
    if (!value->references) status = p->context->error.status;
  }
  qmat_free(references.items);
  return status;
}

/* The list of an edit: one item or several in [], of a type that the field is known to have. */
static qmat_status take_list(parser *p, qmat_usd_type type, qmat_usd_value *list) {
  if (accept_word(p, "None")) {
    *list = (qmat_usd_value){.type = type, .is_array = true, .components = 1};
    return QMAT_OK;
  }
  if (type == QMAT_USD_REFERENCE) return take_references(p, list);
  if (type == QMAT_USD_BLOCK) { /* not known */
    qmat_status status = take_any(p, list);
    if (status == QMAT_OK) list->is_array = true;
    return status;
  }
  qmat_status status = take_texts(p, type, peek(p) == '[', list);
  list->is_array = true;
  return status;
}

/* The word before a list that says what becomes of it. */
static bool accept_edit(parser *p, qmat_usd_edit *edit) {
  static const char *const words[] = {[QMAT_USD_ADDED] = "add",
                                      [QMAT_USD_PREPENDED] = "prepend",
                                      [QMAT_USD_APPENDED] = "append",
                                      [QMAT_USD_DELETED] = "delete",
                                      [QMAT_USD_ORDERED] = "reorder"};
  for (*edit = QMAT_USD_ADDED; *edit < QMAT_USD_EDIT_COUNT; ++*edit) {
    if (accept_word(p, words[*edit])) return true;
  }
  *edit = QMAT_USD_EXPLICIT;
  return false;
}

/* Adds the list here to what the field already says. */
static qmat_status take_edit(parser *p, qmat_usd_spec *spec, const char *name, qmat_usd_edit edit, qmat_usd_type type) {
  const qmat_usd_value *older = qmat_usd_field_value(spec, name);
  qmat_usd_value *value = new_value(p);
  qmat_usd_list_op *op = value ? qmat_usd_alloc(p->context, p->layer, 1, sizeof *op) : NULL;
  if (!op) return p->context->error.status;
  if (older && older->type == QMAT_USD_LIST_OP && edit != QMAT_USD_EXPLICIT) {
    *op = *older->list_op;
  } else {
    for (int i = 0; i < QMAT_USD_EDIT_COUNT; i++) {
      op->lists[i] = (qmat_usd_value){.type = type, .is_array = true, .components = 1};
    }
  }
  if (edit == QMAT_USD_EXPLICIT) op->is_explicit = true;
  *value = (qmat_usd_value){.type = QMAT_USD_LIST_OP, .components = 1, .count = 1, .list_op = op};
  qmat_status status = take_list(p, type, &op->lists[edit]);
  return status == QMAT_OK ? qmat_usd_set_field(p->context, p->layer, spec, name, value) : status;
}

/* ---- metadata ---- */

/* What text calls a field, what the binary form calls it, and the type of its list where it has one. */
static const struct {
  const char *word, *name;
  qmat_usd_type list;
} known_fields[] = {
    {"doc", "documentation", QMAT_USD_BLOCK},         {"references", "references", QMAT_USD_REFERENCE},
    {"payload", "payload", QMAT_USD_REFERENCE},       {"inherits", "inheritPaths", QMAT_USD_PATH},
    {"specializes", "specializes", QMAT_USD_PATH},    {"variantSets", "variantSetNames", QMAT_USD_STRING},
    {"variants", "variantSelection", QMAT_USD_BLOCK}, {"apiSchemas", "apiSchemas", QMAT_USD_TOKEN},
};

static qmat_status take_sublayers(parser *p, qmat_usd_spec *spec) {
  stack assets = {0};
  p->number.count = 0;
  qmat_status status = expect(p, '[');
  bool ends = status == QMAT_OK && accept(p, ']');
  while (status == QMAT_OK && !ends) {
    const char *asset;
    double offset = 0, scale = 1;
    status = take_asset(p, &asset);
    if (status == QMAT_OK) status = push_text(p, &assets, asset);
    if (status == QMAT_OK && peek(p) == '(') {
      stack kept = p->number; /* values inside use it too */
      p->number = (stack){0};
      status = take_layer_offset(p, &offset, &scale);
      qmat_free(p->number.items);
      p->number = kept;
    }
    if (status == QMAT_OK) status = push_number(p, QMAT_USD_DOUBLE, offset, 0);
    if (status == QMAT_OK) status = push_number(p, QMAT_USD_DOUBLE, scale, 0);
    if (status == QMAT_OK) ends = takes_array_end(p, &status);
  }
  qmat_usd_value *names = new_value(p), *offsets = new_value(p);
  if (status == QMAT_OK && (!names || !offsets)) status = p->context->error.status;
  if (status == QMAT_OK) {
    *names = (qmat_usd_value){.type = QMAT_USD_STRING, .is_array = true, .components = 1, .count = assets.count};
    names->texts = keep_collected(p, &assets, sizeof(const char *));
    status = names->texts ? keep_numbers(p, QMAT_USD_DOUBLE, true, 2, offsets) : p->context->error.status;
  }
  if (status == QMAT_OK) status = qmat_usd_set_field(p->context, p->layer, spec, "subLayers", names);
  if (status == QMAT_OK) status = qmat_usd_set_field(p->context, p->layer, spec, "subLayerOffsets", offsets);
  qmat_free(assets.items);
  return status;
}

static qmat_status take_field(parser *p, qmat_usd_spec *spec) {
  qmat_usd_edit edit;
  const char *name;
  if (peek(p) == '"' || peek(p) == '\'') { /* a comment for people */
    qmat_usd_value *comment = new_value(p);
    if (!comment) return p->context->error.status;
    qmat_status status = take_any(p, comment);
    return status == QMAT_OK ? qmat_usd_set_field(p->context, p->layer, spec, "comment", comment) : status;
  }
  bool edits = accept_edit(p, &edit);
  qmat_status status = take_name(p, "the name of a field", &name);
  if (status == QMAT_OK) status = expect(p, '=');
  if (status != QMAT_OK) return status;
  qmat_usd_type list = QMAT_USD_BLOCK;
  for (size_t i = 0; i < sizeof known_fields / sizeof known_fields[0]; i++) {
    if (strcmp(name, known_fields[i].word) != 0) continue;
    name = known_fields[i].name;
    list = known_fields[i].list;
  }
  if (spec->kind == QMAT_USD_ROOT && strcmp(name, "subLayers") == 0) return take_sublayers(p, spec);
  if (edits || list != QMAT_USD_BLOCK) return take_edit(p, spec, name, edit, list);
  qmat_usd_value *value = new_value(p);
  if (!value) return p->context->error.status;
  bool is_map = strcmp(name, "relocates") == 0;
  status = is_map ? pass_over_as(p, name, value) : take_any(p, value);
  return status == QMAT_OK ? qmat_usd_set_field(p->context, p->layer, spec, name, value) : status;
}

/* ( ... ), if it is there. */
static qmat_status take_metadata(parser *p, qmat_usd_spec *spec) {
  if (!accept(p, '(')) return QMAT_OK;
  qmat_status status = QMAT_OK;
  while (status == QMAT_OK && !accept(p, ')')) {
    status = take_field(p, spec);
    while (status == QMAT_OK && accept(p, ';')) continue;
  }
  return status;
}

/* ---- properties ---- */

static qmat_status set_text(parser *p, qmat_usd_spec *spec, const char *name, qmat_usd_type type, const char *text) {
  const qmat_usd_value *value = qmat_usd_text_value(p->context, p->layer, type, text);
  return value ? qmat_usd_set_field(p->context, p->layer, spec, name, value) : p->context->error.status;
}

/* The child of this name, made when it is not there yet. `at` is where its statement begins. */
static qmat_status find_or_add(parser *p, const qmat_scanner *at, qmat_usd_spec *parent, qmat_usd_kind kind,
                               const char *name, qmat_usd_spec **spec) {
  *spec = qmat_usd_child(p->layer, parent, kind, name);
  if (*spec) return QMAT_OK;
  *spec = qmat_usd_add_child(p->context, p->layer, parent, kind, name);
  if (!*spec) return qmat_fail_at(p->context, at->file, at->line, 0);
  (*spec)->line = at->line;
  (*spec)->column = (int)(at->at - at->line_start) + 1;
  return QMAT_OK;
}

static qmat_status take_samples(parser *p, const type_shape *shape, const char *type_name, qmat_usd_value *value) {
  stack times = {0}, values = {0};
  qmat_status status = expect(p, '{');
  while (status == QMAT_OK && !accept(p, '}')) {
    double time;
    const char *end = peek(p) ? qmat_scan_double(p->scanner.at, p->scanner.end, &time) : NULL;
    if (!end) {
      status = fail_expected(p, "the time of a sample");
      break;
    }
    p->scanner.at = end;
    status = expect(p, ':');
    qmat_usd_value *sample = status == QMAT_OK ? new_value(p) : NULL;
    if (!sample) {
      status = p->context->error.status;
      break;
    }
    status = take_value_of(p, shape, type_name, sample);
    if (status == QMAT_OK && (qmat_grow(&times.items, &times.capacity, times.count + 1, sizeof time) != 0 ||
                              qmat_grow(&values.items, &values.capacity, values.count + 1, sizeof sample) != 0)) {
      status = fail_memory(p);
    }
    if (status != QMAT_OK) break;
    ((double *)times.items)[times.count++] = time;
    ((qmat_usd_value **)values.items)[values.count++] = sample;
    if (!accept(p, ',') && peek(p) != '}') status = fail_expected(p, "',' or '}'");
  }
  if (status == QMAT_OK) {
    qmat_usd_samples *samples = qmat_usd_alloc(p->context, p->layer, 1, sizeof *samples);
    if (samples) {
      samples->count = times.count;
      samples->times = keep_collected(p, &times, sizeof(double));
      samples->values = samples->times ? keep_collected(p, &values, sizeof(qmat_usd_value *)) : NULL;
    }
    if (!samples || !samples->values) status = p->context->error.status;
    *value = (qmat_usd_value){.type = QMAT_USD_TIME_SAMPLES, .components = 1, .count = 1, .samples = samples};
  }
  qmat_free(times.items);
  qmat_free(values.items);
  return status;
}

/* A path, or several in [], or None. */
static qmat_status take_targets(parser *p, qmat_usd_spec *spec, const char *name, qmat_usd_edit edit) {
  return take_edit(p, spec, name, edit, QMAT_USD_PATH);
}

static qmat_status take_relationship(parser *p, const qmat_scanner *at, qmat_usd_spec *owner, qmat_usd_edit edit,
                                     bool custom, bool varying) {
  const char *name;
  qmat_usd_spec *spec;
  qmat_status status = take_name(p, "the name of a relationship", &name);
  if (status == QMAT_OK) status = find_or_add(p, at, owner, QMAT_USD_RELATIONSHIP, name, &spec);
  if (status != QMAT_OK) return status;
  if (custom) {
    const qmat_usd_value *yes = qmat_usd_bool_value(p->context, p->layer, true);
    status = yes ? qmat_usd_set_field(p->context, p->layer, spec, "custom", yes) : p->context->error.status;
  }
  if (status == QMAT_OK && !varying) status = set_text(p, spec, "variability", QMAT_USD_TOKEN, "uniform");
  if (status == QMAT_OK && p->scanner.at[0] == '[') return FAIL("attributes of relationships are not read");
  if (status == QMAT_OK && p->scanner.at[0] == '.') {
    p->scanner.at++;
    if (!accept_word(p, "timeSamples") && !accept_word(p, "default")) {
      return fail_expected(p, "timeSamples or default");
    }
    qmat_usd_value *value = new_value(p);
    status = expect(p, '=');
    if (status == QMAT_OK && !value) status = p->context->error.status;
    if (status == QMAT_OK) status = pass_over_as(p, "targets over time", value);
    return status == QMAT_OK ? qmat_usd_set_field(p->context, p->layer, spec, "timeSamples", value) : status;
  }
  if (status == QMAT_OK && accept(p, '=')) status = take_targets(p, spec, "targetPaths", edit);
  return status == QMAT_OK ? take_metadata(p, spec) : status;
}

static qmat_status take_attribute(parser *p, const qmat_scanner *at, qmat_usd_spec *owner, qmat_usd_edit edit,
                                  bool custom, bool uniform) {
  const char *type_name, *name;
  type_shape shape;
  qmat_usd_spec *spec;
  qmat_status status = take_type(p, &type_name, &shape);
  if (status == QMAT_OK) status = take_name(p, "the name of an attribute", &name);
  if (status == QMAT_OK) status = find_or_add(p, at, owner, QMAT_USD_ATTRIBUTE, name, &spec);
  if (status == QMAT_OK) status = set_text(p, spec, "typeName", QMAT_USD_TOKEN, type_name);
  if (status == QMAT_OK && custom) {
    const qmat_usd_value *yes = qmat_usd_bool_value(p->context, p->layer, true);
    status = yes ? qmat_usd_set_field(p->context, p->layer, spec, "custom", yes) : p->context->error.status;
  }
  if (status == QMAT_OK && uniform) status = set_text(p, spec, "variability", QMAT_USD_TOKEN, "uniform");
  if (status != QMAT_OK) return status;

  if (p->scanner.at[0] == '.') {
    p->scanner.at++;
    bool connect = accept_word(p, "connect"), samples = !connect && accept_word(p, "timeSamples");
    if (!connect && !samples && !accept_word(p, "spline")) return fail_expected(p, "connect, timeSamples or spline");
    status = expect(p, '=');
    if (status == QMAT_OK && connect) {
      status = take_targets(p, spec, "connectionPaths", edit);
    } else if (status == QMAT_OK) {
      qmat_usd_value *value = new_value(p);
      if (!value) return p->context->error.status;
      status = samples ? take_samples(p, &shape, type_name, value) : pass_over_as(p, "spline", value);
      if (status == QMAT_OK) {
        status = qmat_usd_set_field(p->context, p->layer, spec, samples ? "timeSamples" : "spline", value);
      }
    }
  } else if (accept(p, '=')) {
    qmat_usd_value *value = new_value(p);
    if (!value) return p->context->error.status;
    status = take_value_of(p, &shape, type_name, value);
    if (status == QMAT_OK) status = qmat_usd_set_field(p->context, p->layer, spec, "default", value);
  }
  return status == QMAT_OK ? take_metadata(p, spec) : status;
}

static qmat_status take_property(parser *p, qmat_usd_spec *owner) {
  qmat_usd_edit edit;
  peek(p);
  const qmat_scanner at = p->scanner;
  bool edits = accept_edit(p, &edit);
  bool custom = accept_word(p, "custom"), varying = accept_word(p, "varying");
  bool uniform = !varying && (accept_word(p, "uniform") || accept_word(p, "config"));
  if (accept_word(p, "rel")) return take_relationship(p, &at, owner, edit, custom, varying);
  if (edits && edit == QMAT_USD_ORDERED && peek(p) != 0) {
    size_t length;
    const char *word = peek_name(p, &length);
    bool names = qmat_is_word(word, length, "nameChildren"), properties = qmat_is_word(word, length, "properties");
    if (names || properties) {
      p->scanner.at += length;
      qmat_usd_value *order = new_value(p);
      qmat_status status = expect(p, '=');
      if (status == QMAT_OK && !order) status = p->context->error.status;
      if (status == QMAT_OK) status = take_texts(p, QMAT_USD_STRING, peek(p) == '[', order);
      return status == QMAT_OK
                 ? qmat_usd_set_field(p->context, p->layer, owner, names ? "primOrder" : "propertyOrder", order)
                 : status;
    }
  }
  return take_attribute(p, &at, owner, edit, custom, uniform);
}

/* ---- prims ---- */

static qmat_status take_contents(parser *p, qmat_usd_spec *spec);

/* The specifier that stands here, or NULL. */
static const char *accept_specifier(parser *p) {
  static const char *const specifiers[] = {"def", "over", "class"};
  for (size_t i = 0; i < 3; i++) {
    if (accept_word(p, specifiers[i])) return specifiers[i];
  }
  return NULL;
}

static qmat_status take_prim(parser *p, const qmat_scanner *at, const char *specifier, qmat_usd_spec *parent) {
  const char *name, *type_name = NULL;
  qmat_usd_spec *spec;
  qmat_status status = QMAT_OK;
  if (peek(p) != '"' && peek(p) != '\'') {
    size_t length;
    const char *text = peek_name(p, &length);
    while (p->scanner.at + length < p->scanner.end && (is_name_part(text[length]) || text[length] == '.')) length++;
    if (length == 0) return fail_expected(p, "the type or the name of a prim");
    type_name = qmat_usd_copy(p->context, p->layer, text, length);
    if (!type_name) return p->context->error.status;
    p->scanner.at += length;
  }
  status = take_string(p, &name);
  if (status != QMAT_OK) return status;
  bool good = is_name_start(*name) || (*name >= '0' && *name <= '9');
  for (const char *c = name; *c && good; c++) good = is_name_part(*c);
  if (!good) return qmat_scan_fail(at, "a prim cannot have the name '%.40s'", qmat_is_utf8(name) ? name : "?");
  if (qmat_usd_child(p->layer, parent, QMAT_USD_PRIM, name)) {
    return qmat_scan_fail(at, "there is already a prim '%.200s' here", qmat_is_utf8(name) ? name : "?");
  }
  status = find_or_add(p, at, parent, QMAT_USD_PRIM, name, &spec);
  if (status == QMAT_OK) status = set_text(p, spec, "specifier", QMAT_USD_TOKEN, specifier);
  if (status == QMAT_OK && type_name) status = set_text(p, spec, "typeName", QMAT_USD_TOKEN, type_name);
  if (status == QMAT_OK) status = take_metadata(p, spec);
  return status == QMAT_OK ? take_contents(p, spec) : status;
}

static qmat_status take_variant_set(parser *p, const qmat_scanner *at, qmat_usd_spec *owner) {
  const char *name;
  qmat_usd_spec *set, *variant;
  qmat_status status = take_string(p, &name);
  if (status == QMAT_OK) status = expect(p, '=');
  if (status == QMAT_OK) status = expect(p, '{');
  if (status == QMAT_OK) status = find_or_add(p, at, owner, QMAT_USD_VARIANT_SET, name, &set);
  while (status == QMAT_OK && !accept(p, '}')) {
    const qmat_scanner here = p->scanner;
    status = take_string(p, &name);
    if (status == QMAT_OK) status = find_or_add(p, &here, set, QMAT_USD_VARIANT, name, &variant);
    if (status == QMAT_OK) status = take_metadata(p, variant);
    if (status == QMAT_OK) status = take_contents(p, variant);
    while (status == QMAT_OK && accept(p, ';')) continue;
  }
  return status;
}

/* { ... } of a prim or a variant. */
static qmat_status take_contents(parser *p, qmat_usd_spec *spec) {
  qmat_status status = expect(p, '{');
  while (status == QMAT_OK && !accept(p, '}')) {
    char c = peek(p);
    const qmat_scanner at = p->scanner;
    if (c == ';') {
      p->scanner.at++;
      continue;
    }
    const char *specifier = accept_specifier(p);
    if (specifier) {
      status = take_prim(p, &at, specifier, spec);
    } else if (accept_word(p, "variantSet")) {
      status = take_variant_set(p, &at, spec);
    } else {
      status = take_property(p, spec);
    }
  }
  return status;
}

static qmat_status take_layer(parser *p) {
  qmat_scanner *scanner = &p->scanner;
  qmat_usd_spec *root = p->layer->root;
  if (qmat_scan_left(scanner) < 6 || memcmp(scanner->at, "#usda ", 6) != 0) {
    return FAIL("a text layer of USD begins with '#usda 1.0'");
  }
  double version;
  const char *end = qmat_scan_double(scanner->at + 6, scanner->end, &version);
  if (!end || !(version >= 1 && version < 2)) return FAIL("only version 1 of the text form of USD is read");
  scanner->at = end;
  qmat_scan_next_line(scanner);

  qmat_status status = take_metadata(p, root);
  while (status == QMAT_OK && peek(p) != 0) {
    const qmat_scanner at = *scanner;
    const char *specifier = accept_specifier(p);
    if (specifier) {
      status = take_prim(p, &at, specifier, root);
    } else if (accept_word(p, "reorder")) {
      qmat_usd_value *order = new_value(p);
      if (!order) return p->context->error.status;
      if (!accept_word(p, "rootPrims")) return fail_expected(p, "rootPrims");
      status = expect(p, '=');
      if (status == QMAT_OK) status = take_texts(p, QMAT_USD_STRING, peek(p) == '[', order);
      if (status == QMAT_OK) status = qmat_usd_set_field(p->context, p->layer, root, "primOrder", order);
    } else if (!accept(p, ';')) {
      status = fail_expected(p, "def, over or class");
    }
  }
  if (status == QMAT_OK && scanner->at < scanner->end) status = fail_expected(p, "def, over or class");
  return status;
}

qmat_status qmat_usda_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_usd_layer *layer) {
  parser p = {.context = context, .layer = layer};
  qmat_status status = qmat_usd_layer_init(context, layer, path, bytes->size);
  if (status != QMAT_OK) return status;
  qmat_scanner_init(&p.scanner, context, layer->path, (const char *)bytes->data, bytes->size, '#');
  status = take_layer(&p);
  qmat_free(p.text.items);
  qmat_free(p.number.items);
  return status;
}
