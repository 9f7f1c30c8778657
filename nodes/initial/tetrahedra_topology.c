/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/initial/tetrahedra_topology.h"

#include <math.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/vector.h"
#include "nodes/initial/item_queue.h"
#include "nodes/initial/medial_vertices.h"
#include "nodes/measure/topology.h"

/* The largest distance between the surface and the incentre of a tetrahedron that is dropped, in diagonals: a sliver on
 * the surface. */
static const double most_sliver_gap = 0.005;

/* The same of one that is kept, and between the solid and the middles of its edges; epsilon where that is less. Where
 * thin walls meet, the samples of both are nearer to each other than to those on the edge between, which leaves a hole
 * in the walls. */
static const double most_hole_gap = 0.01;

/* The most samples of a pocket: samples that dropped tetrahedra connect with each other and not with the outside. A
 * larger set counts as connected with the outside, since those of slivers have a handful. */
enum { MOST_POCKET = 64 };

/* Tetrahedra change sides first only where one alone closes a loop or void, or opens one: a few that join the sides of
 * a narrow gap are dropped rather than the gap filled. Then tetrahedra are kept also where that makes way for others.
 * Dropping makes no way: all of a thin wall is near the surface, and holes in it would become slits. */
static const struct { bool keep, neutral; } passes[] = {{true, false}, {false, false}, {true, true}, {false, false}};

/* A pass repeats while a round changes more than this share of what the pass has changed. A round tries every
 * tetrahedron beside the surface, and late rounds change few. */
static const double least_change = 0.005;

enum { CELLS_A_REPORT = 1024 };

/* Betti numbers of the interior of the kept tetrahedra. Samples of the complement are connected by dropped tetrahedra.
 */
typedef struct betti {
  int64_t components, loops, voids;
} betti;

typedef struct mending {
  qmat_dual_complex *d;
  betti now, wanted;
  uint8_t *before;        /* per tetrahedron: its kind at first */
  double *gaps;           /* per tetrahedron: its gap; negative: not known yet */
  size_t *starts;         /* per sample: where its tetrahedra start in `around` */
  uint32_t *around;       /* 4 per tetrahedron */
  uint8_t *on_hull;       /* per sample */
  uint32_t *pockets;      /* per sample: sets that dropped tetrahedra connect, while tetrahedra are dropped */
  uint8_t *pocket_sizes;  /* of those that lead a set; MOST_POCKET + 1: connected with the outside */
  uint32_t *marks, stamp; /* per sample or tetrahedron: those of the newest search */
  uint32_t *found;        /* 2 per tetrahedron, or one per sample: those of the newest search */
  uint32_t *changed;      /* tetrahedra that changed sides, in order; a pass adds each once, so room for two of each */
  size_t changed_count;
  qmat_item_queue queue;
} mending;

static bool is_kept(const qmat_dual_complex *d, uint32_t cell) {
  return cell != QMAT_NO_TETRAHEDRON && d->kinds[cell] != QMAT_CELL_DROPPED;
}

/* ---- the link of a tetrahedron ---- */

/* The corners of each edge, and the other two. */
static const uint8_t edges[6][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 0, 2}, {2, 3, 0, 1}};

/* Whether all other tetrahedra around an edge of `cell` are kept; `*first`, unless NULL, whether none of them has a
 * smaller number. */
static bool others_are_kept(const qmat_dual_complex *d, uint32_t cell, const uint8_t *edge, bool *first) {
  const uint32_t *corners = &d->cells.corners[4 * (size_t)cell];
  uint32_t leaving = corners[edge[2]], at = cell;
  while ((at = qmat_dual_step_around(d, at, corners[edge[0]], corners[edge[1]], &leaving)) != cell) {
    if (!is_kept(d, at)) return false;
    if (first && at < cell) return *first = false;
  }
  return true;
}

/* A kept tetrahedron is a dual vertex. Its link is a graph: a node for each kept neighbour, and an arc between two
 * where all tetrahedra around their common edge are kept. */
typedef struct cell_link {
  int parts, loops;
  uint32_t ends[2]; /* kept neighbours of the first and the last part */
} cell_link;

