/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usd_write.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/node.h"
#include "io/bytes.h"
#include "io/usd/usd_colliders.h"
#include "io/usd/usdc_write.h"
#include "io/usd/usdz.h"

#define LONGEST_NAME 200

/* ---- checks ---- */

/* QMAT_ERROR_GEOMETRY names the first vertex, or sphere of 4 components, that single precision does not hold. A
 * sphere's diameter and box are written, too. */
static qmat_status check_single(qmat_context *context, const double *numbers, size_t count, size_t components,
                                const char *kind, const char *field) {
  for (size_t i = 0; i < count * components; i++) {
    const double radius = components == 4 ? fabs(numbers[i - i % 4 + 3]) : 0;
    if (isfinite((float)(fabs(numbers[i]) + radius))) continue;
    char number[32];
    qmat_format_number(numbers[i], number, sizeof number);
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "%s does not fit into single precision", number);
    qmat_fail_element(context, kind, (int64_t)(i / components));
    return qmat_fail_field(context, field);
  }
  return QMAT_OK;
}

/* The medial mesh and the skin as they are stored: relative to an origin. */
typedef struct stored {
  double origin[3];
  qmat_medial medial;
  qmat_mesh skin; /* no triangles: no skin */
  double loss;    /* how far single precision moves the solid */
} stored;

static bool has_origin(const stored *s) {
  return s->origin[0] != 0 || s->origin[1] != 0 || s->origin[2] != 0;
}

static void stored_uninit(stored *s) {
  qmat_free(s->medial.spheres);
  qmat_free(s->skin.positions);
}

/* Copies the points; the simplices are shared with the input. */
static qmat_status stored_init(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin, double moved,
                               stored *s) {
  *s = (stored){.medial = *medial};
  if (skin) s->skin = *skin;
  qmat_storage_origin(medial, skin, moved, s->origin);
  s->medial.spheres = qmat_alloc(medial->sphere_count, 4 * sizeof(double));
  s->skin.positions = qmat_alloc(s->skin.vertex_count, 3 * sizeof(double));
  double *back = qmat_alloc(medial->sphere_count, 4 * sizeof *back);
  if (!s->medial.spheres || !s->skin.positions || !back) {
    qmat_free(back);
    return qmat_fail_memory(context, "the output file");
  }
  for (size_t i = 0; i < 4 * medial->sphere_count; i++) {
    const double from = i % 4 < 3 ? s->origin[i % 4] : 0;
    s->medial.spheres[i] = medial->spheres[i] - from;
    back[i] = (double)(float)s->medial.spheres[i] + from;
  }
  for (size_t i = 0; skin && i < 3 * skin->vertex_count; i++)
    s->skin.positions[i] = skin->positions[i] - s->origin[i % 3];
  const qmat_medial read = {.sphere_count = medial->sphere_count, .spheres = back};
  s->loss = qmat_medial_move(medial, &read);
  qmat_free(back);
  qmat_status status = check_single(context, s->medial.spheres, medial->sphere_count, 4, "sphere", "medial");
  if (status == QMAT_OK) status = check_single(context, s->skin.positions, s->skin.vertex_count, 3, "vertex", "skin");
  return status;
}

/* ---- parts of the text ---- */

/* The shortest text that reads back as the same single-precision number. The C locale is set. */
static void put_single(qmat_writer *writer, double number) {
  const float single = (float)number;
  char text[32];
  for (int precision = 6; precision <= 9; precision++) {
    snprintf(text, sizeof text, "%.*g", precision, (double)single);
    if (strtof(text, NULL) == single) break;
  }
  qmat_put_text(writer, text);
}

static void put_triple(qmat_writer *writer, const double *point) {
  qmat_put_text(writer, "(");
  for (int k = 0; k < 3; k++) {
    if (k > 0) qmat_put_text(writer, ", ");
    put_single(writer, point[k]);
  }
  qmat_put_text(writer, ")");
}

static void put_separator(qmat_writer *writer, size_t i) {
  if (i > 0) qmat_put_text(writer, ", ");
}

