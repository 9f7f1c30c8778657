/* SPDX-License-Identifier: GPL-3.0-or-later */
/* medial.voxel_cores: the medial axis of a voxel shape, the interior Voronoi diagram of its boundary vertices. */
#include <math.h>

#include "core/disjoint_sets.h"
#include "core/geometry/medial_build.h"
#include "core/geometry/sheets.h"
#include "core/geometry/vector.h"
#include "core/json_text.h"
#include "core/value_check.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/initial/dual_complex.h"
#include "nodes/initial/free_pairs.h"
#include "nodes/initial/medial_vertices.h"
#include "nodes/initial/voxel_shape.h"

typedef struct medial_voxel_cores_params {
  int64_t depth;
  double lambda;
} medial_voxel_cores_params;

/* A voxel core while it is made. Lengths are in voxels until the spheres are in the medial mesh. */
typedef struct voxel_core {
  qmat_context *context;
  const medial_voxel_cores_params *params;
  const qmat_surface *surface;
  qmat_voxel_shape shape;
  int32_t *points; /* 3 per boundary vertex */
  size_t point_count;
  qmat_dual_complex dual;
  size_t core_spheres, core_edges, core_triangles; /* before pruning */
} voxel_core;

static const size_t items_per_report = 65536;

/* --- the core ---------------------------------------------------------------------------------------------------- */

/* The circumsphere of a tetrahedron of lattice points. Numerators and the denominator of the centre are integers below
 * 2^53, so that equal centres are equal doubles. */
static void circumsphere(const int32_t *const p[4], double *sphere) {
  int64_t e[3][3], square[3], normal[3][3];
  for (int k = 0; k < 3; k++) {
    for (int i = 0; i < 3; i++) e[k][i] = p[k + 1][i] - p[0][i];
    square[k] = e[k][0] * e[k][0] + e[k][1] * e[k][1] + e[k][2] * e[k][2];
  }
  for (int k = 0; k < 3; k++) {
    const int64_t *a = e[(k + 1) % 3], *b = e[(k + 2) % 3];
    for (int i = 0; i < 3; i++) normal[k][i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
  }
  const int64_t twice = 2 * (e[0][0] * normal[0][0] + e[0][1] * normal[0][1] + e[0][2] * normal[0][2]);
  double offset[3];
  for (int i = 0; i < 3; i++) {
    const int64_t n = square[0] * normal[0][i] + square[1] * normal[1][i] + square[2] * normal[2][i];
    offset[i] = (double)n / (double)twice;
    sphere[i] = (double)(p[0][i] * twice + n) / (double)twice;
  }
  sphere[3] = sqrt(qmat_dot(offset, offset));
}

/* Keeps the tetrahedra inside the shape. Its boundary squares are made of Delaunay facets, so that no tetrahedron is on
 * both sides, and the centroid decides. */
static qmat_status select_inner(voxel_core *v) {
  qmat_dual_complex *d = &v->dual;
  d->kinds = qmat_arena_alloc(&v->context->arena, d->cells.count, sizeof *d->kinds);
  d->spheres = qmat_arena_alloc(&v->context->arena, d->cells.count, 4 * sizeof *d->spheres);
  if (!d->kinds || !d->spheres) return qmat_fail_memory(v->context, "medial vertices");
  for (size_t i = 0; i < d->cells.count; i++) {
    if (i % items_per_report == 0) {
      const qmat_status status = qmat_progress(v->context, i, d->cells.count, "tetrahedra");
      if (status != QMAT_OK) return status;
    }
    const int32_t *p[4];
    int32_t at[3] = {0, 0, 0};
    for (size_t k = 0; k < 4; k++) {
      p[k] = &v->points[3 * (size_t)d->cells.corners[4 * i + k]];
      for (int j = 0; j < 3; j++) at[j] += p[k][j];
    }
    const bool inside = qmat_voxel_inside(&v->shape, at[0] / 4, at[1] / 4, at[2] / 4);
    d->kinds[i] = inside ? QMAT_CELL_CIRCUMCENTRE : QMAT_CELL_DROPPED;
    if (inside) circumsphere(p, &d->spheres[4 * i]);
  }
  return QMAT_OK;
}

static qmat_status find_core(voxel_core *v) {
  qmat_context *context = v->context;
  qmat_status status = qmat_voxel_shape_make(context, v->surface, (int)v->params->depth, &v->shape);
  if (status == QMAT_OK && v->shape.count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "no voxel has its centre inside the surface");
    qmat_fail_field(context, v->params->depth < 9 ? "depth" : "mesh");
    return qmat_fail_hint(context, v->params->depth < 9 ? "depth=9 makes the smallest voxels"
                                                        : "check that the surface is closed and faces outwards");
  }
  if (status == QMAT_OK) status = qmat_voxel_boundary(context, &v->shape, &v->points, &v->point_count);
  v->dual = (qmat_dual_complex){.context = context, .keep_duals = true};
  if (status == QMAT_OK) status = qmat_delaunay_lattice(context, v->points, v->point_count, &v->dual.cells);
  if (status == QMAT_OK) status = select_inner(v);
  if (status == QMAT_OK) status = qmat_medial_vertices_number(&v->dual);
  return status == QMAT_OK ? qmat_dual_connect(&v->dual) : status;
}

