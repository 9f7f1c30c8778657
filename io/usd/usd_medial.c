/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_medial.h"

#include <stdio.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "core/json_text.h"
#include "io/usd/usd_stage.h"

/* A medial mesh of the scene. Prims of one name that state the same are one. */
typedef struct found_medial {
  const char *label;  /* the prim's name, or its path where another one has that name */
  const char *path;   /* of the first such prim */
  const char *parent; /* of the first one that is below a prim, or the first whose path was asked for; NULL: none is */
  bool is_near;       /* a prim's path ends in what was asked for */
} found_medial;

typedef struct reader {
  qmat_context *context;
  qmat_usd_stage *stage;
  const char *name; /* of the prim to read, or NULL */
  json_t *numbers;  /* per label, and per name with what the prims state: the number in `found` */
  size_t count, capacity;
  found_medial *found; /* in the order of the scene */
  qmat_arena arena;    /* of paths */
  json_t *facts;
  qmat_medial *medial; /* NULL until it is read */
} reader;

/* Composes the child of this name, if the prim has one. */
static qmat_status find_child(reader *r, qmat_usd_prim *prim, const char *name, qmat_usd_prim *child, bool *found) {
  const char *own;
  const qmat_status status = qmat_usd_prim_find_child(prim, name, strlen(name), &own);
  *found = own != NULL;
  return status == QMAT_OK && own ? qmat_usd_prim_child(r->stage, prim, own, child) : status;
}

/* `data` are the carrier's customData, which say where its space begins in the space of the model. */
static qmat_status read_spheres(reader *r, const qmat_usd_prim *prim, const qmat_usd_value *data) {
  static const char *const axes[] = {"qmat_origin_x", "qmat_origin_y", "qmat_origin_z"};
  const qmat_usd_value *points, *radii;
  qmat_status status = qmat_usd_prim_attribute(prim, "points", &points);
  if (status == QMAT_OK) status = qmat_usd_prim_attribute(prim, "primvars:radius", &radii);
  if (status != QMAT_OK) return status;
  const bool good = points && radii && points->is_array && radii->is_array && qmat_usd_is_number(points->type) &&
                    qmat_usd_is_number(radii->type) && points->components == 3 && radii->components == 1 &&
                    points->count == radii->count && points->count <= UINT32_MAX;
  if (!good) return qmat_usd_prim_fail(prim, "points and primvars:radius do not match");
  r->medial->spheres = qmat_alloc(points->count, 4 * sizeof *r->medial->spheres);
  if (!r->medial->spheres) return qmat_fail_memory(r->context, "a medial mesh");
  r->medial->sphere_count = points->count;
  for (size_t i = 0; i < points->count; i++) {
    for (size_t k = 0; k < 3; k++)
      r->medial->spheres[4 * i + k] = points->numbers[3 * i + k] + qmat_usd_number(qmat_usd_entry(data, axes[k]), 0);
    r->medial->spheres[4 * i + 3] = radii->numbers[i];
  }
  return QMAT_OK;
}

/* The sphere indices in an attribute of the child `name`, `corners` for each simplex; none without that child. The
 * caller frees them. */
static qmat_status read_ids(reader *r, qmat_usd_prim *prim, const char *name, const char *attribute, size_t corners,
                            uint32_t **ids, size_t *count) {
  qmat_usd_prim child = {0};
  const qmat_usd_value *value;
  bool found;
  *ids = NULL;
  *count = 0;
  qmat_status status = find_child(r, prim, name, &child, &found);
  if (status == QMAT_OK && found) {
    status = qmat_usd_prim_attribute(&child, attribute, &value);
    if (status == QMAT_OK && (!value || !value->is_array || !qmat_usd_is_integer(value->type) ||
                              value->components != 1 || value->count % corners != 0)) {
      status = qmat_usd_prim_fail(&child, "%s must be an array of integers, %zu for each simplex", attribute, corners);
    }
    if (status == QMAT_OK) {
      *ids = qmat_alloc(value->count, sizeof **ids);
      if (!*ids) status = qmat_fail_memory(r->context, "a medial mesh");
    }
    for (size_t i = 0; status == QMAT_OK && i < value->count; i++) {
      const int64_t id = value->integers[i];
      if (id < 0 || (uint64_t)id >= r->medial->sphere_count) {
        status = qmat_usd_prim_fail(&child, "%s refers to sphere %lld, but there are %zu", attribute, (long long)id,
                                    r->medial->sphere_count);
        break;
      }
      (*ids)[i] = (uint32_t)id;
    }
    if (status == QMAT_OK) *count = value->count / corners;
  }
  qmat_usd_prim_uninit(&child);
  return status;
}

