/* SPDX-License-Identifier: GPL-3.0-or-later */
/* EXT_meshopt_compression: data that libmeshoptimizer's encoders made are read, damaged ones refused, and assets with
 * them come out as they were. */
#include <math.h>
#include <meshoptimizer.h>

#include "tests/io/files.h"

#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_meshopt.h"
#include "io/gltf/gltf_write.h"
#include "io/model.h"
#include "io/save.h"
#include "tests/io/gltf/gltf_assets.h"
#include "tests/io/medial_examples.h"

#define ASSETS "../shared/data/assets/"

/* A wavy sheet: more vertices than one block of the codec. */
enum { SIDE = 20, VERTICES = SIDE * SIDE, TRIANGLES = 2 * (SIDE - 1) * (SIDE - 1) };

static float sheet[3 * VERTICES];
static uint32_t sheet_corners[3 * TRIANGLES];

static int make_sheet(void **state) {
  (void)state;
  uint32_t *corner = sheet_corners;
  for (uint32_t i = 0; i < VERTICES; i++) {
    const uint32_t x = i % SIDE, y = i / SIDE;
    sheet[3 * i] = (float)x / 16;
    sheet[3 * i + 1] = (float)y / 16;
    sheet[3 * i + 2] = (float)((x * x + 3 * y) % 11) / 64;
    if (x + 1 == SIDE || y + 1 == SIDE) continue;
    const uint32_t square[6] = {i, i + 1, i + SIDE + 1, i, i + SIDE + 1, i + SIDE};
    for (int k = 0; k < 6; k++) *corner++ = square[k];
  }
  return 0;
}

/* ---- the codec ---- */

typedef struct packed {
  qmat_meshopt_view view;
  uint8_t *bytes;
} packed;

static packed pack(qmat_meshopt_mode mode, qmat_meshopt_filter filter, const void *data, size_t count, size_t stride) {
  const size_t bound = mode == QMAT_MESHOPT_ATTRIBUTES  ? meshopt_encodeVertexBufferBound(count, stride)
                       : mode == QMAT_MESHOPT_TRIANGLES ? meshopt_encodeIndexBufferBound(count, VERTICES)
                                                        : meshopt_encodeIndexSequenceBound(count, VERTICES);
  packed p = {.bytes = malloc(bound)};
  assert_non_null(p.bytes);
  meshopt_encodeIndexVersion(1);
  size_t size = 0;
  if (mode == QMAT_MESHOPT_ATTRIBUTES) size = meshopt_encodeVertexBuffer(p.bytes, bound, data, count, stride);
  if (mode == QMAT_MESHOPT_TRIANGLES) size = meshopt_encodeIndexBuffer(p.bytes, bound, data, count);
  if (mode == QMAT_MESHOPT_INDICES) size = meshopt_encodeIndexSequence(p.bytes, bound, data, count);
  assert_true(size > 0);
  p.view = (qmat_meshopt_view){p.bytes, size, mode, filter, count, stride};
  return p;
}

static void *unpack(const packed *p) {
  qmat_context context = {0};
  uint8_t *decoded;
  const qmat_status status = qmat_meshopt_decode(&context, &p->view, &decoded);
  if (status != QMAT_OK) fail_msg("%s", context.error.message);
  return decoded;
}

static void test_attributes_come_back_bit_by_bit(void **state) {
  (void)state;
  static const size_t strides[] = {4, 12, 60, 256};
  for (size_t s = 0; s < 4; s++) {
    const size_t count = sizeof sheet / strides[s];
    packed p = pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_NONE, sheet, count, strides[s]);
    void *decoded = unpack(&p);
    assert_memory_equal(decoded, sheet, count * strides[s]);
    qmat_free(decoded);
    free(p.bytes);
  }
}

