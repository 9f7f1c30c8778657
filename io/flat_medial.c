/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/flat_medial.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "core/geometry/medial_build.h"
#include "core/node.h"
#include "io/bytes.h"
#include "io/stored_medial.h"

static const char magic[4] = {'Q', 'M', 'A', 'T'};
enum { VERSION = 1, HEADER_SIZE = 64 };
enum { FLAG_FLOATS = 1, FLAG_WIDE = 2, FLAG_ERRORS = 4, FLAG_JOINTS = 8, ALL_FLAGS = 15 };
#define LARGEST 65535.0

/* A stored number q stands for offset + scale * q; with floats the offset is 0 and the scale 1. */
typedef struct quantiser {
  float offset, scale;
} quantiser;

/* The largest float that is at most `number`, which must be finite. */
static float round_down(double number) {
  const float near = (float)number;
  return (double)near > number ? nextafterf(near, -INFINITY) : near;
}

static float round_up(double number) {
  return -round_down(-number);
}

static quantiser quantiser_of(double low, double high) {
  const float offset = round_down(low);
  float scale = round_up((high - (double)offset) / LARGEST);
  /* The product may be rounded to less than the range. */
  while ((double)offset + LARGEST * (double)scale < high) scale = nextafterf(scale, INFINITY);
  return (quantiser){offset, scale};
}

static uint16_t quantise(const quantiser *q, double number) {
  if (!(q->scale > 0)) return 0;
  return (uint16_t)fmin(fmax(round((number - (double)q->offset) / (double)q->scale), 0), LARGEST);
}

static double restore(const quantiser *q, double stored) {
  return (double)q->offset + (double)q->scale * stored;
}

/* ---- encoding ---- */

typedef struct encoder {
  const qmat_medial *medial;
  const qmat_sphere_data *data;
  double origin[3];
  bool floats, wide;
  quantiser quantisers[4]; /* of x, y, z and the radius */
  double loss;             /* the largest move of a sphere by storage */
  qmat_writer writer;
} encoder;

static double coordinate(const encoder *e, size_t sphere, size_t k) {
  return e->medial->spheres[4 * sphere + k] - (k < 3 ? e->origin[k] : 0);
}

static qmat_status choose_quantisers(qmat_context *context, encoder *e) {
  for (size_t k = 0; k < 4; k++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < e->medial->sphere_count; i++) {
      const double number = coordinate(e, i, k);
      if (!(fabs(number) <= (double)FLT_MAX / 4)) {
        char text[32];
        qmat_format_number(number, text, sizeof text);
        qmat_fail(context, QMAT_ERROR_GEOMETRY, "%s does not fit into single precision", text);
        return qmat_fail_element(context, "sphere", (int64_t)i);
      }
      low = fmin(low, number);
      high = fmax(high, number);
    }
    e->quantisers[k] = e->floats ? (quantiser){0, 1} : quantiser_of(low, high);
  }
  return QMAT_OK;
}

/* Every part starts at a multiple of 4 bytes. */
static void align(qmat_writer *writer) {
  while (writer->size % 4 != 0 && !writer->failed) qmat_put_u8(writer, 0);
}

static void put_spheres(encoder *e) {
  for (size_t i = 0; i < e->medial->sphere_count; i++) {
    double square = 0, moved = 0;
    for (size_t k = 0; k < 4; k++) {
      const double number = coordinate(e, i, k);
      double stored;
      if (e->floats) {
        stored = (double)(float)number;
        qmat_put_f32(&e->writer, (float)number);
      } else {
        const uint16_t q = quantise(&e->quantisers[k], number);
        stored = restore(&e->quantisers[k], q);
        qmat_put_u16(&e->writer, q);
      }
      moved = fabs(number - stored);
      if (k < 3) square += moved * moved;
    }
    e->loss = fmax(e->loss, nextafter(sqrt(square) + moved, INFINITY));
  }
}