static qmat_status read_simplices(reader *r, qmat_usd_prim *prim) {
  uint32_t *edges = NULL, *triangles = NULL;
  size_t edge_count = 0, triangle_count = 0;
  qmat_status status = read_ids(r, prim, "cones", "primvars:qmat:sphere", 2, &edges, &edge_count);
  if (status == QMAT_OK) status = read_ids(r, prim, "slabs", "faceVertexIndices", 3, &triangles, &triangle_count);
  if (status == QMAT_OK)
    status = qmat_medial_set_simplices(r->context, r->medial, edges, edge_count, triangles, triangle_count);
  qmat_free(edges);
  qmat_free(triangles);
  return status;
}

/* Adds the entries of customData to an object. */
static qmat_status read_facts(const reader *r, const qmat_usd_value *data, json_t *facts) {
  for (size_t i = 0; i < data->count && facts; i++) {
    const qmat_usd_value *value = data->entries[i].value;
    const char *text = qmat_usd_text(value);
    const bool is_single = !value->is_array && value->components == 1;
    if (!qmat_is_utf8(data->entries[i].name)) continue;
    json_t *json = text && qmat_is_utf8(text)                      ? json_string(text)
                   : value->type == QMAT_USD_BOOL && is_single     ? json_boolean(value->integers[0] != 0)
                   : qmat_usd_is_integer(value->type) && is_single ? json_integer(value->integers[0])
                   : qmat_usd_is_number(value->type) && is_single  ? json_real(value->numbers[0])
                                                                   : NULL;
    if (json && json_object_set_new(facts, data->entries[i].name, json) != 0)
      return qmat_fail_memory(r->context, "the facts about a medial mesh");
  }
  return QMAT_OK;
}

static qmat_status read_carrier(reader *r, qmat_usd_prim *prim, const qmat_usd_value *data) {
  qmat_usd_prim spheres = {0};
  bool found;
  qmat_status status = find_child(r, prim, "spheres", &spheres, &found);
  if (status == QMAT_OK && !found)
    status = qmat_usd_prim_fail(prim, "the prim has qmat_version in its customData, but no child 'spheres'");
  if (status == QMAT_OK) {
    r->medial = qmat_medial_new();
    status = r->medial ? read_spheres(r, &spheres, data) : qmat_fail_memory(r->context, "a medial mesh");
  }
  qmat_usd_prim_uninit(&spheres);
  if (status == QMAT_OK) status = read_simplices(r, prim);
  if (status == QMAT_OK) status = qmat_value_seal(r->context, &r->medial->base);
  return status == QMAT_OK ? read_facts(r, data, r->facts) : status;
}

/* ---- the medial meshes of a scene ---- */

static qmat_status fail_shortage(const reader *r) {
  return qmat_fail_memory(r->context, "a medial mesh");
}

