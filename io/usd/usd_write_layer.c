/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A layer over a USD scene that adds medial meshes to its prims. */
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/json_text.h"
#include "core/node.h"
#include "io/collider_frames.h"
#include "io/usd/usd_colliders.h"
#include "io/usd/usd_kept_scene.h"
#include "io/usd/usd_write.h"
#include "io/usd/usdc_write.h"
#include "io/usd/usdz.h"

/* A prim that carries a mesh. */
typedef struct carrier {
  const char *path;
  uint32_t mesh;
  size_t place; /* number in the scene's placements */
  qmat_usd_kept_prim kept_prim;
} carrier;

static qmat_status fail_shortage(qmat_context *context) {
  return qmat_fail_memory(context, "the output file");
}

/* Orders paths so that prims come right before those below them: the slash is the smallest character. */
static int compare_carriers(const void *a, const void *b) {
  const carrier *x = a, *y = b;
  const unsigned char *p = (const unsigned char *)x->path, *q = (const unsigned char *)y->path;
  while (*p && *p == *q) p++, q++;
  const int first = *p == '/' ? 1 : *p, second = *q == '/' ? 1 : *q;
  if (first != second) return first - second;
  return (x->mesh > y->mesh) - (x->mesh < y->mesh);
}

/* The number of names that two paths begin with. */
static size_t common_names(const char *a, const char *b) {
  size_t count = 0;
  for (size_t i = 0;; i++) {
    const bool a_ends = a[i] == '/' || a[i] == '\0', b_ends = b[i] == '/' || b[i] == '\0';
    if (a_ends && b_ends && i > 0) count++;
    if (a[i] != b[i] || a[i] == '\0') return count;
  }
}

static size_t count_names(const char *path) {
  size_t count = 0;
  for (; *path; path++) count += *path == '/';
  return count;
}

/* Opens the prims of a path behind its first `open` names. The last one becomes a rigid body where `is_body`. */
static void open_prims(qmat_writer *writer, const char *path, size_t open, bool has_instances, bool is_body) {
  size_t depth = 0;
  while (*path) {
    const size_t length = strcspn(++path, "/");
    if (depth >= open) {
      const bool makes_body = is_body && path[length] == '\0';
      qmat_put_indent(writer, depth);
      qmat_put_text(writer, "over \"");
      qmat_put_bytes(writer, path, length);
      qmat_put_text(writer, has_instances || makes_body ? "\" (\n" : "\"\n");
      if (has_instances) {
        qmat_put_indent(writer, depth + 1);
        qmat_put_text(writer, "instanceable = false\n");
      }
      if (makes_body) qmat_usd_put_body_schemas(writer, depth + 1);
      if (has_instances || makes_body) {
        qmat_put_indent(writer, depth);
        qmat_put_text(writer, ")\n");
      }
      qmat_put_indent(writer, depth);
      qmat_put_text(writer, "{\n");
    }
    path += length;
    depth++;
  }
}

/* The attributes of a body at a place, in the scene's units. */
static void put_body(qmat_writer *writer, size_t depth, const qmat_scene *scene, size_t place,
                     const qmat_usd_options *options, double kilograms, bool is_kinematic) {
  static const double origin[3] = {0, 0, 0};
  const double *m = scene->placements + 16 * place;
  double linear[3][3], rotation[3][3], body[10];
  if (options->colliders->body_count == 0) return;
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) linear[r][c] = m[4 * c + r];
  const double unit = scene->meters_per_unit > 0 ? scene->meters_per_unit : 1;
  qmat_rotation_in(linear, rotation);
  qmat_placed_body(options->colliders->body, linear, rotation, options->errors.meters_per_unit / unit, body);
  qmat_usd_put_body(writer, depth, body, origin, kilograms, is_kinematic);
}

/* Whether text can name a prim that a crate calls so. The name ends at a slash. */
static bool is_valid_name(const char *name) {
  const size_t length = strcspn(name, "/");
  for (size_t i = 0; i < length; i++) {
    const char c = name[i];
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    if (!plain && !(c & 0x80)) return false;
  }
  return length > 0;
}

/* The same of all names in a path. */
static bool has_valid_names(const char *path) {
  for (; *path == '/'; path += strcspn(path, "/"))
    if (!is_valid_name(++path)) return false;
  return *path == '\0';
}

/* What the names of the prims begin with that are added, before the number of the mesh. */
enum { LONGEST_STEM = 31, MOST_VARIANTS_NAMED = 3 };

/* Chooses the stem, so that no prim of the original gets opinions that are meant for another. */
static void choose_stem(const qmat_usd_kept_scene *kept, char stem[LONGEST_STEM + 1]) {
  snprintf(stem, LONGEST_STEM + 1, "medial_");
  for (unsigned i = 2; qmat_usd_kept_scene_has_stem(kept, stem) && i < 1000; i++)
    snprintf(stem, LONGEST_STEM + 1, "medial%u_", i);
}

