/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/value_form.h"

#include <string.h>

#include "core/value_table.h"

/* The serialised form of a value, all numbers little-endian: "QMAT", u32 form version, text type name, then each row in
 * the order of its table: text row name, u8 row kind, u64 size, and that many bytes. A text is a u32 size and its
 * bytes. */

static const uint8_t MAGIC[4] = {'Q', 'M', 'A', 'T'};
enum { FORM_VERSION = 1, JSON_FLAGS = JSON_SORT_KEYS | JSON_COMPACT | JSON_REAL_PRECISION(17) };

/* Writing. */

/* Receives bytes: hashes them, copies them to memory, or only counts them. */
typedef struct sink {
  qmat_hasher *hasher;
  uint8_t *bytes;
  size_t used;
} sink;

static void put(sink *to, const void *bytes, size_t size) {
  if (size == 0) return;
  if (to->hasher) qmat_hasher_add(to->hasher, bytes, size);
  if (to->bytes) memcpy(to->bytes + to->used, bytes, size);
  to->used += size;
}

static void encode(uint8_t *to, uint64_t number, size_t size) {
  for (size_t i = 0; i < size; i++) to[i] = (uint8_t)(number >> (8 * i));
}

static uint64_t decode(const uint8_t *from, size_t size) {
  uint64_t number = 0;
  for (size_t i = 0; i < size; i++) number |= (uint64_t)from[i] << (8 * i);
  return number;
}

static void put_number(sink *to, uint64_t number, size_t size) {
  uint8_t bytes[8];
  encode(bytes, number, size);
  put(to, bytes, size);
}

static void put_text(sink *to, const char *text) {
  const size_t length = strlen(text);
  put_number(to, (uint32_t)length, 4);
  put(to, text, length);
}

static void put_array(sink *to, qmat_row_kind kind, const void *array, size_t length) {
  enum { CHUNK = 512 };
  const size_t size = kind == QMAT_ROW_U32 ? 4 : 8;
  if (!to->hasher && !to->bytes) {
    to->used += length * size;
    return;
  }
  uint8_t bytes[CHUNK * 8];
  for (size_t start = 0; start < length; start += CHUNK) {
    const size_t count = length - start < CHUNK ? length - start : CHUNK;
    if (kind == QMAT_ROW_U32) {
      const uint32_t *numbers = (const uint32_t *)array + start;
      for (size_t i = 0; i < count; i++) encode(bytes + 4 * i, numbers[i], 4);
    } else {
      const double *numbers = (const double *)array + start;
      for (size_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        encode(bytes + 8 * i, bits, 8);
      }
    }
    put(to, bytes, count * size);
  }
}

static int put_json(const char *text, size_t size, void *to) {
  put(to, text, size);
  return 0;
}

static bool write_rows(sink *to, const qmat_value *value);

/* The bytes of one row's content. False when the JSON cannot be written. */
static bool write_content(sink *to, const qmat_value *value, const qmat_value_row *row) {
  const void *place = qmat_row_place(value, row);
  switch (row->kind) {
    case QMAT_ROW_U32:
    case QMAT_ROW_F64:
      put_array(to, row->kind, qmat_row_pointer(value, row), qmat_row_count(value, row) * row->components);
      return true;
    case QMAT_ROW_TEXT: {
      const char *text = qmat_row_pointer(value, row);
      put(to, text, strlen(text));
      return true;
    }
    case QMAT_ROW_JSON:
      return json_dump_callback(qmat_row_pointer(value, row), put_json, to, JSON_FLAGS) == 0;
    case QMAT_ROW_BOOL:
      put(to, *(const bool *)place ? "\1" : "\0", 1);
      return true;
    case QMAT_ROW_ENUM:
      put_number(to, *(const uint32_t *)place, 4);
      return true;
    case QMAT_ROW_SIZE:
      put_number(to, *(const size_t *)place, 8);
      return true;
    case QMAT_ROW_NUMBER:
      put_array(to, QMAT_ROW_F64, place, 1);
      return true;
    case QMAT_ROW_PARTS: {
      const qmat_file_part *parts = qmat_row_pointer(value, row);
      const size_t count = qmat_row_count(value, row);
      put_number(to, count, 8);
      for (size_t i = 0; i < count; i++) {
        put_text(to, parts[i].name);
        put_number(to, parts[i].size, 8);
        put(to, parts[i].bytes, parts[i].size);
      }
      return true;
    }
    case QMAT_ROW_ITEMS: {
      qmat_value *const *items = qmat_row_pointer(value, row);
      for (size_t i = 0; i < qmat_row_count(value, row); i++) {
        sink size = {0};
        if (!write_rows(&size, items[i])) return false;
        put_number(to, size.used, 8);
        put(to, items[i]->digest.bytes, sizeof items[i]->digest.bytes);
      }
      return true;
    }
    case QMAT_ROW_NAMES: {
      char *const *names = qmat_row_pointer(value, row);
      for (size_t i = 0; i < qmat_row_count(value, row); i++) put_text(to, names[i]);
      return true;
    }
  }
  return false;
}

