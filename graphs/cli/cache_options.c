/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdlib.h>
#include <string.h>

#include "graphs/cli/command.h"

const qmat_option qmat_cache_option_rows[] = {
    {"cache", 0, "DIR", "Folder of the cache; default $QMAT_CACHE, $XDG_CACHE_HOME/qmat or ~/.cache/qmat"},
    {"no-cache", 0, NULL, "Use no cache, like QMAT_CACHE=off"},
    {"cache-size", 0, "SIZE", "Delete the least recently used results above this size; default 10GB"},
    {"cache-read-only", 0, NULL, "Read results from the cache, but store none"},
    {"remote-cache", 0, "URL",
     "Share results through an HTTP server that takes GET, HEAD and PUT; default $QMAT_REMOTE_CACHE"},
    {"remote-read-only", 0, NULL, "Read results from the remote cache, but send none"},
    {0},
};

/* "500MB", "1.5 GB" or bytes; units of 1000. */
static bool parse_size(const char *text, uint64_t *size) {
  static const struct {
    const char *name;
    double factor;
  } units[] = {{"kB", 1e3}, {"MB", 1e6}, {"GB", 1e9}, {"TB", 1e12}, {"k", 1e3},
               {"M", 1e6},  {"G", 1e9},  {"T", 1e12}, {"B", 1},     {"", 1}};
  char digits[64];
  size_t length = strspn(text, "0123456789.");
  double number, factor = 0;
  if (length == 0 || length >= sizeof digits) return false;
  memcpy(digits, text, length);
  digits[length] = 0;
  const char *unit = text + length + strspn(text + length, " ");
  for (size_t i = 0; i < sizeof units / sizeof *units && factor == 0; i++)
    if (strcmp(unit, units[i].name) == 0) factor = units[i].factor;
  if (factor == 0 || !qmat_parse_number(digits, &number)) return false;
  if (!(number * factor >= 1) || number * factor > 0x1p62) return false;
  *size = (uint64_t)(number * factor);
  return true;
}

qmat_status qmat_open_cache(qmat_context *context, const qmat_invocation *invocation, qmat_cache *cache, bool *open) {
  const char *named = qmat_invocation_value(invocation, "cache"), *given = named ? named : getenv("QMAT_CACHE");
  const char *size = qmat_invocation_value(invocation, "cache-size");
  qmat_cache_options options = {.read_only = qmat_invocation_value(invocation, "cache-read-only") != NULL};
  const char *remote = qmat_invocation_value(invocation, "remote-cache");
  options.remote = remote ? remote : getenv("QMAT_REMOTE_CACHE");
  options.remote_read_only = qmat_invocation_value(invocation, "remote-read-only") != NULL;
  if (options.remote && !*options.remote) options.remote = NULL;
  *open = false;
  *cache = (qmat_cache){0};
  if (size && !parse_size(size, &options.most_size)) {
    qmat_fail(context, QMAT_ERROR_USAGE, "expected a size such as 500MB or 10GB, found '%s'", qmat_show(size).text);
    return qmat_fail_field(context, "--cache-size");
  }
  if (qmat_invocation_chooses(invocation, "no-cache", "cache")) return QMAT_OK;
  if (named && !*named) {
    qmat_fail(context, QMAT_ERROR_USAGE, "the folder of the cache is empty");
    return qmat_fail_field(context, "--cache");
  }
  if (given && (!*given || strcmp(given, "off") == 0) && !named) return QMAT_OK;
  char *folder = given ? qmat_strdup(given) : qmat_cache_default_folder();
  /* Without a home folder the run goes without a cache. */
  if (!folder) return given ? qmat_fail_memory(context, "cache") : QMAT_OK;
  options.folder = folder;
  qmat_status status = qmat_cache_open(context, &options, cache);
  qmat_free(folder);
  if (status == QMAT_OK)
    *open = true;
  else
    qmat_cache_close(cache);
  return status;
}
