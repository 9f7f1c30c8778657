/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Writes the golden files of examples/readers: small glTF files as the writer makes them, and beside each what a reader
 * must decode from it: golden FOLDER. The expected distances come from the library's envelope, and the expected rays
 * from steps of that distance, so they share no code with the readers. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/geometry/envelope.h"
#include "core/geometry/medial_build.h"
#include "core/hash.h"
#include "core/json_text.h"
#include "core/node.h"
#include "io/base64.h"
#include "io/flat_medial.h"
#include "io/gltf/gltf_write.h"
#include "io/stored_medial.h"

#define REQUIRE(condition) require(condition, #condition, __LINE__)

static void require(bool condition, const char *text, int line) {
  if (condition) return;
  fprintf(stderr, "golden.c:%d: %s\n", line, text);
  exit(1);
}

static double random_number(uint64_t seed, uint64_t index, double low, double high) {
  return low + (high - low) * qmat_hash_unit(qmat_hash3(seed, index, 0));
}

/* ---- the medial meshes ---- */

static qmat_medial *build(const double *spheres, size_t sphere_count, const uint32_t *edges, size_t edge_count,
                          const uint32_t *triangles, size_t triangle_count) {
  qmat_context context = {0};
  qmat_medial *medial = qmat_medial_new();
  REQUIRE(medial && (medial->spheres = qmat_alloc(sphere_count, 4 * sizeof *spheres)));
  memcpy(medial->spheres, spheres, 4 * sphere_count * sizeof *spheres);
  medial->sphere_count = sphere_count;
  REQUIRE(qmat_medial_set_simplices(&context, medial, edges, edge_count, triangles, triangle_count) == QMAT_OK);
  REQUIRE(qmat_value_seal(&context, &medial->base) == QMAT_OK);
  return medial;
}

static qmat_medial *make_sphere(void) {
  return build((const double[]){1.5, -2, 0.25, 0.75}, 1, NULL, 0, NULL, 0);
}

static qmat_medial *make_capsule(void) {
  return build((const double[]){-1, 0, 0.125, 0.5, 1, 0.5, 0, 0.2}, 2, (const uint32_t[]){0, 1}, 1, NULL, 0);
}

/* Where only a part of a simplex counts: a cone within a sphere, a slab within one, slabs of collinear and of
 * coincident centres, one whose radius grows faster than the distance, spheres of radius zero. */
static qmat_medial *make_degenerate(void) {
  static const double spheres[] = {
      0,  0, 0, 1,    0.25, 0, 0, 0.5,                     /* a cone within its sphere */
      5,  0, 0, 2,    5.5,  0, 0, 0.5, 5,  0.5, 0,   0.25, /* a slab within its sphere */
      10, 0, 0, 0.5,  12,   0, 0, 1,   11, 0,   0,   0.25, /* collinear */
      15, 0, 0, 0.5,  15,   0, 0, 0.5, 16, 1,   0.5, 0.25, /* coincident */
      20, 0, 0, 1.25, 21,   0, 0, 0.5, 20, 1.5, 0,   0.25, /* steep, yet with tangent planes */
      25, 0, 0, 0,    26,   0, 0, 0,   25, 1,   0,   0,    /* a triangle */
      30, 0, 0, 0,    31,   1, 1, 0,                       /* a segment */
      33, 0, 0, 0,                                         /* a point */
      -5, 0, 0, 1.5,  -4,   0, 0, 0.2, -5, 1,   0,   1.4}; /* only two of three edges have a surface */
  static const uint32_t edges[] = {0, 1, 17, 18};
  static const uint32_t triangles[] = {2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 20, 21, 22};
  return build(spheres, sizeof spheres / sizeof *spheres / 4, edges, 2, triangles, 6);
}

