/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/pole_labels.h"

#include <math.h>
#include <string.h>

#include "core/geometry/vector.h"
#include "nodes/initial/item_queue.h"

/* A pole that another one gives a label to. */
typedef struct {
  uint32_t pole;
  double strength; /* 0 to 1 */
} influence;

/* Row i of a table is items[starts[i] .. starts[i + 1]). */
typedef struct {
  size_t *starts;
  influence *items;
} influence_table;

typedef struct {
  qmat_context *context;
  size_t count;
  influence_table opposite, neighbours;
  double *inside, *outside; /* per pole: how certain either label is, 0 to 1 */
  uint8_t *labels;
  qmat_item_queue queue; /* poles, the most certain first; those whose certainty changed since are passed over */
  bool is_short;         /* memory was */
} labelling;

/* --- influences -------------------------------------------------------------------------------------------------- */

/* Lists both ends of each pair in the other's row. */
static qmat_status make_table(qmat_context *context, size_t count, const uint32_t *pairs, const double *strengths,
                              size_t pair_count, influence_table *table) {
  table->starts = qmat_arena_calloc(&context->arena, count + 2, sizeof *table->starts);
  table->items = qmat_arena_alloc(&context->arena, pair_count, 2 * sizeof *table->items);
  if (!table->starts || !table->items) return qmat_fail_memory(context, "the labels of poles");
  for (size_t i = 0; i < 2 * pair_count; i++) table->starts[pairs[i] + 2]++;
  for (size_t i = 0; i < count; i++) table->starts[i + 2] += table->starts[i + 1];
  for (size_t i = 0; i < 2 * pair_count; i++)
    table->items[table->starts[pairs[i] + 1]++] = (influence){pairs[i ^ 1], strengths[i / 2]};
  return QMAT_OK;
}

/* The cosine of the angle at which two spheres intersect, from -1 where they touch to 1 where one contains the other.
 */
static double intersection_cosine(const double *a, const double *b) {
  const double d = qmat_point_distance(a, b), product = 2 * a[3] * b[3];
  if (!(product > 0)) return -1;
  return fmax(-1, fmin(1, (a[3] * a[3] + b[3] * b[3] - d * d) / product));
}

/* --- the queue --------------------------------------------------------------------------------------------------- */

/* Poles that only one label was given to come first; then those whose labels differ most. */
static double certainty(const labelling *l, uint32_t pole) {
  const double inside = l->inside[pole], outside = l->outside[pole];
  if (inside == 0 || outside == 0) return inside + outside;
  return fabs(inside - outside) - 1;
}

/* A label is given to a pole, more or less certainly. */
static void give(labelling *l, uint32_t pole, bool inside, double strength) {
  double *value = inside ? &l->inside[pole] : &l->outside[pole];
  if (l->labels[pole] || !(strength > *value)) return;
  *value = strength;
  if (qmat_queue_push(&l->queue, -certainty(l, pole), pole)) l->is_short = true;
}

/* --- labels ------------------------------------------------------------------------------------------------------ */

static qmat_status spread(labelling *l, double propagation) {
  size_t labelled = 0;
  for (size_t taken = 0; l->queue.count > 0 && !l->is_short; taken++) {
    if (taken % 4096 == 0) {
      const qmat_status status = qmat_progress(l->context, labelled, l->count, "poles");
      if (status != QMAT_OK) return status;
    }
    const qmat_queued first = qmat_queue_pop(&l->queue);
    const uint32_t pole = (uint32_t)first.item;
    if (l->labels[pole] || first.key != -certainty(l, pole)) continue;
    labelled++;
    const bool inside = l->inside[pole] > l->outside[pole];
    const double value = inside ? l->inside[pole] : l->outside[pole];
    l->labels[pole] = inside ? QMAT_POLE_INSIDE : QMAT_POLE_OUTSIDE;
    for (size_t i = l->opposite.starts[pole]; i < l->opposite.starts[pole + 1]; i++)
      give(l, l->opposite.items[i].pole, !inside, value * l->opposite.items[i].strength);
    for (size_t i = l->neighbours.starts[pole]; i < l->neighbours.starts[pole + 1]; i++)
      if (l->neighbours.items[i].strength > propagation)
        give(l, l->neighbours.items[i].pole, inside, value * l->neighbours.items[i].strength);
  }
  return l->is_short ? qmat_fail_memory(l->context, "the labels of poles") : QMAT_OK;
}

