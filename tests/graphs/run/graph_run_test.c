/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <dirent.h>

#include "graphs/run/run_report.h"
#include "graphs/run/run_summary.h"
#include "tests/graphs/test_nodes.h"

static const char sum_graph[] =
    "qmat: 1\n"
    "nodes:\n"
    "  text:  { type: test.print, in: { number: total.sum } }\n"
    "  total: { type: test.add, in: { first: one.number, second: two.number } }\n"
    "  two:   { type: test.number, params: { value: 2 } }\n"
    "  one:   { type: test.number, params: { value: 1 } }\n"
    "outputs: { text: text.file, sum: total.sum }\n";

static const char ball_graph[] =
    "qmat: 1\n"
    "inputs: { model: model.path }\n"
    "nodes:\n"
    "  model: { type: test.mesh, params: { path: tetrahedron } }\n"
    "  ball:  { type: test.ball, in: { mesh: model.mesh } }\n"
    "  text:  { type: test.print, in: { number: ball.report } }\n"
    "outputs: { ball: ball.medial, text: text.file }\n";

/* A folder of its own for every test, and where its files are. */
typedef struct fixture {
  qmat_context context;
  qmat_graph graph;
  qmat_run run;
  char folder[40], paths[4][80];
  char log[256]; /* ids of the nodes that ran */
} fixture;

static int set_up(void **state) {
  fixture *f = calloc(1, sizeof *f);
  *state = f;
  strcpy(f->folder, "/tmp/qmat-run-XXXXXX");
  return mkdtemp(f->folder) ? 0 : -1;
}

static int tear_down(void **state) {
  fixture *f = *state;
  char command[80];
  qmat_run_uninit(&f->run);
  qmat_graph_uninit(&f->graph);
  qmat_context_uninit(&f->context);
  snprintf(command, sizeof command, "rm -r %s", f->folder);
  int result = system(command);
  free(f);
  return result;
}

static const char *in_folder(fixture *f, int index, const char *name) {
  snprintf(f->paths[index], sizeof f->paths[index], "%s/%s", f->folder, name);
  return f->paths[index];
}

static size_t count_files(const fixture *f) {
  DIR *folder = opendir(f->folder);
  assert_non_null(folder);
  size_t count = 0;
  for (struct dirent *entry; (entry = readdir(folder));)
    if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0) count++;
  closedir(folder);
  return count;
}

static void check_file(const char *path, const char *wanted) {
  char text[4096] = "";
  FILE *file = fopen(path, "rb");
  if (!file) fail_msg("there is no file %s", path);
  text[fread(text, 1, sizeof text - 1, file)] = 0;
  fclose(file);
  assert_string_equal(text, wanted);
}

static void note_start(void *user, const qmat_run *run, size_t step) {
  fixture *f = user;
  size_t used = strlen(f->log);
  snprintf(f->log + used, sizeof f->log - used, "%s ", run->graph->nodes[run->steps[step].node].id);
}

static void read_graph(fixture *f, const char *text) {
  test_ok(&f->context, test_read(&f->context, text, &f->graph));
}

static qmat_status plan(fixture *f, qmat_run_options options) {
  return qmat_run_plan(&f->context, &f->graph, &options, &f->run);
}

static qmat_status execute(fixture *f) {
  const qmat_run_observer observer = {.user = f, .started = note_start};
  return qmat_run_execute(&f->context, &f->run, &observer);
}

static void run_all(fixture *f, qmat_run_options options) {
  test_ok(&f->context, plan(f, options));
  test_ok(&f->context, execute(f));
  test_ok(&f->context, qmat_run_make_files(&f->context, &f->run));
  test_ok(&f->context, qmat_run_write(&f->context, &f->run));
}

static void test_nodes_run_after_what_they_need_in_the_order_of_the_file(void **state) {
  fixture *f = *state;
  read_graph(f, sum_graph);
  run_all(f, (qmat_run_options){0});
  assert_string_equal(f->log, "two one total text ");
  assert_int_equal(count_files(f), 0);
}