static void test_indices_come_back_in_16_and_32_bits(void **state) {
  (void)state;
  for (int mode = QMAT_MESHOPT_TRIANGLES; mode <= QMAT_MESHOPT_INDICES; mode++) {
    packed p = pack((qmat_meshopt_mode)mode, QMAT_MESHOPT_NONE, sheet_corners, 3 * TRIANGLES, 4);
    uint32_t *wide = unpack(&p);
    p.view.stride = 2;
    uint16_t *narrow = unpack(&p);
    for (size_t i = 0; i < 3 * TRIANGLES; i += 3) {
      /* A triangle may begin at another corner. */
      size_t turn = 0;
      while (turn < 2 && wide[i + turn] != sheet_corners[i]) turn++;
      for (size_t k = 0; k < 3; k++) {
        assert_int_equal(wide[i + (k + turn) % 3], sheet_corners[i + k]);
        assert_int_equal(narrow[i + k], wide[i + k]);
      }
    }
    qmat_free(wide);
    qmat_free(narrow);
    free(p.bytes);
  }
}

static void test_filters_undo_what_their_encoders_do(void **state) {
  (void)state;
  enum { COUNT = 300 };
  float units[4 * COUNT], floats[4 * COUNT];
  for (size_t i = 0; i < COUNT; i++) {
    double v[4], length = 0;
    for (size_t k = 0; k < 4; k++) v[k] = sin((double)(4 * i + k) * 1.7) + 0.01;
    for (size_t k = 0; k < 4; k++) length += v[k] * v[k];
    for (size_t k = 0; k < 4; k++) units[4 * i + k] = (float)(v[k] / sqrt(length));
  }
  uint8_t filtered[16 * COUNT];
  /* Unit vectors in 8 and 16 bits; the fourth component stays as it is. */
  for (size_t i = 0; i < COUNT; i++) {
    const float *u = &units[4 * i];
    const float length = sqrtf(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    for (size_t k = 0; k < 3; k++) floats[4 * i + k] = u[k] / length;
    floats[4 * i + 3] = 1;
  }
  for (size_t stride = 4; stride <= 8; stride += 4) {
    const int bits = stride == 4 ? 8 : 12;
    meshopt_encodeFilterOct(filtered, COUNT, stride, bits, floats);
    packed p = pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_OCTAHEDRAL, filtered, COUNT, stride);
    uint8_t *decoded = unpack(&p);
    for (size_t i = 0; i < 4 * COUNT; i++) {
      int16_t wide;
      memcpy(&wide, decoded + (stride == 8 ? 2 * i : 0), 2);
      const double value = stride == 4 ? (double)((int8_t *)decoded)[i] / 127 : (double)wide / 32767;
      assert_true(fabs(value - (double)floats[i]) < (stride == 4 ? 0.03 : 0.002));
    }
    qmat_free(decoded);
    free(p.bytes);
  }
  /* Quaternions, of which q and -q are the same rotation. */
  meshopt_encodeFilterQuat(filtered, COUNT, 8, 16, units);
  packed p = pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_QUATERNION, filtered, COUNT, 8);
  int16_t *quaternions = unpack(&p);
  for (size_t i = 0; i < COUNT; i++) {
    double dot = 0;
    for (size_t k = 0; k < 4; k++) dot += quaternions[4 * i + k] / 32767.0 * (double)units[4 * i + k];
    assert_true(fabs(fabs(dot) - 1) < 1e-3);
  }
  qmat_free(quaternions);
  free(p.bytes);
  /* Floats with 24 bits of mantissa. */
  meshopt_encodeFilterExp(filtered, COUNT, 12, 24, units);
  p = pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_EXPONENTIAL, filtered, COUNT, 12);
  float *decoded = unpack(&p);
  for (size_t i = 0; i < 3 * COUNT; i++) assert_true(fabsf(decoded[i] - units[i]) < 1e-6F);
  qmat_free(decoded);
  free(p.bytes);
}

static void assert_not_decoded(const qmat_meshopt_view *view, const char *message) {
  qmat_context context = {0};
  uint8_t *decoded;
  assert_int_equal(qmat_meshopt_decode(&context, view, &decoded), QMAT_ERROR_FORMAT);
  assert_null(decoded);
  if (!strstr(context.error.message, message)) fail_msg("\"%s\" is not in: %s", message, context.error.message);
}