/* An error of a sphere includes what storage moves it by. */
static double error_of(const encoder *e, size_t sphere) {
  return nextafter(e->data->errors[sphere] + e->loss, INFINITY);
}

static quantiser error_quantiser(const encoder *e) {
  double most = 0;
  for (size_t i = 0; i < e->medial->sphere_count; i++) most = fmax(most, error_of(e, i));
  return e->floats ? (quantiser){0, 1} : quantiser_of(0, fmin(most, (double)FLT_MAX / 4));
}

static void put_errors(encoder *e, const quantiser *q) {
  for (size_t i = 0; i < e->medial->sphere_count; i++) {
    const double error = error_of(e, i);
    if (e->floats) {
      qmat_put_f32(&e->writer, round_up(error));
      continue;
    }
    uint16_t stored = quantise(q, error);
    if (stored < LARGEST && restore(q, stored) < error) stored++;
    qmat_put_u16(&e->writer, stored);
  }
  align(&e->writer);
}

static void put_simplices(encoder *e, const uint32_t *faces, const size_t counts[3]) {
  for (size_t kind = 0; kind < 3; kind++) {
    for (size_t i = 0; i < counts[kind]; i++, faces += 3) {
      for (size_t k = 0; k < 3 - kind; k++) {
        if (e->wide) {
          qmat_put_u32(&e->writer, faces[k]);
        } else {
          qmat_put_u16(&e->writer, (uint16_t)faces[k]);
        }
      }
    }
    align(&e->writer);
  }
}

/* The weights of a sphere as whole numbers that sum to 65535: the largest gets what rounding leaves. */
static void put_weights(encoder *e, const double *weights) {
  const double sum = weights[0] + weights[1] + weights[2] + weights[3];
  int32_t stored[4], left = (int32_t)LARGEST;
  size_t largest = 0;
  for (size_t k = 0; k < 4; k++) {
    stored[k] = (int32_t)floor(LARGEST * weights[k] / sum);
    left -= stored[k];
    if (weights[k] > weights[largest]) largest = k;
  }
  stored[largest] += left;
  for (size_t k = 0; k < 4; k++) qmat_put_u16(&e->writer, (uint16_t)stored[k]);
}

static void put_all(encoder *e, const uint32_t *faces, const size_t counts[3]) {
  const size_t count = e->medial->sphere_count;
  const int flags = (e->floats ? FLAG_FLOATS : 0) | (e->wide ? FLAG_WIDE : 0) | (e->data->errors ? FLAG_ERRORS : 0) |
                    (e->data->joints ? FLAG_JOINTS : 0);
  qmat_writer *out = &e->writer;
  qmat_put_bytes(out, magic, sizeof magic);
  qmat_put_u16(out, VERSION);
  qmat_put_u16(out, (uint16_t)flags);
  qmat_put_u32(out, (uint32_t)count);
  for (size_t kind = 0; kind < 3; kind++) qmat_put_u32(out, (uint32_t)counts[kind]);
  for (size_t k = 0; k < 4; k++) qmat_put_f32(out, e->quantisers[k].offset);
  for (size_t k = 0; k < 4; k++) qmat_put_f32(out, e->quantisers[k].scale);
  const size_t place = out->size; /* of the scale of errors, which depends on the loss */
  qmat_put_u32(out, 0);
  qmat_put_u32(out, 0);
  put_spheres(e);
  if (e->data->errors) {
    const quantiser q = error_quantiser(e);
    qmat_writer scale = {0};
    qmat_put_f32(&scale, q.scale);
    if (!scale.failed && !out->failed) memcpy(out->bytes + place, scale.bytes, 4);
    out->failed = out->failed || scale.failed;
    qmat_writer_uninit(&scale);
    put_errors(e, &q);
  }
  put_simplices(e, faces, counts);
  for (size_t i = 0; i < 4 * count && e->data->joints; i++) qmat_put_u16(out, e->data->joints[i]);
  for (size_t i = 0; i < count && e->data->joints; i++) put_weights(e, e->data->weights + 4 * i);
}