static void test_values_are_released_unless_they_are_wanted(void **state) {
  fixture *f = *state;
  read_graph(f, sum_graph);
  const qmat_run_port want = {1, 0};
  run_all(f, (qmat_run_options){.wants = &want, .want_count = 1});
  const qmat_value *sum = qmat_run_value(&f->run, 1, 0);
  assert_non_null(sum);
  assert_true(test_value(sum) == 3);
  assert_null(qmat_run_value(&f->run, 2, 0));
  assert_null(qmat_run_value(&f->run, 0, 0));
}

static void test_only_what_is_wanted_runs(void **state) {
  fixture *f = *state;
  read_graph(f, sum_graph);
  const qmat_run_port want = {3, 0};
  run_all(f, (qmat_run_options){.wants = &want, .want_count = 1, .only_wanted = true});
  assert_string_equal(f->log, "one ");
  assert_true(test_value(qmat_run_value(&f->run, 3, 0)) == 1);
}

/* Values, such as reports, are made all the same. */
static void test_files_that_are_not_saved_are_not_made(void **state) {
  fixture *f = *state;
  static const char two_files[] =
      "qmat: 1\n"
      "nodes:\n"
      "  one:  { type: test.number, params: { value: 1 } }\n"
      "  two:  { type: test.number, params: { value: 2 } }\n"
      "  near: { type: test.print, in: { number: one.number } }\n"
      "  far:  { type: test.print, in: { number: two.number } }\n"
      "outputs: { near: near.file, far: far.file }\n";
  read_graph(f, two_files);
  const qmat_run_save save = {0, in_folder(f, 0, "near.txt")};
  run_all(f, (qmat_run_options){.saves = &save, .save_count = 1});
  assert_string_equal(f->log, "one near ");
  qmat_run_uninit(&f->run);
  f->log[0] = 0;
  run_all(f, (qmat_run_options){0});
  assert_string_equal(f->log, "one two near far ");
}

static void test_a_run_stops_at_the_named_node(void **state) {
  fixture *f = *state;
  read_graph(f, sum_graph);
  run_all(f, (qmat_run_options){.to_node = "total"});
  assert_string_equal(f->log, "two one total ");
  qmat_run_uninit(&f->run);
  assert_int_equal(plan(f, (qmat_run_options){.to_node = "totl"}), QMAT_ERROR_USAGE);
  assert_non_null(strstr(f->context.error.hint, "'total'"));
  qmat_run_uninit(&f->run);
  const qmat_run_save save = {0, in_folder(f, 0, "a.txt")};
  assert_int_equal(plan(f, (qmat_run_options){.to_node = "total", .saves = &save, .save_count = 1}), QMAT_ERROR_USAGE);
  assert_non_null(strstr(f->context.error.message, "needs nodes after 'total'"));
}

static void test_the_last_node_runs_once_a_format_and_the_others_once(void **state) {
  fixture *f = *state;
  read_graph(f, sum_graph);
  const qmat_run_save saves[] = {{0, in_folder(f, 0, "a.txt")},
                                 {0, in_folder(f, 1, "b.CSV")},
                                 {0, in_folder(f, 2, "c.txt")},
                                 {1, in_folder(f, 3, "sum.json")}};
  run_all(f, (qmat_run_options){.saves = saves, .save_count = 4});
  assert_string_equal(f->log, "two one total text text ");
  check_file(f->paths[0], "number 3\n");
  check_file(f->paths[1], "number,3\n");
  check_file(f->paths[2], "number 3\n");
  check_file(f->paths[3], "{\n  \"value\": 3.0\n}\n");
  assert_int_equal(count_files(f), 4);
}

static void test_paths_in_the_graph_are_used_unless_others_are_given(void **state) {
  fixture *f = *state;
  char text[512];
  snprintf(text, sizeof text,
           "qmat: 1\nnodes:\n  n: { type: test.number }\n  p: { type: test.print, in: { number: n.number } }\n"
           "outputs: { t: { from: p.file, path: %s/in-file.csv } }\n",
           f->folder);
  read_graph(f, text);
  run_all(f, (qmat_run_options){0});
  check_file(in_folder(f, 0, "in-file.csv"), "number,1\n");
  unlink(f->paths[0]);
  qmat_run_uninit(&f->run);
  const qmat_run_save save = {0, in_folder(f, 1, "given.txt")};
  run_all(f, (qmat_run_options){.saves = &save, .save_count = 1});
  check_file(f->paths[1], "number 1\n");
  assert_int_equal(count_files(f), 1);
}

