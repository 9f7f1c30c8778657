/* SPDX-License-Identifier: GPL-3.0-or-later */
/* mesh.sdf: the thickness of a solid at each facet, as its shape diameter function (section 3.2). */
#include <math.h>
#include <string.h>

#include "core/geometry/sheets.h"
#include "core/geometry/surface.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vertex_facets.h"
#include "core/node.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/initial/sample_thinning.h"

#define MOST_RAYS 1024
/* Hits closer than this (unit frame) are on the facet itself, by rounding. */
#define RAY_START 1e-9
/* A hit is ignored if the cosine of its normal with the facet's is above this. Slightly above 0, so that walls at a
 * right angle do not depend on rounding. */
#define SAME_SIDE 1e-6
/* The most facets considered around a vertex, so that a fan of thousands does not cost quadratic time. */
#define MOST_NEIGHBOURS 256
/* A facet may take the value of another within this share of that value. */
#define SAME_VALUE 0.1
/* The largest distance of such facets from each other's planes, as a share of the spacing. */
#define SAME_PLANE 0.25

typedef struct mesh_sdf_params {
  double cone_angle;
  int64_t rays;
  double spacing;
} mesh_sdf_params;

typedef enum facet_state { MEASURED, NO_VALID_RAY, DEGENERATE } facet_state;

/* A ray in a facet's frame (first edge, its perpendicular, inward normal), and its weight. */
typedef struct cone_ray {
  double direction[3];
  double weight;
} cone_ray;

/* Spreads rays evenly over the cone's solid angle, with the golden angle between successive rays (Vogel 1979). The
 * weight is the inverse of the angle to the axis (Shapira et al. 2008, section 3.1). */
static void make_cone(double full_angle, size_t count, cone_ray *rays) {
  if (count == 1) {
    rays[0] = (cone_ray){{0, 0, 1}, 1};
    return;
  }
  const double cap = 1 - cos(0.5 * full_angle * QMAT_PI / 180);
  for (size_t i = 0; i < count; i++) {
    const double height = 1 - cap * ((double)i + 0.5) / (double)count, turn = QMAT_GOLDEN_ANGLE * (double)i;
    const double reach = sqrt(1 - height * height);
    rays[i] = (cone_ray){{reach * cos(turn), reach * sin(turn), height}, 1 / acos(height)};
  }
}

/* Shell sort: in place, and fast for the few dozen rays of a facet (gaps of Ciura 2001). */
static void sort_numbers(double *numbers, size_t count) {
  static const size_t gaps[] = {701, 301, 132, 57, 23, 10, 4, 1};
  for (size_t g = 0; g < sizeof gaps / sizeof gaps[0]; g++) {
    for (size_t i = gaps[g]; i < count; i++) {
      const double moved = numbers[i];
      size_t j = i;
      for (; j >= gaps[g] && numbers[j - gaps[g]] > moved; j -= gaps[g]) numbers[j] = numbers[j - gaps[g]];
      numbers[j] = moved;
    }
  }
}

/* Sorts the numbers. The mean of the middle two if their count is even. */
static double median_of(double *numbers, size_t count) {
  sort_numbers(numbers, count);
  return count % 2 == 1 ? numbers[count / 2] : 0.5 * (numbers[count / 2 - 1] + numbers[count / 2]);
}

/* The weighted mean of the lengths within 1.5 median absolute deviations of their median. */
static double robust_mean(const double *lengths, const double *weights, size_t count) {
  double scratch[MOST_RAYS];
  memcpy(scratch, lengths, count * sizeof *scratch);
  const double median = median_of(scratch, count);
  for (size_t i = 0; i < count; i++) scratch[i] = fabs(lengths[i] - median);
  /* The second term tolerates rounding if all lengths are equal. */
  const double reach = 1.5 * median_of(scratch, count) + 1e-9 * median;
  double sum = 0, total = 0;
  for (size_t i = 0; i < count; i++) {
    if (fabs(lengths[i] - median) > reach) continue;
    sum += weights[i] * lengths[i];
    total += weights[i];
  }
  return sum / total; /* half of the lengths are within one deviation, so total > 0 */
}

