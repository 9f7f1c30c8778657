/* SPDX-License-Identifier: GPL-3.0-or-later */
/* glTF scenes on their way through: what is read of them, and that what comes out only has more in it. */
#include <sys/stat.h>

#include "tests/io/files.h"

#include "core/json_text.h"
#include "io/extract.h"
#include "io/gltf/gltf_asset.h"
#include "io/gltf/gltf_keep.h"
#include "io/gltf/gltf_write.h"
#include "io/model.h"
#include "io/save.h"
#include "tests/io/gltf/gltf_assets.h"
#include "tests/io/medial_examples.h"
#include "tests/shapes.h"

/* Two boxes: `near` is on two nodes, of which the second has extras that are a text; `far` is on one, below a camera's
 * parent. A third mesh has points only, a fourth is on no node. */
static const char scene_text[] =
    "{'asset':{'version':'2.0','copyright':'nobody','extras':{'x':1.0,'y':'a\\u0000b'}},'scene':0,"
    "'scenes':[{'name':'all','nodes':[0,1,2,5]}],"
    "'extensionsUsed':['ACME_glow','KHR_lights_punctual'],"
    "'extensions':{'ACME_glow':{'much':1e-7,'deep':[{'a':null},true]},'KHR_lights_punctual':{'lights':[{'type':'point'}"
    "]}},"
    "'nodes':[{'mesh':0,'name':'A','translation':[5,0,0.1],'extras':{'keep':[1,2.5,null]}},"
    "{'mesh':0,'name':'B','weights':[0.5],'scale':[1,2,3],'extras':'a "
    "text'},{'mesh':1,'weights':[1],'children':[3,4]},{'camera':0},"
    "{'extensions':{'KHR_lights_punctual':{'light':0}}},{'mesh':2}],"
    "'cameras':[{'type':'perspective','perspective':{'yfov':0.7,'znear':0.01}}],"
    "'materials':[{'name':'red','pbrMetallicRoughness':{'baseColorFactor':[1,0,0,1]}}],"
    "'images':[{'uri':'tex/a%20b.png'},{'uri':'tex/gone.png'}],"
    "'animations':[{'channels':[],'samplers':[]}],"
    "'meshes':[{'name':'near','primitives':[{'attributes':{'POSITION':0},'targets':[{'POSITION':2}],'indices':1,"
    "'material':0}],'extras':7},"
    "{'name':'far','primitives':[{'attributes':{'POSITION':2},'targets':[{'POSITION':0}],'indices':1}]},"
    "{'name':'dust','primitives':[{'attributes':{'POSITION':0},'mode':0}]},"
    "{'name':'unused','primitives':[{'attributes':{'POSITION':0},'indices':1}]}],"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':8,'type':'VEC3','min':[0,0,0],'max':[1,1,1]},"
    "{'bufferView':1,'componentType':5123,'count':36,'type':'SCALAR'},"
    "{'bufferView':2,'componentType':5126,'count':8,'type':'VEC3','min':[0,0,0],'max':[4,1,1]}],"
    "'bufferViews':[{'buffer':0,'byteOffset':0,'byteLength':96},{'buffer':0,'byteOffset':96,'byteLength':72},"
    "{'buffer':0,'byteOffset':168,'byteLength':96}],"
    "'buffers':[{'byteLength':264BUFFER}]}";

/* 264 bytes: the corners of a box of side 1, its triangles, and the corners of a box of 4 by 1 by 1. */
static qmat_writer box_data(void) {
  qmat_writer data = {0};
  put_box_corners(&data, 1);
  put_box_triangles(&data);
  put_box_corners(&data, 4);
  assert_int_equal(data.size, 264);
  return data;
}

typedef struct fixture {
  char folder[64], path[96];
  qmat_scene *scene;
  qmat_value *mesh;
  qmat_report *report;
  qmat_context context;
} fixture;

