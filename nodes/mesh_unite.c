/* SPDX-License-Identifier: GPL-3.0-or-later */
/* mesh.unite: closed components that intersect are replaced by the boundary of their union. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/frame.h"
#include "core/json_text.h"
#include "core/node.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/mesh/union_cgal.h"

typedef enum parts_choice { PARTS_UNION, PARTS_KEEP } parts_choice;

typedef struct mesh_unite_params {
  int parts;
} mesh_unite_params;

typedef struct box {
  double low[3], high[3];
} box;

/* A sheet: its bounding box, and the box of the intersections with other sheets' boxes. */
typedef struct sheet {
  uint32_t leader; /* triangle */
  box bounds, reach;
} sheet;

typedef struct unison {
  qmat_context *context;
  const qmat_mesh *mesh;
  size_t solid_count;        /* triangles that bound solids, the first ones */
  uint32_t *shells, *sheets; /* disjoint sets of triangles */
  uint8_t *is_open;          /* per shell, by its leader */
  size_t shell_count, open_count;
} unison;

static qmat_status fail_shortage(qmat_context *context) {
  return qmat_fail_memory(context, "the parts of the mesh");
}

/* ---- shells and sheets ---- */

static int compare_keys(const void *left, const void *right) {
  const uint64_t a = *(const uint64_t *)left, b = *(const uint64_t *)right;
  return (a > b) - (a < b);
}

/* Joins triangles at their edges. A shell is open if some of its edges runs one way more often than the other. */
static qmat_status find_shells(unison *u) {
  const qmat_mesh *mesh = u->mesh;
  qmat_arena *arena = &u->context->arena;
  const size_t corners = 3 * u->solid_count;
  u->shells = qmat_sets_new(u->context, mesh->triangle_count);
  u->sheets = qmat_sets_new(u->context, mesh->triangle_count);
  u->is_open = qmat_arena_calloc(arena, mesh->triangle_count, 1);
  size_t *ends = qmat_arena_calloc(arena, mesh->vertex_count + 1, sizeof *ends);
  uint64_t *keys = qmat_arena_alloc(arena, corners, sizeof *keys); /* the higher end of an edge, and its corner */
  uint8_t *is_uneven = qmat_arena_calloc(arena, mesh->triangle_count, 1);
  if (!u->shells || !u->sheets || !u->is_open || !ends || !keys || !is_uneven) return fail_shortage(u->context);
  for (int pass = 0; pass < 2; pass++) {
    for (size_t c = 0; c < corners; c++) {
      const uint32_t a = mesh->triangles[c], b = mesh->triangles[c % 3 == 2 ? c - 2 : c + 1], low = a < b ? a : b;
      if (pass == 0)
        ends[low + 1]++;
      else
        keys[ends[low]++] = (uint64_t)(a < b ? b : a) << 32 | c;
    }
    if (pass == 0)
      for (size_t v = 0; v < mesh->vertex_count; v++) ends[v + 1] += ends[v];
  }
  for (size_t v = 0, first = 0; v < mesh->vertex_count; first = ends[v++]) {
    qsort(keys + first, ends[v] - first, sizeof *keys, compare_keys);
    for (size_t i = first, last; i < ends[v]; i = last) {
      const uint32_t triangle = (uint32_t)keys[i] / 3;
      int64_t balance = 0;
      for (last = i; last < ends[v] && keys[last] >> 32 == keys[i] >> 32; last++) {
        qmat_sets_join(u->shells, triangle, (uint32_t)keys[last] / 3);
        balance += mesh->triangles[(uint32_t)keys[last]] == v ? 1 : -1;
      }
      if (last - i == 2) qmat_sets_join(u->sheets, triangle, (uint32_t)keys[i + 1] / 3);
      if (balance != 0) is_uneven[triangle] = 1;
    }
  }
  for (uint32_t t = 0; t < u->solid_count; t++) {
    const uint32_t shell = qmat_set_leader(u->shells, t);
    if (is_uneven[t]) u->is_open[shell] = 1;
    u->shell_count += shell == t;
  }
  for (size_t t = 0; t < u->solid_count; t++) u->open_count += u->is_open[t];
  memset(u->is_open + u->solid_count, 1, mesh->sheet_triangle_count);
  return QMAT_OK;
}

/* ---- boxes ---- */

static const box no_box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void grow_box(box *b, const double *point) {
  for (int k = 0; k < 3; k++) {
    b->low[k] = fmin(b->low[k], point[k]);
    b->high[k] = fmax(b->high[k], point[k]);
  }
}

static box triangle_box(const qmat_mesh *mesh, size_t triangle) {
  box b = no_box;
  for (size_t k = 0; k < 3; k++) grow_box(&b, mesh->positions + 3 * (size_t)mesh->triangles[3 * triangle + k]);
  return b;
}