static void check_refused(fixture *f, const qmat_run_save *saves, size_t count, qmat_status status,
                          const char *message) {
  qmat_run_uninit(&f->run);
  qmat_status got = plan(f, (qmat_run_options){.saves = saves, .save_count = count});
  char line[2048];
  qmat_error_format(&f->context.error, line, sizeof line);
  if (got != status || !strstr(line, message))
    fail_msg("wanted '%s', got %s: %s", message, qmat_status_name(got), line);
}

static void test_bad_output_paths_are_refused_before_anything_runs(void **state) {
  fixture *f = *state;
  read_graph(f, sum_graph);
  const qmat_run_save unknown = {0, in_folder(f, 0, "a.glb")}, none = {0, in_folder(f, 1, "noending")},
                      report = {1, in_folder(f, 2, "a.txt")}, empty = {0, ""};
  check_refused(f, &unknown, 1, QMAT_ERROR_USAGE, "cannot be written as '.glb' (known endings: .txt, .csv, .pair)");
  check_refused(f, &none, 1, QMAT_ERROR_USAGE, "known endings: .txt, .csv, .pair");
  check_refused(f, &report, 1, QMAT_ERROR_USAGE, "known endings: .json");
  check_refused(f, &empty, 1, QMAT_ERROR_USAGE, "is empty");
  char roundabout[80];
  snprintf(roundabout, sizeof roundabout, "%s/./a.txt", f->folder);
  const qmat_run_save twice[] = {{0, in_folder(f, 0, "a.txt")}, {0, roundabout}};
  check_refused(f, twice, 2, QMAT_ERROR_USAGE, "two outputs have the path");
  const qmat_run_save lost = {0, in_folder(f, 0, "missing/a.txt")}, folder = {0, in_folder(f, 1, "d.txt")};
  check_refused(f, &lost, 1, QMAT_ERROR_IO, "cannot use the output folder");
  char command[100];
  snprintf(command, sizeof command, "mkdir %s", f->paths[1]);
  assert_int_equal(system(command), 0);
  check_refused(f, &folder, 1, QMAT_ERROR_IO, "the output path is a folder");
}

static void test_inputs_are_never_overwritten(void **state) {
  fixture *f = *state;
  const char *input = in_folder(f, 0, "input.txt");
  FILE *file = fopen(input, "wb");
  assert_non_null(file);
  fputs("keep", file);
  fclose(file);
  char assignment[120];
  snprintf(assignment, sizeof assignment, "one.path=%s", input);
  read_graph(f, sum_graph);
  test_ok(&f->context, qmat_graph_assign(&f->context, &f->graph, assignment));
  const qmat_run_save save = {0, input};
  check_refused(f, &save, 1, QMAT_ERROR_USAGE, "would overwrite the file that node 'one' reads");
  qmat_run_uninit(&f->run);
  test_ok(&f->context, plan(f, (qmat_run_options){0}));
  assert_int_equal(qmat_run_check_path(&f->context, &f->run, "the report", input), QMAT_ERROR_USAGE);
  check_file(input, "keep");
}

static void test_a_side_file_never_overwrites_an_input(void **state) {
  fixture *f = *state;
  const char *input = in_folder(f, 0, "side.bin");
  FILE *file = fopen(input, "wb");
  assert_non_null(file);
  fputs("keep", file);
  fclose(file);
  char assignment[120];
  snprintf(assignment, sizeof assignment, "one.path=%s", input);
  read_graph(f, sum_graph);
  test_ok(&f->context, qmat_graph_assign(&f->context, &f->graph, assignment));
  const qmat_run_save save = {0, in_folder(f, 1, "a.pair")};
  test_ok(&f->context, plan(f, (qmat_run_options){.saves = &save, .save_count = 1}));
  test_ok(&f->context, execute(f));
  assert_int_equal(qmat_run_make_files(&f->context, &f->run), QMAT_ERROR_USAGE);
  check_file(input, "keep");
  assert_int_equal(count_files(f), 1);
}