/* The link that `cell` has, or would have if it were kept. */
static cell_link link_of(const qmat_dual_complex *d, uint32_t cell) {
  const uint32_t *neighbours = &d->cells.neighbours[4 * (size_t)cell];
  int part[4], nodes = 0, arcs = 0, joins = 0;
  for (int k = 0; k < 4; k++) {
    part[k] = k;
    nodes += is_kept(d, neighbours[k]);
  }
  for (int e = 0; e < 6; e++) {
    const int a = edges[e][2], b = edges[e][3];
    if (!is_kept(d, neighbours[a]) || !is_kept(d, neighbours[b]) || !others_are_kept(d, cell, edges[e], NULL)) continue;
    arcs++;
    const int from = part[b], to = part[a];
    joins += from != to;
    for (int k = 0; k < 4; k++)
      if (part[k] == from) part[k] = to;
  }
  cell_link link = {.parts = nodes - joins, .loops = arcs - joins};
  int first = 0;
  while (first < 3 && !is_kept(d, neighbours[first])) first++;
  link.ends[0] = link.ends[1] = neighbours[first];
  for (int k = first; k < 4; k++)
    if (is_kept(d, neighbours[k]) && part[k] != part[first]) link.ends[1] = neighbours[k];
  return link;
}

/* Whether keeping or dropping the tetrahedron leaves the homotopy type as it is. */
static bool is_tree(cell_link link) {
  return link.parts == 1 && link.loops == 0;
}

/* ---- Betti numbers ---- */

/* Counts vertices, less edges, plus polygons of the dual. */
static int64_t euler_of_dual(const qmat_dual_complex *d) {
  const int threads = qmat_threads(d->context);
  int64_t euler = 0;
#pragma omp parallel for num_threads(threads) schedule(static) reduction(+ : euler)
  for (size_t i = 0; i < d->cells.count; i++) {
    if (!d->kinds[i]) continue;
    euler++;
    for (size_t k = 0; k < 4; k++) {
      const uint32_t j = d->cells.neighbours[4 * i + k];
      euler -= j > i && is_kept(d, j);
    }
    for (int e = 0; e < 6; e++) {
      bool first = true;
      euler += others_are_kept(d, (uint32_t)i, edges[e], &first);
    }
  }
  return euler;
}

static qmat_status count_betti(const qmat_dual_complex *d, betti *b) {
  qmat_context *context = d->context;
  const size_t count = d->cells.count, outside = d->point_count;
  uint32_t *cells = qmat_sets_new(context, count), *samples = qmat_sets_new(context, outside + 1);
  uint8_t *used = qmat_arena_calloc(&context->arena, outside, sizeof *used);
  if (!cells || !samples || !used) return qmat_fail_memory(context, "the tetrahedra");
  *b = (betti){0, 0, 0};
  for (size_t i = 0; i < count; i++) {
    const uint32_t *corners = &d->cells.corners[4 * i];
    b->components += d->kinds[i] != QMAT_CELL_DROPPED;
    for (size_t k = 0; k < 4; k++) {
      const uint32_t j = d->cells.neighbours[4 * i + k];
      b->voids += !used[corners[k]];
      used[corners[k]] = 1;
      if (d->kinds[i])
        b->components -= is_kept(d, j) && qmat_sets_join(cells, (uint32_t)i, j);
      else
        b->voids -= qmat_sets_join(samples, corners[0], corners[k]);
      for (size_t c = 0; c < 4 && j == QMAT_NO_TETRAHEDRON; c++)
        if (c != k) b->voids -= qmat_sets_join(samples, (uint32_t)outside, corners[c]);
    }
  }
  b->loops = b->components + b->voids - euler_of_dual(d);
  return QMAT_OK;
}

static int64_t distance_between(betti a, betti b) {
  const int64_t loops = a.loops - b.loops, voids = a.voids - b.voids;
  return (loops < 0 ? -loops : loops) + (voids < 0 ? -voids : voids);
}

/* ---- searches ---- */