static void test_what_the_format_does_not_allow_is_refused(void **state) {
  (void)state;
  packed p = pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_NONE, sheet, VERTICES, 12);
  qmat_meshopt_view view = p.view;
  view.stride = 0;
  assert_not_decoded(&view, "elements of 0 bytes are not allowed with mode ATTRIBUTES");
  view.stride = 6;
  assert_not_decoded(&view, "elements of 6 bytes");
  view.stride = 260;
  assert_not_decoded(&view, "elements of 260 bytes");
  view.stride = 12;
  view.filter = QMAT_MESHOPT_OCTAHEDRAL;
  assert_not_decoded(&view, "filter is not for elements of 12 bytes");
  view.filter = QMAT_MESHOPT_QUATERNION;
  assert_not_decoded(&view, "filter is not for elements of 12 bytes");
  view.filter = QMAT_MESHOPT_NONE;
  view.count = VERTICES + 300;
  assert_not_decoded(&view, "damaged, or not of mode ATTRIBUTES");
  view.count = UINT32_MAX;
  assert_not_decoded(&view, "cannot hold 4294967295 elements of 12 bytes");
  view = p.view;
  view.mode = QMAT_MESHOPT_TRIANGLES;
  assert_not_decoded(&view, "elements of 12 bytes are not allowed with mode TRIANGLES");
  view.stride = 2;
  assert_not_decoded(&view, "400 indices are not whole triangles");
  view.count = 399;
  assert_not_decoded(&view, "damaged, or not of mode TRIANGLES");
  view.filter = QMAT_MESHOPT_EXPONENTIAL;
  assert_not_decoded(&view, "mode TRIANGLES allows no filter");
  view.filter = QMAT_MESHOPT_NONE;
  view.mode = QMAT_MESHOPT_INDICES;
  assert_not_decoded(&view, "damaged, or not of mode INDICES");
  free(p.bytes);
}

/* The reader gets a copy of the right size, so that a sanitizer sees what is read past its end. */
static qmat_status try_decode(const packed *p, const uint8_t *bytes, size_t size) {
  qmat_context context = {0};
  qmat_meshopt_view view = p->view;
  uint8_t *copy = malloc(size + !size), *decoded;
  assert_non_null(copy);
  memcpy(copy, bytes, size);
  view.bytes = copy;
  view.size = size;
  const qmat_status status = qmat_meshopt_decode(&context, &view, &decoded);
  qmat_free(decoded);
  free(copy);
  return status;
}

static void test_truncated_data_are_refused_and_noise_is_survived(void **state) {
  (void)state;
  packed all[] = {pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_NONE, sheet, VERTICES, 12),
                  pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_EXPONENTIAL, sheet, VERTICES, 12),
                  pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_OCTAHEDRAL, sheet, VERTICES, 8),
                  pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_QUATERNION, sheet, VERTICES, 8),
                  pack(QMAT_MESHOPT_TRIANGLES, QMAT_MESHOPT_NONE, sheet_corners, 3 * TRIANGLES, 2),
                  pack(QMAT_MESHOPT_INDICES, QMAT_MESHOPT_NONE, sheet_corners, 3 * TRIANGLES, 4)};
  uint64_t random = 1;
  for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
    const size_t size = all[i].view.size;
    for (size_t kept = 0; kept < size; kept++)
      assert_int_equal(try_decode(&all[i], all[i].bytes, kept), QMAT_ERROR_FORMAT);
    for (int round = 0; round < 2000; round++) {
      random = random * 6364136223846793005u + 1442695040888963407u;
      uint8_t *byte = &all[i].bytes[(size_t)(random >> 20) % size];
      const uint8_t before = *byte;
      *byte = (uint8_t)(random >> 56);
      const qmat_status status = try_decode(&all[i], all[i].bytes, size);
      assert_true(status == QMAT_OK || status == QMAT_ERROR_FORMAT);
      *byte = before;
    }
    free(all[i].bytes);
  }
}

/* ---- assets ---- */

