/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/node.h"
#include "io/mesh/mesh_formats.h"
#include "io/scanner.h"

typedef enum scalar { I8, U8, I16, U16, I32, U32, F32, F64, NO_SCALAR } scalar;

static const size_t scalar_sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};

/* The properties that are read. */
typedef enum role { OTHER, X, Y, Z, CORNERS } role;

typedef struct property {
  scalar type;    /* of the number, or of each item of a list */
  scalar counter; /* of the length of a list; NO_SCALAR: not a list */
  role role;
} property;

typedef enum element_kind { ELSE, VERTEX, FACE, STRIPS } element_kind;

typedef struct element {
  char name[32]; /* for errors */
  int line;      /* of the header */
  element_kind kind;
  uint64_t count;
  size_t first_property, property_count;
  bool has_list;
} element;

typedef struct ply {
  qmat_context *context;
  const char *path;
  qmat_soup *soup;
  qmat_scanner scanner;    /* the header, and the body of ASCII files */
  qmat_byte_reader reader; /* the body of binary files */
  bool ascii;
  element *elements;
  size_t element_count, element_capacity;
  property *properties;
  size_t property_count, property_capacity;
  uint32_t *corners;
  size_t corner_capacity;
  uint32_t facets_read;
} ply;

/* ---- header ---- */

/* QMAT_ERROR_FORMAT "expected WHAT, found TOKEN" for a token of the line that is being scanned. */
static qmat_status expected(ply *p, const char *token, const char *what) {
  p->scanner.at = token;
  return qmat_scan_expected(&p->scanner, what);
}

static scalar scalar_named(const char *token, size_t length) {
  static const struct {
    const char *name;
    scalar type;
  } names[] = {{"char", I8},    {"int8", I8},     {"uchar", U8},   {"uint8", U8},   {"short", I16}, {"int16", I16},
               {"ushort", U16}, {"uint16", U16},  {"int", I32},    {"int32", I32},  {"uint", U32},  {"uint32", U32},
               {"float", F32},  {"float32", F32}, {"double", F64}, {"float64", F64}};
  for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
    if (qmat_is_word(token, length, names[i].name)) return names[i].type;
  }
  return NO_SCALAR;
}

static qmat_status read_format(ply *p) {
  size_t length;
  const char *token = qmat_scan_token_on_line(&p->scanner, &length);
  p->ascii = qmat_is_word(token, length, "ascii");
  p->reader.big_endian = qmat_is_word(token, length, "binary_big_endian");
  if (!p->ascii && !p->reader.big_endian && !qmat_is_word(token, length, "binary_little_endian"))
    return expected(p, token, "ascii, binary_little_endian or binary_big_endian");
  token = qmat_scan_token_on_line(&p->scanner, &length);
  if (!qmat_is_word(token, length, "1.0")) return expected(p, token, "version 1.0");
  return QMAT_OK;
}

static qmat_status read_element(ply *p) {
  size_t length;
  const char *token = qmat_scan_token_on_line(&p->scanner, &length);
  if (length == 0) return expected(p, token, "the name of an element");
  if (qmat_grow((void **)&p->elements, &p->element_capacity, p->element_count + 1, sizeof *p->elements) != 0)
    return qmat_fail_memory(p->context, "the header");
  element *e = &p->elements[p->element_count];
  *e = (element){.first_property = p->property_count, .line = p->scanner.line};
  for (size_t i = 0; i < length && i < sizeof e->name - 1; i++)
    e->name[i] = token[i] >= ' ' && token[i] <= '~' ? token[i] : '?';
  if (qmat_is_word(token, length, "vertex")) e->kind = VERTEX;
  if (qmat_is_word(token, length, "face")) e->kind = FACE;
  if (qmat_is_word(token, length, "tristrips")) e->kind = STRIPS;
  for (size_t i = 0; e->kind != ELSE && i < p->element_count; i++) {
    if (p->elements[i].kind == e->kind) return qmat_scan_fail(&p->scanner, "duplicate element '%s'", e->name);
  }
  int64_t count = 0;
  if (!qmat_scan_find_on_line(&p->scanner)) return qmat_scan_expected(&p->scanner, "the count of an element");
  qmat_status status = qmat_scan_integer(&p->scanner, "the count of an element", 0, UINT32_MAX, &count);
  if (status != QMAT_OK) return status;
  e->count = (uint64_t)count;
  p->element_count++;
  return QMAT_OK;
}