/* Whether dropped tetrahedra connect a sample with the outside, or with `most` samples. */
static bool reaches_outside(mending *m, uint32_t sample, size_t most) {
  uint32_t *found = m->found;
  size_t count = 0;
  found[count++] = sample;
  m->marks[sample] = ++m->stamp;
  if (m->on_hull[sample]) return true;
  for (size_t i = 0; i < count; i++)
    for (size_t c = m->starts[found[i]]; c < m->starts[found[i] + 1]; c++) {
      const uint32_t cell = m->around[c];
      for (size_t k = 0; k < 4 && !m->d->kinds[cell]; k++) {
        const uint32_t corner = m->d->cells.corners[4 * (size_t)cell + k];
        if (m->marks[corner] == m->stamp) continue;
        if (count == most || m->on_hull[corner]) return true;
        m->marks[corner] = m->stamp;
        found[count++] = corner;
      }
    }
  return false;
}

/* Whether other dropped tetrahedra connect all corners of a dropped one with the outside, or with `most` samples. */
static bool all_reach_outside(mending *m, uint32_t cell, size_t most) {
  const uint8_t kind = m->d->kinds[cell];
  bool reach = true;
  m->d->kinds[cell] = QMAT_CELL_INCENTRE;
  for (size_t k = 0; k < 4 && reach; k++) reach = reaches_outside(m, m->d->cells.corners[4 * (size_t)cell + k], most);
  m->d->kinds[cell] = kind;
  return reach;
}

/* Joins the pockets of a dropped tetrahedron's corners. */
static void join_pockets(mending *m, uint32_t cell) {
  const uint32_t *corners = &m->d->cells.corners[4 * (size_t)cell];
  for (size_t k = 1; k < 4; k++) {
    const uint32_t a = qmat_set_leader(m->pockets, corners[0]), b = qmat_set_leader(m->pockets, corners[k]);
    const int size = m->pocket_sizes[a] + m->pocket_sizes[b];
    if (qmat_sets_join(m->pockets, a, b))
      m->pocket_sizes[a < b ? a : b] = (uint8_t)(size > MOST_POCKET ? MOST_POCKET + 1 : size);
  }
}

static void find_pockets(mending *m) {
  for (uint32_t i = 0; i < m->d->point_count; i++) {
    m->pockets[i] = i;
    m->pocket_sizes[i] = m->on_hull[i] ? MOST_POCKET + 1 : 1;
  }
  for (size_t i = 0; i < m->d->cells.count; i++)
    if (!m->d->kinds[i]) join_pockets(m, (uint32_t)i);
}

/* Whether a kept tetrahedron lies between pockets and the outside. */
static bool is_beside_pocket_and_outside(mending *m, uint32_t cell) {
  int outside = 0;
  for (size_t k = 0; k < 4; k++)
    outside += m->pocket_sizes[qmat_set_leader(m->pockets, m->d->cells.corners[4 * (size_t)cell + k])] > MOST_POCKET;
  return outside > 0 && outside < 4;
}

/* Whether the two parts of the link of a kept tetrahedron are connected without it. Searches from both at the same
 * time, so that the smaller side decides. */
static bool is_bridged(mending *m, uint32_t cell, cell_link link) {
  const qmat_dual_complex *d = m->d;
  const uint32_t stamps[2] = {m->stamp + 1, m->stamp + 2};
  size_t counts[2] = {0, 0};
  uint32_t *found[2] = {m->found, m->found + d->cells.count};
  m->stamp += 2;
  for (int side = 0; side < 2; side++) {
    m->marks[link.ends[side]] = stamps[side];
    found[side][counts[side]++] = link.ends[side];
  }
  for (size_t i = 0; i < counts[0] && i < counts[1]; i++)
    for (int side = 0; side < 2; side++)
      for (size_t k = 0; k < 4; k++) {
        const uint32_t j = d->cells.neighbours[4 * (size_t)found[side][i] + k];
        if (!is_kept(d, j) || j == cell || m->marks[j] == stamps[side]) continue;
        if (m->marks[j] == stamps[1 - side]) return true;
        m->marks[j] = stamps[side];
        found[side][counts[side]++] = j;
      }
  return false;
}

/* ---- changes ---- */

/* Whether keeping a tetrahedron closes loops and no void. */
static bool closes_loops(mending *m, uint32_t cell, cell_link link) {
  return link.parts == 1 && link.loops > 0 && m->now.loops - link.loops >= m->wanted.loops &&
         all_reach_outside(m, cell, MOST_POCKET);
}

