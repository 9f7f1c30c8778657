/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "graphs/cli/batch_page.h"

#include <stdio.h>
#include <string.h>

#include "core/json_text.h"
#include "core/text.h"
#include "io/page/page_write.h"
#include "io/save.h"

/* The name in the folder of an asset's output with this ending; NULL: none. */
static const char *saved_name(const qmat_asset *asset, const char *folder, const char *ending) {
  const json_t *outputs = json_object_get(asset->result, "outputs");
  const size_t length = strlen(folder), size = strlen(ending);
  for (size_t i = 0; asset->state == QMAT_ASSET_DONE && i < json_array_size(outputs); i++) {
    const char *path = json_string_value(json_object_get(json_array_get(outputs, i), "path"));
    if (!path || strncmp(path, folder, length) != 0 || path[length] != '/') continue;
    const size_t all = strlen(path);
    if (all > size && strcmp(path + all - size, ending) == 0) return path + length + 1;
  }
  return NULL;
}

/* A relative address: every byte that is not plain in one is escaped. */
static void put_address(qmat_writer *writer, const char *name) {
  static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.~/";
  for (; *name; name++) {
    char escaped[4] = {*name, 0};
    if (!strchr(plain, *name)) snprintf(escaped, sizeof escaped, "%%%02X", (unsigned)(unsigned char)*name);
    qmat_put_text(writer, escaped);
  }
}

/* Bytes that are not UTF-8 become '?'. */
static void put_name(qmat_writer *writer, const char *name) {
  json_t *text = qmat_json_string(name);
  if (text)
    qmat_put_markup(writer, json_string_value(text));
  else
    writer->failed = true;
  json_decref(text);
}

static void put_number(qmat_writer *writer, const json_t *value) {
  char text[48] = "";
  if (json_is_integer(value))
    qmat_format_count((uint64_t)json_integer_value(value), text);
  else if (json_is_number(value))
    qmat_format_bound(json_real_value(value), text);
  qmat_put_text(writer, "<td data-value=\"");
  if (*text) qmat_put_number(writer, json_number_value(value));
  qmat_put_text(writer, "\">");
  qmat_put_markup(writer, text);
  qmat_put_text(writer, "</td>");
}

static void put_picture(qmat_writer *writer, const char *page, const char *picture) {
  qmat_put_text(writer, "<td class=\"picture\">");
  if (page && picture) {
    qmat_put_text(writer, "<a tabindex=\"-1\" aria-hidden=\"true\" href=\"");
    put_address(writer, page);
    qmat_put_text(writer, "\">");
  }
  if (picture) {
    qmat_put_text(writer, "<img alt=\"\" loading=\"lazy\" src=\"");
    put_address(writer, picture);
    qmat_put_text(writer, page ? "\"></a>" : "\">");
  }
  qmat_put_text(writer, "</td>");
}

/* Why an asset failed, or what it came to, and the warnings of its run. Sorting by it gives: failed, not run, not
 * certified, good. */
static void put_result(qmat_writer *writer, const qmat_asset *asset) {
  const json_t *certified = json_object_get(json_object_get(asset->result, "summary"), "certified");
  char error[2048] = "";
  const char *text = json_is_true(certified) ? "certified" : json_is_false(certified) ? "not certified" : "done";
  int order = json_is_false(certified) ? 2 : 3;
  if (asset->state == QMAT_ASSET_FAILED) {
    qmat_asset_error(asset, error, sizeof error);
    text = *error ? error : "failed";
    order = 0;
  } else if (asset->state != QMAT_ASSET_DONE) {
    text = "not run";
    order = 1;
  }
  qmat_put_text(writer,
                order == 3 ? "<td class=\"result good\" data-value=\"" : "<td class=\"result bad\" data-value=\"");
  qmat_put_integer(writer, order);
  qmat_put_text(writer, "\">");
  put_name(writer, text);
  const json_t *warnings = json_object_get(asset->result, "warnings");
  for (size_t i = 0; i < json_array_size(warnings); i++) {
    qmat_put_text(writer, "<br>");
    qmat_put_markup(writer, json_string_value(json_array_get(warnings, i)));
  }
  qmat_put_text(writer, "</td>");
}

static void put_row(qmat_writer *writer, const qmat_asset *asset, const qmat_summary_entry *entries,
                    const char *folder) {
  const json_t *summary = json_object_get(asset->result, "summary");
  const char *page = saved_name(asset, folder, ".html");
  qmat_put_text(writer, "<tr>");
  put_picture(writer, page, saved_name(asset, folder, ".png"));
  qmat_put_text(writer, "<th scope=\"row\">");
  if (page) {
    qmat_put_text(writer, "<a href=\"");
    put_address(writer, page);
    qmat_put_text(writer, "\">");
  }
  put_name(writer, asset->stem);
  qmat_put_text(writer, page ? "</a></th>" : "</th>");
  put_result(writer, asset);
  for (size_t i = 0; entries[i].key; i++)
    if (entries[i].title) put_number(writer, json_object_get(summary, entries[i].key));
  qmat_put_text(writer, "</tr>\n");
}

static void put_table(qmat_writer *writer, const qmat_batch *batch, const qmat_summary_entry *entries,
                      const char *folder) {
  qmat_put_text(writer,
                "<thead><tr><td></td><th scope=\"col\"><button type=\"button\">asset</button></th>"
                "<th scope=\"col\" class=\"result\"><button type=\"button\">result</button></th>");
  for (size_t i = 0; entries[i].key; i++) {
    if (!entries[i].title) continue;
    qmat_put_text(writer, "<th scope=\"col\"><button type=\"button\">");
    qmat_put_markup(writer, entries[i].title);
    qmat_put_text(writer, "</button></th>");
  }
  qmat_put_text(writer, "</tr></thead>\n<tbody>\n");
  for (int failures = 1; failures >= 0; failures--)
    for (size_t i = 0; i < batch->count; i++)
      if ((batch->assets[i].state == QMAT_ASSET_FAILED) == failures)
        put_row(writer, &batch->assets[i], entries, folder);
  qmat_put_text(writer, "</tbody>\n");
}

qmat_status qmat_batch_page_save(qmat_context *context, const qmat_batch *batch, const qmat_summary_entry *entries,
                                 const char *folder) {
  qmat_writer table = {0}, writer = {0};
  size_t counts[4] = {0};
  char title[96], path[4200];
  for (size_t i = 0; i < batch->count; i++) counts[batch->assets[i].state]++;
  snprintf(title, sizeof title, "%zu done, %zu failed, %zu not run", counts[QMAT_ASSET_DONE], counts[QMAT_ASSET_FAILED],
           counts[QMAT_ASSET_WAITING] + counts[QMAT_ASSET_RUNNING]);
  put_table(&table, batch, entries, folder);
  qmat_put_u8(&table, 0);
  qmat_status status = table.failed ? qmat_fail_memory(context, "the page of the batch") : QMAT_OK;
  if (status == QMAT_OK) status = qmat_index_put(context, title, (const char *)table.bytes, &writer);
  qmat_file *file = NULL;
  if (status == QMAT_OK) status = qmat_writer_to_file(context, &writer, "html", &file);
  if (status == QMAT_OK && snprintf(path, sizeof path, "%s/index.html", folder) >= (int)sizeof path)
    status = qmat_fail(context, QMAT_ERROR_IO, "the path of the page is too long");
  if (status == QMAT_OK) status = qmat_file_save(context, file, path);
  qmat_value_release(file ? &file->base : NULL);
  qmat_writer_uninit(&writer);
  qmat_writer_uninit(&table);
  return status;
}
