/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "graphs/cli/batch.h"
#include "io/bytes.h"
#include "io/save.h"

/* Of a cluster that does not say another number. */
enum { USUAL_MOST_TASKS = 1001 };

/* Puts a word in quotes for the shell. */
static void put_quoted(qmat_writer *writer, const char *word) {
  qmat_put_text(writer, "'");
  for (; *word; word++) {
    if (*word == '\'')
      qmat_put_text(writer, "'\\''");
    else
      qmat_put_bytes(writer, word, 1);
  }
  qmat_put_text(writer, "' ");
}

/* Puts FOLDER/NAME, quoted. */
static void put_path(qmat_writer *writer, const char *folder, const char *name) {
  char path[4200];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  put_quoted(writer, path);
}

/* Writes the script of a job array of `tasks`. Task n runs the commands of assets n, n + tasks, ... and writes each
 * exit code to FOLDER/NUMBER.exit in one step. A task whose machine dies is started again by Slurm. */
static qmat_status write_script(qmat_context *context, const qmat_batch *batch, size_t tasks, const char *folder) {
  qmat_writer writer = {0};
  qmat_file *file = NULL;
  char path[4200];
  qmat_put_text(&writer, "#!/bin/sh\nmodel=$SLURM_ARRAY_TASK_ID\nwhile [ \"$model\" -lt ");
  qmat_put_integer(&writer, (int64_t)batch->count);
  qmat_put_text(&writer, " ]; do\ncase $model in\n");
  for (size_t i = 0; i < batch->count; i++) {
    qmat_put_integer(&writer, (int64_t)i);
    qmat_put_text(&writer, ") ");
    for (char **word = batch->assets[i].words; word && *word; word++) put_quoted(&writer, *word);
    qmat_put_text(&writer, ";;\n");
  }
  qmat_put_text(&writer, "esac\ncode=$?\n(cd ");
  put_quoted(&writer, folder);
  qmat_put_text(&writer,
                "&& echo $code >\"$model.new\" && mv \"$model.new\" \"$model.exit\")\n"
                "case $code in 3 | 143) exit ;; esac\n" /* cancelled: the others are not started */
                "model=$((model + ");
  qmat_put_integer(&writer, (int64_t)tasks);
  qmat_put_text(&writer, "))\ndone\n");
  snprintf(path, sizeof path, "%s/array.sh", folder);
  qmat_status status = qmat_writer_to_file(context, &writer, "sh", &file);
  if (status == QMAT_OK) status = qmat_file_save(context, file, path);
  if (file) qmat_value_release(&file->base);
  return status;
}

/* Runs a Slurm command and reads its first line. False: it failed. */
static bool ask(qmat_writer *command, char *line, size_t size) {
  qmat_put_bytes(command, "", 1);
  line[0] = 0;
  FILE *pipe = command->failed ? NULL : popen((const char *)command->bytes, "re");
  qmat_writer_uninit(command);
  if (!pipe) return false;
  if (!fgets(line, (int)size, pipe)) line[0] = 0;
  char rest[256];
  while (fgets(rest, sizeof rest, pipe)) continue;
  return pclose(pipe) == 0;
}

/* The number of tasks that a job array may have. */
static size_t most_tasks(void) {
  qmat_writer command = {0};
  char line[64];
  qmat_put_text(&command, "scontrol show config | sed -n 's/^MaxArraySize *= *//p'");
  const long most = ask(&command, line, sizeof line) ? strtol(line, NULL, 10) : 0;
  return most > 0 ? (size_t)most : USUAL_MOST_TASKS;
}

static bool submit(size_t tasks, int jobs, int threads, const char *folder, char *job, size_t size) {
  qmat_writer command = {0};
  char options[160];
  snprintf(options, sizeof options,
           "sbatch --parsable --requeue --job-name=qmat --output=/dev/null --nodes=1 --ntasks=1 --cpus-per-task=%d "
           "--array=0-%zu",
           threads, tasks - 1);
  qmat_put_text(&command, options);
  if (jobs > 0) {
    qmat_put_text(&command, "%");
    qmat_put_integer(&command, jobs);
  }
  qmat_put_text(&command, " ");
  put_path(&command, folder, "array.sh");
  if (!ask(&command, job, size)) return false;
  job[strspn(job, "0123456789")] = 0; /* "12;cluster" */
  return *job != 0;
}

