/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdz.h"

#include <string.h>

#include <zlib.h>

enum {
  LOCAL_SIGNATURE = 0x04034b50,
  CENTRAL_SIGNATURE = 0x02014b50,
  END_SIGNATURE = 0x06054b50,
  LOCAL_SIZE = 30,
  CENTRAL_SIZE = 46,
  END_SIZE = 22,
  LARGEST_COMMENT = 65535,
  ALIGNMENT = 64,
  FIRST_DATE = 1 << 5 | 1, /* 1 January 1980: equal content makes equal bytes */
  PADDING_ID = 0x1986      /* the extra field that aligns a member */
};

static qmat_status fail(qmat_context *context, const char *path, const char *what) {
  return qmat_fail_file(context, QMAT_ERROR_FORMAT, path, "%s", what);
}

static uint32_t checksum(const uint8_t *bytes, size_t size) {
  return (uint32_t)crc32_z(crc32_z(0, NULL, 0), bytes, size);
}

/* The offset of the end record of the archive; SIZE_MAX when there is none. */
static size_t find_end(const qmat_bytes *bytes) {
  const size_t furthest = END_SIZE + LARGEST_COMMENT;
  if (bytes->size < END_SIZE) return SIZE_MAX;
  const size_t first = bytes->size > furthest ? bytes->size - furthest : 0;
  for (size_t at = bytes->size - END_SIZE + 1; at-- > first;) {
    if (memcmp(bytes->data + at, "PK\5\6", 4) == 0) return at;
  }
  return SIZE_MAX;
}

static qmat_status read_member(qmat_context *context, const qmat_bytes *bytes, const char *path,
                               qmat_byte_reader *central, qmat_usdz_member *member) {
  const uint32_t signature = qmat_take_u32(central);
  qmat_take_bytes(central, 4);
  const uint16_t flags = qmat_take_u16(central), method = qmat_take_u16(central);
  qmat_take_bytes(central, 4);
  const uint32_t crc = qmat_take_u32(central), packed = qmat_take_u32(central), size = qmat_take_u32(central);
  const uint16_t name_length = qmat_take_u16(central), extra = qmat_take_u16(central), comment = qmat_take_u16(central);
  qmat_take_bytes(central, 8);
  qmat_byte_reader local = {.bytes = bytes->data, .size = bytes->size, .at = qmat_take_u32(central)};
  const uint8_t *name = qmat_take_bytes(central, name_length);
  qmat_take_bytes(central, (size_t)extra + comment);
  if (central->failed || signature != CENTRAL_SIGNATURE || local.at > bytes->size)
    return fail(context, path, "the directory of the archive is damaged");
  member->name = qmat_alloc((size_t)name_length + 1, 1);
  if (!member->name) return qmat_fail_memory(context, "a USDZ package");
  memcpy(member->name, name, name_length);
  member->name[name_length] = '\0';
  const uint32_t local_signature = qmat_take_u32(&local);
  qmat_take_bytes(&local, 22);
  const uint16_t local_name = qmat_take_u16(&local), local_extra = qmat_take_u16(&local);
  qmat_take_bytes(&local, (size_t)local_name + local_extra);
  if (flags & 1) return fail(context, path, "a member of the archive is encrypted");
  if (method != 0) return fail(context, path, "a member of the archive is compressed, which USDZ forbids");
  member->bytes = qmat_take_bytes(&local, size);
  member->size = size;
  if (local_signature != LOCAL_SIGNATURE || !member->bytes || packed != size)
    return fail(context, path, "a member of the archive is damaged");
  if (checksum(member->bytes, size) != crc)
    return fail(context, path, "the checksum of a member of the archive is wrong");
  return QMAT_OK;
}

bool qmat_usdz_is_package(const uint8_t *bytes, size_t size) {
  return size >= 4 && memcmp(bytes, "PK\3\4", 4) == 0;
}