/* The sheet with its three views compressed: VIEWS and POSITION are filled in. */
static const char sheet_text[] =
    "{'asset':{'version':'2.0'},'extensionsUsed':['EXT_meshopt_compression','KHR_mesh_quantization'],"
    "'extensionsRequired':['EXT_meshopt_compression','KHR_mesh_quantization'],"
    "'buffers':[{'byteLength':CHUNK},{'byteLength':100000,FALLBACK'extensions':{'EXT_meshopt_compression':{'fallback':"
    "true"
    "}}}],"
    "'bufferViews':[{'buffer':1,'byteLength':6400,'byteStride':STRIDE,'extensions':{'EXT_meshopt_compression':{'buffer'"
    ":0,"
    "'byteLength':FIRST,'byteStride':STRIDE,'count':400,'mode':'ATTRIBUTES'FILTER}}},"
    "{'buffer':1,'byteOffset':6400,'byteLength':4332,'extensions':{'EXT_meshopt_compression':{'buffer':0,"
    "'byteOffset':AFTER,'byteLength':SECOND,'byteStride':2,'count':2166,'mode':'TRIANGLES','filter':'NONE'}}}],"
    "'accessors':[{'bufferView':0,COMPONENT,'count':400,'type':'VEC3'},"
    "{'bufferView':1,'componentType':5123,'count':2166,'type':'SCALAR'}],"
    "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}],"
    "'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}]}";

typedef enum kind { FLOATS, EXPONENTIAL, SHORTS, KIND_COUNT } kind;

static char *replaced(char *text, const char *from, const char *to) {
  while (strstr(text, from)) {
    char *next = asset_replace(text, from, to);
    free(text);
    text = next;
  }
  return text;
}

static char *replaced_number(char *text, const char *from, size_t to) {
  char number[24];
  snprintf(number, sizeof number, "%zu", to);
  return replaced(text, from, number);
}

/* The JSON of the asset, and its data in `chunk`. */
static char *make_asset(kind kind, const char *fallback, qmat_writer *chunk) {
  uint8_t vertices[16 * VERTICES];
  size_t stride = 12;
  if (kind == EXPONENTIAL) {
    meshopt_encodeFilterExp(vertices, VERTICES, 12, 24, sheet);
  } else if (kind == SHORTS) { /* of units of 1/1024; the fourth number fills the element */
    stride = 8;
    for (size_t i = 0; i < VERTICES; i++) {
      uint16_t element[4] = {0};
      for (size_t k = 0; k < 3; k++) element[k] = (uint16_t)(1024 * sheet[3 * i + k]);
      memcpy(vertices + 8 * i, element, sizeof element);
    }
  } else {
    memcpy(vertices, sheet, sizeof sheet);
  }
  packed first = pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_NONE, vertices, VERTICES, stride);
  packed second = pack(QMAT_MESHOPT_TRIANGLES, QMAT_MESHOPT_NONE, sheet_corners, 3 * TRIANGLES, 4);
  *chunk = (qmat_writer){0};
  qmat_put_bytes(chunk, first.bytes, first.view.size);
  qmat_gltf_pad(chunk, 0);
  const size_t after = chunk->size;
  qmat_put_bytes(chunk, second.bytes, second.view.size);
  char *text = strdup(sheet_text);
  text = replaced_number(text, "CHUNK", chunk->size);
  text = replaced(text, "FALLBACK", fallback);
  text = replaced_number(text, "STRIDE", stride);
  text = replaced_number(text, "FIRST", first.view.size);
  text = replaced(text, "FILTER", kind == EXPONENTIAL ? ",'filter':'EXPONENTIAL'" : "");
  text = replaced_number(text, "AFTER", after);
  text = replaced_number(text, "SECOND", second.view.size);
  text = replaced(text, "COMPONENT", kind == SHORTS ? "'componentType':5123" : "'componentType':5126");
  free(first.bytes);
  free(second.bytes);
  return text;
}

static qmat_status parse(const char *text, const qmat_writer *chunk, qmat_context *context, qmat_soup *soup) {
  qmat_writer glb = asset_glb(text, chunk->bytes, chunk->size);
  *soup = (qmat_soup){0};
  const qmat_status status = qmat_gltf_parse(context, glb.bytes, glb.size, "test.glb", soup, NULL);
  qmat_writer_uninit(&glb);
  return status;
}

static void assert_is_sheet(const double *positions, size_t count, double scale, double tolerance) {
  assert_int_equal(count, VERTICES);
  for (size_t i = 0; i < 3 * VERTICES; i++) assert_true(fabs(positions[i] - scale * (double)sheet[i]) <= tolerance);
}