static facet_state measure_facet(const qmat_surface *surface, const cone_ray *rays, size_t ray_count, uint32_t facet,
                                 double *thickness) {
  const uint32_t *ids = qmat_surface_mesh(surface)->triangles + 3 * (size_t)facet;
  const double *positions = qmat_surface_positions(surface);
  const double *a = positions + 3 * (size_t)ids[0], *b = positions + 3 * (size_t)ids[1],
               *c = positions + 3 * (size_t)ids[2];
  double normal[3], first[3], second[3], centroid[3];
  if (!(qmat_triangle_area(a, b, c, normal) > 0)) return DEGENERATE;
  for (int k = 0; k < 3; k++) centroid[k] = (a[k] + b[k] + c[k]) / 3;
  qmat_subtract(b, a, first);
  qmat_normalize(first);
  qmat_cross(normal, first, second);

  double lengths[MOST_RAYS], weights[MOST_RAYS];
  size_t count = 0;
  for (size_t i = 0; i < ray_count; i++) {
    const double *local = rays[i].direction;
    double direction[3], hit_normal[3], distance;
    for (int k = 0; k < 3; k++) direction[k] = local[0] * first[k] + local[1] * second[k] - local[2] * normal[k];
    if (!qmat_surface_cast(surface, centroid, direction, RAY_START, INFINITY, &distance, NULL, hit_normal)) continue;
    /* A surface that faces the same way is hit from outside (Shapira et al. 2008, section 3.1). */
    if (qmat_dot(hit_normal, normal) > SAME_SIDE) continue;
    lengths[count] = distance;
    weights[count++] = rays[i].weight;
  }
  if (count == 0) return NO_VALID_RAY;
  *thickness = robust_mean(lengths, weights, count);
  return MEASURED;
}

static double squared_centroid_distance(const qmat_surface *surface, uint32_t left, uint32_t right) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  const double *positions = qmat_surface_positions(surface);
  double square = 0;
  for (size_t k = 0; k < 3; k++) {
    double offset = 0;
    for (size_t corner = 0; corner < 3; corner++) {
      offset += positions[3 * (size_t)mesh->triangles[3 * (size_t)left + corner] + k];
      offset -= positions[3 * (size_t)mesh->triangles[3 * (size_t)right + corner] + k];
    }
    square += offset * offset;
  }
  return square;
}

/* A value for a facet without one, from the known facets at its corners: that of the nearest, or the median of all;
 * `otherwise` if no facet there is known. */
static double borrow_value(const qmat_surface *surface, const qmat_vertex_facets *around, const double *values,
                           const uint8_t *known, uint32_t facet, bool nearest, double otherwise) {
  const uint32_t *ids = qmat_surface_mesh(surface)->triangles + 3 * (size_t)facet;
  double found[3 * MOST_NEIGHBOURS], best = INFINITY;
  uint32_t best_facet = UINT32_MAX;
  size_t count = 0;
  for (int corner = 0; corner < 3; corner++) {
    const size_t begin = around->offsets[ids[corner]], end = around->offsets[ids[corner] + 1];
    for (size_t i = begin; i < end && i < begin + MOST_NEIGHBOURS; i++) {
      const uint32_t other = around->facets[i];
      const uint32_t *theirs = qmat_surface_mesh(surface)->triangles + 3 * (size_t)other;
      bool seen = !known[other];
      for (int earlier = 0; earlier < corner; earlier++) {
        for (int k = 0; k < 3; k++) seen |= theirs[k] == ids[earlier];
      }
      if (seen) continue;
      const double distance = nearest ? squared_centroid_distance(surface, facet, other) : 0;
      if (distance < best || (distance == best && other < best_facet)) {
        best = distance;
        best_facet = other;
      }
      found[count++] = values[other];
    }
  }
  if (count == 0) return otherwise;
  return nearest ? values[best_facet] : median_of(found, count);
}