/* False if the boxes are disjoint. */
static bool intersect_boxes(const box *a, const box *b, box *common) {
  bool meet = true;
  for (int k = 0; k < 3; k++) {
    common->low[k] = fmax(a->low[k], b->low[k]);
    common->high[k] = fmin(a->high[k], b->high[k]);
    meet = meet && common->low[k] <= common->high[k];
  }
  return meet;
}

static int compare_sheets(const void *left, const void *right) {
  const sheet *a = left, *b = right;
  const int order = (a->bounds.low[0] > b->bounds.low[0]) - (a->bounds.low[0] < b->bounds.low[0]);
  return order != 0 ? order : (a->leader > b->leader) - (a->leader < b->leader);
}

/* Finds the sheets of closed shells whose boxes intersect. `reaches` (per triangle) becomes 1 if the triangle's box
 * meets such an intersection, and `is_near` (zeroed, per shell by its leader) becomes 1 for their shells. */
static qmat_status find_near(unison *u, uint8_t *reaches, uint8_t *is_near) {
  const qmat_mesh *mesh = u->mesh;
  qmat_arena *arena = &u->context->arena;
  uint32_t *numbers = qmat_arena_alloc(arena, mesh->triangle_count, sizeof *numbers);
  size_t count = 0;
  for (uint32_t t = 0; numbers && t < mesh->triangle_count; t++)
    if (qmat_set_leader(u->sheets, t) == t && !u->is_open[qmat_set_leader(u->shells, t)])
      numbers[t] = (uint32_t)count++;
  sheet *sheets = qmat_arena_alloc(arena, count, sizeof *sheets);
  if (!numbers || !sheets) return fail_shortage(u->context);
  for (uint32_t t = 0; t < mesh->triangle_count; t++) {
    if (u->is_open[qmat_set_leader(u->shells, t)]) continue;
    const uint32_t leader = qmat_set_leader(u->sheets, t);
    sheet *s = &sheets[numbers[leader]];
    if (leader == t) *s = (sheet){t, no_box, no_box};
    for (size_t k = 0; k < 3; k++)
      grow_box(&s->bounds, mesh->positions + 3 * (size_t)mesh->triangles[3 * (size_t)t + k]);
  }
  qsort(sheets, count, sizeof *sheets, compare_sheets);
  for (size_t i = 0; i < count; i++) {
    const qmat_status status = qmat_progress(u->context, i, count, "parts");
    if (status != QMAT_OK) return status;
    numbers[sheets[i].leader] = (uint32_t)i;
    for (size_t j = i + 1; j < count && sheets[j].bounds.low[0] <= sheets[i].bounds.high[0]; j++) {
      box common;
      if (!intersect_boxes(&sheets[i].bounds, &sheets[j].bounds, &common)) continue;
      grow_box(&sheets[i].reach, common.low);
      grow_box(&sheets[i].reach, common.high);
      grow_box(&sheets[j].reach, common.low);
      grow_box(&sheets[j].reach, common.high);
      is_near[qmat_set_leader(u->shells, sheets[i].leader)] = is_near[qmat_set_leader(u->shells, sheets[j].leader)] = 1;
    }
  }
  for (uint32_t t = 0; t < mesh->triangle_count; t++) {
    reaches[t] = 0;
    if (u->is_open[qmat_set_leader(u->shells, t)]) continue;
    const box bounds = triangle_box(mesh, t);
    box common;
    reaches[t] = intersect_boxes(&bounds, &sheets[numbers[qmat_set_leader(u->sheets, t)]].reach, &common);
  }
  return QMAT_OK;
}

/* ---- the node ---- */

static qmat_status find_union(unison *u, qmat_united *united) {
  const qmat_mesh *mesh = u->mesh;
  qmat_arena *arena = &u->context->arena;
  uint8_t *reaches = qmat_arena_alloc(arena, mesh->triangle_count, 1);
  uint8_t *is_near = qmat_arena_calloc(arena, mesh->triangle_count, 1);
  if (!reaches || !is_near) return fail_shortage(u->context);
  const qmat_status status = find_near(u, reaches, is_near);
  if (status != QMAT_OK) return status;
  bool any = false;
  uint32_t *shells = qmat_arena_alloc(arena, mesh->triangle_count, sizeof *shells);
  if (!shells) return fail_shortage(u->context);
  for (uint32_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t shell = qmat_set_leader(u->shells, t);
    shells[t] = is_near[shell] ? shell : QMAT_NO_SHELL;
    any = any || is_near[shell];
    u->sheets[t] = qmat_set_leader(u->sheets, t);
  }
  if (!any) return QMAT_OK;
  const qmat_shells input = {.vertex_count = mesh->vertex_count,
                             .triangle_count = mesh->triangle_count,
                             .positions = mesh->positions,
                             .triangles = mesh->triangles,
                             .shells = shells,
                             .sheets = u->sheets,
                             .reaches = reaches};
  return qmat_unite_shells(u->context, &input, united);
}