/* A text in quotes. */
static void put_quoted(qmat_writer *writer, const char *text) {
  qmat_put_text(writer, "\"");
  for (; *text; text++) {
    char escaped[8];
    if ((unsigned char)*text < ' ' || *text == 127) {
      snprintf(escaped, sizeof escaped, "\\x%02x", (unsigned)(unsigned char)*text);
      qmat_put_text(writer, escaped);
      continue;
    }
    if (*text == '"' || *text == '\\') qmat_put_text(writer, "\\");
    qmat_put_bytes(writer, text, 1);
  }
  qmat_put_text(writer, "\"");
}

/* The name of a prim: letters, digits and underscores, the first one no digit. */
static void make_prim_name(const char *name, char prim[LONGEST_NAME + 2]) {
  size_t length = 0;
  if (!name || !*name) name = "model";
  if (*name >= '0' && *name <= '9') prim[length++] = '_';
  for (; *name && length < LONGEST_NAME; name++) {
    const char c = *name;
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if ((c & 0xC0) == 0x80) continue; /* one underscore for each character */
    prim[length++] = plain ? c : '_';
  }
  prim[length] = '\0';
}

/* The box of the points, or with `radii` of spheres, as an attribute. */
static void put_extent(qmat_writer *writer, const double *points, size_t count, size_t stride, bool radii) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < count; i++) {
    const double *p = points + stride * i, r = radii ? p[3] : 0;
    for (int k = 0; k < 3; k++) {
      low[k] = fmin(low[k], p[k] - r);
      high[k] = fmax(high[k], p[k] + r);
    }
  }
  qmat_put_text(writer, "        float3[] extent = [");
  put_triple(writer, low);
  qmat_put_text(writer, ", ");
  put_triple(writer, high);
  qmat_put_text(writer, "]\n");
}

static void put_points(qmat_writer *writer, const double *points, size_t count, size_t stride) {
  qmat_put_text(writer, "        point3f[] points = [");
  for (size_t i = 0; i < count; i++) {
    put_separator(writer, i);
    put_triple(writer, points + stride * i);
  }
  qmat_put_text(writer, "]\n");
}

static void put_triangles(qmat_writer *writer, const uint32_t *triangles, size_t count) {
  qmat_put_text(writer, "        int[] faceVertexCounts = [");
  for (size_t t = 0; t < count; t++) qmat_put_text(writer, t > 0 ? ", 3" : "3");
  qmat_put_text(writer, "]\n        int[] faceVertexIndices = [");
  for (size_t i = 0; i < 3 * count; i++) {
    put_separator(writer, i);
    qmat_put_integer(writer, triangles[i]);
  }
  qmat_put_text(writer, "]\n");
}

/* The radii times `factor` of the spheres `ids` (NULL: all), as an array of one number per point. */
static void put_radii(qmat_writer *writer, const char *attribute, const qmat_medial *medial, const uint32_t *ids,
                      size_t count, double factor) {
  qmat_put_text(writer, "        float[] ");
  qmat_put_text(writer, attribute);
  qmat_put_text(writer, " = [");
  for (size_t i = 0; i < count; i++) {
    const double *sphere = medial->spheres + 4 * (ids ? (size_t)ids[i] : i);
    put_separator(writer, i);
    put_single(writer, factor * sphere[3]);
  }
  qmat_put_text(writer, "] (\n            interpolation = \"vertex\"\n        )\n");
}

static void put_guide(qmat_writer *writer) {
  qmat_put_text(writer, "        uniform token purpose = \"guide\"\n    }\n");
}

static void put_skin(qmat_writer *writer, const qmat_mesh *skin) {
  qmat_put_text(writer, "\n    def Mesh \"skin\"");
  if (skin->deviation > 0) {
    qmat_put_text(writer, " (\n        customData = {\n            double qmat_skin_error = ");
    qmat_put_number(writer, skin->deviation);
    qmat_put_text(writer, "\n            string qmat_skin_error_unit = \"model\"\n        }\n    )");
  }
  qmat_put_text(writer, "\n    {\n");
  put_extent(writer, skin->positions, skin->vertex_count, 3, false);
  put_triangles(writer, skin->triangles, skin->triangle_count);
  put_points(writer, skin->positions, skin->vertex_count, 3);
  qmat_put_text(writer, "        uniform token subdivisionScheme = \"none\"\n    }\n");
}