/* The number of the medial mesh that a prim has, which is added if it is new. */
static qmat_status number_medial(reader *r, const qmat_usd_prim *prim, const char *path, size_t *number) {
  const char *own = qmat_usd_shown(prim->name);
  json_t *stated = json_object();
  qmat_status status = stated ? read_facts(r, qmat_usd_prim_field(prim, "customData"), stated) : fail_shortage(r);
  char *text = status == QMAT_OK ? qmat_json_text(stated, JSON_COMPACT | JSON_SORT_KEYS, NULL) : NULL;
  json_t *key = text ? json_sprintf("%s\n%s", own, text) : NULL; /* no label has a line break */
  qmat_free(text);
  json_decref(stated);
  const json_t *known = key ? json_object_get(r->numbers, json_string_value(key)) : NULL;
  *number = known ? (size_t)json_integer_value(known) : r->count;
  if (status == QMAT_OK && !key) status = fail_shortage(r);
  if (status == QMAT_OK && !known) {
    const char *label = json_object_get(r->numbers, own) ? qmat_usd_shown(path) : own;
    if (qmat_grow((void **)&r->found, &r->capacity, r->count + 1, sizeof *r->found) != 0 ||
        json_object_set_new(r->numbers, label, json_integer((json_int_t)r->count)) != 0 ||
        json_object_set_new(r->numbers, json_string_value(key), json_integer((json_int_t)r->count)) != 0)
      status = fail_shortage(r);
    else
      r->found[r->count++] = (found_medial){.label = label, .path = path};
  }
  json_decref(key);
  return status;
}

/* Adds a prim with a medial mesh. Its parent is the prim that the medial mesh stands for. */
static qmat_status add_prim(reader *r, const qmat_usd_prim *prim) {
  const char *path = qmat_usd_prim_path(prim, &r->arena), *parent = qmat_usd_prim_path(prim->parent, &r->arena);
  size_t number;
  if (!path || !parent) return fail_shortage(r);
  const qmat_status status = number_medial(r, prim, path, &number);
  if (status != QMAT_OK) return status;
  found_medial *found = &r->found[number];
  const bool is_below = prim->parent->parent != NULL;
  const bool is_near = r->name && (qmat_usd_path_ends_in(parent, r->name) ||
                                   (strchr(r->name, '/') && qmat_usd_path_ends_in(path, r->name)));
  if (is_below && (!found->parent || (is_near && !found->is_near))) found->parent = parent;
  found->is_near = found->is_near || is_near;
  return QMAT_OK;
}

static qmat_status search(reader *r, qmat_usd_prim *prim) {
  if (prim->parent && qmat_usd_prim_is_medial(prim)) return add_prim(r, prim);
  const char *const *names;
  size_t count;
  qmat_status status = qmat_usd_prim_children(prim, &names, &count);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    qmat_usd_prim child;
    status = qmat_usd_prim_child(r->stage, prim, names[i], &child);
    const bool is_active = status == QMAT_OK && qmat_usd_truth(qmat_usd_prim_field(&child, "active"), true);
    if (is_active) status = search(r, &child);
    qmat_usd_prim_uninit(&child);
  }
  return status;
}

/* Opens the scene and finds its medial meshes. Close the reader also after a failure. */
static qmat_status search_all(reader *r, const qmat_bytes *bytes, const char *path) {
  qmat_usd_prim root = {0};
  r->numbers = json_object();
  qmat_status status = r->numbers ? qmat_usd_stage_open(r->context, bytes, path, &r->stage) : fail_shortage(r);
  if (status == QMAT_OK) status = qmat_usd_stage_root(r->stage, &root);
  if (status == QMAT_OK) status = search(r, &root);
  qmat_usd_prim_uninit(&root);
  return status;
}

static void reader_close(reader *r) {
  qmat_usd_stage_close(r->stage);
  json_decref(r->numbers);
  qmat_free(r->found);
  qmat_arena_uninit(&r->arena);
}

qmat_status qmat_usd_list_medials(qmat_context *context, const qmat_bytes *bytes, const char *path, json_t **names) {
  reader r = {.context = context};
  qmat_status status = search_all(&r, bytes, path);
  *names = status == QMAT_OK ? json_array() : NULL;
  if (status == QMAT_OK && !*names) status = fail_shortage(&r);
  for (size_t i = 0; i < r.count && status == QMAT_OK; i++)
    if (json_array_append_new(*names, json_string(r.found[i].label)) != 0) status = fail_shortage(&r);
  if (status != QMAT_OK) {
    json_decref(*names);
    *names = NULL;
  }
  reader_close(&r);
  return status;
}

