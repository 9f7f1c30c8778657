/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/side_by_side.h"

typedef struct shared_progress {
  qmat_context *context;
  const _Atomic size_t *done;
  size_t total;
  const char *unit;
  _Atomic bool ended; /* the run was cancelled, or an item has failed */
} shared_progress;

/* Only the thread that runs the node may call the progress function of the run. */
typedef struct progress_caller {
  shared_progress *shared;
  bool is_main_thread;
} progress_caller;

static bool forward_progress(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                             const char *unit) {
  (void)node_id;
  (void)node_type;
  (void)done;
  (void)total;
  (void)unit;
  const progress_caller *here = user;
  shared_progress *s = here->shared;
  if (here->is_main_thread && qmat_progress(s->context, atomic_load(s->done), s->total, s->unit) != QMAT_OK)
    atomic_store(&s->ended, true);
  return !atomic_load(&s->ended);
}

qmat_status qmat_run_side_by_side(qmat_context *context, size_t count, qmat_item_fn *run, void *user,
                                  const _Atomic size_t *done, size_t total, const char *unit) {
  shared_progress shared = {.context = context, .done = done, .total = total, .unit = unit};
  const int threads = qmat_threads(context);
  const qmat_status status = qmat_progress(context, 0, 0, unit);
  if (status != QMAT_OK) return status;
  size_t failed = SIZE_MAX;
  qmat_error error = {.status = QMAT_OK};
#pragma omp parallel num_threads(threads)
  {
    progress_caller here = {.shared = &shared, .is_main_thread = false};
    qmat_context own = {.progress = forward_progress,
                        .progress_user = &here,
                        .threads = 1,
                        .node_id = context->node_id,
                        .node_type = context->node_type};
#pragma omp master
    here.is_main_thread = true;
#pragma omp for schedule(dynamic, 1)
    for (size_t item = 0; item < count; item++) {
      if (atomic_load(&shared.ended)) continue;
      const qmat_status result = run(user, &own, item);
      qmat_arena_uninit(&own.arena);
      if (result == QMAT_OK || result == QMAT_CANCELLED) continue;
      atomic_store(&shared.ended, true);
#pragma omp critical(qmat_side_by_side)
      if (item < failed) {
        failed = item;
        error = own.error;
      }
    }
    qmat_context_uninit(&own);
  }
  if (failed < SIZE_MAX) {
    context->error = error;
    return error.status;
  }
  return atomic_load(&shared.ended) ? QMAT_CANCELLED : QMAT_OK;
}