/* `count` random spheres: the first half in slabs, then cones, and every seventh alone. */
static qmat_medial *make_mixed(size_t count) {
  double *spheres = qmat_alloc(count, 4 * sizeof *spheres);
  uint32_t *edges = qmat_alloc(count, 2 * sizeof *edges), *triangles = qmat_alloc(count, 3 * sizeof *triangles);
  REQUIRE(spheres && edges && triangles);
  size_t edge_count = 0, triangle_count = 0;
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < 3; k++)
      spheres[4 * i + k] = random_number(1, 4 * i + k, -3, 3) + (k == 0 ? 0.1 * (double)i : 0);
    spheres[4 * i + 3] = i % 5 == 4 ? 0 : random_number(1, 4 * i + 3, 0.05, 0.4);
    if (i % 7 > 3 || i + 2 >= count) continue;
    const uint32_t id = (uint32_t)i;
    if (i < count / 2) {
      memcpy(triangles + 3 * triangle_count++, (const uint32_t[]){id, id + 1, id + 2}, 3 * sizeof id);
    } else {
      memcpy(edges + 2 * edge_count++, (const uint32_t[]){id, id + 1}, 2 * sizeof id);
    }
  }
  qmat_medial *medial = build(spheres, count, edges, edge_count, triangles, triangle_count);
  qmat_free(spheres);
  qmat_free(edges);
  qmat_free(triangles);
  return medial;
}

