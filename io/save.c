/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/save.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/bytes.h"

/* One part while it is saved. */
typedef struct saved_part {
  char *final, *temporary; /* paths; temporary is NULL unless that file exists */
  bool replaces;           /* a file with other bytes exists */
  bool is_there;           /* a file with the same bytes exists and is left alone */
  bool renamed;
} saved_part;

/* The path of `name` in `folder`, which ends in a slash or is empty. */
static char *join(const char *folder, size_t folder_length, const char *name) {
  size_t name_length = strlen(name);
  char *path = qmat_alloc(folder_length + name_length + 1, 1);
  if (!path) return NULL;
  memcpy(path, folder, folder_length);
  memcpy(path + folder_length, name, name_length + 1);
  return path;
}

bool qmat_file_holds(const char *path, const qmat_file_part *part) {
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

/* Whether the part can be written, and whether its file already has the same bytes. */
static qmat_status check_target(qmat_context *context, const qmat_file_part *bytes, bool is_side, saved_part *part) {
  struct stat about;
  if (stat(part->final, &about) != 0)
    return errno == ENOENT ? QMAT_OK : qmat_fail_io(context, part->final, "cannot write the file", errno);
  if (!S_ISREG(about.st_mode)) {
    return qmat_fail_file(context, QMAT_ERROR_IO, part->final, "cannot write the file: %s has this name",
                          S_ISDIR(about.st_mode) ? "a folder" : "a pipe or device");
  }
  part->is_there = is_side && qmat_file_holds(part->final, bytes);
  if (part->is_there) return QMAT_OK;
  if (access(part->final, W_OK) != 0) return qmat_fail_io(context, part->final, "cannot write the file", errno);
  part->replaces = true;
  return QMAT_OK;
}

/* Makes the folders on the path `final` below its first `folder_length` bytes. */
static qmat_status make_folders(qmat_context *context, const char *final, size_t folder_length) {
  char *path = qmat_strdup(final);
  qmat_status status = path ? QMAT_OK : qmat_fail_memory(context, "the names of output files");
  for (char *slash = path ? strchr(path + folder_length, '/') : NULL; slash && status == QMAT_OK;
       slash = strchr(slash + 1, '/')) {
    *slash = '\0';
    if (mkdir(path, 0777) != 0 && errno != EEXIST)
      status = qmat_fail_io(context, path, "cannot make the folder", errno);
    *slash = '/';
  }
  qmat_free(path);
  return status;
}

/* Makes a new file without a name in the target's folder: it is gone when the process is killed. -1: some file systems
 * cannot, and without /proc it would get no name. */
static int make_unnamed(const char *folder, size_t folder_length) {
  if (access("/proc/self/fd", X_OK) != 0) return -1;
  char *path = join(folder, folder_length, ".");
  const int file = path ? open(path, O_WRONLY | O_TMPFILE | O_CLOEXEC, 0666) : -1;
  qmat_free(path);
  return file;
}

/* Makes a new file in the target's folder, or gives the file `unnamed` (-1: none) a name there. mkstemp would make it
 * readable by its owner only. */
static int make_temporary(const char *folder, size_t folder_length, int unnamed, char **path) {
  for (unsigned attempt = 0; attempt < 10000; attempt++) {
    char name[64], handle[64];
    snprintf(handle, sizeof handle, "/proc/self/fd/%d", unnamed);
    snprintf(name, sizeof name, ".qmat-%ld-%u.tmp", (long)getpid(), attempt);
    *path = join(folder, folder_length, name);
    if (!*path) {
      errno = ENOMEM;
      return -1;
    }
    int file = unnamed;
    if (unnamed < 0)
      file = open(*path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    else if (linkat(AT_FDCWD, handle, AT_FDCWD, *path, AT_SYMLINK_FOLLOW) != 0)
      file = -1;
    if (file >= 0) return file;
    int number = errno;
    qmat_free(*path);
    *path = NULL;
    errno = number;
    if (number != EEXIST) return -1;
  }
  return -1;
}

/* Fills a new file, which it closes. An `is_unnamed` one then gets a temporary name, if the file system gives it one.
 */
static qmat_status fill(qmat_context *context, const qmat_file_part *bytes, const char *folder, size_t folder_length,
                        int file, bool is_unnamed, saved_part *part) {
  qmat_status status = QMAT_OK;
  struct stat about;
  if (part->replaces && stat(part->final, &about) == 0 && fchmod(file, about.st_mode & 0777) != 0)
    status = qmat_fail_io(context, part->final, "cannot copy the old file's permissions", errno);
  for (size_t at = 0; status == QMAT_OK && at < bytes->size;) {
    size_t chunk = bytes->size - at < (size_t)1 << 30 ? bytes->size - at : (size_t)1 << 30;
    ssize_t done = write(file, bytes->bytes + at, chunk);
    if (done >= 0) {
      at += (size_t)done;
    } else if (errno != EINTR) {
      status = qmat_fail_io(context, part->final, "cannot write the file", errno);
    }
  }
  if (status == QMAT_OK && fsync(file) != 0 && errno != EINVAL)
    status = qmat_fail_io(context, part->final, "cannot write the file", errno);
  if (status == QMAT_OK && is_unnamed) make_temporary(folder, folder_length, file, &part->temporary);
  if (close(file) != 0 && status == QMAT_OK)
    status = qmat_fail_io(context, part->final, "cannot write the file", errno);
  return status;
}

static qmat_status write_part(qmat_context *context, const qmat_file_part *bytes, const char *folder,
                              size_t folder_length, saved_part *part) {
  int file = make_unnamed(folder, folder_length);
  if (file >= 0) {
    const qmat_status status = fill(context, bytes, folder, folder_length, file, true, part);
    if (status != QMAT_OK || part->temporary) return status;
  }
  file = make_temporary(folder, folder_length, -1, &part->temporary);
  if (file < 0) return qmat_fail_io(context, part->final, "cannot write the file", errno);
  return fill(context, bytes, folder, folder_length, file, false, part);
}

/* Makes the renames durable. Some file systems cannot flush a folder; the files are complete anyway. */
static void flush_folder(const char *path, size_t folder_length) {
  char *folder = join(path, folder_length, ".");
  int handle = folder ? open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
  if (handle >= 0) {
    (void)fsync(handle);
    close(handle);
  }
  qmat_free(folder);
}

static qmat_status check_part_names(qmat_context *context, const qmat_file *file, const char *main_name) {
  if (file->part_count == 0 || file->parts[0].name[0] != '\0')
    return qmat_fail(context, QMAT_ERROR_INTERNAL, "the file to be saved has no main part");
  for (size_t i = 1; i < file->part_count; i++) {
    const char *name = file->parts[i].name;
    if (!qmat_is_part_name(name))
      return qmat_fail(context, QMAT_ERROR_INTERNAL, "'%s' cannot be the name of a file's part", name);
    bool taken = strcmp(name, main_name) == 0;
    for (size_t j = 1; j < i && !taken; j++) taken = strcmp(name, file->parts[j].name) == 0;
    if (taken) {
      qmat_fail(context, QMAT_ERROR_IO, "two parts of the output have the name '%s'", name);
      return qmat_fail_hint(context, "give the output another name");
    }
  }
  return QMAT_OK;
}

qmat_status qmat_file_save(qmat_context *context, const qmat_file *file, const char *path) {
  const char *slash = strrchr(path, '/');
  size_t folder_length = slash ? (size_t)(slash - path) + 1 : 0;
  if (path[folder_length] == '\0')
    return qmat_fail_file(context, QMAT_ERROR_IO, path, "'%s' is not the name of an output file", path);
  qmat_status status = check_part_names(context, file, path + folder_length);
  if (status != QMAT_OK) return status;

  saved_part *parts = qmat_calloc(file->part_count, sizeof *parts);
  if (!parts) return qmat_fail_memory(context, "the names of the output files");
  for (size_t i = 0; i < file->part_count && status == QMAT_OK; i++) {
    parts[i].final = i == 0 ? qmat_strdup(path) : join(path, folder_length, file->parts[i].name);
    status = parts[i].final ? QMAT_OK : qmat_fail_memory(context, "the names of output files");
    if (status == QMAT_OK) status = check_target(context, &file->parts[i], i > 0, &parts[i]);
  }
  for (size_t i = 0; i < file->part_count && status == QMAT_OK; i++) {
    if (parts[i].is_there) continue;
    status = write_part(context, &file->parts[i], path, folder_length, &parts[i]);
  }
  /* In reverse, so that the main part, which refers to the others, appears last. */
  for (size_t i = file->part_count; i-- > 0 && status == QMAT_OK;) {
    if (parts[i].is_there) continue;
    if (i > 0) status = make_folders(context, parts[i].final, folder_length);
    if (status != QMAT_OK) break;
    if (rename(parts[i].temporary, parts[i].final) != 0) {
      status = qmat_fail_io(context, parts[i].final, "cannot write the file", errno);
      break;
    }
    parts[i].renamed = true;
    qmat_free(parts[i].temporary);
    parts[i].temporary = NULL;
  }
  if (status == QMAT_OK) flush_folder(path, folder_length);
  for (size_t i = 0; i < file->part_count; i++) {
    if (parts[i].temporary) unlink(parts[i].temporary);
    if (status != QMAT_OK && parts[i].renamed && !parts[i].replaces) unlink(parts[i].final);
    qmat_free(parts[i].temporary);
    qmat_free(parts[i].final);
  }
  qmat_free(parts);
  return status;
}
