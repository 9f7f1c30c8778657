/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_IO_ROBOT_WRITE_H
#define QMAT_IO_ROBOT_WRITE_H

#include "core/value.h"

typedef enum qmat_robot_format {
  QMAT_ROBOT_URDF, /* one link; hulls are STL files beside it */
  QMAT_ROBOT_MJCF, /* one body with a free joint; hulls are meshes in the file, whose convex hull MuJoCo takes */
  QMAT_ROBOT_YAML  /* collision_spheres of cuRobo; spheres only */
} qmat_robot_format;

/* Makes a file of colliders and their mass properties as robot simulators read it. `name` (UTF-8; NULL: none) names the
 * link; other characters than letters, digits, "_" and "-" become "_". Lengths are in metres: `meters_per_unit` (0:
 * unknown, taken for 1) times those of the colliders. Spheres are spheres; capsules of one radius are capsules in MJCF;
 * all others are hulls. `*file` is sealed and released by the caller; NULL on failure. QMAT_ERROR_USAGE for YAML of
 * shapes that are no spheres, QMAT_ERROR_MEMORY. One thread; the same bytes for the same input. Linear. */
qmat_status qmat_robot_write(qmat_context *context, const qmat_colliders *colliders, qmat_robot_format format,
                             const char *name, double meters_per_unit, qmat_file **file);

#endif
