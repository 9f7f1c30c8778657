/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/speculation.h"

#include <omp.h>

/* So many trials are made at once for each thread: enough to keep all busy, few enough to be taken before they are
 * thrown away. */
enum { TRIALS_PER_THREAD = 8 };

/* One trial and what it has found. */
typedef struct ahead {
  uint32_t edge; /* QMAT_NONE: free */
  bool failed;
  uint64_t made; /* when, in changes */
  qmat_collapse collapse;
  qmat_coverage coverage;     /* a view, with the marks of the thread that uses it */
  qmat_protrusion protrusion; /* a view, with the lattice of that thread */
  qmat_trial trial;
} ahead;

/* What a thread works on. */
typedef struct workplace {
  qmat_context context;
  qmat_complex complex;       /* a view */
  qmat_depth_lattice lattice; /* a view */
  qmat_sphere_fit fit;
  uint32_t *marks, stamp; /* per control point */
} workplace;

struct qmat_speculation {
  size_t thread_count, trial_count, batch_count;
  workplace *workplaces;   /* per thread */
  ahead *trials, **batch;  /* room for trial_count */
  uint32_t *trial_of_edge; /* per edge: where its trial is if it has one */
  uint64_t changes;        /* so far */
  uint64_t *changed;       /* per vertex: the last change within two edges of it */
};

static bool is_of_use(const qmat_simplification *s) {
  return qmat_threads(s->context) > 1 && s->rules.on_exceed == QMAT_EXCEED_SKIP &&
         s->rules.protect == QMAT_PROTECT_OFF && s->creases.left == 0;
}

static qmat_status workplace_init(const qmat_simplification *s, workplace *w) {
  qmat_status status = qmat_complex_view_init(s->context, &s->complex, &w->complex);
  if (status == QMAT_OK) status = qmat_depth_lattice_view_init(s->context, &s->protrusion.lattice, &w->lattice);
  if (status != QMAT_OK) return status;
  w->marks = qmat_calloc(s->coverage.point_count, sizeof *w->marks);
  return w->marks ? QMAT_OK : qmat_fail_memory(s->context, "trials of collapses");
}

static void workplace_uninit(workplace *w) {
  qmat_complex_view_uninit(&w->complex);
  qmat_depth_lattice_uninit(&w->lattice);
  qmat_sphere_fit_uninit(&w->fit);
  qmat_free(w->marks);
  qmat_context_uninit(&w->context);
}

qmat_status qmat_speculation_start(qmat_simplification *s) {
  if (!is_of_use(s)) return QMAT_OK;
  qmat_speculation *p = s->speculation = qmat_calloc(1, sizeof *p);
  if (!p) return qmat_fail_memory(s->context, "trials of collapses");
  const size_t threads = (size_t)qmat_threads(s->context), trials = threads * TRIALS_PER_THREAD;
  p->workplaces = qmat_calloc(threads, sizeof *p->workplaces);
  p->trials = qmat_calloc(trials, sizeof *p->trials);
  p->batch = qmat_calloc(trials, sizeof(ahead *));
  p->trial_of_edge = qmat_calloc(s->complex.edge_count, sizeof *p->trial_of_edge);
  p->changed = qmat_calloc(s->complex.vertex_count, sizeof *p->changed);
  if (!p->workplaces || !p->trials || !p->batch || !p->trial_of_edge || !p->changed)
    return qmat_fail_memory(s->context, "trials of collapses");
  for (; p->trial_count < trials; p->trial_count++) {
    ahead *a = &p->trials[p->trial_count];
    a->edge = QMAT_NONE;
    qmat_coverage_view_init(&s->coverage, &a->coverage);
    qmat_protrusion_view_init(&s->protrusion, &a->protrusion);
  }
  qmat_status status = QMAT_OK;
  for (; p->thread_count < threads && status == QMAT_OK; p->thread_count++)
    status = workplace_init(s, &p->workplaces[p->thread_count]);
  return status;
}

void qmat_speculation_end(qmat_simplification *s) {
  qmat_speculation *p = s->speculation;
  s->speculation = NULL;
  if (!p) return;
  for (size_t i = 0; i < p->thread_count; i++) workplace_uninit(&p->workplaces[i]);
  for (size_t i = 0; i < p->trial_count; i++) {
    qmat_collapse_uninit(&p->trials[i].collapse);
    qmat_coverage_view_uninit(&p->trials[i].coverage);
    qmat_protrusion_view_uninit(&p->trials[i].protrusion);
  }
  qmat_free(p->workplaces);
  qmat_free(p->trials);
  qmat_free(p->batch);
  qmat_free(p->trial_of_edge);
  qmat_free(p->changed);
  qmat_free(p);
}