static bool write_rows(sink *to, const qmat_value *value) {
  put(to, MAGIC, sizeof MAGIC);
  put_number(to, FORM_VERSION, 4);
  put_text(to, qmat_value_layouts[value->type].name);
  for (const qmat_value_row *row = qmat_value_rows(value); row->name != NULL; row++) {
    sink size = {0};
    if (!write_content(&size, value, row)) return false;
    put_text(to, row->name);
    const uint8_t kind = (uint8_t)row->kind;
    put(to, &kind, 1);
    put_number(to, size.used, 8);
    if (!write_content(to, value, row)) return false;
  }
  return true;
}

size_t qmat_value_bytes(const qmat_value *value) {
  size_t bytes = 0;
  for (const qmat_value_row *row = qmat_value_rows(value); row->name; row++) {
    if (!qmat_row_has_pointer(row) || !qmat_row_pointer(value, row)) continue;
    const void *pointer = qmat_row_pointer(value, row);
    sink size = {0};
    if (row->kind == QMAT_ROW_PARTS) {
      for (size_t i = 0; i < qmat_row_count(value, row); i++) bytes += ((const qmat_file_part *)pointer)[i].size;
    } else if (row->kind == QMAT_ROW_ITEMS) {
      for (size_t i = 0; i < qmat_row_count(value, row); i++) {
        const qmat_value *item = ((qmat_value *const *)pointer)[i];
        if (item) bytes += qmat_value_bytes(item);
      }
    } else if (row->kind != QMAT_ROW_NAMES) {
      write_content(&size, value, row);
      bytes += size.used;
    }
  }
  return bytes;
}

qmat_status qmat_value_serialize(qmat_context *context, const qmat_value *value, uint8_t **bytes, size_t *size) {
  *bytes = NULL;
  *size = 0;
  if (!value->sealed) {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "a %s must be sealed before it is serialised",
                     qmat_value_type_name(value->type));
  }
  sink to = {0};
  if (!write_rows(&to, value)) return qmat_fail_memory(context, "the text of a report");
  to.bytes = qmat_alloc(to.used, 1);
  if (!to.bytes) return qmat_fail_memory(context, "the serialised form of a value");
  to.used = 0;
  if (!write_rows(&to, value)) {
    qmat_free(to.bytes);
    return qmat_fail_memory(context, "the text of a report");
  }
  *bytes = to.bytes;
  *size = to.used;
  return QMAT_OK;
}

qmat_status qmat_value_seal(qmat_context *context, qmat_value *value) {
  if (value->sealed)
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "a %s was sealed twice", qmat_value_type_name(value->type));
  qmat_status status = qmat_value_check(context, value);
  if (status != QMAT_OK) return status;

  qmat_hasher hasher;
  status = qmat_hasher_init(&hasher);
  if (status != QMAT_OK) return qmat_fail(context, status, "OpenSSL cannot start a SHA-256");
  sink to = {.hasher = &hasher};
  const bool written = write_rows(&to, value);
  status = qmat_hasher_finish(&hasher, &value->digest);
  if (!written) return qmat_fail_memory(context, "the text of a report");
  if (status != QMAT_OK) return qmat_fail(context, status, "OpenSSL failed within a SHA-256");
  value->sealed = true;
  return QMAT_OK;
}

/* Reading. */

typedef struct reader {
  const uint8_t *bytes;
  size_t size, used;
  const qmat_value_source *items;
} reader;

