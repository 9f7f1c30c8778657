/* SPDX-License-Identifier: GPL-3.0-or-later */
/* report.page: a surface and its medial mesh as one HTML file, to look at in a browser. */
#include <stdatomic.h>

#include "core/node.h"
#include "core/side_by_side.h"
#include "io/page/page_write.h"
#include "nodes/descriptor/libraries.h"
#include "nodes/page/certificate.h"
#include "nodes/page/figure.h"
#include "nodes/page/look.h"
#include "nodes/page/page_data.h"

typedef enum page_format { FORMAT_HTML, FORMAT_HTM } page_format;

typedef struct report_page_params {
  int format;  /* a page_format */
  int up;      /* of qmat_up_axes */
  int require; /* a qmat_requirement */
  int64_t levels;
  double turn, tilt;
} report_page_params;

/* The picture for browsers without WebGL. */
enum { PICTURE_WIDTH = 960, PICTURE_HEIGHT = 480 };

static const char *name_of(const qmat_value *const inputs[], size_t index) {
  const qmat_value *medial = inputs[QMAT_SHOWN_MEDIAL];
  if (medial->type == QMAT_LIST) return ((const qmat_list *)medial)->names[index];
  const qmat_scene *scene = (const qmat_scene *)inputs[QMAT_SHOWN_SCENE];
  return scene && *scene->name ? scene->name : "model";
}

/* A list of several meshes has the scene's name, else that of its first mesh. */
static const char *title_of(const qmat_value *const inputs[]) {
  const qmat_scene *scene = (const qmat_scene *)inputs[QMAT_SHOWN_SCENE];
  return scene && *scene->name ? scene->name : name_of(inputs, 0);
}

/* The first mesh with the same values; `index` itself where there is none before it. */
static size_t first_equal(const qmat_value *const inputs[], size_t index) {
  for (size_t j = 0; j < index; j++) {
    bool equal = true;
    for (int i = QMAT_SHOWN_MESH; i <= QMAT_SHOWN_CHAIN && equal; i++)
      equal = !inputs[i] ||
              qmat_digest_equal(&qmat_value_at(inputs[i], j)->digest, &qmat_value_at(inputs[i], index)->digest);
    if (equal) return j;
  }
  return index;
}

/* The meshes of a page while they are made. */
typedef struct page_meshes {
  const report_page_params *params;
  const qmat_value *const *inputs;
  size_t drawn;  /* the mesh that makes the picture */
  json_t **data; /* per mesh */
  char *picture;
  _Atomic size_t done;
} page_meshes;

static bool is_described(const qmat_value *const inputs[], size_t index) {
  return qmat_shown_given(inputs[QMAT_SHOWN_MESH], index) && qmat_shown_given(inputs[QMAT_SHOWN_MEDIAL], index);
}

static qmat_status draw_picture(qmat_context *context, const qmat_shown *shown, page_meshes *all) {
  const qmat_scene *scene = (const qmat_scene *)all->inputs[QMAT_SHOWN_SCENE];
  const qmat_picture_options options = {
      .turn = all->params->turn, .tilt = all->params->tilt, .is_z_up = qmat_shown_is_z_up(all->params->up, scene)};
  qmat_picture drawn = {0};
  qmat_status status = qmat_picture_init(context, PICTURE_WIDTH, PICTURE_HEIGHT, &drawn);
  if (status == QMAT_OK)
    status = qmat_picture_draw(context, shown, &options, 0, 0, PICTURE_WIDTH, PICTURE_HEIGHT, &drawn);
  if (status == QMAT_OK) all->picture = qmat_figure_base64(context, &drawn);
  if (status == QMAT_OK && !all->picture) status = context->error.status;
  qmat_picture_uninit(&drawn);
  return status;
}

