/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/bytes.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/node.h"

#define LARGEST_FILE ((uint64_t)4 << 30)
#define PADDING 16

/* ---- whole files ---- */

qmat_status qmat_fail_file(qmat_context *context, qmat_status status, const char *path, const char *format, ...) {
  char message[sizeof context->error.message];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  qmat_fail(context, status, "%s", message);
  return qmat_fail_at(context, path, 0, 0);
}

qmat_status qmat_fail_io(qmat_context *context, const char *path, const char *what, int number) {
  const char *reason = strerrordesc_np(number);
  return qmat_fail_file(context, QMAT_ERROR_IO, path, "%s: %s", what, reason ? reason : "unknown error");
}

/* Whether the open file can be read whole. */
static qmat_status check_file(qmat_context *context, const char *path, int file, size_t *size) {
  struct stat about;
  if (fstat(file, &about) != 0) return qmat_fail_io(context, path, "cannot read the file", errno);
  if (!S_ISREG(about.st_mode)) {
    const char *kind = S_ISDIR(about.st_mode) ? "a folder" : S_ISFIFO(about.st_mode) ? "a pipe" : "a device or socket";
    return qmat_fail_file(context, QMAT_ERROR_IO, path, "this is %s, not a file", kind);
  }
  if (about.st_size == 0) return qmat_fail_file(context, QMAT_ERROR_FORMAT, path, "the file is empty");
  if ((uint64_t)about.st_size > LARGEST_FILE) {
    return qmat_fail_file(context, QMAT_ERROR_FORMAT, path,
                          "the file has %lld bytes, more than the 4 GiB that can be read", (long long)about.st_size);
  }
  *size = (size_t)about.st_size;
  return QMAT_OK;
}

