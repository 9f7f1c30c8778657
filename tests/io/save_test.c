/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/save.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include "tests/io/files.h"

static size_t count_entries(const char *folder) {
  DIR *entries = opendir(folder);
  assert_non_null(entries);
  size_t count = 0;
  while (readdir(entries)) count++;
  closedir(entries);
  return count - 2;
}

static qmat_file *make_file(const char *side_name, size_t size) {
  qmat_file *file = qmat_file_new();
  file->format = qmat_strdup("gltf");
  file->part_count = side_name ? 2 : 1;
  file->parts = qmat_calloc(2, sizeof *file->parts);
  for (size_t i = 0; i < file->part_count; i++) {
    file->parts[i].name = qmat_strdup(i == 0 ? "" : side_name);
    file->parts[i].size = size;
    file->parts[i].bytes = qmat_alloc(size, 1);
    memset(file->parts[i].bytes, i == 0 ? 'm' : 's', size);
  }
  return file;
}

static void assert_content(const char *path, const char *expected) {
  qmat_context context = {0};
  qmat_bytes bytes;
  assert_int_equal(qmat_bytes_read_file(&context, path, &bytes), QMAT_OK);
  assert_string_equal((const char *)bytes.data, expected);
  qmat_bytes_uninit(&bytes);
}

static void assert_unsaved(const char *path, const char *side_name, const char *named, const char *message) {
  qmat_context context = {0};
  qmat_file *file = make_file(side_name, 3);
  assert_int_equal(qmat_file_save(&context, file, path), QMAT_ERROR_IO);
  assert_string_equal(context.error.message, message);
  assert_string_equal(context.error.file, named);
  qmat_value_release(&file->base);
}

static void test_every_part_is_saved_and_permissions_stay(void **state) {
  (void)state;
  char folder[64], main_path[96], side_path[96];
  make_folder(folder);
  snprintf(main_path, sizeof main_path, "%s/m\xE4in.gltf", folder);
  snprintf(side_path, sizeof side_path, "%s/m\xE4in.bin", folder);
  write_file(side_path, "old content", 11);
  assert_int_equal(chmod(side_path, 0640), 0);
  qmat_context context = {0};
  qmat_file *file = make_file("m\xE4in.bin", 3);
  assert_int_equal(qmat_file_save(&context, file, main_path), QMAT_OK);
  assert_int_equal(count_entries(folder), 2);
  assert_content(main_path, "mmm");
  assert_content(side_path, "sss");
  struct stat about;
  assert_int_equal(stat(side_path, &about), 0);
  assert_int_equal(about.st_mode & 0777, 0640);
  mode_t mask = umask(0);
  umask(mask);
  assert_int_equal(stat(main_path, &about), 0);
  assert_int_equal(about.st_mode & 0777, 0666 & ~mask);
  qmat_value_release(&file->base);
  unlink(main_path);
  unlink(side_path);
  assert_int_equal(rmdir(folder), 0);
}

static void test_a_side_file_with_the_same_bytes_is_left_alone(void **state) {
  (void)state;
  char folder[64], main_path[96], side_path[96];
  make_folder(folder);
  snprintf(main_path, sizeof main_path, "%s/main", folder);
  snprintf(side_path, sizeof side_path, "%s/side", folder);
  qmat_context context = {0};
  for (int longer = 0; longer < 3; longer++) { /* the same bytes, fewer and more */
    static const char *const contents[] = {"sss", "ss", "ssss"};
    struct stat before, after;
    write_file(side_path, contents[longer], strlen(contents[longer]));
    assert_int_equal(stat(side_path, &before), 0);
    qmat_file *file = make_file("side", 3);
    assert_int_equal(qmat_file_save(&context, file, main_path), QMAT_OK);
    assert_content(side_path, "sss");
    assert_int_equal(stat(side_path, &after), 0);
    assert_int_equal(before.st_ino == after.st_ino, longer == 0);
    qmat_value_release(&file->base);
  }
  unlink(main_path);
  unlink(side_path);
  assert_int_equal(rmdir(folder), 0);
}

