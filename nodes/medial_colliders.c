/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.colliders: a medial mesh as shapes for collision detection, with the mass properties of the solid. */
#include <math.h>
#include <string.h>

#include "core/json_text.h"
#include "core/node.h"
#include "nodes/colliders/cover_fit.h"
#include "nodes/colliders/hull_merge.h"
#include "nodes/colliders/hull_outside.h"
#include "nodes/colliders/inside_fit.h"
#include "nodes/colliders/joint_division.h"
#include "nodes/colliders/joint_points.h"
#include "nodes/colliders/rigid_body.h"
#include "nodes/colliders/shape_hulls.h"
#include "nodes/colliders/shape_measures.h"
#include "nodes/colliders/shape_merge.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/measure/unit_spheres.h"

typedef enum fit_side { FIT_BOTH, FIT_CONTAIN, FIT_INSIDE } fit_side;
/* The kinds are those of qmat_shape_kind, and this. */
enum { KIND_HULLS = QMAT_SHAPES_SPHERES + 1 };

typedef struct medial_colliders_params {
  int fit, kind;
  int64_t shapes, hull_points, samples;
  double least_radius, dent, hull_error, density;
} medial_colliders_params;

/* More shapes than QMAT_MOST_IN_ROWS would cost engines more than they gain: dents become deeper instead, up to this.
 * Beyond it only rows count, not all shapes: a medial mesh may have more simplices. */
static const double deepest_dent = 0.1;

typedef struct work {
  qmat_context *context;
  const medial_colliders_params *params;
  qmat_surface *surface;
  qmat_envelope *envelope;
  qmat_shape_set set;
  qmat_joint_points skin; /* none where the mesh has no skin */
  uint32_t *joints;       /* of the spheres that shapes are made of; NULL: one joint moves all, or none */
  qmat_colliders *colliders;
  double volume;          /* of the solid, in the unit frame; 0: not known */
  double dent;            /* of rows of capsules or spheres */
  double hull_protrusion; /* of hulls of the solid */
  bool proved;
  qmat_shape_measures measures;
} work;

/* The kind of the shapes that hulls are made of, too. */
static qmat_shape_kind kind_of(const medial_colliders_params *p) {
  return p->kind == KIND_HULLS ? QMAT_SHAPES_ANY : (qmat_shape_kind)p->kind;
}

/* Whether hulls are made around parts of the solid and of sheets, and joined. Thick sheets keep those of their shapes.
 */
static bool has_hulls_of_solid(const work *w) {
  const qmat_mesh *mesh = qmat_surface_mesh(w->surface);
  const bool is_thick = mesh->sheet_triangle_count > 0 && mesh->sheet_thickness > 0;
  return w->params->kind == KIND_HULLS && w->params->fit == FIT_CONTAIN && mesh->closed && mesh->oriented && !is_thick;
}

/* Fitted shapes come apart where a sphere of theirs has grown to contain another one, or has become too small: a hull
 * of three spheres can become three capsules. Those that contain the solid are joined again by shapes that contain
 * both, as capsules at most, which do not come apart. Those inside it cannot be joined: the largest stay. */
static qmat_status keep_budget(work *w, double growth) {
  const medial_colliders_params *p = w->params;
  const size_t most = (size_t)p->shapes;
  if (most == 0 || has_hulls_of_solid(w)) return QMAT_OK;
  if (p->fit == FIT_INSIDE) return qmat_shape_set_keep_largest(w->context, &w->set, most);
  return qmat_shape_set_merge(w->context, &w->set, kind_of(p) == QMAT_SHAPES_ANY ? QMAT_SHAPES_CAPSULES : kind_of(p),
                              growth, most);
}

/* Makes the spheres that shapes are made of: those of the medial mesh, divided where several joints move the surface.
 */
static qmat_status make_spheres(work *w, const qmat_mesh *mesh, const qmat_medial *medial, qmat_medial *unit) {
  qmat_context *context = w->context;
  qmat_status status = qmat_surface_new(context, mesh, &w->surface);
  *unit = *medial;
  if (status == QMAT_OK) status = qmat_unit_spheres(context, qmat_surface_frame(w->surface), medial, &unit->spheres);
  if (status == QMAT_OK) status = qmat_joint_points_take(context, w->surface, &w->skin);
  if (status != QMAT_OK || w->skin.joint_count < 2) return status;
  const qmat_medial whole = *unit;
  return qmat_joint_points_divide(context, &w->skin, &whole, unit, &w->joints);
}

