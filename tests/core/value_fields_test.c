/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every field of a value's struct has a row in the table of types, and its content enters the digest. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/value.h"
#include "core/value_table.h"
#include "tests/core/value_examples.h"

static size_t size_in_struct(const qmat_value_row *row) {
  if (qmat_row_has_pointer(row)) return sizeof(void *);
  switch (row->kind) {
    case QMAT_ROW_BOOL:
      return sizeof(bool);
    case QMAT_ROW_ENUM:
      return sizeof(qmat_domain);
    case QMAT_ROW_SIZE:
      return sizeof(size_t);
    default:
      return sizeof(double);
  }
}

/* A word that no row and no count of a row touches is a field that would be lost: padding is shorter. */
static void test_every_field_has_a_row(void **state) {
  (void)state;
  if (sizeof(size_t) != sizeof(double)) skip();
  for (int type = 0; type < QMAT_VALUE_TYPE_COUNT; type++) {
    const qmat_value_layout *layout = &qmat_value_layouts[type];
    uint8_t *is_known = calloc(layout->size, 1);
    assert_non_null(is_known);
    memset(is_known, 1, sizeof(qmat_value));
    for (const qmat_value_row *row = layout->rows; row->name; row++) {
      memset(is_known + row->offset, 1, size_in_struct(row));
      if (qmat_row_is_array(row)) memset(is_known + row->count_offset, 1, sizeof(size_t));
    }
    for (size_t word = 0; word < layout->size; word += sizeof(size_t))
      if (!memchr(is_known + word, 1, sizeof(size_t)))
        fail_msg("what is at byte %zu of a %s has no row", word, layout->name);
    free(is_known);
  }
}

/* Changes place `place` of what a row holds in the way `way`. False beyond the last way. The value may then break a
 * rule of its type. */
enum { WAYS_OF_IDS = 9 };

static bool change_id(uint32_t *ids, size_t count, size_t place, size_t way) {
  const uint32_t id = ids[place];
  const uint32_t others[WAYS_OF_IDS - 1] = {id + 1, id - 1, id + 2, 0, 1, 2, 3, UINT32_MAX};
  if (way >= WAYS_OF_IDS) return false;
  if (way == 0) { /* their sum stays */
    ids[place]++;
    if (count > 1) ids[(place + 1) % count]--;
  } else {
    ids[place] = others[way - 1] == id ? id + 7 : others[way - 1];
  }
  return true;
}

static bool change_text(char **text, size_t way) {
  if (way > 0) return false;
  const size_t length = strlen(*text);
  char *longer = qmat_alloc(length + 2, 1);
  assert_non_null(longer);
  memcpy(longer, *text, length);
  memcpy(longer + length, "+", 2);
  qmat_free(*text);
  *text = longer;
  return true;
}

static bool change_part(qmat_file_part *part, size_t way) {
  if (way == 0) return change_text(&part->name, 0);
  if (part->size == 0) return false;
  if (way == 1) part->bytes[part->size - 1] ^= 1;
  if (way == 2) part->size--;
  return way < 3;
}

static bool change_item(qmat_value **item, size_t way) {
  qmat_context context = {0};
  if (way > 0) return false;
  qmat_field *other = field_example();
  other->values[0] = 77;
  assert_int_equal(qmat_value_seal(&context, &other->base), QMAT_OK);
  qmat_value_release(*item);
  *item = &other->base;
  return true;
}

static bool change(qmat_value *value, const qmat_value_row *row, size_t place, size_t way) {
  void *at = (char *)value + row->offset, *pointer = qmat_row_has_pointer(row) ? qmat_row_pointer(value, row) : NULL;
  const size_t count = qmat_row_is_array(row) ? row->components * qmat_row_count(value, row) : 1;
  if (place >= count) return false;
  switch (row->kind) {
    case QMAT_ROW_U32:
      return change_id(pointer, count, place, way);
    case QMAT_ROW_F64:
      ((double *)pointer)[place] = nextafter(((double *)pointer)[place], way == 0 ? HUGE_VAL : -HUGE_VAL);
      return way < 2;
    case QMAT_ROW_TEXT:
      return change_text(at, way);
    case QMAT_ROW_JSON:
      return way == 0 && json_object_set_new(pointer, "one more", json_integer(1)) == 0;
    case QMAT_ROW_BOOL:
      *(bool *)at = !*(bool *)at;
      return way == 0;
    case QMAT_ROW_ENUM:
      *(qmat_domain *)at = *(qmat_domain *)at == QMAT_PER_FACET ? QMAT_PER_VERTEX : QMAT_PER_FACET;
      return way == 0;
    case QMAT_ROW_SIZE:
      *(size_t *)at += way == 0 ? 1 : SIZE_MAX;
      return way < 2;
    case QMAT_ROW_PARTS:
      return change_part((qmat_file_part *)pointer + place, way);
    case QMAT_ROW_NUMBER:
      *(double *)at = nextafter(*(double *)at, way == 0 ? HUGE_VAL : -HUGE_VAL);
      return way < 2;
    case QMAT_ROW_ITEMS:
      return change_item((qmat_value **)pointer + place, way);
    case QMAT_ROW_NAMES:
      return change_text((char **)pointer + place, way);
  }
  return false;
}

static size_t places_of(const qmat_value *value, const qmat_value_row *row) {
  return qmat_row_is_array(row) ? row->components * qmat_row_count(value, row) : 1;
}

/* Changes each place of a row on its own, in a value that is like the example. Returns how many changes are valid. */
static size_t try_changes(int example, const qmat_digest *unchanged, const qmat_value_row *row, size_t places) {
  size_t valid = 0;
  for (size_t place = 0; place < places; place++) {
    for (size_t way = 0;; way++) {
      qmat_context context = {0};
      qmat_value *value = example_of(example);
      const bool is_changed = change(value, row, place, way);
      if (is_changed && qmat_value_seal(&context, value) == QMAT_OK) {
        valid++;
        if (qmat_digest_equal(&value->digest, unchanged))
          fail_msg("example %d: element %zu of %s is not in the digest (change %zu)", example, place, row->name, way);
      }
      qmat_value_release(value);
      qmat_context_uninit(&context);
      if (!is_changed) break;
    }
  }
  return valid;
}

static void test_every_field_moves_the_digest(void **state) {
  (void)state;
  enum { MOST_ROWS = 64 };
  size_t valid[QMAT_VALUE_TYPE_COUNT][MOST_ROWS] = {{0}};
  for (int example = 0; example < EXAMPLE_COUNT; example++) {
    qmat_context context = {0};
    qmat_value *value = example_of(example);
    assert_int_equal(qmat_value_seal(&context, value), QMAT_OK);
    const qmat_value_row *rows = qmat_value_rows(value);
    for (size_t r = 0; rows[r].name; r++) {
      assert_true(r < MOST_ROWS);
      valid[value->type][r] += try_changes(example, &value->digest, &rows[r], places_of(value, &rows[r]));
    }
    qmat_value_release(value);
    qmat_context_uninit(&context);
  }
  for (int type = 0; type < QMAT_VALUE_TYPE_COUNT; type++)
    for (size_t r = 0; qmat_value_layouts[type].rows[r].name; r++)
      if (valid[type][r] == 0)
        fail_msg("no example of a %s has its %s changed", qmat_value_layouts[type].name,
                 qmat_value_layouts[type].rows[r].name);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_every_field_has_a_row),
      cmocka_unit_test(test_every_field_moves_the_digest),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
