/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cache/cache.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <fcntl.h>
#include <math.h>
#include <stdatomic.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>

#include "graphs/cache/cache_key.h"
#include "graphs/cache/cache_size.h"
#include "graphs/run/why.h"
#include "io/bytes.h"
#include "nodes/nodes.h"
#include "tests/graphs/test_nodes.h"

/* ---- nodes whose runs are counted ---- */

static struct {
  atomic_int read, scale; /* values of a list are worked on at the same time */
  double drift;           // added by a node that breaks its promise
  const char *written;    // put into the file just before a node reads it; NULL: nothing
} ran;

static char library_text[64];

static void describe_library(char *text, size_t size) {
  snprintf(text, size, "%s", library_text);
}

static const qmat_library test_library = {.name = "Ruler", .describe = describe_library};
static const qmat_library *const test_libraries[] = {&test_library, NULL};

static void write_text(const char *path, const char *text) {
  FILE *file = fopen(path, "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(text, 1, strlen(text), file), strlen(text));
  fclose(file);
}

/* The bytes of a file, summed; one that starts with an exclamation mark refers to the file of the same path and
 * ".side", if that is there, which may refer to a further one in the same way. */
static qmat_status read_run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                            qmat_value *outputs[]) {
  (void)inputs;
  const char *path = ((const path_params *)data)->path;
  char side_path[256];
  qmat_bytes bytes = {0}, side = {0};
  double sum = 0;
  ran.read++;
  if (ran.written) write_text(path, ran.written);
  qmat_status status = qmat_bytes_read_file(context, path, &bytes);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < bytes.size; i++) sum += bytes.data[i];
  if (bytes.data[0] == '!') {
    snprintf(side_path, sizeof side_path, "%s.side", path);
    if (qmat_bytes_read_file(context, side_path, &side) == QMAT_OK)
      for (size_t i = 0; i < side.size; i++) sum += 1000 * side.data[i];
  }
  if (side.size > 1 && side.data[0] == '!') {
    snprintf(side_path, sizeof side_path, "%s.%.*s", path, (int)side.size - 1, (const char *)side.data + 1);
    qmat_bytes_uninit(&side);
    if (qmat_bytes_read_file(context, side_path, &side) == QMAT_OK)
      for (size_t i = 0; i < side.size; i++) sum += 100 * side.data[i];
  }
  qmat_bytes_uninit(&bytes);
  qmat_bytes_uninit(&side);
  return test_report(context, sum, &outputs[0]);
}

static const qmat_node test_read_file = {.name = "test.read",
                                         .version = 1,
                                         .summary = "A file",
                                         .doc = "",
                                         .citation = "",
                                         .params_size = sizeof(path_params),
                                         .params = mesh_rows,
                                         .outputs = number_outputs,
                                         .run = read_run};

typedef struct scale_params {
  double factor;
  bool whole;
} scale_params;

static qmat_status scale_run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                             qmat_value *outputs[]) {
  const scale_params *params = data;
  ran.scale++;
  if (test_value(inputs[0]) == '?') return qmat_fail(context, QMAT_ERROR_GEOMETRY, "that is no number");
  double number = params->factor * test_value(inputs[0]) + ran.drift;
  return test_report(context, params->whole ? (double)(long)number : number, &outputs[0]);
}

static const qmat_param scale_rows[] = {{.name = "factor",
                                         .unit = "1",
                                         .doc = "How much",
                                         .type = QMAT_PARAM_FLOAT,
                                         .default_number = 1,
                                         .min = -100,
                                         .max = 100,
                                         .offset = offsetof(scale_params, factor)},
                                        {.name = "whole",
                                         .unit = "",
                                         .doc = "Cut what is behind the point",
                                         .type = QMAT_PARAM_BOOL,
                                         .offset = offsetof(scale_params, whole)},
                                        {0}};

/* Not constant: a test raises its version. */
static qmat_node test_scale = {.name = "test.scale",
                               .version = 1,
                               .summary = "A product",
                               .doc = "",
                               .citation = "",
                               .params_size = sizeof(scale_params),
                               .params = scale_rows,
                               .inputs = print_inputs,
                               .outputs = number_outputs,
                               .libraries = test_libraries,
                               .run = scale_run};

/* Takes two outputs of one node. */
static qmat_status pair_run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                            qmat_value *outputs[]) {
  const scale_params *params = data;
  const size_t letters = strlen(((const qmat_scene *)inputs[0])->name);
  return test_report(context, params->factor * (double)(letters + ((const qmat_mesh *)inputs[1])->triangle_count),
                     &outputs[0]);
}

static const qmat_node test_pair = {.name = "test.pair",
                                    .version = 1,
                                    .summary = "Two values of one node",
                                    .doc = "",
                                    .citation = "",
                                    .params_size = sizeof(scale_params),
                                    .params = scale_rows,
                                    .inputs = mesh_outputs,
                                    .outputs = number_outputs,
                                    .run = pair_run};

/* The bytes of a file one by one: a list, or the one that there is. */
static qmat_status split_run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                             qmat_value *outputs[]) {
  (void)inputs;
  qmat_bytes bytes = {0};
  qmat_status status = qmat_bytes_read_file(context, ((const path_params *)data)->path, &bytes);
  if (status != QMAT_OK) return status;
  if (bytes.size == 1) {
    status = test_report(context, bytes.data[0], &outputs[0]);
  } else {
    qmat_list *list = qmat_list_new(bytes.size);
    assert_non_null(list);
    for (size_t i = 0; i < bytes.size; i++) {
      char name[2] = {(char)bytes.data[i], 0};
      list->names[i] = qmat_strdup(name);
      test_ok(context, test_report(context, bytes.data[i], &list->items[i]));
    }
    outputs[0] = &list->base;
    status = qmat_value_seal(context, &list->base);
  }
  qmat_bytes_uninit(&bytes);
  return status;
}

static const qmat_port split_outputs[] = {{.name = "number", .type = QMAT_REPORT, .doc = "Bytes", .list = true}, {0}};
static const qmat_node test_split = {.name = "test.split",
                                     .version = 1,
                                     .summary = "The bytes of a file",
                                     .doc = "",
                                     .citation = "",
                                     .params_size = sizeof(path_params),
                                     .params = mesh_rows,
                                     .outputs = split_outputs,
                                     .run = split_run};

/* Takes a list whole; what could not be made counts nothing. */
static qmat_status sum_run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                           qmat_value *outputs[]) {
  (void)params;
  double sum = 0;
  for (size_t i = 0; i < qmat_value_count(inputs[0]); i++) {
    const qmat_value *item = qmat_value_at(inputs[0], i);
    if (!qmat_value_failure(item)) sum += test_value(item);
  }
  return test_report(context, sum, &outputs[0]);
}

static const qmat_port sum_inputs[] = {{.name = "number", .type = QMAT_REPORT, .doc = "Some", .list = true}, {0}};
static const qmat_node test_sum = {.name = "test.sum",
                                   .version = 1,
                                   .summary = "Their sum",
                                   .doc = "",
                                   .citation = "",
                                   .inputs = sum_inputs,
                                   .outputs = number_outputs,
                                   .run = sum_run};

static const qmat_node *const counted_table[] = {&test_add,   &test_mesh,  &test_pair, &test_read_file,
                                                 &test_scale, &test_split, &test_sum};
static const qmat_registry counted = {counted_table, sizeof counted_table / sizeof *counted_table};

/* ---- one run after another on one cache ---- */

typedef struct fixture {
  char folder[64], cache_folder[80], model[80];
  bool read_only;
  uint64_t most_size;
  char warning[400];
  double result;    // of the last run
  char states[64];  // of its steps, by their first letters
  char why[4][512]; /* of its steps, foreseen: all sentences */
} fixture;