static qmat_status fail_form(qmat_context *context, const reader *from, const char *what) {
  qmat_fail(context, QMAT_ERROR_FORMAT, "this is not a serialised value: %s", what);
  return qmat_fail_element(context, "byte", (int64_t)from->used);
}

/* The next `size` bytes, or NULL when fewer are left. */
static const uint8_t *take(reader *from, uint64_t size) {
  if (size > from->size - from->used) return NULL;
  const uint8_t *bytes = from->bytes + from->used;
  from->used += (size_t)size;
  return bytes;
}

/* The next number of `size` bytes; false when fewer are left. */
static bool take_number(reader *from, size_t size, uint64_t *number) {
  const uint8_t *bytes = take(from, size);
  if (bytes) *number = decode(bytes, size);
  return bytes != NULL;
}

/* Whether the next text is `wanted`. */
static bool take_word(reader *from, const char *wanted) {
  const size_t length = strlen(wanted);
  uint64_t size;
  if (!take_number(from, 4, &size) || size != length) return false;
  const uint8_t *bytes = take(from, size);
  return bytes != NULL && memcmp(bytes, wanted, length) == 0;
}

/* A copy of the next `size` bytes as a string. */
static qmat_status take_string(qmat_context *context, reader *from, uint64_t size, char **text) {
  const uint8_t *bytes = take(from, size);
  if (!bytes) return fail_form(context, from, "a text runs past the end");
  if (memchr(bytes, '\0', (size_t)size) != NULL) return fail_form(context, from, "a text holds a zero byte");
  char *copy = qmat_alloc((size_t)size + 1, 1);
  if (!copy) return qmat_fail_memory(context, "a text");
  memcpy(copy, bytes, (size_t)size);
  copy[size] = '\0';
  *text = copy;
  return QMAT_OK;
}

/* Whether an earlier row has set the count that `row` uses. */
static bool shares_count(const qmat_value_row *rows, const qmat_value_row *row) {
  for (const qmat_value_row *earlier = rows; earlier < row; earlier++) {
    if (qmat_row_is_array(earlier) && earlier->count_offset == row->count_offset) return true;
  }
  return false;
}

static void *mutable_slot(qmat_value *value, size_t offset) {
  return (char *)value + offset;
}

static void set_pointer(qmat_value *value, const qmat_value_row *row, void *pointer) {
  memcpy(mutable_slot(value, row->offset), &pointer, sizeof pointer);
}

static qmat_status read_array(qmat_context *context, reader *from, qmat_value *value, const qmat_value_row *row) {
  const size_t stride = qmat_row_element_size(row) * row->components;
  size_t *count = mutable_slot(value, row->count_offset);
  const size_t size = from->size;
  if (size % stride != 0) return fail_form(context, from, "an array ends within an element");
  if (shares_count(qmat_value_rows(value), row) && *count != size / stride)
    return fail_form(context, from, "two arrays that share a count differ in length");
  if (size == 0) return QMAT_OK;
  void *array = qmat_alloc(size / stride, stride);
  if (!array) return qmat_fail_memory(context, row->name);
  set_pointer(value, row, array);
  *count = size / stride;
  const uint8_t *bytes = take(from, size);
  const size_t length = *count * row->components;
  if (row->kind == QMAT_ROW_U32) {
    for (size_t i = 0; i < length; i++) ((uint32_t *)array)[i] = (uint32_t)decode(bytes + 4 * i, 4);
  } else {
    for (size_t i = 0; i < length; i++) {
      const uint64_t bits = decode(bytes + 8 * i, 8);
      memcpy((double *)array + i, &bits, sizeof bits);
    }
  }
  return QMAT_OK;
}