/* Two outputs with a side file of the same name: equal ones are one file, others would overwrite each other. */
static void test_side_files_of_two_outputs_do_not_collide(void **state) {
  fixture *f = *state;
  for (int equal = 0; equal < 2; equal++) {
    char graph[256];
    snprintf(graph, sizeof graph,
             "qmat: 1\nnodes:\n  n: { type: test.number }\n  p: { type: test.print, in: { number: n.number } }\n"
             "  q: { type: test.print, params: { label: %s }, in: { number: n.number } }\noutputs: { t: p.file, s: "
             "q.file }\n",
             equal ? "number" : "other");
    qmat_graph_uninit(&f->graph);
    read_graph(f, graph);
    const qmat_run_save saves[] = {{0, in_folder(f, 0, "a.pair")}, {1, in_folder(f, 1, "b.pair")}};
    test_ok(&f->context, plan(f, (qmat_run_options){.saves = saves, .save_count = 2}));
    test_ok(&f->context, execute(f));
    test_ok(&f->context, qmat_run_make_files(&f->context, &f->run));
    assert_int_equal(qmat_run_write(&f->context, &f->run), equal ? QMAT_OK : QMAT_ERROR_IO);
    assert_int_equal(count_files(f), equal ? 3 : 0);
    qmat_run_uninit(&f->run);
  }
}

static void test_a_failing_node_leaves_no_file_and_names_itself(void **state) {
  fixture *f = *state;
  read_graph(f,
             "qmat: 1\nnodes:\n  n: { type: test.number }\n  p: { type: test.print, in: { number: n.number } }\n"
             "  bad: { type: test.fail, in: { first: n.number } }\noutputs: { t: p.file, s: bad.sum }\n");
  const qmat_run_save save = {0, in_folder(f, 0, "a.txt")};
  test_ok(&f->context, plan(f, (qmat_run_options){.saves = &save, .save_count = 1}));
  assert_int_equal(execute(f), QMAT_ERROR_GEOMETRY);
  assert_string_equal(f->log, "n p bad ");
  assert_int_equal(count_files(f), 0);
  char line[512];
  qmat_error_format(&f->context.error, line, sizeof line);
  assert_string_equal(line, "node 'bad' (test.fail): digit 7: the number is not round");
  json_t *report = qmat_error_report(&f->context.error), *error = json_object_get(report, "error");
  assert_string_equal(json_string_value(json_object_get(error, "status")), "geometry");
  assert_string_equal(json_string_value(json_object_get(error, "node")), "bad");
  assert_int_equal(json_integer_value(json_object_get(error, "element")), 7);
  assert_string_equal(json_string_value(json_object_get(error, "text")), line);
  assert_true(json_is_null(json_object_get(error, "file")));
  json_decref(report);
}

static bool stop_at_once(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                         const char *unit) {
  (void)node_type;
  (void)total;
  (void)unit;
  return !(strcmp(node_id, (const char *)user) == 0 && (done > 3 || strcmp(node_id, "wait") != 0));
}

static void test_a_run_is_cancelled_inside_and_between_nodes(void **state) {
  fixture *f = *state;
  read_graph(f,
             "qmat: 1\nnodes: { n: { type: test.number }, wait: { type: test.wait } }\n"
             "outputs: { a: n.number, b: wait.sum }\n");
  const qmat_run_save save = {0, in_folder(f, 0, "a.json")};
  static const char *const where[] = {"n", "wait"};
  for (int i = 0; i < 2; i++) {
    qmat_run_uninit(&f->run);
    f->context.progress = stop_at_once;
    f->context.progress_user = (void *)where[i];
    test_ok(&f->context, plan(f, (qmat_run_options){.saves = &save, .save_count = 1}));
    assert_int_equal(execute(f), QMAT_CANCELLED);
    assert_string_equal(f->context.error.node_id, where[i]);
    assert_int_equal(count_files(f), 0);
  }
}