/* Whether keeping a tetrahedron closes the last hole around a void that the solid has. */
static bool closes_void(mending *m, uint32_t cell, cell_link link) {
  return link.parts == 1 && link.loops == 1 && m->now.loops == m->wanted.loops && m->now.voids < m->wanted.voids &&
         !all_reach_outside(m, cell, m->d->point_count);
}

/* Whether dropping a tetrahedron opens a void or a loop, and does nothing else. */
static bool opens(mending *m, uint32_t cell, cell_link link) {
  if (link.parts == 1 && link.loops == 1 && m->now.voids > m->wanted.voids)
    return is_beside_pocket_and_outside(m, cell);
  return link.parts == 2 && link.loops == 0 && m->now.loops > m->wanted.loops && is_bridged(m, cell, link);
}

static double most_gap(const mending *m, bool keep) {
  return keep ? fmin(m->d->epsilon, most_hole_gap) : most_sliver_gap;
}

/* The distance of a tetrahedron's incentre from the surface. A needle between distant parts of the surface leaves the
 * solid far while its incentre does not, so the middles of the edges count too, where the tetrahedron is outside. */
static double gap_of(const mending *m, uint32_t cell) {
  const qmat_dual_complex *d = m->d;
  const uint32_t *corners = &d->cells.corners[4 * (size_t)cell];
  double centre[3];
  qmat_medial_vertex_incentre(d, cell, centre);
  const double most = fmax(most_gap(m, true), most_sliver_gap);
  double gap = qmat_surface_distance(d->surface, centre, most, NULL, NULL);
  for (int e = 0; e < 6 && gap <= most && !m->before[cell]; e++)
    gap = fmax(gap, qmat_dual_edge_outside(d, corners[edges[e][0]], corners[edges[e][1]], gap, most));
  return gap;
}

/* Queues the tetrahedra of one side that have a neighbour on the other. */
static qmat_status queue_side(mending *m, bool kept) {
  const qmat_dual_complex *d = m->d;
  const int threads = qmat_threads(d->context);
#pragma omp parallel for num_threads(threads) schedule(dynamic, 512)
  for (size_t i = 0; i < d->cells.count; i++) {
    bool borders = false;
    for (size_t k = 0; k < 4; k++) borders |= is_kept(d, d->cells.neighbours[4 * i + k]) != kept;
    if (borders && is_kept(d, (uint32_t)i) == kept && m->gaps[i] < 0) m->gaps[i] = gap_of(m, (uint32_t)i);
  }
  for (size_t i = 0; i < d->cells.count; i++)
    if (is_kept(d, (uint32_t)i) == kept && m->gaps[i] >= 0 && m->gaps[i] <= most_gap(m, !kept) &&
        qmat_queue_push(&m->queue, m->gaps[i], i))
      return qmat_fail_memory(d->context, "the tetrahedra");
  return QMAT_OK;
}

static bool is_mended(const mending *m) {
  return distance_between(m->now, m->wanted) == 0;
}

/* Changes the side of a tetrahedron if that helps or, with `neutral`, leaves the homotopy type as it is. */
static bool change(mending *m, uint32_t cell, bool keep, bool neutral) {
  const cell_link link = link_of(m->d, cell);
  const bool no_change = neutral && is_tree(link), makes_void = !no_change && keep && closes_void(m, cell, link);
  if (!no_change && !makes_void && !(keep ? closes_loops(m, cell, link) : opens(m, cell, link))) return false;
  if (makes_void)
    m->now.voids++;
  else if (keep)
    m->now.loops -= link.loops;
  else if (link.parts == 2)
    m->now.loops--;
  else
    m->now.voids -= link.loops;
  m->d->kinds[cell] = keep ? QMAT_CELL_INCENTRE : QMAT_CELL_DROPPED;
  if (!keep) join_pockets(m, cell);
  m->changed[m->changed_count++] = cell;
  return true;
}

static bool is_changed(const mending *m, uint32_t cell) {
  return is_kept(m->d, cell) != (m->before[cell] != QMAT_CELL_DROPPED);
}

