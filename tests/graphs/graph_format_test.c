/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "graphs/graph_format.h"
#include "graphs/yaml_tree.h"
#include "tests/random.h"

/* The layout of a text, as a new text to be freed; NULL: it was refused. */
static char *layout(qmat_context *context, const char *text) {
  qmat_writer made;
  const qmat_status status = qmat_graph_format(context, "mine.yaml", text, strlen(text), &made);
  if (status != QMAT_OK) {
    assert_int_equal(status, QMAT_ERROR_USAGE);
    assert_null(made.bytes);
    return NULL;
  }
  qmat_put_u8(&made, 0);
  assert_false(made.failed);
  return (char *)made.bytes;
}

static void expect_layout(const char *text, const char *expected) {
  qmat_context context = {0};
  char *made = layout(&context, text);
  assert_non_null(made);
  assert_string_equal(made, expected);
  char *again = layout(&context, made);
  assert_non_null(again);
  assert_string_equal(again, expected);
  qmat_free(made);
  qmat_free(again);
  qmat_context_uninit(&context);
}

static void test_indentation_blanks_and_empty_lines(void **state) {
  (void)state;
  expect_layout("\n\nqmat:   1  \r\n\n\n\nnodes:\n     a:   {type:   scene.read,params: {path: x}}\n",
                "qmat: 1\n\nnodes:\n  a: { type: scene.read, params: { path: x } }\n");
  expect_layout("nodes:\n\n  a:\n   type: x\n\n\n\noutputs: {}\n", "nodes:\n  a:\n    type: x\n\noutputs: {}\n");
  expect_layout("%YAML 1.1\n---\nqmat: 1\n...\n", "qmat: 1\n");
  expect_layout("\xef\xbb\xbfqmat: 1", "qmat: 1\n");
  expect_layout("? a\n: b\nc:\n  d\n", "a: b\nc: d\n");
}

static void test_comments_stay_with_what_they_are_about(void **state) {
  (void)state;
  expect_layout("# top\na: 1 # one\nlong: 2      # two\n             # goes on\n\nb: 3 # three\n",
                "# top\na: 1     # one\nlong: 2  # two\n         # goes on\n\nb: 3  # three\n");
  /* A comment at the end of a mapping is of the mapping in whose column it stands. */
  expect_layout("n:\n    a:\n        t: 1\n        # in a\n    # in n\n# in none\nb: 2\n",
                "n:\n  a:\n    t: 1\n    # in a\n  # in n\n# in none\nb: 2\n");
  expect_layout("a: # of a\n  # of b\n   b: 1\n#end", "a:  # of a\n  # of b\n  b: 1\n#end\n");
  expect_layout("a:  # of a\n     { b: c }\n", "a:  # of a\n  { b: c }\n");
  expect_layout("a: \"# text\" # comment\n", "a: \"# text\"  # comment\n");
}

static void test_braces_open_where_they_must(void **state) {
  (void)state;
  expect_layout("a: { b: c, # of b\n d: e }\n", "a:\n  b: c  # of b\n  d: e\n");
  expect_layout("a: {\n b: c, d: {e: f,\n  g: h} }\n", "a:\n  b: c\n  d: { e: f, g: h }\n");
  expect_layout("a: {b, c: , d: ~,}\n", "a: { b, c: , d: ~ }\n");
  expect_layout("a: { # nothing\n }\n", "a: {}  # nothing\n");
  /* JSON stays JSON. */
  expect_layout("{\"a\":1,\"b\":{\"c\":{}}}", "{ \"a\": 1, \"b\": { \"c\": {} } }\n");
  expect_layout("{\n\"a\":1,\"b\":{\n\"c\":{}}}", "{\n  \"a\": 1,\n  \"b\": {\n    \"c\": {}\n  }\n}\n");
}

/* A mapping of exactly 120 columns stays on its line; one more column and it takes a line each. */
static void test_the_width_decides(void **state) {
  (void)state;
  for (int extra = 0; extra < 3; extra++) {
    char value[128], text[256], expected[256];
    memset(value, 'x', sizeof value);
    value[120 - (int)strlen("a: { b: , c: d }") + extra] = 0;
    snprintf(text, sizeof text, "a: {b: %s, c: d}\n", value);
    /* On a line of its own it is one column shorter. */
    snprintf(expected, sizeof expected, extra == 0 ? "a: { b: %s, c: d }\n" : "a:\n  { b: %s, c: d }\n", value);
    if (extra == 2) snprintf(expected, sizeof expected, "a:\n  b: %s\n  c: d\n", value);
    expect_layout(text, expected);
  }
}

static void test_values_of_several_lines(void **state) {
  (void)state;
  expect_layout("a:\n    t: |\n\n        one\n          two\n\n\n    e: 1\n",
                "a:\n  t: |\n\n    one\n      two\n\n  e: 1\n");
  expect_layout("a: \"one\n         two\"\nb: x\n    y\n", "a: \"one\n  two\"\nb: x\n  y\n");
}