static qmat_status make_mesh(qmat_context *context, const qmat_mesh *from, qmat_united *united, qmat_mesh **made) {
  qmat_mesh *mesh = qmat_mesh_new();
  if (!mesh) return qmat_fail_memory(context, "the united mesh");
  mesh->vertex_count = united->vertex_count;
  mesh->triangle_count = united->triangle_count;
  mesh->positions = united->positions;
  mesh->triangles = united->triangles;
  united->positions = NULL;
  united->triangles = NULL;
  mesh->sheet_triangle_count = from->sheet_triangle_count;
  mesh->sheet_thickness = from->sheet_thickness;
  mesh->closed = from->closed;
  mesh->oriented = from->oriented;
  mesh->deviation = from->deviation;
  mesh->meters_per_unit = from->meters_per_unit;
  const qmat_status status = qmat_value_seal(context, &mesh->base);
  if (status != QMAT_OK)
    qmat_value_release(&mesh->base);
  else
    *made = mesh;
  return status;
}

static qmat_status fill_report(const unison *u, const qmat_united *united, bool keep, qmat_report *report) {
  json_t *root = report->root;
  int bad = 0;
  if (!keep) {
    bad |= qmat_json_set_count(root, "parts", u->shell_count);
    bad |= qmat_json_set_count(root, "parts_open", u->open_count);
    bad |= qmat_json_set_count(root, "parts_united", united->shells_united);
    bad |= qmat_json_set_count(root, "triangles_cut", united->cut_triangles);
  }
  if (united->changed) {
    bad |= qmat_json_set_count(root, "vertices", united->vertex_count);
    bad |= qmat_json_set_count(root, "triangles", united->triangle_count);
  }
  if (united->why_not) {
    char text[160];
    snprintf(text, sizeof text, "intersecting parts are not united: %s", united->why_not);
    bad |= json_object_set_new(root, "warnings", json_pack("[s]", text));
  }
  return bad ? qmat_fail_memory(u->context, "the report") : qmat_value_seal(u->context, &report->base);
}

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const mesh_unite_params *params = data;
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  unison u = {.context = context, .mesh = mesh, .solid_count = mesh->triangle_count - mesh->sheet_triangle_count};
  qmat_united united = {.changed = false};
  qmat_mesh *made = NULL;
  const bool keep = params->parts == PARTS_KEEP;
  qmat_report *report = qmat_report_new();
  qmat_status status = report ? QMAT_OK : qmat_fail_memory(context, "the report");
  qmat_frame frame;
  if (status == QMAT_OK) status = qmat_frame_of_mesh(context, u.mesh, &frame);
  if (status == QMAT_OK && !keep) {
    if (u.mesh->triangle_count >= UINT32_MAX / 3)
      united.why_not = "the mesh has too many triangles";
    else
      status = find_shells(&u);
    if (status == QMAT_OK && u.shell_count > u.open_count) status = find_union(&u, &united);
  }
  if (status == QMAT_OK) status = fill_report(&u, &united, keep, report);
  if (status == QMAT_OK && united.changed) status = make_mesh(context, u.mesh, &united, &made);
  qmat_free(united.positions);
  qmat_free(united.triangles);
  if (status == QMAT_OK) {
    outputs[0] = made ? &made->base : qmat_value_retain(&u.mesh->base);
    outputs[1] = &report->base;
    return QMAT_OK;
  }
  qmat_value_release(report ? &report->base : NULL);
  return status;
}

static const char *const choices[] = {[PARTS_UNION] = "union", [PARTS_KEEP] = "keep", NULL};

static const qmat_param params[] = {
    QMAT_ENUM(mesh_unite_params, parts, choices, PARTS_UNION,
              "Closed parts that intersect are replaced by their union, or kept as they are"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "A surface of one or more parts"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The boundary of the union; the input if no part loses anything"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Counts of parts, of open parts, and of united parts"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_cgal, NULL};

const qmat_node qmat_node_mesh_unite = {
    .name = "mesh.unite",
    .version = 2,
    .summary = "Replaces parts that intersect by the boundary of their union",
    .doc =
        "A surface inside another part is not a boundary of the solid, but it would limit the medial spheres. This "
        "node cuts the triangles of closed parts where they intersect, in exact arithmetic, and keeps the pieces with "
        "the inside (a winding number above 0) on one side only.\n\n"
        "A part inside another vanishes, parts that share a face become one, cavities stay, and of equal parts one is "
        "kept. Intersecting parts also lose their self-intersections. Open parts stay as they are, and so do parts "
        "that lose no surface: disjoint ones, and those that touch in points and lines only.\n\n"
        "New vertices are rounded to doubles. The result is closed if the input is. If the parts cannot be united, the "
        "mesh passes through and the report has a warning.",
    .citation = "Zhou et al. 2016, Mesh arrangements for solid geometry",
    .params_size = sizeof(mesh_unite_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