void qmat_speculation_forget(qmat_simplification *s, uint32_t vertex) {
  qmat_speculation *p = s->speculation;
  if (!p) return;
  const qmat_complex *complex = &s->complex;
  p->changes++;
  p->changed[vertex] = p->changes;
  size_t count, further;
  const uint32_t *at = qmat_complex_edges_at(complex, vertex, &count);
  for (size_t i = 0; i < count; i++) {
    const uint32_t *there = qmat_complex_edges_at(complex, qmat_complex_other_end(complex, at[i], vertex), &further);
    for (size_t j = 0; j < 2 * further; j++) p->changed[complex->edges[2 * (size_t)there[j / 2] + j % 2]] = p->changes;
  }
}

static bool is_valid(const qmat_simplification *s, const ahead *a) {
  if (a->edge == QMAT_NONE || a->failed || !s->complex.edge_alive[a->edge]) return false;
  const uint32_t *ends = &s->complex.edges[2 * (size_t)a->edge];
  const uint64_t *changed = s->speculation->changed;
  return changed[ends[0]] <= a->made && changed[ends[1]] <= a->made;
}

/* The edge's valid trial, or NULL. */
static ahead *trial_of(const qmat_simplification *s, uint32_t edge) {
  ahead *a = &s->speculation->trials[s->speculation->trial_of_edge[edge]];
  return a->edge == edge && is_valid(s, a) ? a : NULL;
}

/* Gives the places that are free to `edge` and to edges from the top of the heap. */
static void choose_batch(const qmat_simplification *s, uint32_t edge) {
  qmat_speculation *p = s->speculation;
  size_t from = 0;
  p->batch_count = 0;
  for (uint32_t place = 0; place < p->trial_count; place++) {
    if (is_valid(s, &p->trials[place])) continue;
    if (p->batch_count > 0) {
      while (from < s->heap.count && trial_of(s, s->heap.edges[from])) from++;
      if (from == s->heap.count) return;
      edge = s->heap.edges[from++];
    }
    ahead *a = p->batch[p->batch_count++] = &p->trials[place];
    a->edge = edge;
    a->made = p->changes;
    a->failed = false;
    p->trial_of_edge[edge] = place;
  }
}

static void run_trial(const qmat_simplification *s, workplace *w, ahead *a) {
  const qmat_trial_tools tools = {.context = &w->context,
                                  .complex = &w->complex,
                                  .coverage = &a->coverage,
                                  .protrusion = &a->protrusion,
                                  .fit = &w->fit,
                                  .collapse = &a->collapse};
  a->coverage.marks = w->marks;
  a->coverage.stamp = w->stamp;
  a->protrusion.lattice = w->lattice;
  qmat_candidates candidates;
  qmat_status status = qmat_trial_candidates(s, &tools, a->edge, &candidates);
  if (status == QMAT_OK) status = qmat_complex_preview(&w->context, &w->complex, a->edge, &a->collapse);
  if (status == QMAT_OK) status = qmat_trial_run(s, &tools, &candidates, false, &a->trial);
  a->failed = status != QMAT_OK;
  w->stamp = a->coverage.stamp;
  w->lattice = a->protrusion.lattice;
}

static void run_batch(qmat_simplification *s) {
  qmat_speculation *p = s->speculation;
  for (size_t i = 0; i < p->thread_count; i++) qmat_complex_view_update(&s->complex, &p->workplaces[i].complex);
#pragma omp parallel for num_threads((int)p->thread_count) schedule(dynamic, 1)
  for (size_t i = 0; i < p->batch_count; i++) run_trial(s, &p->workplaces[omp_get_thread_num()], p->batch[i]);
  for (size_t i = 0; i < p->thread_count; i++)
    qmat_depth_lattice_absorb(&s->protrusion.lattice, &p->workplaces[i].lattice);
}

bool qmat_speculation_take(qmat_simplification *s, uint32_t edge, qmat_trial *trial) {
  if (!s->speculation) return false;
  ahead *a = trial_of(s, edge);
  if (!a) {
    choose_batch(s, edge);
    run_batch(s);
    a = trial_of(s, edge);
  }
  if (!a) return false;
  *trial = a->trial;
  const qmat_collapse preview = s->collapse;
  s->collapse = a->collapse;
  a->collapse = preview;
  qmat_coverage_swap_found(&s->coverage, &a->coverage);
  qmat_protrusion_swap_bounds(&s->protrusion, &a->protrusion);
  a->edge = QMAT_NONE;
  return true;
}