/* Facets without a valid ray take the median of their neighbours; degenerate facets take the nearest neighbour's. */
static qmat_status fill_gaps(qmat_context *context, const qmat_surface *surface, const uint8_t *states,
                             double *values) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  const size_t count = mesh->triangle_count;
  size_t measured = 0;
  double sum = 0;
  for (size_t i = 0; i < count; i++) {
    if (states[i] != MEASURED) continue;
    measured++;
    sum += values[i];
  }
  if (measured == count) return QMAT_OK;
  if (measured == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "no ray hits an opposite side: the surface encloses no solid");
    qmat_fail_field(context, "mesh");
    return qmat_fail_hint(context,
                          "check that the surface is closed and its normals point outwards; qmat mat: --set "
                          "solid.solid=auto makes solids "
                          "and sheets of any surface");
  }
  const double mean = sum / (double)measured;
  qmat_vertex_facets around;
  uint8_t *known = qmat_arena_alloc(&context->arena, count, sizeof *known);
  if (!known) return qmat_fail_memory(context, "the facets' states");
  qmat_status status = qmat_vertex_facets_find(context, mesh, &around);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < count; i++) known[i] = states[i] == MEASURED;
  for (size_t i = 0; i < count; i++) {
    if (states[i] == NO_VALID_RAY) values[i] = borrow_value(surface, &around, values, known, (uint32_t)i, false, mean);
  }
  for (size_t i = 0; i < count; i++) known[i] = states[i] != DEGENERATE;
  for (size_t i = 0; i < count; i++) {
    if (states[i] == DEGENERATE) values[i] = borrow_value(surface, &around, values, known, (uint32_t)i, true, mean);
  }
  return QMAT_OK;
}

/* Sets the facet that is measured in place of each facet, possibly itself. */
static qmat_status find_representatives(qmat_context *context, const qmat_surface *surface, double spacing,
                                        uint32_t *representatives) {
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  const double *positions = qmat_surface_positions(surface);
  const size_t count = mesh->triangle_count;
  for (size_t i = 0; i < count; i++) representatives[i] = (uint32_t)i;
  if (spacing == 0) return QMAT_OK;
  double *centroids = qmat_arena_alloc(&context->arena, count, 3 * sizeof *centroids);
  double *normals = qmat_arena_alloc(&context->arena, count, 3 * sizeof *normals);
  double *radii = qmat_arena_alloc(&context->arena, count, sizeof *radii);
  if (!centroids || !normals || !radii) return qmat_fail_memory(context, "the facets");
  for (size_t i = 0; i < count; i++) {
    const uint32_t *ids = mesh->triangles + 3 * i;
    const double *a = positions + 3 * (size_t)ids[0], *b = positions + 3 * (size_t)ids[1],
                 *c = positions + 3 * (size_t)ids[2];
    for (int k = 0; k < 3; k++) centroids[3 * i + (size_t)k] = (a[k] + b[k] + c[k]) / 3;
    (void)qmat_triangle_area(a, b, c, normals + 3 * i);
    radii[i] = spacing;
  }
  return qmat_samples_thin(context, centroids, normals, radii, count, spacing, SAME_PLANE * spacing, representatives);
}

typedef struct measuring {
  const qmat_surface *surface;
  const cone_ray *rays;
  size_t ray_count;
  const uint32_t *representatives;
  uint8_t *states;
  double *values;
} measuring;

static bool takes_value(const measuring *m, uint32_t facet) {
  const uint32_t measured = m->representatives[facet];
  if (m->states[measured] != MEASURED) return false;
  const double reach =
      3 * SAME_VALUE * m->values[measured]; /* squared_centroid_distance compares sums of three corners */
  return squared_centroid_distance(m->surface, facet, measured) <= reach * reach;
}

