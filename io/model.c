/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/model.h"

#include <float.h>
#include <math.h>
#include <string.h>
#include <strings.h>

#include "io/gltf/gltf.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_keep.h"
#include "io/mesh/mesh_formats.h"
#include "io/near_copies.h"
#include "io/scanner.h"
#include "io/stretch.h"
#include "io/usd/usd_model.h"

#define LONGEST_DIAGONAL (DBL_MAX / 8)

static const struct {
  const char *title; /* the usual name */
  const char *name;  /* in scenes and reports */
} formats[QMAT_FORMAT_COUNT] = {
    [QMAT_FORMAT_UNKNOWN] = {"unknown", ""},    [QMAT_FORMAT_OFF] = {"OFF", "off"},
    [QMAT_FORMAT_OBJ] = {"OBJ", "obj"},         [QMAT_FORMAT_PLY] = {"PLY", "ply"},
    [QMAT_FORMAT_STL] = {"STL", "stl"},         [QMAT_FORMAT_GLTF] = {"glTF", "gltf"},
    [QMAT_FORMAT_GLB] = {"binary glTF", "glb"}, [QMAT_FORMAT_MA] = {"MA", "ma"},
    [QMAT_FORMAT_USD] = {"USD", "usd"},         [QMAT_FORMAT_ZIP] = {"zip", "zip"},
};

static const struct {
  const char *ending;
  qmat_format format;
} endings[] = {
    {"off", QMAT_FORMAT_OFF}, {"obj", QMAT_FORMAT_OBJ},   {"ply", QMAT_FORMAT_PLY},  {"stl", QMAT_FORMAT_STL},
    {"ma", QMAT_FORMAT_MA},   {"gltf", QMAT_FORMAT_GLTF}, {"glb", QMAT_FORMAT_GLB},  {"usd", QMAT_FORMAT_USD},
    {"zip", QMAT_FORMAT_ZIP}, {"usda", QMAT_FORMAT_USD},  {"usdc", QMAT_FORMAT_USD}, {"usdz", QMAT_FORMAT_USD},
};

const char *qmat_format_title(qmat_format format) {
  return formats[format].title;
}

static const char *base_name(const char *path) {
  const char *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

/* The extension with its dot, or the end of the name. A leading dot is part of the name. */
static const char *ending_of(const char *base) {
  const char *dot = strrchr(base, '.');
  return dot && dot != base ? dot : base + strlen(base);
}

qmat_format qmat_format_of_name(const char *path) {
  const char *ending = ending_of(base_name(path));
  if (*ending == '.') ending++;
  for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
    const char *wanted = endings[i].ending;
    size_t k = 0;
    while (wanted[k] && (ending[k] >= 'A' && ending[k] <= 'Z' ? ending[k] | 0x20 : ending[k]) == wanted[k]) k++;
    if (!wanted[k] && !ending[k]) return endings[i].format;
  }
  return QMAT_FORMAT_UNKNOWN;
}

static bool starts(const qmat_bytes *bytes, const char *magic) {
  const size_t length = strlen(magic);
  return bytes->size >= length && memcmp(bytes->data, magic, length) == 0;
}

