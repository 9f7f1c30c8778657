/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/graphs/test_nodes.h"
#include "tests/locale.h"

static const char good_yaml[] =
    "qmat: 1\n"
    "inputs: { start: one.value }\n"
    "nodes:\n"
    "  total: { type: test.add, in: { first: one.number, second: two.number } }\n"
    "  one:   { type: test.number, params: { value: 2.5, repeat: 2 } }\n"
    "  two:\n"
    "    type: test.number   # a comment\n"
    "    params:\n"
    "      value: 1%\n"
    "      path: data/x.off\n"
    "  text:  { type: test.print, in: { number: total.sum } }\n"
    "outputs:\n"
    "  sum: total.sum\n"
    "  text: { from: text.file, path: out.csv }\n";

static const char good_json[] =
    "{\"qmat\": 1, \"inputs\": {\"start\": \"one.value\"},\n"
    " \"nodes\": {\n"
    "  \"total\": {\"type\": \"test.add\", \"in\": {\"first\": \"one.number\", \"second\": \"two.number\"}},\n"
    "  \"one\": {\"type\": \"test.number\", \"params\": {\"value\": 2.5, \"repeat\": 2}},\n"
    "  \"two\": {\"type\": \"test.number\", \"params\": {\"value\": \"1%\", \"path\": \"data/x.off\"}},\n"
    "  \"text\": {\"type\": \"test.print\", \"in\": {\"number\": \"total.sum\"}}},\n"
    " \"outputs\": {\"sum\": \"total.sum\", \"text\": {\"from\": \"text.file\", \"path\": \"out.csv\"}}}\n";

static void check_good_graph(const qmat_graph *graph) {
  assert_int_equal(graph->node_count, 4);
  assert_string_equal(graph->nodes[0].id, "total");
  assert_ptr_equal(graph->nodes[0].type, &test_add);
  assert_int_equal(graph->nodes[0].links[0].node, 1);
  assert_int_equal(graph->nodes[0].links[1].node, 2);
  const number_params *one = graph->nodes[1].params, *two = graph->nodes[2].params;
  assert_true(one->value == 2.5 && one->repeat == 2 && !one->negate && !one->path);
  assert_true(two->value == 0.01 && two->repeat == 1);
  assert_int_equal(graph->input_count, 1);
  assert_string_equal(graph->inputs[0].name, "start");
  assert_int_equal(graph->inputs[0].param_count, 1);
  assert_int_equal(graph->inputs[0].params[0].node, 1);
  assert_int_equal(graph->output_count, 2);
  assert_string_equal(graph->outputs[1].name, "text");
  assert_int_equal(graph->outputs[1].node, 3);
  static const size_t order[] = {1, 2, 0, 3};
  for (size_t i = 0; i < 4; i++) assert_int_equal(graph->order[i], order[i]);
}

static void test_a_yaml_graph_is_read_as_written(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_graph graph;
  test_ok(&context, test_read(&context, good_yaml, &graph));
  check_good_graph(&graph);
  assert_string_equal(((const number_params *)graph.nodes[2].params)->path, "data/x.off");
  assert_string_equal(graph.outputs[1].path, "out.csv");
  assert_null(graph.outputs[0].path);
  qmat_graph_uninit(&graph);
  qmat_context_uninit(&context);
}

static void test_a_json_graph_equals_the_yaml_graph(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_graph graph;
  test_ok(&context, test_read(&context, good_json, &graph));
  check_good_graph(&graph);
  qmat_graph_uninit(&graph);
  qmat_context_uninit(&context);
}

static void test_paths_are_relative_to_the_graph_file_and_set_ones_are_not(void **state) {
  (void)state;
  char folder[] = "/tmp/qmat-graph-XXXXXX", path[64];
  assert_non_null(mkdtemp(folder));
  snprintf(path, sizeof path, "%s/g.yaml", folder);
  FILE *file = fopen(path, "wb");
  assert_non_null(file);
  fputs(good_yaml, file);
  fclose(file);
  qmat_context context = {0};
  qmat_graph graph;
  test_ok(&context, qmat_graph_read_file(&context, &test_registry, path, &graph));
  char wanted[96];
  snprintf(wanted, sizeof wanted, "%s/data/x.off", folder);
  assert_string_equal(((const number_params *)graph.nodes[2].params)->path, wanted);
  snprintf(wanted, sizeof wanted, "%s/out.csv", folder);
  assert_string_equal(graph.outputs[1].path, wanted);
  test_ok(&context, qmat_graph_assign(&context, &graph, "two.path=here.off"));
  assert_string_equal(((const number_params *)graph.nodes[2].params)->path, "here.off");
  qmat_graph_uninit(&graph);
  unlink(path);
  rmdir(folder);
  qmat_context_uninit(&context);
}