static int set_up(void **state) {
  fixture *f = calloc(1, sizeof *f);
  *state = f;
  ran.read = ran.scale = 0;
  ran.drift = 0;
  ran.written = NULL;
  test_scale.version = 1;
  strcpy(library_text, "1.0");
  strcpy(f->folder, "/tmp/qmat-cache-XXXXXX");
  if (!mkdtemp(f->folder)) return -1;
  snprintf(f->cache_folder, sizeof f->cache_folder, "%s/cache", f->folder);
  snprintf(f->model, sizeof f->model, "%s/model", f->folder);
  return 0;
}

static int tear_down(void **state) {
  fixture *f = *state;
  char command[160];
  snprintf(command, sizeof command, "chmod -R u+w %s && rm -r %s", f->folder, f->folder);
  int result = system(command);
  free(f);
  return result;
}

static void open_cache(const fixture *f, qmat_cache *cache) {
  qmat_context context = {0};
  const qmat_cache_options options = {.folder = f->cache_folder, .read_only = f->read_only, .most_size = f->most_size};
  test_ok(&context, qmat_cache_open(&context, &options, cache));
}

static void tell_why(fixture *f, const qmat_run *run) {
  json_t *records = qmat_cache_records(run->cache);
  assert_non_null(records);
  for (size_t i = 0; i < run->step_count && i < 4; i++) {
    json_t *why = qmat_why(run, records, i);
    assert_non_null(why);
    snprintf(f->why[i], sizeof f->why[i], "%s", json_string_value(json_object_get(why, "text")));
    const json_t *causes = json_object_get(why, "causes");
    for (size_t k = 0; k < json_array_size(causes); k++) {
      size_t used = strlen(f->why[i]);
      snprintf(f->why[i] + used, sizeof f->why[i] - used, "|%s",
               json_string_value(json_object_get(json_array_get(causes, k), "text")));
    }
    json_decref(why);
  }
  json_decref(records);
}

/* Reads the model, multiplies it twice. With `dry` only the states and reasons. */
static void run_graph(fixture *f, const char *factor, const char *last_factor, bool dry, bool force) {
  char text[512];
  snprintf(text, sizeof text,
           "qmat: 1\nnodes:\n"
           "  file:  { type: test.read, params: { path: %s } }\n"
           "  scale: { type: test.scale, params: { factor: %s, whole: true }, in: { number: file.number } }\n"
           "  last:  { type: test.scale, params: { factor: %s }, in: { number: scale.number } }\n"
           "outputs: { last: last.number }\n",
           f->model, factor, last_factor);
  qmat_context context = {0};
  qmat_graph graph;
  qmat_cache cache;
  qmat_run run = {0};
  test_ok(&context, qmat_graph_read_text(&context, &counted, "g.yaml", text, strlen(text), &graph));
  open_cache(f, &cache);
  const qmat_run_port want = {2, 0};
  const qmat_run_options options = {.wants = &want, .want_count = 1, .cache = &cache, .force_all = force};
  test_ok(&context, qmat_run_plan(&context, &graph, &options, &run));
  if (dry) {
    qmat_run_foresee(&run);
    tell_why(f, &run);
  } else {
    test_ok(&context, qmat_run_execute(&context, &run, NULL));
    f->result = test_value(qmat_run_value(&run, 2, 0));
    qmat_cache_trim(&cache);
  }
  for (size_t i = 0; i < run.step_count; i++) f->states[i] = qmat_step_state_name(run.steps[i].state)[0];
  f->states[run.step_count] = 0;
  snprintf(f->warning, sizeof f->warning, "%s", cache.warning);
  qmat_run_uninit(&run);
  qmat_graph_uninit(&graph);
  qmat_cache_close(&cache);
  qmat_context_uninit(&context);
}

static void run_once(fixture *f, const char *factor) {
  run_graph(f, factor, "2", false, false);
}

static void foresee(fixture *f, const char *factor) {
  run_graph(f, factor, "2", true, false);
}

/* Where the cache keeps the value of a number. */
static void blob_path(const fixture *f, double number, char path[256]) {
  qmat_context context = {0};
  qmat_value *value;
  char hex[65];
  test_ok(&context, test_report(&context, number, &value));
  qmat_digest_hex(&value->digest, hex);
  snprintf(path, 256, "%s/cas/%s", f->cache_folder, hex);
  qmat_value_release(value);
}

static size_t count_entries(const fixture *f, qmat_cache_kind kind) {
  qmat_cache cache;
  qmat_cache_entry *entries;
  size_t count, found = 0;
  open_cache(f, &cache);
  assert_true(qmat_cache_list(&cache, &entries, &count));
  for (size_t i = 0; i < count; i++) found += entries[i].kind == kind;
  qmat_free(entries);
  qmat_cache_close(&cache);
  return found;
}

/* ---- hits and misses ---- */

static void test_a_second_run_runs_nothing_and_gives_the_same(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  assert_string_equal(f->states, "rrr");
  assert_true(f->result == 2 * 3 * ('a' + 'b' + 'c'));
  f->result = 0;
  run_once(f, "3");
  assert_string_equal(f->states, "hhh");
  assert_int_equal(ran.read + ran.scale, 3);
  assert_true(f->result == 2 * 3 * ('a' + 'b' + 'c'));
}

static void test_a_changed_parameter_reuses_what_stands_before_it(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  run_once(f, "4");
  assert_string_equal(f->states, "hrr");
  assert_true(f->result == 2 * 4 * ('a' + 'b' + 'c'));
  run_graph(f, "3", "7", false, false);
  assert_string_equal(f->states, "hhr");
  assert_true(f->result == 7 * 3 * ('a' + 'b' + 'c'));
}

static void test_equal_bytes_stop_the_wave(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  run_once(f, "3.0001"); /* cut to the same whole number */
  assert_string_equal(f->states, "hsh");
  write_text(f->model, "cba"); /* another file of the same sum */
  run_once(f, "3");
  assert_string_equal(f->states, "shh");
}

static void test_only_the_bytes_of_a_file_count(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  write_text(f->model, "abc"); /* written anew */
  run_once(f, "3");
  assert_string_equal(f->states, "hhh");
  write_text(f->model, "abd");
  run_once(f, "3");
  assert_string_equal(f->states, "rrr");
  assert_true(f->result == 2 * 3 * ('a' + 'b' + 'd'));
}

static void test_a_file_that_changes_before_it_is_read_is_not_kept(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  ran.written = "xyz"; /* after the key was made of "abc" */
  run_once(f, "3");
  assert_true(f->result == 2 * 3 * ('x' + 'y' + 'z'));
  ran.written = NULL;
  write_text(f->model, "abc");
  run_once(f, "3");
  assert_true(f->result == 2 * 3 * ('a' + 'b' + 'c'));
}

static void test_another_folder_hits_and_another_name_misses(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  char folder[80];
  snprintf(folder, sizeof folder, "%s/deep", f->folder);
  assert_int_equal(mkdir(folder, 0777), 0);
  snprintf(f->model, sizeof f->model, "%s/deep/model", f->folder);
  write_text(f->model, "abc");
  run_once(f, "3");
  assert_string_equal(f->states, "hhh");
  snprintf(f->model, sizeof f->model, "%s/other", f->folder);
  write_text(f->model, "abc");
  run_once(f, "3");
  assert_string_equal(f->states, "shh");
}

