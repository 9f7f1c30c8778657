/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The C reader against the golden files, and against 10,000 mutations of each: c_test FOLDER. It is built with the
 * address and undefined-behaviour sanitizers, and shares no code with the library. */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jansson.h>

#include "examples/readers/qmat_reader.h"

static const char *file_name;
static size_t failures, checks;

static void check(int holds, const char *what, size_t index) {
  checks++;
  if (holds) return;
  if (failures++ < 20) fprintf(stderr, "%s: %s %zu\n", file_name, what, index);
}

static uint8_t *load(const char *path, size_t *size) {
  FILE *file = fopen(path, "rb");
  if (!file) abort();
  fseek(file, 0, SEEK_END);
  *size = (size_t)ftell(file);
  rewind(file);
  uint8_t *bytes = malloc(*size);
  if (!bytes || fread(bytes, 1, *size, file) != *size) abort();
  fclose(file);
  return bytes;
}

static double at(const json_t *rows, size_t row, size_t column) {
  return json_number_value(json_array_get(json_array_get(rows, row), column));
}

static void take(const json_t *object, const char *key, double vector[3]) {
  for (size_t k = 0; k < 3; k++) vector[k] = json_number_value(json_array_get(json_object_get(object, key), k));
}

static void check_ids(const json_t *expected, const char *key, const uint32_t *ids, size_t count, size_t width) {
  const json_t *rows = json_object_get(expected, key);
  check(json_array_size(rows) == count, key, count);
  for (size_t i = 0; i < count * width; i++) check((uint32_t)at(rows, i / width, i % width) == ids[i], key, i / width);
}

static void check_medial(const qmr_medial *m, const json_t *expected) {
  const json_t *spheres = json_object_get(expected, "spheres"), *errors = json_object_get(expected, "errors"),
               *joints = json_object_get(expected, "joints");
  const double within = json_number_value(json_object_get(expected, "within"));
  check(json_array_size(spheres) == m->sphere_count, "spheres", m->sphere_count);
  for (size_t i = 0; i < m->sphere_count; i++) {
    double move = 0;
    for (size_t k = 0; k < 3; k++) move += pow(m->spheres[4 * i + k] - at(spheres, i, k), 2);
    move = sqrt(move) + fabs(m->spheres[4 * i + 3] - at(spheres, i, 3));
    check(move <= within * (1 + 1e-9), "moved sphere", i);
  }
  check_ids(expected, "slabs", m->slabs, m->slab_count, 3);
  check_ids(expected, "cones", m->cones, m->cone_count, 2);
  check_ids(expected, "points", m->points, m->point_count, 1);
  check(!errors == !m->errors && !joints == !m->joints && !joints == !m->weights, "data of spheres", 0);
  for (size_t i = 0; errors && i < m->sphere_count; i++) {
    const double error = json_number_value(json_array_get(errors, i));
    check(m->errors[i] >= error + within * (1 - 1e-9) && m->errors[i] <= error + 1.1 * within + 1e-6, "error", i);
    for (size_t k = 0; k < 4 && joints; k++) {
      check(m->joints[4 * i + k] == (uint16_t)at(joints, i, k), "joint", i);
      check(fabs(m->weights[4 * i + k] - at(json_object_get(expected, "weights"), i, k)) < 1e-4, "weight", i);
    }
  }
}

static void check_answers(const qmr_medial *m, const json_t *expected) {
  const double size = json_number_value(json_object_get(expected, "size")), near = 1e-9 * size;
  size_t i;
  json_t *item;
  json_array_foreach(json_object_get(expected, "distances"), i, item) {
    double p[3], closest[3], square = 0;
    take(item, "point", p);
    const double distance = qmr_distance(m, p, closest);
    check(fabs(distance - json_number_value(json_object_get(item, "distance"))) <= near, "distance", i);
    for (int k = 0; k < 3; k++) square += pow(p[k] - closest[k], 2);
    check(fabs(sqrt(square) - fabs(distance)) <= near, "distance to the closest point", i);
    if (distance > 0) check(fabs(qmr_distance(m, closest, NULL)) <= near, "closest point", i);
  }
  json_array_foreach(json_object_get(expected, "supports"), i, item) {
    double d[3], point[3];
    take(item, "direction", d);
    const double reach = qmr_support(m, d, point);
    check(fabs(reach - json_number_value(json_object_get(item, "distance"))) <= near, "support", i);
    check(fabs(qmr_dot(point, d) - reach) <= near && qmr_distance(m, point, NULL) <= near, "support point", i);
  }
  json_array_foreach(json_object_get(expected, "rays"), i, item) {
    const json_t *wanted = json_object_get(item, "distance");
    double origin[3], d[3], normal[3] = {0, 0, 0}, place[3];
    take(item, "origin", origin);
    take(item, "direction", d);
    const double t = qmr_ray(m, origin, d, 8 * size, normal);
    check(json_is_null(wanted) ? t == -1 : fabs(t - json_number_value(wanted)) <= near, "ray", i);
    if (t < 0) continue;
    for (int k = 0; k < 3; k++) place[k] = origin[k] + t * d[k];
    check(t == 0 || fabs(qmr_distance(m, place, NULL)) <= near, "place that a ray meets", i);
    check(fabs(qmr_dot(normal, normal) - 1) < 1e-9 && (t == 0 || qmr_dot(normal, d) <= 0), "normal", i);
    if (t > near) check(qmr_ray(m, origin, d, t - near, NULL) == -1, "ray that ends before", i);
  }
}

