/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_scene.h"

#include <math.h>
#include <string.h>

#include "core/key_table.h"
#include "io/usd/usd_instancer.h"
#include "io/usd/usd_shape.h"

#define FREE_ELEMENTS ((size_t)1 << 24)
#define ELEMENTS_PER_BYTE 16
#define FREE_PLACEMENTS ((size_t)1 << 20)
#define BYTES_PER_PLACEMENT 8

enum { DEEPEST_INSTANCERS = 16, USUAL_SEGMENTS = 64 };

/* What a prim inherits from its parent. */
typedef struct inherited {
  qmat_usd_transform world;
  const char *purpose; /* "default" when no prim above has one */
  int instancers;      /* above it */
  bool is_prototype;   /* it is itself the prototype of an instancer */
  bool is_body;        /* it or a prim above it is a rigid body */
} inherited;

typedef struct reader {
  qmat_context *context;
  qmat_usd_scene *scene;
  qmat_usd_stage *stage;
  size_t segments;
  bool takes_undefined; /* also reads prims that only have an 'over' */
  bool has_undefined;   /* such a prim was found */
  qmat_error broken;    /* of the first instancer that is left out; QMAT_OK: there is none */
  bool leaves_medials;  /* the root layer is one that qmat has written over another */
  qmat_key_table known; /* the numbers of meshes by the first bytes of their digests */
} reader;

/* ---- meshes ---- */

static uint64_t key_of(const qmat_digest *digest) {
  uint64_t key;
  memcpy(&key, digest->bytes, sizeof key);
  return key == QMAT_NO_KEY ? 0 : key;
}

/* The number of the mesh with this digest; UINT32_MAX: it is new. */
static uint32_t find_mesh(const reader *r, const qmat_digest *digest) {
  const uint32_t number = qmat_key_table_id(&r->known, key_of(digest));
  return number != QMAT_NO_ID && qmat_digest_equal(&r->scene->digests[number], digest) ? number : UINT32_MAX;
}

static qmat_status add_mesh(reader *r, const qmat_usd_prim *prim, const qmat_usd_mesh *mesh,
                            const qmat_digest *digest) {
  qmat_usd_scene *scene = r->scene;
  const size_t at = scene->mesh_count;
  if (qmat_grow((void **)&scene->meshes, &scene->mesh_capacity, at + 1, sizeof *scene->meshes) != 0 ||
      qmat_grow((void **)&scene->digests, &scene->digest_capacity, at + 1, sizeof *scene->digests) != 0)
    return qmat_usd_fail_prim_memory(prim);
  const uint64_t key = key_of(digest);
  if (qmat_key_table_id(&r->known, key) == QMAT_NO_ID) {
    qmat_key_slot *slot = qmat_key_table_add(&r->known, key);
    if (!slot) return qmat_usd_fail_prim_memory(prim);
    slot->id = (uint32_t)at;
  }
  scene->meshes[at] = *mesh;
  scene->digests[at] = *digest;
  scene->mesh_count++;
  if (mesh->scheme != QMAT_SCHEME_NONE) scene->cages++;
  scene->holes += qmat_usd_mesh_holes(mesh);
  return QMAT_OK;
}

static qmat_status fail_too_many(const reader *r, const qmat_usd_prim *prim, const char *what) {
  qmat_usd_prim_fail(prim, "the scene has more %s than its files justify", what);
  return r->context->error.status = QMAT_ERROR_GEOMETRY;
}

static qmat_status add_placement(const reader *r, const qmat_usd_prim *prim, const qmat_usd_placement *placement) {
  qmat_usd_scene *scene = r->scene;
  if (scene->placement_count >= FREE_PLACEMENTS + qmat_usd_stage_bytes(r->stage) / BYTES_PER_PLACEMENT)
    return fail_too_many(r, prim, "places of meshes");
  if (qmat_grow((void **)&scene->placements, &scene->placement_capacity, scene->placement_count + 1,
                sizeof *scene->placements) != 0)
    return qmat_usd_fail_prim_memory(prim);
  scene->placements[scene->placement_count++] = *placement;
  return QMAT_OK;
}