static void test_side_files_count(void **state) {
  fixture *f = *state;
  char side[96];
  snprintf(side, sizeof side, "%s.side", f->model);
  write_text(f->model, "!a");
  run_once(f, "3"); /* without its side file */
  assert_true(f->result == 6 * ('!' + 'a'));
  run_once(f, "3");
  assert_string_equal(f->states, "hhh");
  write_text(side, "b");
  run_once(f, "3");
  assert_string_equal(f->states, "rrr");
  assert_true(f->result == 6 * ('!' + 'a' + 1000 * 'b'));
  run_once(f, "3");
  assert_string_equal(f->states, "hhh");
  write_text(side, "c");
  foresee(f, "3");
  assert_string_equal(f->why[0], "would run:|the side file model.side changed");
  run_once(f, "3");
  assert_string_equal(f->states, "rrr");
  assert_true(f->result == 6 * ('!' + 'a' + 1000 * 'c'));
  write_text(side, "b"); /* what was before is still there */
  run_once(f, "3");
  assert_string_equal(f->states, "hhh");
  assert_true(f->result == 6 * ('!' + 'a' + 1000 * 'b'));
  assert_int_equal(unlink(side), 0);
  run_once(f, "3");
  assert_string_equal(f->states, "hhh");
  assert_true(f->result == 6 * ('!' + 'a'));
}

/* Twenty assets whose first files are the same bytes; each of the second files refers to another third one. */
static void test_equal_files_that_lead_to_different_ones_are_all_found_again(void **state) {
  fixture *f = *state;
  enum { ASSETS = 20 };
  double results[ASSETS];
  char folder[80], path[120], text[40];
  strcpy(folder, f->folder);
  for (int pass = 0; pass < 4; pass++)
    for (int i = 0; i < ASSETS; i++) {
      snprintf(path, sizeof path, "%s/%d", folder, i);
      if (pass == 0) assert_int_equal(mkdir(path, 0777), 0);
      snprintf(f->model, sizeof f->model, "%s/%d/model", folder, i);
      if (pass == 0) {
        write_text(f->model, "!root");
        snprintf(path, sizeof path, "%s.side", f->model);
        snprintf(text, sizeof text, "!mesh%d", i);
        write_text(path, text);
        snprintf(path, sizeof path, "%s.mesh%d", f->model, i);
        snprintf(text, sizeof text, "%d", 7 * i);
        write_text(path, text);
      }
      run_once(f, "3");
      if (pass == 0) results[i] = f->result;
      assert_true(f->result == results[i]);
      if (pass >= 2) assert_string_equal(f->states, "hhh"); /* the second pass parts the ways */
    }
  /* A change of the last file counts. */
  snprintf(path, sizeof path, "%s.mesh%d", f->model, ASSETS - 1);
  write_text(path, "another");
  run_once(f, "3");
  assert_string_equal(f->states, "rrr");
  /* Where the second file changed, which third one follows is not known. */
  snprintf(path, sizeof path, "%s.side", f->model);
  write_text(path, "!mesh77");
  foresee(f, "3");
  assert_string_equal(f->why[0], "would run:|the side file model.side changed");
}

static void test_forced_nodes_run_and_are_the_same(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  run_graph(f, "3", "2", false, true);
  assert_string_equal(f->states, "sss");
  assert_string_equal(f->warning, "");
  assert_int_equal(ran.read + ran.scale, 6);
}

/* Splits the model, doubles each byte, and adds them up; `rest` are further nodes. */
static qmat_status run_split(fixture *f, const char *rest, qmat_context *context, double *sum, size_t *lifted,
                             size_t *hits) {
  char text[1024];
  snprintf(text, sizeof text,
           "qmat: 1\nnodes:\n"
           "  split: { type: test.split, params: { path: %s } }\n"
           "  scale: { type: test.scale, params: { factor: 2 }, in: { number: split.number } }\n"
           "  sum:   { type: test.sum, in: { number: scale.number } }\n%s"
           "outputs: { sum: %s }\n",
           f->model, rest, *rest ? "add.sum" : "sum.number");
  qmat_graph graph;
  qmat_cache cache;
  qmat_run run = {0};
  test_ok(context, qmat_graph_read_text(context, &counted, "g.yaml", text, strlen(text), &graph));
  open_cache(f, &cache);
  const qmat_run_port want = {graph.node_count - 1, 0};
  const qmat_run_options options = {.wants = &want, .want_count = 1, .cache = &cache};
  test_ok(context, qmat_run_plan(context, &graph, &options, &run));
  const qmat_status status = qmat_run_execute(context, &run, NULL);
  if (status == QMAT_OK) {
    *sum = test_value(qmat_run_value(&run, want.node, 0));
    *lifted = run.steps[1].lifted;
    *hits = run.steps[1].lifted_hits;
    for (size_t i = 0; i < 3; i++) f->states[i] = qmat_step_state_name(run.steps[i].state)[0];
    f->states[3] = 0;
  }
  qmat_run_uninit(&run);
  qmat_graph_uninit(&graph);
  qmat_cache_close(&cache);
  return status;
}

static void test_a_node_runs_once_for_each_value_of_a_list_and_what_is_known_of_one_stays(void **state) {
  fixture *f = *state;
  qmat_context context = {0};
  double sum;
  size_t lifted, hits;
  write_text(f->model, "abcd");
  context.threads = 8;
  test_ok(&context, run_split(f, "", &context, &sum, &lifted, &hits));
  assert_true(sum == 2 * ('a' + 'b' + 'c' + 'd'));
  assert_string_equal(f->states, "rrr");
  assert_int_equal(ran.scale, 4);
  assert_int_equal(lifted, 4);
  assert_int_equal(hits, 0);

  context.threads = 1; /* the entries are the same for any number of threads */
  test_ok(&context, run_split(f, "", &context, &sum, &lifted, &hits));
  assert_true(sum == 2 * ('a' + 'b' + 'c' + 'd'));
  assert_string_equal(f->states, "hhh");
  assert_int_equal(ran.scale, 4);

  write_text(f->model, "abXd");
  test_ok(&context, run_split(f, "", &context, &sum, &lifted, &hits));
  assert_true(sum == 2 * ('a' + 'b' + 'X' + 'd'));
  assert_int_equal(ran.scale, 5);
  assert_int_equal(hits, 3);

  write_text(f->model, "b"); /* a list of one is the value, so what it made in the list is known, too */
  test_ok(&context, run_split(f, "", &context, &sum, &lifted, &hits));
  assert_true(sum == 2 * 'b');
  assert_int_equal(ran.scale, 5);
  assert_int_equal(lifted, 0);
  qmat_context_uninit(&context);
}

static void test_values_that_a_node_cannot_work_on_are_left_out_but_not_all_of_them(void **state) {
  fixture *f = *state;
  qmat_context context = {0};
  double sum;
  size_t lifted, hits;
  /* Another node after the one that fails, which must not be asked for what is missing. */
  static const char rest[] =
      "  twice: { type: test.scale, params: { factor: 2 }, in: { number: scale.number } }\n"
      "  all:   { type: test.sum, in: { number: twice.number } }\n"
      "  add:   { type: test.add, in: { first: all.number, second: sum.number } }\n";
  write_text(f->model, "a?c?");
  for (int again = 0; again < 2; again++) {
    context.threads = 1 + again;
    test_ok(&context, run_split(f, rest, &context, &sum, &lifted, &hits));
    assert_true(sum == 6 * ('a' + 'c'));
    assert_string_equal(f->states, again ? "hhh" : "rrr");
    assert_int_equal(ran.scale, 3 + 2); /* equal values are computed once */
  }
  write_text(f->model, "???");
  for (context.threads = 1; context.threads <= 4; context.threads++) {
    assert_int_equal(run_split(f, rest, &context, &sum, &lifted, &hits), QMAT_ERROR_GEOMETRY);
    assert_string_equal(context.error.message, "?: that is no number");
    assert_string_equal(context.error.node_id, "scale");
  }
  write_text(f->model, "?"); /* one is no list: there is nothing to go on with */
  assert_int_equal(run_split(f, rest, &context, &sum, &lifted, &hits), QMAT_ERROR_GEOMETRY);
  assert_string_equal(context.error.message, "that is no number");
  qmat_context_uninit(&context);
}