/* The joints and weights of the spheres, as UsdSkel has them. */
static void put_joints(qmat_writer *writer, const qmat_medial *medial) {
  static const char *const ending =
      "] (\n            elementSize = 4\n            interpolation = \"vertex\"\n        )\n";
  const size_t count = 4 * medial->skinned_count;
  if (count == 0) return;
  qmat_put_text(writer, "        int[] primvars:skel:jointIndices = [");
  for (size_t i = 0; i < count; i++) {
    put_separator(writer, i);
    qmat_put_integer(writer, medial->joints[i]);
  }
  qmat_put_text(writer, ending);
  qmat_put_text(writer, "        float[] primvars:skel:jointWeights = [");
  for (size_t i = 0; i < count; i++) {
    put_separator(writer, i);
    put_single(writer, medial->weights[i]);
  }
  qmat_put_text(writer, ending);
}

static void put_spheres(qmat_writer *writer, const qmat_medial *medial) {
  qmat_put_text(writer, "\n    def Points \"spheres\"");
  if (medial->skinned_count > 0) qmat_put_text(writer, " (\n        prepend apiSchemas = [\"SkelBindingAPI\"]\n    )");
  qmat_put_text(writer, "\n    {\n");
  put_extent(writer, medial->spheres, medial->sphere_count, 4, true);
  put_points(writer, medial->spheres, medial->sphere_count, 4);
  put_radii(writer, "primvars:radius", medial, NULL, medial->sphere_count, 1);
  put_radii(writer, "widths", medial, NULL, medial->sphere_count, 2);
  put_joints(writer, medial);
  put_guide(writer);
}

static void put_cones(qmat_writer *writer, const qmat_medial *medial) {
  const size_t count = 2 * medial->edge_count;
  qmat_put_text(writer, "\n    def BasisCurves \"cones\"\n    {\n        int[] curveVertexCounts = [");
  for (size_t e = 0; e < medial->edge_count; e++) qmat_put_text(writer, e > 0 ? ", 2" : "2");
  qmat_put_text(writer, "]\n");
  put_extent(writer, medial->spheres, medial->sphere_count, 4, true);
  qmat_put_text(writer, "        point3f[] points = [");
  for (size_t i = 0; i < count; i++) {
    put_separator(writer, i);
    put_triple(writer, medial->spheres + 4 * (size_t)medial->edges[i]);
  }
  qmat_put_text(writer, "]\n        int[] primvars:qmat:sphere = [");
  for (size_t i = 0; i < count; i++) {
    put_separator(writer, i);
    qmat_put_integer(writer, medial->edges[i]);
  }
  qmat_put_text(writer, "] (\n            interpolation = \"vertex\"\n        )\n");
  put_radii(writer, "primvars:radius", medial, medial->edges, count, 1);
  put_radii(writer, "widths", medial, medial->edges, count, 2);
  qmat_put_text(writer, "        uniform token type = \"linear\"\n");
  put_guide(writer);
}

static void put_slabs(qmat_writer *writer, const qmat_medial *medial) {
  qmat_put_text(writer, "\n    def Mesh \"slabs\"\n    {\n        uniform bool doubleSided = 1\n");
  put_extent(writer, medial->spheres, medial->sphere_count, 4, true);
  put_triangles(writer, medial->triangles, medial->triangle_count);
  put_points(writer, medial->spheres, medial->sphere_count, 4);
  put_radii(writer, "primvars:radius", medial, NULL, medial->sphere_count, 1);
  qmat_put_text(writer, "        uniform token subdivisionScheme = \"none\"\n");
  put_guide(writer);
}

/* ---- metadata ---- */

static void put_entry(qmat_writer *writer, const char *type, const char *name) {
  qmat_put_text(writer, "        ");
  qmat_put_text(writer, type);
  qmat_put_text(writer, " ");
  qmat_put_text(writer, name);
  qmat_put_text(writer, " = ");
}