typedef struct mistake {
  const char *text;
  int line, column;
  const char *message, *hint; /* parts of them; NULL: no hint */
} mistake;

#define HEAD "qmat: 1\nnodes:\n"

static const mistake mistakes[] = {
    /* The shape of the file. */
    {"", 1, 1, "empty", NULL},
    {"# nothing\n", 1, 1, "empty", NULL},
    {"~", 1, 1, "empty", NULL},
    {"hello", 1, 1, "has to be a mapping", "qmat: 1"},
    {"qmat: 1\nnodes: {\n  a: b\n", 4, 1, "not YAML", NULL},
    {"qmat: 1\n\tnodes: 3\n", 2, 1, "not YAML", NULL},
    {"qmat: 1\nnodes: \xff\n", 2, 8, "not YAML", NULL},
    {"qmat: 1\n---\nqmat: 1\n", 2, 1, "second one", NULL},
    {"qmat: 1\nnodes: [ a, b ]\n", 2, 8, "lists are not part", NULL},
    {"qmat: 1\nnodes: &n { a: 1 }\n", 2, 8, "anchors", NULL},
    {"qmat: 1\nnodes: *n\n", 2, 8, "aliases", NULL},
    {"qmat: !!int 1\n", 1, 7, "tags", NULL},
    {"? { a: b }\n: 1\n", 1, 3, "single name", NULL},
    {"qmat: 1\nnodes: { \"a\\0b\": 1 }\n", 2, 10, "zero character", NULL},
    {"{a: {a: {a: {a: {a: {a: {a: {a: {a: {a: {a: {a: {a: {a: {a: {a: {a: 1}}}}}}}}}}}}}}}}}", 1, 65, "nested", NULL},
    /* The version. */
    {"nodes: { a: { type: test.number } }\n", 1, 1, "version of the graph language is missing", "qmat: 1"},
    {"qmat: 2\nnodes: 1\n", 1, 7, "version 2", NULL},
    {"future: 1\nqmat: 2\n", 2, 7, "version 2", NULL},
    {"qmat: one\n", 1, 7, "has to be a number, not 'one'", NULL},
    {"qmat:\n", 1, 6, "has no value", NULL},
    /* Keys. */
    {"qmat: 1\nnods: { }\n", 2, 1, "no key 'nods'", "'nodes'"},
    {"qmat: 1\nnodes: {}\nqmat: 1\n", 3, 1, "'qmat' is given twice; the first is on line 1", NULL},
    {HEAD "  a: { type: test.number, parms: { } }\n", 3, 27, "no key 'parms'", "'params'"},
    {"qmat: 1\n", 1, 1, "has no nodes", "nodes:"},
    {"qmat: 1\nnodes: {}\n", 2, 8, "has no nodes", NULL},
    {"qmat: 1\nnodes: 7\n", 2, 8, "has to be a mapping, not '7'", "type"},
    {"qmat: 1\nnodes:\n", 2, 7, "is empty", "type"},
    /* Nodes. */
    {HEAD "  1a: { type: test.number }\n", 3, 3, "cannot name a node", NULL},
    {HEAD "  a.b: { type: test.number }\n", 3, 3, "cannot name a node", NULL},
    {HEAD "  a: { type: test.number }\n  a: { type: test.number }\n", 4, 3, "given twice; the first is on line 3",
     NULL},
    {HEAD "  a: { params: { } }\n", 3, 3, "'a' has no type", NULL},
    {HEAD "  a: test.number\n", 3, 6, "has to be a mapping", "type"},
    {HEAD "  a: { type: test.nunber }\n", 3, 14, "no node type 'test.nunber'", "'test.number'"},
    {HEAD "  a: { type: { } }\n", 3, 14, "single value", NULL},
    /* Parameters. */
    {HEAD "  a: { type: test.number, params: { valu: 3 } }\n", 3, 37, "no parameter 'valu'", "'value'"},
    {HEAD "  a: { type: test.number, params: { xyzzyx: 3 } }\n", 3, 37, "no parameter", "value, repeat, negate, path"},
    {HEAD "  a: { type: test.number, params: { value: 101 } }\n", 3, 44, "between -100 and 100", NULL},
    {HEAD "  a: { type: test.number, params: { value: 1,5 } }\n", 3, 46, "", NULL},
    {HEAD "  a: { type: test.number, params: { value: '1,5' } }\n", 3, 44, "must be a number", NULL},
    {HEAD "  a: { type: test.number, params: { repeat: 2.5 } }\n", 3, 45, "whole number", NULL},
    {HEAD "  a: { type: test.number, params: { negate: maybe } }\n", 3, 45, "true or false", NULL},
    {HEAD "  a: { type: test.number, params: { value: } }\n", 3, 44, "has no value", NULL},
    {HEAD "  a: { type: test.number, params: { value: { } } }\n", 3, 44, "single value", NULL},
    {HEAD "  a: { type: test.number, params: 3 }\n", 3, 35, "has to be a mapping", "name: value"},
    {HEAD "  a: { type: test.number, params: { path: '' } }\n", 3, 43, "must not be empty", NULL},
    {HEAD "  a: { type: test.print, params: { format: tex } }\n", 3, 44, "txt, csv or pair", "'txt'"},
    /* Wiring. */
    {HEAD "  a: { type: test.number }\n  b: { type: test.add, in: { frist: a.number } }\n", 4, 30, "no input 'frist'",
     "'first'"},
    {HEAD "  a: { type: test.number }\n  b: { type: test.add, in: { first: a.nmber } }\n", 4, 37, "no output 'nmber'",
     "'number'"},
    {HEAD "  alpha: { type: test.number }\n  b: { type: test.add, in: { first: alhpa.number } }\n", 4, 37,
     "no node 'alhpa'", "'alpha'"},
    {HEAD "  a: { type: test.number }\n  b: { type: test.add, in: { first: a } }\n", 4, 37, "not of the form node.port",
     "'a.number'"},
    {HEAD "  a: { type: test.number }\n  b: { type: test.ball, in: { mesh: a.number } }\n", 4, 37,
     "takes a mesh, but 'a.number' is a report", NULL},
    {HEAD "  m: { type: test.mesh }\n  b: { type: test.ball, in: { mesh: m.scene } }\n", 4, 37,
     "takes a mesh, but 'm.scene' is a scene", "'m.mesh' is a mesh"},
    {HEAD "  a: { type: test.number }\n  b: { type: test.add, in: { second: a.number } }\n", 4, 3,
     "input 'first' of node 'b' (test.add) is not connected", "'a.number' is a report"},
    {HEAD "  b: { type: test.add }\n", 3, 3, "is not connected", NULL},
    {HEAD "  b: { type: test.add, in: { first: b.sum } }\noutputs: { s: b.sum }\n", 3, 37, "cycle: b -> b", NULL},
    {HEAD "  z: { type: test.number }\n"
          "  d: { type: test.add, in: { first: c.sum } }\n"
          "  c: { type: test.add, in: { first: b.sum, second: z.number } }\n"
          "  a: { type: test.add, in: { first: c.sum } }\n"
          "  b: { type: test.add, in: { first: z.number, second: a.sum } }\n"
          "outputs: { s: d.sum }\n",
     5, 37, "cycle: c -> a -> b -> c", NULL},
    /* Inputs and outputs. */
    {"qmat: 1\ninputs: { n: a.valu }\nnodes: { a: { type: test.number } }\n", 2, 14, "no parameter 'valu'", "'value'"},
    {"qmat: 1\ninputs: { n: b.value }\nnodes: { a: { type: test.number } }\n", 2, 14, "no node 'b'", "nodes: a"},
    {"qmat: 1\ninputs: { n: a }\nnodes: { a: { type: test.number } }\n", 2, 14, "node.parameter", "'a.value'"},
    {"qmat: 1\ninputs: { n: { a: valu } }\nnodes: { a: { type: test.number } }\n", 2, 16, "no parameter 'valu'",
     "'value'"},
    {"qmat: 1\ninputs: { n: { b: value } }\nnodes: { a: { type: test.number } }\n", 2, 16, "no node 'b'", "nodes: a"},
    {"qmat: 1\ninputs: { n: { a: { b: c } } }\nnodes: { a: { type: test.number } }\n", 2, 19, "single value", NULL},
    {"qmat: 1\ninputs: { n: { a: value, b: negate } }\nnodes: { a: { type: test.number }, b: { type: test.number } }\n",
     2, 11, "no value of input 'n' fits both 'a.value' and 'b.negate'", NULL},
    {"qmat: 1\nnodes: { a: { type: test.number } }\n"
     "outputs: { x: a234567890123456789012345678901234567890123456789012345678901234.number }\n",
     3, 15, "names no node: an id has at most 63 letters", NULL},
    {"qmat: 1\ninputs: { n: {} }\nnodes: { a: { type: test.number } }\n", 2, 14, "single value", NULL},
    {"qmat: 1\ninputs: 3\nnodes: { a: { type: test.number } }\n", 2, 9, "has to be a mapping", "node.parameter"},
    {"qmat: 1\ninputs: { 'n n': a.value }\nnodes: { a: { type: test.number } }\n", 2, 11, "cannot name an input", NULL},
    {HEAD "  a: { type: test.number }\noutputs: { x: a.numbr }\n", 4, 15, "no output 'numbr'", "'number'"},
    {HEAD "  a: { type: test.number }\noutputs: { x: { form: a.number } }\n", 4, 17, "no key 'form'", "'from'"},
    {HEAD "  a: { type: test.number }\noutputs: { x: { path: a.json } }\n", 4, 12, "no key 'from'", "from"},
    {HEAD "  a: { type: test.number }\noutputs: { x: { from: a.number, path: a.yaml } }\n", 4, 39, "'.yaml'", ".json"},
    {HEAD "  a: { type: test.number }\n  p: { type: test.print, in: { number: a.number } }\n"
          "outputs: { x: { from: p.file, path: a.doc } }\n",
     5, 37, "'.doc'", ".txt, .csv, .pair"},
    {HEAD "  a: { type: test.mesh, params: { path: x } }\noutputs: { x: { from: a.mesh, path: a.off } }\n", 4, 37,
     "only files and reports", NULL},
    {HEAD "  a: { type: test.number }\n  b: { type: test.number }\noutputs: { x: b.number }\n", 3, 3,
     "no output of the graph depends on node 'a'", "a.number"},
    {HEAD "  a: { type: test.number }\n", 3, 3, "no output of the graph depends on node 'a'", "a.number"},
};