static void test_a_list_is_kept_as_its_items_and_each_of_them_once(void **state) {
  fixture *f = *state;
  qmat_context context = {0};
  qmat_cache cache;
  open_cache(f, &cache);
  qmat_list *lists[2];
  json_t *stored[2];
  bool added;
  for (int k = 0; k < 2; k++) {
    lists[k] = qmat_list_new(3);
    for (int i = 0; i < 3; i++) {
      char name[8];
      snprintf(name, sizeof name, "%d", i);
      lists[k]->names[i] = qmat_strdup(name);
      test_ok(&context, test_report(&context, i + (i == 1) * 10 * k, &lists[k]->items[i]));
    }
    test_ok(&context, qmat_value_seal(&context, &lists[k]->base));
    stored[k] = qmat_cache_put_value(&cache, &lists[k]->base, &added);
    assert_true(added);
    assert_int_equal(json_array_size(json_object_get(stored[k], "items")), 3);
    assert_true(qmat_cache_has_stored(&cache, stored[k]));
    assert_int_equal(count_entries(f, QMAT_CACHE_BLOB),
                     k == 0 ? 4 : 6); /* the other list, and the one item that is new */
  }
  json_decref(qmat_cache_put_value(&cache, &lists[0]->base, &added));
  assert_false(added);
  for (int k = 0; k < 2; k++) {
    const uint64_t size = (uint64_t)json_integer_value(json_object_get(stored[k], "blob"));
    qmat_value *again = qmat_cache_value(&cache, &lists[k]->base.digest, size, QMAT_LIST);
    assert_non_null(again);
    for (size_t i = 0; i < 3; i++)
      assert_true(qmat_digest_equal(&qmat_value_at(again, i)->digest, &lists[k]->items[i]->digest));
    qmat_value_release(again);
  }

  /* Without an item the list is no hit and is not given, but is sound: it comes back with the item. */
  char path[256];
  blob_path(f, 11, path);
  assert_int_equal(unlink(path), 0);
  const uint64_t size = (uint64_t)json_integer_value(json_object_get(stored[1], "blob"));
  assert_true(qmat_cache_has_stored(&cache, stored[0]));
  assert_false(qmat_cache_has_stored(&cache, stored[1]));
  assert_null(qmat_cache_value(&cache, &lists[1]->base.digest, size, QMAT_LIST));
  assert_int_equal(count_entries(f, QMAT_CACHE_BAD), 0);
  json_decref(qmat_cache_put_value(&cache, lists[1]->items[1], &added));
  qmat_value *again = qmat_cache_value(&cache, &lists[1]->base.digest, size, QMAT_LIST);
  assert_non_null(again);
  qmat_value_release(again);

  /* An item of other bytes is set aside, and the list is not. */
  write_text(path, "what is this");
  assert_null(qmat_cache_value(&cache, &lists[1]->base.digest, size, QMAT_LIST));
  assert_int_equal(count_entries(f, QMAT_CACHE_BAD), 1);
  assert_int_equal(count_entries(f, QMAT_CACHE_BLOB), 5);
  for (int k = 0; k < 2; k++) {
    json_decref(stored[k]);
    qmat_value_release(&lists[k]->base);
  }
  qmat_cache_close(&cache);
  qmat_context_uninit(&context);
}

static void test_lists_of_different_lengths_do_not_go_together(void **state) {
  fixture *f = *state;
  qmat_context context = {0};
  char rest[480], other[80];
  double sum;
  size_t lifted, hits;
  write_text(f->model, "abcd");
  snprintf(other, sizeof other, "%s/other", f->folder);
  write_text(other, "abc");
  snprintf(rest, sizeof rest,
           "  three: { type: test.split, params: { path: %s } }\n"
           "  both:  { type: test.add, in: { first: scale.number, second: three.number } }\n"
           "  all:   { type: test.sum, in: { number: both.sum } }\n"
           "  add:   { type: test.add, in: { first: all.number, second: sum.number } }\n",
           other);
  assert_int_equal(run_split(f, rest, &context, &sum, &lifted, &hits), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.message, "this list has 3 items, another input's has 4");
  assert_string_equal(context.error.node_id, "both");
  assert_string_equal(context.error.field, "second");
  qmat_context_uninit(&context);
}

static void test_a_node_that_breaks_its_promise_is_named(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  ran.drift = 1;
  run_graph(f, "3", "2", false, true);
  assert_non_null(strstr(f->warning, "'scale' (test.scale) made another 'number'"));
}

/* ---- what goes wrong ---- */

static void check_recovers(fixture *f) {
  for (int round = 0; round < 2; round++) {
    f->result = 0;
    run_once(f, "3");
    assert_true(f->result == 2 * 3 * ('a' + 'b' + 'c'));
  }
  assert_string_equal(f->states, f->read_only ? f->states : "hhh");
}

static void damage(const char *path, long at, bool truncate_it) {
  struct stat about;
  assert_int_equal(stat(path, &about), 0);
  if (truncate_it) {
    assert_int_equal(truncate(path, about.st_size - 3), 0);
    return;
  }
  FILE *file = fopen(path, "r+b");
  assert_non_null(file);
  assert_int_equal(fseek(file, at < 0 ? about.st_size + at : at, SEEK_SET), 0);
  int byte = fgetc(file);
  assert_int_equal(fseek(file, -1, SEEK_CUR), 0);
  fputc(byte ^ 4, file);
  fclose(file);
}

static void test_a_damaged_blob_is_a_miss(void **state) {
  fixture *f = *state;
  const double sums[] = {'a' + 'b' + 'c', 3 * ('a' + 'b' + 'c'), 6 * ('a' + 'b' + 'c')};
  write_text(f->model, "abc");
  for (int which = 0; which < 3; which++)
    for (int way = 0; way < 3; way++) {
      char path[256];
      run_once(f, "3");
      blob_path(f, sums[which], path);
      damage(path, way == 0 ? 2 : -6, way == 2);
      check_recovers(f);
    }
  assert_true(count_entries(f, QMAT_CACHE_BAD) > 0);
}

static void test_a_blob_that_is_gone_is_a_miss(void **state) {
  fixture *f = *state;
  char path[256];
  write_text(f->model, "abc");
  run_once(f, "3");
  blob_path(f, 3 * ('a' + 'b' + 'c'), path);
  assert_int_equal(unlink(path), 0);
  foresee(f, "3");
  assert_string_equal(f->states, "hrd");
  assert_string_equal(f->why[1], "would run: a part of its result is missing from the cache");
  check_recovers(f);
}

static void test_a_damaged_record_is_a_miss(void **state) {
  fixture *f = *state;
  qmat_cache cache;
  qmat_cache_entry *entries;
  size_t count;
  write_text(f->model, "abc");
  run_once(f, "3");
  open_cache(f, &cache);
  assert_true(qmat_cache_list(&cache, &entries, &count));
  for (size_t i = 0; i < count && entries[i].kind == QMAT_CACHE_RECORD; i++) {
    char path[256];
    snprintf(path, sizeof path, "%s/ac/%s", f->cache_folder, entries[i].name);
    damage(path, 20 + 5 * (long)i, i == 1);
  }
  qmat_free(entries);
  qmat_cache_close(&cache);
  check_recovers(f);
  assert_int_equal(ran.read, 2);
}

static void test_a_record_under_another_key_is_not_believed(void **state) {
  fixture *f = *state;
  char command[512];
  write_text(f->model, "abc");
  run_once(f, "3");
  foresee(f, "4");
  /* Every record takes the name of every other. */
  snprintf(command, sizeof command, "cd %s/ac && set -- * && cp $1 x && cp $2 $1 && cp $3 $2 && mv x $3",
           f->cache_folder);
  assert_int_equal(system(command), 0);
  check_recovers(f);
  assert_int_equal(ran.read, 2);
}

