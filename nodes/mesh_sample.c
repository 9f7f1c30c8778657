/* SPDX-License-Identifier: GPL-3.0-or-later */
/* mesh.sample: spreads samples over a surface, more on large and on thin facets (section 3.2, eq. 7 and 8). */
#include <math.h>
#include <string.h>

#include "core/geometry/frame.h"
#include "core/geometry/sheets.h"
#include "core/geometry/thickness.h"
#include "core/geometry/triangle.h"
#include "core/hash.h"
#include "core/node.h"
#include "nodes/initial/facet_relaxation.h"
#include "nodes/initial/sample_spacing.h"

/* Neighbours count in eq. 7 as a square whose side is at least this share of the spacing. Otherwise a few slivers would
 * force dozens of samples, far closer than any epsilon needs, on each facet around them. */
#define LEAST_NEIGHBOUR_SIDE 0.15
/* The spacing on a facet, as a share of its height. A third would put the number of rows on a border of rounding. */
static const double height_share = 0.35;
/* Facets that are equal up to rounding get no sample for their area. */
#define AREA_TOLERANCE 1e-9

typedef struct mesh_sample_params {
  double spacing;
  double theta;
  int64_t n_f;
  int64_t lloyd_rounds;
  int64_t max_per_facet;
  int64_t max_samples;
  int64_t seed;
} mesh_sample_params;

/* The smallest two areas among the facets at a vertex. */
typedef struct smallest_areas {
  double area[2];
  uint32_t facet[2];
} smallest_areas;

/* The samples that the spacing adds to eq. 7. */
typedef struct spaced_points {
  double *spacings;   /* per facet; NULL without a spacing, as the others */
  uint32_t *on_sides; /* 3 per facet: points on the sides that it owns */
  uint64_t *in_rows;  /* per facet: points in rows if they outnumber the samples of eq. 7, else 0 */
} spaced_points;

typedef struct sample_counts {
  size_t by_spacing;
  size_t by_area, by_thickness, thin, capped, degenerate;
  size_t added, dropped;
  double threshold;
} sample_counts;

static void find_corners(const double *positions, const uint32_t *ids, const double *corners[3]) {
  for (int k = 0; k < 3; k++) corners[k] = positions + 3 * (size_t)ids[k];
}

/* --- how many: eq. 7 and 8 -------------------------------------------------------------------------------------- */

static void note_area(smallest_areas *smallest, double area, uint32_t facet) {
  if (area < smallest->area[0]) {
    smallest->area[1] = smallest->area[0];
    smallest->facet[1] = smallest->facet[0];
    smallest->area[0] = area;
    smallest->facet[0] = facet;
  } else if (area < smallest->area[1]) {
    smallest->area[1] = area;
    smallest->facet[1] = facet;
  }
}

/* The first term of eq. 7: the ratio of a facet's area to its smallest neighbour's, rounded up, minus one. Degenerate
 * neighbours are ignored. */
static int64_t samples_for_area(const smallest_areas *at_vertices, const uint32_t ids[3], uint32_t facet, double area,
                                double least_area, int64_t most) {
  double smallest = INFINITY;
  for (int k = 0; k < 3; k++) {
    const smallest_areas *here = at_vertices + ids[k];
    smallest = fmin(smallest, here->facet[0] == facet ? here->area[1] : here->area[0]);
  }
  const double count = ceil(area / fmax(smallest, least_area) * (1 - AREA_TOLERANCE)) - 1;
  return (int64_t)fmin(fmax(count, 0), (double)most);
}