/* Writes the scene, as a .glb or as a .gltf with files beside it, and reads it. */
static qmat_status read_scene(fixture *f, bool binary, const char *choice) {
  qmat_writer data = box_data();
  *f = (fixture){0};
  make_folder(f->folder);
  char path[96];
  snprintf(path, sizeof path, "%s/tex", f->folder);
  assert_int_equal(mkdir(path, 0777), 0);
  snprintf(path, sizeof path, "%s/tex/a b.png", f->folder);
  write_file(path, "a picture", 9);
  snprintf(f->path, sizeof f->path, "%s/scene.%s", f->folder, binary ? "glb" : "gltf");
  char *text = asset_replace(scene_text, "BUFFER", binary ? "" : ",'uri':'./the%20data.bin'");
  if (binary) {
    qmat_writer glb = asset_glb(text, data.bytes, data.size);
    write_file(f->path, glb.bytes, glb.size);
    qmat_writer_uninit(&glb);
  } else {
    char *json = asset_json(text);
    write_file(f->path, json, strlen(json));
    free(json);
    snprintf(path, sizeof path, "%s/the data.bin", f->folder);
    write_file(path, data.bytes, data.size);
  }
  free(text);
  qmat_writer_uninit(&data);
  const qmat_read_options options = {0};
  return qmat_model_read_meshes(&f->context, f->path, &options, choice, &f->scene, &f->mesh, &f->report);
}

static void release(fixture *f) {
  static const char *const names[] = {"tex/a b.png", "the data.bin"};
  for (size_t i = 0; i < 2; i++) {
    char path[96];
    snprintf(path, sizeof path, "%s/%s", f->folder, names[i]);
    unlink(path);
  }
  unlink(f->path);
  char path[96];
  snprintf(path, sizeof path, "%s/tex", f->folder);
  rmdir(path);
  assert_int_equal(rmdir(f->folder), 0);
  if (f->scene) qmat_value_release(&f->scene->base);
  qmat_value_release(f->mesh);
  if (f->report) qmat_value_release(&f->report->base);
  qmat_context_uninit(&f->context);
}

/* Fails where `after` lacks or changes anything of `before`: objects may have more keys, arrays more members. The
 * length of the GLB's buffer may grow. */
static void assert_only_more(const json_t *before, const json_t *after, const char *where) {
  const char *key;
  json_t *value;
  char path[512];
  if (json_is_object(before)) {
    assert_true(json_is_object(after));
    json_object_foreach((json_t *)(uintptr_t)before, key, value) {
      snprintf(path, sizeof path, "%s/%s", where, key);
      const json_t *other = json_object_get(after, key);
      if (!other) fail_msg("%s is gone", path);
      if (strcmp(path, "/buffers/0/byteLength") == 0) {
        assert_true(json_integer_value(other) >= json_integer_value(value));
      } else {
        assert_only_more(value, other, path);
      }
    }
  } else if (json_is_array(before)) {
    assert_true(json_array_size(after) >= json_array_size(before));
    for (size_t i = 0; i < json_array_size(before); i++) {
      snprintf(path, sizeof path, "%s/%zu", where, i);
      assert_only_more(json_array_get(before, i), json_array_get(after, i), path);
    }
  } else if (!json_equal((json_t *)(uintptr_t)before, (json_t *)(uintptr_t)after)) {
    fail_msg("%s is another", where);
  }
}

static qmat_gltf_asset open_part(const qmat_file_part *part) {
  qmat_context context = {0};
  qmat_gltf_asset asset;
  assert_int_equal(qmat_gltf_asset_init(&context, part->bytes, part->size, "a file", &asset), QMAT_OK);
  return asset;
}

static const json_t *node_of(const qmat_gltf_asset *asset, size_t i) {
  return json_array_get(json_object_get(asset->root, "nodes"), i);
}

static const char *data_of(const json_t *node) {
  return json_string_value(json_object_get(json_object_get(node, "extras"), "qmat_data"));
}

/* The scene with a medial mesh of 3 spheres for the first mesh and of 5 for the second. */
static qmat_file *enrich(fixture *f, size_t count, bool binary, const qmat_mesh *skin, bool compress) {
  qmat_medial *medials[] = {example_medial(3), example_medial(5)};
  qmat_gltf_addition additions[2];
  for (size_t i = 0; i < 2; i++) {
    additions[i] = (qmat_gltf_addition){.medial = medials[i],
                                        .skin = skin,
                                        .options = {.binary = binary,
                                                    .compress_skin = compress,
                                                    .quantisation = 1e-3,
                                                    .errors.epsilon = (double)NAN,
                                                    .errors.error_out = (double)NAN,
                                                    .errors.error_in = (double)NAN,
                                                    .name = "scene"}};
  }
  qmat_file *file;
  if (qmat_gltf_enrich(&f->context, f->scene, additions, count, false, NULL, &file) != QMAT_OK)
    fail_msg("%s", f->context.error.message);
  for (size_t i = 0; i < 2; i++) qmat_value_release(&medials[i]->base);
  return file;
}

