/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report.picture: a surface and its medial mesh as an image. */
#include <math.h>
#include <string.h>

#include "core/node.h"
#include "io/png.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/page/certificate.h"
#include "nodes/page/figure.h"

typedef enum picture_format { FORMAT_PNG, FORMAT_SVG } picture_format;
typedef enum background { BACKGROUND_NONE, BACKGROUND_LIGHT, BACKGROUND_DARK } background;

typedef struct report_picture_params {
  int format;     /* a picture_format */
  int view;       /* a qmat_picture_view */
  int up;         /* of qmat_up_axes */
  int background; /* a background */
  int require;    /* a qmat_requirement */
  int64_t width, height;
  double turn, tilt;
} report_picture_params;

static qmat_picture_options options_of(const report_picture_params *params, const qmat_scene *scene) {
  static const double backgrounds[][4] = {{1, 1, 1, 0}, {1, 1, 1, 1}, {0.063, 0.078, 0.102, 1}};
  qmat_picture_options options = {
      .view = (qmat_picture_view)params->view,
      .turn = params->turn,
      .tilt = params->tilt,
      .is_z_up = qmat_shown_is_z_up(params->up, scene),
  };
  memcpy(options.background, backgrounds[params->background], sizeof options.background);
  return options;
}

/* Draws one mesh into its cell, and adds it to the caption. */
static qmat_status draw_mesh(qmat_context *context, const qmat_picture_options *options,
                             const qmat_value *const inputs[], size_t index, const size_t cell[4],
                             qmat_picture *picture, qmat_caption *caption) {
  const qmat_mesh *mesh = (const qmat_mesh *)qmat_shown_given(inputs[QMAT_SHOWN_MESH], index);
  const qmat_medial *medial = (const qmat_medial *)qmat_shown_given(inputs[QMAT_SHOWN_MEDIAL], index);
  const qmat_report *report = (const qmat_report *)qmat_shown_given(inputs[QMAT_SHOWN_REPORT], index);
  if (!mesh || !medial) return QMAT_OK;
  qmat_shown shown;
  qmat_status status = qmat_shown_init(context, mesh, medial, report, &shown);
  if (status == QMAT_OK)
    status = qmat_picture_draw(context, &shown, options, cell[0], cell[1], cell[2], cell[3], picture);
  caption->spheres += medial->sphere_count;
  caption->cones += medial->edge_count;
  caption->slabs += medial->triangle_count;
  const bool is_first = caption->range == 0, is_alike = fabs(shown.range - caption->range) <= 1e-9 * shown.range;
  caption->range = is_first || is_alike ? shown.range : (double)NAN;
  /* one mesh without errors leaves all without */
  const double out = qmat_shown_number(report, "surface_to_envelope"),
               in = qmat_shown_number(report, "envelope_to_surface");
  caption->error_out = out >= caption->error_out || isnan(out) ? out : caption->error_out;
  caption->error_in = in >= caption->error_in || isnan(in) ? in : caption->error_in;
  qmat_shown_uninit(&shown);
  return status;
}

/* Several meshes are drawn in rows of cells. */
static qmat_status draw(qmat_context *context, const report_picture_params *params, const qmat_value *const inputs[],
                        qmat_picture *picture, qmat_caption *caption) {
  const qmat_scene *scene = (const qmat_scene *)inputs[QMAT_SHOWN_SCENE];
  const qmat_picture_options options = options_of(params, scene);
  const size_t count = qmat_value_count(inputs[QMAT_SHOWN_MEDIAL]), width = picture->width, height = picture->height;
  size_t columns = 1;
  while (columns * columns < count && columns < width / 2) columns++;
  size_t rows = (count + columns - 1) / columns;
  if (rows > height) rows = height; /* the rest has no pixel */
  *caption = (qmat_caption){.name = scene ? scene->name : NULL,
                            .has_errors = params->view == QMAT_VIEW_BOTH || params->view == QMAT_VIEW_SURFACE,
                            .has_medial = params->view != QMAT_VIEW_SURFACE};
  qmat_status status = QMAT_OK;
  for (size_t i = 0; i < count && i < rows * columns && status == QMAT_OK; i++) {
    const size_t x = width * (i % columns) / columns, y = height * (i / columns) / rows;
    const size_t cell[4] = {x, y, width * (i % columns + 1) / columns - x, height * (i / columns + 1) / rows - y};
    const qmat_arena aside = qmat_arena_set_aside(&context->arena); /* each mesh frees its scratch memory */
    status = draw_mesh(context, &options, inputs, i, cell, picture, caption);
    qmat_arena_put_back(&context->arena, aside);
    if (status != QMAT_OK && count > 1 && inputs[QMAT_SHOWN_MEDIAL]->type == QMAT_LIST)
      qmat_fail_within(context, ((const qmat_list *)inputs[QMAT_SHOWN_MEDIAL])->names[i]);
  }
  return status;
}