/* The numbers of a mesh that is described and equal to none before it. */
static qmat_status describe(qmat_context *context, page_meshes *all, size_t index) {
  const qmat_value *const *inputs = all->inputs;
  const qmat_report *report = (const qmat_report *)qmat_shown_given(inputs[QMAT_SHOWN_REPORT], index);
  qmat_shown shown;
  qmat_status status =
      qmat_shown_init(context, (const qmat_mesh *)qmat_shown_given(inputs[QMAT_SHOWN_MESH], index),
                      (const qmat_medial *)qmat_shown_given(inputs[QMAT_SHOWN_MEDIAL], index), report, &shown);
  if (status == QMAT_OK) {
    const qmat_chain *chain = (const qmat_chain *)qmat_shown_given(inputs[QMAT_SHOWN_CHAIN], index);
    all->data[index] = qmat_page_data(context, &shown, report, chain, (size_t)all->params->levels);
    status = all->data[index] ? QMAT_OK : context->error.status;
  }
  if (status == QMAT_OK && index == all->drawn) status = draw_picture(context, &shown, all);
  qmat_shown_uninit(&shown);
  return status == QMAT_OK || qmat_value_count(inputs[QMAT_SHOWN_MEDIAL]) == 1
             ? status
             : qmat_fail_within(context, name_of(inputs, index));
}

/* Makes the data of one mesh. One that could not be described has only its reason. */
static qmat_status make_mesh(void *user, qmat_context *context, size_t index) {
  page_meshes *all = user;
  const qmat_value *const *inputs = all->inputs;
  const size_t equal = first_equal(inputs, index);
  qmat_status status = QMAT_OK;
  if (!is_described(inputs, index)) {
    const qmat_value *mesh = qmat_shown_given(inputs[QMAT_SHOWN_MESH], index);
    const char *reason = qmat_value_failure(qmat_value_at(inputs[mesh ? QMAT_SHOWN_MEDIAL : QMAT_SHOWN_MESH], index));
    all->data[index] = json_pack("{s:s}", "failure", reason);
  } else if (equal < index) {
    all->data[index] = json_pack("{s:I}", "same", (json_int_t)equal);
  } else {
    status = describe(context, all, index);
  }
  atomic_fetch_add(&all->done, 1);
  if (status == QMAT_OK &&
      (!all->data[index] || json_object_set_new(all->data[index], "name", json_string(name_of(inputs, index)))))
    status = qmat_fail_memory(context, "the page");
  return status;
}

/* Adds all meshes, several side by side. `picture` gets that of the first that is described; the caller frees it. */
static qmat_status add_meshes(qmat_context *context, const report_page_params *params, const qmat_value *const inputs[],
                              json_t *meshes, char **picture) {
  const size_t count = qmat_value_count(inputs[QMAT_SHOWN_MEDIAL]);
  page_meshes all = {.params = params, .inputs = inputs, .data = qmat_calloc(count, sizeof *all.data)};
  if (!all.data) return qmat_fail_memory(context, "the page");
  while (all.drawn < count && !is_described(inputs, all.drawn)) all.drawn++;
  qmat_status status = count == 1 ? make_mesh(&all, context, 0)
                                  : qmat_run_side_by_side(context, count, make_mesh, &all, &all.done, count, "meshes");
  for (size_t i = 0; i < count; i++) {
    if (status != QMAT_OK)
      json_decref(all.data[i]);
    else if (json_array_append_new(meshes, all.data[i]))
      status = qmat_fail_memory(context, "the page");
  }
  *picture = all.picture;
  qmat_free(all.data);
  return status;
}

static qmat_status fill(qmat_context *context, const report_page_params *params, const qmat_value *const inputs[],
                        json_t *data, char **picture) {
  const qmat_scene *scene = (const qmat_scene *)inputs[QMAT_SHOWN_SCENE];
  const bool is_z_up = qmat_shown_is_z_up(params->up, scene);
  json_t *meshes = json_array();
  int bad = json_object_set_new(data, "meshes", meshes);
  bad |= json_object_set_new(data, "look", qmat_look_json());
  bad |= json_object_set_new(data, "title", json_string(title_of(inputs)));
  bad |= json_object_set_new(data, "format", json_string(scene ? scene->format : ""));
  bad |= json_object_set_new(data, "version", json_string(QMAT_VERSION));
  bad |= json_object_set_new(data, "camera",
                             json_pack("{s:f, s:f, s:b}", "turn", params->turn, "tilt", params->tilt, "z_up", is_z_up));
  return bad ? qmat_fail_memory(context, "the page") : add_meshes(context, params, inputs, meshes, picture);
}