qmat_format qmat_format_of_bytes(const qmat_bytes *bytes) {
  if (starts(bytes, "glTF")) return QMAT_FORMAT_GLB;
  if (starts(bytes, "PXR-USDC") || starts(bytes, "#usda")) return QMAT_FORMAT_USD;
  if (starts(bytes, "ply\n") || starts(bytes, "ply\r")) return QMAT_FORMAT_PLY;
  if (starts(bytes, "PK\3\4") || starts(bytes, "PK\5\6")) {
    /* USDZ is a zip whose first member is a USD layer; its name follows a header of 30 bytes. */
    qmat_byte_reader reader = {.bytes = bytes->data, .size = bytes->size, .at = 4};
    qmat_take_bytes(&reader, 22);
    const size_t length = qmat_take_u16(&reader);
    qmat_take_u16(&reader);
    const char *name = (const char *)qmat_take_bytes(&reader, length);
    bool usd = name && length >= 5 && memcmp(name + length - 5, ".usd", 4) == 0;
    usd = usd || (name && length >= 4 && memcmp(name + length - 4, ".usd", 4) == 0);
    return usd ? QMAT_FORMAT_USD : QMAT_FORMAT_ZIP;
  }
  if (qmat_stl_is_binary(bytes)) return QMAT_FORMAT_STL;

  qmat_scanner scanner;
  qmat_context nowhere = {0}; /* finding tokens cannot fail */
  qmat_scanner_init(&scanner, &nowhere, "", (const char *)bytes->data, bytes->size, '#');
  size_t length;
  const char *word = qmat_scan_token(&scanner, &length);
  if (length == 0) return QMAT_FORMAT_UNKNOWN;
  if (word[0] == '{') return QMAT_FORMAT_GLTF;
  if (length >= 3 && length <= 8 && strncasecmp(word + length - 3, "OFF", 3) == 0) return QMAT_FORMAT_OFF;
  if (qmat_is_word(word, length, "ply")) return QMAT_FORMAT_PLY;
  if (qmat_is_word(word, length, "solid")) return QMAT_FORMAT_STL;
  static const char *const obj_words[] = {"v", "vn", "vt", "vp", "f", "o", "g", "s", "mtllib", "usemtl"};
  for (size_t i = 0; i < sizeof obj_words / sizeof obj_words[0]; i++) {
    if (qmat_is_word(word, length, obj_words[i])) return QMAT_FORMAT_OBJ;
  }
  return QMAT_FORMAT_UNKNOWN;
}

qmat_status qmat_format_choose(qmat_context *context, const char *path, const qmat_bytes *bytes, qmat_format *format) {
  const qmat_format named = qmat_format_of_name(path), found = qmat_format_of_bytes(bytes);
  const bool both = named != QMAT_FORMAT_UNKNOWN && found != QMAT_FORMAT_UNKNOWN;
  *format = found != QMAT_FORMAT_UNKNOWN ? found : named;
  if (both && named != found) {
    qmat_fail(context, QMAT_ERROR_FORMAT, "the extension says %s, but the content is %s", formats[named].title,
              formats[found].title);
    qmat_fail_at(context, path, 0, 0);
    return qmat_fail_hint(context, "rename or convert the file");
  }
  if (*format == QMAT_FORMAT_ZIP || *format == QMAT_FORMAT_UNKNOWN) {
    qmat_fail(context, QMAT_ERROR_FORMAT,
              *format == QMAT_FORMAT_ZIP ? "archives are not supported"
                                         : "neither the content nor the extension is of a supported format");
    qmat_fail_at(context, path, 0, 0);
    return qmat_fail_hint(context, "use .off, .obj, .ply, .stl, .gltf, .glb, .usd, .usda, .usdc or .usdz");
  }
  return QMAT_OK;
}

char *qmat_model_name(const char *path) {
  const char *base = base_name(path), *end = ending_of(base);
  if (base == end) return qmat_strdup("model");
  char *name = qmat_alloc((size_t)(end - base) * 3 + 1, 1); /* U+FFFD has three bytes */
  if (!name) return NULL;
  size_t size = 0;
  while (base < end) {
    size_t length = qmat_utf8_length(base);
    memcpy(name + size, length > 0 ? base : "\xEF\xBF\xBD", length > 0 ? length : 3);
    size += length > 0 ? length : 3;
    base += length > 0 ? length : 1;
  }
  name[size] = '\0';
  return name;
}