static qmat_status read_property(ply *p) {
  if (p->element_count == 0) return qmat_scan_fail(&p->scanner, "a property must follow an element");
  element *e = &p->elements[p->element_count - 1];
  property property = {.counter = NO_SCALAR};
  size_t length;
  const char *token = qmat_scan_token_on_line(&p->scanner, &length);
  bool list = qmat_is_word(token, length, "list");
  if (list) {
    token = qmat_scan_token_on_line(&p->scanner, &length);
    property.counter = scalar_named(token, length);
    if (property.counter >= F32) return expected(p, token, "an integer type");
    token = qmat_scan_token_on_line(&p->scanner, &length);
  }
  property.type = scalar_named(token, length);
  if (property.type == NO_SCALAR) return expected(p, token, "a type");
  token = qmat_scan_token_on_line(&p->scanner, &length);
  if (length == 0) return expected(p, token, "the name of a property");
  if (e->kind == VERTEX && !list && length == 1 && token[0] >= 'x' && token[0] <= 'z')
    property.role = (role)(X + (token[0] - 'x'));
  if ((e->kind == FACE || e->kind == STRIPS) && list &&
      (qmat_is_word(token, length, "vertex_indices") || qmat_is_word(token, length, "vertex_index"))) {
    property.role = CORNERS;
  }
  for (size_t i = e->first_property; property.role != OTHER && i < p->property_count; i++) {
    if (p->properties[i].role == property.role)
      return qmat_scan_fail(&p->scanner, "duplicate property '%.*s'", (int)length, token);
  }
  if (qmat_grow((void **)&p->properties, &p->property_capacity, p->property_count + 1, sizeof *p->properties) != 0)
    return qmat_fail_memory(p->context, "the header");
  p->properties[p->property_count++] = property;
  e->property_count++;
  e->has_list = e->has_list || list;
  return QMAT_OK;
}

static bool has_role(const ply *p, const element *e, role role) {
  for (size_t i = 0; i < e->property_count; i++) {
    if (p->properties[e->first_property + i].role == role) return true;
  }
  return false;
}

/* The fewest bytes that one element takes in the body. */
static uint64_t least_size(const ply *p, const element *e) {
  uint64_t size = 0;
  for (size_t i = 0; i < e->property_count; i++) {
    const property *q = &p->properties[e->first_property + i];
    size += p->ascii ? 2 : scalar_sizes[q->counter == NO_SCALAR ? q->type : q->counter];
  }
  return size;
}

static qmat_status fail_element(ply *p, const element *e, const char *complaint) {
  qmat_fail(p->context, QMAT_ERROR_FORMAT, "element '%s' %s", e->name, complaint);
  return qmat_fail_at(p->context, p->path, e->line, 0);
}

/* Checks that the elements that the header counts fit into the `left` bytes of the body, and that they can be read. */
static qmat_status check_header(ply *p, uint64_t left) {
  bool vertices = false, facets = false;
  left += p->ascii ? 1 : 0; /* the last number may lack its blank */
  for (size_t i = 0; i < p->element_count; i++) {
    const element *e = &p->elements[i];
    const uint64_t size = least_size(p, e);
    if (size > 0 && e->count > left / size) return fail_element(p, e, "has a count that the file cannot hold");
    left -= size * e->count;
    for (int k = X; e->kind == VERTEX && k <= Z; k++) {
      if (!has_role(p, e, (role)k)) return fail_element(p, e, "lacks one of the properties x, y and z");
    }
    if ((e->kind == FACE || e->kind == STRIPS) && !has_role(p, e, CORNERS))
      return fail_element(p, e, "lacks the list property vertex_indices");
    vertices = vertices || e->kind == VERTEX;
    facets = facets || e->kind == FACE || e->kind == STRIPS;
  }
  if (!vertices) return qmat_fail_file(p->context, QMAT_ERROR_FORMAT, p->path, "the file has no element 'vertex'");
  if (!facets) return qmat_fail_file(p->context, QMAT_ERROR_FORMAT, p->path, "the file has no element 'face'");
  return QMAT_OK;
}