/* A surface for clients that show meshes: a box. */
static qmat_mesh *make_box(void) {
  qmat_context context = {0};
  qmat_mesh *mesh = qmat_mesh_new();
  REQUIRE(mesh && (mesh->positions = qmat_alloc(24, sizeof(double))) && (mesh->triangles = qmat_alloc(36, 4)));
  static const uint32_t triangles[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                         2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  for (int i = 0; i < 24; i++) mesh->positions[i] = (i / 3) >> (i % 3) & 1 ? 1 : -1;
  memcpy(mesh->triangles, triangles, sizeof triangles);
  mesh->vertex_count = 8;
  mesh->triangle_count = 12;
  mesh->closed = mesh->oriented = true;
  REQUIRE(qmat_value_seal(&context, &mesh->base) == QMAT_OK);
  return mesh;
}

/* ---- what is expected ---- */

static json_t *numbers(const double *values, size_t count) {
  json_t *array = json_array();
  for (size_t i = 0; i < count; i++) REQUIRE(json_array_append_new(array, json_real(values[i])) == 0);
  return array;
}

static json_t *rows_of(const double *values, size_t rows, size_t columns) {
  json_t *array = json_array();
  for (size_t i = 0; i < rows; i++) REQUIRE(json_array_append_new(array, numbers(values + columns * i, columns)) == 0);
  return array;
}

static void add_simplices(json_t *expected, const qmat_medial *medial) {
  static const char *const names[] = {"slabs", "cones", "points"};
  qmat_context context = {0};
  uint32_t *faces;
  size_t counts[3], face = 0;
  REQUIRE(qmat_medial_faces(&context, medial, &faces, counts) == QMAT_OK);
  for (size_t kind = 0; kind < 3; kind++) {
    json_t *list = json_array();
    for (size_t i = 0; i < counts[kind]; i++, face++) {
      json_t *ids = json_array();
      for (size_t k = 0; k < 3 - kind; k++) json_array_append_new(ids, json_integer(faces[3 * face + k]));
      json_array_append_new(list, ids);
    }
    REQUIRE(json_object_set_new(expected, names[kind], list) == 0);
  }
  qmat_free(faces);
}

/* Distances, supports and rays of the decoded medial mesh at random places around it. */
static void add_queries(json_t *expected, const qmat_medial *medial) {
  qmat_context context = {0};
  qmat_envelope *envelope;
  REQUIRE(qmat_envelope_of_medial(&context, medial, &envelope) == QMAT_OK);
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0;
  for (size_t i = 0; i < 3 * medial->sphere_count; i++) {
    const double *sphere = medial->spheres + 4 * (i / 3);
    low[i % 3] = fmin(low[i % 3], sphere[i % 3] - sphere[3]);
    high[i % 3] = fmax(high[i % 3], sphere[i % 3] + sphere[3]);
  }
  for (int k = 0; k < 3; k++) size = fmax(size, high[k] - low[k]);
  json_t *distances = json_array(), *supports = json_array(), *rays = json_array();
  for (uint64_t i = 0; i < 60; i++) {
    double point[3], target[3], direction[3], length = 0, support = -INFINITY, at = 0;
    const double *near_it = medial->spheres + 4 * (i % medial->sphere_count);
    for (uint64_t k = 0; k < 3; k++) {
      point[k] = i % 2 ? random_number(2, 3 * i + k, low[k] - size / 4, high[k] + size / 4)
                       : near_it[k] + random_number(2, 3 * i + k, -1.5, 1.5) * near_it[3];
      target[k] = near_it[k] + random_number(3, 3 * i + k, -0.7, 0.7) * (near_it[3] + 0.1);
      direction[k] = target[k] - point[k];
      length += direction[k] * direction[k];
    }
    for (int k = 0; k < 3; k++) direction[k] /= sqrt(length);
    json_array_append_new(distances, json_pack("{s:o, s:f}", "point", numbers(point, 3), "distance",
                                               qmat_envelope_distance(envelope, point, NULL)));
    for (size_t s = 0; s < medial->sphere_count; s++) {
      const double *c = medial->spheres + 4 * s;
      support = fmax(support, c[0] * direction[0] + c[1] * direction[1] + c[2] * direction[2] + c[3]);
    }
    json_array_append_new(supports, json_pack("{s:o, s:f}", "direction", numbers(direction, 3), "distance", support));
    double left = INFINITY;
    for (int step = 0; step < 1000000 && at <= 8 * size; step++) {
      double place[3];
      for (int k = 0; k < 3; k++) place[k] = point[k] + at * direction[k];
      left = qmat_envelope_distance(envelope, place, NULL);
      if (left <= 1e-13 * size) break;
      at += left;
    }
    const bool hits = left <= 1e-13 * size;
    json_array_append_new(rays, json_pack("{s:o, s:o, s:o}", "origin", numbers(point, 3), "direction",
                                          numbers(direction, 3), "distance", hits ? json_real(at) : json_null()));
  }
  qmat_envelope_free(envelope);
  REQUIRE(json_object_set_new(expected, "size", json_real(size)) == 0 &&
          json_object_set_new(expected, "distances", distances) == 0 &&
          json_object_set_new(expected, "supports", supports) == 0 && json_object_set_new(expected, "rays", rays) == 0);
}

/* ---- the files ---- */

static void save(const char *folder, const char *name, const char *ending, const void *bytes, size_t size) {
  char path[512];
  snprintf(path, sizeof path, "%s/%s.%s", folder, name, ending);
  FILE *file = fopen(path, "wb");
  REQUIRE(file && fwrite(bytes, 1, size, file) == size && fclose(file) == 0);
}

static void save_json(const char *folder, const char *name, const char *ending, const json_t *root, size_t flags) {
  size_t size;
  char *text = qmat_json_text(root, flags, &size);
  REQUIRE(text);
  text[size] = '\n';
  save(folder, name, ending, text, size + 1);
  qmat_free(text);
}

static double error_of(size_t sphere) {
  return random_number(4, sphere, 0, 0.01);
}

/* Puts errors, joints and weights of the spheres into the plain form, without the skin that the writer asks for, and
 * their expected values into `expected`. */
static void add_sphere_data(const qmat_medial *medial, bool floats, json_t *root, json_t *expected) {
  const size_t count = medial->sphere_count;
  qmat_context context = {0};
  double *errors = qmat_alloc(count, sizeof *errors), *weights = qmat_alloc(count, 4 * sizeof *weights);
  uint16_t *joints = qmat_alloc(count, 4 * sizeof *joints);
  REQUIRE(errors && weights && joints);
  for (size_t i = 0; i < count; i++) {
    errors[i] = error_of(i);
    for (size_t k = 0; k < 4; k++) {
      joints[4 * i + k] = (uint16_t)((i + 300 * k) % 1000);
      weights[4 * i + k] = k > i % 4 ? 0 : random_number(5, 4 * i + k, 0.1, 1);
    }
  }
  const qmat_sphere_data data = {.errors = errors, .joints = joints, .weights = weights};
  uint8_t *bytes;
  size_t size;
  REQUIRE(qmat_flat_encode(&context, medial, &data, NULL, floats, &bytes, &size) == QMAT_OK);
  char *text = qmat_base64_encode(bytes, size);
  json_t *extras = json_object_get(json_array_get(json_object_get(root, "nodes"), 0), "extras");
  REQUIRE(text && json_object_set_new(extras, "qmat_flat", json_string(text)) == 0);
  json_t *list = json_array();
  for (size_t i = 0; i < count; i++) {
    json_t *row = json_array();
    const double sum = weights[4 * i] + weights[4 * i + 1] + weights[4 * i + 2] + weights[4 * i + 3];
    for (size_t k = 0; k < 4; k++) {
      json_array_append_new(row, json_integer(joints[4 * i + k]));
      weights[4 * i + k] /= sum;
    }
    json_array_append_new(list, row);
  }
  REQUIRE(json_object_set_new(expected, "errors", numbers(errors, count)) == 0 &&
          json_object_set_new(expected, "joints", list) == 0 &&
          json_object_set_new(expected, "weights", rows_of(weights, count, 4)) == 0);
  qmat_free(text);
  qmat_free(bytes);
  qmat_free(joints);
  qmat_free(weights);
  qmat_free(errors);
}

static void make(const char *folder, const char *name, qmat_medial *medial, qmat_flat_form form, bool binary,
                 bool has_data) {
  qmat_context context = {0};
  qmat_mesh *box = binary ? make_box() : NULL;
  double errors[64];
  REQUIRE(medial->sphere_count <= sizeof errors / sizeof *errors);
  for (size_t i = 0; i < medial->sphere_count; i++) errors[i] = error_of(i);
  const qmat_gltf_options options = {
      .binary = binary,
      .flat = form,
      .quantisation = 1e-3,
      .name = name,
      .sphere_errors = binary ? errors : NULL,
      .errors = {
          .diagonal = 4, .epsilon = 0.01, .error_out = 0.005, .error_in = 0.0075, .certified = QMAT_CERTIFICATE_YES}};
  qmat_file *file;
  REQUIRE(qmat_gltf_write(&context, medial, box, &options, &file) == QMAT_OK);
  const qmat_file_part *part = &file->parts[0];
  json_t *expected = json_object(), *root = NULL;
  if (binary) {
    save(folder, name, "glb", part->bytes, part->size);
    REQUIRE(json_object_set_new(expected, "errors", numbers(errors, medial->sphere_count)) == 0);
    root = json_loadb((const char *)part->bytes + 20, part->bytes[12] | (size_t)part->bytes[13] << 8, 0, NULL);
  } else {
    root = json_loadb((const char *)part->bytes, part->size, 0, NULL);
    if (has_data) add_sphere_data(medial, form == QMAT_FLAT_FLOAT, root, expected);
    save_json(folder, name, "gltf", root, JSON_INDENT(1));
  }
  const json_t *extras = json_object_get(json_array_get(json_object_get(root, "nodes"), 0), "extras");
  const json_t *flat = json_object_get(extras, "qmat_flat"),
               *within = json_object_get(extras, "qmat_flat_quantisation");
  uint8_t *bytes;
  size_t size;
  qmat_medial *decoded;
  REQUIRE(qmat_base64_decode(&context, json_string_value(flat), json_string_length(flat), &bytes, &size) == QMAT_OK);
  REQUIRE(qmat_flat_decode(&context, bytes, size, NULL, &decoded) == QMAT_OK);
  REQUIRE(json_object_set_new(expected, "within", json_real(json_number_value(within))) == 0 &&
          json_object_set_new(expected, "spheres", rows_of(medial->spheres, medial->sphere_count, 4)) == 0);
  add_simplices(expected, medial);
  add_queries(expected, decoded);
  save_json(folder, name, "expected.json", expected, JSON_COMPACT);
  qmat_value_release(&decoded->base);
  qmat_free(bytes);
  json_decref(expected);
  json_decref(root);
  qmat_value_release(&file->base);
  if (box) qmat_value_release(&box->base);
  qmat_value_release(&medial->base);
}

int main(int argc, char **argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: golden FOLDER\n");
    return 2;
  }
  make(argv[1], "sphere", make_sphere(), QMAT_FLAT_SHORT, false, false);
  make(argv[1], "capsule", make_capsule(), QMAT_FLAT_FLOAT, false, false);
  make(argv[1], "degenerate", make_degenerate(), QMAT_FLAT_FLOAT, false, false);
  make(argv[1], "mixed", make_mixed(41), QMAT_FLAT_SHORT, false, true);
  make(argv[1], "mixed_float", make_mixed(33), QMAT_FLAT_FLOAT, false, true);
  make(argv[1], "shown", make_mixed(20), QMAT_FLAT_AUTO, true, false);
  return 0;
}