static qmat_status read_surface(qmat_context *context, qmat_format format, const char *path, const qmat_bytes *bytes,
                                qmat_soup *soup, json_t *report) {
  switch (format) {
    case QMAT_FORMAT_OFF:
      return qmat_off_read(context, bytes, path, soup);
    case QMAT_FORMAT_OBJ:
      return qmat_obj_read(context, bytes, path, soup);
    case QMAT_FORMAT_PLY:
      return qmat_ply_read(context, bytes, path, soup);
    case QMAT_FORMAT_STL:
      return qmat_stl_read(context, bytes, path, soup);
    case QMAT_FORMAT_GLTF:
    case QMAT_FORMAT_GLB:
      return qmat_gltf_parse(context, bytes->data, bytes->size, path, soup, report);
    default:
      qmat_fail(context, QMAT_ERROR_FORMAT, "the file has a medial mesh, not a surface");
      qmat_fail_at(context, path, 0, 0);
      return qmat_fail_hint(context, "read it with the node medial.read");
  }
}

static qmat_scene *make_scene(const char *path, qmat_format format) {
  qmat_scene *scene = qmat_scene_new();
  if (!scene) return NULL;
  scene->name = qmat_model_name(path);
  scene->format = qmat_strdup(formats[format].name);
  if (scene->name && scene->format) return scene;
  qmat_value_release(&scene->base);
  return NULL;
}

static double unit_of_usd(const json_t *report) {
  const double unit = json_real_value(json_object_get(report, "meters_per_unit"));
  return unit > 0 ? unit : 0;
}

static bool states_unit(qmat_format format) {
  return format == QMAT_FORMAT_GLTF || format == QMAT_FORMAT_GLB || format == QMAT_FORMAT_USD;
}

/* Sets the unit of length and the up axis that the reader reported; `given` is the unit of a file that states none. */
static void set_units(qmat_scene *scene, qmat_format format, const json_t *report, double given) {
  scene->meters_per_unit = states_unit(format) ? 1 : given;
  if (format != QMAT_FORMAT_USD) return;
  const char *up = json_string_value(json_object_get(report, "up_axis"));
  scene->meters_per_unit = unit_of_usd(report);
  scene->is_z_up = up && up[0] == 'Z';
}

/* Lengths of a few diagonals must be numbers too, as nodes measure with them. */
static qmat_status check_extent(qmat_context *context, const char *path, const qmat_mesh *mesh) {
  double square = 0;
  for (size_t axis = 0; axis < 3; axis++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t v = 0; v < mesh->vertex_count; v++) {
      low = fmin(low, mesh->positions[3 * v + axis]);
      high = fmax(high, mesh->positions[3 * v + axis]);
    }
    const double share = high / LONGEST_DIAGONAL - low / LONGEST_DIAGONAL;
    square += share * share;
  }
  if (square <= 1) return QMAT_OK;
  qmat_fail(context, QMAT_ERROR_GEOMETRY, "its bounding box is too large to be measured");
  return qmat_fail_at(context, path, 0, 0);
}

/* qmat_soup_to_mesh for a mesh that can be measured. */
static qmat_status make_surface(qmat_context *context, const qmat_soup *soup, const char *path,
                                const qmat_read_options *options, qmat_mesh **mesh, json_t *report) {
  qmat_status status = qmat_soup_to_mesh(context, soup, path, options, mesh, report);
  if (status == QMAT_OK) status = check_extent(context, path, *mesh);
  if (status == QMAT_OK || !*mesh) return status;
  qmat_value_release(&(*mesh)->base);
  *mesh = NULL;
  return status;
}

static qmat_status read_whole(qmat_context *context, qmat_format format, const char *path, const qmat_bytes *bytes,
                              const qmat_read_options *options, qmat_value **mesh, json_t *report) {
  qmat_soup soup = {0};
  qmat_mesh *made = NULL;
  qmat_status status = read_surface(context, format, path, bytes, &soup, report);
  if (format == QMAT_FORMAT_USD) soup.meters_per_unit = unit_of_usd(report);
  if (status == QMAT_OK) status = make_surface(context, &soup, path, options, &made, report);
  qmat_soup_uninit(&soup);
  *mesh = made ? &made->base : NULL;
  return status;
}