static qmat_status read_parts(qmat_context *context, reader *from, qmat_value *value, const qmat_value_row *row) {
  uint64_t count;
  size_t *part_count = mutable_slot(value, row->count_offset);
  enum { LEAST_BYTES = 12 }; /* a part has at least its two sizes */
  if (!take_number(from, 8, &count) || count > (from->size - from->used) / LEAST_BYTES)
    return fail_form(context, from, "there are fewer parts than it states");
  if (count == 0) return QMAT_OK;
  qmat_file_part *parts = qmat_calloc((size_t)count, sizeof *parts);
  if (!parts) return qmat_fail_memory(context, "the parts of a file");
  set_pointer(value, row, parts);
  *part_count = (size_t)count;
  for (size_t i = 0; i < count; i++) {
    uint64_t name_size, size;
    if (!take_number(from, 4, &name_size)) return fail_form(context, from, "a part's name is missing");
    const qmat_status status = take_string(context, from, name_size, &parts[i].name);
    if (status != QMAT_OK) return status;
    const uint8_t *bytes = take_number(from, 8, &size) ? take(from, size) : NULL;
    if (!bytes) return fail_form(context, from, "a part runs past the end");
    parts[i].bytes = qmat_alloc((size_t)size, 1);
    if (!parts[i].bytes) return qmat_fail_memory(context, "the bytes of a file");
    parts[i].size = (size_t)size;
    if (size > 0) memcpy(parts[i].bytes, bytes, (size_t)size);
  }
  return QMAT_OK;
}

static qmat_status read_items(qmat_context *context, reader *from, qmat_value *value, const qmat_value_row *row) {
  qmat_digest digest;
  const size_t count = from->size / (8 + sizeof digest.bytes);
  if (from->size % (8 + sizeof digest.bytes) != 0) return fail_form(context, from, "an item is cut short");
  qmat_value **items = qmat_calloc(count, sizeof *items);
  if (!items) return qmat_fail_memory(context, "the items of a list");
  set_pointer(value, row, items);
  *(size_t *)mutable_slot(value, row->count_offset) = count;
  for (size_t i = 0; i < count; i++) {
    uint64_t size = 0;
    take_number(from, 8, &size);
    memcpy(digest.bytes, take(from, sizeof digest.bytes), sizeof digest.bytes);
    items[i] = from->items != NULL ? from->items->find(from->items->user, &digest, size) : NULL;
    if (!items[i]) return fail_form(context, from, "an item of the list is missing");
  }
  return QMAT_OK;
}

/* The number of texts up to the end; the last one may be cut short. */
static size_t count_texts(reader from) {
  size_t count = 0;
  for (uint64_t size; take_number(&from, 4, &size); count++) take(&from, size);
  return count;
}