/* Measures the facets that represent themselves, or the others. */
static qmat_status measure_facets(qmat_context *context, const measuring *m, bool representatives) {
  const size_t count = qmat_surface_mesh(m->surface)->triangle_count;
  /* About a tenth of a second of rays between two progress reports. */
  const size_t slice = 100000 / m->ray_count + 1;
  const int threads = qmat_threads(context);
  for (size_t begin = 0; begin < count; begin += slice) {
    const size_t end = count - begin < slice ? count : begin + slice;
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
    for (size_t i = begin; i < end; i++) {
      if ((m->representatives[i] == i) != representatives) continue;
      if (!representatives && takes_value(m, (uint32_t)i)) {
        m->values[i] = m->values[m->representatives[i]];
        m->states[i] = MEASURED;
      } else {
        m->states[i] = (uint8_t)measure_facet(m->surface, m->rays, m->ray_count, (uint32_t)i, m->values + i);
      }
    }
    const qmat_status status = qmat_progress(context, end, count, "facets");
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

/* Fills the values of the facets of solids, in model units. */
static qmat_status measure_solids(qmat_context *context, const mesh_sdf_params *params, const qmat_mesh *mesh,
                                  double *values) {
  const size_t count = qmat_solid_triangle_count(mesh), ray_count = (size_t)params->rays;
  qmat_surface *surface;
  qmat_status status = qmat_surface_new_of_solids(context, mesh, &surface);
  if (status != QMAT_OK) return qmat_fail_field(context, "mesh");
  cone_ray *rays = qmat_arena_alloc(&context->arena, ray_count, sizeof *rays);
  uint8_t *states = qmat_arena_alloc(&context->arena, count, sizeof *states);
  uint32_t *representatives = qmat_arena_alloc(&context->arena, count, sizeof *representatives);
  if (rays && states && representatives) {
    make_cone(params->cone_angle, ray_count, rays);
    const measuring m = {surface, rays, ray_count, representatives, states, values};
    status = find_representatives(context, surface, params->spacing, representatives);
    if (status == QMAT_OK) status = measure_facets(context, &m, true);
    if (status == QMAT_OK && params->spacing > 0) status = measure_facets(context, &m, false);
    if (status == QMAT_OK) status = fill_gaps(context, surface, states, values);
    for (size_t i = 0; i < count && status == QMAT_OK; i++) values[i] *= qmat_surface_frame(surface)->diagonal;
  } else {
    status = qmat_fail_memory(context, "the thickness");
  }
  qmat_surface_free(surface);
  return status;
}

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  qmat_status status = QMAT_OK;
  qmat_field *field = qmat_field_new();
  if (field) {
    field->values = qmat_alloc(mesh->triangle_count, sizeof *field->values);
    field->unit = qmat_strdup("model unit");
  }
  if (field && field->values && field->unit) {
    field->count = mesh->triangle_count;
    field->domain = QMAT_PER_FACET;
    if (qmat_has_solids(mesh)) status = measure_solids(context, params, mesh, field->values);
    for (size_t i = qmat_solid_triangle_count(mesh); i < field->count && status == QMAT_OK; i++)
      field->values[i] = mesh->sheet_thickness;
  } else {
    status = qmat_fail_memory(context, "the thickness");
  }
  return qmat_hand_over(context, status, (qmat_value *const[]){field ? &field->base : NULL}, 1, outputs);
}

static const qmat_param params[] = {
    QMAT_FLOAT(mesh_sdf_params, cone_angle, "degrees", 120, 10, 170,
               "Full angle of the cone of rays around the inward normal"),
    QMAT_INT(mesh_sdf_params, rays, "rays", 30, 1, MOST_RAYS, "Rays per facet; a single one follows the inward normal"),
    QMAT_LENGTH(mesh_sdf_params, spacing, 0.002, 0, 0.1,
                "Coplanar facets with centroids nearer than this share one value if the solid is at least ten times as "
                "thick as their distance; 0: every facet is measured"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The surface of a solid, with outward normals"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "thickness", .type = QMAT_FIELD, .doc = "The shape diameter of each facet, in model units"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_embree, NULL};

const qmat_node qmat_node_mesh_sdf = {
    .name = "mesh.sdf",
    .version = 3,
    .summary = "Measures how thick a solid is at each facet",
    .doc =
        "Each facet casts a fixed pattern of rays from its centroid into the solid, within a cone around the inward "
        "normal. Hits on surfaces that face the same way as the facet are ignored. The thickness is a weighted mean of "
        "the ray lengths within 1.5 median absolute deviations of their median; the weight is the inverse of the angle "
        "to the normal. It is neither smoothed nor normalised.\n\n"
        "Facets without a valid ray take the median of the facets at their corners, or the mean of all. Degenerate "
        "facets take the value of the nearest facet at their corners. Sheets have their own thickness. On meshes much "
        "finer than the spacing only some "
        "facets are measured, and their neighbours take their values.",
    .citation =
        "Section 3.2; Shapira et al. 2008, Consistent mesh partitioning and skeletonisation using the shape diameter "
        "function",
    .params_size = sizeof(mesh_sdf_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .effort = 8,
    .run = run,
};