/* xorshift64 */
static uint64_t next(uint64_t *state) {
  *state ^= *state << 13;
  *state ^= *state >> 7;
  *state ^= *state << 17;
  return *state;
}

/* Changes bytes, cuts or repeats the end; what can be decoded must be answerable. */
static void mutate(const uint8_t *from, size_t from_size, int as_text, uint64_t seed, size_t *decoded) {
  uint64_t state = seed * 2654435761u + 88172645463325252u;
  const size_t cut = next(&state) % 4 == 0 ? next(&state) % from_size : 0,
               more = next(&state) % 8 == 0 ? next(&state) % from_size : 0, size = from_size - cut + more;
  /* An exact allocation, so that the sanitizer sees every read beyond its end. */
  uint8_t *bytes = malloc(size + !size);
  if (!bytes) abort();
  for (size_t i = 0; i < size; i++) bytes[i] = from[i % from_size];
  for (uint64_t i = 0, edits = next(&state) % 6; i < edits && size > 0; i++) {
    const size_t where = (size_t)(next(&state) % (next(&state) % 2 && size > 64 ? 64 : size));
    static const uint8_t edges[] = {0, 1, 127, 128, 255};
    bytes[where] = next(&state) % 2 ? (uint8_t)next(&state) : edges[next(&state) % sizeof edges];
  }
  qmr_medial medial;
  size_t length = 0;
  const char *text = as_text ? qmr_find(bytes, size, NULL, &length) : NULL;
  const int result =
      as_text ? (text ? qmr_decode_base64(text, length, &medial) : -1) : qmr_decode(bytes, size, &medial);
  if (result == 0) {
    const double point[3] = {0.5, -1, 2}, direction[3] = {0.6, 0, -0.8};
    double closest[3], support[3], normal[3];
    ++*decoded;
    check(medial.sphere_count > 0, "spheres of a mutation", (size_t)seed);
    check(!isnan(qmr_distance(&medial, point, closest)), "distance of a mutation", (size_t)seed);
    check(!isnan(qmr_support(&medial, direction, support)), "support of a mutation", (size_t)seed);
    check(!isnan(qmr_ray(&medial, point, direction, 1e9, normal)), "ray of a mutation", (size_t)seed);
    qmr_free(&medial);
  } else if (text) {
    check(!medial.spheres && !medial.slabs && medial.sphere_count == 0, "what a failure leaves", (size_t)seed);
  }
  free(bytes);
}

/* The bytes that a base64 string stands for, by another way than the reader's. */
static uint8_t *plain_bytes(const char *text, size_t length, size_t *size) {
  static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  uint8_t *bytes = calloc(length, 1);
  if (!bytes) abort();
  *size = length / 4 * 3;
  for (size_t i = 0; i < length; i++) {
    if (text[i] == '=') (*size)--;
    for (size_t bit = 0; bit < 6 && text[i] != '='; bit++) {
      const size_t place = 6 * i + bit;
      if ((strchr(alphabet, text[i]) - alphabet) >> (5 - bit) & 1) bytes[place / 8] |= (uint8_t)(128 >> place % 8);
    }
  }
  uint8_t *exact = malloc(*size);
  if (!exact) abort();
  memcpy(exact, bytes, *size);
  free(bytes);
  return exact;
}

static void test_file(const char *folder, const char *name) {
  char path[512];
  size_t size, length = 0, blob_size, decoded = 0;
  file_name = name;
  snprintf(path, sizeof path, "%s/%s", folder, name);
  uint8_t *file = load(path, &size);
  snprintf(path, sizeof path, "%s/%.*s.expected.json", folder, (int)(strrchr(name, '.') - name), name);
  json_t *expected = json_load_file(path, 0, NULL);
  const char *text = qmr_find(file, size, NULL, &length);
  qmr_medial medial;
  size_t other;
  if (!expected || !text || qmr_decode_base64(text, length, &medial) != 0) {
    check(0, "the file cannot be decoded", 0);
  } else {
    check(qmr_find(file, size, text, &other) == NULL, "a second medial mesh", 0);
    check_medial(&medial, expected);
    check_answers(&medial, expected);
    qmr_free(&medial);
    uint8_t *blob = plain_bytes(text, length, &blob_size);
    for (uint64_t i = 0; i < 5000; i++) mutate(blob, blob_size, 0, i, &decoded);
    const size_t of_bytes = decoded;
    for (uint64_t i = 0; i < 5000; i++) mutate(file, size, 1, i, &decoded);
    check(of_bytes > 100 && of_bytes < 4900 && decoded - of_bytes > 100, "mutations that can be decoded", decoded);
    free(blob);
  }
  json_decref(expected);
  free(file);
}

int main(int argc, char **argv) {
  if (argc != 2) return 2;
  DIR *folder = opendir(argv[1]);
  size_t files = 0;
  for (const struct dirent *entry; folder && (entry = readdir(folder));) {
    const char *ending = strrchr(entry->d_name, '.');
    if (!ending || (strcmp(ending, ".gltf") != 0 && strcmp(ending, ".glb") != 0)) continue;
    test_file(argv[1], entry->d_name);
    files++;
  }
  if (folder) closedir(folder);
  printf("%zu files, %zu checks, %zu failures\n", files, checks, failures);
  return files < 6 || failures > 0;
}