static qmat_status run(qmat_context *context, const void *data, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const report_picture_params *params = data;
  qmat_picture picture;
  qmat_caption caption;
  qmat_writer writer = {0};
  qmat_file *file = NULL;
  qmat_status status = qmat_picture_init(context, (size_t)params->width, (size_t)params->height, &picture);
  if (status == QMAT_OK && params->require == QMAT_REQUIRE_CERTIFIED)
    status = qmat_check_reports_certify(context, inputs[QMAT_SHOWN_MEDIAL], inputs[QMAT_SHOWN_REPORT]);
  if (status == QMAT_OK) status = draw(context, params, inputs, &picture, &caption);
  const bool is_svg = params->format == FORMAT_SVG;
  if (status == QMAT_OK)
    status = is_svg ? qmat_figure_put(context, &picture, &caption, &writer)
                    : qmat_png_put(context, picture.pixels, picture.width, picture.height, &writer);
  if (status == QMAT_OK) status = qmat_writer_to_file(context, &writer, is_svg ? "svg" : "png", &file);
  qmat_writer_uninit(&writer);
  qmat_picture_uninit(&picture);
  if (status == QMAT_OK) outputs[0] = &file->base;
  return status;
}

static const char *const formats[] = {[FORMAT_PNG] = "png", [FORMAT_SVG] = "svg", NULL};
static const char *const views[] = {"both", "surface", "medial", "overlay", NULL};
static const char *const backgrounds[] = {"none", "light", "dark", NULL};

static const qmat_param params[] = {
    {.name = "format",
     .unit = "",
     .doc = "The format of the file; the ending of an output path sets it",
     .type = QMAT_PARAM_ENUM,
     .default_number = FORMAT_PNG,
     .choices = formats,
     .flags = QMAT_PARAM_OUTPUT_FORMAT,
     .offset = offsetof(report_picture_params, format)},
    QMAT_REQUIRE_PARAM(report_picture_params),
    QMAT_ENUM(report_picture_params, view, views, QMAT_VIEW_BOTH,
              "Surface coloured by its error, medial mesh, both side by side, or the one inside the other"),
    QMAT_ENUM(report_picture_params, background, backgrounds, BACKGROUND_NONE, "Colour behind the model; none: clear"),
    QMAT_INT(report_picture_params, width, "pixels", 960, 16, 8192, "Width of the image"),
    QMAT_INT(report_picture_params, height, "pixels", 480, 16, 8192, "Height of the image, without the caption of svg"),
    QMAT_SHOWN_PARAMS(report_picture_params),
    {0},
};

static const qmat_port inputs[] = {
    QMAT_SHOWN_INPUTS,
    {0},
};

static qmat_status check_counts(qmat_context *context, const void *data, const size_t counts[]) {
  (void)data;
  return qmat_shown_check_counts(context, inputs, counts);
}

static const qmat_port outputs[] = {
    {.name = "file", .type = QMAT_FILE, .doc = "The image", .on_request = true},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_embree, &qmat_library_png, NULL};

const qmat_node qmat_node_report_picture = {
    .name = "report.picture",
    .version = 3,
    .summary = "Draws a surface and its medial mesh as PNG or SVG",
    .doc =
        "Spheres are orange, cones blue and slabs green, each cut exactly where others cover it. The surface has the "
        "colour of its signed distance to the envelope: blue inside of it, red outside, full at epsilon. Without a "
        "report colours end at the largest distance.\n\n"
        "svg is the same picture with a caption and a colour bar. Several meshes are drawn in rows, each in its own "
        "frame. report.page shows the same view in a browser. Rays are cast by Embree.",
    .citation = "",
    .params_size = sizeof(report_picture_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .check_counts = check_counts,
    .run = run,
};
