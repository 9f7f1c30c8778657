/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_CONVEX_POLYGON_H
#define QMAT_CORE_GEOMETRY_CONVEX_POLYGON_H

#include <string.h>

/* Cuts a convex polygon by a plane (Sutherland and Hodgman 1974). heights[i] is the signed height of corner i above the
 * plane; what is not above goes to `kept`, which is not `polygon`. Returns the number of corners kept, 0 for a polygon
 * of none. It is at most count + 1 where heights have no rounding errors. Those of corners on the plane may alternate,
 * so `kept` needs room for 3 * count / 2 corners. */
static inline int qmat_convex_polygon_cut(double (*polygon)[3], const double *heights, int count, double (*kept)[3]) {
  int corners = 0;
  for (int i = 0; i < count; i++) {
    const int next = i + 1 < count ? i + 1 : 0;
    const double a = heights[i], b = heights[next];
    if (a <= 0) memcpy(kept[corners++], polygon[i], sizeof kept[0]);
    if (!((a < 0 && b > 0) || (a > 0 && b < 0))) continue;
    const double t = a / (a - b);
    for (int k = 0; k < 3; k++) kept[corners][k] = polygon[i][k] + t * (polygon[next][k] - polygon[i][k]);
    corners++;
  }
  return corners;
}

#endif