qmat_status qmat_flat_encode(qmat_context *context, const qmat_medial *medial, const qmat_sphere_data *data,
                             const double *origin, bool floats, uint8_t **bytes, size_t *size) {
  static const qmat_sphere_data none = {0};
  encoder e = {.medial = medial, .data = data ? data : &none, .floats = floats, .wide = medial->sphere_count > 65536};
  uint32_t *faces = NULL;
  size_t counts[3];
  *bytes = NULL;
  *size = 0;
  for (int k = 0; k < 3 && origin; k++) e.origin[k] = origin[k];
  if (medial->sphere_count == 0) return qmat_fail(context, QMAT_ERROR_GEOMETRY, "the medial mesh has no spheres");
  qmat_status status = choose_quantisers(context, &e);
  if (status == QMAT_OK) status = qmat_medial_faces(context, medial, &faces, counts);
  if (status == QMAT_OK) {
    put_all(&e, faces, counts);
    if (e.writer.failed) status = qmat_fail_memory(context, "the flat form of a medial mesh");
  }
  if (status == QMAT_OK) {
    *bytes = e.writer.bytes;
    *size = e.writer.size;
    e.writer = (qmat_writer){0};
  }
  qmat_writer_uninit(&e.writer);
  qmat_free(faces);
  return status;
}

/* ---- decoding ---- */

typedef struct header {
  uint32_t flags, sphere_count, counts[3];
  quantiser quantisers[4];
} header;

static uint64_t aligned(uint64_t size) {
  return (size + 3) / 4 * 4;
}

/* The size that the header promises. No product of its 32-bit counts overflows. */
static uint64_t size_of(const header *h) {
  const uint64_t width = h->flags & FLAG_WIDE ? 4 : 2, real = h->flags & FLAG_FLOATS ? 4 : 2, count = h->sphere_count;
  uint64_t size = HEADER_SIZE + 4 * real * count;
  if (h->flags & FLAG_ERRORS) size += aligned(real * count);
  for (uint64_t kind = 0; kind < 3; kind++) size += aligned((3 - kind) * width * h->counts[kind]);
  return size + (h->flags & FLAG_JOINTS ? 16 * count : 0);
}

static qmat_status take_header(qmat_context *context, qmat_byte_reader *reader, header *h) {
  const uint8_t *start = qmat_take_bytes(reader, sizeof magic);
  if (!start || memcmp(start, magic, sizeof magic) != 0)
    return qmat_fail(context, QMAT_ERROR_FORMAT, "not flat data: it does not start with \"QMAT\"");
  const uint32_t version = qmat_take_u16(reader);
  h->flags = qmat_take_u16(reader);
  h->sphere_count = qmat_take_u32(reader);
  for (int kind = 0; kind < 3; kind++) h->counts[kind] = qmat_take_u32(reader);
  for (int k = 0; k < 4; k++) h->quantisers[k].offset = qmat_take_f32(reader);
  for (int k = 0; k < 4; k++) h->quantisers[k].scale = qmat_take_f32(reader);
  qmat_take_u32(reader);
  qmat_take_u32(reader);
  if (reader->failed) return qmat_fail(context, QMAT_ERROR_FORMAT, "flat data end within their header");
  if (version != VERSION)
    return qmat_fail(context, QMAT_ERROR_FORMAT, "version %u of flat data is not supported (only %d is)", version,
                     VERSION);
  if (h->flags & ~(uint32_t)ALL_FLAGS)
    return qmat_fail(context, QMAT_ERROR_FORMAT, "flat data have unknown flags: %u", h->flags);
  if (h->sphere_count == 0) return qmat_fail(context, QMAT_ERROR_FORMAT, "flat data hold no sphere");
  if (size_of(h) != reader->size)
    return qmat_fail(context, QMAT_ERROR_FORMAT, "flat data have %zu bytes, but their header promises %llu",
                     reader->size, (unsigned long long)size_of(h));
  return QMAT_OK;
}