static void test_rules_between_parameters_are_checked_before_the_run(void **state) {
  fixture *f = *state;
  read_graph(f, sum_graph);
  test_ok(&f->context, qmat_graph_assign(&f->context, &f->graph, "one.repeat=2"));
  test_ok(&f->context, qmat_graph_assign(&f->context, &f->graph, "one.negate=true"));
  assert_int_equal(plan(f, (qmat_run_options){0}), QMAT_ERROR_USAGE);
  assert_string_equal(f->context.error.node_id, "one");
  assert_string_equal(f->context.error.file, "");
}

static void test_given_values_replace_a_node(void **state) {
  fixture *f = *state;
  read_graph(f, sum_graph);
  qmat_value *value;
  test_ok(&f->context, test_report(&f->context, 40, &value));
  const qmat_run_given given = {3, 0, value};
  const qmat_run_port want = {1, 0};
  test_ok(&f->context, plan(f, (qmat_run_options){.given = &given, .given_count = 1, .wants = &want, .want_count = 1}));
  qmat_value_release(value);
  test_ok(&f->context, execute(f));
  assert_string_equal(f->log, "two total text ");
  assert_true(test_value(qmat_run_value(&f->run, 1, 0)) == 42);
}

static const char pick_graph[] =
    "qmat: 1\n"
    "inputs: { value: one.value }\n"
    "nodes:\n"
    "  one:   { type: test.number, params: { value: %s } }\n"
    "  two:   { type: test.number, params: { value: 2 } }\n"
    "  twice: { type: test.add, in: { first: two.number, second: two.number } }\n"
    "  pick:  { type: test.pick, in: { first: one.number, second: twice.sum } }\n"
    "outputs: { sum: pick.sum }\n";

static void pick(fixture *f, const char *value, qmat_run_options options, double sum) {
  char text[512];
  snprintf(text, sizeof text, pick_graph, value);
  qmat_run_uninit(&f->run);
  qmat_graph_uninit(&f->graph);
  f->log[0] = 0;
  read_graph(f, text);
  const qmat_run_port wants[2] = {{3, 0}, {2, 0}};
  options.wants = wants;
  options.want_count += 1;
  run_all(f, options);
  assert_true(test_value(qmat_run_value(&f->run, 3, 0)) == sum);
}

static void test_what_a_value_makes_unread_does_not_run_and_is_no_part_of_the_run(void **state) {
  fixture *f = *state;
  pick(f, "0.5", (qmat_run_options){0}, 4);
  assert_string_equal(f->log, "one two twice pick ");
  pick(f, "1", (qmat_run_options){0}, 1);
  assert_string_equal(f->log, "one pick ");
  assert_int_equal(f->run.step_count, 2);
  /* It is wanted for itself. */
  pick(f, "1", (qmat_run_options){.want_count = 1}, 1);
  assert_string_equal(f->log, "one two twice pick ");
  assert_true(test_value(qmat_run_value(&f->run, 2, 0)) == 4);
  /* It is given, and so is what decides. */
  qmat_value *value;
  test_ok(&f->context, test_report(&f->context, 7, &value));
  const qmat_run_given given = {0, 0, value};
  pick(f, "0.5", (qmat_run_options){.given = &given, .given_count = 1}, 7);
  qmat_value_release(value);
  assert_string_equal(f->log, "pick ");
}