static void test_compressed_and_quantised_meshes_are_read(void **state) {
  (void)state;
  for (int kind = 0; kind < KIND_COUNT; kind++) {
    qmat_context context = {0};
    qmat_soup soup;
    qmat_writer chunk;
    char *text = make_asset((enum kind)kind, "", &chunk);
    if (parse(text, &chunk, &context, &soup) != QMAT_OK) fail_msg("%s", context.error.message);
    assert_is_sheet(soup.positions, soup.vertex_count, kind == SHORTS ? 1024 : 1, kind == EXPONENTIAL ? 1e-7 : 0);
    assert_int_equal(soup.facet_count, TRIANGLES);
    for (size_t i = 0; i < 3 * TRIANGLES; i += 3) {
      size_t turn = 0;
      while (turn < 2 && soup.corners[i + turn] != sheet_corners[i]) turn++;
      for (size_t k = 0; k < 3; k++) assert_int_equal(soup.corners[i + (k + turn) % 3], sheet_corners[i + k]);
    }
    qmat_soup_uninit(&soup);
    qmat_writer_uninit(&chunk);
    free(text);
  }
}

static void test_faults_of_the_extension_are_refused_by_name(void **state) {
  (void)state;
  static const struct {
    const char *from, *to, *line;
  } faults[] = {
      {"'fallback':true", "'fallback':1", "test.glb: buffer 1: EXT_meshopt_compression: fallback must be a boolean"},
      {"'extensions':{'EXT_meshopt_compression':{'buffer':0,'byteLength'",
       "'extension':{'EXT_meshopt_compression':{'buffer':0,'byteLength'",
       "test.glb: bufferView 0: buffer 1 has no uri and no GLB chunk, or is a fallback"},
      {"{'buffer':0,'byteLength'", "{'buffer':2,'byteLength'",
       "test.glb: bufferView 0: buffer is 2, but there are 2 buffers"},
      {"{'buffer':0,'byteLength'", "{'buffer':1,'byteLength'",
       "test.glb: bufferView 0: its compressed data are in buffer 1"},
      {"{'buffer':0,'byteLength'", "{'buffer':0,'byteOffset':99999,'byteLength'",
       "test.glb: bufferView 0: compressed bytes 99999 to"},
      {"'count':400,'mode'", "'mode'", "test.glb: bufferView 0: count is missing"},
      {"'count':400,'mode'", "'count':0,'mode'", "test.glb: bufferView 0: count must be"},
      {"'count':400,'mode'", "'count':700,'mode'", "test.glb: bufferView 0: its meshopt data are damaged"},
      {"'count':400,'mode'", "'count':4000000000,'mode'", "test.glb: bufferView 0: "},
      {"'ATTRIBUTES'", "'POINTS'", "test.glb: bufferView 0: EXT_meshopt_compression: mode \"POINTS\" is unknown"},
      {"'mode':'ATTRIBUTES'", "'moda':'ATTRIBUTES'",
       "test.glb: bufferView 0: EXT_meshopt_compression: mode \"\" is unknown"},
      {"'TRIANGLES'", "'INDICES'", "test.glb: bufferView 1: its meshopt data are damaged, or not of mode INDICES"},
      {"'NONE'", "'COLOR'", "test.glb: bufferView 1: EXT_meshopt_compression: filter \"COLOR\" is unknown"},
      {"'NONE'", "'OCTAHEDRAL'", "test.glb: bufferView 1: its filter is not for elements of 2 bytes"},
      {"'byteLength':6400,'byteStride':12", "'byteLength':6400,'byteStride':16",
       "test.glb: bufferView 0: byteStride is 16, but 12 in EXT_meshopt_compression"},
      {"'extensions':{'EXT_meshopt_compression':{'buffer':0,'byteLength'",
       "'extensions':{'EXT_meshopt_compression':[],'a':{'buffer':0,'byteLength'",
       "test.glb: bufferView 0: EXT_meshopt_compression must be an object"},
      {"'count':400,'type'", "'count':401,'type'", "test.glb: accessor 0: 401 elements need 4812 bytes"},
  };
  qmat_writer chunk;
  char *text = make_asset(FLOATS, "", &chunk);
  for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
    qmat_context context = {0};
    qmat_soup soup;
    char line[1024];
    char *bad = asset_replace(text, faults[i].from, faults[i].to);
    assert_int_equal(parse(bad, &chunk, &context, &soup), QMAT_ERROR_FORMAT);
    qmat_error_format(&context.error, line, sizeof line);
    if (strncmp(line, faults[i].line, strlen(faults[i].line)) != 0) fail_msg("%s\nis not\n%s", line, faults[i].line);
    qmat_soup_uninit(&soup);
    free(bad);
  }
  qmat_writer_uninit(&chunk);
  free(text);
}

