/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/bytes.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <locale.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/node.h"

#define LARGEST_FILE ((uint64_t)4 << 30)
#define PADDING 16

/* The C library's own text of an error, never translated. */
static const char *reason(int number) {
  const char *text = strerrordesc_np(number);
  return text ? text : "unknown error";
}

static qmat_status fail_file(qmat_context *context, const char *path, const char *what, int number) {
  qmat_fail(context, QMAT_ERROR_IO, "%s: %s", what, reason(number));
  return qmat_fail_at(context, path, 0, 0);
}

/* ---- whole files ---- */

qmat_status qmat_bytes_read_file(qmat_context *context, const char *path, qmat_bytes *bytes) {
  qmat_status status = QMAT_OK;
  bytes->size = 0;
  bytes->data = NULL;
  /* Without O_NONBLOCK, opening a pipe waits for its writer. */
  int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (file < 0) {
    status = fail_file(context, path, "cannot open the file", errno);
    qmat_note_file_read(context, path, NULL, 0);
    return status;
  }

  struct stat about;
  if (fstat(file, &about) != 0) {
    status = fail_file(context, path, "cannot read the file", errno);
    goto done;
  }
  if (!S_ISREG(about.st_mode)) {
    const char *kind = S_ISDIR(about.st_mode) ? "a folder" : S_ISFIFO(about.st_mode) ? "a pipe" : "a device or socket";
    qmat_fail(context, QMAT_ERROR_IO, "this is %s, not a file", kind);
    status = qmat_fail_at(context, path, 0, 0);
    goto done;
  }
  if (about.st_size == 0) {
    qmat_fail(context, QMAT_ERROR_FORMAT, "the file is empty");
    status = qmat_fail_at(context, path, 0, 0);
    goto done;
  }
  if ((uint64_t)about.st_size > LARGEST_FILE) {
    qmat_fail(context, QMAT_ERROR_FORMAT, "the file has %lld bytes; at most 4 GiB are read", (long long)about.st_size);
    status = qmat_fail_at(context, path, 0, 0);
    goto done;
  }

  size_t wanted = (size_t)about.st_size, size = 0;
  bytes->data = qmat_alloc(wanted + PADDING, 1);
  if (!bytes->data) {
    qmat_fail_memory(context, "the file");
    status = qmat_fail_at(context, path, 0, 0);
    goto done;
  }
  while (size < wanted) {
    ssize_t got = read(file, bytes->data + size, wanted - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      status = fail_file(context, path, "cannot read the file", errno);
      goto done;
    }
    if (got == 0) break;
    size += (size_t)got;
  }
  if (size != wanted) {
    qmat_fail(context, QMAT_ERROR_IO, "the file became shorter while it was read");
    status = qmat_fail_at(context, path, 0, 0);
    goto done;
  }
  memset(bytes->data + size, 0, PADDING);
  bytes->size = size;

done:
  close(file);
  if (status != QMAT_OK) qmat_bytes_uninit(bytes);
  qmat_note_file_read(context, path, bytes->data, bytes->size);
  return status;
}