/* Places the mesh of this number at the prim. `skin` as in qmat_usd_placement. */
static qmat_status place_mesh(const reader *r, const qmat_usd_prim *prim, uint32_t mesh, uint32_t skin,
                              const inherited *state) {
  const qmat_usd_placement placement = {
      .mesh = mesh,
      .world = state->world,
      .skin = skin,
      .states_body = state->is_body || qmat_usd_prim_has_schema(prim, "PhysicsCollisionAPI"),
      .path = qmat_usd_prim_path(prim, &r->scene->arena)};
  return placement.path ? add_placement(r, prim, &placement) : qmat_usd_fail_prim_memory(prim);
}

/* Whether the transform keeps a volume: it is finite and flattens nothing. */
static bool keeps_volume(const qmat_usd_transform *world) {
  for (int i = 0; i < 16; i++)
    if (!isfinite(world->m[i])) return false;
  return fabs(qmat_usd_volume(world)) > 0;
}

static qmat_status warn_if_flattened(const qmat_usd_prim *prim, const inherited *state, bool *flattened) {
  *flattened = !keeps_volume(&state->world);
  return *flattened ? qmat_usd_warn(prim, "left out: its transform flattens it or is not finite") : QMAT_OK;
}

static qmat_status read_mesh(reader *r, const qmat_usd_prim *prim, const inherited *state) {
  qmat_usd_mesh mesh = {0};
  qmat_digest digest;
  bool flattened;
  qmat_status status = qmat_usd_mesh_read(prim, &mesh);
  if (status != QMAT_OK) return status;
  const char *lacks = qmat_usd_mesh_lacks(&mesh);
  if (lacks) return qmat_usd_warn(prim, "the mesh has no %s", lacks);
  status = warn_if_flattened(prim, state, &flattened);
  if (status != QMAT_OK || flattened) return status;
  uint32_t skin = UINT32_MAX;
  if (state->instancers == 0) {
    status = qmat_usd_rig_bind(&r->scene->rig, r->stage, prim, &mesh, &skin);
  } else if (mesh.joints) {
    status = qmat_usd_warn(prim, "its skeleton is ignored where a point instancer places it");
  }
  if (status != QMAT_OK) return status;
  if (qmat_usd_mesh_digest(&mesh, &digest) != QMAT_OK) return qmat_usd_fail_prim_memory(prim);
  uint32_t number = find_mesh(r, &digest);
  if (number == UINT32_MAX) {
    number = (uint32_t)r->scene->mesh_count;
    status = add_mesh(r, prim, &mesh, &digest);
  }
  return status == QMAT_OK ? place_mesh(r, prim, number, skin, state) : status;
}

static qmat_status read_shape(reader *r, const qmat_usd_prim *prim, const char *type, const inherited *state) {
  qmat_usd_scene *scene = r->scene;
  qmat_usd_shape shape;
  qmat_usd_mesh mesh;
  qmat_digest digest;
  bool flattened;
  scene->shapes++;
  qmat_status status = qmat_usd_shape_read(prim, type, &shape);
  if (status != QMAT_OK || shape.is_flat) return status;
  status = warn_if_flattened(prim, state, &flattened);
  if (status != QMAT_OK || flattened) return status;
  if (qmat_usd_shape_digest(&shape, &digest) != QMAT_OK) return qmat_usd_fail_prim_memory(prim);
  uint32_t number = find_mesh(r, &digest);
  if (number == UINT32_MAX) {
    number = (uint32_t)scene->mesh_count;
    if (!qmat_usd_shape_mesh(&shape, r->segments, &scene->arena, &mesh)) return qmat_usd_fail_prim_memory(prim);
    scene->shape_elements += mesh.points->count + mesh.indices->count;
    if (scene->shape_elements > FREE_ELEMENTS) return fail_too_many(r, prim, "different shapes");
    status = add_mesh(r, prim, &mesh, &digest);
  }
  return status == QMAT_OK ? place_mesh(r, prim, number, UINT32_MAX, state) : status;
}

/* ---- prims ---- */

/* Whether the type is geometry that is not read. */
static bool is_other_shape(const char *type) {
  static const char *const types[] = {"Points",      "BasisCurves",   "NurbsPatch", "TetMesh",
                                      "NurbsCurves", "HermiteCurves", "Volume",     "Field3DAsset"};
  for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
    if (strcmp(type, types[i]) == 0) return true;
  }
  return false;
}

