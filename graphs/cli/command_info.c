/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/json_text.h"
#include "core/node.h"
#include "graphs/cli/command.h"
#include "graphs/run/run_report.h"
#include "io/extract.h"
#include "io/model.h"
#include "nodes/nodes.h"

/* One call of `qmat info`. */
typedef struct info_call {
  qmat_context *context;
  const char *node, *against; /* --node and --against; NULL: not given */
  const char *shown;          /* the name of the file at hand, for people */
  json_t *json;               /* of that file; NULL: the facts are printed */
} info_call;

/* Prints a text of the file without its control characters. */
static void print_text(const char *key, const char *text) {
  printf("  %s: ", key);
  for (; *text; text++) putchar((unsigned char)*text < 0x20 || *text == 0x7f ? '?' : *text);
  putchar('\n');
}

static void print_object(const json_t *object) {
  const char *key;
  json_t *value;
  json_object_foreach((json_t *)(uintptr_t)object, key, value) {
    if (json_is_array(value)) {
      for (size_t i = 0; i < json_array_size(value); i++) {
        const char *text = json_string_value(json_array_get(value, i));
        if (text) print_text(key, text);
      }
    } else if (json_is_string(value)) {
      printf("  %s: %s\n", key, qmat_show(json_string_value(value)).text);
    } else if (json_is_boolean(value)) {
      printf("  %s: %s\n", key, json_is_true(value) ? "yes" : "no");
    } else if (json_is_number(value)) {
      char number[32];
      qmat_format_number(json_number_value(value), number, sizeof number);
      printf("  %s: %s\n", key, number);
    }
  }
}

static double number_of(const json_t *object, const char *key) {
  const json_t *value = json_object_get(object, key);
  return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

/* The least epsilon that the bounds certify, rounded up to three digits; NAN for an open surface, which none does. */
static double certified_from(const json_t *measured) {
  const double most = fmax(number_of(measured, "surface_to_envelope"), number_of(measured, "envelope_to_surface"));
  if (json_is_true(json_object_get(measured, "estimate")) || !(most > 0 && most < INFINITY)) return NAN;
  const double unit = pow(10, floor(log10(most)) - 2);
  return ceil(most / unit) * unit;
}

/* Says for which epsilon the model is certified; a file that states none asks for none. */
static void print_certified(const json_t *facts, const json_t *measured) {
  const bool certified = json_is_true(json_object_get(measured, "certified"));
  const double from = certified_from(measured);
  if (!isnan(number_of(facts, "qmat_epsilon")) || isnan(from))
    printf("  %s for an epsilon of %.6g\n", certified ? "certified" : "not certified", number_of(measured, "epsilon"));
  if (!isnan(from)) printf("  certified from an epsilon of %.3g on\n", from);
}

/* Compares the errors that the file states with measured bounds. A stated error below its lower bound is refuted. */
static qmat_status compare(const info_call *call, const json_t *facts, const json_t *measured) {
  const struct {
    const char *title, *stated, *most, *least;
  } rows[] = {
      {"surface to envelope", "qmat_error_out", "surface_to_envelope", "surface_to_envelope_at_least"},
      {"envelope to surface", "qmat_error_in", "envelope_to_surface", "envelope_to_surface_at_least"},
  };
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < 2; i++) {
    const double stated = number_of(facts, rows[i].stated), least = number_of(measured, rows[i].least);
    const bool holds = !(least > stated);
    if (!call->json) {
      printf("  %s: between %.6g and %.6g of the diagonal", rows[i].title, least, number_of(measured, rows[i].most));
      if (isnan(stated))
        printf("; the file states none\n");
      else
        printf("; stated %.6g: %s\n", stated, holds ? "not refuted" : "REFUTED");
    }
    if (!holds) {
      status = qmat_fail(call->context, QMAT_ERROR_GEOMETRY, "the error from %s is larger than the file states",
                         rows[i].title);
    }
  }
  if (!call->json) print_certified(facts, measured);
  return status;
}

/* Runs a node with default parameters, but for `epsilon` where that is above zero. `outputs` holds one pointer per
 * port.
 */
static qmat_status run_node(qmat_context *context, const char *name, double epsilon, const qmat_value *const inputs[],
                            qmat_value *outputs[]) {
  const qmat_node *node = qmat_node_find(name);
  void *params = qmat_calloc(1, node->params_size);
  if (!params) return qmat_fail_memory(context, "parameters");
  qmat_params_default(node, params);
  const qmat_param *param = qmat_param_find(node, "epsilon");
  if (param && epsilon > 0) memcpy((char *)params + param->offset, &epsilon, sizeof epsilon);
  const qmat_status status = qmat_node_run(context, node, params, inputs, outputs);
  qmat_free(params);
  return status;
}