void qmat_bytes_uninit(qmat_bytes *bytes) {
  qmat_free(bytes->data);
  bytes->data = NULL;
  bytes->size = 0;
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

/* ---- numbers in text ---- */

static bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

static bool is_blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

/* The length of `word` when `text` starts with it in any case, else 0. */
static size_t starts_with(const char *text, const char *end, const char *word) {
  size_t length = strlen(word);
  if ((size_t)(end - text) < length) return 0;
  for (size_t i = 0; i < length; i++) {
    if ((text[i] | 0x20) != word[i]) return 0;
  }
  return length;
}

const char *qmat_scan_double(const char *text, const char *end, double *number) {
  static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                  1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  const char *at = text;
  bool negative = at < end && *at == '-';
  if (at < end && (*at == '-' || *at == '+')) at++;

  uint64_t mantissa = 0;
  int exponent = 0;  /* of ten, of the last digit in the mantissa */
  bool exact = true; /* the mantissa holds every digit */
  const char *first = at;
  for (; at < end && is_digit(*at); at++) {
    if (mantissa < (uint64_t)1 << 59) {
      mantissa = mantissa * 10 + (uint64_t)(*at - '0');
    } else {
      exact = false;
    }
  }
  size_t digits = (size_t)(at - first);
  if (at < end && *at == '.') {
    const char *point = at++;
    for (; at < end && is_digit(*at); at++) {
      if (mantissa < (uint64_t)1 << 59) {
        mantissa = mantissa * 10 + (uint64_t)(*at - '0');
        if (exponent > -1000) exponent--;
      } else {
        exact = false;
      }
    }
    digits += (size_t)(at - point - 1);
  }
  if (digits == 0) {
    at = first;
    size_t word = starts_with(at, end, "infinity");
    if (!word) word = starts_with(at, end, "inf");
    if (word) {
      *number = negative ? -(double)INFINITY : (double)INFINITY;
      return at + word;
    }
    word = starts_with(at, end, "nan");
    if (!word) return NULL;
    *number = (double)NAN;
    return at + word;
  }
  if (at < end && (*at == 'e' || *at == 'E')) {
    const char *power = at + 1;
    bool minus = power < end && *power == '-';
    if (power < end && (*power == '-' || *power == '+')) power++;
    if (power < end && is_digit(*power)) {
      int value = 0;
      for (; power < end && is_digit(*power); power++) {
        if (value < 100000) value = value * 10 + (*power - '0');
      }
      exponent += minus ? -value : value;
      at = power;
    }
  }

  /* Up to 2^53 the mantissa and up to 10^22 the power are exact, so that one operation rounds once (Clinger 1990). */
  if (exact && mantissa <= (uint64_t)1 << 53 && exponent >= -22 && exponent <= 22) {
    double value = (double)mantissa;
    value = exponent < 0 ? value / powers[-exponent] : value * powers[exponent];
    *number = negative ? -value : value;
    return at;
  }
  /* The C locale is a constant of the C library: this allocates nothing. */
  locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
  if (plain == (locale_t)0) return NULL;
  *number = strtod_l(text, NULL, plain);
  freelocale(plain);
  return at;
}

void qmat_scanner_init(qmat_scanner *scanner, qmat_context *context, const char *file, const char *text, size_t size,
                       char comment) {
  *scanner = (qmat_scanner){.context = context,
                            .file = file,
                            .at = text,
                            .end = text + size,
                            .line_start = text,
                            .line = 1,
                            .comment = comment};
  if (size >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0) scanner->at += 3;
}

/* The length of the line end at `at`: 0, 1 or 2. */
static size_t line_end(const qmat_scanner *scanner, const char *at) {
  if (at >= scanner->end) return 0;
  if (*at == '\n') return 1;
  if (*at != '\r') return 0;
  return at + 1 < scanner->end && at[1] == '\n' ? 2 : 1;
}

static void begin_line(qmat_scanner *scanner, const char *at) {
  scanner->at = at;
  scanner->line_start = at;
  if (scanner->line < INT_MAX) scanner->line++;
}

/* The length of a backslash and the line end that it takes away, or 0. */
static size_t line_join(const qmat_scanner *scanner, const char *at) {
  if (!scanner->joins_lines || at >= scanner->end || *at != '\\') return 0;
  size_t length = line_end(scanner, at + 1);
  return length > 0 ? length + 1 : 0;
}

static bool ends_token(const qmat_scanner *scanner, const char *at) {
  if (at >= scanner->end || is_blank(*at)) return true;
  if (scanner->comment && *at == scanner->comment) return true;
  return line_join(scanner, at) > 0;
}

static bool find(qmat_scanner *scanner, bool across_lines) {
  while (scanner->at < scanner->end) {
    char c = *scanner->at;
    if (c == '\n' || c == '\r') {
      if (!across_lines) return false;
      begin_line(scanner, scanner->at + line_end(scanner, scanner->at));
    } else if (is_blank(c)) {
      scanner->at++;
    } else if (scanner->comment && c == scanner->comment) {
      while (scanner->at < scanner->end && *scanner->at != '\n' && *scanner->at != '\r') scanner->at++;
    } else {
      size_t join = line_join(scanner, scanner->at);
      if (join == 0) return true;
      begin_line(scanner, scanner->at + join);
    }
  }
  return false;
}

bool qmat_scan_find(qmat_scanner *scanner) {
  return find(scanner, true);
}

bool qmat_scan_find_on_line(qmat_scanner *scanner) {
  return find(scanner, false);
}

bool qmat_scan_next_line(qmat_scanner *scanner) {
  while (scanner->at < scanner->end) {
    size_t length = line_end(scanner, scanner->at);
    if (length > 0) {
      begin_line(scanner, scanner->at + length);
      return scanner->at < scanner->end;
    }
    /* A comment may end in a backslash without going on. */
    if (scanner->comment && *scanner->at == scanner->comment) {
      find(scanner, false);
      continue;
    }
    size_t join = line_join(scanner, scanner->at);
    if (join > 0) {
      begin_line(scanner, scanner->at + join);
    } else {
      scanner->at++;
    }
  }
  return false;
}

static const char *take_token(qmat_scanner *scanner, size_t *length) {
  const char *token = scanner->at;
  while (!ends_token(scanner, scanner->at)) scanner->at++;
  *length = (size_t)(scanner->at - token);
  return token;
}

const char *qmat_scan_token(qmat_scanner *scanner, size_t *length) {
  *length = 0;
  return qmat_scan_find(scanner) ? take_token(scanner, length) : scanner->at;
}

const char *qmat_scan_token_on_line(qmat_scanner *scanner, size_t *length) {
  *length = 0;
  return qmat_scan_find_on_line(scanner) ? take_token(scanner, length) : scanner->at;
}

bool qmat_scan_word(qmat_scanner *scanner, const char *word) {
  size_t length = strlen(word);
  if (!qmat_scan_find(scanner) || qmat_scan_left(scanner) < length) return false;
  if (memcmp(scanner->at, word, length) != 0 || !ends_token(scanner, scanner->at + length)) return false;
  scanner->at += length;
  return true;
}

/* The next token as text that is fit for a message. */
static const char *quote_token(const qmat_scanner *scanner, char text[32]) {
  size_t length = 0;
  for (const char *at = scanner->at; !ends_token(scanner, at); at++) {
    if (length == 28) {
      memcpy(text + 25, "...", 3);
      break;
    }
    text[length++] = *at >= ' ' && *at <= '~' ? *at : '?';
  }
  text[length] = '\0';
  return text;
}

static qmat_status fail_token(qmat_scanner *scanner, const char *what, const char *complaint) {
  char text[32];
  if (!qmat_scan_find(scanner)) return qmat_scan_fail(scanner, "the file ends where %s should stand", what);
  return qmat_scan_fail(scanner, "%s is '%s', %s", what, quote_token(scanner, text), complaint);
}

qmat_status qmat_scan_number(qmat_scanner *scanner, const char *what, double *number) {
  if (!qmat_scan_find(scanner)) return fail_token(scanner, what, "");
  const char *after = qmat_scan_double(scanner->at, scanner->end, number);
  if (!after || !ends_token(scanner, after)) return fail_token(scanner, what, "which is no number");
  scanner->at = after;
  return QMAT_OK;
}

qmat_status qmat_scan_integer(qmat_scanner *scanner, const char *what, int64_t least, int64_t most, int64_t *number) {
  if (!qmat_scan_find(scanner)) return fail_token(scanner, what, "");
  const char *at = scanner->at;
  bool negative = *at == '-';
  if (*at == '-' || *at == '+') at++;
  const char *first = at;
  int64_t value = 0;
  for (; is_digit(*at) && at - first < 18; at++) value = value * 10 + (*at - '0');
  if (at > first && ends_token(scanner, at)) {
    if (negative) value = -value;
  } else {
    double real;
    at = qmat_scan_double(scanner->at, scanner->end, &real);
    if (!at || !ends_token(scanner, at) || !(fabs(real) <= 9.0e15) || real != floor(real)) {
      return fail_token(scanner, what, "which is no whole number");
    }
    value = (int64_t)real;
  }
  if (value < least || value > most) {
    char complaint[96];
    if (least > most) {
      snprintf(complaint, sizeof complaint, "but there are none");
    } else {
      snprintf(complaint, sizeof complaint, "not one of %lld to %lld", (long long)least, (long long)most);
    }
    return fail_token(scanner, what, complaint);
  }
  *number = value;
  scanner->at = at;
  return QMAT_OK;
}

qmat_status qmat_scan_fail(const qmat_scanner *scanner, const char *format, ...) {
  char message[512];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  qmat_fail(scanner->context, QMAT_ERROR_FORMAT, "%s", message);
  ptrdiff_t column = scanner->at - scanner->line_start + 1;
  return qmat_fail_at(scanner->context, scanner->file, scanner->line, column < INT_MAX ? (int)column : INT_MAX);
}

size_t qmat_scan_left(const qmat_scanner *scanner) {
  return (size_t)(scanner->end - scanner->at);
}

/* ---- writing ---- */

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

/* One part on its way to the disk. */
typedef struct saved_part {
  char *final, *temporary; /* paths; temporary is NULL until the file is made, and again once it is renamed */
  bool replaces;           /* there was a file before */
  bool is_there;           /* with the same bytes: it stays as it is */
  bool renamed;
} saved_part;

/* `folder` (with its final slash, or empty) and `name` as one path. */
static char *join(const char *folder, size_t folder_length, const char *name) {
  size_t name_length = strlen(name);
  char *path = qmat_alloc(folder_length + name_length + 1, 1);
  if (!path) return NULL;
  memcpy(path, folder, folder_length);
  memcpy(path + folder_length, name, name_length + 1);
  return path;
}

static qmat_status check_target(qmat_context *context, saved_part *part) {
  struct stat about;
  if (stat(part->final, &about) != 0) {
    if (errno == ENOENT) return QMAT_OK;
    return fail_file(context, part->final, "cannot write the file", errno);
  }
  if (!S_ISREG(about.st_mode)) {
    qmat_fail(context, QMAT_ERROR_IO, "cannot write the file: there is already %s of this name",
              S_ISDIR(about.st_mode) ? "a folder" : "a pipe or device");
    return qmat_fail_at(context, part->final, 0, 0);
  }
  if (access(part->final, W_OK) != 0) return fail_file(context, part->final, "cannot write the file", errno);
  part->replaces = true;
  return QMAT_OK;
}

/* Whether the file `path` holds these bytes. */
static bool holds(const char *path, const qmat_file_part *part) {
  FILE *file = fopen(path, "rbe");
  if (!file) return false;
  uint8_t chunk[16384];
  size_t at = 0, read;
  bool same = true;
  while (same && (read = fread(chunk, 1, sizeof chunk, file)) > 0) {
    same = read <= part->size - at && memcmp(chunk, part->bytes + at, read) == 0;
    at += read;
  }
  same = same && at == part->size && !ferror(file);
  fclose(file);
  return same;
}

/* Makes the folders that a side part's name leads through, below the first `folder_length` bytes of its path. */
static qmat_status make_folders(qmat_context *context, const char *final, size_t folder_length) {
  char *path = qmat_strdup(final);
  qmat_status status = path ? QMAT_OK : qmat_fail_memory(context, "the names of output files");
  for (char *slash = path ? strchr(path + folder_length, '/') : NULL; slash && status == QMAT_OK;
       slash = strchr(slash + 1, '/')) {
    *slash = '\0';
    if (mkdir(path, 0777) != 0 && errno != EEXIST) status = fail_file(context, path, "cannot make the folder", errno);
    *slash = '/';
  }
  qmat_free(path);
  return status;
}

/* Makes a new file next to the target. Not mkstemp, which would leave the result readable by its owner alone. */
static int make_temporary(const char *folder, size_t folder_length, char **path) {
  for (unsigned attempt = 0; attempt < 10000; attempt++) {
    char name[64];
    snprintf(name, sizeof name, ".qmat-%ld-%u.tmp", (long)getpid(), attempt);
    *path = join(folder, folder_length, name);
    if (!*path) {
      errno = ENOMEM;
      return -1;
    }
    int file = open(*path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file >= 0) return file;
    int number = errno;
    qmat_free(*path);
    *path = NULL;
    errno = number;
    if (number != EEXIST) return -1;
  }
  return -1;
}

static qmat_status write_part(qmat_context *context, const qmat_file_part *bytes, const char *folder,
                              size_t folder_length, saved_part *part) {
  qmat_status status = QMAT_OK;
  int file = make_temporary(folder, folder_length, &part->temporary);
  if (file < 0) return fail_file(context, part->final, "cannot write the file", errno);

  struct stat about;
  if (part->replaces && stat(part->final, &about) == 0 && fchmod(file, about.st_mode & 0777) != 0) {
    status = fail_file(context, part->final, "cannot give the new file the old one's permissions", errno);
  }
  for (size_t at = 0; status == QMAT_OK && at < bytes->size;) {
    size_t chunk = bytes->size - at < (size_t)1 << 30 ? bytes->size - at : (size_t)1 << 30;
    ssize_t done = write(file, bytes->bytes + at, chunk);
    if (done >= 0) {
      at += (size_t)done;
    } else if (errno != EINTR) {
      status = fail_file(context, part->final, "cannot write the file", errno);
    }
  }
  if (status == QMAT_OK && fsync(file) != 0 && errno != EINVAL) {
    status = fail_file(context, part->final, "cannot write the file", errno);
  }
  if (close(file) != 0 && status == QMAT_OK) status = fail_file(context, part->final, "cannot write the file", errno);
  return status;
}

static qmat_status check_part_names(qmat_context *context, const qmat_file *file, const char *main_name) {
  if (file->part_count == 0 || file->parts[0].name[0] != '\0') {
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "the file to be saved has no main part");
  }
  for (size_t i = 1; i < file->part_count; i++) {
    const char *name = file->parts[i].name;
    if (!qmat_is_part_name(name))
      return qmat_fail(context, QMAT_ERROR_INTERNAL, "'%s' is no name for a part of a file", name);
    bool taken = strcmp(name, main_name) == 0;
    for (size_t j = 1; j < i && !taken; j++) taken = strcmp(name, file->parts[j].name) == 0;
    if (taken) {
      qmat_fail(context, QMAT_ERROR_IO, "two parts of the output would have the name '%s'", name);
      return qmat_fail_hint(context, "give the output another name");
    }
  }
  return QMAT_OK;
}