/* Fits shapes that were made of those given. A joint shape may be outside of the solid where those given were not: a
 * joint that has lost all gets the largest of its shapes given that is inside. */
static qmat_status fit_inside(work *w, const qmat_shape_set *given, double least_radius) {
  qmat_context *context = w->context;
  qmat_shape_set lost = {0};
  qmat_status status = qmat_inside_fit(context, w->surface, &w->set, least_radius, &w->proved);
  if (status == QMAT_OK && given->shape_count > 0) status = qmat_shape_set_find_lost(context, given, &w->set, &lost);
  if (status != QMAT_OK || lost.shape_count == 0) return status;
  status = qmat_inside_fit(context, w->surface, &lost, least_radius, &w->proved);
  if (status == QMAT_OK) status = qmat_shape_set_keep_largest(context, &lost, 0);
  return status == QMAT_OK ? qmat_shape_set_append(context, &w->set, &lost) : status;
}

/* Joins shapes until the budget is kept. `given`: those before, with all that they had; none where nothing changes. */
static qmat_status join_shapes(work *w, double growth, qmat_shape_set *given) {
  const size_t most = (size_t)w->params->shapes;
  *given = (qmat_shape_set){0};
  if (most == 0 || w->set.shape_count <= most || has_hulls_of_solid(w)) return QMAT_OK;
  *given = w->set; /* the spheres and joints stay as they are */
  given->shapes = qmat_arena_alloc(&w->context->arena, given->shape_count, 3 * sizeof *given->shapes);
  if (!given->shapes) return qmat_fail_memory(w->context, "the colliders");
  memcpy(given->shapes, w->set.shapes, 3 * given->shape_count * sizeof *given->shapes);
  return qmat_shape_set_merge(w->context, &w->set, kind_of(w->params), growth, most);
}

static qmat_status make_shapes(work *w, const qmat_mesh *mesh, const qmat_medial *medial) {
  const medial_colliders_params *p = w->params;
  qmat_context *context = w->context;
  qmat_medial unit;
  qmat_status status = make_spheres(w, mesh, medial, &unit);
  if (status != QMAT_OK) return status;
  for (w->dent = p->dent; status == QMAT_OK; w->dent *= 1.25) {
    const bool may_deepen = kind_of(p) != QMAT_SHAPES_ANY && w->dent < deepest_dent;
    status = qmat_shape_set_make(context, &unit, w->joints, p->least_radius, kind_of(p), w->dent,
                                 may_deepen ? 4 * QMAT_MOST_IN_ROWS : SIZE_MAX, &w->set);
    if (w->set.shape_count <= (may_deepen ? QMAT_MOST_IN_ROWS : SIZE_MAX - 1)) break;
  }
  static const double growth[] = {[FIT_BOTH] = 0.5, [FIT_CONTAIN] = 1, [FIT_INSIDE] = 0};
  qmat_shape_set given;
  if (status == QMAT_OK) status = join_shapes(w, growth[p->fit], &given);
  /* The surface itself is known to the deviation. */
  const double deviation = mesh->deviation / qmat_surface_frame(w->surface)->diagonal;
  if (status == QMAT_OK && p->fit == FIT_CONTAIN) {
    status = qmat_cover_fit(context, w->surface, &w->skin, &w->set, p->least_radius, &w->proved);
    for (size_t i = 0; i < w->set.sphere_count; i++) w->set.spheres[4 * i + 3] += deviation;
  }
  if (status == QMAT_OK && p->fit == FIT_INSIDE) {
    status = fit_inside(w, &given, p->least_radius + deviation);
    for (size_t i = 0; i < w->set.sphere_count; i++) w->set.spheres[4 * i + 3] -= deviation;
  }
  if (status == QMAT_OK) status = keep_budget(w, growth[p->fit]);
  if (status != QMAT_OK || w->set.shape_count > 0) return status;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "no shape is left");
  qmat_fail_field(context, "medial");
  return qmat_fail_hint(context,
                        "the solid is thinner than least_radius, or open; fit=both takes the spheres as they are");
}