static void test_what_is_no_graph_is_refused_with_its_place(void **state) {
  (void)state;
  qmat_context context = {0};
  assert_null(layout(&context, "a: [1]\n"));
  assert_int_equal(context.error.line, 1);
  assert_int_equal(context.error.column, 4);
  assert_null(layout(&context, ""));
  assert_null(layout(&context, "OFF\n3 1 0\n0 0 0\n"));
  assert_null(layout(&context, "a: {\n"));
  assert_null(layout(&context, "a: 1\na: 2\n"));
  qmat_context_uninit(&context);
}

static bool same(const qmat_tree *a, const qmat_tree *b) {
  if (a->is_mapping != b->is_mapping) return false;
  if (!a->is_mapping) return strcmp(a->text, b->text) == 0 && a->empty == b->empty;
  const qmat_tree_entry *x = a->entries, *y = b->entries;
  for (; x && y; x = x->next, y = y->next)
    if (strcmp(x->key, y->key) != 0 || !same(x->value, y->value)) return false;
  return !x && !y;
}

static const qmat_tree *tree_of(qmat_arena *arena, const char *text) {
  qmat_context context = {0};
  const qmat_tree *tree;
  if (qmat_tree_read(&context, arena, "mine.yaml", text, strlen(text), &tree) != QMAT_OK) tree = NULL;
  qmat_context_uninit(&context);
  return tree;
}

static size_t count_of(const char *text, const char *part) {
  size_t count = 0;
  for (; (text = strstr(text, part)); text++) count++;
  return count;
}

/* Appends a mapping of random layout; in a mapping without braces its entries start at column `indent`. */
static void put_mapping(random_numbers *random, char *text, int depth, int indent, bool flow, int *serial) {
  const int count = 1 + (int)(random_index(random, 3));
  for (int i = 0; i < count; i++) {
    char *end = text + strlen(text);
    if (!flow) {
      if (random_index(random, 4) == 0) end += sprintf(end, "\n\n");
      if (random_index(random, 4) == 0)
        end += sprintf(end, "%*s#! %d\n", (int)random_index(random, 9), "", (*serial)++);
      end += sprintf(end, "%*s", indent, "");
    }
    end += sprintf(end, "k%d:%*s", (*serial)++, 1 + (int)random_index(random, 3), "");
    const size_t kind = random_index(random, depth > 3 ? 2 : 4);
    if (kind == 0) sprintf(end, "v%d", (*serial)++);
    if (kind == 1) sprintf(end, "\"q # %d\"", (*serial)++);
    if (kind == 2 || (kind == 3 && flow)) {
      strcat(end, random_index(random, 3) == 0 ? "{ #! x\n   " : "{");
      put_mapping(random, text, depth + 1, 0, true, serial);
      strcat(text, random_index(random, 3) == 0 ? "\n      }" : " }");
    } else if (kind == 3) {
      strcat(text, "\n");
      put_mapping(random, text, depth + 1, indent + 1 + (int)random_index(random, 5), false, serial);
      continue;
    }
    if (flow && i + 1 < count) strcat(text, random_index(random, 3) == 0 ? ", #! y\n     " : ",");
    if (!flow) strcat(text, random_index(random, 3) == 0 ? "   #! z  \n" : "\n");
  }
}

/* Random documents come back with all values and comments, and are laid out once and for all. */
static void test_nothing_is_lost(void **state) {
  (void)state;
  static char text[1 << 16];
  random_numbers random = {.seed = 15};
  for (int round = 0; round < 2000; round++) {
    qmat_context context = {0};
    qmat_arena arena = {0};
    int serial = 0;
    *text = 0;
    put_mapping(&random, text, 0, (int)random_index(&random, 3), false, &serial);
    const qmat_tree *before = tree_of(&arena, text);
    assert_non_null(before);
    char *made = layout(&context, text);
    if (!made) fail_msg("refused:\n%s", text);
    const qmat_tree *after = tree_of(&arena, made);
    assert_non_null(after);
    assert_true(same(before, after));
    assert_int_equal(count_of(text, "#!"), count_of(made, "#!"));
    assert_null(strstr(made, " \n"));
    assert_null(strstr(made, "\n\n\n"));
    char *again = layout(&context, made);
    assert_non_null(again);
    assert_string_equal(again, made);
    qmat_free(made);
    qmat_free(again);
    qmat_arena_uninit(&arena);
    qmat_context_uninit(&context);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_indentation_blanks_and_empty_lines),
      cmocka_unit_test(test_comments_stay_with_what_they_are_about),
      cmocka_unit_test(test_braces_open_where_they_must),
      cmocka_unit_test(test_the_width_decides),
      cmocka_unit_test(test_values_of_several_lines),
      cmocka_unit_test(test_what_is_no_graph_is_refused_with_its_place),
      cmocka_unit_test(test_nothing_is_lost),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