/* Fills offsets (triangle_count + 1) with the index of each facet's first added sample, before max_samples. */
static qmat_status count_samples(qmat_context *context, const mesh_sample_params *params, const qmat_mesh *mesh,
                                 const double *unit_positions, const qmat_field *thickness, const double *areas,
                                 uint64_t *offsets, spaced_points *spaced, sample_counts *counts) {
  smallest_areas *at_vertices = qmat_arena_alloc(&context->arena, mesh->vertex_count, sizeof *at_vertices);
  if (!at_vertices) return qmat_fail_memory(context, "the areas around vertices");
  for (size_t i = 0; i < mesh->vertex_count; i++)
    at_vertices[i] = (smallest_areas){{INFINITY, INFINITY}, {UINT32_MAX, UINT32_MAX}};
  for (size_t i = 0; i < mesh->triangle_count; i++) {
    const uint32_t *ids = mesh->triangles + 3 * i;
    for (int k = 0; k < 3 && areas[i] > 0; k++) note_area(at_vertices + ids[k], areas[i], (uint32_t)i);
  }
  const double least_side = LEAST_NEIGHBOUR_SIDE * params->spacing;
  counts->threshold = qmat_thickness_threshold(mesh, thickness, params->theta);
  if (params->spacing > 0) {
    spaced->spacings = qmat_arena_alloc(&context->arena, mesh->triangle_count, sizeof *spaced->spacings);
    spaced->on_sides = qmat_arena_alloc(&context->arena, 3 * mesh->triangle_count, sizeof *spaced->on_sides);
    spaced->in_rows = qmat_arena_calloc(&context->arena, mesh->triangle_count, sizeof *spaced->in_rows);
    if (!spaced->spacings || !spaced->on_sides || !spaced->in_rows) return qmat_fail_memory(context, "the samples");
    for (size_t i = 0; i < mesh->triangle_count; i++) {
      const double *corners[3];
      find_corners(unit_positions, mesh->triangles + 3 * i, corners);
      spaced->spacings[i] = qmat_triangle_spacing(qmat_triangle_longest_side(corners[0], corners[1], corners[2]).height,
                                                  height_share, params->spacing);
    }
    const qmat_status status =
        qmat_side_points_count(context, mesh, unit_positions, spaced->spacings, spaced->on_sides);
    if (status != QMAT_OK) return status;
  }

  offsets[0] = 0;
  for (size_t i = 0; i < mesh->triangle_count; i++) {
    const bool thin = thickness->values[i] <= counts->threshold;
    counts->thin += thin;
    offsets[i + 1] = offsets[i];
    for (size_t k = 0; k < 3 && spaced->on_sides; k++) {
      offsets[i + 1] += spaced->on_sides[3 * i + k];
      counts->by_spacing += spaced->on_sides[3 * i + k];
    }
    if (!(areas[i] > 0)) {
      counts->degenerate++;
      continue;
    }
    /* One more than the cap, so that `capped` counts it. */
    const int64_t by_thickness = thin ? params->n_f : 0;
    const int64_t by_area = samples_for_area(at_vertices, mesh->triangles + 3 * i, (uint32_t)i, areas[i],
                                             least_side * least_side, params->max_per_facet + 1);
    const int64_t wanted = by_area + by_thickness;
    const int64_t count = wanted < params->max_per_facet ? wanted : params->max_per_facet;
    if (spaced->in_rows) {
      const double *corners[3];
      find_corners(unit_positions, mesh->triangles + 3 * i, corners);
      const uint64_t rows = qmat_row_points_count(corners[0], corners[1], corners[2], spaced->spacings[i]);
      if (rows > (uint64_t)count) {
        spaced->in_rows[i] = rows;
        counts->by_spacing += rows;
        offsets[i + 1] += rows;
        continue;
      }
    }
    const int64_t kept_thickness = by_thickness < count ? by_thickness : count;
    counts->capped += wanted > count;
    counts->by_thickness += (size_t)kept_thickness;
    counts->by_area += (size_t)(count - kept_thickness);
    offsets[i + 1] += (uint64_t)count;
  }
  return QMAT_OK;
}

/* Scales the counts down evenly to at most `room` added samples. */
static void limit_samples(uint64_t *offsets, size_t facet_count, uint64_t room, sample_counts *counts) {
  const uint64_t wanted = offsets[facet_count];
  if (wanted > room) {
    /* Rounding the running sum, not each count, keeps the ratio even if every facet has a single sample. */
    for (size_t i = 0; i <= facet_count; i++) {
      const uint64_t scaled = (uint64_t)floor((double)offsets[i] * (double)room / (double)wanted);
      offsets[i] = scaled < room ? scaled : room;
    }
  }
  counts->added = (size_t)offsets[facet_count];
  counts->dropped = (size_t)(wanted - offsets[facet_count]);
}

