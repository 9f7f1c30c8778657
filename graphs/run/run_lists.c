/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/run_lists.h"

#include "core/key_table.h"
#include "graphs/run/parallel_items.h"

qmat_status qmat_count_lifted(qmat_context *context, const qmat_node *type, const qmat_value *const *inputs,
                              size_t *count, const qmat_list **first) {
  *count = 0;
  *first = NULL;
  for (size_t port = 0; port < qmat_input_count(type); port++) {
    if (!inputs[port] || inputs[port]->type != QMAT_LIST || type->inputs[port].list) continue;
    const size_t here = qmat_value_count(inputs[port]);
    if (*count > 0 && here != *count) {
      qmat_fail(context, QMAT_ERROR_USAGE, "this list has %zu items, another input's has %zu", here, *count);
      return qmat_fail_field(context, type->inputs[port].name);
    }
    if (*count == 0) *first = (const qmat_list *)inputs[port];
    *count = here;
  }
  return QMAT_OK;
}

/* Plans the run of `step` alone, with item `item` of each of its lists. Its outputs' slots come first. */
static qmat_status plan_item(qmat_context *context, const qmat_run *run, const qmat_run_step *step,
                             const qmat_value *const *inputs, size_t item, qmat_run *one) {
  const qmat_node *type = run->graph->nodes[step->node].type;
  const size_t output_count = qmat_output_count(type), input_count = qmat_input_count(type);
  *one = (qmat_run){.graph = run->graph, .cache = run->cache, .bypass = run->bypass};
  one->steps = qmat_calloc(1, sizeof *one->steps);
  one->slots = qmat_calloc(output_count + input_count, sizeof *one->slots);
  if (!one->steps || !one->slots) return qmat_fail_memory(context, "plan");
  qmat_run_step *own = &one->steps[0];
  own->forced = step->forced;
  one->step_count = 1;
  one->slot_count = output_count + input_count;
  const qmat_status status = qmat_step_init(context, run->graph, step->node, step->params, step->format, own);
  if (status != QMAT_OK) return status;
  for (size_t port = 0; port < output_count; port++) one->slots[port].kept = true;
  for (size_t port = 0; port < input_count; port++) {
    own->inputs[port] = SIZE_MAX;
    if (!inputs[port]) continue;
    const qmat_value *value = type->inputs[port].list ? inputs[port] : qmat_value_at(inputs[port], item);
    own->inputs[port] = output_count + port;
    one->slots[output_count + port] = (qmat_run_slot){
        .value = qmat_value_retain(value), .digest = value->digest, .known = true, .step = SIZE_MAX, .kept = true};
  }
  return QMAT_OK;
}

/* A step that runs over lists. */
typedef struct lifted_step {
  const qmat_run *run;
  qmat_run_step *step;
  const qmat_value *const *inputs;
  qmat_list **outputs;
  qmat_make_item_fn *make;
  void *user;
  pthread_mutex_t lock;   /* of the cache, the step's counters and the next two */
  const size_t *items;    /* those that are run: equal items are run once */
  bool *hits;             /* per item: its result came from the cache */
  size_t first_unusable;  /* the first item that the node cannot process; SIZE_MAX: none */
  qmat_error first_error; /* why */
} lifted_step;

/* Puts a failure into the output lists for one item; the other items continue. */
static qmat_status leave_out(lifted_step *lifted, qmat_context *context, size_t item, const qmat_value *failure) {
  qmat_run_step *step = lifted->step;
  qmat_value *made = failure ? qmat_value_retain(failure) : qmat_failure_of_error(context);
  if (!made) return context->error.status;
  for (size_t port = 0; port < qmat_output_count(lifted->run->graph->nodes[step->node].type); port++)
    lifted->outputs[port]->items[item] = qmat_value_retain(made);
  qmat_value_release(made);
  pthread_mutex_lock(&lifted->lock);
  if (failure) step->lifted_left_out++;
  if (!failure && item < lifted->first_unusable) {
    lifted->first_unusable = item;
    lifted->first_error = context->error;
  }
  pthread_mutex_unlock(&lifted->lock);
  return QMAT_OK;
}