static qmat_status read_header(ply *p, const qmat_bytes *bytes) {
  qmat_scanner *scanner = &p->scanner;
  size_t length;
  bool format = false;
  const char *token = qmat_scan_token_on_line(scanner, &length);
  if (!qmat_is_word(token, length, "ply")) {
    scanner->at = token;
    return qmat_scan_expected(scanner, "'ply'");
  }
  qmat_scan_find_on_line(scanner);
  /* If lines end in a lone carriage return, a line feed after the header is data. */
  const bool lone_returns = scanner->at < scanner->end && *scanner->at == '\r' && scanner->at[1] != '\n';
  for (;;) {
    if (!qmat_scan_next_line(scanner)) return qmat_scan_expected(scanner, "'end_header'");
    if (!qmat_scan_find_on_line(scanner)) continue;
    const qmat_scanner line = *scanner;
    qmat_status status = QMAT_OK;
    token = qmat_scan_token_on_line(scanner, &length);
    if (qmat_is_word(token, length, "format")) {
      status = read_format(p);
      format = true;
    } else if (qmat_is_word(token, length, "element")) {
      status = read_element(p);
    } else if (qmat_is_word(token, length, "property")) {
      status = read_property(p);
    } else if (qmat_is_word(token, length, "end_header")) {
      break;
    } else if (!qmat_is_word(token, length, "comment") && !qmat_is_word(token, length, "obj_info")) {
      return qmat_scan_expected(&line, "a keyword of a PLY header");
    }
    if (status != QMAT_OK) return status;
  }
  if (!format) return qmat_scan_fail(scanner, "the header has no line 'format'");
  if (qmat_scan_find_on_line(scanner)) return qmat_scan_expected(scanner, "the end of the line");
  const char *at = scanner->at;
  if (at < scanner->end && *at == '\r') at++;
  if (at < scanner->end && *at == '\n' && !(lone_returns && at > scanner->at)) at++;
  p->reader.bytes = bytes->data;
  p->reader.size = bytes->size;
  p->reader.at = (size_t)(at - (const char *)bytes->data);
  return check_header(p, qmat_bytes_left(&p->reader));
}

/* ---- body ---- */

static double take_scalar(qmat_byte_reader *reader, scalar type) {
  switch (type) {
    case I8:
      return (int8_t)qmat_take_u8(reader);
    case U8:
      return qmat_take_u8(reader);
    case I16:
      return (int16_t)qmat_take_u16(reader);
    case U16:
      return qmat_take_u16(reader);
    case I32:
      return (int32_t)qmat_take_u32(reader);
    case U32:
      return qmat_take_u32(reader);
    case F32:
      return (double)qmat_take_f32(reader);
    default:
      return qmat_take_f64(reader);
  }
}

static qmat_status fail_body(ply *p, const element *e, uint64_t index, const char *message) {
  if (p->ascii) {
    qmat_scan_fail(&p->scanner, "%s", message);
  } else {
    qmat_fail_file(p->context, QMAT_ERROR_FORMAT, p->path, "%s", message);
  }
  return qmat_fail_element(p->context, e->name, (int64_t)index);
}

static qmat_status next_scalar(ply *p, scalar type, const char *what, double *number) {
  if (p->ascii) return qmat_scan_number(&p->scanner, what, number);
  *number = take_scalar(&p->reader, type);
  return QMAT_OK;
}

static qmat_status add_facet(ply *p, const uint32_t *corners, size_t count, int line) {
  return qmat_soup_add_facet(p->context, p->soup, corners, count, p->facets_read++, line);
}

/* Adds a triangle for every three consecutive corners, every second one reversed. -1 starts a new strip. Triangles with
 * a repeated vertex only connect parts of a strip and are skipped. */
static qmat_status add_strips(ply *p, size_t count, int line) {
  size_t start = 0;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    if (p->corners[i] == UINT32_MAX) start = i + 1;
    if (i < start + 2) continue;
    const uint32_t *c = &p->corners[i - 2];
    if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) {
      const bool turned = (i - start) % 2 != 0;
      const uint32_t triangle[3] = {c[turned], c[!turned], c[2]};
      status = add_facet(p, triangle, 3, line);
    }
  }
  return status;
}

