/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/graph_order.h"

#include <string.h>

/* The first link of `node` to a node that is not done. */
static const qmat_graph_link *waiting_link(const qmat_graph_node *node, const bool *done) {
  size_t port = 0;
  while (node->links[port].node == SIZE_MAX || done[node->links[port].node]) port++;
  return &node->links[port];
}

/* Names the nodes of a cycle. Every node that is not done waits for another one, so following links backwards ends in a
 * cycle. */
static qmat_status fail_cycle(qmat_context *context, const qmat_graph *graph, const bool *done, size_t *visits) {
  size_t at = 0;
  while (done[at]) at++;
  for (size_t i = 0; i < graph->node_count; i++) visits[i] = 0;
  /* A node that is visited twice is on the cycle. */
  size_t first = SIZE_MAX;
  while (visits[at] < 2) {
    if (++visits[at] == 2 && at < first) first = at;
    at = waiting_link(&graph->nodes[at], done)->node;
  }
  /* The walk goes backwards from the cycle's first node in the file, so the text is built from its end. */
  char path[400];
  size_t start = sizeof path - 1;
  path[start] = 0;
  at = first;
  qmat_mark mark = {0, 0};
  bool cut = false;
  do {
    const qmat_graph_node *node = &graph->nodes[at];
    const qmat_graph_link *link = waiting_link(node, done);
    if (at == first) mark = link->mark;
    size_t length = strlen(node->id);
    if (start > length + 4 + QMAT_GRAPH_NAME_SIZE + 8) {
      start -= length;
      memcpy(path + start, node->id, length);
      start -= 4;
      memcpy(path + start, " -> ", 4);
    } else {
      cut = true;
    }
    at = link->node;
  } while (at != first);
  qmat_fail(context, QMAT_ERROR_USAGE, "nodes depend on each other in a cycle: %s%s%s", graph->nodes[first].id,
            cut ? " -> ..." : "", path + start);
  return qmat_fail_at(context, graph->file, mark.line, mark.column);
}

qmat_status qmat_graph_order_nodes(qmat_context *context, qmat_graph *graph) {
  graph->order = qmat_calloc(graph->node_count, sizeof *graph->order);
  bool *done = qmat_calloc(graph->node_count, sizeof *done);
  size_t *visits = qmat_calloc(graph->node_count, sizeof *visits);
  qmat_status status = QMAT_OK;
  if (!graph->order || !done || !visits) {
    status = qmat_fail_memory(context, "graph");
    goto cleanup;
  }
  /* The first node in the file that waits for nothing comes next, so the order follows from the file alone. */
  for (size_t count = 0; count < graph->node_count; count++) {
    size_t next = SIZE_MAX;
    for (size_t i = 0; i < graph->node_count && next == SIZE_MAX; i++) {
      if (done[i]) continue;
      bool ready = true;
      for (size_t port = 0; ready && port < qmat_input_count(graph->nodes[i].type); port++) {
        size_t from = graph->nodes[i].links[port].node;
        if (from != SIZE_MAX && !done[from]) ready = false;
      }
      if (ready) next = i;
    }
    if (next == SIZE_MAX) {
      status = fail_cycle(context, graph, done, visits);
      goto cleanup;
    }
    done[next] = true;
    graph->order[count] = next;
  }
cleanup:
  qmat_free(done);
  qmat_free(visits);
  return status;
}

qmat_status qmat_graph_check_reached(qmat_context *context, const qmat_graph *graph) {
  bool *needed = qmat_calloc(graph->node_count, sizeof *needed);
  if (!needed) return qmat_fail_memory(context, "graph");
  for (size_t i = 0; i < graph->output_count; i++) needed[graph->outputs[i].node] = true;
  for (size_t i = 0; i < graph->node_count; i++)
    if (qmat_output_count(graph->nodes[i].type) == 0) needed[i] = true;
  for (size_t k = graph->node_count; k-- > 0;) {
    const qmat_graph_node *node = &graph->nodes[graph->order[k]];
    for (size_t port = 0; needed[graph->order[k]] && port < qmat_input_count(node->type); port++)
      if (node->links[port].node != SIZE_MAX) needed[node->links[port].node] = true;
  }
  size_t idle = 0;
  while (idle < graph->node_count && needed[idle]) idle++;
  qmat_free(needed);
  if (idle == graph->node_count) return QMAT_OK;
  const qmat_graph_node *node = &graph->nodes[idle];
  qmat_fail(context, QMAT_ERROR_USAGE, "no output of the graph depends on node '%s' (%s)", node->id, node->type->name);
  qmat_fail_hint(context, "outputs: { %s: %s.%s }, or remove it", node->type->outputs[0].name, node->id,
                 node->type->outputs[0].name);
  return qmat_fail_at(context, graph->file, node->mark.line, node->mark.column);
}
