/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/colliders/rigid_body.h"

#include <math.h>

#include "core/geometry/sheets.h"
#include "core/geometry/vector.h"

/* Below this volume, in cubic diagonals, rounding decides. */
static const double least_volume = 1e-12;

bool qmat_rigid_body_of_surface(const qmat_surface *surface, double density, double body[10], double *volume) {
  static const int pairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  const qmat_mesh *mesh = qmat_surface_mesh(surface);
  const double *positions = qmat_surface_positions(surface);
  const qmat_frame *frame = qmat_surface_frame(surface);
  double sum = 0, first[3] = {0}, second[6] = {0};
  *volume = 0;
  if (!mesh->closed || !mesh->oriented) return false;
  /* Each triangle spans a tetrahedron with the origin, whose volume has a sign. */
  for (size_t t = 0; t < qmat_solid_triangle_count(mesh); t++) { /* sheets have no volume */
    const double *corners[3];
    double cross[3], s[3];
    for (int k = 0; k < 3; k++) corners[k] = &positions[3 * (size_t)mesh->triangles[3 * t + (size_t)k]];
    qmat_cross(corners[1], corners[2], cross);
    const double six = qmat_dot(corners[0], cross);
    for (int k = 0; k < 3; k++) s[k] = corners[0][k] + corners[1][k] + corners[2][k];
    sum += six / 6;
    for (int k = 0; k < 3; k++) first[k] += six / 24 * s[k];
    for (int m = 0; m < 6; m++) {
      const int i = pairs[m][0], j = pairs[m][1];
      double products = s[i] * s[j];
      for (int k = 0; k < 3; k++) products += corners[k][i] * corners[k][j];
      second[m] += six / 120 * products;
    }
  }
  const double sign = sum < 0 ? -1 : 1; /* a surface may be inside out */
  if (!(sign * sum > least_volume)) return false;
  *volume = sign * sum;
  double centre[3], spread[6];
  for (int k = 0; k < 3; k++) centre[k] = first[k] / sum;
  for (int m = 0; m < 6; m++) spread[m] = sign * (second[m] - sum * centre[pairs[m][0]] * centre[pairs[m][1]]);
  const double meters = (mesh->meters_per_unit > 0 ? mesh->meters_per_unit : 1) * frame->diagonal;
  const double share = density * meters * meters * meters; /* kg per cubic diagonal */
  const double mass = share * *volume, square = share * frame->diagonal * frame->diagonal;
  body[0] = mass;
  qmat_frame_to_model(frame, centre, 1, &body[1]);
  const double trace = spread[0] + spread[1] + spread[2];
  for (int m = 0; m < 6; m++) body[4 + m] = square * (m < 3 ? trace - spread[m] : -spread[m]);
  for (int k = 0; k < 10; k++)
    if (!isfinite(body[k])) return false;
  return mass > 0;
}