static void test_the_report_tells_every_node_file_and_the_summary(void **state) {
  fixture *f = *state;
  read_graph(f, ball_graph);
  test_ok(&f->context, qmat_graph_assign(&f->context, &f->graph, "text.label=L"));
  /* The printing node reads "value", which the ball's report does not have: it prints 0. */
  const qmat_run_save save = {1, in_folder(f, 0, "ball.csv")};
  const double start = qmat_clock_seconds();
  run_all(f, (qmat_run_options){.saves = &save, .save_count = 1});
  const double taken = qmat_clock_seconds() - start;
  json_t *report = qmat_run_report(&f->context, &f->run);
  assert_non_null(report);
  const char *version, *graph, *input, *id, *type, *path, *format, *sha256, *label, *text, *name;
  json_t *nodes;
  int node_version, spheres, cones, bytes, triangles;
  double seconds;
  assert_int_equal(json_unpack(report, "{s:s, s:s, s:s, s:F, s:o}", "qmat", &version, "graph", &graph, "input", &input,
                               "seconds", &seconds, "nodes", &nodes),
                   0);
  assert_string_equal(version, QMAT_VERSION);
  assert_string_equal(graph, "g.yaml");
  assert_string_equal(input, "tetrahedron");
  assert_true(seconds > 0 && seconds <= taken);
  assert_int_equal(json_array_size(nodes), 3);
  assert_int_equal(json_unpack(json_array_get(nodes, 1), "{s:s, s:s, s:i, s:{s:{s:i, s:i, s:s}}, s:{s:i}}", "id", &id,
                               "type", &type, "version", &node_version, "outputs", "medial", "spheres", &spheres,
                               "cones", &cones, "digest", &sha256, "report", "spheres", &spheres),
                   0);
  assert_string_equal(id, "ball");
  assert_string_equal(type, "test.ball");
  assert_int_equal(node_version, 1);
  assert_int_equal(spheres, 1);
  assert_int_equal(cones, 0);
  assert_int_equal(strlen(sha256), 64);
  assert_int_equal(
      json_unpack(json_array_get(nodes, 2), "{s:{s:s, s:s}}", "params", "format", &format, "label", &label), 0);
  assert_string_equal(format, "csv");
  assert_string_equal(label, "L");
  assert_int_equal(json_unpack(json_array_get(json_object_get(report, "outputs"), 0), "{s:s, s:s, s:s, s:i, s:s}",
                               "name", &name, "path", &path, "format", &format, "bytes", &bytes, "sha256", &sha256),
                   0);
  assert_string_equal(name, "text");
  assert_string_equal(path, f->paths[0]);
  assert_string_equal(format, "csv");
  assert_int_equal(bytes, 4);
  /* printf 'L,0\n' | sha256sum */
  assert_string_equal(sha256, "a763d8a221db10f076b8511edc192f7ed7c8602f24d3483435b9e86bbd81d70d");
  assert_int_equal(json_unpack(json_object_get(report, "summary"), "{s:i, s:s, s:i, s:s}", "spheres", &spheres, "text",
                               &text, "triangles", &triangles, "name", &name),
                   0);
  assert_string_equal(name, "tetrahedron");
  assert_int_equal(triangles, 4);
  assert_string_equal(
      text,
      "tetrahedron: 1 sphere describes 4 triangles; surface to envelope 0.98 %, envelope outside of the "
      "solid 0 % of the diagonal");
  json_decref(report);
}

static void fruit_sentence(const char *name, const json_t *summary, char *text, size_t size) {
  char *json = json_dumps(summary, JSON_SORT_KEYS | JSON_COMPACT);
  assert_non_null(json);
  snprintf(text, size, "%s %s", name, json);
  free(json);
}