/* Views that name the same bytes again and again. */
static void test_a_small_file_cannot_ask_for_gigabytes(void **state) {
  (void)state;
  enum { VIEWS = 400, COUNT = 16384 };
  static uint8_t zeros[4 * COUNT];
  packed p = pack(QMAT_MESHOPT_ATTRIBUTES, QMAT_MESHOPT_NONE, zeros, COUNT, 4);
  qmat_writer json = {0};
  char text[256];
  snprintf(text, sizeof text,
           "{'asset':{'version':'2.0'},'extensionsRequired':['EXT_meshopt_compression'],'buffers':[{'byteLength':%zu},"
           "{'byteLength':65536}],'bufferViews':[",
           p.view.size);
  qmat_put_text(&json, text);
  for (int i = 0; i < VIEWS; i++) {
    snprintf(text, sizeof text,
             "%s{'buffer':1,'byteLength':65536,'extensions':{'EXT_meshopt_compression':{'buffer':0,'byteLength':%zu,"
             "'byteStride':4,'count':%d,'mode':'ATTRIBUTES'}}}",
             i > 0 ? "," : "", p.view.size, COUNT);
    qmat_put_text(&json, text);
  }
  qmat_put_bytes(&json, "]}", 3);
  qmat_context context = {0};
  qmat_soup soup;
  const qmat_writer chunk = {.bytes = p.bytes, .size = p.view.size};
  assert_int_equal(parse((const char *)json.bytes, &chunk, &context, &soup), QMAT_ERROR_FORMAT);
  assert_non_null(strstr(context.error.message, "more than 64 times the size of the data"));
  qmat_soup_uninit(&soup);
  qmat_writer_uninit(&json);
  free(p.bytes);
}

/* ---- on their way through ---- */

static qmat_status read_file(const char *path, qmat_scene **scene, qmat_value **mesh) {
  qmat_context context = {0};
  qmat_report *report = NULL;
  const qmat_read_options options = {.defects = QMAT_DEFECTS_DROP};
  const qmat_status status = qmat_model_read_meshes(&context, path, &options, "all", scene, mesh, &report);
  if (status != QMAT_OK) print_error("%s\n", context.error.message);
  if (report) qmat_value_release(&report->base);
  return status;
}

/* What is written can be read, has the same mesh, and requires what it required. */
static void assert_written_again(const char *folder, const qmat_scene *scene, const qmat_mesh *mesh, bool binary,
                                 bool embed) {
  qmat_context context = {0};
  qmat_medial *medial = example_medial(3);
  qmat_gltf_addition additions[2];
  qmat_file *file;
  assert_true(scene->mesh_count <= 2);
  for (size_t i = 0; i < scene->mesh_count; i++) {
    additions[i] =
        (qmat_gltf_addition){.medial = medial, .options = {.binary = binary, .embed = embed, .quantisation = 1e-3}};
  }
  assert_int_equal(qmat_gltf_enrich(&context, scene, additions, scene->mesh_count, true, NULL, &file), QMAT_OK);
  qmat_gltf_asset asset;
  assert_int_equal(qmat_gltf_asset_init(&context, file->parts[0].bytes, file->parts[0].size, "out", &asset), QMAT_OK);
  const json_t *required = json_object_get(asset.root, "extensionsRequired");
  bool kept = false;
  for (size_t i = 0; i < json_array_size(required); i++)
    kept = kept || strcmp(json_string_value(json_array_get(required, i)), QMAT_GLTF_MESHOPT) == 0;
  assert_true(kept);
  qmat_gltf_asset_uninit(&asset);
  char path[128];
  for (size_t i = file->part_count; i > 0; i--) { /* the main part last: its path stays in `path` */
    const qmat_file_part *part = &file->parts[i - 1];
    snprintf(path, sizeof path, "%s/%s", folder, i > 1 ? part->name : binary ? "out.glb" : "out.gltf");
    write_file(path, part->bytes, part->size);
  }
  qmat_scene *again_scene;
  qmat_value *again;
  assert_int_equal(read_file(path, &again_scene, &again), QMAT_OK);
  const qmat_value *first = again->type == QMAT_LIST ? ((const qmat_list *)again)->items[0] : again;
  assert_true(qmat_digest_equal(&first->digest, &mesh->base.digest));
  assert_int_equal(again_scene->mesh_count, scene->mesh_count);
  qmat_value_release(&again_scene->base);
  qmat_value_release(again);
  for (size_t i = 0; i < file->part_count; i++) {
    snprintf(path, sizeof path, "%s/%s", folder, i > 0 ? file->parts[i].name : binary ? "out.glb" : "out.gltf");
    unlink(path);
  }
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  qmat_context_uninit(&context);
}

