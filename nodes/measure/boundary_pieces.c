/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/measure/boundary_pieces.h"

#include <math.h>
#include <string.h>

#include "core/geometry/triangle.h"
#include "core/geometry/vector.h"

/* By this the cube of space is larger than the box of the spheres: more than rounding. */
static const double rounding = 1e-9;

size_t qmat_boundary_pieces_of_feature(const qmat_boundary_features *f, size_t feature, uint8_t wanted,
                                       qmat_boundary_piece pieces[]) {
  qmat_boundary_piece root = {.feature = (uint32_t)feature, .near = QMAT_NONE, .wanted = wanted};
  size_t row;
  qmat_cone_side side;
  switch (qmat_boundary_feature_kind(f, feature, &row)) {
    case QMAT_FEATURE_SPHERE:
      for (int octant = 0; octant < 8; octant++) {
        for (int i = 0; i < 3; i++) root.at[4 * i] = octant >> i & 1 ? -1 : 1;
        pieces[octant] = root;
      }
      return 8;
    case QMAT_FEATURE_CONE_SIDE:
      if (!qmat_cone_side_of_edge(f, row, &side)) return 0;
      root.at[1] = 1;
      for (int quarter = 0; quarter < 4; quarter++) {
        root.at[2] = 0.5 * QMAT_PI * quarter;
        root.at[3] = 0.5 * QMAT_PI * (quarter + 1);
        pieces[quarter] = root;
      }
      return 4;
    default:
      if (!qmat_slab_face(f, row, root.at)) return 0;
      pieces[0] = root;
      return 1;
  }
}

qmat_boundary_piece qmat_boundary_piece_of_space(const qmat_boundary_features *f, uint8_t wanted) {
  qmat_boundary_piece cell = {.feature = QMAT_CELL, .near = QMAT_NONE, .wanted = wanted};
  for (int k = 0; k < 3; k++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < f->sphere_count; i++) {
      const double *sphere = &f->spheres[4 * i];
      low = qmat_smaller(low, sphere[k] - sphere[3]);
      high = qmat_larger(high, sphere[k] + sphere[3]);
    }
    cell.at[k] = 0.5 * (low + high);
    cell.at[3] = qmat_larger(cell.at[3], 0.5 * (high - low));
  }
  cell.at[3] *= 1 + rounding;
  return cell;
}

/* ---- the ball around a piece ---- */

/* A lower bound of the depth, in the hull of the spheres a = (c, radius) and b, of the points c + radius n; 0 where the
 * points may lie on its boundary. `excess` is the least of n.(cb - ca) - (ra - rb) over the unit normals n, and
 * `square` the squared distance of the centres. The sphere at t between a and b holds the point at a depth of at least
 * t excess - t^2 |cb - ca|^2 / (2 ra), by sqrt(1 + x) <= 1 + x / 2. */
static double depth_in_hull(double excess, double radius, double square) {
  if (!(excess > 0) || !(radius > 0)) return 0;
  const double t = square > 0 ? qmat_smaller(1, excess * radius / square) : 1;
  return t * excess - t * t * square / (2 * radius);
}

/* The mean normal of a piece of a sphere, and the largest distance of a corner's normal from it. */
static double sphere_spread(const qmat_boundary_piece *p, double normal[3]) {
  double spread = 0;
  for (int k = 0; k < 3; k++) normal[k] = p->at[k] + p->at[3 + k] + p->at[6 + k];
  qmat_normalize(normal);
  for (int i = 0; i < 3; i++) spread = qmat_larger(spread, qmat_point_distance(normal, &p->at[3 * i]));
  return spread;
}

static bool sphere_ball(const qmat_boundary_features *f, const qmat_boundary_piece *p, double middle[3],
                        double *reach) {
  const double *sphere = &f->spheres[4 * (size_t)p->feature];
  double normal[3];
  const double spread = sphere_spread(p, normal);
  for (int k = 0; k < 3; k++) middle[k] = sphere[k] + sphere[3] * normal[k];
  *reach = sphere[3] * spread;
  for (size_t i = f->neighbour_offsets[p->feature]; i < f->neighbour_offsets[p->feature + 1]; i++) {
    const double *other = &f->spheres[4 * (size_t)f->neighbours[i]];
    double d[3];
    qmat_subtract(other, sphere, d);
    const double square = qmat_dot(d, d), excess = qmat_dot(normal, d) - spread * sqrt(square) - (sphere[3] - other[3]);
    if (depth_in_hull(excess, sphere[3], square) > QMAT_BOUNDARY_SKIN) return false;
  }
  return true;
}