/* Whether an earlier run has added the prim, with its skin, to a prim that has a mesh. */
static bool is_addition(const reader *r, const qmat_usd_prim *prim) {
  const qmat_usd_value *data = qmat_usd_prim_field(prim, "customData");
  return qmat_usd_is_medial_data(data) && (r->leaves_medials || qmat_usd_text(qmat_usd_entry(data, "qmat_prim")));
}

/* Whether the prim and all prims below it are skipped. Updates the inherited purpose. */
static qmat_status find_skipped(reader *r, const qmat_usd_prim *prim, inherited *state, bool *skipped) {
  const char *visibility, *purpose;
  *skipped = true;
  if (!qmat_usd_truth(qmat_usd_prim_field(prim, "active"), true)) {
    r->scene->prims_skipped++;
    return QMAT_OK;
  }
  if (is_addition(r, prim)) return QMAT_OK;
  const char *specifier = qmat_usd_prim_specifier(prim);
  qmat_status status = QMAT_OK;
  if (strcmp(specifier, "class") == 0 && !state->is_prototype) return QMAT_OK;
  if (strcmp(specifier, "over") == 0 && !state->is_prototype) {
    r->has_undefined = true;
    status =
        qmat_usd_warn(prim, r->takes_undefined ? "read although nothing defines it: the scene has only an 'over' of it"
                                               : "skipped with all prims below it: nothing defines this 'over'");
    if (status != QMAT_OK || !r->takes_undefined) return status;
  }
  status = qmat_usd_prim_token(prim, "visibility", "inherited", &visibility);
  if (status == QMAT_OK) status = qmat_usd_prim_token(prim, "purpose", state->purpose, &purpose);
  if (status != QMAT_OK) return status;
  state->purpose = purpose;
  *skipped = strcmp(visibility, "invisible") == 0;
  if (*skipped) r->scene->prims_skipped++;
  return QMAT_OK;
}

static bool is_for_rendering(const char *purpose) {
  return strcmp(purpose, "default") == 0 || strcmp(purpose, "render") == 0;
}

static qmat_status read_geometry(reader *r, const qmat_usd_prim *prim, const char *type, const inherited *state) {
  const bool is_mesh = strcmp(type, "Mesh") == 0, is_shape = qmat_usd_is_shape(type);
  if (!is_mesh && !is_shape && !is_other_shape(type)) return QMAT_OK;
  if (!is_for_rendering(state->purpose)) {
    r->scene->prims_skipped++;
    return QMAT_OK;
  }
  if (is_mesh) return read_mesh(r, prim, state);
  if (!is_shape) {
    r->scene->shapes_skipped++;
    return qmat_usd_warn(prim, "skipped: a %s is not a surface that bounds a solid", type);
  }
  return read_shape(r, prim, type, state);
}

static qmat_status read_prim(reader *r, qmat_usd_prim *prim, inherited state);

static qmat_status read_children(reader *r, qmat_usd_prim *prim, const inherited *state) {
  const char *const *names;
  size_t count;
  qmat_status status = qmat_usd_prim_children(prim, &names, &count);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    qmat_usd_prim child;
    status = qmat_usd_prim_child(r->stage, prim, names[i], &child);
    if (status == QMAT_OK) status = read_prim(r, &child, *state);
    qmat_usd_prim_uninit(&child);
  }
  return status;
}

/* ---- point instancers ---- */

/* What a prototype is read with. */
typedef struct prototype {
  reader *r;
  const inherited *state;
} prototype;

static qmat_status read_prototype(void *user, qmat_usd_prim *prim) {
  const prototype *p = user;
  return read_prim(p->r, prim, *p->state);
}