static void test_side_parts_in_folders_are_saved_or_nothing_is_left(void **state) {
  (void)state;
  char folder[64], main_path[96], side_path[96], other_path[96];
  make_folder(folder);
  snprintf(main_path, sizeof main_path, "%s/main", folder);
  snprintf(side_path, sizeof side_path, "%s/f/g/side", folder);
  qmat_context context = {0};
  qmat_file *file = make_file("f/g/side", 3);
  assert_int_equal(qmat_file_save(&context, file, main_path), QMAT_OK);
  assert_content(side_path, "sss");
  qmat_value_release(&file->base);
  unlink(main_path);
  unlink(side_path);
  *strrchr(side_path, '/') = '\0';
  assert_int_equal(rmdir(side_path), 0);
  *strrchr(side_path, '/') = '\0';
  assert_int_equal(rmdir(side_path), 0);
  /* The last part becomes a file where the one before needs a folder: it is removed again. */
  file = make_file("f/side", 3);
  qmat_file_part *parts = qmat_calloc(3, sizeof *parts);
  memcpy(parts, file->parts, 2 * sizeof *parts);
  qmat_free(file->parts);
  parts[2] = (qmat_file_part){.name = qmat_strdup("f"), .size = 1, .bytes = qmat_calloc(1, 1)};
  file->parts = parts;
  file->part_count = 3;
  snprintf(other_path, sizeof other_path, "%s/f/side", folder);
  assert_int_equal(qmat_file_save(&context, file, main_path), QMAT_ERROR_IO);
  assert_string_equal(context.error.file, other_path);
  assert_int_equal(count_entries(folder), 0);
  qmat_value_release(&file->base);
  assert_int_equal(rmdir(folder), 0);
}

static void test_a_relative_name_is_saved_in_the_working_folder(void **state) {
  (void)state;
  char folder[64], before[4096];
  make_folder(folder);
  assert_non_null(getcwd(before, sizeof before));
  assert_int_equal(chdir(folder), 0);
  qmat_context context = {0};
  qmat_file *file = make_file("b", 2);
  assert_int_equal(qmat_file_save(&context, file, "a"), QMAT_OK);
  assert_content("a", "mm");
  assert_content("b", "ss");
  qmat_value_release(&file->base);
  unlink("a");
  unlink("b");
  assert_int_equal(chdir(before), 0);
  assert_int_equal(rmdir(folder), 0);
}

static void test_a_failed_save_names_the_file_and_leaves_nothing_behind(void **state) {
  (void)state;
  char folder[64], path[96], side[96];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/none/x.gltf", folder);
  assert_unsaved(path, NULL, path, "cannot write the file: No such file or directory");
  assert_unsaved(folder, NULL, folder, "cannot write the file: a folder has this name");
  snprintf(path, sizeof path, "%s/", folder);
  char message[160];
  snprintf(message, sizeof message, "'%s' is not the name of an output file", path);
  assert_unsaved(path, NULL, path, message);
  assert_unsaved("", NULL, "", "'' is not the name of an output file");
  assert_unsaved("/dev/null", NULL, "/dev/null", "cannot write the file: a pipe or device has this name");
  snprintf(path, sizeof path, "%s/x", folder);
  assert_unsaved(path, "x", "", "two parts of the output have the name 'x'");

  /* The side part cannot be written: the main part is not there either. */
  snprintf(side, sizeof side, "%s/side", folder);
  assert_int_equal(mkdir(side, 0700), 0);
  assert_unsaved(path, "side", side, "cannot write the file: a folder has this name");
  assert_int_equal(count_entries(folder), 1);
  rmdir(side);
  /* A pipe of this name is refused without waiting for its writer. */
  assert_int_equal(mkfifo(side, 0600), 0);
  assert_unsaved(path, "side", side, "cannot write the file: a pipe or device has this name");
  unlink(side);

  if (geteuid() != 0) {
    assert_int_equal(chmod(folder, 0500), 0);
    assert_unsaved(path, NULL, path, "cannot write the file: Permission denied");
    assert_int_equal(chmod(folder, 0700), 0);
  }
  assert_int_equal(rmdir(folder), 0);
}