/* Makes each shape one of three spheres, which is written as a hull: the last one is repeated as further spheres. */
static void widen_shapes(qmat_colliders *c) {
  for (size_t i = 0; i < c->shape_count; i++) {
    uint32_t *ids = &c->shapes[3 * i];
    const int width = qmat_shape_width(ids);
    for (int k = width; k < 3; k++) {
      memcpy(&c->spheres[4 * c->sphere_count], &c->spheres[4 * (size_t)ids[width - 1]], 4 * sizeof *c->spheres);
      ids[k] = (uint32_t)c->sphere_count++;
    }
  }
}

static qmat_status fill_colliders(work *w) {
  qmat_colliders *c = w->colliders;
  c->spheres = qmat_alloc(w->set.sphere_count + 2 * w->set.shape_count, 4 * sizeof *c->spheres);
  c->shapes = qmat_alloc(w->set.shape_count, 3 * sizeof *c->shapes);
  c->body = qmat_alloc(10, sizeof *c->body);
  if (!c->spheres || !c->shapes || !c->body) return qmat_fail_memory(w->context, "the colliders");
  c->sphere_count = w->set.sphere_count;
  c->shape_count = w->set.shape_count;
  qmat_frame_spheres_to_model(qmat_surface_frame(w->surface), w->set.spheres, c->sphere_count, c->spheres);
  memcpy(c->shapes, w->set.shapes, 3 * c->shape_count * sizeof *c->shapes);
  if (w->skin.joint_count > 0) {
    c->joints = qmat_alloc(c->shape_count, sizeof *c->joints);
    if (!c->joints) return qmat_fail_memory(w->context, "the colliders");
    c->joint_count = c->shape_count;
    for (size_t i = 0; i < c->shape_count; i++)
      c->joints[i] = w->set.joints ? w->set.joints[w->set.shapes[3 * i]] : w->skin.first_joint;
  }
  c->body_count = qmat_rigid_body_of_surface(w->surface, w->params->density, c->body, &w->volume);
  const qmat_hull_side side = w->params->fit == FIT_CONTAIN ? QMAT_HULL_OUTSIDE : QMAT_HULL_INSIDE;
  const double error = w->params->hull_error * qmat_surface_frame(w->surface)->diagonal;
  const qmat_status status = qmat_shape_hulls(w->context, c, (size_t)w->params->hull_points, error, side);
  if (status == QMAT_OK && w->params->kind == KIND_HULLS) widen_shapes(c);
  return status;
}

/* Replaces the hulls of the shapes by those of the solid's parts. */
static qmat_status make_hulls_of_solid(work *w) {
  qmat_solid_part *parts = NULL;
  qmat_status status = qmat_solid_parts_find(w->context, w->surface, &w->set, w->params->least_radius, &parts);
  if (status == QMAT_OK && w->set.joints) status = qmat_solid_parts_add_joints(w->context, &w->set, &w->skin, parts);
  if (status == QMAT_OK)
    status = qmat_hulls_merge(w->context, w->surface, parts, (size_t)w->params->shapes, (size_t)w->params->hull_points,
                              w->params->hull_error * qmat_surface_frame(w->surface)->diagonal, w->colliders);
  qmat_solid_parts_free(parts, w->set.shape_count);
  if (status == QMAT_OK) status = qmat_hulls_protrusion(w->context, w->surface, w->colliders, &w->hull_protrusion);
  return status;
}

static const char *const fits[] = {"both", "contain", "inside", NULL};
static const char *const kinds[] = {"any", "capsules", "spheres", "hulls", NULL};

/* The lowest joint of a shape that is not below `least`; UINT32_MAX: there is none. */
static uint32_t lowest_joint(const qmat_colliders *c, uint32_t least) {
  uint32_t lowest = UINT32_MAX;
  for (size_t i = 0; i < c->joint_count; i++)
    if (c->joints[i] >= least && c->joints[i] < lowest) lowest = c->joints[i];
  return lowest;
}

/* The number of shapes of each joint that has some: {"joint": 3, "shapes": 2}. NULL: no memory. */
static json_t *count_by_joint(const qmat_colliders *c) {
  json_t *list = json_array();
  for (uint32_t joint = lowest_joint(c, 0); list && joint != UINT32_MAX; joint = lowest_joint(c, joint + 1)) {
    json_int_t count = 0;
    for (size_t i = 0; i < c->joint_count; i++) count += c->joints[i] == joint;
    if (json_array_append_new(list, json_pack("{s:I, s:I}", "joint", (json_int_t)joint, "shapes", count)) == 0)
      continue;
    json_decref(list);
    return NULL;
  }
  return list;
}