/* Places what a prototype has, the places from `first` on, at each of its instances instead. */
static qmat_status place_instances(const reader *r, const qmat_usd_prim *prim, const qmat_usd_instancer *instancer,
                                   size_t prototype, const inherited *state, size_t first) {
  const size_t begin = prototype > 0 ? instancer->ends[prototype - 1] : 0, end = instancer->ends[prototype];
  qmat_usd_scene *scene = r->scene;
  const size_t count = scene->placement_count - first;
  qmat_usd_placement *own = qmat_alloc(count, sizeof *own);
  if (!own) return qmat_usd_fail_prim_memory(prim);
  if (count > 0) memcpy(own, scene->placements + first, count * sizeof *own);
  scene->placement_count = first;
  qmat_status status = QMAT_OK;
  for (size_t i = begin; i < end && status == QMAT_OK; i++) {
    if (i % 65536 == 0) status = qmat_progress(r->context, i, instancer->instance_count, "instances");
    if (status != QMAT_OK) break;
    const qmat_usd_transform world = qmat_usd_product(&instancer->placements[i], &state->world);
    for (size_t k = 0; k < count && status == QMAT_OK; k++) {
      qmat_usd_placement placed = own[k];
      placed.world = qmat_usd_product(&own[k].world, &world);
      if (keeps_volume(&placed.world)) status = add_placement(r, prim, &placed);
    }
  }
  qmat_free(own);
  return status;
}

static qmat_status read_instancer(reader *r, qmat_usd_prim *prim, const inherited *state) {
  qmat_usd_instancer instancer;
  if (state->instancers >= DEEPEST_INSTANCERS)
    return qmat_usd_prim_fail(prim, "instancers are nested more than %d deep", DEEPEST_INSTANCERS);
  const qmat_error before = r->context->error;
  qmat_status status = qmat_usd_instancer_read(prim, &prim->arena, &instancer);
  if (status == QMAT_ERROR_FORMAT) {
    if (r->broken.status == QMAT_OK) r->broken = r->context->error;
    return qmat_usd_warn_of_error(prim, "left out with all its instances", &before);
  }
  if (status != QMAT_OK) return status;
  r->scene->point_instances += instancer.instance_count;
  /* Prototypes do not inherit the instancer's place twice. */
  const inherited own = {.world = qmat_usd_identity(),
                         .purpose = state->purpose,
                         .instancers = state->instancers + 1,
                         .is_body = state->is_body,
                         .is_prototype = true};
  prototype p = {.r = r, .state = &own};
  for (size_t i = 0; i < instancer.prototype_count && status == QMAT_OK; i++) {
    const size_t first = r->scene->placement_count;
    bool found;
    if (instancer.ends[i] == (i > 0 ? instancer.ends[i - 1] : 0)) continue; /* it has no instance */
    status = qmat_usd_stage_visit(r->stage, instancer.prototypes[i], read_prototype, &p, &found);
    if (status == QMAT_OK && !found) status = qmat_usd_warn(prim, "a prototype is skipped: there is no such prim");
    if (status == QMAT_OK) status = place_instances(r, prim, &instancer, i, state, first);
  }
  return status;
}

static qmat_status read_prim(reader *r, qmat_usd_prim *prim, inherited state) {
  bool skipped;
  if (++r->scene->prims % 1024 == 0) {
    const qmat_status status = qmat_progress(r->context, r->scene->prims, 0, "prims");
    if (status != QMAT_OK) return status;
  }
  qmat_status status = find_skipped(r, prim, &state, &skipped);
  if (status != QMAT_OK || skipped) return status;
  state.is_prototype = false;
  state.is_body = state.is_body || qmat_usd_prim_has_schema(prim, "PhysicsRigidBodyAPI");
  const char *type = qmat_usd_text(qmat_usd_prim_field(prim, "typeName"));
  if (!type) type = "";
  if (qmat_usd_truth(qmat_usd_prim_field(prim, "instanceable"), false)) r->scene->instances++;
  status = qmat_usd_read_transform(prim, type, &state.world);
  if (status != QMAT_OK) return status;
  if (strcmp(type, "PointInstancer") == 0) return read_instancer(r, prim, &state);
  status = read_geometry(r, prim, type, &state);
  return status == QMAT_OK ? read_children(r, prim, &state) : status;
}

/* ---- the scene ---- */

/* Removes meshes that have no place: prototypes without instances. */
static void drop_unplaced(qmat_usd_scene *scene, uint32_t *numbers) {
  for (size_t i = 0; i < scene->mesh_count; i++) numbers[i] = UINT32_MAX;
  for (size_t i = 0; i < scene->placement_count; i++) numbers[scene->placements[i].mesh] = 0;
  uint32_t kept = 0;
  for (size_t i = 0; i < scene->mesh_count; i++) {
    if (numbers[i] == UINT32_MAX) continue;
    scene->meshes[kept] = scene->meshes[i];
    numbers[i] = kept++;
  }
  for (size_t i = 0; i < scene->placement_count; i++) scene->placements[i].mesh = numbers[scene->placements[i].mesh];
  scene->mesh_count = kept;
}