static void test_meshes_are_read_once_each_in_their_own_space(void **state) {
  (void)state;
  for (int binary = 0; binary < 2; binary++) {
    fixture f;
    assert_int_equal(read_scene(&f, binary == 1, "all"), QMAT_OK);
    assert_int_equal(f.mesh->type, QMAT_LIST);
    const qmat_list *list = (const qmat_list *)f.mesh;
    assert_int_equal(list->count, 2); /* not the points, not the one on no node */
    assert_string_equal(list->names[0], "near");
    assert_string_equal(list->names[1], "far");
    assert_int_equal(f.scene->mesh_count, 2);
    assert_int_equal(f.scene->meshes[0], 0);
    assert_int_equal(f.scene->meshes[1], 1);
    const double lengths[] = {1, 5}; /* the node of the second moves its target, those of the first differ */
    for (size_t i = 0; i < 2; i++) {
      const qmat_mesh *mesh = (const qmat_mesh *)list->items[i];
      assert_int_equal(mesh->vertex_count, 8);
      assert_true(mesh->closed && mesh->oriented);
      double low = INFINITY, high = -INFINITY;
      for (size_t v = 0; v < 8; v++) {
        low = fmin(low, mesh->positions[3 * v]);
        high = fmax(high, mesh->positions[3 * v]);
      }
      assert_true(low == 0 && high == lengths[i]); /* the node's translation is not in it */
      /* The largest scale of its nodes: the first mesh is also on one that scales by 1, 2 and 3. */
      assert_true(fabs(mesh->meters_per_unit - (i == 0 ? 3 : 1)) < 1e-12);
    }
    const json_t *meshes = json_object_get(f.report->root, "meshes");
    assert_int_equal(json_integer_value(json_object_get(json_array_get(meshes, 0), "nodes")), 2);
    const json_t *warnings = json_object_get(f.report->root, "warnings");
    assert_int_equal(json_array_size(warnings), 4);
    assert_non_null(strstr(json_string_value(json_array_get(warnings, 0)), "differ, in 1 cases"));
    assert_non_null(strstr(json_string_value(json_array_get(warnings, 1)), "1 of 3 primitives"));
    assert_non_null(strstr(json_string_value(json_array_get(warnings, 2)), "node 1 "));
    assert_non_null(strstr(json_string_value(json_array_get(warnings, 3)), "tex/gone.png"));
    assert_int_equal(f.scene->part_count, binary ? 2 : 3);
    assert_string_equal(f.scene->parts[1].name, "tex/a b.png");
    if (!binary) assert_string_equal(f.scene->parts[2].name, "the data.bin");
    release(&f);
  }
}

static void test_a_mesh_is_chosen_by_name_or_number(void **state) {
  (void)state;
  static const char *const choices[] = {"far", "1"};
  fixture f;
  for (size_t i = 0; i < 2; i++) {
    assert_int_equal(read_scene(&f, true, choices[i]), QMAT_OK);
    assert_int_equal(f.mesh->type, QMAT_MESH);
    assert_int_equal(f.scene->mesh_count, 1);
    assert_int_equal(f.scene->meshes[0], 1);
    release(&f);
  }
  static const char *const wrong[] = {"unused", "3", "4", "-1", "nothing", ""};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
    assert_int_equal(read_scene(&f, true, wrong[i]), QMAT_ERROR_USAGE);
    assert_string_equal(f.context.error.field, "mesh");
    assert_true(!f.scene && !f.mesh && !f.report);
    release(&f);
  }
  assert_int_equal(read_scene(&f, true, "merged"), QMAT_OK);
  assert_int_equal(f.mesh->type, QMAT_MESH);
  assert_int_equal(((const qmat_mesh *)f.mesh)->triangle_count, 36); /* three boxes are placed */
  assert_int_equal(f.scene->mesh_count, 0);
  release(&f);
}

