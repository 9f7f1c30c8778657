/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_unread.h"

#include <string.h>

#include "graphs/run/run_cache.h"

static bool is_needed(const qmat_run *run, const qmat_run_step *step) {
  bool needed = step->wanted;
  for (size_t port = 0; port < qmat_output_count(run->graph->nodes[step->node].type); port++) {
    const qmat_run_slot *slot = &run->slots[step->first_slot + port];
    needed = needed || slot->readers > 0 || slot->kept;
  }
  return needed;
}

/* Removes a step whose outputs nobody reads. */
static void remove_step(qmat_run *run, size_t index) {
  qmat_step_uninit(&run->steps[index]);
  memmove(run->steps + index, run->steps + index + 1, (--run->step_count - index) * sizeof *run->steps);
  for (size_t i = 0; i < run->slot_count; i++) {
    qmat_run_slot *slot = &run->slots[i];
    if (slot->step == SIZE_MAX || slot->step < index) continue;
    slot->step = slot->step == index ? SIZE_MAX : slot->step - 1;
  }
}

/* The value of an input that decides what else is read, or NULL while it is not made. */
static const qmat_value *deciding_value(qmat_run *run, const qmat_run_step *step, size_t port) {
  if (step->inputs[port] == SIZE_MAX || !run->graph->nodes[step->node].type->inputs[port].decides) return NULL;
  qmat_run_slot *slot = &run->slots[step->inputs[port]];
  if (!slot->value && slot->known && slot->step != SIZE_MAX)
    slot->value = qmat_run_load(run, slot->step, step->inputs[port] - run->steps[slot->step].first_slot);
  return slot->value;
}

void qmat_run_drop_unread(qmat_run *run, size_t first) {
  for (size_t i = run->step_count; i-- > first;) {
    const qmat_run_step *step = &run->steps[i];
    const qmat_node *type = run->graph->nodes[step->node].type;
    const bool needed = is_needed(run, step);
    const size_t count = qmat_input_count(type);
    const qmat_value **known = type->reads ? qmat_calloc(count, sizeof *known) : NULL;
    for (size_t port = 0; known && port < count; port++) known[port] = deciding_value(run, step, port);
    for (size_t port = 0; port < count; port++) {
      if (step->inputs[port] == SIZE_MAX || (needed && (!known || type->reads(step->params, known, port)))) continue;
      run->slots[step->inputs[port]].readers--;
      step->inputs[port] = SIZE_MAX;
    }
    qmat_free(known);
    if (!needed) remove_step(run, i);
  }
}