static qmat_status run(qmat_context *context, const void *parameters, const qmat_value *const inputs[],
                       qmat_value *outputs[]) {
  const report_page_params *params = parameters;
  json_t *data = json_object();
  char *picture = NULL;
  qmat_writer writer = {0};
  qmat_file *file = NULL;
  qmat_status status = data ? QMAT_OK : qmat_fail_memory(context, "the page");
  if (status == QMAT_OK && params->require == QMAT_REQUIRE_CERTIFIED)
    status = qmat_check_reports_certify(context, inputs[QMAT_SHOWN_MEDIAL], inputs[QMAT_SHOWN_REPORT]);
  if (status == QMAT_OK) status = fill(context, params, inputs, data, &picture);
  if (status == QMAT_OK) {
    const qmat_page page = {.title = title_of(inputs), .picture = picture ? picture : "", .data = data};
    status = qmat_page_put(context, &page, &writer);
  }
  if (status == QMAT_OK) status = qmat_writer_to_file(context, &writer, "html", &file);
  qmat_writer_uninit(&writer);
  qmat_free(picture);
  json_decref(data);
  if (status == QMAT_OK) outputs[0] = &file->base;
  return status;
}

static const char *const formats[] = {[FORMAT_HTML] = "html", [FORMAT_HTM] = "htm", NULL};

static const qmat_param params[] = {
    {.name = "format",
     .unit = "",
     .doc = "The format of the file; the ending of an output path sets it",
     .type = QMAT_PARAM_ENUM,
     .default_number = FORMAT_HTML,
     .choices = formats,
     .flags = QMAT_PARAM_OUTPUT_FORMAT,
     .offset = offsetof(report_page_params, format)},
    QMAT_REQUIRE_PARAM(report_page_params),
    QMAT_INT(report_page_params, levels, "spheres", 4000, 1, 1000000,
             "The finest level of detail of the slider; more make the page larger"),
    QMAT_SHOWN_PARAMS(report_page_params),
    {0},
};

static const qmat_port inputs[] = {
    QMAT_SHOWN_INPUTS,
    {.name = "chain",
     .type = QMAT_CHAIN,
     .optional = true,
     .doc = "From medial.chain, for the slider of levels of detail",
     .list = true},
    {0},
};

static qmat_status check_counts(qmat_context *context, const void *data, const size_t counts[]) {
  (void)data;
  return qmat_shown_check_counts(context, inputs, counts);
}

static const qmat_port outputs[] = {
    {.name = "file", .type = QMAT_FILE, .doc = "The page", .on_request = true},
    {0},
};

static const qmat_library *const libraries[] = {&qmat_library_embree, &qmat_library_png, NULL};

const qmat_node qmat_node_report_page = {
    .name = "report.page",
    .version = 5,
    .summary = "Makes a page that shows a surface and its medial mesh in a browser",
    .doc =
        "One HTML file, which needs no server, no network and no other file. It shows the surface, coloured by its "
        "signed distance to the envelope, beside the spheres, cones and slabs or around them, with one camera; the "
        "places where either error is largest; the errors and the topology; and each mesh of a scene.\n\n"
        "With a chain a slider goes through its levels of detail, from `levels` spheres down to one. It stops "
        "at those with proved bounds of both errors (bounds of medial.chain), and above them at four in each doubling, "
        "whose errors hold at the constraint points. The spheres and errors of a level are those of medial.lod.\n\n"
        "Primitives are intersected exactly for each pixel (WebGL 2). Browsers without it show a picture, as "
        "report.picture draws it.",
    .citation = "",
    .params_size = sizeof(report_page_params),
    .params = params,
    .inputs = inputs,
    .outputs = outputs,
    .libraries = libraries,
    .check_counts = check_counts,
    .run = run,
};
