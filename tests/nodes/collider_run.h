/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_NODES_COLLIDER_RUN_H
#define QMAT_TESTS_NODES_COLLIDER_RUN_H

/* Runs of medial.colliders for tests. Include after cmocka. */

#include "tests/nodes/pipeline.h"
#include "tests/shapes.h"

typedef struct collider_run {
  qmat_mesh *mesh;
  qmat_medial *medial;
  qmat_colliders *colliders;
  qmat_report *report;
} collider_run;

/* Takes mesh and medial mesh over. Free with collider_run_free. */
static inline collider_run make_colliders(qmat_mesh *mesh, qmat_medial *medial, const char *params, int threads) {
  collider_run r = {.mesh = mesh->base.sealed ? mesh : shape_seal(mesh), .medial = medial};
  qmat_value *outputs[2];
  pipeline_must_run(threads, "medial.colliders", params, (const qmat_value *[]){&r.mesh->base, &medial->base}, outputs);
  r.colliders = (qmat_colliders *)outputs[0];
  r.report = (qmat_report *)outputs[1];
  return r;
}

static inline void collider_run_free(collider_run *r) {
  qmat_value_release(&r->mesh->base);
  qmat_value_release(&r->medial->base);
  qmat_value_release(&r->colliders->base);
  qmat_value_release(&r->report->base);
}

#endif