static qmat_status read_list(ply *p, const element *e, uint64_t index, const property *q) {
  double number = 0;
  qmat_status status = next_scalar(p, q->counter, "the length of a list", &number);
  if (status != QMAT_OK) return qmat_fail_element(p->context, e->name, (int64_t)index);
  const int line = p->ascii ? p->scanner.line : 0;
  const size_t size = p->ascii ? 2 : scalar_sizes[q->type];
  const size_t left = p->ascii ? qmat_scan_left(&p->scanner) : qmat_bytes_left(&p->reader);
  if (p->reader.failed) return fail_body(p, e, index, "the file ends within the element");
  if (!(number >= 0) || number != floor(number)) return fail_body(p, e, index, "the length of a list is not a count");
  if (number > (double)(left / size)) return fail_body(p, e, index, "a list is longer than the rest of the file");
  const size_t count = (size_t)number;
  if (q->role != CORNERS) {
    if (!p->ascii) qmat_take_bytes(&p->reader, count * size);
    for (size_t i = 0; p->ascii && i < count && status == QMAT_OK; i++)
      status = qmat_scan_number(&p->scanner, "an item of a list", &number);
    return status == QMAT_OK ? status : qmat_fail_element(p->context, e->name, (int64_t)index);
  }

  if (qmat_grow((void **)&p->corners, &p->corner_capacity, count, sizeof *p->corners) != 0)
    return qmat_fail_memory(p->context, "the corners of a facet");
  for (size_t i = 0; i < count; i++) {
    status = next_scalar(p, q->type, "a vertex index", &number);
    if (status != QMAT_OK) return qmat_fail_element(p->context, e->name, (int64_t)index);
    const bool restart = e->kind == STRIPS && number == -1;
    if (!restart && (!(number >= 0 && number < (double)UINT32_MAX) || number != floor(number))) {
      char message[80], text[32];
      qmat_format_number(number, text, sizeof text);
      snprintf(message, sizeof message, "a vertex index is %s", text);
      return fail_body(p, e, index, message);
    }
    p->corners[i] = restart ? UINT32_MAX : (uint32_t)number;
  }
  return e->kind == STRIPS ? add_strips(p, count, line) : add_facet(p, p->corners, count, line);
}

static qmat_status read_one(ply *p, const element *e, uint64_t index) {
  double point[3] = {0, 0, 0}, number;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < e->property_count && status == QMAT_OK; i++) {
    const property *q = &p->properties[e->first_property + i];
    if (q->counter != NO_SCALAR) {
      status = read_list(p, e, index, q);
    } else {
      status = next_scalar(p, q->type, q->role == OTHER ? "a property" : "a coordinate of a vertex", &number);
      if (status != QMAT_OK) return qmat_fail_element(p->context, e->name, (int64_t)index);
      if (q->role >= X && q->role <= Z) point[q->role - X] = number;
    }
  }
  if (status != QMAT_OK) return status;
  if (p->reader.failed) return fail_body(p, e, index, "the file ends within the element");
  return e->kind == VERTEX ? qmat_soup_add_vertices(p->context, p->soup, point, 1) : QMAT_OK;
}

static qmat_status read_body(ply *p) {
  for (size_t i = 0; i < p->element_count; i++) {
    const element *e = &p->elements[i];
    const uint64_t size = least_size(p, e);
    if (e->kind == ELSE && (size == 0 || (!p->ascii && !e->has_list))) {
      if (!qmat_take_bytes(&p->reader, (size_t)(size * e->count)))
        return fail_body(p, e, 0, "the file ends within the elements");
      continue;
    }
    /* Reserves for facets of 4 bytes or more: shorter ones have no valid corners. */
    const size_t left = p->ascii ? qmat_scan_left(&p->scanner) : qmat_bytes_left(&p->reader);
    const size_t facets = e->kind == FACE ? (e->count < left / 4 ? (size_t)e->count : left / 4) : 0;
    const size_t vertices = e->kind == VERTEX ? (size_t)e->count : 0;
    qmat_status status = qmat_soup_reserve(p->context, p->soup, vertices, facets, 3 * facets);
    for (uint64_t k = 0; k < e->count && status == QMAT_OK; k++) status = read_one(p, e, k);
    if (status != QMAT_OK) return status;
  }
  if (p->ascii) return qmat_scan_find(&p->scanner) ? qmat_scan_expected(&p->scanner, "the end of the file") : QMAT_OK;
  /* A line end or zero bytes may follow. Anything else means that the header is wrong. */
  while (qmat_bytes_left(&p->reader) > 0) {
    const uint8_t byte = qmat_take_u8(&p->reader);
    if (byte != 0 && byte != '\n' && byte != '\r')
      return qmat_fail_file(p->context, QMAT_ERROR_FORMAT, p->path, "the file continues after its last element");
  }
  return QMAT_OK;
}

qmat_status qmat_ply_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup) {
  ply p = {.context = context, .path = path, .soup = soup};
  qmat_scanner_init(&p.scanner, context, path, (const char *)bytes->data, bytes->size, 0);
  qmat_status status = read_header(&p, bytes);
  if (status == QMAT_OK) status = read_body(&p);
  qmat_free(p.corners);
  qmat_free(p.properties);
  qmat_free(p.elements);
  return status;
}