static qmat_status make_report(const work *w, qmat_report *report) {
  const qmat_shape_measures *m = &w->measures;
  const struct {
    const char *key;
    double value;
  } numbers[] = {
      {"diagonal", qmat_surface_frame(w->surface)->diagonal},
      {"coverage", m->coverage},
      {"protrusion", m->protrusion},
      {"protrusion_mean", m->protrusion_mean},
      {"protrusion_p95", m->protrusion_p95},
      {"gap_mean", m->gap_mean},
      {"gap_p95", m->gap_p95},
      {"max_uncovered_gap", m->max_uncovered_gap},
      {"volume_ratio", m->volume_ratio},
      {"iou", m->iou},
      {"dent", w->dent},
  };
  size_t widths[4] = {0};
  for (size_t i = 0; i < w->set.shape_count; i++) widths[qmat_shape_width(&w->set.shapes[3 * i])]++;
  const qmat_json_count counts[] = {{"shapes", w->colliders->shape_count},
                                    {"single_spheres", widths[1]},
                                    {"capsules", widths[2]},
                                    {"hulls_of_three", widths[3]},
                                    {"spheres", w->set.sphere_count},
                                    {"hull_points", w->colliders->point_count}};
  int bad = json_object_set_new(report->root, "fit", json_string(fits[w->params->fit]));
  bad |= json_object_set_new(report->root, "proved", json_boolean(w->proved));
  bad |= qmat_json_set_counts(report->root, counts, sizeof counts / sizeof *counts);
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
    bad |= json_object_set_new(report->root, numbers[i].key, json_real(numbers[i].value));
  if (has_hulls_of_solid(w)) bad |= json_object_set_new(report->root, "hull_protrusion", json_real(w->hull_protrusion));
  if (w->colliders->joint_count > 0) {
    bad |= json_object_set_new(report->root, "pose", json_string("bind"));
    bad |= json_object_set_new(report->root, "joints", count_by_joint(w->colliders));
  }
  if (w->colliders->body_count > 0) {
    const double *b = w->colliders->body;
    bad |= json_object_set_new(report->root, "mass", json_real(b[0]));
    bad |= json_object_set_new(report->root, "centre_of_mass", json_pack("[f, f, f]", b[1], b[2], b[3]));
    bad |= json_object_set_new(report->root, "inertia",
                               json_pack("[f, f, f, f, f, f]", b[4], b[5], b[6], b[7], b[8], b[9]));
  }
  return bad ? qmat_fail_memory(w->context, "the report") : QMAT_OK;
}

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  work w = {.context = context, .params = data, .colliders = qmat_colliders_new()};
  const qmat_medial *medial = (const qmat_medial *)inputs[1];
  qmat_report *report = qmat_report_new();
  qmat_status status = w.colliders && report ? QMAT_OK : qmat_fail_memory(context, "the colliders");
  if (status == QMAT_OK) status = make_shapes(&w, (const qmat_mesh *)inputs[0], medial);
  if (status == QMAT_OK) status = fill_colliders(&w);
  if (status == QMAT_OK) status = qmat_shape_set_envelope(context, &w.set, &w.envelope);
  if (status == QMAT_OK)
    status = qmat_shape_measures_take(context, w.surface, &w.set, w.envelope, w.colliders, w.volume,
                                      (size_t)w.params->samples, &w.measures);
  if (status == QMAT_OK && has_hulls_of_solid(&w)) status = make_hulls_of_solid(&w);
  if (status == QMAT_OK) status = make_report(&w, report);
  qmat_envelope_free(w.envelope);
  qmat_surface_free(w.surface);
  return qmat_hand_over(context, status,
                        (qmat_value *const[]){w.colliders ? &w.colliders->base : NULL, report ? &report->base : NULL},
                        2, outputs);
}