static void put_text_entry(qmat_writer *writer, const char *name, const char *text) {
  put_entry(writer, "string", name);
  put_quoted(writer, text);
  qmat_put_text(writer, "\n");
}

static void put_count_entry(qmat_writer *writer, const char *name, size_t count) {
  put_entry(writer, "int", name);
  qmat_put_integer(writer, (int64_t)count);
  qmat_put_text(writer, "\n");
}

static void put_number_entry(qmat_writer *writer, const char *name, double number) {
  put_entry(writer, "double", name);
  qmat_put_number(writer, number);
  qmat_put_text(writer, "\n");
}

static void put_custom_data(qmat_writer *writer, const stored *s, const char *name, const char *path,
                            const qmat_stated_errors *stated) {
  const qmat_medial *medial = &s->medial;
  const struct {
    const char *name;
    double value;
  } errors[] = {
      {"qmat_epsilon", stated->epsilon}, {"qmat_error_out", stated->error_out}, {"qmat_error_in", stated->error_in}};
  bool any = false;
  qmat_put_text(writer, "    customData = {\n");
  put_text_entry(writer, "qmat_version", QMAT_VERSION);
  put_text_entry(writer, "qmat_name", name ? name : "");
  if (path) put_text_entry(writer, "qmat_prim", path);
  put_count_entry(writer, "qmat_vertices", medial->sphere_count);
  put_count_entry(writer, "qmat_edges", medial->edge_count);
  put_count_entry(writer, "qmat_triangles", medial->triangle_count);
  for (size_t i = 0; i < sizeof errors / sizeof errors[0]; i++) {
    if (!isfinite(errors[i].value)) continue;
    put_number_entry(writer, errors[i].name, errors[i].value);
    any = true;
  }
  if (any) put_text_entry(writer, "qmat_error_unit", "diagonal");
  if (stated->certified != QMAT_CERTIFICATE_UNKNOWN) {
    put_entry(writer, "bool", "qmat_certified");
    qmat_put_text(writer, stated->certified == QMAT_CERTIFICATE_YES ? "true\n" : "false\n");
  }
  put_number_entry(writer, "qmat_quantisation", s->loss);
  put_text_entry(writer, "qmat_quantisation_unit", "model");
  put_text_entry(writer, "qmat_frame", "prim");
  static const char *const axes[] = {"qmat_origin_x", "qmat_origin_y", "qmat_origin_z"};
  for (int k = 0; k < 3 && has_origin(s); k++) put_number_entry(writer, axes[k], s->origin[k]);
  qmat_put_text(writer, "    }\n");
}

/* The position of the prim, in double precision. */
static void put_translation(qmat_writer *writer, const double origin[3]) {
  qmat_put_text(writer, "\n    double3 xformOp:translate = (");
  for (int k = 0; k < 3; k++) {
    if (k > 0) qmat_put_text(writer, ", ");
    qmat_put_number(writer, origin[k]);
  }
  qmat_put_text(writer, ")\n    uniform token[] xformOpOrder = [\"xformOp:translate\"]\n");
}

/* The prim with the medial mesh; `specifier` is "def" or "class". */
static void put_prim(qmat_writer *writer, const stored *s, const qmat_usd_options *options,
                     const qmat_stated_errors *stated, const char *specifier, const char *prim) {
  const qmat_medial *medial = &s->medial;
  const bool is_body = options->colliders && options->dynamic && strcmp(specifier, "def") == 0;
  qmat_put_text(writer, specifier);
  qmat_put_text(writer, " Xform ");
  put_quoted(writer, prim);
  qmat_put_text(writer, " (\n");
  if (is_body) qmat_usd_put_body_schemas(writer, 1);
  put_custom_data(writer, s, options->name, options->prim, stated);
  if (!options->prim) qmat_put_text(writer, "    kind = \"component\"\n");
  qmat_put_text(writer, ")\n{");
  if (has_origin(s)) put_translation(writer, s->origin);
  if (is_body && options->colliders->body_count > 0) {
    qmat_put_text(writer, "\n");
    qmat_usd_put_body(writer, 1, options->colliders->body, s->origin, 1, false);
  }
  if (s->skin.triangle_count > 0) put_skin(writer, &s->skin);
  put_spheres(writer, medial);
  if (medial->edge_count > 0) put_cones(writer, medial);
  if (medial->triangle_count > 0) put_slabs(writer, medial);
  if (options->colliders) qmat_usd_put_colliders(writer, options->colliders, s->origin);
  qmat_put_text(writer, "}\n");
}