/* Writes a prim that has only metadata. */
static void put_empty_prim(qmat_writer *writer, size_t depth, const char *kind, const char *name,
                           const char *metadata) {
  qmat_put_indent(writer, depth);
  qmat_put_text(writer, kind);
  qmat_put_text(writer, " \"");
  qmat_put_text(writer, name);
  qmat_put_text(writer, "\" (\n");
  qmat_put_indent(writer, depth + 1);
  qmat_put_text(writer, metadata);
  qmat_put_text(writer, "\n");
  qmat_put_indent(writer, depth);
  qmat_put_text(writer, ")\n");
  qmat_put_indent(writer, depth);
  qmat_put_text(writer, "{\n");
  qmat_put_indent(writer, depth);
  qmat_put_text(writer, "}\n");
}

/* Hides the medial meshes that a prim has already: of a scene that was flattened after an earlier run, or that refers
 * to a layer of one. */
static void hide_earlier(qmat_writer *writer, size_t depth, const qmat_usd_kept_prim *kept_prim) {
  for (size_t i = 0; i < kept_prim->medial_count; i++)
    if (is_valid_name(kept_prim->medials[i]))
      put_empty_prim(writer, depth, "over", kept_prim->medials[i], "active = false");
}

static void put_reference(qmat_writer *writer, size_t depth, const char *stem, uint32_t mesh) {
  char name[LONGEST_STEM + 16], reference[sizeof name + 32];
  snprintf(name, sizeof name, "%s%u", stem, mesh);
  snprintf(reference, sizeof reference, "prepend references = </%s>", name);
  put_empty_prim(writer, depth, "def Xform", name, reference);
}

/* The prims that carry a mesh with a medial mesh, each once, in the order in which they are written. */
typedef struct carriers {
  size_t count;
  carrier *items;
} carriers;

static qmat_status list_carriers(qmat_context *context, const qmat_scene *scene, const qmat_usd_addition *additions,
                                 carriers *list) {
  list->items = qmat_alloc(scene->placement_count, sizeof *list->items);
  if (!list->items) return fail_shortage(context);
  size_t count = 0;
  for (size_t i = 0; i < scene->placement_count; i++)
    if (additions[scene->placed[i]].medial && has_valid_names(scene->placement_paths[i]))
      list->items[count++] = (carrier){.path = scene->placement_paths[i], .mesh = scene->placed[i], .place = i};
  if (count > 0) qsort(list->items, count, sizeof *list->items, compare_carriers);
  for (size_t i = 0; i < count; i++) /* a prototype has several instances */
    if (i == 0 || strcmp(list->items[i].path, list->items[list->count - 1].path) != 0)
      list->items[list->count++] = list->items[i];
  return QMAT_OK;
}

/* The path is UTF-8, since text can have its names. */
static int warn_of_variant(json_t *report, const char *path, const qmat_usd_spec *variant) {
  return qmat_json_add_warning(report,
                               "%s: its shape is that of the variant '%s' of '%s', but the medial mesh stays when "
                               "another variant is selected: run qmat again for each",
                               path, qmat_usd_shown(variant->name), qmat_usd_shown(variant->parent->name));
}

/* Finds what the scene says of the carriers. */
static qmat_status find_kept_prims(qmat_context *context, qmat_usd_kept_scene *kept, carriers *list, json_t *report) {
  qmat_status status = QMAT_OK;
  size_t variants = 0;
  bool failed = false;
  for (size_t i = 0; i < list->count && status == QMAT_OK; i++) {
    carrier *at = &list->items[i];
    status = qmat_usd_kept_scene_find(kept, at->path, &at->kept_prim);
    if (status != QMAT_OK || !at->kept_prim.variant || !report) continue;
    if (variants++ < MOST_VARIANTS_NAMED)
      failed = failed || warn_of_variant(report, at->path, at->kept_prim.variant) != 0;
  }
  if (status == QMAT_OK && variants > MOST_VARIANTS_NAMED)
    failed = failed || qmat_json_add_warning(report, "and %zu more prims have the shape of a variant",
                                             variants - MOST_VARIANTS_NAMED) != 0;
  return failed ? fail_shortage(context) : status;
}