/* Reverts the changes that leave the homotopy type as it is, the newest first. What is as before leaves the list. */
static void revert_neutral(mending *m) {
  qmat_dual_complex *d = m->d;
  size_t reverted;
  do {
    reverted = 0;
    for (size_t i = m->changed_count; i-- > 0;) {
      const uint32_t cell = m->changed[i];
      if (!is_changed(m, cell) || !is_tree(link_of(d, cell))) continue;
      d->kinds[cell] = m->before[cell];
      reverted++;
    }
  } while (reverted > 0);
  size_t left = 0;
  for (size_t i = 0; i < m->changed_count; i++)
    if (is_changed(m, m->changed[i])) m->changed[left++] = m->changed[i];
  m->changed_count = left;
}

/* Keeps (or drops) tetrahedra, the nearest to the surface first, until the Betti numbers are right or little changes.
 * With `neutral`, changes that leave the homotopy type as it is make way for others, and are reverted at the end. */
static qmat_status change_side(mending *m, bool keep, bool neutral) {
  const qmat_dual_complex *d = m->d;
  const size_t start = m->changed_count;
  size_t before, tried = 0;
  qmat_status status = QMAT_OK;
  if (!keep) find_pockets(m);
  do { /* a ring can be completed from afar */
    before = m->changed_count;
    status = queue_side(m, !keep);
    while (status == QMAT_OK && m->queue.count > 0 && !is_mended(m)) {
      if (++tried % CELLS_A_REPORT == 0) status = qmat_progress(d->context, 0, 0, "tetrahedra");
      const uint32_t cell = (uint32_t)qmat_queue_pop(&m->queue).item;
      if (is_kept(d, cell) == keep || !change(m, cell, keep, neutral)) continue;
      for (size_t k = 0; k < 4 && status == QMAT_OK; k++) {
        const uint32_t j = d->cells.neighbours[4 * (size_t)cell + k];
        if (j == QMAT_NO_TETRAHEDRON || is_kept(d, j) == keep) continue;
        if (m->gaps[j] < 0) m->gaps[j] = gap_of(m, j);
        if (m->gaps[j] <= most_gap(m, keep) && qmat_queue_push(&m->queue, m->gaps[j], j))
          status = qmat_fail_memory(d->context, "the tetrahedra");
      }
    }
    m->queue.count = 0;
  } while (status == QMAT_OK && !is_mended(m) &&
           (double)(m->changed_count - before) > least_change * (double)(m->changed_count - start));
  revert_neutral(m);
  return status;
}

/* ---- the result ---- */

/* Copies to `sphere` that of the nearest neighbour that has one; false where none has. */
static bool take_from_neighbour(const mending *m, uint32_t cell, double sphere[4]) {
  const qmat_dual_complex *d = m->d;
  double centre[3], nearest = INFINITY;
  qmat_medial_vertex_incentre(d, cell, centre);
  for (size_t k = 0; k < 4; k++) {
    const uint32_t j = d->cells.neighbours[4 * (size_t)cell + k];
    if (!is_kept(d, j) || !m->before[j]) continue;
    const double distance = qmat_point_distance(&d->spheres[4 * (size_t)j], centre);
    if (!(distance < nearest)) continue;
    nearest = distance;
    memcpy(sphere, &d->spheres[4 * (size_t)j], 4 * sizeof *sphere);
  }
  return nearest < INFINITY;
}

/* The largest sphere around the incentre inside the solid; of radius zero where the incentre is outside. */
static void take_incentre(const qmat_dual_complex *d, uint32_t cell, double sphere[4]) {
  qmat_medial_vertex_incentre(d, cell, sphere);
  sphere[3] = fmax(-qmat_surface_signed_distance(d->surface, sphere), 0);
}

/* One pass over the tetrahedra that are kept now and have no sphere; returns how many got one. */
static size_t give_spheres(mending *m, bool from_neighbours) {
  const qmat_dual_complex *d = m->d;
  size_t given = 0;
  for (size_t i = 0; i < m->changed_count; i++) {
    const uint32_t cell = m->changed[i];
    if (m->before[cell] || !d->kinds[cell]) continue;
    double *sphere = &d->spheres[4 * (size_t)cell];
    if (from_neighbours && !take_from_neighbour(m, cell, sphere)) continue;
    if (!from_neighbours) take_incentre(d, cell, sphere);
    m->before[cell] = QMAT_CELL_INCENTRE; /* it has a sphere now */
    given++;
  }
  return given;
}