static qmat_cone_side cone_side_of(const qmat_boundary_features *f, const qmat_boundary_piece *p) {
  qmat_cone_side side;
  qmat_cone_side_of_edge(f, p->feature - f->sphere_count, &side);
  return side;
}

/* Half the extent of a piece along the cone side and around it. */
static void cone_side_extent(const qmat_cone_side *side, const qmat_boundary_piece *p, double *along, double *around) {
  double sphere[4];
  qmat_cone_side_sphere(side, 0.5 * (p->at[0] + p->at[1]), sphere);
  *along = 0.5 * side->length * (p->at[1] - p->at[0]);
  *around = 2 * sphere[3] * side->across * sin(0.25 * (p->at[3] - p->at[2]));
}

static bool cone_side_ball(const qmat_boundary_features *f, const qmat_boundary_piece *p, double middle[3],
                           double *reach) {
  const size_t edge = p->feature - f->sphere_count;
  const qmat_cone_side side = cone_side_of(f, p);
  double sphere[4], ends[2][4], normal[3], along, around;
  qmat_cone_side_sphere(&side, 0.5 * (p->at[0] + p->at[1]), sphere);
  qmat_cone_side_normal(&side, 0.5 * (p->at[2] + p->at[3]), normal);
  for (int k = 0; k < 3; k++) middle[k] = sphere[k] + sphere[3] * normal[k];
  cone_side_extent(&side, p, &along, &around);
  *reach = along + around;
  const double spread = 2 * side.across * sin(0.25 * (p->at[3] - p->at[2]));
  for (int e = 0; e < 2; e++) qmat_cone_side_sphere(&side, p->at[e], ends[e]);
  for (size_t i = f->apex_offsets[edge]; i < f->apex_offsets[edge + 1]; i++) {
    /* Along the side n.c + r and so the excess are constant. Its ends have the least radius and the largest distance.
     */
    const double *apex = &f->spheres[4 * (size_t)f->apexes[i]];
    double excess = INFINITY, radius = INFINITY, square = 0;
    for (int e = 0; e < 2; e++) {
      double d[3];
      qmat_subtract(apex, ends[e], d);
      square = qmat_larger(square, qmat_dot(d, d));
      radius = qmat_smaller(radius, ends[e][3]);
      excess = qmat_smaller(excess, qmat_dot(normal, d) - spread * sqrt(qmat_dot(d, d)) - (ends[e][3] - apex[3]));
    }
    if (depth_in_hull(excess, radius, square) > QMAT_BOUNDARY_SKIN) return false;
  }
  return true;
}

static qmat_feature_kind kind_of(const qmat_boundary_features *f, const qmat_boundary_piece *p) {
  size_t row;
  return qmat_boundary_feature_kind(f, p->feature, &row);
}

bool qmat_boundary_piece_ball(const qmat_boundary_features *f, const qmat_boundary_piece *p, double middle[3],
                              double *reach) {
  if (p->feature == QMAT_CELL) {
    memcpy(middle, p->at, 3 * sizeof *middle);
    *reach = sqrt(3) * p->at[3];
    return true;
  }
  switch (kind_of(f, p)) {
    case QMAT_FEATURE_SPHERE:
      return sphere_ball(f, p, middle, reach);
    case QMAT_FEATURE_CONE_SIDE:
      return cone_side_ball(f, p, middle, reach);
    default:
      for (int k = 0; k < 3; k++) middle[k] = (p->at[k] + p->at[3 + k] + p->at[6 + k]) / 3;
      *reach = 0;
      for (int i = 0; i < 3; i++) *reach = qmat_larger(*reach, qmat_point_distance(middle, &p->at[3 * i]));
      return true;
  }
}

/* ---- the hull of a piece ---- */

/* A unit normal n of the piece is h / |h| for a point h of the triangle of the corners, and |h| >= h.m >= the least a.m
 * over the corners a = 1 - |a - m|^2 / 2, for every unit vector m. */
static int sphere_hull(const qmat_boundary_features *f, const qmat_boundary_piece *p, double points[4][3],
                       double *bulge) {
  const double *sphere = &f->spheres[4 * (size_t)p->feature];
  double normal[3];
  const double spread = sphere_spread(p, normal);
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) points[i][k] = sphere[k] + sphere[3] * p->at[3 * i + k];
  *bulge = 0.5 * sphere[3] * spread * spread;
  return 3;
}