/* Whether Slurm still has tasks of the job. */
static bool is_alive(const char *job) {
  qmat_writer command = {0};
  char line[64];
  qmat_put_text(&command, "squeue --noheader --format=%i --jobs=");
  qmat_put_text(&command, job);
  qmat_put_text(&command, " 2>/dev/null");
  /* squeue fails for a job that ended some time ago. */
  return ask(&command, line, sizeof line) && *line;
}

/* Cancels the job, and waits for at most 20 seconds until its tasks have ended: they write files to the last. */
static void cancel(const char *job) {
  qmat_writer command = {0};
  char line[64];
  qmat_put_text(&command, "scancel ");
  qmat_put_text(&command, job);
  ask(&command, line, sizeof line);
  for (int i = 0; i < 100 && is_alive(job); i++) nanosleep(&(struct timespec){.tv_nsec = 200000000}, NULL);
}

static void exit_path(const char *folder, size_t index, char path[4200]) {
  snprintf(path, 4200, "%s/%zu.exit", folder, index);
}

/* Reads the result of a task. False: it has not ended. */
static bool collect(qmat_asset *asset, size_t index, const char *folder) {
  char path[4200];
  exit_path(folder, index, path);
  FILE *file = fopen(path, "re");
  if (!file) return false;
  if (fscanf(file, "%d", &asset->exit_code) != 1) asset->exit_code = -1;
  fclose(file);
  unlink(path);
  /* The shell reports a signal as 128 + its number. */
  asset->signal = asset->exit_code > 128 ? asset->exit_code - 128 : 0;
  asset->result = json_load_file(asset->report, 0, NULL);
  asset->seconds = json_real_value(json_object_get(asset->result, "seconds"));
  asset->state = asset->exit_code == 0 ? QMAT_ASSET_DONE : QMAT_ASSET_FAILED;
  return true;
}

/* The job has ended when squeue has not named it so many times in turn. On a shared folder, files may appear after the
 * job has ended, and a busy controller may not answer. */
enum { PATIENCE = 10 };

qmat_status qmat_batch_run_slurm(qmat_context *context, qmat_batch *batch, int jobs, int threads, const char *folder,
                                 bool (*stop)(void), qmat_batch_observer *observer, void *user) {
  char job[64], path[4200];
  const size_t most = most_tasks(), tasks = batch->count < most ? batch->count : most;
  qmat_status status = write_script(context, batch, tasks, folder);
  if (status == QMAT_OK && !submit(tasks, jobs, threads, folder, job, sizeof job)) {
    qmat_fail(context, QMAT_ERROR_DEPENDENCY, "Slurm does not accept the job: sbatch failed");
    status = qmat_fail_hint(context, "without --engine slurm the batch runs on this machine");
  }
  size_t left = status == QMAT_OK ? batch->count : 0;
  for (size_t i = 0; i < batch->count && status == QMAT_OK; i++) {
    if (batch->assets[i].state != QMAT_ASSET_FAILED) continue;
    left--;
    observer(user, batch, &batch->assets[i]);
  }
  for (int patience = PATIENCE; left > 0 && patience > 0;) {
    if (stop()) {
      cancel(job);
      status = qmat_fail(context, QMAT_CANCELLED, "cancelled");
      break;
    }
    nanosleep(&(struct timespec){.tv_nsec = 500000000}, NULL);
    bool alive = is_alive(job);
    for (size_t i = 0; i < batch->count; i++) {
      qmat_asset *asset = &batch->assets[i];
      if (asset->state != QMAT_ASSET_WAITING || !collect(asset, i, folder)) continue;
      left--;
      observer(user, batch, asset);
    }
    patience = alive ? PATIENCE : patience - 1;
  }
  for (size_t i = 0; i < batch->count && status == QMAT_OK; i++) {
    qmat_asset *asset = &batch->assets[i];
    if (asset->state != QMAT_ASSET_WAITING) continue;
    asset->state = QMAT_ASSET_FAILED;
    asset->exit_code = -1;
    observer(user, batch, asset);
  }
  /* Cancelled tasks may have written exit codes meanwhile. */
  for (size_t i = 0; i < batch->count; i++) {
    exit_path(folder, i, path);
    unlink(path);
  }
  snprintf(path, sizeof path, "%s/array.sh", folder);
  unlink(path);
  return status;
}