/* Gives tetrahedra that are kept now the sphere of a neighbour, or their own where no neighbour has one. */
static void set_spheres(mending *m, qmat_mended_tetrahedra *mended) {
  size_t given;
  do {
    given = give_spheres(m, true);
    mended->kept += given;
  } while (given > 0);
  mended->kept += give_spheres(m, false);
  for (size_t i = 0; i < m->d->cells.count; i++) mended->dropped += m->before[i] && !m->d->kinds[i];
}

static qmat_status start(mending *m) {
  const qmat_dual_complex *d = m->d;
  qmat_arena *arena = &d->context->arena;
  const size_t count = d->cells.count, samples = d->point_count;
  m->before = qmat_arena_alloc(arena, count, sizeof *m->before);
  m->gaps = qmat_arena_alloc(arena, count, sizeof *m->gaps);
  m->starts = qmat_arena_calloc(arena, samples + 2, sizeof *m->starts);
  m->around = qmat_arena_alloc(arena, 4 * count, sizeof *m->around);
  m->on_hull = qmat_arena_calloc(arena, samples, sizeof *m->on_hull);
  m->pockets = qmat_arena_alloc(arena, samples, sizeof *m->pockets);
  m->pocket_sizes = qmat_arena_alloc(arena, samples, sizeof *m->pocket_sizes);
  m->marks = qmat_arena_calloc(arena, count > samples ? count : samples, sizeof *m->marks);
  m->found = qmat_arena_alloc(arena, 2 * count > samples ? 2 * count : samples, sizeof *m->found);
  m->changed = qmat_arena_alloc(arena, 2 * count, sizeof *m->changed);
  if (!m->before || !m->gaps || !m->starts || !m->around || !m->on_hull || !m->pockets || !m->pocket_sizes ||
      !m->marks || !m->found || !m->changed)
    return qmat_fail_memory(d->context, "the tetrahedra");
  memcpy(m->before, d->kinds, count);
  for (size_t i = 0; i < count; i++) m->gaps[i] = -1;
  for (size_t i = 0; i < 4 * count; i++) m->starts[d->cells.corners[i] + 2]++;
  for (size_t i = 0; i < samples; i++) m->starts[i + 2] += m->starts[i + 1];
  for (size_t i = 0; i < 4 * count; i++) {
    m->around[m->starts[d->cells.corners[i] + 1]++] = (uint32_t)(i / 4);
    for (size_t c = 0; c < 4 && d->cells.neighbours[i] == QMAT_NO_TETRAHEDRON; c++)
      if (c != i % 4) m->on_hull[d->cells.corners[4 * (i / 4) + c]] = 1;
  }
  return QMAT_OK;
}

qmat_status qmat_tetrahedra_mend(qmat_dual_complex *d, qmat_mended_tetrahedra *mended) {
  mending m = {.d = d};
  betti first;
  qmat_topology solid;
  *mended = (qmat_mended_tetrahedra){0, 0};
  qmat_status status = qmat_topology_of_solid(d->context, d->surface, &solid);
  if (status != QMAT_OK || !solid.known) return status;
  m.wanted = (betti){(int64_t)solid.components, (int64_t)solid.loops, (int64_t)solid.voids};
  if ((status = count_betti(d, &first)) != QMAT_OK) return status;
  m.now = first;
  if (is_mended(&m)) return QMAT_OK;
  status = start(&m);
  for (size_t i = 0; i < sizeof passes / sizeof *passes && status == QMAT_OK && !is_mended(&m); i++) {
    status = change_side(&m, passes[i].keep, passes[i].neutral);
    if (status == QMAT_OK) status = count_betti(d, &m.now); /* a large pocket may have been taken for the outside */
  }
  qmat_free(m.queue.items);
  if (status != QMAT_OK) return status;
  if (m.now.components == first.components && distance_between(m.now, m.wanted) < distance_between(first, m.wanted))
    set_spheres(&m, mended);
  else
    memcpy(d->kinds, m.before, d->cells.count);
  return QMAT_OK;
}
