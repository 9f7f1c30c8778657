/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/side_by_side.h"

#include <time.h>

/* The main thread, when it has no item left, asks so often whether to go on: nanoseconds. */
enum { WAIT = 1000000 };

typedef struct shared_items {
  qmat_context *context;
  const _Atomic size_t *done;
  size_t total;
  const char *unit;
  _Atomic size_t next, ended; /* the next item to start; how many have ended or are left out */
  _Atomic size_t failed;      /* the first item that has failed; SIZE_MAX: none */
  _Atomic bool cancelled;
  qmat_error error; /* of the item that failed */
} shared_items;

/* A thread and its item. Only the thread that runs the node may call the progress function of the run. */
typedef struct item_thread {
  shared_items *shared;
  qmat_context *own; /* of its items */
  bool is_main_thread;
  size_t item;
} item_thread;

static void ask_outer(shared_items *s) {
  if (qmat_progress(s->context, atomic_load(s->done), s->total, s->unit) != QMAT_OK) atomic_store(&s->cancelled, true);
}

static bool is_needed(const shared_items *s, size_t item) {
  return !atomic_load(&s->cancelled) && item < atomic_load(&s->failed);
}

static bool item_may_continue(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                              const char *unit) {
  (void)node_id;
  (void)node_type;
  (void)done;
  (void)total;
  (void)unit;
  const item_thread *here = user;
  here->own->progress_time = 0; /* each poll comes here: the outer context limits how often the run is asked */
  if (here->is_main_thread) ask_outer(here->shared);
  return is_needed(here->shared, here->item);
}

static void note_failure(shared_items *s, size_t item, const qmat_error *error, qmat_status status) {
#pragma omp critical(qmat_side_by_side)
  if (is_needed(s, item)) { /* one that was stopped comes after one that failed, or all were cancelled */
    s->error = *error;
    s->error.status = status;
    atomic_store(&s->failed, item);
  }
}

qmat_status qmat_run_side_by_side(qmat_context *context, size_t count, qmat_item_fn *run, void *user,
                                  const _Atomic size_t *done, size_t total, const char *unit) {
  shared_items shared = {.context = context, .done = done, .total = total, .unit = unit, .failed = SIZE_MAX};
  const int threads = qmat_threads(context);
  const qmat_status status = qmat_progress(context, 0, 0, unit);
  if (status != QMAT_OK) return status;
#pragma omp parallel num_threads(threads)
  {
    item_thread here = {.shared = &shared, .is_main_thread = false};
    qmat_context own = {.progress = item_may_continue,
                        .progress_user = &here,
                        .threads = 1,
                        .node_id = context->node_id,
                        .node_type = context->node_type};
    here.own = &own;
#pragma omp master
    here.is_main_thread = true;
    while ((here.item = atomic_fetch_add(&shared.next, 1)) < count) {
      if (is_needed(&shared, here.item)) {
        const qmat_status result = run(user, &own, here.item);
        if (result != QMAT_OK) note_failure(&shared, here.item, &own.error, result);
        qmat_arena_uninit(&own.arena);
      }
      atomic_fetch_add(&shared.ended, 1);
    }
    while (here.is_main_thread && atomic_load(&shared.ended) < count) {
      ask_outer(&shared);
      nanosleep(&(struct timespec){.tv_nsec = WAIT}, NULL);
    }
    qmat_context_uninit(&own);
  }
  if (atomic_load(&shared.cancelled)) return QMAT_CANCELLED;
  if (atomic_load(&shared.failed) == SIZE_MAX) return QMAT_OK;
  context->error = shared.error;
  return shared.error.status;
}
