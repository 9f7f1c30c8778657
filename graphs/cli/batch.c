/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cli/batch.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "graphs/run/run.h"

void qmat_batch_uninit(qmat_batch *batch) {
  for (size_t i = 0; i < batch->count; i++) {
    qmat_asset *asset = &batch->assets[i];
    for (size_t k = 0; asset->words && asset->words[k]; k++) qmat_free(asset->words[k]);
    qmat_free(asset->words);
    qmat_free(asset->input);
    qmat_free(asset->stem);
    qmat_free(asset->report);
    json_decref(asset->result);
  }
  qmat_free(batch->assets);
  *batch = (qmat_batch){0};
}

/* ---- running ---- */

static bool start(qmat_asset *asset) {
  extern char **environ;
  posix_spawn_file_actions_t actions;
  int result = posix_spawn_file_actions_init(&actions);
  if (result == 0) {
    /* Messages go to the report. */
    result = posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    if (result == 0) result = posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    if (result == 0) result = posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    if (result == 0) result = posix_spawn(&asset->process, asset->words[0], &actions, NULL, asset->words, environ);
    posix_spawn_file_actions_destroy(&actions);
  }
  asset->started = qmat_clock_seconds();
  asset->state = result == 0 ? QMAT_ASSET_RUNNING : QMAT_ASSET_FAILED;
  if (result == 0) return true;
  asset->exit_code = -1;
  asset->result =
      json_pack("{s:{s:o}}", "error", "text", json_sprintf("cannot start '%s': %s", asset->words[0], strerror(result)));
  return false;
}

static void end(qmat_asset *asset, int status) {
  asset->seconds = qmat_clock_seconds() - asset->started;
  asset->exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  asset->signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  asset->state = asset->exit_code == 0 ? QMAT_ASSET_DONE : QMAT_ASSET_FAILED;
  asset->result = json_load_file(asset->report, 0, NULL);
}

/* The asset of a process that has ended; NULL: none has, after a short wait. */
static qmat_asset *wait_for_one(qmat_batch *batch) {
  for (size_t i = 0; i < batch->count; i++) {
    qmat_asset *asset = &batch->assets[i];
    int status;
    if (asset->state != QMAT_ASSET_RUNNING || waitpid(asset->process, &status, WNOHANG) != asset->process) continue;
    end(asset, status);
    return asset;
  }
  nanosleep(&(struct timespec){.tv_nsec = 10000000}, NULL);
  return NULL;
}

qmat_status qmat_batch_run(qmat_context *context, qmat_batch *batch, int jobs, bool (*stop)(void),
                           qmat_batch_observer *observer, void *user) {
  int running = 0;
  bool stopped = false;
  for (size_t next = 0; next < batch->count || running > 0;) {
    if (!stopped && stop()) {
      stopped = true;
      for (size_t i = 0; i < batch->count; i++)
        if (batch->assets[i].state == QMAT_ASSET_RUNNING) kill(batch->assets[i].process, SIGTERM);
    }
    if (stopped && running == 0) break;
    if (!stopped && running < jobs && next < batch->count) {
      qmat_asset *asset = &batch->assets[next++];
      if (asset->state == QMAT_ASSET_WAITING && start(asset))
        running++;
      else
        observer(user, batch, asset);
      continue;
    }
    qmat_asset *asset = wait_for_one(batch);
    if (!asset) continue;
    running--;
    if (stopped && asset->state == QMAT_ASSET_FAILED) asset->state = QMAT_ASSET_WAITING; /* it was interrupted */
    observer(user, batch, asset);
  }
  return stopped ? qmat_fail(context, QMAT_CANCELLED, "cancelled") : QMAT_OK;
}

/* ---- results ---- */

void qmat_asset_error(const qmat_asset *asset, char *text, size_t size) {
  const char *reported = json_string_value(json_object_get(json_object_get(asset->result, "error"), "text"));
  if (asset->state != QMAT_ASSET_FAILED)
    snprintf(text, size, "%s", asset->state == QMAT_ASSET_DONE ? "" : "not run");
  else if (reported)
    snprintf(text, size, "%s", reported);
  else if (asset->signal)
    snprintf(text, size, "ended by signal %d (%s)", asset->signal, strsignal(asset->signal));
  else
    snprintf(text, size, asset->exit_code < 0 ? "it ended without a result" : "exit code %d without a report",
             asset->exit_code);
}

json_t *qmat_asset_json(const qmat_asset *asset) {
  static const char *const results[] = {"not run", "running", "ok", "failed"};
  char error[2048];
  qmat_asset_error(asset, error, sizeof error);
  json_t *json = json_object(), *path = json_string(asset->input);
  json_object_set_new(json, "input", path ? path : json_string("(not UTF-8)"));
  json_object_set_new(json, "result", json_string(results[asset->state]));
  json_object_set_new(json, "exit_code", json_integer(asset->exit_code));
  json_object_set_new(json, "seconds", json_real(asset->seconds));
  json_object_set_new(json, "nodes",
                      json_integer((json_int_t)json_array_size(json_object_get(asset->result, "nodes"))));
  json_object_set_new(
      json, "hits", json_integer(json_integer_value(json_object_get(json_object_get(asset->result, "cache"), "hits"))));
  static const char *const kept[] = {"outputs", "summary", "warnings"};
  for (int i = 0; i < 3; i++) {
    json_t *value = json_object_get(asset->result, kept[i]);
    json_object_set_new(json, kept[i], value ? json_incref(value) : json_null());
  }
  json_t *text = *error ? json_string(error) : json_null();
  json_object_set_new(json, "error", text ? text : json_string("(not UTF-8)"));
  return json;
}