/* Several meshes that were read, each in its own space. */
typedef struct separate_meshes {
  size_t count;
  const uint32_t *ids; /* count: their numbers in the file */
  qmat_soup *soups;    /* count */
  const json_t *root;  /* of a glTF asset, for names and uses; NULL: */
  char **names;        /* count */
  const size_t *uses;  /* count: how often the scene shows a mesh */
} separate_meshes;

/* The name of a mesh, which the caller frees; NULL if memory is short. */
static char *name_of(const separate_meshes *from, size_t i) {
  return from->root ? qmat_gltf_mesh_name(from->root, from->ids[i]) : qmat_strdup(from->names[i]);
}

/* Appends an entry for a mesh to the report's list "meshes". NULL if memory is short. */
static json_t *add_mesh_report(json_t *report, const separate_meshes *from, size_t i, const char *name) {
  const size_t uses = from->root ? qmat_gltf_mesh_carriers(from->root, from->ids[i]) : from->uses[i];
  json_t *of_mesh =
      json_pack("{s:s, s:I, s:I}", "name", name, "mesh", (json_int_t)from->ids[i], "nodes", (json_int_t)uses);
  return json_array_append_new(json_object_get(report, "meshes"), of_mesh) == 0 ? of_mesh : NULL;
}

/* Makes one of several meshes, or a failure value if its facets make no valid mesh. */
static qmat_status make_mesh(qmat_context *context, const char *path, const qmat_soup *soup,
                             const qmat_read_options *options, qmat_value **mesh, json_t *report) {
  qmat_mesh *made = NULL;
  qmat_status status = make_surface(context, soup, path, options, &made, report);
  *mesh = made ? &made->base : NULL;
  if (status != QMAT_ERROR_GEOMETRY) return status;
  *mesh = qmat_failure_of_error(context);
  if (!*mesh) return context->error.status;
  const int failed = json_object_set_new(report, "failure", json_string(qmat_value_failure(*mesh)));
  return failed ? qmat_fail_memory(context, "the report") : QMAT_OK;
}

/* Makes one value of the meshes: a mesh, or a list of several. */
static qmat_status make_meshes(qmat_context *context, const char *path, const separate_meshes *from,
                               const qmat_read_options *options, qmat_value **mesh, json_t *report) {
  qmat_status status = QMAT_OK;
  if (from->count == 1) {
    qmat_mesh *made = NULL;
    status = make_surface(context, &from->soups[0], path, options, &made, report);
    *mesh = made ? &made->base : NULL;
    return status;
  }
  qmat_error first_error = {0};
  size_t failed = 0;
  qmat_list *list = qmat_list_new(from->count);
  if (!list || json_object_set_new(report, "meshes", json_array()) != 0)
    status = qmat_fail_memory(context, "the meshes of a scene");
  for (size_t i = 0; i < from->count && status == QMAT_OK; i++) {
    list->names[i] = name_of(from, i);
    json_t *of_mesh = list->names[i] ? add_mesh_report(report, from, i, list->names[i]) : NULL;
    if (!of_mesh) {
      status = qmat_fail_memory(context, "the meshes of a scene");
      break;
    }
    status = make_mesh(context, path, &from->soups[i], options, &list->items[i], of_mesh);
    qmat_soup_uninit(&from->soups[i]);
    if (status != QMAT_OK) qmat_fail_within(context, list->names[i]);
    if (status == QMAT_OK && qmat_value_failure(list->items[i]) && failed++ == 0) first_error = context->error;
  }
  if (status == QMAT_OK && failed == from->count) {
    context->error = first_error;
    status = qmat_fail_within(context, list->names[0]);
  }
  if (status == QMAT_OK) status = qmat_near_copies_merge(context, list, json_object_get(report, "meshes"));
  if (status == QMAT_OK) status = qmat_value_seal(context, &list->base);
  if (status == QMAT_OK) {
    *mesh = &list->base;
  } else if (list) {
    qmat_value_release(&list->base);
  }
  return status;
}

