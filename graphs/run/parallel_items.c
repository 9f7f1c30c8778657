/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/run/parallel_items.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <time.h>

/* These are pthreads, since a parallel region of a node inside an OpenMP thread would get one thread only. */

static const int64_t ASK_INTERVAL = 50000000; /* nanoseconds between two calls of the outer progress function */
static const int REPORT_AFTER = 20;           /* calls without news before progress is reported again */

typedef enum place_state { PLACE_FREE, PLACE_BUSY, PLACE_DONE } place_state;

typedef struct item_pool item_pool;

/* A place for one running item. */
typedef struct place {
  item_pool *pool;
  pthread_t thread;
  place_state state;
  bool outside; /* runs in the calling thread */
  size_t item;
  qmat_context context; /* of the item */
} place;

struct item_pool {
  qmat_context *outer;
  const char *unit;
  qmat_item_fn *run;
  void *user;
  size_t count;
  pthread_mutex_t lock; /* guards the fields below */
  pthread_cond_t changed;
  size_t done, failed; /* number of finished items; the first item that failed, SIZE_MAX: none */
  qmat_error error;    /* of that one */
  bool cancelled;
  size_t reported; /* the last number reported; used by the calling thread only, as the next */
  int silent;      /* calls of the outer progress function since */
};

typedef struct sized_item {
  size_t size, item;
} sized_item;

/* Sorts by size, the largest first; equal sizes keep their order. */
static int by_falling_size(const void *a, const void *b) {
  const sized_item *first = a, *second = b;
  if (first->size != second->size) return first->size > second->size ? -1 : 1;
  return first->item < second->item ? -1 : first->item > second->item;
}

/* Calls the outer progress function, which may cancel. */
static void ask_outer(item_pool *pool) {
  pthread_mutex_lock(&pool->lock);
  const size_t done = pool->done;
  const bool cancelled = pool->cancelled;
  pthread_mutex_unlock(&pool->lock);
  if (cancelled) return;
  const bool due = done != pool->reported || ++pool->silent == REPORT_AFTER;
  if (due) {
    pool->reported = done;
    pool->silent = 0;
  }
  const qmat_status status =
      due ? qmat_progress(pool->outer, done, pool->count, pool->unit) : qmat_progress(pool->outer, 0, 0, "");
  if (status == QMAT_OK) return;
  pthread_mutex_lock(&pool->lock);
  pool->cancelled = true;
  pthread_mutex_unlock(&pool->lock);
}

static bool item_may_continue(void *user, const char *node_id, const char *node_type, uint64_t done, uint64_t total,
                              const char *unit) {
  (void)node_id;
  (void)node_type;
  (void)done;
  (void)total;
  (void)unit;
  const place *here = user;
  item_pool *pool = here->pool;
  if (here->outside) ask_outer(pool);
  pthread_mutex_lock(&pool->lock);
  const bool needed = !pool->cancelled && here->item < pool->failed;
  pthread_mutex_unlock(&pool->lock);
  return needed;
}

static void *run_item(void *user) {
  place *here = user;
  item_pool *pool = here->pool;
  const qmat_status status = pool->run(pool->user, &here->context, here->item);
  pthread_mutex_lock(&pool->lock);
  /* An item that was stopped comes after one that failed, or all were cancelled. */
  if (status != QMAT_OK && here->item < pool->failed && !pool->cancelled) {
    pool->failed = here->item;
    pool->error = here->context.error;
    pool->error.status = status;
  }
  pool->done++;
  here->state = PLACE_DONE;
  pthread_cond_signal(&pool->changed);
  pthread_mutex_unlock(&pool->lock);
  qmat_context_uninit(&here->context);
  return NULL;
}

/* Starts an item. If the system has no thread and nothing else runs, runs it here. False: not started. */
static bool start_item(item_pool *pool, place *here, size_t item, int threads, bool alone) {
  *here = (place){.pool = pool,
                  .state = PLACE_BUSY,
                  .item = item,
                  .context = {.progress = item_may_continue,
                              .progress_user = here,
                              .threads = threads,
                              .node_id = pool->outer->node_id,
                              .node_type = pool->outer->node_type}};
  here->outside = alone && qmat_threads(pool->outer) == 1;
  if (!here->outside && pthread_create(&here->thread, NULL, run_item, here) == 0) return true;
  here->outside = alone;
  if (alone)
    run_item(here);
  else
    here->state = PLACE_FREE;
  return alone;
}