/* ---- the choice ---- */

/* A hint with the first medial meshes to choose from. */
static void hint_choices(const reader *r) {
  enum { MOST_SHOWN = 3 };
  char text[200] = "";
  size_t used = 0, shown = 0;
  for (size_t i = 0; i < r->count && shown < MOST_SHOWN; i++) {
    const found_medial *found = &r->found[i];
    const char *parent = found->parent ? qmat_usd_shown(found->parent) : NULL;
    char one[sizeof text];
    const int length = snprintf(one, sizeof one, "%s%s%s%s", shown > 0 ? ", " : "", found->label, parent ? " of " : "",
                                parent ? parent : "");
    if (length < 0 || (size_t)length >= sizeof text - used) break;
    memcpy(text + used, one, (size_t)length + 1);
    used += (size_t)length;
    shown++;
  }
  qmat_fail_hint(r->context, "--node with a name or the path of a prim: %s%s", text,
                 shown < r->count ? ", ...; qmat info lists all" : "");
}

/* The number of the medial mesh to read: the one with this label, or with a prim whose path ends so. */
static qmat_status choose(const reader *r, size_t *choice) {
  size_t near = 0;
  *choice = 0;
  if (r->count == 0) return qmat_fail(r->context, QMAT_ERROR_GEOMETRY, "no prim has a medial mesh");
  if (!r->name && r->count == 1) return QMAT_OK;
  for (size_t i = 0; i < r->count && r->name; i++) {
    if (strcmp(r->found[i].label, r->name) == 0) {
      *choice = i;
      return QMAT_OK;
    }
    if (r->found[i].is_near && near++ == 0) *choice = i;
  }
  if (near == 1) return QMAT_OK;
  if (r->name && near == 0)
    qmat_fail(r->context, QMAT_ERROR_GEOMETRY, "no prim of this name has a medial mesh");
  else
    qmat_fail(r->context, QMAT_ERROR_USAGE, "%zu prims have a medial mesh: name one of them",
              r->name ? near : r->count);
  hint_choices(r);
  return r->context->error.status;
}

static qmat_status read_visited(void *user, qmat_usd_prim *prim) {
  return read_carrier(user, prim, qmat_usd_prim_field(prim, "customData"));
}

static qmat_status visit_nothing(void *user, qmat_usd_prim *prim) {
  (void)user, (void)prim;
  return QMAT_OK;
}

/* States the prim that the medial mesh stands for, where the stage does not have the path that the file states: that is
 * one of another stage, which this one refers to. */
static qmat_status state_parent(reader *r, const char *parent) {
  const char *stated = json_string_value(json_object_get(r->facts, "qmat_prim"));
  bool found;
  if (!stated || !parent || !qmat_is_utf8(parent)) return QMAT_OK;
  const qmat_status status = qmat_usd_stage_visit(r->stage, stated, visit_nothing, NULL, &found);
  if (status != QMAT_OK || found) return status;
  return json_object_set_new(r->facts, "composed_prim", json_string(parent)) == 0 ? QMAT_OK : fail_shortage(r);
}

qmat_status qmat_usd_read_medial(qmat_context *context, const qmat_bytes *bytes, const char *path, const char *name,
                                 qmat_medial **medial, json_t *facts) {
  reader r = {.context = context, .facts = facts, .name = name};
  size_t choice;
  bool found;
  *medial = NULL;
  qmat_status status = search_all(&r, bytes, path);
  if (status == QMAT_OK) status = choose(&r, &choice);
  if (status == QMAT_OK) status = qmat_usd_stage_visit(r.stage, r.found[choice].path, read_visited, &r, &found);
  if (status == QMAT_OK && facts) status = state_parent(&r, r.found[choice].parent);
  reader_close(&r);
  if (status == QMAT_OK) {
    *medial = r.medial;
    return QMAT_OK;
  }
  if (r.medial) qmat_value_release(&r.medial->base);
  return qmat_fail_at(context, context->error.file[0] ? context->error.file : path, context->error.line,
                      context->error.column);
}