/* The length of a unit in meters, as the root layer states it; the default of USD where it states none that is one. */
static double find_unit(const qmat_usd_spec *root) {
  const double usual = 0.01, unit = qmat_usd_number(qmat_usd_field_value(root, "metersPerUnit"), usual);
  return unit > 0 && isfinite(unit) ? unit : usual;
}

/* Warns of a unit and of an axis that are none. */
static qmat_status check_frame(const qmat_usd_prim *root, const qmat_usd_spec *layer) {
  const qmat_usd_value *unit = qmat_usd_field_value(layer, "metersPerUnit"),
                       *up = qmat_usd_field_value(layer, "upAxis");
  const char *axis = qmat_usd_text(up);
  qmat_status status = QMAT_OK;
  if (unit && qmat_usd_number(unit, NAN) != find_unit(layer))
    status = qmat_usd_warn(root, "metersPerUnit is no length: %g is used", find_unit(layer));
  if (status == QMAT_OK && up && !(axis && (strcmp(axis, "Y") == 0 || strcmp(axis, "Z") == 0)))
    status = qmat_usd_warn(root, "upAxis is '%.40s', not Y or Z: Y is used", qmat_usd_shown(axis ? axis : "?"));
  return status;
}

static qmat_status check_any(const reader *r, const char *path) {
  const qmat_usd_scene *scene = r->scene;
  if (scene->placement_count > 0) return QMAT_OK;
  if (r->broken.status != QMAT_OK) {
    r->context->error = r->broken;
    return r->broken.status;
  }
  const char *first = json_string_value(json_array_get(qmat_usd_stage_warnings(scene->stage), 0));
  return qmat_fail_file(r->context, QMAT_ERROR_GEOMETRY, path, "the scene has no mesh that can be read%s%s",
                        first ? "; " : "", first ? first : "");
}

static qmat_status read_all(reader *r, qmat_usd_prim *root) {
  const inherited state = {.world = qmat_usd_identity(), .purpose = "default"};
  qmat_status status = qmat_key_table_init(&r->known, 0) == 0 ? read_children(r, root, &state)
                                                              : qmat_fail_memory(r->context, "a USD scene");
  qmat_key_table_uninit(&r->known);
  return status;
}

qmat_status qmat_usd_scene_open(qmat_context *context, const qmat_bytes *bytes, const char *path, size_t segments,
                                qmat_usd_scene *scene) {
  qmat_usd_prim root = {0};
  *scene = (qmat_usd_scene){0};
  qmat_status status = qmat_usd_stage_open(context, bytes, path, &scene->stage);
  if (status != QMAT_OK) return status;
  reader r = {
      .context = context, .scene = scene, .stage = scene->stage, .segments = segments > 0 ? segments : USUAL_SEGMENTS};
  r.leaves_medials = qmat_usd_original_of(qmat_usd_stage_root_layer(scene->stage)) != NULL;
  status = qmat_usd_stage_root(r.stage, &root);
  if (status == QMAT_OK) status = read_all(&r, &root);
  if (status == QMAT_OK && scene->placement_count == 0 && r.has_undefined) {
    /* The file may be meant as a layer of another one. */
    qmat_usd_stage *stage = scene->stage;
    scene->stage = NULL;
    qmat_usd_scene_close(scene);
    scene->stage = stage;
    qmat_usd_stage_forget_warnings(stage);
    r.takes_undefined = true;
    r.broken.status = QMAT_OK;
    status = read_all(&r, &root);
  }
  if (status == QMAT_OK) status = check_frame(&root, qmat_usd_stage_root_layer(scene->stage)->root);
  qmat_usd_prim_uninit(&root);
  if (status == QMAT_OK) status = check_any(&r, path);
  uint32_t *numbers = status == QMAT_OK ? qmat_alloc(scene->mesh_count, sizeof *numbers) : NULL;
  if (status == QMAT_OK && !numbers) status = qmat_fail_memory(context, "a USD scene");
  if (status == QMAT_OK) drop_unplaced(scene, numbers);
  if (status == QMAT_OK) qmat_usd_rig_finish(&scene->rig, scene->stage);
  qmat_free(numbers);
  return status;
}

