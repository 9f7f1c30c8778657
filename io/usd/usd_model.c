/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_model.h"

#include <stdlib.h>
#include <string.h>

#include "core/text.h"
#include "io/usd/usd_keep.h"
#include "io/usd/usd_scene.h"

static qmat_status fail_shortage(qmat_context *context) {
  return qmat_fail_memory(context, "the meshes of a scene");
}

/* ---- the choice ---- */

/* The number that `choice` is; SIZE_MAX: it is none. */
static size_t number_of(const char *choice) {
  const size_t length = strlen(choice);
  if (length == 0 || length > 9 || strspn(choice, "0123456789") != length) return SIZE_MAX;
  return (size_t)strtoul(choice, NULL, 10);
}

/* Marks the chosen meshes. */
static qmat_status choose(qmat_context *context, const qmat_usd_scene *scene, const char *path, const char *choice,
                          bool *chosen) {
  const bool all = strcmp(choice, "all") == 0;
  size_t found = 0, number = number_of(choice);
  const char *first = NULL; /* path that ends in the choice */
  for (size_t i = 0; i < scene->mesh_count; i++) chosen[i] = all;
  for (size_t i = 0; i < scene->placement_count && !all; i++) {
    const qmat_usd_placement *placement = &scene->placements[i];
    if (chosen[placement->mesh] || !qmat_usd_path_ends_in(placement->path, choice)) continue;
    chosen[placement->mesh] = true;
    if (found++ == 0) first = placement->path;
  }
  if (found == 0 && !all && number < scene->mesh_count) {
    chosen[number] = true;
    found = 1;
  }
  if (all || found == 1) return QMAT_OK;
  if (found == 0) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the scene has no mesh '%s'", choice);
    qmat_fail_hint(context, "the path of a prim, a number below %zu, merged, or all; qmat mat: --set model.mesh=all",
                   scene->mesh_count);
  } else {
    qmat_fail(context, QMAT_ERROR_USAGE, "%zu different meshes have a path that ends in '%s'", found, choice);
    qmat_fail_hint(context, "give the whole path; qmat mat: --set model.mesh=%s", qmat_usd_shown(first));
  }
  qmat_fail_at(context, path, 0, 0);
  return qmat_fail_field(context, "mesh");
}

/* ---- the meshes and their places ---- */

static char *shown_copy(const char *path) {
  return qmat_strdup(qmat_usd_shown(path));
}

/* Lists the chosen meshes. `items` (per mesh of the scene) becomes the number in the list. */
static qmat_status list_meshes(qmat_context *context, const qmat_usd_scene *scene, const bool *chosen, uint32_t *items,
                               qmat_usd_meshes *meshes) {
  const size_t most = scene->mesh_count;
  meshes->ids = qmat_alloc(most, sizeof *meshes->ids);
  meshes->soups = qmat_calloc(most, sizeof *meshes->soups);
  meshes->names = qmat_calloc(most, sizeof *meshes->names);
  meshes->uses = qmat_calloc(most, sizeof *meshes->uses);
  if (!meshes->ids || !meshes->soups || !meshes->names || !meshes->uses) return fail_shortage(context);
  for (size_t i = 0; i < most; i++) {
    if (!chosen[i]) continue;
    items[i] = (uint32_t)meshes->count;
    meshes->ids[meshes->count++] = (uint32_t)i;
  }
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < scene->placement_count && status == QMAT_OK; i++) {
    const qmat_usd_placement *placement = &scene->placements[i];
    if (!chosen[placement->mesh]) continue;
    const size_t item = items[placement->mesh];
    if (meshes->uses[item]++ == 0 && !(meshes->names[item] = shown_copy(placement->path)))
      status = fail_shortage(context);
  }
  for (size_t i = 0; i < meshes->count && status == QMAT_OK; i++)
    status = qmat_usd_scene_add_mesh(context, scene, meshes->ids[i], &meshes->soups[i]);
  return status;
}