/* Waits until an item ends, at most about ASK_INTERVAL. */
static void wait_for_change(item_pool *pool, const place *places, size_t place_count) {
  struct timespec until;
  clock_gettime(CLOCK_MONOTONIC, &until);
  const int64_t nanoseconds = until.tv_nsec + ASK_INTERVAL;
  until.tv_sec += (time_t)(nanoseconds / 1000000000);
  until.tv_nsec = (long)(nanoseconds % 1000000000);
  pthread_mutex_lock(&pool->lock);
  bool ended = false, late = false;
  while (!ended && !late) {
    for (size_t i = 0; i < place_count; i++) ended = ended || places[i].state == PLACE_DONE;
    if (!ended) late = pthread_cond_timedwait(&pool->changed, &pool->lock, &until) == ETIMEDOUT;
  }
  pthread_mutex_unlock(&pool->lock);
}

/* Frees the places and threads of finished items. */
static void collect_ended(item_pool *pool, place *places, size_t place_count, size_t *running, int *free_threads) {
  for (size_t i = 0; i < place_count; i++) {
    pthread_mutex_lock(&pool->lock);
    const bool ended = places[i].state == PLACE_DONE;
    pthread_mutex_unlock(&pool->lock);
    if (!ended) continue;
    if (!places[i].outside) pthread_join(places[i].thread, NULL);
    places[i].state = PLACE_FREE;
    *free_threads += places[i].context.threads;
    --*running;
  }
}

static place *find_free(item_pool *pool, place *places, size_t place_count) {
  place *found = NULL;
  pthread_mutex_lock(&pool->lock);
  for (size_t i = 0; i < place_count && !found; i++)
    if (places[i].state == PLACE_FREE) found = &places[i];
  pthread_mutex_unlock(&pool->lock);
  return found;
}

/* An item's share of the free threads; `rest` is the size of all items that have not started, this one included. */
static int share_of(int free_threads, double size, double rest) {
  const double share = rest > 0 ? round(free_threads * size / rest) : 1;
  return share < 1 ? 1 : share > free_threads ? free_threads : (int)share;
}

static void run_all(item_pool *pool, const sized_item *order, place *places, size_t place_count) {
  double rest = 0; /* exact: sizes in bytes stay below 2^53 */
  for (size_t i = 0; i < pool->count; i++) rest += (double)order[i].size;
  int free_threads = qmat_threads(pool->outer);
  size_t next = 0, running = 0;
  for (;;) {
    collect_ended(pool, places, place_count, &running, &free_threads);
    ask_outer(pool);
    pthread_mutex_lock(&pool->lock);
    const size_t last = pool->cancelled ? 0 : pool->failed;
    pthread_mutex_unlock(&pool->lock);
    /* Items after a failed one are skipped. */
    while (next < pool->count && order[next].item >= last) rest -= (double)order[next++].size;
    if (next == pool->count && running == 0) return;
    place *here = next < pool->count && free_threads > 0 ? find_free(pool, places, place_count) : NULL;
    const int threads = here ? share_of(free_threads, (double)order[next].size, rest) : 0;
    if (here && start_item(pool, here, order[next].item, threads, running == 0)) {
      rest -= (double)order[next++].size;
      free_threads -= threads;
      running++;
    } else {
      wait_for_change(pool, places, place_count);
    }
  }
}

qmat_status qmat_run_items(qmat_context *context, size_t count, const size_t *sizes, const char *unit,
                           qmat_item_fn *run, void *user, size_t *failed) {
  const size_t threads = (size_t)qmat_threads(context), place_count = count < threads ? count : threads;
  item_pool pool = {.outer = context, .unit = unit, .run = run, .user = user, .count = count, .failed = SIZE_MAX};
  pthread_condattr_t attributes;
  *failed = SIZE_MAX;
  sized_item *order = qmat_calloc(count, sizeof *order);
  place *places = qmat_calloc(place_count, sizeof *places);
  if (!order || !places) {
    qmat_free(order);
    qmat_free(places);
    return qmat_fail_memory(context, "items");
  }
  for (size_t i = 0; i < count; i++) order[i] = (sized_item){.size = sizes[i], .item = i};
  if (count > 1) qsort(order, count, sizeof *order, by_falling_size);
  /* None of these fails on Linux. */
  pthread_mutex_init(&pool.lock, NULL);
  pthread_condattr_init(&attributes);
  pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
  pthread_cond_init(&pool.changed, &attributes);
  pthread_condattr_destroy(&attributes);
  run_all(&pool, order, places, place_count);
  pthread_cond_destroy(&pool.changed);
  pthread_mutex_destroy(&pool.lock);
  qmat_free(order);
  qmat_free(places);
  if (pool.cancelled) return QMAT_CANCELLED; /* the error is in the context */
  if (pool.failed == SIZE_MAX) return QMAT_OK;
  *failed = pool.failed;
  context->error = pool.error;
  return pool.error.status;
}