static void check_mistake(const mistake *wanted) {
  qmat_context context = {0};
  qmat_graph graph;
  qmat_status status = test_read(&context, wanted->text, &graph);
  const qmat_error *error = &context.error;
  bool right = status == QMAT_ERROR_USAGE && strcmp(error->file, "g.yaml") == 0 && error->line == wanted->line &&
               error->column == wanted->column && strstr(error->message, wanted->message) &&
               (!wanted->hint || strstr(error->hint, wanted->hint));
  if (!right) {
    char line[2048];
    qmat_error_format(error, line, sizeof line);
    fail_msg("%s\nwanted %d:%d '%s' (%s), got %s: %s", wanted->text, wanted->line, wanted->column, wanted->message,
             wanted->hint ? wanted->hint : "", qmat_status_name(status), line);
  }
  assert_int_equal(graph.node_count, 0);
  qmat_graph_uninit(&graph);
  qmat_context_uninit(&context);
}

static void test_every_mistake_is_told_with_its_place_and_the_nearest_name(void **state) {
  (void)state;
  for (size_t i = 0; i < sizeof mistakes / sizeof *mistakes; i++) check_mistake(&mistakes[i]);
}

static void test_every_cut_of_a_graph_is_refused_or_read_but_never_more(void **state) {
  (void)state;
  for (size_t size = 0; size < sizeof good_yaml; size++) {
    qmat_context context = {0};
    qmat_graph graph;
    char *cut = malloc(size + 1); /* exactly as long, so that reading on is found */
    assert_non_null(cut);
    memcpy(cut, good_yaml, size);
    qmat_status status = qmat_graph_read_text(&context, &test_registry, "g.yaml", cut, size, &graph);
    assert_true(status == QMAT_OK || (status == QMAT_ERROR_USAGE && context.error.message[0]));
    qmat_graph_uninit(&graph);
    qmat_context_uninit(&context);
    free(cut);
  }
}