/* Warns of nodes whose extras cannot store a medial mesh. */
static qmat_status warn_of_extras(qmat_context *context, const json_t *root, const qmat_gltf_meshes *meshes,
                                  json_t *warnings) {
  const json_t *nodes = json_object_get(root, "nodes");
  for (size_t i = 0; i < json_array_size(nodes); i++) {
    const json_t *node = json_array_get(nodes, i), *extras = json_object_get(node, "extras");
    const int64_t mesh = qmat_gltf_mesh_of(node);
    bool chosen = false;
    for (size_t k = 0; k < meshes->count && !chosen; k++) chosen = mesh == (int64_t)meshes->ids[k];
    if (!chosen || !extras || json_is_object(extras)) continue;
    json_t *text = json_sprintf("the extras of node %zu are not an object: its medial mesh goes to a child node", i);
    if (json_array_append_new(warnings, text) != 0) return qmat_fail_memory(context, "the report");
  }
  return QMAT_OK;
}

static qmat_status read_gltf(qmat_context *context, qmat_format format, const char *path, const qmat_bytes *bytes,
                             const qmat_read_options *options, const char *choice, qmat_scene *scene, qmat_value **mesh,
                             json_t *report) {
  qmat_gltf_asset asset = {0};
  qmat_gltf_meshes meshes = {0};
  json_t *warnings = json_array();
  const bool merged = strcmp(choice, "merged") == 0;
  qmat_status status = warnings ? QMAT_OK : qmat_fail_memory(context, "the report");
  if (status == QMAT_OK) status = qmat_gltf_asset_init(context, bytes->data, bytes->size, path, &asset);
  if (status == QMAT_OK && merged) {
    status = read_whole(context, format, path, bytes, options, mesh, report);
  } else if (status == QMAT_OK) {
    status = qmat_gltf_parse_meshes(context, bytes->data, bytes->size, path, asset.root, choice, &meshes, report);
    const separate_meshes from = {.count = meshes.count, .ids = meshes.ids, .soups = meshes.soups, .root = asset.root};
    if (status == QMAT_OK) status = make_meshes(context, path, &from, options, mesh, report);
    if (status == QMAT_OK) status = warn_of_extras(context, asset.root, &meshes, warnings);
    if (status == QMAT_OK) {
      scene->mesh_count = meshes.count;
      scene->meshes = meshes.ids;
      meshes.ids = NULL;
    }
  }
  if (status == QMAT_OK) status = qmat_gltf_keep(context, asset.root, bytes->data, bytes->size, path, scene, warnings);
  if (status == QMAT_OK && json_array_size(warnings) > 0) {
    json_t *before = json_object_get(report, "warnings"); /* of the reader */
    if ((before ? json_array_extend(before, warnings) : json_object_set(report, "warnings", warnings)) != 0)
      status = qmat_fail_memory(context, "the report");
  }
  json_decref(warnings);
  qmat_gltf_meshes_uninit(&meshes);
  qmat_gltf_asset_uninit(&asset);
  return status;
}