/* The runner merges what a node declares, whatever it is called. */
static void test_the_reports_of_several_meshes_become_one_summary(void **state) {
  (void)state;
  static const qmat_summary_entry entries[] = {
      {"apples", "apples", QMAT_SUMMARY_SUM},  {"bruise", "bruise", QMAT_SUMMARY_BOUND},
      {"ripe", NULL, QMAT_SUMMARY_ALL},        {"wormy", NULL, QMAT_SUMMARY_ANY},
      {"triangles", NULL, QMAT_SUMMARY_INPUT}, {0}};
  static const qmat_report_summary type = {entries, fruit_sentence};
  const qmat_node fruit = {.name = "test.fruit", .report_summary = &type};
  qmat_graph_node node = {.id = "fruit", .type = &fruit};
  const qmat_graph graph = {.nodes = &node, .node_count = 1};
  static const struct {
    const char *report, *text; /* NULL: no summary */
  } cases[] = {
      {"{'apples': 3, 'bruise': 0.25, 'ripe': true, 'wormy': false, 'pears': 9}",
       "x {'apples':3,'bruise':0.25,'name':'x','node':'fruit','ripe':true,'triangles':0}"},
      {"{'meshes': [{'report': {'apples': 3, 'bruise': 0.25, 'ripe': true, 'wormy': true}}, {'failure': 'no tree'},"
       " {'report': {'apples': 4, 'bruise': 0.5, 'ripe': false}}]}",
       "x {'apples':7,'bruise':0.5,'failures':1,'meshes':2,'name':'x','node':'fruit','ripe':false,'triangles':0,"
       "'wormy':true}"},
      {"{'meshes': [{'report': {'apples': 3, 'bruise': 0.5, 'ripe': true}}, {'report': {'apples': 4, 'bruise': "
       "0.25}}]}",
       "x {'apples':7,'bruise':0.5,'meshes':2,'name':'x','node':'fruit','triangles':0}"},
      {"{'meshes': [{'report': {'apples': 3, 'bruise': 0.5}},"
       " {'report': {'apples': 4, 'bruise': 0.25, 'ripe': true}}]}",
       "x {'apples':7,'bruise':0.5,'meshes':2,'name':'x','node':'fruit','triangles':0}"},
      {"{'apples': 3}", NULL},
      {"{'apples': -3, 'bruise': 0}", NULL},
      {"{'apples': 3, 'bruise': 'none'}", NULL},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char report[512], expected[512], text[512] = "";
    snprintf(report, sizeof report, "%s", cases[i].report);
    for (char *c = report; *c; c++)
      if (*c == '\'') *c = '"';
    qmat_run_step step = {.done = true, .report = json_loads(report, 0, NULL)};
    assert_non_null(step.report);
    const qmat_run run = {.name = "x", .graph = &graph, .steps = &step, .step_count = 1};
    json_t *summary = qmat_run_summarise(&run, 0, text, sizeof text);
    assert_int_equal(summary != NULL, cases[i].text != NULL);
    snprintf(expected, sizeof expected, "%s", cases[i].text ? cases[i].text : "");
    for (char *c = expected; *c; c++)
      if (*c == '\'') *c = '"';
    assert_string_equal(text, expected);
    json_decref(summary);
    json_decref(step.report);
  }
}

static void test_two_runs_give_the_same_digests(void **state) {
  fixture *f = *state;
  read_graph(f, ball_graph);
  qmat_digest first[2];
  for (int round = 0; round < 2; round++) {
    qmat_run_uninit(&f->run);
    run_all(f, (qmat_run_options){0});
    assert_int_equal(f->run.step_count, 3);
    if (round == 0) memcpy(first, f->run.steps[1].made, sizeof first[0]);
  }
  assert_memory_equal(&first[0], &f->run.steps[1].made[0].digest, sizeof first[0]);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)

int main(void) {
  const struct CMUnitTest tests[] = {
      TEST(test_nodes_run_after_what_they_need_in_the_order_of_the_file),
      TEST(test_values_are_released_unless_they_are_wanted),
      TEST(test_only_what_is_wanted_runs),
      TEST(test_files_that_are_not_saved_are_not_made),
      TEST(test_a_run_stops_at_the_named_node),
      TEST(test_the_last_node_runs_once_a_format_and_the_others_once),
      TEST(test_paths_in_the_graph_are_used_unless_others_are_given),
      TEST(test_bad_output_paths_are_refused_before_anything_runs),
      TEST(test_inputs_are_never_overwritten),
      TEST(test_a_side_file_never_overwrites_an_input),
      TEST(test_side_files_of_two_outputs_do_not_collide),
      TEST(test_a_failing_node_leaves_no_file_and_names_itself),
      TEST(test_a_run_is_cancelled_inside_and_between_nodes),
      TEST(test_rules_between_parameters_are_checked_before_the_run),
      TEST(test_given_values_replace_a_node),
      TEST(test_what_a_value_makes_unread_does_not_run_and_is_no_part_of_the_run),
      TEST(test_the_report_tells_every_node_file_and_the_summary),
      TEST(test_the_reports_of_several_meshes_become_one_summary),
      TEST(test_two_runs_give_the_same_digests),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
