/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc_original.h"

#include <string.h>

#include "io/usd/usdc.h"
#include "io/usd/usdc_write.h"

static const char entry[] = "qmat_original";

qmat_status qmat_usdc_rename_original(qmat_context *context, const qmat_file_part *part, const char *name,
                                      qmat_writer *out) {
  const qmat_bytes bytes = {.size = part->size, .data = part->bytes};
  qmat_usd_layer layer = {0};
  qmat_usd_value text;
  qmat_status status = qmat_usdc_read(context, &bytes, "the output", &layer);
  if (status == QMAT_OK) status = qmat_usd_make_text(&layer, QMAT_USD_STRING, name, &text);
  if (status == QMAT_OK) {
    const qmat_usd_field data = {.name = entry, .value = &text};
    const qmat_usd_value dictionary = {.type = QMAT_USD_DICTIONARY, .components = 1, .count = 1, .entries = &data};
    qmat_usd_value sublayers = text;
    sublayers.is_array = true;
    status = qmat_usd_set_field(&layer, layer.root, "subLayers", &sublayers);
    if (status == QMAT_OK) status = qmat_usd_set_field(&layer, layer.root, "customLayerData", &dictionary);
    if (status == QMAT_OK) status = qmat_usdc_write(context, &layer, out);
  }
  qmat_usd_layer_uninit(&layer);
  return status;
}

bool qmat_usdc_has_original(const char *path, const char *name) {
  qmat_context context = {0};
  qmat_bytes bytes = {0};
  qmat_usd_layer layer = {0};
  bool found = false;
  if (qmat_bytes_read_file(&context, path, &bytes) == QMAT_OK && qmat_usdc_is_crate(&bytes) &&
      qmat_usdc_read(&context, &bytes, path, &layer) == QMAT_OK) {
    const char *text = qmat_usd_original_of(&layer);
    found = text && strcmp(text, name) == 0;
  }
  qmat_usd_layer_uninit(&layer);
  qmat_bytes_uninit(&bytes);
  qmat_context_uninit(&context);
  return found;
}