static void test_changed_bytes_never_break_the_reader(void **state) {
  (void)state;
  uint64_t seed = 1;
  char text[sizeof good_yaml];
  for (int round = 0; round < 20000; round++) {
    memcpy(text, good_yaml, sizeof good_yaml);
    for (int change = 0; change < 1 + round % 3; change++) {
      seed = seed * 6364136223846793005u + 1442695040888963407u;
      text[(seed >> 33) % (sizeof text - 1)] = "{}[]:,&*!|>'\"%@`#- \n\tab0.\xc3\xff"[(seed >> 20) % 27];
    }
    qmat_context context = {0};
    qmat_graph graph;
    qmat_status status = qmat_graph_read_text(&context, &test_registry, "g.yaml", text, sizeof text - 1, &graph);
    assert_true(status == QMAT_OK || (status == QMAT_ERROR_USAGE && context.error.line > 0));
    qmat_graph_uninit(&graph);
    qmat_context_uninit(&context);
  }
}

static void test_oversized_graphs_are_refused(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_graph graph;
  size_t size = QMAT_TREE_MAX_BYTES + 1;
  char *text = malloc(size);
  assert_non_null(text);
  memset(text, ' ', size);
  assert_int_equal(qmat_graph_read_text(&context, &test_registry, "g.yaml", text, size, &graph), QMAT_ERROR_USAGE);
  assert_non_null(strstr(context.error.message, "bytes"));
  /* More keys than a mapping may have. */
  size_t used = 0;
  for (int i = 0; i <= QMAT_TREE_MAX_ENTRIES; i++) used += (size_t)snprintf(text + used, size - used, "k%d: 1\n", i);
  assert_int_equal(qmat_graph_read_text(&context, &test_registry, "g.yaml", text, used, &graph), QMAT_ERROR_USAGE);
  assert_int_equal(context.error.line, QMAT_TREE_MAX_ENTRIES + 1);
  /* Deep nesting stops long before the end of the text. */
  memset(text, '{', size - 1);
  assert_int_equal(qmat_graph_read_text(&context, &test_registry, "g.yaml", text, size - 1, &graph), QMAT_ERROR_USAGE);
  free(text);
  qmat_context_uninit(&context);
}