qmat_status qmat_file_save(qmat_context *context, const qmat_file *file, const char *path) {
  const char *slash = strrchr(path, '/');
  size_t folder_length = slash ? (size_t)(slash - path) + 1 : 0;
  if (path[folder_length] == '\0') {
    qmat_fail(context, QMAT_ERROR_IO, "'%s' names no output file", path);
    return qmat_fail_at(context, path, 0, 0);
  }
  qmat_status status = check_part_names(context, file, path + folder_length);
  if (status != QMAT_OK) return status;

  saved_part *parts = qmat_calloc(file->part_count, sizeof *parts);
  if (!parts) return qmat_fail_memory(context, "the names of the output files");
  for (size_t i = 0; i < file->part_count && status == QMAT_OK; i++) {
    parts[i].final = i == 0 ? qmat_strdup(path) : join(path, folder_length, file->parts[i].name);
    status = parts[i].final ? QMAT_OK : qmat_fail_memory(context, "the names of output files");
    parts[i].is_there = status == QMAT_OK && i > 0 && holds(parts[i].final, &file->parts[i]);
    if (status == QMAT_OK && !parts[i].is_there) status = check_target(context, &parts[i]);
  }
  for (size_t i = 0; i < file->part_count && status == QMAT_OK; i++) {
    if (parts[i].is_there) continue;
    status = write_part(context, &file->parts[i], path, folder_length, &parts[i]);
  }
  /* Backwards: the main part, which names the others, appears last. */
  for (size_t i = file->part_count; i-- > 0 && status == QMAT_OK;) {
    if (parts[i].is_there) continue;
    if (i > 0) status = make_folders(context, parts[i].final, folder_length);
    if (status != QMAT_OK) break;
    if (rename(parts[i].temporary, parts[i].final) != 0) {
      status = fail_file(context, parts[i].final, "cannot write the file", errno);
      break;
    }
    parts[i].renamed = true;
    qmat_free(parts[i].temporary);
    parts[i].temporary = NULL;
  }
  if (status == QMAT_OK) {
    /* The names are on the disk once their folder is. Some file systems cannot do that; the files are whole anyway. */
    char *folder = join(path, folder_length, ".");
    int handle = folder ? open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
    if (handle >= 0) {
      (void)fsync(handle);
      close(handle);
    }
    qmat_free(folder);
  }
  for (size_t i = 0; i < file->part_count; i++) {
    if (parts[i].temporary) unlink(parts[i].temporary);
    if (status != QMAT_OK && parts[i].renamed && !parts[i].replaces) unlink(parts[i].final);
    qmat_free(parts[i].temporary);
    qmat_free(parts[i].final);
  }
  qmat_free(parts);
  return status;
}
