/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/node.h"
#include "io/model.h"
#include "nodes/descriptor/libraries.h"

typedef struct scene_read_params {
  const char *path;
  const char *mesh;
  int defects; /* qmat_defects */
} scene_read_params;

static const char *const defects_choices[] = {"refuse", "drop", NULL};

static const qmat_param params[] = {
    {.name = "path",
     .doc = "The model: .off, .obj, .ply, .stl, .gltf, .glb, .usd, .usda, .usdc or .usdz",
     .unit = "",
     .type = QMAT_PARAM_PATH,
     .flags = QMAT_PARAM_REQUIRED | QMAT_PARAM_INPUT_FILE,
     .offset = offsetof(scene_read_params, path)},
    {.name = "mesh",
     .doc = "Of glTF: all (each by itself, in its own space), merged (all placed as one), or a mesh's name or number",
     .unit = "",
     .type = QMAT_PARAM_STRING,
     .default_text = "all",
     .offset = offsetof(scene_read_params, mesh)},
    {.name = "defects",
     .doc = "What becomes of facets that name a vertex twice or repeat another facet's vertices",
     .unit = "",
     .type = QMAT_PARAM_ENUM,
     .default_number = QMAT_DEFECTS_REFUSE,
     .choices = defects_choices,
     .offset = offsetof(scene_read_params, defects)},
    {0}};

enum { SCENE, MESH, REPORT };

static const qmat_port outputs[] = {
    [SCENE] = {.name = "scene",
               .type = QMAT_SCENE,
               .doc = "The model's name, format and unit; of glTF the whole asset"},
    [MESH] = {.name = "mesh",
              .type = QMAT_MESH,
              .doc = "Its surface as triangles; of several meshes a list",
              .list = true},
    [REPORT] = {.name = "report", .type = QMAT_REPORT, .doc = "What was read and what was done to it"},
    {0}};

static qmat_status run(qmat_context *context, const void *raw_params, const qmat_value *const inputs[],
                       qmat_value *made[]) {
  (void)inputs;
  const scene_read_params *p = raw_params;
  const qmat_read_options options = {.defects = (qmat_defects)p->defects};
  qmat_scene *scene;
  qmat_value *mesh;
  qmat_report *report;
  const qmat_status status = qmat_model_read_meshes(context, p->path, &options, p->mesh, &scene, &mesh, &report);
  if (status != QMAT_OK) return status;
  made[SCENE] = &scene->base;
  made[MESH] = mesh;
  made[REPORT] = &report->base;
  return QMAT_OK;
}

static const qmat_library *const libraries[] = {&qmat_library_draco, &qmat_library_tinygltf, NULL};

const qmat_node qmat_node_scene_read = {
    .name = "scene.read",
    .version = 5,
    .summary = "Reads a 3D model as a triangle mesh, or one for each mesh of a glTF scene",
    .doc =
        "The format is told by the file's first bytes and must agree with its ending. Vertices at equal positions "
        "become one, polygons are cut into triangles, unused vertices are left out, and the triangles get one "
        "orientation, outward where the surface is closed. The report counts all of this, border edges, "
        "non-manifold edges, components and the Euler characteristic. A glTF scene is "
        "kept whole, with the files that it refers to, for scene.write to hand on; its meshes are read one by one, as "
        "they are stored: in their own spaces, in bind pose, without the transforms of the nodes that carry them, and "
        "once, however many those are. Meshes that no node carries, and those without triangles, are left out. Nodes "
        "that take a mesh then run once for each; where one of several meshes has no usable facets or no inside, the "
        "others are described all the same. merged places all meshes as one surface in world space, skins in the "
        "pose that their joints stand in. Of USD all meshes are placed as one; USD layers are composed from the files "
        "beside them, and the report's warnings say what was left out. Subdivision surfaces are "
        "placed as their control cages, which mesh.subdivide takes to the limit.",
    .citation = "",
    .params_size = sizeof(scene_read_params),
    .params = params,
    .outputs = outputs,
    .libraries = libraries,
    .run = run,
};
