/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf/gltf_checker.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

qmat_status qmat_gltf_fail(const qmat_gltf_checker *check, const char *kind, size_t element, const char *format, ...) {
  char text[384];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  qmat_fail(check->context, QMAT_ERROR_FORMAT, "%s", text);
  if (kind) qmat_fail_element(check->context, kind, (int64_t)element);
  return qmat_fail_at(check->context, check->path, 0, 0);
}

qmat_status qmat_gltf_fail_memory(const qmat_gltf_checker *check) {
  qmat_fail_memory(check->context, "a glTF asset");
  return qmat_fail_at(check->context, check->path, 0, 0);
}

bool qmat_gltf_whole(const json_t *value, int64_t least, int64_t most, int64_t *number) {
  int64_t n;
  if (json_is_integer(value)) {
    n = json_integer_value(value);
  } else if (json_is_real(value) && fabs(json_real_value(value)) < 9e15 &&
             json_real_value(value) == floor(json_real_value(value))) {
    n = (int64_t)json_real_value(value);
  } else {
    return false;
  }
  if (n < least || n > most) return false;
  *number = n;
  return true;
}

qmat_status qmat_gltf_take_whole(const qmat_gltf_checker *check, json_t *object, const char *key, const char *kind,
                                 size_t element, int64_t least, int64_t most, int64_t *number, bool *present) {
  json_t *value = json_object_get(object, key);
  if (present) *present = value != NULL;
  if (!value && present) return QMAT_OK;
  if (!value) return qmat_gltf_fail(check, kind, element, "%s is missing", key);
  if (!qmat_gltf_whole(value, least, most, number)) {
    return qmat_gltf_fail(check, kind, element, "%s must be a whole number in [%lld, %lld]", key, (long long)least,
                          (long long)most);
  }
  if (json_object_set_new(object, key, json_integer(*number)) != 0) return qmat_gltf_fail_memory(check);
  return QMAT_OK;
}

qmat_status qmat_gltf_take_id(const qmat_gltf_checker *check, json_t *object, const char *key, const char *kind,
                              size_t element, const char *of, int64_t *id, bool *present) {
  size_t count = json_array_size(json_object_get(check->root, of));
  int64_t number = 0;
  bool there = true;
  qmat_status status =
      qmat_gltf_take_whole(check, object, key, kind, element, 0, INT64_MAX, &number, present ? &there : NULL);
  if (present) *present = there;
  if (status != QMAT_OK || !there) return status;
  if ((uint64_t)number >= count)
    return qmat_gltf_fail(check, kind, element, "%s is %lld, but there are %zu %s", key, (long long)number, count, of);
  *id = number;
  return QMAT_OK;
}

qmat_status qmat_gltf_take_numbers(const qmat_gltf_checker *check, const json_t *object, const char *key,
                                   const char *kind, size_t element, size_t count, double *numbers, bool *present) {
  const json_t *array = json_object_get(object, key);
  *present = array != NULL;
  if (!array) return QMAT_OK;
  if (!json_is_array(array) || (count != SIZE_MAX && json_array_size(array) != count)) {
    if (count == SIZE_MAX) return qmat_gltf_fail(check, kind, element, "%s must be an array of numbers", key);
    return qmat_gltf_fail(check, kind, element, "%s must be an array of %zu numbers", key, count);
  }
  for (size_t i = 0; i < json_array_size(array); i++) {
    const json_t *number = json_array_get(array, i);
    if (!json_is_number(number)) return qmat_gltf_fail(check, kind, element, "%s must hold numbers only", key);
    if (numbers) numbers[i] = json_number_value(number);
  }
  return QMAT_OK;
}

qmat_status qmat_gltf_take_object(const qmat_gltf_checker *check, const json_t *object, const char *key,
                                  const char *kind, size_t element, json_t **value) {
  *value = json_object_get(object, key);
  if (*value && !json_is_object(*value)) return qmat_gltf_fail(check, kind, element, "%s must be an object", key);
  return QMAT_OK;
}

qmat_status qmat_gltf_take_array(const qmat_gltf_checker *check, const json_t *object, const char *key,
                                 const char *kind, size_t element, json_t **value) {
  *value = json_object_get(object, key);
  if (*value && !json_is_array(*value)) return qmat_gltf_fail(check, kind, element, "%s must be an array", key);
  return QMAT_OK;
}

void qmat_gltf_keep_keys(json_t *object, const char *const keys[]) {
  const char *key;
  json_t *value;
  void *next;
  json_object_foreach_safe(object, next, key, value) {
    bool keep = false;
    for (size_t i = 0; keys[i]; i++) keep = keep || strcmp(keys[i], key) == 0;
    if (!keep) json_object_del(object, key);
  }
}