static void test_a_cache_that_is_read_only_is_used_and_left_alone(void **state) {
  fixture *f = *state;
  char path[256];
  write_text(f->model, "abc");
  run_once(f, "3");
  size_t records = count_entries(f, QMAT_CACHE_RECORD);
  f->read_only = true;
  run_once(f, "3");
  assert_string_equal(f->states, "hhh");
  run_once(f, "4");
  assert_string_equal(f->states, "hrr");
  assert_int_equal(count_entries(f, QMAT_CACHE_RECORD), records);
  blob_path(f, 6 * ('a' + 'b' + 'c'), path);
  damage(path, -6, false);
  check_recovers(f);
  assert_int_equal(count_entries(f, QMAT_CACHE_BAD), 0);
  assert_string_equal(f->warning, "");
}

static void test_a_node_that_makes_other_bytes_when_its_blob_is_lost_starts_the_run_again(void **state) {
  fixture *f = *state;
  char path[256];
  write_text(f->model, "abc");
  run_once(f, "3");
  /* The last node has to run, but what it reads is damaged, and made anew it is something else. */
  blob_path(f, 3 * ('a' + 'b' + 'c'), path);
  damage(path, -6, false);
  ran.drift = 1;
  run_graph(f, "3", "5", false, false);
  assert_true(f->result == 5 * (3 * ('a' + 'b' + 'c') + 1) + 1);
}

static void test_a_node_that_runs_again_for_one_output_leaves_the_other_as_it_is(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  for (int round = 0; round < 2; round++) {
    char text[512];
    snprintf(text, sizeof text,
             "qmat: 1\nnodes:\n  model: { type: test.mesh, params: { path: %s } }\n"
             "  pair: { type: test.pair, params: { factor: %d }, in: { scene: model.scene, mesh: model.mesh } }\n"
             "outputs: { pair: pair.number }\n",
             f->model, round + 1);
    qmat_context context = {0};
    qmat_graph graph;
    qmat_cache cache;
    qmat_run run = {0};
    test_ok(&context, qmat_graph_read_text(&context, &counted, "g.yaml", text, strlen(text), &graph));
    open_cache(f, &cache);
    const qmat_run_port want = {1, 0};
    const qmat_run_options options = {.wants = &want, .want_count = 1, .cache = &cache};
    test_ok(&context, qmat_run_plan(&context, &graph, &options, &run));
    test_ok(&context, qmat_run_execute(&context, &run, NULL));
    assert_true(test_value(qmat_run_value(&run, 1, 0)) == (round + 1) * (double)(strlen("model") + 4));
    char hex[65], path[256];
    qmat_digest_hex(&run.steps[0].made[1].digest, hex);
    snprintf(path, sizeof path, "%s/cas/%s", f->cache_folder, hex);
    damage(path, -6, false); /* the mesh; the scene stays */
    qmat_run_uninit(&run);
    qmat_graph_uninit(&graph);
    qmat_cache_close(&cache);
    qmat_context_uninit(&context);
  }
}

static void test_a_cache_that_cannot_be_made_is_told_once_and_the_run_goes_on(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  snprintf(f->cache_folder, sizeof f->cache_folder, "/proc/nowhere/cache");
  run_once(f, "3");
  assert_true(f->result == 2 * 3 * ('a' + 'b' + 'c'));
  assert_non_null(strstr(f->warning, "cannot write to the cache"));
}

static void test_a_file_is_no_cache(void **state) {
  fixture *f = *state;
  qmat_context context = {0};
  qmat_cache cache;
  write_text(f->model, "abc");
  const qmat_cache_options options = {.folder = f->model};
  assert_int_equal(qmat_cache_open(&context, &options, &cache), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.file, f->model);
  qmat_cache_close(&cache);
}

/* ---- keys ---- */

static void test_a_key_is_the_digest_of_its_items_with_their_lengths(void **state) {
  (void)state;
  qmat_digest key, wanted;
  json_t *items = json_pack("[[s, s, s]]", "a", "bc", "");
  const char bytes[] =
      "\1\0\0\0\0\0\0\0a"
      "\2\0\0\0\0\0\0\0bc"
      "\0\0\0\0\0\0\0";
  assert_true(qmat_key_digest(items, &key));
  assert_int_equal(qmat_digest_of(bytes, sizeof bytes, &wanted), QMAT_OK);
  assert_true(qmat_digest_equal(&key, &wanted));
  json_array_append_new(json_array_get(items, 0), json_string("d"));
  assert_false(qmat_key_digest(items, &key));
  json_decref(items);
}

/* What a key is made of, for one node type. */
typedef struct key_facts {
  const qmat_node *type;
  void *params;
  qmat_digest digests[2][32];
  const qmat_digest *inputs[32], *files[32];
} key_facts;

static void make_key(const key_facts *facts, qmat_digest *key) {
  json_t *items = qmat_key_items(facts->type, facts->params, facts->inputs, facts->files);
  assert_non_null(items);
  assert_true(qmat_key_digest(items, key));
  json_decref(items);
}

/* The key must be none of those before it, and is added to them. */
static void add_key(const key_facts *facts, qmat_digest *keys, size_t *count, const char *what) {
  assert_true(*count < 256);
  make_key(facts, &keys[*count]);
  for (size_t i = 0; i < *count; i++)
    if (qmat_digest_equal(&keys[i], &keys[*count]))
      fail_msg("%s: another %s gives the same key", facts->type->name, what);
  (*count)++;
}

static void change_param(const key_facts *facts, const qmat_param *param, qmat_digest *keys, size_t *count) {
  char *place = (char *)facts->params + param->offset;
  int choice, first_choice;
  int64_t whole;
  double number;
  const char *text;
  switch (param->type) {
    case QMAT_PARAM_BOOL:
      *(bool *)place = !*(bool *)place;
      add_key(facts, keys, count, param->name);
      *(bool *)place = !*(bool *)place;
      break;
    case QMAT_PARAM_INT:
      whole = *(int64_t *)place;
      *(int64_t *)place = (double)whole + 1 <= param->max ? whole + 1 : whole - 1;
      add_key(facts, keys, count, param->name);
      *(int64_t *)place = whole;
      break;
    case QMAT_PARAM_FLOAT:
      /* The nearest other number of all. */
      number = *(double *)place;
      *(double *)place = nextafter(number, number < param->max ? param->max : param->min);
      add_key(facts, keys, count, param->name);
      *(double *)place = number;
      break;
    case QMAT_PARAM_ENUM:
      memcpy(&first_choice, place, sizeof first_choice);
      for (choice = 0; param->choices[choice]; choice++) {
        if (choice == first_choice) continue;
        memcpy(place, &choice, sizeof choice);
        add_key(facts, keys, count, param->name);
      }
      memcpy(place, &first_choice, sizeof first_choice);
      break;
    case QMAT_PARAM_STRING:
    case QMAT_PARAM_PATH:
      text = *(const char **)place;
      *(const char **)place = "another name";
      add_key(facts, keys, count, param->name);
      *(const char **)place = "another\xffname";
      add_key(facts, keys, count, param->name);
      *(const char **)place = "another\\xffname";
      add_key(facts, keys, count, param->name);
      if (!text || *text) { /* an empty text is not the same as none */
        *(const char **)place = "";
        add_key(facts, keys, count, param->name);
      }
      if (text) {
        *(const char **)place = NULL;
        add_key(facts, keys, count, param->name);
      }
      *(const char **)place = text;
      break;
  }
}