/* The side part fails when it is renamed: its folder is a link that leads nowhere. */
static void test_the_main_part_appears_last(void **state) {
  (void)state;
  char folder[64], path[96], link[96];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/main", folder);
  snprintf(link, sizeof link, "%s/sub", folder);
  write_file(path, "old", 3);
  assert_int_equal(symlink("nowhere", link), 0);
  qmat_context context = {0};
  qmat_file *file = make_file("sub/side", 3);
  assert_int_equal(qmat_file_save(&context, file, path), QMAT_ERROR_IO);
  assert_content(path, "old");
  assert_int_equal(count_entries(folder), 2);
  qmat_value_release(&file->base);
  unlink(path);
  unlink(link);
  assert_int_equal(rmdir(folder), 0);
}

static void test_a_full_disk_leaves_the_old_file_as_it_was(void **state) {
  (void)state;
  char folder[64], path[96];
  make_folder(folder);
  snprintf(path, sizeof path, "%s/x", folder);
  write_file(path, "old", 3);
  struct rlimit before, small;
  assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
  small = before;
  small.rlim_cur = 4096;
  signal(SIGXFSZ, SIG_IGN);
  assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
  qmat_context context = {0};
  qmat_file *file = make_file("y", 100000);
  qmat_status status = qmat_file_save(&context, file, path);
  assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
  assert_int_equal(status, QMAT_ERROR_IO);
  assert_string_equal(context.error.message, "cannot write the file: File too large");
  assert_string_equal(context.error.file, path);
  assert_int_equal(count_entries(folder), 1);
  assert_content(path, "old");
  qmat_value_release(&file->base);
  unlink(path);
  assert_int_equal(rmdir(folder), 0);
}

/* Killed while it writes: here by the signal of a file that is too large. */
static void test_a_killed_process_leaves_nothing_behind(void **state) {
  (void)state;
  char folder[64], path[96];
  make_folder(folder);
  const int unnamed = open(folder, O_WRONLY | O_TMPFILE, 0666);
  if (unnamed < 0) {
    rmdir(folder);
    skip(); /* this file system has no files without names */
  }
  close(unnamed);
  snprintf(path, sizeof path, "%s/x", folder);
  qmat_context context = {0};
  qmat_file *file = make_file("y", 100000);
  const pid_t child = fork();
  if (child == 0) {
    const struct rlimit small = {.rlim_cur = 4096, .rlim_max = 4096}, no_core = {0};
    signal(SIGXFSZ, SIG_DFL);
    setrlimit(RLIMIT_CORE, &no_core);
    setrlimit(RLIMIT_FSIZE, &small);
    qmat_file_save(&context, file, path);
    _exit(0);
  }
  int how;
  assert_int_equal(waitpid(child, &how, 0), child);
  assert_true(WIFSIGNALED(how));
  assert_int_equal(count_entries(folder), 0);
  qmat_value_release(&file->base);
  assert_int_equal(rmdir(folder), 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_every_part_is_saved_and_permissions_stay),
      cmocka_unit_test(test_a_side_file_with_the_same_bytes_is_left_alone),
      cmocka_unit_test(test_side_parts_in_folders_are_saved_or_nothing_is_left),
      cmocka_unit_test(test_a_relative_name_is_saved_in_the_working_folder),
      cmocka_unit_test(test_a_failed_save_names_the_file_and_leaves_nothing_behind),
      cmocka_unit_test(test_the_main_part_appears_last),
      cmocka_unit_test(test_a_full_disk_leaves_the_old_file_as_it_was),
      cmocka_unit_test(test_a_killed_process_leaves_nothing_behind),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