static void put_layer(qmat_writer *writer, const stored *s, const qmat_usd_options *options,
                      const qmat_stated_errors *stated, const char *prim) {
  qmat_put_text(writer, "#usda 1.0\n(\n    defaultPrim = ");
  put_quoted(writer, prim);
  qmat_put_text(writer, "\n    doc = \"qmat " QMAT_VERSION "\"\n    metersPerUnit = ");
  qmat_put_number(writer, options->meters_per_unit > 0 ? options->meters_per_unit : 1);
  qmat_put_text(writer, options->is_z_up ? "\n    upAxis = \"Z\"\n)\n\n" : "\n    upAxis = \"Y\"\n)\n\n");
  put_prim(writer, s, options, stated, "def", prim);
}

/* Stores the medial mesh, and states its errors. Free `s` also after a failure. */
static qmat_status store(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                         const qmat_usd_options *options, stored *s, qmat_stated_errors *stated) {
  const qmat_status status = stored_init(context, medial, skin, options->moved, s);
  if (status != QMAT_OK) return status;
  *stated = qmat_errors_after_move(&options->errors, s->loss);
  if (options->stated) *options->stated = *stated;
  return QMAT_OK;
}

qmat_status qmat_usd_put_class(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                               const qmat_usd_options *options, const char *prim, qmat_writer *writer) {
  stored s;
  qmat_stated_errors stated;
  const qmat_status status = store(context, medial, skin, options, &s, &stated);
  if (status == QMAT_OK) put_prim(writer, &s, options, &stated, "class", prim);
  stored_uninit(&s);
  return status;
}

static qmat_status crate_to_file(qmat_context *context, qmat_writer *layer, qmat_file **file) {
  const qmat_status status = qmat_usdc_of_text(context, layer);
  if (status == QMAT_OK) return qmat_writer_to_file(context, layer, "usdc", file);
  qmat_writer_uninit(layer);
  return status;
}

qmat_status qmat_usd_write(qmat_context *context, const qmat_medial *medial, const qmat_mesh *skin,
                           const qmat_usd_options *options, qmat_file **file) {
  *file = NULL;
  if (medial->sphere_count == 0) {
    qmat_fail(context, QMAT_ERROR_GEOMETRY, "the medial mesh has no sphere");
    return qmat_fail_field(context, "medial");
  }
  stored s;
  qmat_stated_errors stated;
  const qmat_status status = store(context, medial, skin, options, &s, &stated);
  if (status != QMAT_OK) {
    stored_uninit(&s);
    return status;
  }
  char prim[LONGEST_NAME + 2], member[LONGEST_NAME + 8];
  make_prim_name(options->name, prim);
  qmat_writer writer = {0}, package = {0};
  const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
  if (plain == (locale_t)0) {
    stored_uninit(&s);
    return qmat_fail_memory(context, "the output file");
  }
  const locale_t before = uselocale(plain);
  put_layer(&writer, &s, options, &stated, prim);
  uselocale(before);
  freelocale(plain);
  stored_uninit(&s);
  if (options->form == QMAT_USD_CRATE) return crate_to_file(context, &writer, file);
  if (options->form == QMAT_USD_TEXT) return qmat_writer_to_file(context, &writer, "usda", file);
  snprintf(member, sizeof member, "%s.usda", prim);
  if (!writer.failed) qmat_usdz_put(&package, member, writer.bytes, writer.size);
  package.failed = package.failed || writer.failed;
  qmat_writer_uninit(&writer);
  return qmat_writer_to_file(context, &package, "usdz", file);
}