/* Prints what mesh.solid took each component for, and what it did. Lengths are in diagonals. */
static void print_components(const json_t *report) {
  static const char *const counts[] = {"components_not_listed", "vertices_welded",
                                       "sheet_triangles",       "opposite_triangles_merged",
                                       "two_sided_solids",      "inner_triangles",
                                       "unbounding_triangles",  "flap_triangles",
                                       "triangles_turned",      "faces_triangulated_again",
                                       "edges_split",           "seam_triangles",
                                       "parts_united",          "triangles_cut"};
  size_t i;
  json_t *part;
  json_array_foreach(json_object_get(report, "components"), i, part) {
    const json_t *caps = json_object_get(part, "largest_caps");
    printf("  component %zu: %lld triangles, %s", i + 1,
           (long long)json_integer_value(json_object_get(part, "triangles")),
           json_string_value(json_object_get(part, "taken_for")));
    if (json_is_true(json_object_get(part, "cavity"))) printf(", a cavity");
    if (json_is_true(json_object_get(part, "turned"))) printf(", turned outwards");
    if (caps) printf(", %lld closed:", (long long)json_integer_value(json_object_get(part, "caps")));
    for (size_t k = 0; k < json_array_size(caps); k++) {
      const json_t *cap = json_array_get(caps, k);
      printf("%s %lld sides, length %.3g, area %.3g", k ? ";" : "",
             (long long)json_integer_value(json_object_get(cap, "sides")), number_of(cap, "length"),
             number_of(cap, "area"));
    }
    printf("\n");
  }
  for (i = 0; i < sizeof counts / sizeof *counts; i++) {
    const json_int_t count = json_integer_value(json_object_get(report, counts[i]));
    if (count > 0) printf("  %s: %lld\n", counts[i], (long long)count);
  }
}

/* Replaces a mesh by the solid's surface, made as in the shipped graph, and prints its components. */
static qmat_status make_solid(const info_call *call, double epsilon, qmat_value **mesh) {
  static const char *const nodes[] = {"mesh.subdivide", "mesh.solid"};
  for (size_t i = 0; i < sizeof nodes / sizeof *nodes; i++) {
    qmat_value *outputs[2] = {NULL};
    const qmat_status status = run_node(call->context, nodes[i], epsilon, (const qmat_value *const[]){*mesh}, outputs);
    if (status != QMAT_OK) return status;
    if (!call->json) print_components(((const qmat_report *)outputs[1])->root);
    qmat_value_release(outputs[1]);
    qmat_value_release(*mesh);
    *mesh = outputs[0];
  }
  return QMAT_OK;
}

/* Evaluates the medial mesh against a model. `mesh_choice` is the mesh of the model that it describes, or "merged". */
static qmat_status check_against(const info_call *call, const char *path, const char *mesh_choice,
                                 const qmat_medial *medial, const json_t *facts, json_t *json) {
  qmat_context *context = call->context;
  const qmat_read_options options = {.defects = QMAT_DEFECTS_DROP};
  qmat_scene *scene;
  qmat_value *mesh;
  qmat_report *read;
  qmat_value *output = NULL;
  qmat_status status = qmat_model_read_meshes(context, path, &options, mesh_choice, &scene, &mesh, &read);
  if (status == QMAT_OK) {
    const double epsilon = number_of(facts, "qmat_epsilon");
    if (!json) printf("against %s\n", qmat_show(path).text);
    status = make_solid(call, epsilon, &mesh);
    if (status == QMAT_OK)
      status = run_node(context, "medial.evaluate", epsilon, (const qmat_value *const[]){mesh, &medial->base}, &output);
    if (status == QMAT_OK) {
      const double from = certified_from(((const qmat_report *)output)->root);
      if (json) json_object_set(json, "against", ((const qmat_report *)output)->root);
      if (json && !isnan(from)) json_object_set_new(json, "certified_from", json_real(from));
      status = compare(call, facts, ((const qmat_report *)output)->root);
      if (status != QMAT_OK) qmat_fail_at(context, path, 0, 0);
    }
    qmat_value_release(output);
    qmat_value_release(&scene->base);
    qmat_value_release(mesh);
    qmat_value_release(&read->base);
  }
  return status;
}