static const qmat_param params[] = {
    QMAT_ENUM(medial_colliders_params, fit, fits, FIT_BOTH,
              "both: the spheres as they are; contain: nothing of the solid is outside of the shapes; inside: nothing "
              "of a shape is outside of the solid"),
    QMAT_INT(medial_colliders_params, shapes, "shapes", 0, 0, 1e6,
             "The largest number of shapes, but one for each joint of a skin; pairs become one until it is reached; 0: "
             "any number"),
    QMAT_ENUM(
        medial_colliders_params, kind, kinds, QMAT_SHAPES_ANY,
        "any: spheres, tapered capsules and hulls of three spheres; capsules: no hulls; spheres: spheres only; hulls: "
        "hulls of all of these, with contain around the parts of the solid, joined where that is convex"),
    QMAT_LENGTH(
        medial_colliders_params, dent, 0.01, 1e-4, 1,
        "How deep the dents between the capsules or spheres may be that replace a cone or slab; deeper where that "
        "takes more than 256 shapes"),
    QMAT_LENGTH(medial_colliders_params, least_radius, 0.0005, 1e-6, 1,
                "The smallest radius; engines refuse 0, which sharp features have"),
    QMAT_INT(medial_colliders_params, hull_points, "points", 128, QMAT_LEAST_HULL_POINTS, 1024,
             "The largest number of vertices of a hull: PhysX takes 255 (64 on graphics cards), Jolt 256"),
    QMAT_LENGTH(medial_colliders_params, hull_error, 0.003, 1e-6, 1,
                "How far a hull may be from its shape where hull_points allows"),
    QMAT_FLOAT(medial_colliders_params, density, "kg/m^3", 1000, 1e-12, 1e12,
               "The density of the solid, which its mass and inertia follow from; a model without a unit is in metres"),
    QMAT_INT(medial_colliders_params, samples, "points", 20000, 1, 1e8,
             "Points of the surface and of the shapes, and a tenth of those of the volume, for the measures"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The surface of the solid"},
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The medial mesh that describes it"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "colliders", .type = QMAT_COLLIDERS, .doc = "Shapes, their hulls, and the mass properties of the solid"},
    {.name = "report", .type = QMAT_REPORT, .doc = "How well the shapes describe the solid"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_cgal, &qmat_library_embree, NULL};

const qmat_node qmat_node_medial_colliders = {
    .name = "medial.colliders",
    .version = 24,
    .summary = "Makes colliders of a medial mesh: spheres, tapered capsules and hulls of three spheres",
    .doc =
        "A shape is a sphere, a cone (a tapered capsule) or a slab (the convex hull of three spheres) of the medial "
        "mesh that is no side of another one. Each also has a hull, a convex polyhedron for engines without such "
        "shapes.\n\n"
        "fit=contain: spheres move and grow so that their union has little volume beyond the solid's. Branch and "
        "bound then proves that no point of the solid is outside, and spheres grow where one is. Hulls contain their "
        "shapes.\n\n"
        "fit=inside: radii change, and the proof is the opposite one: no point of a shape is outside of the solid. "
        "Where that leaves more than `shapes`, the largest stay, one of each joint at least. Hulls are inside their "
        "shapes, as with fit=both. proved is false for open surfaces.\n\n"
        "kind=hulls (with contain): the solid is divided among the shapes, and each hull contains only its part. Hulls "
        "are joined where the facets between both leave the solid by at most hull_error, or until `shapes` are left. "
        "Then one is divided by a plane and two others are joined, as long as the union's volume falls and the facets "
        "between these leave the solid by at most twice hull_error. The hull of a part that is not convex leaves the "
        "solid, too: hull_protrusion in the report bounds by how much, to 1e-4 diagonals. Sheets are divided and "
        "joined likewise; their hulls reach beyond them by least_radius. Open surfaces, and sheets with a thickness, "
        "keep the hulls of the shapes.\n\n"
        "A skinned mesh gets shapes for each joint: cones and slabs are divided where another joint moves the surface "
        "around them, and only shapes of one joint are joined. With fit=contain a vertex is inside of a shape of the "
        "joint with its largest weight (the lowest of equal ones). It also is in one of each joint with at least a "
        "quarter of that weight, so that shapes overlap at joints. A joint without a vertex of its own has no shape. "
        "That nothing of the solid is outside, and all measures, hold for the bind pose. The report counts the shapes "
        "of each joint.\n\n"
        "Mass, centre and inertia are exact integrals over the solid; open surfaces have none. Mass is in kg, inertia "
        "in kg times the square of a model unit.\n\n"
        "The measures in the report are those of cuRobo, in diagonals, and sampled. coverage: the share of the solid's "
        "volume in the shapes. protrusion: how far the shapes' boundary is outside. gap: how far the surface is from "
        "the shapes. iou: intersection over union. Thick sheets are parts of the solid, without mass. All measures but "
        "hull_protrusion are those of the shapes, not of hulls.",
    .citation = "",
    .params_size = sizeof(medial_colliders_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .effort = 40,
    .run = run,
};