/* Makes the step's outputs for one item. Runs in one of the threads of qmat_run_items. */
static qmat_status run_item(void *user, qmat_context *context, size_t at) {
  lifted_step *lifted = user;
  const size_t item = lifted->items[at];
  qmat_run_step *step = lifted->step;
  const qmat_node *type = lifted->run->graph->nodes[step->node].type;
  for (size_t port = 0; port < qmat_input_count(type); port++) {
    if (!lifted->inputs[port] || type->inputs[port].list) continue;
    const qmat_value *given = qmat_value_at(lifted->inputs[port], item);
    if (qmat_value_failure(given)) return leave_out(lifted, context, item, given);
  }
  qmat_run one;
  bool hit = false;
  qmat_status status = plan_item(context, lifted->run, step, lifted->inputs, item, &one);
  if (status == QMAT_OK) status = lifted->make(lifted->user, context, &one, &lifted->lock, &hit);
  for (size_t port = 0; port < qmat_output_count(type) && status == QMAT_OK; port++)
    lifted->outputs[port]->items[item] = qmat_value_retain(one.slots[port].value);
  pthread_mutex_lock(&lifted->lock);
  lifted->hits[item] = hit;
  if (hit) step->lifted_hits++;
  pthread_mutex_unlock(&lifted->lock);
  qmat_run_uninit(&one);
  return status == QMAT_ERROR_GEOMETRY ? leave_out(lifted, context, item, NULL) : status;
}

/* The bytes of one item's inputs. */
static size_t item_size(const qmat_node *type, const qmat_value *const *inputs, size_t item) {
  size_t size = 0;
  for (size_t port = 0; port < qmat_input_count(type); port++)
    if (inputs[port] && inputs[port]->type == QMAT_LIST && !type->inputs[port].list)
      size += qmat_value_bytes(qmat_value_at(inputs[port], item));
  return size;
}

/* Whether two items of the lists have equal inputs, so that the node makes the same of both. */
static bool are_equal(const lifted_step *lifted, const qmat_node *type, size_t a, size_t b) {
  for (size_t port = 0; port < qmat_input_count(type); port++) {
    const qmat_value *input = lifted->inputs[port];
    if (!input || input->type != QMAT_LIST || type->inputs[port].list) continue;
    if (!qmat_digest_equal(&qmat_value_at(input, a)->digest, &qmat_value_at(input, b)->digest)) return false;
  }
  return true;
}

/* A key that equal items have in common. */
static uint64_t key_of(const lifted_step *lifted, const qmat_node *type, size_t item) {
  uint64_t key = 0, first;
  for (size_t port = 0; port < qmat_input_count(type); port++) {
    const qmat_value *input = lifted->inputs[port];
    if (!input || input->type != QMAT_LIST || type->inputs[port].list) continue;
    memcpy(&first, qmat_value_at(input, item)->digest.bytes, sizeof first);
    key = qmat_hash_mix(key) ^ first;
  }
  return key == QMAT_NO_KEY ? 0 : key;
}

/* Lists the items that differ from every earlier one: `*different` of them. `equals` gets for each item the first one
 * that equals it. */
static qmat_status find_different(qmat_context *context, const lifted_step *lifted, const qmat_node *type, size_t count,
                                  size_t *items, size_t *equals, size_t *different) {
  qmat_key_table newest;                              /* per key: the newest item in the list that has it */
  uint32_t *older = qmat_alloc(count, sizeof *older); /* per item in the list: the one before it with its key */
  *different = 0;
  bool done = qmat_key_table_init(&newest, count) == 0 && older;
  for (size_t i = 0; i < count && done; i++) {
    const uint64_t key = key_of(lifted, type, i);
    const uint32_t first = qmat_key_table_id(&newest, key);
    uint32_t k = first;
    while (k != QMAT_NO_ID && !are_equal(lifted, type, items[k], i)) k = older[k];
    if (k == QMAT_NO_ID) {
      qmat_key_slot *slot = first == QMAT_NO_ID ? qmat_key_table_add(&newest, key) : qmat_key_table_find(&newest, key);
      if (!slot) {
        done = false;
        break;
      }
      k = (uint32_t)(*different)++;
      slot->id = k;
      items[k] = i;
      older[k] = first;
    }
    equals[i] = items[k];
  }
  qmat_key_table_uninit(&newest);
  qmat_free(older);
  return done ? QMAT_OK : qmat_fail_memory(context, "values");
}