static void test_what_comes_out_only_has_more_in_it(void **state) {
  (void)state;
  for (int way = 0; way < 12; way++) {
    const bool from_binary = way & 1, to_binary = way >> 1 & 1, has_skin = way >= 4, compress = way >= 8;
    fixture f;
    assert_int_equal(read_scene(&f, from_binary, "all"), QMAT_OK);
    const qmat_mesh *skin = has_skin ? (const qmat_mesh *)((const qmat_list *)f.mesh)->items[1] : NULL;
    qmat_file *file = enrich(&f, 2, to_binary, skin, compress);
    qmat_gltf_asset before = open_part(&f.scene->parts[0]), after = open_part(&file->parts[0]);
    assert_only_more(before.root, after.root, "");
    assert_int_equal(after.binary, to_binary);
    assert_int_equal(file->part_count, f.scene->part_count);
    for (size_t i = 1; i < file->part_count; i++) {
      assert_string_equal(file->parts[i].name, f.scene->parts[i].name);
      assert_int_equal(file->parts[i].size, f.scene->parts[i].size);
      assert_memory_equal(file->parts[i].bytes, f.scene->parts[i].bytes, file->parts[i].size);
    }
    if (from_binary && to_binary) {
      assert_true(after.chunk_size >= before.chunk_size);
      assert_memory_equal(after.chunk, before.chunk, before.chunk_size);
      if (!has_skin) assert_int_equal(after.chunk_size, before.chunk_size);
    }
    /* Node 0 has extras, node 1 a text instead, node 2 none: all carry one, nodes of one mesh the same. */
    const json_t *child = node_of(&after, has_skin ? 7 : 6);
    assert_non_null(data_of(node_of(&after, 0)));
    assert_null(data_of(node_of(&after, 1)));
    assert_string_equal(data_of(child), data_of(node_of(&after, 0)));
    assert_string_equal(json_string_value(json_object_get(child, "name")), "B medial mesh");
    assert_non_null(data_of(node_of(&after, 2)));
    assert_string_not_equal(data_of(child), data_of(node_of(&after, 2)));
    assert_int_equal(json_array_size(json_object_get(after.root, "nodes")), has_skin ? 10 : 7);
    release(&f);
    qmat_gltf_asset_uninit(&before);
    qmat_gltf_asset_uninit(&after);
    qmat_value_release(&file->base);
  }
}

static qmat_digest merged_digest(fixture *f, const char *path) {
  const qmat_read_options options = {0};
  qmat_scene *scene;
  qmat_value *mesh;
  qmat_report *report;
  assert_int_equal(qmat_model_read_meshes(&f->context, path, &options, "merged", &scene, &mesh, &report), QMAT_OK);
  const qmat_digest digest = mesh->digest;
  qmat_value_release(&scene->base);
  qmat_value_release(mesh);
  qmat_value_release(&report->base);
  return digest;
}

/* Saves the file and its parts in a folder of its own, and reads all of it again. */
static void test_what_comes_out_is_read_again_with_the_same_meshes(void **state) {
  (void)state;
  for (int way = 0; way < 8; way++) {
    const bool binary = way & 1, has_skin = way >= 4, compress = way >= 6, to_binary = way >> 1 & 1;
    fixture f;
    assert_int_equal(read_scene(&f, binary, "all"), QMAT_OK);
    const qmat_mesh *skin = has_skin ? (const qmat_mesh *)((const qmat_list *)f.mesh)->items[1] : NULL;
    qmat_file *file = enrich(&f, 2, to_binary, skin, compress);
    char folder[64], path[96], side[160];
    make_folder(folder);
    snprintf(path, sizeof path, "%s/out.%s", folder, to_binary ? "glb" : "gltf");
    assert_int_equal(qmat_file_save(&f.context, file, path), QMAT_OK);
    qmat_scene *scene;
    qmat_value *mesh;
    qmat_report *report;
    const qmat_read_options options = {0};
    if (qmat_model_read_meshes(&f.context, path, &options, "all", &scene, &mesh, &report) != QMAT_OK)
      fail_msg("%s", f.context.error.message);
    assert_memory_equal(&mesh->digest, &f.mesh->digest, sizeof mesh->digest); /* the skins are not taken for models */
    const qmat_digest merged[] = {merged_digest(&f, f.path), merged_digest(&f, path)};
    assert_memory_equal(&merged[0], &merged[1], sizeof merged[0]); /* nor where all meshes are merged */
    qmat_medial *medial;
    assert_int_equal(qmat_medial_extract(&f.context, path, "A", &medial, NULL), QMAT_OK);
    assert_int_equal(medial->sphere_count, 3);
    qmat_value_release(&medial->base);
    assert_int_equal(qmat_medial_extract(&f.context, path, "2", &medial, NULL), QMAT_OK);
    assert_int_equal(medial->sphere_count, 5);
    qmat_value_release(&medial->base);
    for (size_t i = 1; i < file->part_count; i++) {
      snprintf(side, sizeof side, "%s/%s", folder, file->parts[i].name);
      assert_int_equal(unlink(side), 0);
    }
    snprintf(side, sizeof side, "%s/tex", folder);
    assert_int_equal(rmdir(side), 0);
    assert_int_equal(unlink(path), 0);
    assert_int_equal(rmdir(folder), 0);
    qmat_value_release(&scene->base);
    qmat_value_release(mesh);
    qmat_value_release(&report->base);
    qmat_value_release(&file->base);
    release(&f);
  }
}