/* --- lambda ------------------------------------------------------------------------------------------------------ */

static double squared_distance(const int32_t *a, const int32_t *b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return x * x + y * y + z * z;
}

/* The radius of the smallest ball that contains two or three boundary vertices. */
static double enclosing_radius(const voxel_core *v, const uint32_t *ids, size_t count) {
  const int32_t *p[3];
  for (size_t k = 0; k < count; k++) p[k] = &v->points[3 * (size_t)ids[k]];
  const double a = squared_distance(p[0], p[1]);
  if (count == 2) return 0.5 * sqrt(a);
  const double b = squared_distance(p[1], p[2]), c = squared_distance(p[2], p[0]), longest = fmax(a, fmax(b, c));
  if (2 * longest >= a + b + c) return 0.5 * sqrt(longest);
  const double sixteen_areas = 2 * (a * b + b * c + c * a) - (a * a + b * b + c * c); /* 16 times the squared area */
  return sqrt(a * b * c / sixteen_areas);
}

/* Prunes what is close to the boundary: lambda of an element is the radius of the smallest ball around its closest
 * boundary vertices. A diagonal of a Voronoi face has the face's. */
static qmat_status prune(voxel_core *v, qmat_medial *medial) {
  const qmat_dual_complex *d = &v->dual;
  qmat_arena *arena = &v->context->arena;
  double *edges = qmat_arena_calloc(arena, medial->edge_count, sizeof *edges);
  double *triangles = qmat_arena_calloc(arena, medial->triangle_count, sizeof *triangles);
  if (!edges || !triangles) return qmat_fail_memory(v->context, "the pruning measure");
  for (size_t i = 0; i < d->edge_count + d->triangle_count; i++) {
    if (i % items_per_report == 0) {
      const qmat_status status = qmat_progress(v->context, i, d->edge_count + d->triangle_count, "Voronoi elements");
      if (status != QMAT_OK) return status;
    }
    const bool is_edge = i < d->edge_count;
    const size_t width = is_edge ? 2 : 3, at = is_edge ? i : i - d->edge_count;
    uint32_t row[3] = {0, 0, 0};
    for (size_t k = 0; k < width; k++) row[k] = is_edge ? d->edges[2 * at + k] : d->triangles[3 * at + k];
    for (size_t k = 1; k < width; k++)
      for (size_t j = k; j > 0 && row[j] < row[j - 1]; j--) {
        const uint32_t swap = row[j];
        row[j] = row[j - 1];
        row[j - 1] = swap;
      }
    const double lambda =
        is_edge ? enclosing_radius(v, &d->edge_duals[3 * at], 3) : enclosing_radius(v, &d->triangle_duals[2 * at], 2);
    if (is_edge) {
      double *known = &edges[qmat_simplex_find(medial->edges, medial->edge_count, 2, row)];
      *known = fmax(*known, lambda);
      continue;
    }
    triangles[qmat_simplex_find(medial->triangles, medial->triangle_count, 3, row)] = lambda;
    const uint32_t sides[3][2] = {{row[0], row[1]}, {row[0], row[2]}, {row[1], row[2]}};
    for (size_t k = 0; k < 3; k++) {
      double *known = &edges[qmat_simplex_find(medial->edges, medial->edge_count, 2, sides[k])];
      *known = fmax(*known, lambda); /* that of a Voronoi edge is no smaller */
    }
  }
  return qmat_free_pairs_remove(v->context, medial, edges, triangles, v->params->lambda / v->shape.voxel);
}

/* --- the node ---------------------------------------------------------------------------------------------------- */

static qmat_status make_medial(voxel_core *v, qmat_medial *medial) {
  const qmat_dual_complex *d = &v->dual;
  medial->sphere_count = d->sphere_count;
  medial->spheres = qmat_alloc(d->sphere_count, 4 * sizeof *medial->spheres);
  if (!medial->spheres) return qmat_fail_memory(v->context, "medial spheres");
  for (size_t i = 0, next = 0; i < d->cells.count; i++) {
    if (!d->kinds[i] || d->sphere_of[i] != next) continue;
    double *sphere = &medial->spheres[4 * next++];
    for (size_t k = 0; k < 3; k++) sphere[k] = v->shape.origin[k] + v->shape.voxel * d->spheres[4 * i + k];
    sphere[3] = v->shape.voxel * d->spheres[4 * i + 3];
  }
  const qmat_frame *frame = qmat_surface_frame(v->surface);
  qmat_frame_spheres_to_model(frame, medial->spheres, medial->sphere_count, medial->spheres);
  qmat_status status =
      qmat_medial_set_simplices(v->context, medial, d->edges, d->edge_count, d->triangles, d->triangle_count);
  v->core_spheres = medial->sphere_count;
  v->core_edges = medial->edge_count;
  v->core_triangles = medial->triangle_count;
  if (status == QMAT_OK && v->params->lambda > 0) status = prune(v, medial);
  if (status != QMAT_OK) return status;
  medial->region_offset_count = medial->sphere_count + 1; /* no sphere is responsible for a sample */
  medial->region_offsets = qmat_calloc(medial->region_offset_count, sizeof *medial->region_offsets);
  return medial->region_offsets ? QMAT_OK : qmat_fail_memory(v->context, "regions");
}