static qmat_status read_names(qmat_context *context, reader *from, qmat_value *value, const qmat_value_row *row) {
  const size_t count = count_texts(*from);
  size_t *shared = mutable_slot(value, row->count_offset);
  if (shares_count(qmat_value_rows(value), row) && *shared != count)
    return fail_form(context, from, "there are not as many names as items");
  if (count == 0) return QMAT_OK;
  char **names = qmat_calloc(count, sizeof *names);
  if (!names) return qmat_fail_memory(context, "the names of a list");
  set_pointer(value, row, names);
  *shared = count;
  for (size_t i = 0; i < count; i++) {
    uint64_t size;
    if (!take_number(from, 4, &size)) return fail_form(context, from, "a name is cut short");
    const qmat_status status = take_string(context, from, size, &names[i]);
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status read_json(qmat_context *context, reader *from, qmat_value *value, const qmat_value_row *row) {
  json_error_t error;
  const uint8_t *bytes = take(from, from->size);
  json_t *root = json_loadb((const char *)bytes, from->size, JSON_REJECT_DUPLICATES | JSON_ALLOW_NUL, &error);
  if (!json_is_object(root)) {
    json_decref(root);
    return fail_form(context, from, "a report is not a JSON object");
  }
  json_decref(qmat_row_pointer(value, row));
  set_pointer(value, row, root);
  return QMAT_OK;
}

/* `from` holds exactly the content of the row. */
static qmat_status read_content(qmat_context *context, reader *from, qmat_value *value, const qmat_value_row *row) {
  uint64_t number;
  uint32_t small;
  switch (row->kind) {
    case QMAT_ROW_U32:
    case QMAT_ROW_F64:
      return read_array(context, from, value, row);
    case QMAT_ROW_TEXT:
      return take_string(context, from, from->size, mutable_slot(value, row->offset));
    case QMAT_ROW_JSON:
      return read_json(context, from, value, row);
    case QMAT_ROW_PARTS:
      return read_parts(context, from, value, row);
    case QMAT_ROW_ITEMS:
      return read_items(context, from, value, row);
    case QMAT_ROW_NAMES:
      return read_names(context, from, value, row);
    case QMAT_ROW_BOOL:
      if (!take_number(from, 1, &number) || number > 1) return fail_form(context, from, "a flag is neither 0 nor 1");
      *(bool *)mutable_slot(value, row->offset) = number == 1;
      return QMAT_OK;
    case QMAT_ROW_ENUM:
      if (!take_number(from, 4, &number)) return fail_form(context, from, "an enumerator is cut short");
      small = (uint32_t)number;
      memcpy(mutable_slot(value, row->offset), &small, sizeof small);
      return QMAT_OK;
    case QMAT_ROW_SIZE:
      if (!take_number(from, 8, &number) || number > SIZE_MAX) return fail_form(context, from, "a count is cut short");
      *(size_t *)mutable_slot(value, row->offset) = (size_t)number;
      return QMAT_OK;
    case QMAT_ROW_NUMBER:
      if (!take_number(from, 8, &number)) return fail_form(context, from, "a number is cut short");
      memcpy(mutable_slot(value, row->offset), &number, sizeof number);
      return QMAT_OK;
  }
  return fail_form(context, from, "a row has an unknown kind");
}

static qmat_status read_rows(qmat_context *context, reader *from, qmat_value *value) {
  for (const qmat_value_row *row = qmat_value_rows(value); row->name != NULL; row++) {
    if (!take_word(from, row->name)) return fail_form(context, from, "a row is missing");
    const uint8_t *kind = take(from, 1);
    if (!kind || *kind != (uint8_t)row->kind) return fail_form(context, from, "a row has the wrong kind");
    uint64_t size;
    const uint8_t *bytes = take_number(from, 8, &size) ? take(from, size) : NULL;
    if (!bytes) return fail_form(context, from, "a row runs past the end");
    reader content = {bytes, (size_t)size, 0, from->items};
    const qmat_status status = read_content(context, &content, value, row);
    if (status != QMAT_OK) {
      if (status == QMAT_ERROR_FORMAT)
        qmat_fail_element(context, "byte", (int64_t)(from->used - content.size + content.used));
      return qmat_fail_field(context, row->name);
    }
    if (content.used != content.size) return fail_form(context, from, "a row is longer than its content");
  }
  if (from->used != from->size) return fail_form(context, from, "bytes follow the last row");
  return QMAT_OK;
}

qmat_status qmat_value_deserialize(qmat_context *context, const uint8_t *bytes, size_t size,
                                   const qmat_value_source *items, qmat_value **value) {
  *value = NULL;
  reader from = {bytes, size, 0, items};
  const uint8_t *magic = take(&from, sizeof MAGIC);
  uint64_t version;
  if (!magic || memcmp(magic, MAGIC, sizeof MAGIC) != 0)
    return fail_form(context, &from, "it does not start with QMAT");
  if (!take_number(&from, 4, &version)) return fail_form(context, &from, "its version is missing");
  if (version != FORM_VERSION) {
    return qmat_fail(context, QMAT_ERROR_FORMAT, "the serialised form has version %u; this qmat reads version %d",
                     (unsigned)version, FORM_VERSION);
  }
  const size_t name_start = from.used;
  int type = 0;
  while (type < QMAT_VALUE_TYPE_COUNT && !take_word(&from, qmat_value_layouts[type].name)) {
    from.used = name_start;
    type++;
  }
  if (type == QMAT_VALUE_TYPE_COUNT) return fail_form(context, &from, "its type is unknown");

  qmat_value *made = qmat_value_new((qmat_value_type)type);
  if (!made) return qmat_fail_memory(context, "a value");
  qmat_status status = read_rows(context, &from, made);
  if (status == QMAT_OK) {
    status = qmat_value_seal(context, made);
    /* The bytes are wrong, not a node or a model. */
    if (status == QMAT_ERROR_GEOMETRY || status == QMAT_ERROR_INTERNAL)
      status = context->error.status = QMAT_ERROR_FORMAT;
  }
  if (status != QMAT_OK) {
    qmat_value_release(made);
    return status;
  }
  *value = made;
  return QMAT_OK;
}