void qmat_usd_scene_close(qmat_usd_scene *scene) {
  qmat_usd_stage_close(scene->stage);
  qmat_free(scene->meshes);
  qmat_free(scene->digests);
  qmat_free(scene->placements);
  qmat_usd_rig_uninit(&scene->rig);
  qmat_arena_uninit(&scene->arena);
  *scene = (qmat_usd_scene){0};
}

qmat_status qmat_usd_scene_report(qmat_context *context, const qmat_usd_scene *scene, json_t *report) {
  const qmat_usd_spec *root = qmat_usd_stage_root_layer(scene->stage)->root;
  const struct {
    const char *key;
    size_t count;
  } rows[] = {
      {"layers_read", qmat_usd_stage_layer_count(scene->stage)},
      {"prims_read", scene->prims},
      {"meshes_placed", scene->placement_count},
      {"cages", scene->cages},
      {"holes", scene->holes},
      {"instances", scene->instances},
      {"point_instances", scene->point_instances},
      {"shapes_read", scene->shapes},
      {"prims_skipped", scene->prims_skipped},
      {"shapes_skipped", scene->shapes_skipped},
  };
  for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
    if (json_object_set_new(report, rows[i].key, json_integer((json_int_t)rows[i].count)) != 0)
      return qmat_fail_memory(context, "a report");
  }
  /* The default axis is that of USD. */
  const char *up = qmat_usd_text(qmat_usd_field_value(root, "upAxis"));
  const bool is_z = up && strcmp(up, "Z") == 0;
  if (json_object_set_new(report, "meters_per_unit", json_real(find_unit(root))) != 0 ||
      json_object_set_new(report, "up_axis", json_string(is_z ? "Z" : "Y")) != 0 ||
      json_object_set(report, "warnings", qmat_usd_stage_warnings(scene->stage)) != 0) {
    return qmat_fail_memory(context, "a report");
  }
  return QMAT_OK;
}

qmat_status qmat_usd_scene_add_mesh(qmat_context *context, const qmat_usd_scene *scene, size_t mesh, qmat_soup *soup) {
  const qmat_usd_transform identity = qmat_usd_identity();
  qmat_status status = qmat_usd_mesh_add(context, &scene->meshes[mesh], &identity, soup);
  if (status == QMAT_OK) status = qmat_usd_mesh_add_skin(context, &scene->meshes[mesh], soup);
  if (scene->meshes[mesh].scheme == QMAT_SCHEME_NONE) qmat_soup_clear_cage(soup); /* no subdivision surface */
  return status;
}

qmat_status qmat_usd_scene_add_all(qmat_context *context, const qmat_usd_scene *scene, const char *path,
                                   qmat_soup *soup) {
  const size_t justified = FREE_ELEMENTS + ELEMENTS_PER_BYTE * qmat_usd_stage_bytes(scene->stage);
  size_t elements = 0;
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < scene->placement_count && status == QMAT_OK; i++) {
    const qmat_usd_placement *placement = &scene->placements[i];
    const qmat_usd_mesh *mesh = &scene->meshes[placement->mesh];
    elements += mesh->points->count + mesh->indices->count;
    if (elements > justified || mesh->points->count > UINT32_MAX - soup->vertex_count)
      return qmat_fail_file(context, QMAT_ERROR_GEOMETRY, path,
                            "%s: the copies of meshes have more vertices than the files justify",
                            qmat_usd_shown(placement->path));
    status = qmat_usd_mesh_add(context, mesh, &placement->world, soup);
  }
  if (scene->cages == 0) qmat_soup_clear_cage(soup);
  return status;
}

qmat_status qmat_usd_read(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_soup *soup,
                          json_t *report) {
  qmat_usd_scene scene;
  qmat_status status = qmat_usd_scene_open(context, bytes, path, 0, &scene);
  if (status == QMAT_OK) status = qmat_usd_scene_add_all(context, &scene, path, soup);
  if (status == QMAT_OK && report) status = qmat_usd_scene_report(context, &scene, report);
  qmat_usd_scene_close(&scene);
  return status;
}