/* --- where ------------------------------------------------------------------------------------------------------- */

/* Places a facet's samples: first on its sides, then inside. */
static void place_samples(const mesh_sample_params *params, const double *unit_positions, const uint32_t *ids,
                          uint32_t facet, const spaced_points *spaced, size_t count, double *barycentrics) {
  const double *corners[3];
  find_corners(unit_positions, ids, corners);
  for (int side = 0; side < 3 && spaced->on_sides; side++) {
    const size_t wanted = spaced->on_sides[3 * (size_t)facet + (size_t)side];
    const size_t placed = wanted < count ? wanted : count;
    qmat_side_points_fill(side, (uint32_t)placed, barycentrics);
    barycentrics += 3 * placed;
    count -= placed;
  }
  if (count == 0) return;
  if (spaced->in_rows && spaced->in_rows[facet] > 0) {
    qmat_row_points_fill(corners[0], corners[1], corners[2], spaced->spacings[facet],
                         qmat_hash3((uint64_t)params->seed, facet, 0), count, barycentrics);
  } else {
    const qmat_facet_relaxation_seed seed = {(uint64_t)params->seed, facet};
    qmat_facet_relaxation(corners[0], corners[1], corners[2], seed, params->lloyd_rounds, count, barycentrics);
  }
}

/* --- the node --------------------------------------------------------------------------------------------------- */

/* Below this spacing the number of samples could overflow; max_samples limits it otherwise. */
static qmat_status check(qmat_context *context, const void *raw_params) {
  const mesh_sample_params *params = raw_params;
  if (params->spacing == 0 || params->spacing >= 1e-4) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_USAGE, "spacing must be 0 or at least 0.0001 (diagonal)");
  return qmat_fail_field(context, "spacing");
}

/* The first samples are the vertices, each on the first facet that uses it. */
static qmat_status sample_vertices(qmat_context *context, const qmat_mesh *mesh, qmat_samples *samples) {
  memcpy(samples->positions, mesh->positions, 3 * mesh->vertex_count * sizeof *samples->positions);
  for (size_t i = 0; i < mesh->vertex_count; i++) samples->facets[i] = UINT32_MAX;
  for (size_t i = 3 * mesh->triangle_count; i-- > 0;) {
    const uint32_t vertex = mesh->triangles[i];
    double *weights = samples->barycentrics + 3 * (size_t)vertex;
    samples->facets[vertex] = (uint32_t)(i / 3);
    for (size_t k = 0; k < 3; k++) weights[k] = k == i % 3;
  }
  for (size_t i = 0; i < mesh->vertex_count; i++) {
    if (samples->facets[i] != UINT32_MAX) continue;
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "no triangle uses the vertex");
    qmat_fail_field(context, "mesh");
    qmat_fail_element(context, "vertex", (int64_t)i);
    return qmat_fail_hint(context, "remove unused vertices");
  }
  return QMAT_OK;
}

/* Adds offsets[i + 1] - offsets[i] samples to each facet, after the vertices. */
static qmat_status sample_facets(qmat_context *context, const mesh_sample_params *params, const qmat_mesh *mesh,
                                 const double *unit_positions, const uint64_t *offsets, const spaced_points *spaced,
                                 qmat_samples *samples) {
  /* Relaxing the samples of large facets takes most of the time: 2,048 of them take about a hundredth of a second. */
  const size_t most_facets = 65536, most_samples = 2048;
  const int threads = qmat_threads(context);
  for (size_t begin = 0, end; begin < mesh->triangle_count; begin = end) {
    for (end = begin + 1; end < mesh->triangle_count && end - begin < most_facets; end++)
      if (offsets[end] - offsets[begin] >= most_samples) break;
#pragma omp parallel for schedule(dynamic, 16) num_threads(threads)
    for (size_t i = begin; i < end; i++) {
      const size_t first = mesh->vertex_count + (size_t)offsets[i], count = (size_t)(offsets[i + 1] - offsets[i]);
      if (count == 0) continue;
      const uint32_t *ids = mesh->triangles + 3 * i;
      place_samples(params, unit_positions, ids, (uint32_t)i, spaced, count, samples->barycentrics + 3 * first);
      for (size_t s = first; s < first + count; s++) {
        const double *weights = samples->barycentrics + 3 * s;
        samples->facets[s] = (uint32_t)i;
        for (size_t k = 0; k < 3; k++) {
          samples->positions[3 * s + k] = weights[0] * mesh->positions[3 * (size_t)ids[0] + k] +
                                          weights[1] * mesh->positions[3 * (size_t)ids[1] + k] +
                                          weights[2] * mesh->positions[3 * (size_t)ids[2] + k];
        }
      }
    }
    const qmat_status status = qmat_progress(context, end, mesh->triangle_count, "facets");
    if (status != QMAT_OK) return status;
  }
  return QMAT_OK;
}

