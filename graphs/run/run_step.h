/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_RUN_RUN_STEP_H
#define QMAT_GRAPHS_RUN_RUN_STEP_H

#include <pthread.h>

#include "graphs/run/run.h"

/* Called before and after each step; either function may be NULL. */
typedef struct qmat_run_observer {
  void *user;
  void (*started)(void *user, const qmat_run *run, size_t step);
  void (*done)(void *user, const qmat_run *run, size_t step);
} qmat_run_observer;

/* One execution of a plan. */
typedef struct qmat_executor {
  qmat_context *context;
  qmat_run *run;
  const qmat_run_observer *observer;
  bool unsteady;         /* a node made other bytes than the cache has for it */
  pthread_mutex_t *lock; /* held while the cache is used; NULL: no other executor uses it */
} qmat_executor;

void qmat_executor_started(const qmat_executor *executor, size_t step);
void qmat_executor_done(const qmat_executor *executor, size_t step);

/* Makes the value of a slot available: from the cache, else by running the step that makes it. */
qmat_status qmat_need_value(qmat_executor *executor, size_t slot);

/* Runs a step, over lists where it is given some, stores its results in the cache and records the files it read. */
qmat_status qmat_run_step_now(qmat_executor *executor, size_t step);

#endif