static qmat_status list_places(qmat_context *context, const qmat_usd_scene *from, const bool *chosen,
                               const uint32_t *items, const qmat_usd_meshes *meshes, qmat_scene *scene) {
  size_t count = 0;
  for (size_t i = 0; i < meshes->count; i++) count += meshes->uses[i];
  scene->meshes = qmat_alloc(meshes->count, sizeof *scene->meshes);
  scene->placed = qmat_alloc(count, sizeof *scene->placed);
  scene->placements = qmat_alloc(count, 16 * sizeof *scene->placements);
  scene->placement_paths = qmat_calloc(count, sizeof *scene->placement_paths);
  scene->placement_bodies = qmat_alloc(count, sizeof *scene->placement_bodies);
  if (!scene->meshes || !scene->placed || !scene->placements || !scene->placement_paths || !scene->placement_bodies)
    return fail_shortage(context);
  memcpy(scene->meshes, meshes->ids, meshes->count * sizeof *scene->meshes);
  scene->mesh_count = meshes->count;
  for (size_t i = 0; i < from->placement_count; i++) {
    const qmat_usd_placement *placement = &from->placements[i];
    if (!chosen[placement->mesh]) continue;
    const size_t at = scene->placement_count++;
    scene->placed[at] = items[placement->mesh];
    scene->placement_bodies[at] = placement->states_body;
    memcpy(scene->placements + 16 * at, placement->world.m, sizeof placement->world.m);
    scene->placement_paths[at] = shown_copy(placement->path);
    if (!scene->placement_paths[at]) return fail_shortage(context);
  }
  return QMAT_OK;
}

/* Gives the scene the rig, which leaves `from`, and its places their skins. Call it when they are listed. */
static qmat_status list_skins(qmat_context *context, qmat_usd_scene *from, const bool *chosen, qmat_scene *scene) {
  size_t at = 0;
  if (from->rig.rig.skin_count == 0) return QMAT_OK;
  scene->rig = from->rig.rig;
  from->rig.rig = (qmat_rig){0};
  scene->rig.placed_skins = qmat_alloc(scene->placement_count, sizeof *scene->rig.placed_skins);
  if (!scene->rig.placed_skins) return fail_shortage(context);
  scene->rig.placed_count = scene->placement_count;
  for (size_t i = 0; i < from->placement_count; i++)
    if (chosen[from->placements[i].mesh]) scene->rig.placed_skins[at++] = from->placements[i].skin;
  return QMAT_OK;
}

static qmat_status read_merged(qmat_context *context, const qmat_usd_scene *from, const char *path,
                               qmat_usd_meshes *meshes) {
  meshes->soups = qmat_calloc(1, sizeof *meshes->soups);
  if (!meshes->soups) return fail_shortage(context);
  meshes->count = 1;
  return qmat_usd_scene_add_all(context, from, path, &meshes->soups[0]);
}

qmat_status qmat_usd_read_meshes(qmat_context *context, const qmat_bytes *bytes, const char *path, const char *choice,
                                 size_t segments, qmat_scene *scene, qmat_usd_meshes *meshes, json_t *report) {
  qmat_usd_scene from;
  bool *chosen = NULL;
  uint32_t *items = NULL;
  *meshes = (qmat_usd_meshes){0};
  qmat_status status = qmat_usd_scene_open(context, bytes, path, segments, &from);
  if (status == QMAT_OK && strcmp(choice, "merged") == 0) {
    status = read_merged(context, &from, path, meshes);
  } else if (status == QMAT_OK) {
    chosen = qmat_alloc(from.mesh_count, sizeof *chosen);
    items = qmat_alloc(from.mesh_count, sizeof *items);
    status = chosen && items ? choose(context, &from, path, choice, chosen) : fail_shortage(context);
    if (status == QMAT_OK) status = list_meshes(context, &from, chosen, items, meshes);
    if (status == QMAT_OK) status = list_places(context, &from, chosen, items, meshes, scene);
    if (status == QMAT_OK) status = list_skins(context, &from, chosen, scene);
    if (status == QMAT_OK) status = qmat_usd_keep(context, from.stage, bytes, scene);
    scene->has_instances = from.instances > 0;
  }
  if (status == QMAT_OK) status = qmat_usd_scene_report(context, &from, report);
  qmat_free(items);
  qmat_free(chosen);
  qmat_usd_scene_close(&from);
  return status;
}

void qmat_usd_meshes_uninit(qmat_usd_meshes *meshes) {
  for (size_t i = 0; i < meshes->count; i++) {
    qmat_soup_uninit(&meshes->soups[i]);
    if (meshes->names) qmat_free(meshes->names[i]);
  }
  qmat_free(meshes->ids);
  qmat_free(meshes->soups);
  qmat_free(meshes->names);
  qmat_free(meshes->uses);
  *meshes = (qmat_usd_meshes){0};
}
