/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/descriptor/medial_summary.h"

#include <math.h>
#include <stdio.h>

#include "core/text.h"

static const qmat_summary_entry entries[] = {
    {"spheres", "spheres", QMAT_SUMMARY_SUM},
    {"triangles", NULL, QMAT_SUMMARY_INPUT},
    {"epsilon", NULL, QMAT_SUMMARY_BOUND},
    {"surface_to_envelope", "to envelope", QMAT_SUMMARY_BOUND},
    {"envelope_to_surface", "to surface", QMAT_SUMMARY_BOUND},
    {"surface_to_envelope_meters", NULL, QMAT_SUMMARY_SIZE},
    {"envelope_to_surface_meters", NULL, QMAT_SUMMARY_SIZE},
    {"certified", NULL, QMAT_SUMMARY_ALL},
    {"estimate", NULL, QMAT_SUMMARY_ANY},
    {0},
};

static uint64_t count_of(const json_t *summary, const char *key) {
  return (uint64_t)json_integer_value(json_object_get(summary, key));
}

/* "4 triangles", "2 of the 3 meshes of 900 triangles", "the model". */
static void describe_model(const json_t *summary, char *text, size_t size) {
  const uint64_t triangles = count_of(summary, "triangles"), meshes = count_of(summary, "meshes"),
                 failures = count_of(summary, "failures");
  char number[32], what[48] = "the model";
  qmat_format_count(triangles, number);
  if (triangles > 0) snprintf(what, sizeof what, "%s triangle%s", number, triangles == 1 ? "" : "s");
  if (failures > 0)
    snprintf(text, size, "%llu of the %llu meshes of %s", (unsigned long long)meshes,
             (unsigned long long)(meshes + failures), what);
  else if (meshes > 1)
    snprintf(text, size, "%s of %llu meshes", what, (unsigned long long)meshes);
  else
    snprintf(text, size, "%s", what);
}

/* " (4.9 mm)" for that share of the diagonal, or nothing. `text` holds at least 56 bytes. */
static void describe_size(const json_t *meters, const json_t *share, char *text) {
  const double fraction = json_real_value(share);
  char size[48];
  text[0] = '\0';
  if (!meters) return;
  const double length = json_real_value(meters);
  qmat_format_length(length, fraction > 0 ? length / fraction : (double)INFINITY, size);
  snprintf(text, 56, " (%s)", size);
}

static void write_sentence(const char *name, const json_t *summary, char *text, size_t size) {
  const json_t *certified = json_object_get(summary, "certified");
  const uint64_t sphere_count = count_of(summary, "spheres");
  char spheres[32], out[48], in[48], out_size[56], in_size[56], model[144];
  qmat_format_count(sphere_count, spheres);
  qmat_format_bound(json_real_value(json_object_get(summary, "surface_to_envelope")), out);
  qmat_format_bound(json_real_value(json_object_get(summary, "envelope_to_surface")), in);
  describe_size(json_object_get(summary, "surface_to_envelope_meters"), json_object_get(summary, "surface_to_envelope"),
                out_size);
  describe_size(json_object_get(summary, "envelope_to_surface_meters"), json_object_get(summary, "envelope_to_surface"),
                in_size);
  describe_model(summary, model, sizeof model);
  const char *proof = "";
  if (json_is_true(certified))
    proof = " (certified)";
  else if (json_is_true(json_object_get(summary, "estimate")))
    proof = " (an estimate: the surface is not closed)";
  else if (certified && json_real_value(json_object_get(summary, "epsilon")) > 0)
    proof = " (not certified)";
  /* With lengths beside them, percentages need no other unit. */
  const char *unit = *out_size && *in_size             ? ""
                     : count_of(summary, "meshes") > 1 ? " of the mesh's diagonal"
                                                       : " of the diagonal";
  snprintf(text, size, "%s: %s sphere%s %s%s\nsurface to envelope %s%s, %s %s%s%s", name, spheres,
           sphere_count == 1 ? " describes" : "s describe", model, proof, out, out_size,
           certified ? "envelope to surface" : "envelope outside of the solid", in, in_size, unit);
}

const qmat_report_summary qmat_medial_summary = {.entries = entries, .sentence = write_sentence};