static void test_files_that_cannot_be_read_are_bad_graphs(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_graph graph;
  assert_int_equal(qmat_graph_read_file(&context, &test_registry, "/nowhere/g.yaml", &graph), QMAT_ERROR_USAGE);
  assert_string_equal(context.error.file, "/nowhere/g.yaml");
  assert_int_equal(qmat_graph_read_file(&context, &test_registry, "/tmp", &graph), QMAT_ERROR_USAGE);
  assert_non_null(strstr(context.error.message, "folder"));
  qmat_graph_uninit(&graph);
  qmat_context_uninit(&context);
}

static void check_assignment(qmat_graph *graph, const char *text, const char *message, const char *hint) {
  qmat_context context = {0};
  assert_int_equal(qmat_graph_assign(&context, graph, text), QMAT_ERROR_USAGE);
  if (!strstr(context.error.message, message) || !strstr(context.error.hint, hint))
    fail_msg("%s: %s (%s)", text, context.error.message, context.error.hint);
  qmat_context_uninit(&context);
}

static void test_assignments_set_by_node_and_by_input_and_suggest(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_graph graph;
  test_ok(&context, test_read(&context, good_yaml, &graph));
  const number_params *one = graph.nodes[1].params;
  test_ok(&context, qmat_graph_assign(&context, &graph, "start=50%"));
  assert_true(one->value == 0.5);
  test_ok(&context, qmat_graph_assign(&context, &graph, "one.value=-7"));
  assert_true(one->value == -7);
  test_ok(&context, qmat_graph_assign(&context, &graph, "text.label=a=b"));
  assert_string_equal(((const print_params *)graph.nodes[3].params)->label, "a=b");
  check_assignment(&graph, "one.value", "not of the form", "");
  check_assignment(&graph, "strat=1", "no input 'strat'", "'start'");
  check_assignment(&graph, "one=1", "not of the form node.parameter", "'one.value'");
  check_assignment(&graph, "one.valu=1", "no parameter 'valu'", "'value'");
  check_assignment(&graph, "oen.value=1", "no node 'oen'", "'one'");
  check_assignment(&graph, "one.value=1e9", "between", "");
  assert_true(one->value == -7);
  qmat_graph_uninit(&graph);
  qmat_context_uninit(&context);
}