qmat_status qmat_usdz_open(qmat_context *context, const qmat_bytes *bytes, const char *path, qmat_usdz *package) {
  *package = (qmat_usdz){0};
  const size_t end = find_end(bytes);
  if (end == SIZE_MAX) return fail(context, path, "the archive has no directory: it may be incomplete");
  qmat_byte_reader record = {.bytes = bytes->data, .size = bytes->size, .at = end + 10};
  const size_t count = qmat_take_u16(&record);
  qmat_take_u32(&record);
  const size_t start = qmat_take_u32(&record);
  if (start > end || (end - start) / CENTRAL_SIZE < count)
    return fail(context, path, "the directory of the archive is damaged");
  package->members = qmat_calloc(count, sizeof *package->members);
  if (!package->members) return qmat_fail_memory(context, "a USDZ package");
  qmat_byte_reader central = {.bytes = bytes->data, .size = end, .at = start};
  /* Members must not overlap: checking their sums is then linear in the file. */
  size_t total = 0;
  for (size_t i = 0; i < count; i++) {
    package->member_count = i + 1;
    qmat_status status = read_member(context, bytes, path, &central, &package->members[i]);
    if (status != QMAT_OK) return status;
    total += package->members[i].size;
    if (total > bytes->size) return fail(context, path, "members of the archive overlap");
  }
  return QMAT_OK;
}

void qmat_usdz_uninit(qmat_usdz *package) {
  for (size_t i = 0; i < package->member_count; i++) qmat_free(package->members[i].name);
  qmat_free(package->members);
  *package = (qmat_usdz){0};
}

const qmat_usdz_member *qmat_usdz_find(const qmat_usdz *package, const char *name) {
  for (size_t i = 0; i < package->member_count; i++) {
    if (strcmp(package->members[i].name, name) == 0) return &package->members[i];
  }
  return NULL;
}

/* The fields that the local header and the directory share. */
static void put_facts(qmat_writer *writer, uint32_t crc, uint32_t size, uint16_t name_length, uint16_t extra) {
  qmat_put_u16(writer, 10); /* version needed */
  qmat_put_u16(writer, 0);  /* flags */
  qmat_put_u16(writer, 0);  /* stored */
  qmat_put_u16(writer, 0);  /* time */
  qmat_put_u16(writer, FIRST_DATE);
  qmat_put_u32(writer, crc);
  qmat_put_u32(writer, size);
  qmat_put_u32(writer, size);
  qmat_put_u16(writer, name_length);
  qmat_put_u16(writer, extra);
}

void qmat_usdz_add(qmat_usdz_writer *writer, const char *name, const void *bytes, size_t size) {
  qmat_writer *out = writer->out, *directory = &writer->directory;
  const size_t name_length = strlen(name), start = out->size, header = start + LOCAL_SIZE + name_length;
  /* The header of an extra field has 4 bytes. */
  const size_t extra = ALIGNMENT - (header + 4) % ALIGNMENT + 4;
  if (size > UINT32_MAX - 4096 || start > UINT32_MAX - 4096 - size || name_length > 255 ||
      writer->count == UINT16_MAX) {
    out->failed = true;
    return;
  }
  const uint32_t crc = checksum(bytes, size);
  qmat_put_u32(out, LOCAL_SIGNATURE);
  put_facts(out, crc, (uint32_t)size, (uint16_t)name_length, (uint16_t)extra);
  qmat_put_text(out, name);
  qmat_put_u16(out, PADDING_ID);
  qmat_put_u16(out, (uint16_t)(extra - 4));
  for (size_t i = 4; i < extra; i++) qmat_put_u8(out, 0);
  qmat_put_bytes(out, bytes, size);
  qmat_put_u32(directory, CENTRAL_SIGNATURE);
  qmat_put_u16(directory, 10); /* version made by */
  put_facts(directory, crc, (uint32_t)size, (uint16_t)name_length, 0);
  for (int i = 0; i < 10; i++) qmat_put_u8(directory, 0); /* comment, disk, attributes */
  qmat_put_u32(directory, (uint32_t)start);
  qmat_put_text(directory, name);
  writer->count++;
}

void qmat_usdz_finish(qmat_usdz_writer *writer) {
  qmat_writer *out = writer->out, *directory = &writer->directory;
  const size_t start = out->size;
  if (start > UINT32_MAX - 4096 || directory->failed) out->failed = true;
  qmat_put_bytes(out, directory->bytes, directory->size);
  qmat_put_u32(out, END_SIGNATURE);
  qmat_put_u32(out, 0); /* disks */
  qmat_put_u16(out, (uint16_t)writer->count);
  qmat_put_u16(out, (uint16_t)writer->count);
  qmat_put_u32(out, (uint32_t)directory->size);
  qmat_put_u32(out, (uint32_t)start);
  qmat_put_u16(out, 0);
  qmat_writer_uninit(directory);
}

void qmat_usdz_put(qmat_writer *writer, const char *name, const void *bytes, size_t size) {
  qmat_usdz_writer archive = {.out = writer};
  qmat_usdz_add(&archive, name, bytes, size);
  qmat_usdz_finish(&archive);
}