static qmat_status fill_report(qmat_context *context, const qmat_mesh *mesh, const sample_counts *counts,
                               qmat_report *report) {
  json_t *root = json_pack("{s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:f}", "samples",
                           (json_int_t)(mesh->vertex_count + counts->added), "vertices", (json_int_t)mesh->vertex_count,
                           "added", (json_int_t)counts->added, "added_by_area", (json_int_t)counts->by_area,
                           "added_by_spacing", (json_int_t)counts->by_spacing, "added_by_thickness",
                           (json_int_t)counts->by_thickness, "thin_facets", (json_int_t)counts->thin,
                           "degenerate_facets", (json_int_t)counts->degenerate, "capped", (json_int_t)counts->capped,
                           "dropped", (json_int_t)counts->dropped, "thickness_threshold", counts->threshold);
  if (!root || json_object_update(report->root, root) != 0) {
    json_decref(root);
    return qmat_fail_memory(context, "the report");
  }
  json_decref(root);
  return QMAT_OK;
}

/* The areas and the vertices in the unit frame. */
static qmat_status measure_areas(qmat_context *context, const qmat_mesh *mesh, double *unit_positions, double *areas) {
  qmat_frame frame;
  const qmat_status status = qmat_frame_of_mesh(context, mesh, &frame);
  if (status != QMAT_OK) return qmat_fail_field(context, "mesh");
  qmat_frame_to_unit(&frame, mesh->positions, mesh->vertex_count, unit_positions);
  for (size_t i = 0; i < mesh->triangle_count; i++) {
    const uint32_t *ids = mesh->triangles + 3 * i;
    double normal[3];
    areas[i] = qmat_triangle_area(unit_positions + 3 * (size_t)ids[0], unit_positions + 3 * (size_t)ids[1],
                                  unit_positions + 3 * (size_t)ids[2], normal);
  }
  return QMAT_OK;
}

static qmat_status run(qmat_context *context, const void *raw_params, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const mesh_sample_params *params = raw_params;
  const qmat_mesh *mesh = (const qmat_mesh *)inputs[0];
  const qmat_mesh solids = qmat_mesh_of_solids(mesh);
  const qmat_field *thickness = (const qmat_field *)inputs[1];
  qmat_samples *samples = qmat_samples_new();
  qmat_report *report = qmat_report_new();
  double *unit_positions = qmat_arena_alloc(&context->arena, 3 * mesh->vertex_count, sizeof *unit_positions);
  double *areas = qmat_arena_alloc(&context->arena, mesh->triangle_count, sizeof *areas);
  uint64_t *offsets = qmat_arena_alloc(&context->arena, mesh->triangle_count + 1, sizeof *offsets);
  spaced_points spaced = {.spacings = NULL};
  sample_counts counts = {0};
  qmat_status status = QMAT_OK;
  if (!samples || !report || !unit_positions || !areas || !offsets) {
    status = qmat_fail_memory(context, "the samples");
    goto done;
  }
  status = qmat_thickness_check_field(context, mesh, thickness);
  if (status == QMAT_OK) status = measure_areas(context, mesh, unit_positions, areas);
  if (status == QMAT_OK)
    status = count_samples(context, params, &solids, unit_positions, thickness, areas, offsets, &spaced, &counts);
  if (status != QMAT_OK) goto done;
  const uint64_t most = (uint64_t)params->max_samples;
  limit_samples(offsets, solids.triangle_count, most > mesh->vertex_count ? most - mesh->vertex_count : 0, &counts);

  samples->vertex_count = mesh->vertex_count;
  samples->count = mesh->vertex_count + counts.added;
  samples->positions = qmat_alloc(3 * samples->count, sizeof *samples->positions);
  samples->facets = qmat_alloc(samples->count, sizeof *samples->facets);
  samples->barycentrics = qmat_alloc(3 * samples->count, sizeof *samples->barycentrics);
  if (!samples->positions || !samples->facets || !samples->barycentrics) {
    status = qmat_fail_memory(context, "the samples");
    goto done;
  }
  status = sample_vertices(context, mesh, samples);
  if (status == QMAT_OK) status = sample_facets(context, params, &solids, unit_positions, offsets, &spaced, samples);
  if (status == QMAT_OK) status = fill_report(context, mesh, &counts, report);
done:
  return qmat_hand_over(context, status, (qmat_value *[]){(qmat_value *)samples, (qmat_value *)report}, 2, outputs);
}