/* Writes the prims that carry a mesh with a medial mesh. */
static void put_overs(const qmat_scene *scene, const qmat_usd_addition *additions, const carriers *list,
                      const qmat_usd_layer *original, const char *stem, qmat_writer *writer) {
  const double kilograms = qmat_usd_number(qmat_usd_field_value(original->root, "kilogramsPerUnit"), 1);
  size_t open = 0;
  size_t body = SIZE_MAX; /* the depth of the open prim that is a body: one below is a part of it */
  for (size_t i = 0; i < list->count; i++) {
    const carrier *at = &list->items[i];
    const size_t shared = i > 0 ? common_names(at->path, list->items[i - 1].path) : 0;
    while (open > shared) {
      qmat_put_indent(writer, --open);
      qmat_put_text(writer, "}\n");
    }
    if (body >= open) body = SIZE_MAX;
    const qmat_usd_options *options = &additions[at->mesh].options;
    const bool is_body =
        options->colliders && options->dynamic && body == SIZE_MAX && !scene->placement_bodies[at->place];
    open_prims(writer, at->path, open, scene->has_instances, is_body);
    open = count_names(at->path);
    if (is_body) {
      body = open - 1;
      put_body(writer, open, scene, at->place, options, kilograms > 0 ? kilograms : 1, at->kept_prim.is_animated);
    }
    hide_earlier(writer, open, &at->kept_prim);
    put_reference(writer, open, stem, scene->meshes[at->mesh]);
  }
  while (open > 0) {
    qmat_put_indent(writer, --open);
    qmat_put_text(writer, "}\n");
  }
}

/* ---- the layer's metadata ---- */

static void put_number_field(qmat_writer *writer, const qmat_usd_spec *root, const char *name) {
  const double value = qmat_usd_number(qmat_usd_field_value(root, name), NAN);
  if (!isfinite(value)) return;
  qmat_put_text(writer, "    ");
  qmat_put_text(writer, name);
  qmat_put_text(writer, " = ");
  qmat_put_number(writer, value);
  qmat_put_text(writer, "\n");
}

/* Whether a text needs no escapes. */
static bool is_plain(const char *text) {
  for (; *text; text++)
    if ((unsigned char)*text < ' ' || *text == '"' || *text == '\\' || *text == 127) return false;
  return true;
}

static void put_metadata(qmat_writer *writer, const qmat_usd_spec *root, bool is_z_up, const char *sublayer) {
  static const char *const numbers[] = {"endTimeCode",   "framesPerSecond", "kilogramsPerUnit",
                                        "metersPerUnit", "startTimeCode",   "timeCodesPerSecond"};
  const char *prim = qmat_usd_text(qmat_usd_field_value(root, "defaultPrim"));
  qmat_put_text(writer, "#usda 1.0\n(\n");
  if (is_plain(sublayer)) { /* by this a later run knows that the side file is this layer's */
    qmat_put_text(writer, "    customLayerData = {\n        string qmat_original = \"");
    qmat_put_text(writer, sublayer);
    qmat_put_text(writer, "\"\n    }\n");
  }
  if (prim && is_plain(prim)) {
    qmat_put_text(writer, "    defaultPrim = \"");
    qmat_put_text(writer, prim);
    qmat_put_text(writer, "\"\n");
  }
  qmat_put_text(writer, "    doc = \"qmat " QMAT_VERSION "\"\n");
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) put_number_field(writer, root, numbers[i]);
  const char *quote = strchr(sublayer, '@') ? "@@@" : "@";
  qmat_put_text(writer, "    subLayers = [\n        ");
  qmat_put_text(writer, quote);
  qmat_put_text(writer, sublayer);
  qmat_put_text(writer, quote);
  qmat_put_text(writer, is_z_up ? "\n    ]\n    upAxis = \"Z\"\n)\n\n" : "\n    ]\n    upAxis = \"Y\"\n)\n\n");
}

/* ---- the file ---- */

static const char *ending_of(const qmat_file_part *part) {
  if (qmat_usdz_is_package(part->bytes, part->size)) return "usdz";
  return part->size >= 8 && memcmp(part->bytes, "PXR-USDC", 8) == 0 ? "usdc" : "usda";
}

static qmat_status put_text(qmat_context *context, const qmat_scene *scene, const qmat_usd_addition *additions,
                            size_t count, const qmat_usd_kept_scene *kept, const carriers *list, const char *sublayer,
                            qmat_writer *text) {
  const qmat_usd_layer *original = qmat_usd_stage_root_layer(kept->stage);
  qmat_status status = QMAT_OK;
  char stem[LONGEST_STEM + 1];
  const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
  if (plain == (locale_t)0) return fail_shortage(context);
  const locale_t before = uselocale(plain);
  put_metadata(text, original->root, scene->is_z_up, sublayer);
  choose_stem(kept, stem);
  for (size_t i = 0; i < count && status == QMAT_OK; i++) {
    char prim[LONGEST_STEM + 16];
    if (!additions[i].medial) continue;
    snprintf(prim, sizeof prim, "%s%u", stem, scene->meshes[i]);
    status = qmat_usd_put_class(context, additions[i].medial, additions[i].skin, &additions[i].options, prim, text);
    qmat_put_text(text, "\n");
  }
  if (status == QMAT_OK) put_overs(scene, additions, list, original, stem, text);
  uselocale(before);
  freelocale(plain);
  return status;
}