/* Prints the medial mesh of node `name`, or the only one. `carrier` (NULL: unknown) has the number of its mesh. */
static qmat_status print_medial(const info_call *call, const char *path, const char *name, const json_t *carrier) {
  qmat_context *context = call->context;
  const char *against = call->against;
  qmat_medial *medial;
  json_t *facts = json_object();
  if (!facts) return qmat_fail_memory(context, "facts");
  qmat_status status = qmat_medial_extract(context, path, name, &medial, facts);
  if (status == QMAT_OK) {
    const qmat_value_count_row *rows = qmat_value_count_rows(QMAT_MEDIAL);
    size_t counts[QMAT_MOST_COUNTS];
    qmat_value_counts(&medial->base, counts);
    json_t *json = call->json ? json_object() : NULL;
    if (json) {
      if (name) json_object_set_new(json, "node", qmat_json_string(name));
      for (size_t i = 0; rows[i].name; i++) qmat_json_set_count(json, rows[i].name, counts[i]);
      json_object_update(json, facts);
      json_array_append_new(json_object_get(call->json, "medial_meshes"), json);
    } else {
      printf("%s: a medial mesh of", qmat_show(call->shown).text);
      for (size_t i = 0; rows[i].name; i++) printf("%s %zu %s", i ? "," : "", counts[i], rows[i].name);
      if (name) printf(" on node %s", qmat_show(name).text);
      printf("\n");
      print_object(facts);
    }
    if (against) {
      const json_t *mesh = json_object_get(carrier, "mesh");
      const qmat_format format = qmat_format_of_name(against);
      const bool by_mesh = mesh && (format == QMAT_FORMAT_GLB || format == QMAT_FORMAT_GLTF);
      char number[24] = "merged";
      if (by_mesh) snprintf(number, sizeof number, "%lld", (long long)json_integer_value(mesh));
      const char *prim = json_string_value(json_object_get(facts, "qmat_prim")),
                 *composed = json_string_value(json_object_get(facts, "composed_prim"));
      const qmat_error before = context->error;
      status = check_against(call, against, format == QMAT_FORMAT_USD && prim ? prim : number, medial, facts, json);
      if (status == QMAT_ERROR_USAGE && format == QMAT_FORMAT_USD && composed) {
        /* The stage refers to the one that the medial mesh was made for, under another path. */
        context->error = before;
        status = check_against(call, against, composed, medial, facts, json);
      }
    }
    qmat_value_release(&medial->base);
  }
  json_decref(facts);
  return status;
}

/* Prints the medial mesh of one node, or all. */
static qmat_status print_medials(const info_call *call, const char *path) {
  qmat_context *context = call->context;
  const char *name = call->node;
  json_t *carriers = qmat_medial_carriers(context, path);
  if (!carriers) return context->error.status;
  const size_t count = json_array_size(carriers);
  qmat_status status = QMAT_OK;
  if (name || count < 2) {
    const json_t *carrier = count == 1 ? json_array_get(carriers, 0) : NULL;
    for (size_t i = 0; i < count && name; i++) {
      const json_t *other = json_array_get(carriers, i);
      if (strcmp(json_string_value(json_object_get(other, "node")), name) == 0) carrier = other;
    }
    status = print_medial(call, path, name, carrier);
  }
  for (size_t i = 0; !name && count >= 2 && i < count; i++) {
    const json_t *carrier = json_array_get(carriers, i);
    const qmat_error before = context->error;
    const qmat_status of_one = print_medial(call, path, json_string_value(json_object_get(carrier, "node")), carrier);
    /* The first error is reported; the other medial meshes are still compared. */
    if (status != QMAT_OK)
      context->error = before;
    else
      status = of_one;
  }
  json_decref(carriers);
  return status;
}

/* Only that it was cancelled is an error. */
static qmat_status describe_surface(const info_call *call, const qmat_mesh *mesh, const json_t *report) {
  qmat_value *outputs[2] = {NULL};
  if (call->json) json_object_set(call->json, "surface", (json_t *)(uintptr_t)report);
  if (!call->json) printf("%s: a surface\n", qmat_show(call->shown).text);
  if (!call->json) print_object(report);
  const qmat_status status =
      run_node(call->context, "mesh.solid", 0, (const qmat_value *const[]){&mesh->base}, outputs);
  if (status != QMAT_OK) return status == QMAT_CANCELLED ? status : QMAT_OK;
  if (call->json)
    json_object_set(call->json, "solid", ((const qmat_report *)outputs[1])->root);
  else
    print_components(((const qmat_report *)outputs[1])->root);
  qmat_value_release(outputs[0]);
  qmat_value_release(outputs[1]);
  return QMAT_OK;
}