static const qmat_param params[] = {
    QMAT_LENGTH(
        mesh_sample_params, spacing, 0.02, 0, 1,
        "The largest distance between neighbouring samples on long sides and large facets; 0: eq. 7 alone. Very "
        "large facets have up to 2.5 times this distance"),
    QMAT_FLOAT(mesh_sample_params, theta, "1", 0.5, 0, 10,
               "A facet is thin if its thickness is at most this ratio of the mean (eq. 8)"),
    QMAT_INT(mesh_sample_params, n_f, "samples", 1, 0, 16, "Extra samples for each thin facet (eq. 7)"),
    QMAT_INT(mesh_sample_params, lloyd_rounds, "rounds", 5, 0, 100, "Rounds of Lloyd's relaxation on each facet"),
    QMAT_INT(mesh_sample_params, max_per_facet, "samples", QMAT_MOST_FACET_SAMPLES, 0, QMAT_MOST_FACET_SAMPLES,
             "The most samples added to one facet by eq. 7"),
    QMAT_INT(mesh_sample_params, max_samples, "samples", 4000000, 0, 100000000,
             "The most samples in all. Beyond it all facets get proportionally fewer; the vertices always stay"),
    QMAT_INT(mesh_sample_params, seed, "1", 0, 0, UINT32_MAX,
             "Seed of the random points that the relaxation starts from"),
    {0},
};

static const qmat_port inputs[] = {
    {.name = "mesh", .type = QMAT_MESH, .doc = "The surface; every vertex belongs to a triangle"},
    {.name = "thickness", .type = QMAT_FIELD, .doc = "The thickness of each facet, from mesh.sdf"},
    {0},
};

static const qmat_port outputs[] = {
    {.name = "samples", .type = QMAT_SAMPLES, .doc = "All vertices, then the added points facet by facet"},
    {.name = "report", .type = QMAT_REPORT, .doc = "Counts of samples by their origin"},
    {0},
};

const qmat_node qmat_node_mesh_sample = {
    .name = "mesh.sample",
    .version = 5,
    .summary = "Spreads points over a surface, more of them on large and on thin facets",
    .doc =
        "Every vertex is a sample. Sheets have no other samples. A facet of a solid gets further samples for its area "
        "relative to its smallest neighbour, and "
        "n_f more if it is thin. Neighbours count as at least a square whose side is 0.15 of the spacing; "
        "degenerate facets are ignored.\n\n"
        "A single sample lies at the centroid. Several start at random and are spread by Lloyd's relaxation on the "
        "facet's bounded Voronoi diagram, with fixed corners.\n\n"
        "Eq. 7 only compares facets with each other, so a mesh that is coarse everywhere gets few samples. Long sides "
        "and large facets are therefore filled evenly. The spacing on a facet is 0.35 of its height, but at least the "
        "given one and at most 2.5 times that.",
    .citation = "Section 3.2, eq. 7 and 8; Tournois et al. 2010",
    .params_size = sizeof(mesh_sample_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .check = check,
    .effort = 2,
    .run = run,
};