/* The label of a pole that none reached: that of the neighbours that it intersects, or else the one that its opposite
 * poles do not have. */
static qmat_pole_label guess(const labelling *l, uint32_t pole) {
  double deepest[3] = {-1, 0, 0}; /* by label; neighbours that do not intersect do not count */
  for (size_t i = l->neighbours.starts[pole]; i < l->neighbours.starts[pole + 1]; i++) {
    const influence *n = &l->neighbours.items[i];
    deepest[l->labels[n->pole]] = fmax(deepest[l->labels[n->pole]], n->strength);
  }
  bool opposite[3] = {false, false, false};
  for (size_t i = l->opposite.starts[pole]; i < l->opposite.starts[pole + 1]; i++)
    opposite[l->labels[l->opposite.items[i].pole]] = true;
  const double in = deepest[QMAT_POLE_INSIDE], out = deepest[QMAT_POLE_OUTSIDE];
  if (in > 0 && !(out > 0)) return QMAT_POLE_INSIDE;
  if (out > 0 && !(in > 0)) return QMAT_POLE_OUTSIDE;
  if (opposite[QMAT_POLE_INSIDE] != opposite[QMAT_POLE_OUTSIDE])
    return opposite[QMAT_POLE_INSIDE] ? QMAT_POLE_OUTSIDE : QMAT_POLE_INSIDE;
  return in > out ? QMAT_POLE_INSIDE : in < out ? QMAT_POLE_OUTSIDE : QMAT_POLE_UNLABELLED;
}

qmat_status qmat_poles_label(qmat_context *context, const qmat_poles *poles, const uint32_t *edges, size_t edge_count,
                             double propagation, uint8_t *labels) {
  qmat_arena *arena = &context->arena;
  const size_t count = poles->count;
  labelling l = {.context = context,
                 .count = count,
                 .inside = qmat_arena_calloc(arena, count, sizeof *l.inside),
                 .outside = qmat_arena_calloc(arena, count, sizeof *l.outside),
                 .labels = labels};
  double *opposite = qmat_arena_alloc(arena, poles->pair_count, sizeof *opposite);
  double *depths = qmat_arena_alloc(arena, edge_count, sizeof *depths);
  if (!l.inside || !l.outside || !opposite || !depths) return qmat_fail_memory(context, "the labels of poles");
  for (size_t i = 0; i < poles->pair_count; i++) opposite[i] = -poles->cosines[i];
  for (size_t i = 0; i < edge_count; i++)
    depths[i] =
        intersection_cosine(&poles->spheres[4 * (size_t)edges[2 * i]], &poles->spheres[4 * (size_t)edges[2 * i + 1]]);
  qmat_status status = make_table(context, count, poles->pairs, opposite, poles->pair_count, &l.opposite);
  if (status == QMAT_OK) status = make_table(context, count, edges, depths, edge_count, &l.neighbours);
  if (status != QMAT_OK) return status;
  memset(labels, QMAT_POLE_UNLABELLED, count);
  for (uint32_t i = 0; i < count; i++)
    if (poles->at_box[i]) give(&l, i, false, 1);
  status = spread(&l, propagation);
  qmat_free(l.queue.items);
  if (status != QMAT_OK) return status;
  for (uint32_t i = 0; i < count; i++)
    if (!labels[i]) labels[i] = (uint8_t)guess(&l, i);
  return QMAT_OK;
}