static void test_every_parameter_and_every_input_of_every_node_changes_its_key(void **state) {
  (void)state;
  assert_true(qmat_node_count > 0);
  for (size_t n = 0; n < qmat_node_count; n++) {
    static qmat_digest keys[256];
    key_facts *facts = calloc(1, sizeof *facts);
    size_t count = 0;
    qmat_node copy = *qmat_nodes[n];
    facts->type = &copy;
    facts->params = qmat_calloc(1, copy.params_size);
    qmat_params_default(&copy, facts->params);
    size_t params = qmat_param_count(&copy), inputs = qmat_input_count(&copy);
    assert_true(params < 32 && inputs < 32);
    for (size_t i = 0; i < 32; i++)
      for (size_t k = 0; k < 2; k++) facts->digests[k][i].bytes[0] = (uint8_t)(2 * i + k);
    for (size_t row = 0; row < params; row++) {
      if (copy.params[row].type != QMAT_PARAM_PATH) continue;
      *(const char **)((char *)facts->params + copy.params[row].offset) = "folder/name";
      facts->files[row] = &facts->digests[0][row];
    }
    for (size_t port = 0; port < inputs; port++) facts->inputs[port] = &facts->digests[0][port];
    add_key(facts, keys, &count, "start");
    for (size_t row = 0; row < params; row++) {
      change_param(facts, &copy.params[row], keys, &count);
      if (!facts->files[row]) continue;
      facts->files[row] = &facts->digests[1][row];
      add_key(facts, keys, &count, "file");
      facts->files[row] = &facts->digests[0][row];
    }
    for (size_t port = 0; port < inputs; port++) {
      facts->inputs[port] = &facts->digests[1][port];
      add_key(facts, keys, &count, copy.inputs[port].name);
      facts->inputs[port] = NULL;
      add_key(facts, keys, &count, copy.inputs[port].name);
      facts->inputs[port] = &facts->digests[0][port];
    }
    for (size_t port = 1; port < inputs; port++) { /* inputs that change places */
      facts->inputs[0] = &facts->digests[0][port];
      facts->inputs[port] = &facts->digests[0][0];
      add_key(facts, keys, &count, "order");
      facts->inputs[0] = &facts->digests[0][0];
      facts->inputs[port] = &facts->digests[0][port];
    }
    copy.version++;
    add_key(facts, keys, &count, "version");
    copy.libraries = test_libraries;
    strcpy(library_text, "1.0");
    add_key(facts, keys, &count, "library");
    strcpy(library_text, "1.0 avx512");
    add_key(facts, keys, &count, "library");
    copy.name = "other.node";
    add_key(facts, keys, &count, "name");
    qmat_free(facts->params);
    free(facts);
  }
}

static void test_folders_are_not_in_a_key(void **state) {
  (void)state;
  path_params here = {"a/model.off"}, there = {"/somewhere/else/model.off"};
  qmat_digest digest = {{1}}, first, second;
  const qmat_digest *files[] = {&digest};
  key_facts facts = {.type = &test_read_file, .params = &here, .files = {files[0]}};
  make_key(&facts, &first);
  facts.params = &there;
  make_key(&facts, &second);
  assert_true(qmat_digest_equal(&first, &second));
}

/* ---- why ---- */

static void test_why_names_a_parameter(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  foresee(f, "3");
  assert_string_equal(f->states, "rdd");
  assert_string_equal(f->why[0], "would run: the cache has no result of this node type");
  run_once(f, "3");
  foresee(f, "4.5");
  assert_string_equal(f->states, "hrd");
  assert_string_equal(f->why[1], "would run:|parameter factor is 4.5, was 3");
  assert_non_null(strstr(f->why[2], "|input number comes from scale"));
  run_once(f, "4.5");
  foresee(f, "4.5"); /* why it ran then */
  assert_string_equal(f->states, "hhh");
  assert_non_null(strstr(f->why[1], "it ran then because|parameter factor is 4.5, was 3"));
  assert_non_null(strstr(f->why[2], "|input number gets other bytes from scale.number"));
}

static void test_why_names_the_bytes_of_the_input(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  write_text(f->model, "abd");
  foresee(f, "3");
  assert_string_equal(f->why[0], "would run:|the file of parameter path changed (model)");
}

static void test_why_names_the_version_of_a_node(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  test_scale.version = 2;
  foresee(f, "3");
  assert_string_equal(f->states, "hrd");
  assert_string_equal(f->why[1], "would run:|the version of test.scale is 2, was 1");
}

static void test_why_names_the_version_of_a_library(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  strcpy(library_text, "1.0 avx512");
  foresee(f, "3");
  assert_string_equal(f->states, "hrd"); /* the reader does not use it */
  assert_string_equal(f->why[1], "would run:|library Ruler is 1.0 avx512, was 1.0");
}

static void test_why_names_the_format_of_keys(void **state) {
  fixture *f = *state;
  write_text(f->model, "abc");
  run_once(f, "3");
  /* What an earlier qmat would have left: the same records under keys of another format. */
  qmat_cache cache;
  qmat_cache_entry *entries;
  size_t count;
  open_cache(f, &cache);
  assert_true(qmat_cache_list(&cache, &entries, &count));
  for (size_t i = 0; i < count && entries[i].kind == QMAT_CACHE_RECORD; i++) {
    json_t *record = qmat_cache_record(&cache, &entries[i].digest);
    assert_non_null(record);
    json_t *items = json_object_get(record, "key");
    json_array_set_new(json_array_get(items, 0), 2, json_string("0"));
    qmat_digest key;
    assert_true(qmat_key_digest(items, &key));
    assert_true(qmat_cache_put_record(&cache, &key, record));
    json_decref(record);
    char path[256];
    snprintf(path, sizeof path, "%s/ac/%s", f->cache_folder, entries[i].name);
    assert_int_equal(unlink(path), 0);
  }
  qmat_free(entries);
  qmat_cache_close(&cache);
  foresee(f, "3");
  assert_string_equal(f->states, "rdd");
  assert_string_equal(f->why[0], "would run:|the key format is 2, was 0");
}

/* ---- looking after it ---- */

static void test_what_was_used_least_recently_is_deleted_first(void **state) {
  fixture *f = *state;
  qmat_context context = {0};
  qmat_cache cache;
  open_cache(f, &cache);
  qmat_value *values[10];
  json_t *stored[10];
  for (int i = 0; i < 10; i++) {
    bool added;
    test_ok(&context, test_report(&context, 10 + i, &values[i]));
    stored[i] = qmat_cache_put_value(&cache, values[i], &added);
    assert_non_null(stored[i]);
    assert_true(added);
    char path[256];
    blob_path(f, 10 + i, path);
    const struct timespec times[2] = {{.tv_sec = 1000 + i}, {.tv_sec = 1000 + i}};
    assert_int_equal(utimensat(AT_FDCWD, path, times, 0), 0);
  }
  qmat_cache_touch_stored(&cache, stored[0]);
  const uint64_t size = qmat_cache_stored_size(stored[0]);
  const qmat_cache_sweep sweep = qmat_cache_collect(&cache, 6 * size, false);
  assert_int_equal(sweep.deleted, 5); /* down to nine tenths of the limit */
  assert_int_equal(sweep.freed, 5 * size);
  for (int i = 0; i < 10; i++) {
    assert_int_equal(qmat_cache_has_stored(&cache, stored[i]), i == 0 || i > 5);
    json_decref(stored[i]);
    qmat_value_release(values[i]);
  }
  qmat_cache_close(&cache);
}