/* What was written, as a scene of which mesh 1 is to get a medial mesh. */
static qmat_scene *scene_again(qmat_context *context, const qmat_file *file) {
  qmat_scene *scene = qmat_scene_new();
  scene->name = qmat_strdup("again");
  scene->format = qmat_strdup("glb");
  scene->parts = qmat_calloc(1, sizeof *scene->parts);
  scene->part_count = 1;
  scene->parts[0].name = qmat_strdup("");
  scene->parts[0].bytes = qmat_alloc(file->parts[0].size, 1);
  scene->parts[0].size = file->parts[0].size;
  memcpy(scene->parts[0].bytes, file->parts[0].bytes, file->parts[0].size);
  scene->mesh_count = 1;
  scene->meshes = qmat_calloc(1, sizeof *scene->meshes);
  scene->meshes[0] = 1;
  assert_int_equal(qmat_value_seal(context, &scene->base), QMAT_OK);
  return scene;
}

static void test_a_second_time_replaces_what_the_first_left(void **state) {
  (void)state;
  fixture f, again = {0};
  assert_int_equal(read_scene(&f, true, "1"), QMAT_OK);
  qmat_file *first = enrich(&f, 1, true, NULL, false);
  again.scene = scene_again(&again.context, first);
  qmat_file *second = enrich(&again, 1, true, NULL, false);
  assert_int_equal(second->parts[0].size, first->parts[0].size);
  assert_memory_equal(second->parts[0].bytes, first->parts[0].bytes, first->parts[0].size);
  qmat_value_release(&again.scene->base);
  qmat_value_release(&first->base);
  qmat_value_release(&second->base);
  release(&f);
}

static void test_one_of_all_meshes_gets_a_node_of_the_scene(void **state) {
  (void)state;
  fixture f;
  assert_int_equal(read_scene(&f, true, "merged"), QMAT_OK);
  qmat_file *file = enrich(&f, 1, true, NULL, false);
  qmat_gltf_asset before = open_part(&f.scene->parts[0]), after = open_part(&file->parts[0]);
  assert_only_more(before.root, after.root, "");
  assert_non_null(data_of(node_of(&after, 6)));
  const json_t *roots = json_object_get(json_array_get(json_object_get(after.root, "scenes"), 0), "nodes");
  assert_int_equal(json_array_size(roots), 5);
  assert_int_equal(json_integer_value(json_array_get(roots, 4)), 6);
  qmat_gltf_asset_uninit(&before);
  qmat_gltf_asset_uninit(&after);
  qmat_value_release(&file->base);
  release(&f);
}

