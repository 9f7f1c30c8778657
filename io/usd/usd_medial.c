/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_medial.h"

#include <string.h>

#include "core/geometry/medial_build.h"
#include "io/usd/usd_stage.h"

typedef struct reader {
  qmat_context *context;
  qmat_usd_stage *stage;
  json_t *facts;
  const char *name;    /* of the prim to read, or NULL */
  bool lists;          /* only lists the names */
  json_t *names;       /* of prims with a medial mesh, as keys: prims of one name have the same one */
  json_t *found;       /* the names in their order */
  qmat_medial *medial; /* NULL until it is found */
} reader;

/* Composes the child of this name, if the prim has one. */
static qmat_status find_child(reader *r, qmat_usd_prim *prim, const char *name, qmat_usd_prim *child, bool *found) {
  const char *const *names;
  size_t count;
  *found = false;
  qmat_status status = qmat_usd_prim_children(prim, &names, &count);
  for (size_t i = 0; i < count && status == QMAT_OK && !*found; i++) {
    if (strcmp(names[i], name) != 0) continue;
    *found = true;
    status = qmat_usd_prim_child(r->stage, prim, names[i], child);
  }
  return status;
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

static qmat_status read_facts(reader *r, const qmat_usd_value *data) {
  for (size_t i = 0; i < data->count && r->facts; i++) {
    const qmat_usd_value *value = data->entries[i].value;
    const char *text = qmat_usd_text(value);
    const bool is_single = !value->is_array && value->components == 1;
    if (!qmat_is_utf8(data->entries[i].name)) continue;
    json_t *json = text && qmat_is_utf8(text)                      ? json_string(text)
                   : value->type == QMAT_USD_BOOL && is_single     ? json_boolean(value->integers[0] != 0)
                   : qmat_usd_is_integer(value->type) && is_single ? json_integer(value->integers[0])
                   : qmat_usd_is_number(value->type) && is_single  ? json_real(value->numbers[0])
                                                                   : NULL;
    if (json && json_object_set_new(r->facts, data->entries[i].name, json) != 0)
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
  return status == QMAT_OK ? read_facts(r, data) : status;
}

static qmat_status search(reader *r, qmat_usd_prim *prim) {
  if (prim->parent && qmat_usd_prim_is_medial(prim)) {
    const char *own = qmat_usd_shown(prim->name);
    if (!json_object_get(r->names, own) && (json_object_set_new(r->names, own, json_true()) != 0 ||
                                            json_array_append_new(r->found, json_string(own)) != 0))
      return qmat_fail_memory(r->context, "a medial mesh");
    if (r->lists || r->medial || (r->name && strcmp(r->name, prim->name) != 0)) return QMAT_OK;
    return read_carrier(r, prim, qmat_usd_prim_field(prim, "customData"));
  }
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

/* Searches all prims. The caller releases r->found. */
static qmat_status search_all(reader *r, const qmat_bytes *bytes, const char *path) {
  qmat_usd_prim root = {0};
  r->names = json_object();
  r->found = json_array();
  qmat_status status = r->names && r->found ? qmat_usd_stage_open(r->context, bytes, path, &r->stage)
                                            : qmat_fail_memory(r->context, "a medial mesh");
  if (status == QMAT_OK) status = qmat_usd_stage_root(r->stage, &root);
  if (status == QMAT_OK) status = search(r, &root);
  qmat_usd_prim_uninit(&root);
  qmat_usd_stage_close(r->stage);
  json_decref(r->names);
  return status;
}

qmat_status qmat_usd_list_medials(qmat_context *context, const qmat_bytes *bytes, const char *path, json_t **names) {
  reader r = {.context = context, .lists = true};
  const qmat_status status = search_all(&r, bytes, path);
  if (status != QMAT_OK) json_decref(r.found);
  *names = status == QMAT_OK ? r.found : NULL;
  return status;
}

qmat_status qmat_usd_read_medial(qmat_context *context, const qmat_bytes *bytes, const char *path, const char *name,
                                 qmat_medial **medial, json_t *facts) {
  reader r = {.context = context, .facts = facts, .name = name};
  *medial = NULL;
  qmat_status status = search_all(&r, bytes, path);
  const size_t carriers = json_array_size(r.found);
  json_decref(r.found);
  if (status == QMAT_OK && !r.medial) {
    qmat_fail(context, status = QMAT_ERROR_GEOMETRY,
              carriers > 0 ? "no prim of this name has a medial mesh" : "no prim has a medial mesh");
  } else if (status == QMAT_OK && !name && carriers > 1) {
    qmat_fail(context, status = QMAT_ERROR_USAGE, "%zu prims have a medial mesh: name one of them", carriers);
  }
  if (status == QMAT_OK) {
    *medial = r.medial;
    return QMAT_OK;
  }
  if (r.medial) qmat_value_release(&r.medial->base);
  return qmat_fail_at(context, context->error.file[0] ? context->error.file : path, context->error.line,
                      context->error.column);
}