static void test_work_that_does_not_fit_finds_a_part_of_it_again(void **state) {
  fixture *f = *state;
  enum { RESULTS = 20, PASSES = 10 };
  qmat_context context = {0};
  qmat_cache cache;
  open_cache(f, &cache);
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  size_t hits = 0, deleted = 0, recent = 0;
  for (int turn = 0; turn < PASSES * RESULTS; turn++) {
    bool added;
    char path[256];
    qmat_value *value;
    test_ok(&context, test_report(&context, 10 + turn % RESULTS, &value));
    json_t *stored = qmat_cache_put_value(&cache, value, &added);
    hits += !added;
    blob_path(f, 10 + turn % RESULTS, path);
    const time_t used = now.tv_sec - 4 * (PASSES * RESULTS - turn);
    const struct timespec times[2] = {{.tv_sec = used}, {.tv_sec = used}};
    assert_int_equal(utimensat(AT_FDCWD, path, times, 0), 0);
    const qmat_cache_sweep sweep = qmat_cache_collect(&cache, 16 * qmat_cache_stored_size(stored), false);
    deleted += sweep.deleted;
    recent += sweep.recent;
    assert_true(qmat_cache_has_stored(&cache, stored)); /* what was just used stays */
    json_decref(stored);
    qmat_value_release(value);
  }
  assert_true(hits >= 20 && hits < 180);
  assert_true(deleted > 0 && recent == deleted);
  qmat_cache_close(&cache);
}

/* The file of how much the cache holds: its first line, and how many bytes follow. */
static void read_size_file(const fixture *f, uint64_t *total, size_t *counted) {
  char path[128], bytes[4096];
  snprintf(path, sizeof path, "%s/size", f->cache_folder);
  FILE *file = fopen(path, "rb");
  assert_non_null(file);
  const size_t size = fread(bytes, 1, sizeof bytes, file);
  fclose(file);
  assert_true(size >= 21 && bytes[20] == '\n');
  *total = strtoull(bytes, NULL, 10);
  *counted = size - 21;
}

static uint64_t listed_size(const fixture *f) {
  qmat_cache cache;
  qmat_cache_entry *entries;
  size_t count;
  uint64_t total = 0;
  open_cache(f, &cache);
  assert_true(qmat_cache_list(&cache, &entries, &count));
  for (size_t i = 0; i < count; i++) total += entries[i].size;
  qmat_free(entries);
  qmat_cache_close(&cache);
  return total;
}

/* A blob of 1,000 bytes that was last used in 1970. */
static void plant_blob(const fixture *f, char path[256]) {
  const struct timespec times[2] = {{.tv_sec = 1000}, {.tv_sec = 1000}};
  char bytes[1001];
  memset(bytes, 'x', 1000);
  bytes[1000] = 0;
  snprintf(path, 256, "%s/cas/%064d", f->cache_folder, 7);
  write_text(path, bytes);
  assert_int_equal(utimensat(AT_FDCWD, path, times, 0), 0);
}

static void test_the_folder_is_listed_only_when_it_may_be_above_its_size(void **state) {
  fixture *f = *state;
  char planted[256], size_file[128];
  uint64_t first, total;
  size_t counted;
  write_text(f->model, "abc");
  run_once(f, "3");
  read_size_file(f, &first, &counted);
  assert_int_equal(first, listed_size(f));
  assert_int_equal(counted, 0);
  plant_blob(f, planted);
  run_once(f, "4");
  read_size_file(f, &total, &counted);
  assert_int_equal(total, first); /* no listing */
  assert_int_equal(counted, 1);   /* a unit of 64 KiB for all that the run stored */
  run_once(f, "4");
  read_size_file(f, &total, &counted);
  assert_int_equal(counted, 1); /* nothing was stored */
  /* A damaged file, a cut one and none: the folder is listed. */
  static const char *const damaged[] = {"0000000000000000x000\n", "000", "", "-000000000000000001\n"};
  snprintf(size_file, sizeof size_file, "%s/size", f->cache_folder);
  for (size_t i = 0; i <= sizeof damaged / sizeof *damaged; i++) {
    char factor[8];
    if (i < sizeof damaged / sizeof *damaged)
      write_text(size_file, damaged[i]);
    else
      assert_int_equal(unlink(size_file), 0);
    snprintf(factor, sizeof factor, "%d", 5 + (int)i);
    run_once(f, factor);
    assert_string_equal(f->warning, "");
    read_size_file(f, &total, &counted);
    assert_int_equal(total, listed_size(f));
  }
  /* A limit that the size is above: the blob that was used least recently goes. */
  f->most_size = total - 500;
  run_once(f, "20");
  assert_int_equal(access(planted, F_OK), -1);
  read_size_file(f, &total, &counted);
  assert_int_equal(total, listed_size(f));
  /* Deleting all leaves no count behind. */
  qmat_cache cache;
  open_cache(f, &cache);
  qmat_cache_clear(&cache);
  qmat_cache_close(&cache);
  assert_int_equal(access(size_file, F_OK), -1);
}

static void test_what_killed_processes_stored_is_counted(void **state) {
  fixture *f = *state;
  uint64_t total;
  size_t counted;
  write_text(f->model, "abc");
  run_once(f, "3");
  for (int child = 0; child < 8; child++) {
    const pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid > 0) continue;
    qmat_cache cache;
    open_cache(f, &cache);
    for (int i = 0; i < 200; i++) qmat_cache_count(&cache, 1 << 15); /* and is killed */
    _exit(0);
  }
  int status;
  while (wait(&status) > 0) assert_int_equal(status, 0);
  read_size_file(f, &total, &counted);
  assert_int_equal(counted, 8 * 100);
  qmat_cache cache;
  f->most_size = (uint64_t)800 << 19; /* an eighth of it is counted */
  open_cache(f, &cache);
  assert_false(qmat_cache_may_be_full(&cache));
  qmat_cache_count(&cache, 1);
  assert_true(qmat_cache_may_be_full(&cache));
  qmat_cache_close(&cache);
  read_size_file(f, &total, &counted);
  assert_int_equal(counted, 0);
  assert_int_equal(total, listed_size(f));
}

static void test_one_process_sweeps_at_a_time(void **state) {
  fixture *f = *state;
  char planted[256], size_file[128];
  write_text(f->model, "abc");
  run_once(f, "3");
  plant_blob(f, planted);
  f->most_size = listed_size(f) - 500;
  snprintf(size_file, sizeof size_file, "%s/size", f->cache_folder);
  const int file = open(size_file, O_RDONLY);
  assert_int_equal(flock(file, LOCK_EX), 0);
  run_once(f, "4");
  assert_int_equal(access(planted, F_OK), 0); /* the other one is at it */
  close(file);
  run_once(f, "5");
  assert_int_equal(access(planted, F_OK), -1);
  /* A cache that is read only counts nothing. */
  uint64_t total;
  size_t counted, before;
  read_size_file(f, &total, &before);
  f->read_only = true;
  run_once(f, "6");
  read_size_file(f, &total, &counted);
  assert_int_equal(counted, before);
}

static void test_a_cache_too_small_for_its_work_is_told(void **state) {
  fixture *f = *state;
  char path[256];
  write_text(f->model, "abc");
  run_once(f, "3");
  f->most_size = listed_size(f);
  plant_blob(f, path);
  run_once(f, "4"); /* the planted blob is old, but does not suffice */
  assert_non_null(strstr(f->warning, "the cache is too small for this work: "));
  assert_non_null(strstr(f->warning, "--cache-size"));
  f->most_size *= 4;
  plant_blob(f, path);
  run_once(f, "5");
  assert_string_equal(f->warning, "");
}