static qmat_status take_spheres(qmat_context *context, qmat_byte_reader *reader, const header *h, const double *origin,
                                qmat_medial *medial) {
  for (size_t i = 0; i < 4 * medial->sphere_count; i++) {
    const size_t k = i % 4;
    const double stored = h->flags & FLAG_FLOATS ? (double)qmat_take_f32(reader) : qmat_take_u16(reader);
    const double number = restore(&h->quantisers[k], stored);
    medial->spheres[i] = number + (origin && k < 3 ? origin[k] : 0);
    if (isfinite(medial->spheres[i]) && (k < 3 || number >= 0)) continue;
    qmat_fail(context, QMAT_ERROR_FORMAT, k < 3 ? "a coordinate is not finite" : "the radius is below 0 or not finite");
    return qmat_fail_element(context, "sphere", (int64_t)(i / 4));
  }
  if (h->flags & FLAG_ERRORS)
    qmat_take_bytes(reader, (size_t)aligned((h->flags & FLAG_FLOATS ? 4 : 2) * medial->sphere_count));
  return QMAT_OK;
}

/* `ids` has room for `count` ids; NULL: they are only checked. */
static qmat_status take_ids(qmat_context *context, qmat_byte_reader *reader, const header *h, size_t count,
                            uint32_t *ids) {
  const bool wide = h->flags & FLAG_WIDE;
  for (size_t i = 0; i < count; i++) {
    const uint32_t id = wide ? qmat_take_u32(reader) : qmat_take_u16(reader);
    if (ids) ids[i] = id;
    if (id >= h->sphere_count)
      return qmat_fail(context, QMAT_ERROR_FORMAT, "sphere %u of a simplex is beyond the %u spheres", id,
                       h->sphere_count);
  }
  if (!wide && count % 2 != 0) qmat_take_u16(reader);
  return QMAT_OK;
}

qmat_status qmat_flat_decode(qmat_context *context, const uint8_t *bytes, size_t size, const double *origin,
                             qmat_medial **medial) {
  qmat_byte_reader reader = {.bytes = bytes, .size = size};
  header h = {0};
  *medial = NULL;
  qmat_status status = take_header(context, &reader, &h);
  if (status != QMAT_OK) return status;
  const size_t slab_count = h.counts[0], cone_count = h.counts[1];
  uint32_t *slabs = qmat_alloc(slab_count, 3 * sizeof *slabs), *cones = qmat_alloc(cone_count, 2 * sizeof *cones);
  qmat_medial *made = qmat_medial_new();
  if (made) {
    made->sphere_count = h.sphere_count;
    made->spheres = qmat_alloc(made->sphere_count, 4 * sizeof *made->spheres);
  }
  if (!slabs || !cones || !made || !made->spheres) status = qmat_fail_memory(context, "a medial mesh");
  if (status == QMAT_OK) status = take_spheres(context, &reader, &h, origin, made);
  if (status == QMAT_OK) status = take_ids(context, &reader, &h, 3 * slab_count, slabs);
  if (status == QMAT_OK) status = take_ids(context, &reader, &h, 2 * cone_count, cones);
  if (status == QMAT_OK) status = take_ids(context, &reader, &h, h.counts[2], NULL);
  if (status == QMAT_OK) status = qmat_medial_set_simplices(context, made, cones, cone_count, slabs, slab_count);
  if (status == QMAT_OK) status = qmat_value_seal(context, &made->base);
  if (status == QMAT_OK) {
    *medial = made;
  } else if (made) {
    qmat_value_release(&made->base);
  }
  qmat_free(cones);
  qmat_free(slabs);
  return status;
}
