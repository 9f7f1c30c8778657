/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graphs/cli/command.h"
#include "graphs/cli/progress.h"

/* A file that the run depends on, with its digest when it was read. */
typedef struct watched_file {
  char *path;
  const char *name; /* in `path`, without the folder */
  int folder;       /* the watch of its folder; -1: the folder cannot be watched */
  bool readable;
  qmat_digest digest;
  struct stat about; /* what the system said of it last */
} watched_file;

typedef struct watcher {
  int inotify;
  watched_file *files;
  size_t count, capacity;
  bool failed; /* memory was short */
} watcher;

static void forget_files(watcher *watcher) {
  for (size_t i = 0; i < watcher->count; i++) qmat_free(watcher->files[i].path);
  watcher->count = 0;
}

/* Updates what the system says of a file: zeros where there is none. True: it says something else than before. */
static bool update_about(watched_file *file) {
  const struct stat before = file->about;
  struct stat about;
  file->about = stat(file->path, &about) == 0 ? about : (struct stat){0};
  return file->about.st_dev != before.st_dev || file->about.st_ino != before.st_ino ||
         file->about.st_size != before.st_size || file->about.st_mtim.tv_sec != before.st_mtim.tv_sec ||
         file->about.st_mtim.tv_nsec != before.st_mtim.tv_nsec;
}

/* Whether a file has changed. Its folder does not tell when it is a link, or when a folder on the way is missing or is
 * replaced. */
static bool has_changed_elsewhere(watcher *watcher) {
  bool changed = false;
  for (size_t i = 0; i < watcher->count; i++) changed = update_about(&watcher->files[i]) || changed;
  return changed;
}

static void add_file(watcher *watcher, const char *path, bool readable, const qmat_digest *digest) {
  for (size_t i = 0; i < watcher->count; i++)
    if (strcmp(watcher->files[i].path, path) == 0) return;
  char *copy = qmat_strdup(path), *slash = copy ? strrchr(copy, '/') : NULL;
  if (!copy ||
      qmat_grow((void **)&watcher->files, &watcher->capacity, watcher->count + 1, sizeof *watcher->files) != 0) {
    qmat_free(copy);
    watcher->failed = true;
    return;
  }
  watched_file file = {.path = copy, .name = slash ? slash + 1 : copy, .readable = readable, .digest = *digest};
  update_about(&file);
  /* Folders are watched, since programs save a file by renaming a new one. */
  const uint32_t events = IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE;
  if (slash == copy) {
    file.folder = inotify_add_watch(watcher->inotify, "/", events);
  } else {
    if (slash) *slash = 0;
    file.folder = inotify_add_watch(watcher->inotify, slash ? copy : ".", events);
    if (slash) *slash = '/';
  }
  watcher->files[watcher->count++] = file;
}

static void add_as_it_is(watcher *watcher, const char *path) {
  qmat_digest digest = {{0}};
  bool readable = qmat_digest_of_file(path, &digest) == QMAT_OK;
  add_file(watcher, path, readable, &digest);
}

/* Collects the files that a run read, and those that a failed run would have read. */
static void on_run(void *user, const qmat_graph *graph, const qmat_run *run) {
  watcher *watcher = user;
  for (size_t i = 0; i < run->hashed_count; i++)
    add_file(watcher, run->hashed[i].path, run->hashed[i].readable, &run->hashed[i].digest);
  for (size_t i = 0; i < graph->node_count; i++)
    for (size_t row = 0; row < qmat_param_count(graph->nodes[i].type); row++) {
      const qmat_param *param = &graph->nodes[i].type->params[row];
      const char *path = graph->nodes[i].texts[row];
      if (path && param->type == QMAT_PARAM_PATH && (param->flags & QMAT_PARAM_INPUT_FILE)) add_as_it_is(watcher, path);
    }
}

static bool has_changed(const watcher *watcher) {
  for (size_t i = 0; i < watcher->count; i++) {
    const watched_file *file = &watcher->files[i];
    qmat_digest digest;
    bool readable = qmat_digest_of_file(file->path, &digest) == QMAT_OK;
    if (readable != file->readable || (readable && !qmat_digest_equal(&digest, &file->digest))) return true;
  }
  return false;
}

/* Takes all waiting events. True: one of them is about a watched file. */
static bool take_events(const watcher *watcher) {
  _Alignas(struct inotify_event) char events[8192];
  bool ours = false;
  for (ssize_t size; (size = read(watcher->inotify, events, sizeof events)) > 0;)
    for (ssize_t at = 0; at < size;) {
      struct inotify_event event;
      memcpy(&event, events + at, sizeof event);
      const char *name = events + at + sizeof event;
      if (event.mask & IN_Q_OVERFLOW) ours = true;
      for (size_t i = 0; event.len > 0 && i < watcher->count; i++)
        if (watcher->files[i].folder == event.wd && strcmp(watcher->files[i].name, name) == 0) ours = true;
      at += (ssize_t)sizeof event + event.len;
    }
  return ours;
}

/* Waits until the bytes of a file change. False: the program was interrupted. */
static bool wait_for_change(watcher *watcher) {
  struct pollfd waiting = {.fd = watcher->inotify, .events = POLLIN};
  /* A file may have changed during the run. */
  for (bool changed = has_changed(watcher); !changed;) {
    if (qmat_interrupted()) return false;
    const bool told = poll(&waiting, 1, 500) > 0 && take_events(watcher);
    if (!has_changed_elsewhere(watcher) && !told) continue;
    /* Several files may be saved at once, so this waits until no event has come for a while. */
    while (poll(&waiting, 1, 60) > 0) take_events(watcher);
    changed = has_changed(watcher);
  }
  return !qmat_interrupted();
}

static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  bool quiet = qmat_invocation_value(invocation, "quiet") != NULL;
  watcher watcher = {.inotify = inotify_init1(IN_NONBLOCK | IN_CLOEXEC)};
  if (watcher.inotify < 0) return qmat_fail(context, QMAT_ERROR_IO, "cannot watch files: %s", strerror(errno));
  qmat_status status = QMAT_OK;
  do {
    forget_files(&watcher);
    qmat_graph_uninit(&invocation->graph);
    add_as_it_is(&watcher, invocation->arguments[0]);
    status = qmat_execute(context, invocation, qmat_read_graph_argument, on_run, &watcher);
    if (status != QMAT_OK && status != QMAT_CANCELLED) qmat_print_error(&context->error);
    fflush(stdout);
    if (!quiet && !qmat_interrupted())
      fprintf(stderr, "qmat: watching %zu file%s\n", watcher.count, watcher.count == 1 ? "" : "s");
  } while (!watcher.failed && status != QMAT_CANCELLED && wait_for_change(&watcher));
  status = watcher.failed ? qmat_fail_memory(context, "files to watch") : QMAT_OK;
  forget_files(&watcher);
  qmat_free(watcher.files);
  close(watcher.inotify);
  return status;
}

const qmat_command qmat_command_watch = {
    .name = "watch",
    .arguments = "GRAPH",
    .summary = "Run a graph file again whenever a file it depends on is saved",
    .doc =
        "Runs a graph file, and runs it again whenever the graph, a model or a file that a model refers to changes. "
        "With the cache, only the nodes that the change affects run. An error is printed, and the next change starts "
        "the next run. Ctrl-C ends the program.",
    .options = qmat_output_options,
    .common = qmat_common_options,
    .caching = qmat_cache_option_rows,
    .least = 1,
    .most = 1,
    .run = run,
};