static void test_a_long_name_of_a_missing_file_is_told_in_whole_characters(void **state) {
  (void)state;
  char name[256];
  memset(name, 'a', 199);
  snprintf(name + 199, sizeof name - 199, "\xC3\xA9.png"); /* the 200th byte is the first of two */
  json_t *root = json_pack("{s:[{s:s}]}", "images", "uri", name), *warnings = json_array();
  assert_true(root && warnings);
  qmat_context context = {0};
  qmat_scene *scene = qmat_scene_new();
  const uint8_t bytes[] = {'{', '}'};
  assert_int_equal(qmat_gltf_keep(&context, root, bytes, sizeof bytes, "/nowhere/at/all.gltf", scene, warnings),
                   QMAT_OK);
  assert_int_equal(scene->part_count, 1);
  assert_int_equal(json_array_size(warnings), 1);
  memcpy(name + 199, "\" cannot be read", 17);
  assert_non_null(strstr(json_string_value(json_array_get(warnings, 0)), name));
  qmat_value_release(&scene->base);
  json_decref(root);
  json_decref(warnings);
  qmat_context_uninit(&context);
}

/* A buffer in a data URI comes first, the box in a file, one image twice, one in a data URI, and two that are no image.
 */
static const char outside_text[] =
    "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}],"
    "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}],"
    "'images':[{'uri':'a%20b.png'},{'uri':'./a%20b.png','name':'twin'},{'uri':'../SECRET'},{'uri':'odd.png'},"
    "{'uri':'data:image/png;base64,iVBORw0KGgo='},{'uri':'data:image/png;base64,?'}],"
    "'accessors':[{'bufferView':1,'componentType':5126,'count':8,'type':'VEC3'},"
    "{'bufferView':2,'componentType':5123,'count':36,'type':'SCALAR'}],"
    "'bufferViews':[{'buffer':0,'byteLength':4},{'buffer':1,'byteOffset':0,'byteLength':96},"
    "{'buffer':1,'byteOffset':96,'byteLength':72,'extensions':{'ACME_packed':{'buffer':1,'byteOffset':4}}}],"
    "'buffers':[{'uri':'data:application/octet-stream;base64,AAAAAA==','byteLength':4},"
    "{'uri':'box.bin','byteLength':168,'name':'box'}]}";

static json_int_t number_at(const json_t *root, const char *array, size_t index, const char *key) {
  return json_integer_value(json_object_get(json_array_get(json_object_get(root, array), index), key));
}