static void test_an_input_of_several_parameters_sets_all_or_none(void **state) {
  (void)state;
  static const char text[] =
      "qmat: 1\ninputs: { both: { a: value, b: repeat } }\n"
      "nodes: { a: { type: test.number }, b: { type: test.number } }\n"
      "outputs: { first: a.number, second: b.number }\n";
  qmat_context context = {0};
  qmat_graph graph;
  test_ok(&context, test_read(&context, text, &graph));
  assert_int_equal(graph.inputs[0].param_count, 2);
  const number_params *a = graph.nodes[0].params, *b = graph.nodes[1].params;
  test_ok(&context, qmat_graph_assign(&context, &graph, "both=3"));
  assert_true(a->value == 3 && b->repeat == 3);
  check_assignment(&graph, "both=2.5", "whole", ""); /* the first of them would take it */
  check_assignment(&graph, "both=x", "number", "");
  assert_true(a->value == 3 && b->repeat == 3);
  qmat_graph_uninit(&graph);
  qmat_context_uninit(&context);
}

static void test_required_parameters_may_wait_when_they_are_inputs(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_graph graph;
  static const char without[] = HEAD "  m: { type: test.mesh }\noutputs: { x: m.mesh }\n";
  static const char with[] =
      "qmat: 1\ninputs: { model: m.path }\nnodes: { m: { type: test.mesh } }\noutputs: { x: m.mesh }\n";
  test_ok(&context, test_read(&context, without, &graph));
  assert_int_equal(qmat_graph_check_params(&context, &graph), QMAT_ERROR_USAGE);
  assert_int_equal(context.error.line, 3);
  assert_int_equal(context.error.column, 3);
  assert_string_equal(context.error.field, "path");
  assert_non_null(strstr(context.error.hint, "--set m.path="));
  qmat_graph_uninit(&graph);
  test_ok(&context, test_read(&context, with, &graph));
  test_ok(&context, qmat_graph_check_params(&context, &graph));
  qmat_graph_uninit(&graph);
  qmat_context_uninit(&context);
}

static void test_rules_between_parameters_point_at_the_parameter(void **state) {
  (void)state;
  qmat_context context = {0};
  qmat_graph graph;
  test_ok(&context, test_read(&context,
                              HEAD "  a:\n    type: test.number\n    params:\n      negate: true\n      repeat: 3\n"
                                   "outputs: { x: a.number }\n",
                              &graph));
  assert_int_equal(qmat_graph_check_params(&context, &graph), QMAT_ERROR_USAGE);
  assert_int_equal(context.error.line, 7);
  assert_int_equal(context.error.column, 15);
  assert_string_equal(context.error.node_id, "a");
  qmat_graph_uninit(&graph);
  qmat_context_uninit(&context);
}

static void test_numbers_do_not_depend_on_the_locale(void **state) {
  (void)state;
  locale_with_comma();
  qmat_context context = {0};
  qmat_graph graph;
  qmat_status status = test_read(&context, good_yaml, &graph);
  setlocale(LC_ALL, "C");
  test_ok(&context, status);
  assert_true(((const number_params *)graph.nodes[1].params)->value == 2.5);
  qmat_graph_uninit(&graph);
  qmat_context_uninit(&context);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_a_yaml_graph_is_read_as_written),
      cmocka_unit_test(test_a_json_graph_equals_the_yaml_graph),
      cmocka_unit_test(test_paths_are_relative_to_the_graph_file_and_set_ones_are_not),
      cmocka_unit_test(test_every_mistake_is_told_with_its_place_and_the_nearest_name),
      cmocka_unit_test(test_every_cut_of_a_graph_is_refused_or_read_but_never_more),
      cmocka_unit_test(test_changed_bytes_never_break_the_reader),
      cmocka_unit_test(test_oversized_graphs_are_refused),
      cmocka_unit_test(test_files_that_cannot_be_read_are_bad_graphs),
      cmocka_unit_test(test_assignments_set_by_node_and_by_input_and_suggest),
      cmocka_unit_test(test_an_input_of_several_parameters_sets_all_or_none),
      cmocka_unit_test(test_required_parameters_may_wait_when_they_are_inputs),
      cmocka_unit_test(test_rules_between_parameters_point_at_the_parameter),
      cmocka_unit_test(test_numbers_do_not_depend_on_the_locale),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