static void test_temporaries_of_dead_writers_are_swept_and_others_stay(void **state) {
  fixture *f = *state;
  char dead[160], alive[160], foreign[160];
  write_text(f->model, "abc");
  run_once(f, "3");
  snprintf(dead, sizeof dead, "%s/tmp/12-3-4", f->cache_folder);
  snprintf(alive, sizeof alive, "%s/tmp/12-3-5", f->cache_folder);
  snprintf(foreign, sizeof foreign, "%s/tmp/notes.txt", f->cache_folder);
  write_text(dead, "half");
  write_text(alive, "half");
  write_text(foreign, "mine");
  const int file = open(alive, O_WRONLY);
  assert_int_equal(flock(file, LOCK_EX), 0);
  run_once(f, "4");
  assert_int_equal(access(dead, F_OK), -1);
  assert_int_equal(access(alive, F_OK), 0);
  qmat_cache cache;
  open_cache(f, &cache);
  qmat_cache_clear(&cache);
  qmat_cache_close(&cache);
  assert_int_equal(access(alive, F_OK), 0);
  assert_int_equal(access(foreign, F_OK), 0);
  assert_int_equal(count_entries(f, QMAT_CACHE_RECORD) + count_entries(f, QMAT_CACHE_BLOB), 0);
  close(file);
}

static void test_checking_finds_what_is_broken_and_what_is_incomplete(void **state) {
  fixture *f = *state;
  char path[256];
  write_text(f->model, "abc");
  run_once(f, "3");
  blob_path(f, 'a' + 'b' + 'c', path);
  damage(path, -6, false);
  size_t health[QMAT_CACHE_UNREADABLE + 1] = {0};
  qmat_cache cache;
  qmat_cache_entry *entries;
  size_t count;
  open_cache(f, &cache);
  assert_true(qmat_cache_list(&cache, &entries, &count));
  for (size_t i = count; i-- > 0;) health[qmat_cache_check(&cache, &entries[i])]++;
  qmat_free(entries);
  assert_int_equal(health[QMAT_CACHE_BROKEN], 1);
  assert_int_equal(health[QMAT_CACHE_INCOMPLETE], 1);
  assert_int_equal(health[QMAT_CACHE_SOUND], 4);
  qmat_cache_close(&cache);
}

/* A link to itself is a file that cannot be read, also for root. */
static void test_a_file_that_may_not_be_read_is_told_once_and_left_alone(void **state) {
  fixture *f = *state;
  char path[256];
  struct stat about;
  qmat_cache cache;
  qmat_cache_entry *entries;
  size_t count, unreadable = 0;
  write_text(f->model, "abc");
  run_once(f, "3");
  blob_path(f, 3 * ('a' + 'b' + 'c'), path);
  open_cache(f, &cache);
  assert_true(qmat_cache_list(&cache, &entries, &count));
  assert_int_equal(unlink(path), 0);
  assert_int_equal(symlink(path, path), 0);
  for (size_t i = 0; i < count; i++) unreadable += qmat_cache_check(&cache, &entries[i]) == QMAT_CACHE_UNREADABLE;
  assert_int_equal(unreadable, 1);
  assert_non_null(strstr(cache.warning, "cannot read the cache: "));
  qmat_free(entries);
  qmat_cache_close(&cache);
  run_once(f, "3");
  assert_true(f->result == 6 * ('a' + 'b' + 'c'));
  assert_int_equal(lstat(path, &about), 0);
  assert_true(S_ISLNK(about.st_mode));
  assert_int_equal(count_entries(f, QMAT_CACHE_BAD), 0);
}

static void test_a_broken_record_is_found_and_set_aside(void **state) {
  fixture *f = *state;
  char path[256];
  qmat_cache cache;
  qmat_cache_entry *entries;
  size_t count;
  write_text(f->model, "abc");
  run_once(f, "3");
  open_cache(f, &cache);
  assert_true(qmat_cache_list(&cache, &entries, &count));
  assert_int_equal(entries[0].kind, QMAT_CACHE_RECORD);
  snprintf(path, sizeof path, "%s/ac/%s", f->cache_folder, entries[0].name);
  damage(path, -6, false);
  assert_int_equal(qmat_cache_check(&cache, &entries[0]), QMAT_CACHE_BROKEN);
  assert_int_equal(qmat_cache_check(&cache, &entries[0]), QMAT_CACHE_SOUND); /* it is gone */
  assert_int_equal(count_entries(f, QMAT_CACHE_BAD), 1);
  qmat_free(entries);
  qmat_cache_close(&cache);
}

static void test_the_folder_says_that_it_is_a_cache(void **state) {
  fixture *f = *state;
  char path[128], text[64] = "";
  write_text(f->model, "abc");
  run_once(f, "3");
  snprintf(path, sizeof path, "%s/CACHEDIR.TAG", f->cache_folder);
  FILE *file = fopen(path, "rb");
  assert_non_null(file);
  assert_int_equal(fread(text, 1, 43, file), 43);
  fclose(file);
  assert_string_equal(text, "Signature: 8a477f597d28d172789f06886806bc55");
}

int main(void) {
#define CASE(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)
  const struct CMUnitTest tests[] = {
      CASE(test_a_second_run_runs_nothing_and_gives_the_same),
      CASE(test_a_changed_parameter_reuses_what_stands_before_it),
      CASE(test_equal_bytes_stop_the_wave),
      CASE(test_only_the_bytes_of_a_file_count),
      CASE(test_a_file_that_changes_before_it_is_read_is_not_kept),
      CASE(test_another_folder_hits_and_another_name_misses),
      CASE(test_side_files_count),
      CASE(test_equal_files_that_lead_to_different_ones_are_all_found_again),
      CASE(test_forced_nodes_run_and_are_the_same),
      CASE(test_a_node_runs_once_for_each_value_of_a_list_and_what_is_known_of_one_stays),
      CASE(test_values_that_a_node_cannot_work_on_are_left_out_but_not_all_of_them),
      CASE(test_a_list_is_kept_as_its_items_and_each_of_them_once),
      CASE(test_lists_of_different_lengths_do_not_go_together),
      CASE(test_a_node_that_breaks_its_promise_is_named),
      CASE(test_a_damaged_blob_is_a_miss),
      CASE(test_a_blob_that_is_gone_is_a_miss),
      CASE(test_a_damaged_record_is_a_miss),
      CASE(test_a_record_under_another_key_is_not_believed),
      CASE(test_a_cache_that_is_read_only_is_used_and_left_alone),
      CASE(test_a_node_that_makes_other_bytes_when_its_blob_is_lost_starts_the_run_again),
      CASE(test_a_node_that_runs_again_for_one_output_leaves_the_other_as_it_is),
      CASE(test_a_cache_that_cannot_be_made_is_told_once_and_the_run_goes_on),
      CASE(test_a_file_is_no_cache),
      CASE(test_a_key_is_the_digest_of_its_items_with_their_lengths),
      CASE(test_every_parameter_and_every_input_of_every_node_changes_its_key),
      CASE(test_folders_are_not_in_a_key),
      CASE(test_why_names_a_parameter),
      CASE(test_why_names_the_bytes_of_the_input),
      CASE(test_why_names_the_version_of_a_node),
      CASE(test_why_names_the_version_of_a_library),
      CASE(test_why_names_the_format_of_keys),
      CASE(test_what_was_used_least_recently_is_deleted_first),
      CASE(test_work_that_does_not_fit_finds_a_part_of_it_again),
      CASE(test_the_folder_is_listed_only_when_it_may_be_above_its_size),
      CASE(test_what_killed_processes_stored_is_counted),
      CASE(test_one_process_sweeps_at_a_time),
      CASE(test_a_cache_too_small_for_its_work_is_told),
      CASE(test_temporaries_of_dead_writers_are_swept_and_others_stay),
      CASE(test_checking_finds_what_is_broken_and_what_is_incomplete),
      CASE(test_a_file_that_may_not_be_read_is_told_once_and_left_alone),
      CASE(test_a_broken_record_is_found_and_set_aside),
      CASE(test_the_folder_says_that_it_is_a_cache),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