static void test_a_glb_takes_in_buffers_and_images_and_renumbers_them(void **state) {
  (void)state;
  static const char png[] = "\x89PNG\r\n\x1a\nxyz", secret[] = "no image";
  qmat_context context = {0};
  char folder[64], path[96], file_path[128], secret_path[128];
  make_folder(folder);
  snprintf(secret_path, sizeof secret_path, "%s.secret", folder);
  write_file(secret_path, secret, sizeof secret - 1);
  char *text = asset_replace(outside_text, "SECRET", strrchr(secret_path, '/') + 1), *json = asset_json(text);
  qmat_writer data = box_data();
  const struct {
    const char *name;
    const void *bytes;
    size_t size;
  } files[] = {{"scene.gltf", json, strlen(json)},
               {"box.bin", data.bytes, 168},
               {"a b.png", png, sizeof png - 1},
               {"odd.png", "odd", 3}};
  for (size_t i = 0; i < 4; i++) {
    snprintf(file_path, sizeof file_path, "%s/%s", folder, files[i].name);
    write_file(file_path, files[i].bytes, files[i].size);
  }
  snprintf(path, sizeof path, "%s/scene.gltf", folder);
  qmat_scene *scene;
  qmat_value *mesh;
  qmat_report *report;
  const qmat_read_options options = {0};
  assert_int_equal(qmat_model_read_meshes(&context, path, &options, "all", &scene, &mesh, &report), QMAT_OK);
  assert_int_equal(scene->part_count, 4); /* not the one that lies outside and is no image */
  assert_int_equal(json_array_size(json_object_get(report->root, "warnings")), 1);

  qmat_medial *medial = example_medial(3);
  const qmat_gltf_addition addition = {.medial = medial,
                                       .options = {.binary = true, .embed = true, .quantisation = 1e-3}};
  qmat_file *file;
  assert_int_equal(qmat_gltf_enrich(&context, scene, &addition, 1, false, NULL, &file), QMAT_OK);
  assert_int_equal(file->part_count, 2); /* what is no image stays outside */
  assert_string_equal(file->parts[1].name, "odd.png");
  qmat_gltf_asset after = open_part(&file->parts[0]);
  const json_t *buffers = json_object_get(after.root, "buffers");
  assert_int_equal(json_array_size(buffers), 1);
  assert_null(json_object_get(json_array_get(buffers, 0), "uri"));
  assert_int_equal(number_at(after.root, "bufferViews", 0, "byteOffset"), 0);
  assert_int_equal(number_at(after.root, "bufferViews", 1, "buffer"), 0);
  assert_int_equal(number_at(after.root, "bufferViews", 1, "byteOffset"), 4);
  assert_int_equal(number_at(after.root, "bufferViews", 2, "byteOffset"), 4 + 96);
  const json_t *packed = json_object_get(
      json_object_get(json_array_get(json_object_get(after.root, "bufferViews"), 2), "extensions"), "ACME_packed");
  assert_int_equal(json_integer_value(json_object_get(packed, "buffer")), 0);
  assert_int_equal(json_integer_value(json_object_get(packed, "byteOffset")), 4 + 4);
  assert_int_equal(after.chunk_size, number_at(after.root, "buffers", 0, "byteLength"));
  assert_memory_equal(after.chunk, "\0\0\0\0", 4);
  assert_memory_equal(after.chunk + 4, data.bytes, 168);
  const size_t view = (size_t)number_at(after.root, "images", 0, "bufferView");
  assert_int_equal(number_at(after.root, "images", 1, "bufferView"), view);
  assert_memory_equal(after.chunk + number_at(after.root, "bufferViews", view, "byteOffset"), png, sizeof png - 1);
  const json_t *image = json_array_get(json_object_get(after.root, "images"), 1);
  assert_string_equal(json_string_value(json_object_get(image, "mimeType")), "image/png");
  assert_string_equal(json_string_value(json_object_get(image, "name")), "twin");
  assert_null(json_object_get(image, "uri"));
  const size_t data_view = (size_t)number_at(after.root, "images", 4, "bufferView");
  assert_memory_equal(after.chunk + number_at(after.root, "bufferViews", data_view, "byteOffset"), png, 8);
  assert_int_equal(number_at(after.root, "bufferViews", data_view, "byteLength"), 8);
  assert_null(json_object_get(json_array_get(json_object_get(after.root, "images"), 4), "uri"));
  assert_non_null(json_object_get(json_array_get(json_object_get(after.root, "images"), 5), "uri")); /* no base64 */

  /* The same surface is read from it, alone in another place. */
  qmat_soup soup = {0};
  assert_int_equal(qmat_gltf_parse(&context, file->parts[0].bytes, file->parts[0].size, "/nowhere/x.glb", &soup, NULL),
                   QMAT_OK);
  assert_int_equal(soup.facet_count, 12);
  qmat_soup_uninit(&soup);
  qmat_gltf_asset_uninit(&after);
  for (size_t i = 0; i < 4; i++) {
    snprintf(file_path, sizeof file_path, "%s/%s", folder, files[i].name);
    assert_int_equal(unlink(file_path), 0);
  }
  assert_int_equal(unlink(secret_path), 0);
  assert_int_equal(rmdir(folder), 0);
  free(text);
  free(json);
  qmat_writer_uninit(&data);
  qmat_value_release(&file->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&scene->base);
  qmat_value_release(mesh);
  qmat_value_release(&report->base);
  qmat_context_uninit(&context);
}

