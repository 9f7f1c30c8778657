/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_USD_USD_KEEP_H
#define QMAT_IO_USD_USD_KEEP_H

#include "io/usd/usd_stage.h"

/* Keeps a stage that was read for qmat_usd_write_layer: scene->parts becomes one part, the file in `bytes` as it is;
 * or, where it refers to other layers or images, a USDZ package of all of them, with the names that they have relative
 * to each other. Images are recognised by their first bytes. Other assets are not kept, with a warning. A stage with
 * files that have no such name, or with packages inside of it, is not kept, with a warning. QMAT_ERROR_MEMORY;
 * QMAT_ERROR_IO for a file that is no longer there. Cost: reads the files again. */
qmat_status qmat_usd_keep(qmat_context *context, const qmat_usd_stage *stage, const qmat_bytes *bytes,
                          qmat_scene *scene);

#endif