static qmat_status read_usd(qmat_context *context, const char *path, const qmat_bytes *bytes,
                            const qmat_read_options *options, const char *choice, qmat_scene *scene, qmat_value **mesh,
                            json_t *report) {
  qmat_usd_meshes meshes;
  qmat_status status = qmat_usd_read_meshes(context, bytes, path, choice, options->segments, scene, &meshes, report);
  const double unit = unit_of_usd(report);
  for (size_t k = 0; k < scene->placement_count && status == QMAT_OK; k++) {
    qmat_soup *soup = &meshes.soups[scene->placed[k]];
    const double stretch = qmat_rounded_stretch(qmat_largest_stretch(scene->placements + 16 * k));
    soup->meters_per_unit = fmax(soup->meters_per_unit, unit * stretch);
  }
  for (size_t i = 0; i < meshes.count && status == QMAT_OK; i++) { /* merged, or flattened by what places them */
    const double found = meshes.soups[i].meters_per_unit;
    if (!(found > 0) || !isfinite(found)) meshes.soups[i].meters_per_unit = unit;
  }
  const separate_meshes from = {
      .count = meshes.count, .ids = meshes.ids, .soups = meshes.soups, .names = meshes.names, .uses = meshes.uses};
  if (status == QMAT_OK) status = make_meshes(context, path, &from, options, mesh, report);
  qmat_usd_meshes_uninit(&meshes);
  return status;
}

qmat_status qmat_model_read_meshes(qmat_context *context, const char *path, const qmat_read_options *options,
                                   const char *choice, qmat_scene **scene, qmat_value **mesh, qmat_report **report) {
  *scene = NULL;
  *mesh = NULL;
  *report = NULL;
  qmat_scene *made_scene = NULL;
  qmat_value *made_mesh = NULL;
  qmat_report *made_report = NULL;
  qmat_bytes bytes = {0};
  qmat_format format = QMAT_FORMAT_UNKNOWN;
  qmat_status status = qmat_bytes_read_file(context, path, &bytes);
  if (status == QMAT_OK) status = qmat_format_choose(context, path, &bytes, &format);
  if (status != QMAT_OK) goto done;

  made_scene = make_scene(path, format);
  made_report = qmat_report_new();
  if (!made_scene || !made_report ||
      json_object_set_new(made_report->root, "format", json_string(formats[format].name)) != 0) {
    status = qmat_fail_memory(context, "the report");
    goto done;
  }
  if (options->meters_per_unit > 0 && states_unit(format)) {
    qmat_fail(context, QMAT_ERROR_USAGE, "%s states its unit of length itself", formats[format].title);
    qmat_fail_at(context, path, 0, 0);
    status = qmat_fail_field(context, "unit");
  } else if (format == QMAT_FORMAT_GLTF || format == QMAT_FORMAT_GLB) {
    status = read_gltf(context, format, path, &bytes, options, choice, made_scene, &made_mesh, made_report->root);
  } else if (format == QMAT_FORMAT_USD) {
    status = read_usd(context, path, &bytes, options, choice, made_scene, &made_mesh, made_report->root);
  } else if (strcmp(choice, "all") != 0 && strcmp(choice, "merged") != 0) {
    qmat_fail(context, QMAT_ERROR_USAGE, "only glTF and USD have a choice of meshes; %s is read as a whole",
              formats[format].title);
    qmat_fail_at(context, path, 0, 0);
    status = qmat_fail_field(context, "mesh");
  } else {
    status = read_whole(context, format, path, &bytes, options, &made_mesh, made_report->root);
  }
  if (status == QMAT_OK) set_units(made_scene, format, made_report->root, options->meters_per_unit);
  if (status == QMAT_OK) status = qmat_value_seal(context, &made_scene->base);
  if (status == QMAT_OK) status = qmat_value_seal(context, &made_report->base);

done:
  qmat_bytes_uninit(&bytes);
  if (status == QMAT_OK) {
    *scene = made_scene;
    *mesh = made_mesh;
    *report = made_report;
    return QMAT_OK;
  }
  if (made_scene) qmat_value_release(&made_scene->base);
  qmat_value_release(made_mesh);
  if (made_report) qmat_value_release(&made_report->base);
  return status;
}

qmat_status qmat_model_read(qmat_context *context, const char *path, const qmat_read_options *options,
                            qmat_scene **scene, qmat_mesh **mesh, qmat_report **report) {
  qmat_value *made = NULL;
  const qmat_status status = qmat_model_read_meshes(context, path, options, "merged", scene, &made, report);
  *mesh = (qmat_mesh *)made;
  return status;
}
