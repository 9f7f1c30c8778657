/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_SUMMARY_H
#define QMAT_GRAPHS_RUN_RUN_SUMMARY_H

#include "graphs/run/run.h"

/* The summary of saved file number `file` of a run: that of the last finished step which the file needs, whose node
 * declares one (qmat_node.report_summary) and whose report has its entries; without saved files, of the run's last.
 * Nodes that make files have no summary of their own: where one that needs the step declares the same summary, bounds
 * are the largest and flags hold for all of what its reports state. A JSON object: "name", "node", the entries in their
 * order, and for several meshes the counts "meshes" and "failures". Writes what it comes to, in two lines, to `text` of
 * `size` bytes. NULL when there is no summary or memory is short; the caller calls json_decref. */
json_t *qmat_run_summarise(const qmat_run *run, size_t file, char *text, size_t size);

/* Adds the summary of one more run to `total`, an empty object at first. */
void qmat_summary_add(const qmat_report_summary *type, const json_t *summary, json_t *total);

#endif
