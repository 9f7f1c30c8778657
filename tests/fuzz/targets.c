/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every reader of bytes that may come from strangers: one line in the table at the end. */
#include "tests/fuzz/targets.h"

#include <sys/stat.h>

#include "core/value_form.h"
#include "graphs/cache/cache.h"
#include "graphs/cache/cache_key.h"
#include "graphs/graph_file.h"
#include "io/base64.h"
#include "io/draco.h"
#include "io/extract.h"
#include "io/flat_medial.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_meshopt.h"
#include "io/gltf/gltf_write.h"
#include "io/mesh/ma.h"
#include "io/mesh/mesh_formats.h"
#include "io/model.h"
#include "io/usd/usd_medial.h"
#include "io/usd/usd_model.h"
#include "io/usd/usd_scene.h"
#include "io/usd/usd_write.h"
#include "nodes/nodes.h"
#include "tests/io/files.h" /* brings cmocka.h, which the headers below need */

#include "tests/graphs/test_nodes.h"
#include "tests/io/medial_examples.h"
#include "tests/io/usd/crate_writer.h"
#include "tests/io/usd/usd_examples.h"
#include "tests/io/usd/usd_layers.h"

/* A block may take 32 MiB, and 512 bytes for each byte of the input. */
#define FREE_BYTES ((size_t)1 << 25)
#define BYTES_PER_BYTE 512

static size_t largest_request;

void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size) {
  if (size > largest_request) largest_request = size;
  return __real_aligned_alloc(alignment, size);
}

