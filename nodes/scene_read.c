/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/node.h"
#include "io/model.h"
#include "nodes/descriptor/libraries.h"

typedef struct scene_read_params {
  const char *path;
  const char *mesh;
  int defects; /* qmat_defects */
  int64_t segments;
  int unit;
} scene_read_params;

static const char *const unit_choices[] = {"file", "mm", "cm", "m", "in", "ft", NULL};
static const double units_in_meters[] = {0, 0.001, 0.01, 1, 0.0254, 0.3048};
static const char *const defects_choices[] = {"refuse", "drop", NULL};

static const qmat_param params[] = {
    {.name = "path",
     .doc = "The model: .off, .obj, .ply, .stl, .gltf, .glb, .usd, .usda, .usdc or .usdz",
     .unit = "",
     .type = QMAT_PARAM_PATH,
     .flags = QMAT_PARAM_REQUIRED | QMAT_PARAM_INPUT_FILE,
     .offset = offsetof(scene_read_params, path)},
    {.name = "mesh",
     .doc =
         "Which meshes of a glTF or USD scene: all (each in its own space), merged (placed as one), or a name, path or "
         "number",
     .unit = "",
     .type = QMAT_PARAM_STRING,
     .default_text = "all",
     .offset = offsetof(scene_read_params, mesh)},
    QMAT_ENUM(scene_read_params, defects, defects_choices, QMAT_DEFECTS_DROP,
              "Facets of fewer than three different vertices, or with those of another facet: an error, or dropped and "
              "counted"),
    QMAT_INT(scene_read_params, segments, "sides", 64, 8, 1024,
             "Sides of the polygons that stand for the circles of USD's spheres, capsules, cylinders and cones"),
    QMAT_ENUM(
        scene_read_params, unit, unit_choices, 0,
        "The unit of length of an OBJ, OFF, PLY or STL file, for lengths such as epsilon=5mm; file: as it states"),
    {0}};

enum { SCENE, MESH, REPORT };

static const qmat_port outputs[] = {
    [SCENE] = {.name = "scene",
               .type = QMAT_SCENE,
               .doc = "The model's name, format and unit; for glTF also the whole asset, for USD its files and the "
                      "places of its meshes"},
    [MESH] = {.name = "mesh",
              .type = QMAT_MESH,
              .doc = "The surface as triangles; a list where the scene has several meshes",
              .list = true},
    [REPORT] = {.name = "report", .type = QMAT_REPORT, .doc = "Counts of what was read and changed"},
    {0}};

static qmat_status run(qmat_context *context, const void *raw_params, const qmat_value *const inputs[],
                       qmat_value *made[]) {
  (void)inputs;
  const scene_read_params *p = raw_params;
  const qmat_read_options options = {.defects = (qmat_defects)p->defects,
                                     .segments = (size_t)p->segments,
                                     .meters_per_unit = units_in_meters[p->unit]};
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

static const qmat_library *const libraries[] = {&qmat_library_draco, &qmat_library_meshoptimizer,
                                                &qmat_library_tinygltf, NULL};

const qmat_node qmat_node_scene_read = {
    .name = "scene.read",
    .version = 23,
    .summary = "Reads a 3D model as a triangle mesh, or one for each mesh of a glTF or USD scene",
    .doc =
        "The file's first bytes give the format. Equal vertices are merged, polygons triangulated, unused vertices "
        "removed, and triangles oriented, outward where the surface is closed. The report counts all of this.\n\n"
        "A glTF scene is kept whole for scene.write, with its files; outside of its folder only images are read. Its "
        "meshes are read one by one, in their own spaces and in bind pose, and later nodes run once for each. Meshes "
        "on no node and meshes without triangles are left out. Meshes that differ by the rounding of single precision "
        "are one, with a deviation that covers it. With mesh=merged all meshes are one surface in world "
        "space, skins in their current pose. Skinned meshes, also those of UsdSkel, keep the four strongest joints of "
        "each vertex.\n\n"
        "A USD scene is read alike: equal meshes are one, wherever references, instances and point instancers place "
        "it, "
        "and warnings name what was left out. Skeletons and their motion are kept for glTF. Subdivision surfaces are "
        "control cages, for mesh.subdivide. Sphere, "
        "Cube, "
        "Capsule, Cylinder and Cone are solids; the mesh's deviation is that of the polygons from their circles.",
    .citation = "",
    .params_size = sizeof(scene_read_params),
    .params = params,
    .outputs = outputs,
    .libraries = libraries,
    .effort = 1,
    .run = run,
};