/* A cone side is ruled by lines between two arcs; an arc leaves its chord by its sagitta. */
static int cone_side_hull(const qmat_boundary_features *f, const qmat_boundary_piece *p, double points[4][3],
                          double *bulge) {
  const qmat_cone_side side = cone_side_of(f, p);
  double radius = 0;
  for (int i = 0; i < 4; i++) {
    double sphere[4], normal[3];
    qmat_cone_side_sphere(&side, p->at[i & 1], sphere);
    qmat_cone_side_normal(&side, p->at[2 + (i >> 1)], normal);
    for (int k = 0; k < 3; k++) points[i][k] = sphere[k] + sphere[3] * normal[k];
    radius = qmat_larger(radius, sphere[3] * side.across);
  }
  *bulge = radius * (1 - cos(0.5 * (p->at[3] - p->at[2])));
  return 4;
}

int qmat_boundary_piece_hull(const qmat_boundary_features *f, const qmat_boundary_piece *p, double points[4][3],
                             double *bulge) {
  *bulge = 0;
  if (p->feature == QMAT_CELL) return 0;
  switch (kind_of(f, p)) {
    case QMAT_FEATURE_SPHERE:
      return sphere_hull(f, p, points, bulge);
    case QMAT_FEATURE_CONE_SIDE:
      return cone_side_hull(f, p, points, bulge);
    default:
      memcpy(points, p->at, sizeof p->at);
      return 3;
  }
}

/* ---- the pieces of a piece ---- */

int qmat_boundary_piece_child_count(const qmat_boundary_features *f, const qmat_boundary_piece *p) {
  if (p->feature == QMAT_CELL) return 8;
  const qmat_feature_kind kind = kind_of(f, p);
  if (kind != QMAT_FEATURE_CONE_SIDE) return kind == QMAT_FEATURE_SPHERE ? 4 : 2;
  double along, around;
  const qmat_cone_side side = cone_side_of(f, p);
  cone_side_extent(&side, p, &along, &around);
  return along > 2 * around || around > 2 * along ? 2 : 4;
}

static void split_sphere(const qmat_boundary_piece *p, qmat_boundary_piece children[4]) {
  double middles[3][3]; /* opposite to each corner */
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++) middles[i][k] = p->at[3 * ((i + 1) % 3) + k] + p->at[3 * ((i + 2) % 3) + k];
    qmat_normalize(middles[i]);
  }
  for (int i = 0; i < 3; i++) { /* child i keeps corner i */
    memcpy(&children[i].at[3 * ((i + 1) % 3)], middles[(i + 2) % 3], sizeof middles[0]);
    memcpy(&children[i].at[3 * ((i + 2) % 3)], middles[(i + 1) % 3], sizeof middles[0]);
  }
  memcpy(children[3].at, middles, sizeof middles);
}

static void split_cone_side(const qmat_boundary_features *f, const qmat_boundary_piece *p, int count,
                            qmat_boundary_piece children[]) {
  double along, around;
  const qmat_cone_side side = cone_side_of(f, p);
  cone_side_extent(&side, p, &along, &around);
  const double t = 0.5 * (p->at[0] + p->at[1]), angle = 0.5 * (p->at[2] + p->at[3]);
  for (int i = 0; i < count; i++) {
    if (along >= around || count == 4) children[i].at[i & 1 ? 0 : 1] = t;
    if (along < around && count == 2) children[i].at[i & 1 ? 2 : 3] = angle;
    if (count == 4) children[i].at[i & 2 ? 2 : 3] = angle;
  }
}

static void split_cell(const qmat_boundary_piece *p, qmat_boundary_piece children[8]) {
  for (int i = 0; i < 8; i++) {
    children[i].at[3] = 0.5 * p->at[3];
    for (int k = 0; k < 3; k++) children[i].at[k] = p->at[k] + (i >> k & 1 ? 0.5 : -0.5) * p->at[3];
  }
}

void qmat_boundary_piece_split(const qmat_boundary_features *f, const qmat_boundary_piece *p,
                               qmat_boundary_piece children[]) {
  const int count = qmat_boundary_piece_child_count(f, p);
  for (int i = 0; i < count; i++) children[i] = *p;
  if (p->feature == QMAT_CELL) {
    split_cell(p, children);
    return;
  }
  switch (kind_of(f, p)) {
    case QMAT_FEATURE_SPHERE:
      split_sphere(p, children);
      break;
    case QMAT_FEATURE_CONE_SIDE:
      split_cone_side(f, p, count, children);
      break;
    default:
      qmat_triangle_halve(p->at, children[0].at, children[1].at);
  }
}