#define require(holds)                                                      \
  do {                                                                      \
    if (!(holds)) {                                                         \
      fprintf(stderr, "%s:%d: violated: %s\n", __FILE__, __LINE__, #holds); \
      abort();                                                              \
    }                                                                       \
  } while (0)

/* A reader succeeds or explains itself; an internal error is a defect. */
static void require_explained(const qmat_context *context, qmat_status status) {
  if (status == QMAT_OK) return;
  require(context->error.status == status && status != QMAT_ERROR_INTERNAL);
  require(context->error.message[0] != '\0');
}

/* The node table that graphs/ is linked with: the small nodes of the tests of graphs. */
const qmat_node *const qmat_nodes[] = {&test_add};
const size_t qmat_node_count = sizeof qmat_nodes / sizeof qmat_nodes[0];

/* ---- surfaces and medial meshes ---- */

static void read_surface(read_function *reader, const uint8_t *content, size_t size) {
  qmat_context context = {0};
  qmat_soup soup = {0};
  qmat_bytes bytes = memory_file(content, size);
  const qmat_status status = reader(&context, &bytes, "file", &soup);
  require_explained(&context, status);
  for (int drop = 0; drop < 2 && status == QMAT_OK; drop++) {
    const qmat_read_options options = {.defects = drop ? QMAT_DEFECTS_DROP : QMAT_DEFECTS_REFUSE};
    qmat_mesh *mesh = NULL;
    const qmat_status made = qmat_soup_to_mesh(&context, &soup, "file", &options, &mesh, NULL);
    require_explained(&context, made);
    require((made == QMAT_OK) == (mesh != NULL));
    if (mesh) qmat_value_release(&mesh->base);
  }
  qmat_soup_uninit(&soup);
  free(bytes.data);
  qmat_context_uninit(&context);
}

static void read_off(const uint8_t *bytes, size_t size) {
  read_surface(qmat_off_read, bytes, size);
}

static void read_obj(const uint8_t *bytes, size_t size) {
  read_surface(qmat_obj_read, bytes, size);
}

static void read_ply(const uint8_t *bytes, size_t size) {
  read_surface(qmat_ply_read, bytes, size);
}

static void read_stl(const uint8_t *bytes, size_t size) {
  read_surface(qmat_stl_read, bytes, size);
}

/* What can be read is the same after it was written and read again. */
static void read_ma(const uint8_t *content, size_t size) {
  qmat_context context = {0};
  qmat_bytes bytes = memory_file(content, size);
  qmat_medial *medial = NULL, *again = NULL;
  qmat_file *file = NULL;
  const qmat_status status = qmat_ma_read(&context, &bytes, "file", &medial);
  require_explained(&context, status);
  if (status == QMAT_OK) {
    require(qmat_ma_write(&context, medial, &file) == QMAT_OK);
    qmat_bytes written = memory_file(file->parts[0].bytes, file->parts[0].size);
    require(qmat_ma_read(&context, &written, "written", &again) == QMAT_OK);
    require(qmat_digest_equal(&medial->base.digest, &again->base.digest));
    free(written.data);
    qmat_value_release(&file->base);
    qmat_value_release(&again->base);
    qmat_value_release(&medial->base);
  }
  free(bytes.data);
  qmat_context_uninit(&context);
}

static void read_draco(const uint8_t *content, size_t size) {
  qmat_context context = {0};
  qmat_bytes bytes = memory_file(content, size);
  qmat_medial *medial = NULL;
  require_explained(&context, qmat_draco_decode_medial(&context, bytes.data, size, NULL, &medial));
  if (medial) {
    uint8_t *encoded = NULL;
    size_t encoded_size = 0;
    require_explained(&context, qmat_draco_encode_medial(&context, medial, NULL, 11, 9, &encoded, &encoded_size));
    qmat_free(encoded);
    qmat_value_release(&medial->base);
  }
  free(bytes.data);
  qmat_context_uninit(&context);
}

/* What can be decoded can be encoded again. */
static void read_flat(const uint8_t *content, size_t size) {
  qmat_context context = {0};
  qmat_bytes bytes = memory_file(content, size);
  qmat_medial *medial = NULL, *again = NULL;
  require_explained(&context, qmat_flat_decode(&context, bytes.data, size, NULL, &medial));
  for (int floats = 0; medial && floats < 2; floats++) {
    uint8_t *encoded = NULL;
    size_t encoded_size = 0;
    const qmat_status status = qmat_flat_encode(&context, medial, NULL, NULL, floats, &encoded, &encoded_size);
    require_explained(&context, status);
    if (status == QMAT_OK) {
      require(qmat_flat_decode(&context, encoded, encoded_size, NULL, &again) == QMAT_OK);
      require(again->edge_count == medial->edge_count && again->triangle_count == medial->triangle_count);
      qmat_value_release(&again->base);
    }
    qmat_free(encoded);
  }
  if (medial) qmat_value_release(&medial->base);
  free(bytes.data);
  qmat_context_uninit(&context);
}

/* The input is the mode, the filter, the stride, the count in two bytes, and the data. */
static void read_meshopt(const uint8_t *content, size_t size) {
  enum { HEAD = 5 };
  if (size < HEAD) return;
  qmat_context context = {0};
  qmat_bytes bytes = memory_file(content + HEAD, size - HEAD);
  const qmat_meshopt_view view = {.bytes = bytes.data,
                                  .size = bytes.size,
                                  .mode = (qmat_meshopt_mode)(content[0] % 3),
                                  .filter = (qmat_meshopt_filter)(content[1] % 4),
                                  .stride = content[2],
                                  .count = content[3] + 256u * content[4]};
  uint8_t *decoded = NULL;
  const qmat_status status = qmat_meshopt_decode(&context, &view, &decoded);
  require_explained(&context, status);
  require((status == QMAT_OK) == (decoded != NULL));
  qmat_free(decoded);
  free(bytes.data);
  qmat_context_uninit(&context);
}

/* ---- scenes ---- */

/* Work files of the targets that read paths; removed at exit. */
static char folder[64];

static void remove_folder(void) {
  static const char *const below[] = {"/cache/ac", "/cache/cas", "/cache/tmp", "/cache/bad", "/cache", ""};
  char path[128];
  snprintf(path, sizeof path, "%s/cache/CACHEDIR.TAG", folder);
  unlink(path);
  for (size_t i = 0; i < sizeof below / sizeof below[0]; i++) {
    snprintf(path, sizeof path, "%s%s", folder, below[i]);
    rmdir(path);
  }
}

static const char *work_folder(void) {
  if (folder[0] == '\0') {
    make_folder(folder);
    atexit(remove_folder);
  }
  return folder;
}

/* Writes the scene that was read again, with a medial mesh for each of its meshes: what is written can be opened. */
static void write_again(qmat_context *context, const qmat_scene *scene) {
  const size_t count = scene->mesh_count > 0 ? scene->mesh_count : 1;
  qmat_medial *medial = example_medial(3);
  qmat_gltf_addition *additions = qmat_calloc(count, sizeof *additions);
  require(additions);
  for (size_t i = 0; i < count; i++) {
    additions[i] = (qmat_gltf_addition){
        .medial = medial, .options = {.binary = true, .position_bits = 8, .radius_bits = 8, .name = scene->name}};
  }
  for (int draco_meshes = 0; draco_meshes < 2; draco_meshes++) {
    qmat_file *file = NULL;
    const qmat_status status = qmat_gltf_enrich(context, scene, additions, count, draco_meshes, NULL, &file);
    require_explained(context, status);
    if (status != QMAT_OK) continue;
    qmat_gltf_asset asset;
    require(qmat_gltf_asset_init(context, file->parts[0].bytes, file->parts[0].size, "written", &asset) == QMAT_OK);
    qmat_gltf_asset_uninit(&asset);
    qmat_value_release(&file->base);
  }
  qmat_free(additions);
  qmat_value_release(&medial->base);
}

/* What `qmat extract` and `qmat info` take out of a file. */
static void take_medial(const char *path) {
  qmat_context context = {0};
  qmat_medial *medial = NULL;
  json_t *facts = json_object();
  require_explained(&context, qmat_medial_extract(&context, path, NULL, &medial, facts));
  if (medial) qmat_value_release(&medial->base);
  json_decref(qmat_medial_carriers(&context, path));
  json_decref(facts);
  qmat_context_uninit(&context);
}

static void read_gltf(const uint8_t *content, size_t size) {
  static const char *const choices[] = {"all", "merged", "0"};
  char path[96];
  const bool binary = size >= 4 && memcmp(content, "glTF", 4) == 0;
  snprintf(path, sizeof path, "%s/file.%s", work_folder(), binary ? "glb" : "gltf");
  write_file(path, content, size);
  for (size_t i = 0; i < sizeof choices / sizeof choices[0]; i++) {
    qmat_context context = {0};
    const qmat_read_options options = {.defects = QMAT_DEFECTS_DROP};
    qmat_scene *scene;
    qmat_value *mesh;
    qmat_report *report;
    const qmat_status status = qmat_model_read_meshes(&context, path, &options, choices[i], &scene, &mesh, &report);
    require_explained(&context, status);
    if (status == QMAT_OK) {
      write_again(&context, scene);
      qmat_value_release(&scene->base);
      qmat_value_release(mesh);
      qmat_value_release(&report->base);
    }
    qmat_context_uninit(&context);
  }
  take_medial(path);
  unlink(path);
}

/* The extras of a node, as JSON. */
static void read_extras(const uint8_t *content, size_t size) {
  char path[96];
  qmat_writer text = {0};
  qmat_put_text(&text, "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"extras\":");
  qmat_put_bytes(&text, content, size);
  qmat_put_text(&text, "}]}");
  require(!text.failed);
  snprintf(path, sizeof path, "%s/file.gltf", work_folder());
  write_file(path, text.bytes, text.size);
  take_medial(path);
  unlink(path);
  qmat_writer_uninit(&text);
}

/* What can be decoded is the same after it was encoded and decoded again. */
static void read_base64(const uint8_t *content, size_t size) {
  qmat_context context = {0};
  uint8_t *bytes = NULL, *again = NULL;
  size_t decoded = 0, decoded_again = 0;
  qmat_bytes text = memory_file(content, size);
  const qmat_status status = qmat_base64_decode(&context, (const char *)text.data, size, &bytes, &decoded);
  require_explained(&context, status);
  if (status == QMAT_OK) {
    char *encoded = qmat_base64_encode(bytes, decoded);
    require(encoded && strlen(encoded) == size);
    require(qmat_base64_decode(&context, encoded, size, &again, &decoded_again) == QMAT_OK);
    require(decoded_again == decoded && memcmp(again, bytes, decoded) == 0);
    qmat_free(encoded);
  }
  qmat_free(bytes);
  qmat_free(again);
  free(text.data);
  qmat_context_uninit(&context);
}

/* A layer over any scene can be read. */
static void write_usd_layer(const qmat_scene *scene) {
  qmat_context context = {0};
  qmat_file *file = NULL;
  qmat_medial *medial = example_medial(3);
  qmat_usd_addition *additions = calloc(scene->mesh_count, sizeof *additions);
  require(additions);
  for (size_t i = 0; i < scene->mesh_count; i++)
    additions[i] = (qmat_usd_addition){.medial = medial, .options = {.moved = 1e-3, .prim = "/p"}};
  require(qmat_usd_write_layer(&context, scene, additions, scene->mesh_count, NULL, &file) == QMAT_OK);
  qmat_usd_layer layer = {0};
  qmat_bytes text = memory_file(file->parts[0].bytes, file->parts[0].size);
  require(read_layer(&context, &text, "layer", &layer) == QMAT_OK);
  qmat_usd_layer_uninit(&layer);
  free(text.data);
  free(additions);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* Any scene can be written as glTF, with a small mesh for each of its own that follows joint 0. */
static void write_usd_places(const qmat_scene *scene) {
  static double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, weights[] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  static uint32_t triangle[] = {0, 1, 2}, joints[12];
  const qmat_mesh mesh = {.vertex_count = 3, .triangle_count = 1, .positions = positions, .triangles = triangle};
  qmat_context context = {0};
  qmat_file *file = NULL;
  qmat_medial *medial = example_medial(3);
  qmat_gltf_addition *additions = calloc(scene->mesh_count, sizeof *additions);
  require(additions);
  for (size_t i = 0; i < scene->mesh_count; i++)
    additions[i] = (qmat_gltf_addition){.medial = medial,
                                        .skin = &mesh,
                                        .vertices = {.joints = joints, .weights = weights},
                                        .options = {.binary = true, .quantisation = 0.01, .errors = {.diagonal = 1}}};
  require(qmat_gltf_write_places(&context, scene, additions, scene->mesh_count, &file) == QMAT_OK);
  free(additions);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

/* The meshes of a scene one by one, and their places. */
static void read_usd_meshes(const qmat_bytes *bytes, const char *path) {
  qmat_context context = {0};
  qmat_usd_meshes meshes;
  json_t *report = json_object();
  qmat_scene *scene = qmat_scene_new();
  scene->name = qmat_strdup("file");
  scene->format = qmat_strdup("usd");
  const qmat_status status = qmat_usd_read_meshes(&context, bytes, path, "all", 8, scene, &meshes, report);
  require_explained(&context, status);
  if (status == QMAT_OK) {
    require(meshes.count > 0 && scene->mesh_count == meshes.count && scene->placement_count >= meshes.count);
    require(qmat_value_seal(&context, &scene->base) == QMAT_OK);
    if (scene->part_count > 0) write_usd_layer(scene);
    write_usd_places(scene);
  }
  qmat_usd_meshes_uninit(&meshes);
  qmat_value_release(&scene->base);
  json_decref(report);
  qmat_context_uninit(&context);
}

/* A text layer, a crate or a package, told apart by the first bytes. */
static void read_usd(const uint8_t *content, size_t size) {
  static const char path[] = "/no such folder/file.usd";
  qmat_context context = {0};
  qmat_usd_layer layer = {0};
  qmat_soup soup = {0};
  qmat_medial *medial = NULL;
  json_t *report = json_object(), *facts = json_object();
  qmat_bytes bytes = memory_file(content, size);
  require_explained(&context, read_layer(&context, &bytes, path, &layer));
  qmat_usd_layer_uninit(&layer);
  const qmat_status status = qmat_usd_read(&context, &bytes, path, &soup, report);
  require_explained(&context, status);
  if (status == QMAT_OK) {
    const qmat_read_options options = {.defects = QMAT_DEFECTS_DROP};
    qmat_mesh *mesh = NULL;
    require_explained(&context, qmat_soup_to_mesh(&context, &soup, path, &options, &mesh, NULL));
    if (mesh) qmat_value_release(&mesh->base);
  }
  read_usd_meshes(&bytes, path);
  require_explained(&context, qmat_usd_read_medial(&context, &bytes, path, NULL, &medial, facts));
  if (medial) qmat_value_release(&medial->base);
  qmat_soup_uninit(&soup);
  json_decref(report);
  json_decref(facts);
  free(bytes.data);
  qmat_context_uninit(&context);
}

/* The tables of a crate are packed, so damaged bytes seldom damage a number in them. Here the input is a crate's
 * version and a seed that says which numbers are wrong. */
static void read_crate_tables(const uint8_t *content, size_t size) {
  uint64_t seed = 0;
  if (size < 1 || size > 1 + sizeof seed) return;
  memcpy(&seed, content + 1, size - 1);
  static qmat_usd_layer text; /* read once */
  if (!text.root) text = good_layer(usd_example);
  qmat_writer crate = write_damaged_crate(&text, 6 + content[0] % 5, seed | 1);
  read_usd(crate.bytes, crate.size);
  qmat_writer_uninit(&crate);
}

/* ---- graphs and the cache ---- */

static void read_graph(const uint8_t *content, size_t size) {
  qmat_context context = {0};
  qmat_graph graph;
  qmat_bytes bytes = memory_file(content, size);
  const qmat_status status =
      qmat_graph_read_text(&context, &test_registry, "g.yaml", (const char *)bytes.data, size, &graph);
  require_explained(&context, status);
  if (status == QMAT_OK) {
    const qmat_status checked = qmat_graph_check_params(&context, &graph);
    require_explained(&context, checked);
  }
  qmat_graph_uninit(&graph);
  free(bytes.data);
  qmat_context_uninit(&context);
}

/* A value that can be read is written as the same bytes; the JSON of a report may be spelled in other ways. */
static void read_value(const uint8_t *content, size_t size) {
  qmat_context context = {0};
  qmat_value *value = NULL;
  qmat_bytes bytes = memory_file(content, size);
  const qmat_status status = qmat_value_deserialize(&context, bytes.data, size, NULL, &value);
  require_explained(&context, status);
  if (status == QMAT_OK) {
    uint8_t *written = NULL;
    size_t written_size = 0;
    qmat_digest digest;
    require(qmat_value_serialize(&context, value, &written, &written_size) == QMAT_OK);
    require(qmat_digest_of(written, written_size, &digest) == QMAT_OK && qmat_digest_equal(&digest, &value->digest));
    const bool same = written_size == size && memcmp(written, content, size) == 0;
    require(same || value->type == QMAT_REPORT);
    qmat_free(written);
    qmat_value_release(value);
  }
  free(bytes.data);
  qmat_context_uninit(&context);
}

/* The JSON of a record, to which the right digest is added, under the name that its items ask for. */
static void read_record(const uint8_t *content, size_t size) {
  qmat_context context = {0};
  qmat_cache cache;
  qmat_digest key = {0}, digest;
  qmat_writer text = {0};
  char path[160], hex[65];
  snprintf(path, sizeof path, "%s/cache", work_folder());
  const qmat_cache_options options = {.folder = path};
  require(qmat_cache_open(&context, &options, &cache) == QMAT_OK);
  json_t *given = json_loadb((const char *)content, size, JSON_REJECT_DUPLICATES, NULL);
  const bool keyed = qmat_key_digest(json_object_get(given, "key"), &key);
  if (keyed) {
    bool added;
    qmat_report *report = qmat_report_new(); /* makes the cache's folders */
    require(report && qmat_value_seal(&context, &report->base) == QMAT_OK);
    json_decref(qmat_cache_put_value(&cache, &report->base, &added));
    qmat_value_release(&report->base);
    require(qmat_digest_of(content, size, &digest) == QMAT_OK);
    qmat_digest_hex(&digest, hex);
    qmat_put_bytes(&text, content, size);
    qmat_put_text(&text, "\nsha256 ");
    qmat_put_text(&text, hex);
    qmat_put_text(&text, "\n");
    qmat_digest_hex(&key, hex);
    snprintf(path, sizeof path, "%s/cache/ac/%s", folder, hex);
    write_file(path, text.bytes, text.size);
    json_t *record = qmat_cache_record(&cache, &key);
    require(record && json_equal(record, given));
    size_t index;
    json_t *stored;
    json_array_foreach(json_object_get(record, "outputs"), index, stored) {
      qmat_cache_has_stored(&cache, stored);
      qmat_cache_touch_stored(&cache, stored);
      qmat_cache_stored_size(stored);
    }
    qmat_cache_entry *entries = NULL;
    size_t count = 0;
    require(qmat_cache_list(&cache, &entries, &count));
    for (size_t i = 0; i < count; i++) qmat_cache_check(&cache, &entries[i]);
    qmat_free(entries);
    json_decref(record);
    qmat_cache_clear(&cache);
  }
  json_decref(given);
  qmat_writer_uninit(&text);
  qmat_cache_close(&cache);
  qmat_context_uninit(&context);
}

/* ---- the table ---- */

const fuzz_target fuzz_targets[] = {
    {"off", read_off},         {"obj", read_obj},       {"ply", read_ply},
    {"stl", read_stl},         {"ma", read_ma},         {"gltf", read_gltf},
    {"glb", read_gltf},        {"draco", read_draco},   {"flat", read_flat},
    {"extras", read_extras},   {"base64", read_base64}, {"usda", read_usd},
    {"usdc", read_usd},        {"usdz", read_usd},      {"usdc-tables", read_crate_tables},
    {"graph", read_graph},     {"value", read_value},   {"record", read_record},
    {"meshopt", read_meshopt},
};
const size_t fuzz_target_count = sizeof fuzz_targets / sizeof fuzz_targets[0];

const fuzz_target *fuzz_target_find(const char *name) {
  for (size_t i = 0; i < fuzz_target_count; i++) {
    if (strcmp(fuzz_targets[i].name, name) == 0) return &fuzz_targets[i];
  }
  return NULL;
}

void fuzz_run(const fuzz_target *target, const uint8_t *bytes, size_t size) {
  largest_request = 0;
  target->read(bytes, size);
  if (largest_request <= FREE_BYTES + BYTES_PER_BYTE * size) return;
  fprintf(stderr, "%s: %zu bytes were allocated at once for an input of %zu\n", target->name, largest_request, size);
  abort();
}