static void test_a_mesh_far_from_zero_has_its_medial_mesh_on_a_translated_child(void **state) {
  (void)state;
  fixture f;
  assert_int_equal(read_scene(&f, true, "1"), QMAT_OK);
  const double spheres[] = {4e5 + 0.1, 0, 5e6 + 0.3, 1, 4e5 + 1.3, 0, 5e6, 0.5};
  qmat_medial *medial = sealed_medial_mesh(spheres, 2, (const uint32_t[]){0, 1}, 1, NULL, 0), *back;
  qmat_stated_errors stated;
  const qmat_gltf_addition addition = {
      .medial = medial,
      .options = {.binary = true,
                  .quantisation = 1e-4,
                  .errors = {.diagonal = 4, .epsilon = 0.01, .error_out = 0.007, .error_in = 0.009},
                  .stated = &stated}};
  qmat_file *file;
  assert_int_equal(qmat_gltf_enrich(&f.context, f.scene, &addition, 1, false, NULL, &file), QMAT_OK);
  qmat_gltf_asset after = open_part(&file->parts[0]);
  assert_null(data_of(node_of(&after, 2)));
  const json_t *child = node_of(&after, 6), *translation = json_object_get(child, "translation");
  assert_non_null(data_of(child));
  assert_true(fabs(json_number_value(json_array_get(translation, 0)) - 4e5) <= 4);
  assert_true(fabs(json_number_value(json_array_get(translation, 2)) - 5e6) <= 4);
  char folder[64], path[96];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/out.glb", folder);
  write_file(path, file->parts[0].bytes, file->parts[0].size);
  assert_int_equal(qmat_medial_extract(&f.context, path, NULL, &back, NULL), QMAT_OK);
  const double moved = qmat_medial_move(medial, back);
  assert_true(moved > 0 && moved <= 1e-4);
  assert_true(stated.error_in >= 0.009 + moved / 4 && stated.error_in <= 0.009 + moved / 4 + 1e-12);
  qmat_gltf_asset_uninit(&after);
  assert_int_equal(unlink(path), 0);
  assert_int_equal(rmdir(folder), 0);
  qmat_value_release(&back->base);
  qmat_value_release(&medial->base);
  qmat_value_release(&file->base);
  release(&f);
}

/* The first run adds a child with a medial mesh far from zero and one with a skin, the second run only extras. */
static void test_a_second_time_takes_away_children_of_the_first(void **state) {
  (void)state;
  fixture f, again = {0};
  assert_int_equal(read_scene(&f, true, "1"), QMAT_OK);
  qmat_medial *medial = sealed_medial_mesh((const double[]){4e5 + 0.1, 0, 5e6 + 0.3, 1, 4e5 + 1.3, 0, 5e6, 0.5}, 2,
                                           (const uint32_t[]){0, 1}, 1, NULL, 0);
  qmat_mesh *skin = shape_box(1, 1, 1);
  for (size_t i = 0; i < skin->vertex_count; i++) {
    skin->positions[3 * i] += 4e5;
    skin->positions[3 * i + 2] += 5e6;
  }
  shape_seal(skin);
  const qmat_gltf_addition addition = {
      .medial = medial, .skin = skin, .options = {.binary = true, .quantisation = 1e-4}};
  qmat_file *first;
  assert_int_equal(qmat_gltf_enrich(&f.context, f.scene, &addition, 1, false, NULL, &first), QMAT_OK);
  qmat_gltf_asset before = open_part(&first->parts[0]);
  assert_int_equal(json_array_size(json_object_get(node_of(&before, 2), "children")), 4);
  qmat_gltf_asset_uninit(&before);
  again.scene = scene_again(&again.context, first);
  qmat_file *second = enrich(&again, 1, true, NULL, false);
  qmat_gltf_asset after = open_part(&second->parts[0]);
  assert_non_null(data_of(node_of(&after, 2)));
  assert_int_equal(json_array_size(json_object_get(node_of(&after, 2), "children")), 2); /* its own */
  for (size_t i = 6; i < json_array_size(json_object_get(after.root, "nodes")); i++)
    assert_int_equal(json_object_size(node_of(&after, i)), 0);
  qmat_gltf_asset_uninit(&after);
  qmat_value_release(&again.scene->base);
  qmat_value_release(&first->base);
  qmat_value_release(&second->base);
  qmat_value_release(&skin->base);
  qmat_value_release(&medial->base);
  release(&f);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_meshes_are_read_once_each_in_their_own_space),
      cmocka_unit_test(test_a_mesh_is_chosen_by_name_or_number),
      cmocka_unit_test(test_what_comes_out_only_has_more_in_it),
      cmocka_unit_test(test_what_comes_out_is_read_again_with_the_same_meshes),
      cmocka_unit_test(test_a_second_time_replaces_what_the_first_left),
      cmocka_unit_test(test_a_second_time_takes_away_children_of_the_first),
      cmocka_unit_test(test_one_of_all_meshes_gets_a_node_of_the_scene),
      cmocka_unit_test(test_a_glb_takes_in_buffers_and_images_and_renumbers_them),
      cmocka_unit_test(test_a_mesh_far_from_zero_has_its_medial_mesh_on_a_translated_child),
      cmocka_unit_test(test_a_long_name_of_a_missing_file_is_told_in_whole_characters),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