static qmat_status make_report(const voxel_core *v, const qmat_medial *medial, qmat_report *report) {
  size_t components;
  const qmat_status status =
      qmat_sets_count(v->context, medial->sphere_count, medial->edges, medial->edge_count, &components);
  if (status != QMAT_OK) return status;
  const qmat_json_count rows[] = {
      {"voxels", v->shape.count},
      {"boundary_vertices", v->point_count},
      {"tetrahedra", v->dual.cells.count},
      {"core_spheres", v->core_spheres},
      {"core_edges", v->core_edges},
      {"core_triangles", v->core_triangles},
      {"sheet_spheres", medial->sheet_sphere_count},
      {"spheres", medial->sphere_count},
      {"edges", medial->edge_count},
      {"triangles", medial->triangle_count},
      {"components", components},
  };
  int bad = json_object_set_new(report->root, "voxel", json_real(v->shape.voxel));
  bad |= qmat_json_set_counts(report->root, rows, sizeof rows / sizeof *rows);
  return bad ? qmat_fail_memory(v->context, "the report") : QMAT_OK;
}

static qmat_status run(qmat_context *context, const void *params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  voxel_core v = {.context = context, .params = params};
  qmat_surface *solids = NULL;
  qmat_medial *medial = qmat_medial_new();
  qmat_report *report = qmat_report_new();
  qmat_status status = medial && report ? QMAT_OK : qmat_fail_memory(context, "the medial mesh");
  if (status == QMAT_OK && qmat_has_solids(mesh)) {
    status = qmat_surface_new_of_solids(context, mesh, &solids);
    v.surface = solids;
    if (status == QMAT_OK) status = find_core(&v);
    if (status == QMAT_OK) status = make_medial(&v, medial);
  }
  if (status == QMAT_OK && mesh->sheet_triangle_count > 0) status = qmat_sheet_slabs_prepend(context, mesh, medial);
  if (status == QMAT_OK) status = make_report(&v, medial, report);
  qmat_free(v.dual.edges);
  qmat_free(v.dual.triangles);
  qmat_free(v.dual.edge_duals);
  qmat_free(v.dual.triangle_duals);
  qmat_surface_free(solids);
  return qmat_hand_over(context, status, (qmat_value *[]){(qmat_value *)medial, (qmat_value *)report}, 2, outputs);
}

static const qmat_param params[] = {
    QMAT_INT(medial_voxel_cores_params, depth, "levels", 7, 2, 9,
             "Depth of the octree: the longest side of the solid's box has 0.9 * 2^depth voxels; the paper: 9"),
    QMAT_LENGTH(medial_voxel_cores_params, lambda, 0.015, 0, 1,
                "Free parts of the core are removed if a ball with this radius contains their closest boundary "
                "vertices; 0: none is"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The closed surface"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "medial", .type = QMAT_MEDIAL, .doc = "The pruned voxel core"},
    {.name = "report", .type = QMAT_REPORT, .doc = "The voxel's side in diagonals; counts of voxels and of the core"},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_cgal, &qmat_library_embree, NULL};

const qmat_node qmat_node_medial_voxel_cores = {
    .name = "medial.voxel_cores",
    .version = 2,
    .summary = "Makes the voxel core of a solid: the medial axis of its voxels",
    .doc =
        "The method that the paper compares with as VC. A voxel belongs to the shape if its centre is inside the "
        "solid. "
        "The core is the part of the Voronoi diagram of the shape's boundary vertices that lies in the shape, in exact "
        "integers. It has the topology of the voxels that share squares.\n\n"
        "Parts with a small lambda are pruned, the smallest first, and only where the topology stays. Parts thinner "
        "than a voxel are missing, and flat parts thinner than twice lambda shrink to curves or points; lambda=0.5% is "
        "the paper's choice for them. The radii are distances to boundary vertices of voxels, so both errors are about "
        "a voxel at least. The result is an initial medial mesh like that of medial.delaunay.",
    .citation =
        "Yan, Letscher, Ju: Voxel cores: efficient, robust, and provably good approximation of 3D medial axes, 2018 "
        "(the paper's VC)",
    .params_size = sizeof(medial_voxel_cores_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