static qmat_status describe_file(const info_call *call, const char *path) {
  qmat_context *context = call->context;
  const qmat_read_options options = {.defects = QMAT_DEFECTS_DROP};
  qmat_scene *scene;
  qmat_mesh *mesh;
  qmat_report *report;
  qmat_status status = qmat_model_read(context, path, &options, &scene, &mesh, &report);
  const bool has_surface = status == QMAT_OK;
  if (has_surface) {
    status = describe_surface(call, mesh, report->root);
    qmat_value_release(&scene->base);
    qmat_value_release(&mesh->base);
    qmat_value_release(&report->base);
  }
  if (status == QMAT_CANCELLED) return status;
  const qmat_error first = context->error;
  const qmat_status carried = print_medials(call, path);
  if (carried == QMAT_OK) {
    status = QMAT_OK;
  } else if (call->against || call->node || (has_surface && carried != QMAT_ERROR_GEOMETRY)) {
    status = carried; /* its medial mesh is ambiguous, unreadable, or missing with --against or --node */
  } else if (!has_surface && qmat_format_of_name(path) == QMAT_FORMAT_MA) {
    status = carried; /* what is wrong with it, not that it has no surface */
  } else if (!has_surface && carried != QMAT_CANCELLED) {
    context->error = first;
  }
  return status;
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  const bool json = qmat_invocation_value(invocation, "json") != NULL;
  const size_t count = invocation->argument_count;
  size_t failures = 0;
  json_t *all = json_array();
  if (!all) return qmat_fail_memory(context, "listing");
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count && status != QMAT_CANCELLED; i++) {
    const char *path = invocation->arguments[i];
    const bool is_stream = qmat_is_stream(path);
    info_call call = {context, qmat_invocation_value(invocation, "node"), qmat_invocation_value(invocation, "against"),
                      is_stream ? "standard input" : path,
                      json ? json_pack("{s:o, s:[]}", "file", qmat_json_string(path), "medial_meshes") : NULL};
    qmat_status of_one = is_stream ? qmat_streams_read(context, &invocation->streams, &path) : QMAT_OK;
    if (of_one == QMAT_OK) of_one = describe_file(&call, path);
    if (of_one != QMAT_OK) qmat_streams_name(&invocation->streams, &context->error);
    if (call.json && of_one != QMAT_OK) json_object_update_new(call.json, qmat_error_report(&context->error));
    if (call.json) json_array_append_new(all, call.json);
    if (of_one == QMAT_OK) continue;
    if (failures++ == 0 || of_one == QMAT_CANCELLED) status = of_one;
    if (count > 1 && of_one != QMAT_CANCELLED) qmat_print_error(&context->error);
  }
  if (json) {
    const qmat_error error = context->error;
    const qmat_status printed = qmat_print_json(context, json_incref(all));
    if (printed == QMAT_OK)
      context->error = error;
    else
      status = printed;
  }
  json_decref(all);
  if (count > 1 && failures > 0 && status != QMAT_CANCELLED)
    qmat_fail(context, status, "%zu of %zu files have failed", failures, count);
  return status;
}

static const qmat_option options[] = {
    {"against", 0, "MODEL",
     "Measure the errors of the medial mesh against this model, and compare them with the stated ones"},
    {"node", 0, "NAME", "The node or prim whose medial mesh to use, if several have one; a prim also by its path"},
    {"json", 0, NULL, "Print a list with an object of each file as JSON"},
    {0},
};

const qmat_command qmat_command_info = {
    .name = "info",
    .arguments = "FILE...",
    .summary = "Print what model files contain",
    .doc =
        "Prints the contents of model files ('-': the standard input): counts, units, what was left out, and what "
        "mesh.solid takes each "
        "component for, with the caps of its holes; for each medial mesh in it, its counts and stated errors.\n"
        "With --against, bounds the errors anew, on limit surfaces of subdivision cages and on the solids and sheets "
        "of mesh.solid. The exit code is 1 if an error is certainly larger than stated. If both files are glTF, each "
        "medial "
        "mesh is compared with the mesh that its node refers to, in that mesh's own space.",
    .options = options,
    .least = 1,
    .most = SIZE_MAX,
    .run = run,
};