static qmat_status read_whole(qmat_context *context, const char *path, int file, qmat_bytes *bytes) {
  size_t size = 0;
  qmat_status status = check_file(context, path, file, &size);
  if (status != QMAT_OK) return status;
  bytes->data = qmat_alloc(size + PADDING, 1);
  if (!bytes->data) {
    qmat_fail_memory(context, "the file");
    return qmat_fail_at(context, path, 0, 0);
  }
  while (bytes->size < size) {
    ssize_t got = read(file, bytes->data + bytes->size, size - bytes->size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return qmat_fail_io(context, path, "cannot read the file", errno);
    if (got == 0) return qmat_fail_file(context, QMAT_ERROR_IO, path, "the file became shorter while it was read");
    bytes->size += (size_t)got;
  }
  memset(bytes->data + size, 0, PADDING);
  return QMAT_OK;
}

qmat_status qmat_bytes_read_file(qmat_context *context, const char *path, qmat_bytes *bytes) {
  *bytes = (qmat_bytes){0};
  /* Without O_NONBLOCK, opening a pipe waits for its writer. */
  int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  qmat_status status =
      file < 0 ? qmat_fail_io(context, path, "cannot open the file", errno) : read_whole(context, path, file, bytes);
  if (file >= 0) close(file);
  if (status != QMAT_OK) qmat_bytes_uninit(bytes);
  qmat_note_file_read(context, path, bytes->data, bytes->size);
  return status;
}

void qmat_bytes_uninit(qmat_bytes *bytes) {
  qmat_free(bytes->data);
  *bytes = (qmat_bytes){0};
}

/* ---- binary numbers ---- */

size_t qmat_bytes_left(const qmat_byte_reader *reader) {
  return reader->size - reader->at;
}

const uint8_t *qmat_take_bytes(qmat_byte_reader *reader, size_t size) {
  if (reader->failed || qmat_bytes_left(reader) < size) {
    reader->failed = true;
    return NULL;
  }
  const uint8_t *bytes = reader->bytes + reader->at;
  reader->at += size;
  return bytes;
}

static uint64_t take_unsigned(qmat_byte_reader *reader, unsigned size) {
  const uint8_t *bytes = qmat_take_bytes(reader, size);
  uint64_t number = 0;
  if (!bytes) return 0;
  for (unsigned i = 0; i < size; i++) number = number << 8 | bytes[reader->big_endian ? i : size - 1 - i];
  return number;
}

uint8_t qmat_take_u8(qmat_byte_reader *reader) {
  return (uint8_t)take_unsigned(reader, 1);
}

uint16_t qmat_take_u16(qmat_byte_reader *reader) {
  return (uint16_t)take_unsigned(reader, 2);
}

uint32_t qmat_take_u32(qmat_byte_reader *reader) {
  return (uint32_t)take_unsigned(reader, 4);
}

uint64_t qmat_take_u64(qmat_byte_reader *reader) {
  return take_unsigned(reader, 8);
}

float qmat_take_f32(qmat_byte_reader *reader) {
  uint32_t bits = qmat_take_u32(reader);
  float number;
  memcpy(&number, &bits, sizeof number);
  return number;
}

double qmat_take_f64(qmat_byte_reader *reader) {
  uint64_t bits = qmat_take_u64(reader);
  double number;
  memcpy(&number, &bits, sizeof number);
  return number;
}
/* ---- building a file ---- */

void qmat_put_bytes(qmat_writer *writer, const void *bytes, size_t size) {
  if (writer->failed || size == 0) return;
  if (size > SIZE_MAX - writer->size ||
      qmat_grow((void **)&writer->bytes, &writer->capacity, writer->size + size, 1) != 0) {
    writer->failed = true;
    return;
  }
  memcpy(writer->bytes + writer->size, bytes, size);
  writer->size += size;
}

void qmat_put_text(qmat_writer *writer, const char *text) {
  qmat_put_bytes(writer, text, strlen(text));
}

void qmat_put_indent(qmat_writer *writer, size_t depth) {
  for (size_t i = 0; i < depth; i++) qmat_put_text(writer, "    ");
}

void qmat_put_integer(qmat_writer *writer, int64_t number) {
  char text[24];
  size_t at = sizeof text;
  uint64_t rest = number < 0 ? 0 - (uint64_t)number : (uint64_t)number;
  do {
    text[--at] = (char)('0' + rest % 10);
    rest /= 10;
  } while (rest > 0);
  if (number < 0) text[--at] = '-';
  qmat_put_bytes(writer, text + at, sizeof text - at);
}

void qmat_put_number(qmat_writer *writer, double number) {
  char text[32];
  if (fabs(number) < 1e15 && number == floor(number) && (number != 0 || !signbit(number))) {
    qmat_put_integer(writer, (int64_t)number);
  } else if (isfinite(number)) {
    qmat_format_number(number, text, sizeof text);
    if (text[0] == '\0') writer->failed = true;
    qmat_put_text(writer, text);
  } else {
    qmat_put_text(writer, isnan(number) ? "nan" : number < 0 ? "-inf" : "inf");
  }
}

static void put_unsigned(qmat_writer *writer, uint64_t number, unsigned size) {
  uint8_t bytes[8];
  for (unsigned i = 0; i < size; i++) bytes[i] = (uint8_t)(number >> (8 * i));
  qmat_put_bytes(writer, bytes, size);
}

void qmat_put_u8(qmat_writer *writer, uint8_t number) {
  put_unsigned(writer, number, 1);
}

void qmat_put_u16(qmat_writer *writer, uint16_t number) {
  put_unsigned(writer, number, 2);
}

void qmat_put_u32(qmat_writer *writer, uint32_t number) {
  put_unsigned(writer, number, 4);
}

void qmat_put_u64(qmat_writer *writer, uint64_t number) {
  put_unsigned(writer, number, 8);
}

void qmat_put_f32(qmat_writer *writer, float number) {
  uint32_t bits;
  memcpy(&bits, &number, sizeof bits);
  put_unsigned(writer, bits, 4);
}

void qmat_put_f64(qmat_writer *writer, double number) {
  uint64_t bits;
  memcpy(&bits, &number, sizeof bits);
  put_unsigned(writer, bits, 8);
}

void qmat_writer_uninit(qmat_writer *writer) {
  qmat_free(writer->bytes);
  *writer = (qmat_writer){0};
}

qmat_status qmat_writer_to_part(qmat_context *context, qmat_writer *writer, qmat_file *file, size_t part,
                                const char *name) {
  char *copy = writer->failed ? NULL : qmat_strdup(name);
  if (!copy) {
    qmat_writer_uninit(writer);
    return qmat_fail_memory(context, "the output file");
  }
  file->parts[part] = (qmat_file_part){.name = copy, .size = writer->size, .bytes = writer->bytes};
  *writer = (qmat_writer){0};
  return QMAT_OK;
}

qmat_status qmat_writer_to_file(qmat_context *context, qmat_writer *writer, const char *format, qmat_file **file) {
  qmat_status status = QMAT_OK;
  *file = NULL;
  qmat_file *made = qmat_file_new();
  if (made) {
    made->format = qmat_strdup(format);
    made->parts = qmat_calloc(1, sizeof *made->parts);
    made->part_count = made->parts ? 1 : 0;
  }
  if (!made || !made->format || !made->parts) {
    qmat_writer_uninit(writer);
    status = qmat_fail_memory(context, "the output file");
  }
  if (status == QMAT_OK) status = qmat_writer_to_part(context, writer, made, 0, "");
  if (status == QMAT_OK) status = qmat_value_seal(context, &made->base);
  if (status == QMAT_OK) {
    *file = made;
  } else if (made) {
    qmat_value_release(&made->base);
  }
  return status;
}