/* The name of the first member of the original, which is its root layer; "" for a file that is no package. */
static qmat_status open_original(qmat_context *context, const qmat_file_part *part, const char *ending,
                                 qmat_usdz *package) {
  const qmat_bytes bytes = {.data = part->bytes, .size = part->size};
  *package = (qmat_usdz){0};
  return strcmp(ending, "usdz") == 0 ? qmat_usdz_open(context, &bytes, "the scene", package) : QMAT_OK;
}

static qmat_status make_package(qmat_context *context, const qmat_usdz *original, const qmat_file_part *part,
                                const char *sublayer, const qmat_writer *text, qmat_file **file) {
  qmat_writer out = {0};
  qmat_usdz_writer archive = {.out = &out};
  qmat_status status = QMAT_OK;
  qmat_usdz_add(&archive, "medial.usda", text->bytes, text->size);
  if (original->member_count == 0) qmat_usdz_add(&archive, sublayer, part->bytes, part->size);
  for (size_t i = 0; i < original->member_count && status == QMAT_OK; i++) {
    const qmat_usdz_member *member = &original->members[i];
    const size_t size = strlen(member->name) + sizeof "original/";
    char *name = qmat_alloc(size, 1);
    if (!name) status = fail_shortage(context);
    if (name) snprintf(name, size, "original/%s", member->name);
    if (name) qmat_usdz_add(&archive, name, member->bytes, member->size);
    qmat_free(name);
  }
  qmat_usdz_finish(&archive);
  if (status == QMAT_OK) return qmat_writer_to_file(context, &out, "usdz", file);
  qmat_writer_uninit(&out);
  return status;
}

/* A layer beside its original. */
static qmat_status make_pair(qmat_context *context, const qmat_file_part *part, const char *name, const char *format,
                             qmat_writer *layer, qmat_file **file) {
  qmat_file *made = qmat_file_new();
  if (made) {
    made->format = qmat_strdup(format);
    made->parts = qmat_calloc(2, sizeof *made->parts);
    if (made->parts) made->part_count = 2;
  }
  qmat_status status = made && made->format && made->parts ? QMAT_OK : fail_shortage(context);
  if (status == QMAT_OK) status = qmat_writer_to_part(context, layer, made, 0, "");
  if (status == QMAT_OK) {
    made->parts[1] =
        (qmat_file_part){.name = qmat_strdup(name), .size = part->size, .bytes = qmat_alloc(part->size, 1)};
    if (made->parts[1].bytes) memcpy(made->parts[1].bytes, part->bytes, part->size);
    status =
        made->parts[1].name && made->parts[1].bytes ? qmat_value_seal(context, &made->base) : fail_shortage(context);
  }
  if (status == QMAT_OK)
    *file = made;
  else if (made)
    qmat_value_release(&made->base);
  return status;
}

qmat_status qmat_usd_write_layer(qmat_context *context, const qmat_scene *scene, const qmat_usd_addition *additions,
                                 size_t count, json_t *report, qmat_file **file) {
  const qmat_file_part *part = &scene->parts[0];
  const char *ending = ending_of(part);
  const qmat_usd_form form = additions[0].options.form;
  const bool in_package = form == QMAT_USD_PACKAGE;
  char sublayer[512];
  qmat_usd_kept_scene kept = {0};
  carriers list = {0};
  qmat_usdz original = {0};
  qmat_writer text = {0};
  *file = NULL;
  qmat_status status = open_original(context, part, ending, &original);
  if (status == QMAT_OK) status = qmat_usd_kept_scene_open(context, part, &kept);
  if (status == QMAT_OK) status = list_carriers(context, scene, additions, &list);
  if (status == QMAT_OK) status = find_kept_prims(context, &kept, &list, report);
  if (status == QMAT_OK) {
    if (in_package && original.member_count > 0)
      snprintf(sublayer, sizeof sublayer, "original/%s", original.members[0].name);
    else
      snprintf(sublayer, sizeof sublayer, in_package ? "original/scene.%s" : "original.%s", ending);
    status = put_text(context, scene, additions, count, &kept, &list, sublayer, &text);
  }
  if (status == QMAT_OK && text.failed) status = fail_shortage(context);
  if (status == QMAT_OK && form == QMAT_USD_CRATE) status = qmat_usdc_of_text(context, &text);
  if (status == QMAT_OK)
    status = in_package ? make_package(context, &original, part, sublayer, &text, file)
                        : make_pair(context, part, sublayer, form == QMAT_USD_CRATE ? "usdc" : "usda", &text, file);
  qmat_writer_uninit(&text);
  qmat_usdz_uninit(&original);
  qmat_free(list.items);
  qmat_usd_kept_scene_close(&kept);
  return status;
}