static void assert_goes_through(const char *folder, const char *path) {
  qmat_scene *scene;
  qmat_value *value;
  assert_int_equal(read_file(path, &scene, &value), QMAT_OK);
  const qmat_value *first = value->type == QMAT_LIST ? ((const qmat_list *)value)->items[0] : value;
  for (int way = 0; way < 4; way++)
    assert_written_again(folder, scene, (const qmat_mesh *)first, way % 2 == 0, way < 2);
  qmat_value_release(&scene->base);
  qmat_value_release(value);
}

static void test_what_is_written_stays_compressed_and_readable(void **state) {
  (void)state;
  char folder[64], path[128];
  make_folder(folder);
  for (int binary = 0; binary < 2; binary++) {
    qmat_writer chunk;
    /* As a .gltf, the placeholder names a file, which is never read. */
    char *text = make_asset(SHORTS, binary ? "" : "'uri':'fallback.bin',", &chunk);
    snprintf(path, sizeof path, "%s/fallback.bin", folder);
    char zeros[100000] = {0};
    if (!binary) write_file(path, zeros, sizeof zeros);
    if (!binary) text = replaced(text, "'buffers':[{'byte", "'buffers':[{'uri':'data.bin','byte");
    snprintf(path, sizeof path, "%s/data.bin", folder);
    if (!binary) write_file(path, chunk.bytes, chunk.size);
    snprintf(path, sizeof path, "%s/%s", folder, binary ? "in.glb" : "in.gltf");
    if (binary) {
      qmat_writer glb = asset_glb(text, chunk.bytes, chunk.size);
      write_file(path, glb.bytes, glb.size);
      qmat_writer_uninit(&glb);
    } else {
      char *json = asset_json(text);
      write_file(path, json, strlen(json));
      free(json);
    }
    assert_goes_through(folder, path);
    unlink(path);
    qmat_writer_uninit(&chunk);
    free(text);
  }
  assert_int_equal(rmdir(folder), 0);
}

static void test_real_files_are_read_and_go_through(void **state) {
  (void)state;
  static const char *const names[] = {ASSETS "BoxMeshopt.glb", ASSETS "meshopt-no-fallback/meshopt-no-fallback.gltf"};
  char folder[64];
  make_folder(folder);
  for (size_t i = 0; i < 2; i++) {
    if (access(names[i], R_OK) != 0) {
      print_message("skipped: %s is not here\n", names[i]);
      continue;
    }
    assert_goes_through(folder, names[i]);
  }
  assert_int_equal(rmdir(folder), 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_attributes_come_back_bit_by_bit),
      cmocka_unit_test(test_indices_come_back_in_16_and_32_bits),
      cmocka_unit_test(test_filters_undo_what_their_encoders_do),
      cmocka_unit_test(test_what_the_format_does_not_allow_is_refused),
      cmocka_unit_test(test_truncated_data_are_refused_and_noise_is_survived),
      cmocka_unit_test(test_compressed_and_quantised_meshes_are_read),
      cmocka_unit_test(test_faults_of_the_extension_are_refused_by_name),
      cmocka_unit_test(test_a_small_file_cannot_ask_for_gigabytes),
      cmocka_unit_test(test_what_is_written_stays_compressed_and_readable),
      cmocka_unit_test(test_real_files_are_read_and_go_through),
  };
  return cmocka_run_group_tests(tests, make_sheet, NULL);
}