/* Gives the items that were not run what was made of their equals. */
static void copy_results(lifted_step *lifted, const qmat_node *type, size_t count, const size_t *equals) {
  for (size_t i = 0; i < count; i++) {
    if (equals[i] == i) continue;
    bool is_left_out = false;
    for (size_t port = 0; port < qmat_input_count(type); port++) {
      const qmat_value *input = lifted->inputs[port];
      if (input && !type->inputs[port].list && qmat_value_failure(qmat_value_at(input, i))) is_left_out = true;
    }
    lifted->step->lifted_left_out += is_left_out;
    lifted->step->lifted_hits += lifted->hits[equals[i]];
    for (size_t port = 0; port < qmat_output_count(type); port++)
      lifted->outputs[port]->items[i] = qmat_value_retain(lifted->outputs[port]->items[equals[i]]);
  }
}

/* Fails when every item failed, with the first item's error. */
static qmat_status check_any_made(const lifted_step *lifted, qmat_context *context, const qmat_list *first) {
  const qmat_list *made = lifted->outputs[0];
  for (size_t i = 0; i < made->count; i++)
    if (!qmat_value_failure(made->items[i])) return QMAT_OK;
  if (lifted->first_unusable == SIZE_MAX) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%s", qmat_value_failure(made->items[0]));
    return qmat_fail_within(context, first->names[0]);
  }
  context->error = lifted->first_error;
  return qmat_fail_within(context, first->names[lifted->first_unusable]);
}

static qmat_status run_items(qmat_context *context, lifted_step *lifted, const qmat_list *first) {
  const qmat_node *type = lifted->run->graph->nodes[lifted->step->node].type;
  size_t *sizes = qmat_alloc(first->count, sizeof *sizes), *items = qmat_alloc(first->count, sizeof *items),
         *equals = qmat_alloc(first->count, sizeof *equals), failed = SIZE_MAX, different = 0;
  lifted->hits = qmat_calloc(first->count, sizeof *lifted->hits);
  qmat_status status = sizes && items && equals && lifted->hits ? QMAT_OK : qmat_fail_memory(context, "values");
  if (status == QMAT_OK) status = find_different(context, lifted, type, first->count, items, equals, &different);
  if (status == QMAT_OK) {
    lifted->items = items;
    for (size_t i = 0; i < different; i++) sizes[i] = item_size(type, lifted->inputs, items[i]);
    pthread_mutex_init(&lifted->lock, NULL);
    status = qmat_run_items(context, different, sizes, "meshes", run_item, lifted, &failed);
    pthread_mutex_destroy(&lifted->lock);
  }
  if (failed != SIZE_MAX) qmat_fail_within(context, first->names[items[failed]]);
  if (status == QMAT_OK) copy_results(lifted, type, first->count, equals);
  qmat_free(sizes);
  qmat_free(items);
  qmat_free(equals);
  qmat_free(lifted->hits);
  if (status == QMAT_OK && qmat_output_count(type) > 0) status = check_any_made(lifted, context, first);
  return status;
}

qmat_status qmat_run_lifted(qmat_context *context, qmat_run *run, size_t index, const qmat_value *const *inputs,
                            const qmat_list *first, qmat_make_item_fn *make, void *user, qmat_value **outputs) {
  qmat_run_step *step = &run->steps[index];
  const size_t output_count = qmat_output_count(run->graph->nodes[step->node].type);
  qmat_list **lists = qmat_calloc(output_count, sizeof *lists);
  qmat_status status = lists ? QMAT_OK : qmat_fail_memory(context, "values");
  step->lifted = first->count;
  step->lifted_hits = step->lifted_left_out = 0;
  for (size_t port = 0; port < output_count && status == QMAT_OK; port++) {
    lists[port] = qmat_list_new(first->count);
    for (size_t i = 0; lists[port] && i < first->count; i++) {
      lists[port]->names[i] = qmat_strdup(first->names[i]);
      if (!lists[port]->names[i]) status = qmat_fail_memory(context, "values");
    }
    if (!lists[port]) status = qmat_fail_memory(context, "values");
  }
  lifted_step lifted = {.run = run,
                        .step = step,
                        .inputs = inputs,
                        .outputs = lists,
                        .make = make,
                        .user = user,
                        .first_unusable = SIZE_MAX};
  if (status == QMAT_OK) status = run_items(context, &lifted, first);
  for (size_t port = 0; port < output_count && status == QMAT_OK; port++)
    status = qmat_value_seal(context, &lists[port]->base);
  for (size_t port = 0; lists && port < output_count; port++) {
    if (status == QMAT_OK)
      outputs[port] = &lists[port]->base;
    else if (lists[port])
      qmat_value_release(&lists[port]->base);
  }
  qmat_free(lists);
  return status;
}
