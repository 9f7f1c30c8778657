/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The components of the initial medial mesh: specks are dropped, the others linked. */
#include "nodes/initial/dual_components.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/disjoint_sets.h"
#include "core/geometry/medial_build.h"
#include "core/geometry/vector.h"
#include "nodes/measure/envelope_to_surface.h"

#define NONE QMAT_NO_ID

typedef struct {
  uint32_t root, size;
} component;

static int larger_component(const void *left, const void *right) {
  const component *a = left, *b = right;
  if (a->size != b->size) return a->size < b->size ? 1 : -1;
  return a->root < b->root ? -1 : 1;
}

/* The components, largest first; `index` gets the component of each sphere. NULL when memory is short. */
static component *find_components(qmat_dual_complex *d, uint32_t *index, size_t *count) {
  qmat_arena *arena = &d->context->arena;
  uint32_t *parent = qmat_sets_new(d->context, d->sphere_count);
  component *components = qmat_arena_calloc(arena, d->sphere_count, sizeof *components);
  uint32_t *order = qmat_arena_alloc(arena, d->sphere_count, sizeof *order);
  if (!parent || !components || !order) return NULL;
  for (size_t e = 0; e < d->edge_count; e++) qmat_sets_join(parent, d->edges[2 * e], d->edges[2 * e + 1]);
  *count = 0;
  for (size_t i = 0; i < d->sphere_count; i++) {
    const uint32_t root = qmat_set_leader(parent, (uint32_t)i);
    if (root == i) {
      index[i] = (uint32_t)*count;
      components[(*count)++].root = root;
    }
    components[index[root]].size++;
  }
  qsort(components, *count, sizeof *components, larger_component);
  for (size_t i = 0; i < *count; i++) order[components[i].root] = (uint32_t)i;
  for (size_t i = 0; i < d->sphere_count; i++) index[i] = order[qmat_set_leader(parent, (uint32_t)i)];
  return components;
}

/* --- specks ------------------------------------------------------------------------------------------------------ */

/* Marks the components that are responsible for a sample which no larger component is responsible for. */
static qmat_status mark_needed(qmat_dual_complex *d, const uint32_t *index, size_t count, uint8_t *needed) {
  qmat_arena *arena = &d->context->arena;
  size_t *starts = qmat_arena_calloc(arena, count + 2, sizeof *starts);
  uint32_t *members = qmat_arena_alloc(arena, d->cells.count, sizeof *members);
  uint8_t *covered = qmat_arena_calloc(arena, d->point_count, sizeof *covered);
  if (!starts || !members || !covered) return qmat_fail_memory(d->context, "components");
  for (size_t cell = 0; cell < d->cells.count; cell++)
    if (d->kinds[cell]) starts[index[d->sphere_of[cell]] + 2]++;
  for (size_t i = 0; i < count; i++) starts[i + 2] += starts[i + 1];
  for (size_t cell = 0; cell < d->cells.count; cell++)
    if (d->kinds[cell]) members[starts[index[d->sphere_of[cell]] + 1]++] = (uint32_t)cell;
  for (size_t i = 0; i < count; i++) {
    const size_t first = 4 * starts[i], last = 4 * starts[i + 1];
    needed[i] = 0;
    for (size_t m = first; m < last && !needed[i]; m++)
      needed[i] = !covered[d->cells.corners[4 * (size_t)members[m / 4] + m % 4]];
    for (size_t m = first; m < last && needed[i]; m++)
      covered[d->cells.corners[4 * (size_t)members[m / 4] + m % 4]] = 1;
  }
  return QMAT_OK;
}

static qmat_status drop_specks(qmat_dual_complex *d, qmat_dual_component_counts *counts) {
  qmat_arena *arena = &d->context->arena;
  uint32_t *index = qmat_arena_alloc(arena, d->sphere_count, sizeof *index);
  uint32_t *renumbered = qmat_arena_alloc(arena, d->sphere_count, sizeof *renumbered);
  size_t count = 0;
  component *components = index ? find_components(d, index, &count) : NULL;
  uint8_t *needed = qmat_arena_alloc(arena, count, sizeof *needed);
  if (!renumbered || !components || !needed) return qmat_fail_memory(d->context, "components");
  const qmat_status status = mark_needed(d, index, count, needed);
  if (status != QMAT_OK) return status;
  for (size_t i = 0; i < count; i++) {
    counts->components += needed[i];
    counts->specks += !needed[i];
    counts->speck_spheres += needed[i] ? 0 : components[i].size;
  }
  uint32_t next = 0;
  for (size_t i = 0; i < d->sphere_count; i++) renumbered[i] = needed[index[i]] ? next++ : NONE;
  for (size_t cell = 0; cell < d->cells.count; cell++) {
    if (!d->kinds[cell]) continue;
    d->sphere_of[cell] = renumbered[d->sphere_of[cell]];
    if (d->sphere_of[cell] == NONE) d->kinds[cell] = QMAT_CELL_DROPPED;
  }
  d->edge_count = qmat_medial_renumber(d->edges, d->edge_count, 2, renumbered, d->edges);
  d->triangle_count = qmat_medial_renumber(d->triangles, d->triangle_count, 3, renumbered, d->triangles);
  d->sphere_count = next;
  return QMAT_OK;
}

/* --- links ------------------------------------------------------------------------------------------------------- */

/* A medial edge that would link two components. */
typedef struct {
  double outside; /* how far its cone leaves the solid, at the test points */
  double length;
  uint32_t a, b;
} medial_link;

static int better_link(const void *left, const void *right) {
  const medial_link *p = left, *q = right;
  if (p->outside != q->outside) return p->outside < q->outside ? -1 : 1;
  if (p->length != q->length) return p->length < q->length ? -1 : 1;
  if (p->a != q->a) return p->a < q->a ? -1 : 1;
  return p->b < q->b ? -1 : p->b > q->b;
}

static medial_link link_of(const double *spheres, uint32_t a, uint32_t b) {
  const double length = qmat_point_distance(&spheres[4 * (size_t)a], &spheres[4 * (size_t)b]);
  return (medial_link){0, length, a < b ? a : b, a < b ? b : a};
}

enum { LINK_TEST_POINTS = 7, SPHERES_A_REPORT = 64, LINKS_A_REPORT = 64 };

/* `spheres` holds 4 doubles per medial vertex. */
static medial_link measured_link(const qmat_dual_complex *d, const double *spheres, uint32_t a, uint32_t b) {
  const double *p = &spheres[4 * (size_t)a], *q = &spheres[4 * (size_t)b];
  medial_link link = link_of(spheres, a, b);
  for (int i = 1; i <= LINK_TEST_POINTS; i++) {
    const double t = (double)i / (LINK_TEST_POINTS + 1);
    double s[4];
    for (int k = 0; k < 4; k++) s[k] = (1 - t) * p[k] + t * q[k];
    link.outside = fmax(link.outside, s[3] + qmat_surface_signed_distance(d->surface, s));
  }
  return link;
}

/* A sphere at a site: a sample, or a solid. */
typedef struct {
  uint32_t site, component, sphere;
} contact;

static int by_site(const void *left, const void *right) {
  const contact *p = left, *q = right;
  if (p->site != q->site) return p->site < q->site ? -1 : 1;
  if (p->component != q->component) return p->component < q->component ? -1 : 1;
  return p->sphere < q->sphere ? -1 : p->sphere > q->sphere;
}

/* Sorted contacts without duplicates: of all spheres with the solids in which they lie (`homes`, per component), or,
 * where that is NULL, with the samples that several components are responsible for. */
static contact *find_contacts(qmat_dual_complex *d, const uint32_t *index, const uint32_t *homes, size_t *count) {
  qmat_arena *arena = &d->context->arena;
  const size_t points = d->point_count;
  uint32_t *component_of = qmat_arena_alloc(arena, points, sizeof *component_of);
  uint8_t *shared = qmat_arena_calloc(arena, points, sizeof *shared);
  if (!component_of || !shared) return NULL;
  for (size_t i = 0; i < points; i++) component_of[i] = NONE;
  for (size_t i = 0; i < 4 * d->cells.count; i++) {
    if (!d->kinds[i / 4]) continue;
    const uint32_t sample = d->cells.corners[i], component = index[d->sphere_of[i / 4]];
    if (component_of[sample] != NONE && component_of[sample] != component) shared[sample] = 1;
    component_of[sample] = component;
  }
  size_t room = 0;
  for (size_t i = 0; i < 4 * d->cells.count; i++) room += d->kinds[i / 4] && (homes || shared[d->cells.corners[i]]);
  contact *contacts = qmat_arena_alloc(arena, room, sizeof *contacts);
  if (!contacts) return NULL;
  *count = 0;
  for (size_t i = 0; i < 4 * d->cells.count; i++) {
    const uint32_t sample = d->cells.corners[i];
    if (!d->kinds[i / 4] || !(homes || shared[sample])) continue;
    const uint32_t sphere = d->sphere_of[i / 4], component = index[sphere];
    contacts[(*count)++] = (contact){homes ? homes[component] : sample, component, sphere};
  }
  qsort(contacts, *count, sizeof *contacts, by_site);
  size_t kept = 0;
  for (size_t i = 0; i < *count; i++)
    if (kept == 0 || by_site(&contacts[kept - 1], &contacts[i]) != 0) contacts[kept++] = contacts[i];
  *count = kept;
  return contacts;
}

/* Per component of the medial mesh, the solid in which it lies. A tetrahedron that mending the topology kept has none
 * of its own. NULL when memory is short. */
static const uint32_t *find_homes(qmat_dual_complex *d, const uint32_t *index, size_t count) {
  uint32_t *homes = qmat_arena_calloc(&d->context->arena, count, sizeof *homes);
  if (!homes) return NULL;
  for (size_t i = 0; i < d->cells.count && d->solid_of; i++)
    if (d->kinds[i] && d->solid_of[i] != QMAT_NO_ID) homes[index[d->sphere_of[i]]] = d->solid_of[i];
  return homes;
}

/* Whether the link leaves the solid by at most the limit. */
static bool is_near_solid(const qmat_dual_complex *d, const double *spheres, const medial_link *link) {
  static const double tolerance_share = 0.01;
  const double *const ends[] = {&spheres[4 * (size_t)link->a], &spheres[4 * (size_t)link->b]};
  if (d->link_limit == INFINITY) return true;
  if (link->outside > d->link_limit) return false;
  return qmat_envelope_to_surface_bound(d->surface, ends, 2, d->link_limit, tolerance_share * d->link_limit) <=
         d->link_limit;
}

/* Links two components that are not linked yet, where the link stays near the solid. `joined` are the linked ones. */
static qmat_status add_link(qmat_dual_complex *d, const double *spheres, const uint32_t *index, const medial_link *link,
                            uint32_t *joined, size_t *links) {
  const uint32_t a = index[link->a], b = index[link->b];
  if (qmat_set_leader(joined, a) == qmat_set_leader(joined, b) || !is_near_solid(d, spheres, link)) return QMAT_OK;
  if (qmat_grow((void **)&d->edges, &d->edge_capacity, 2 * (d->edge_count + 1), sizeof *d->edges))
    return qmat_fail_memory(d->context, "medial edges");
  d->edges[2 * d->edge_count] = link->a;
  d->edges[2 * d->edge_count + 1] = link->b;
  d->edge_count++;
  ++*links;
  qmat_sets_join(joined, a, b);
  return QMAT_OK;
}

/* The contacts of one component at one site are contacts[first .. end). */
typedef struct {
  size_t first, end;
} contact_row;

static contact_row row_from(const contact *contacts, size_t count, size_t first) {
  contact_row row = {first, first};
  while (row.end < count && contacts[row.end].site == contacts[first].site &&
         contacts[row.end].component == contacts[first].component)
    row.end++;
  return row;
}

/* Links that may be made; freed by the caller. */
typedef struct {
  medial_link *links;
  size_t count, capacity;
  size_t measured; /* including those that are not kept */
} link_list;

/* Adds the best link between two components at a site. */
static qmat_status add_best_link(qmat_dual_complex *d, const double *spheres, const contact *contacts, contact_row from,
                                 contact_row to, link_list *list) {
  medial_link best = {INFINITY, INFINITY, NONE, NONE};
  for (size_t i = from.first; i < from.end; i++)
    for (size_t j = to.first; j < to.end; j++) {
      const qmat_status status =
          list->measured++ % LINKS_A_REPORT == 0 ? qmat_progress(d->context, 0, 0, "components") : QMAT_OK;
      if (status != QMAT_OK) return status;
      const medial_link link = measured_link(d, spheres, contacts[i].sphere, contacts[j].sphere);
      if (better_link(&link, &best) < 0) best = link;
    }
  if (qmat_grow((void **)&list->links, &list->capacity, list->count + 1, sizeof *list->links))
    return qmat_fail_memory(d->context, "components");
  list->links[list->count++] = best;
  return QMAT_OK;
}

/* Links components of one solid by edges between spheres that are responsible for a common sample, so that they touch
 * the surface at the same place. The edges that stay inside come first. */
static qmat_status link_at_samples(qmat_dual_complex *d, const uint32_t *index, const uint32_t *homes, uint32_t *joined,
                                   const double *spheres, size_t *links) {
  size_t count = 0;
  const contact *contacts = find_contacts(d, index, NULL, &count);
  link_list list = {0};
  qmat_status status = contacts ? QMAT_OK : qmat_fail_memory(d->context, "components");
  for (contact_row from = {0, 0}; from.end < count && status == QMAT_OK;) {
    from = row_from(contacts, count, from.end);
    const contact *first = &contacts[from.first];
    for (contact_row to = from; to.end < count && contacts[to.end].site == first->site && status == QMAT_OK;) {
      to = row_from(contacts, count, to.end);
      if (homes[contacts[to.first].component] == homes[first->component])
        status = add_best_link(d, spheres, contacts, from, to, &list);
    }
  }
  if (list.count) qsort(list.links, list.count, sizeof *list.links, better_link);
  for (size_t i = 0; i < list.count && status == QMAT_OK; i++)
    status = add_link(d, spheres, index, &list.links[i], joined, links);
  qmat_free(list.links);
  return status;
}

/* A sphere in one solid, and the shortest link from it to the spheres that are reached. */
typedef struct {
  double along; /* its centre, along one axis */
  medial_link best;
  uint32_t sphere, set; /* components that are linked already are one set */
  bool reached;
} reachable_sphere;

static int by_place(const void *left, const void *right) {
  const reachable_sphere *p = left, *q = right;
  if (p->along != q->along) return p->along < q->along ? -1 : 1;
  return p->sphere < q->sphere ? -1 : p->sphere > q->sphere;
}

/* Sorts spheres along the axis on which they extend farthest. */
static void sort_along(reachable_sphere *reachable, size_t count, const double *spheres) {
  double widest = -1;
  size_t axis = 0;
  for (size_t k = 0; k < 3; k++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      low = fmin(low, spheres[4 * (size_t)reachable[i].sphere + k]);
      high = fmax(high, spheres[4 * (size_t)reachable[i].sphere + k]);
    }
    if (!(high - low > widest)) continue;
    widest = high - low;
    axis = k;
  }
  for (size_t i = 0; i < count; i++) reachable[i].along = spheres[4 * (size_t)reachable[i].sphere + axis];
  qsort(reachable, count, sizeof *reachable, by_place);
}

/* Improves the link of a sphere by those to `members`, which are sorted: `next` is the first that lies not before it.
 * Nearer members come first, and none beyond the best link can be better. */
static void improve_link(const double *spheres, const reachable_sphere *reachable, const uint32_t *members,
                         size_t member_count, size_t next, reachable_sphere *sphere) {
  size_t previous = next; /* one more than the next member before it */
  while (previous > 0 || next < member_count) {
    const double before = previous > 0 ? sphere->along - reachable[members[previous - 1]].along : INFINITY;
    const double behind = next < member_count ? reachable[members[next]].along - sphere->along : INFINITY;
    if (fmin(before, behind) > sphere->best.length) return;
    const uint32_t member = before < behind ? members[--previous] : members[next++];
    const medial_link link = link_of(spheres, reachable[member].sphere, sphere->sphere);
    if (better_link(&link, &sphere->best) < 0) sphere->best = link;
  }
}

/* Reaches the spheres of a set. They may be nearer to the others than those reached before. `members` has room for the
 * numbers of all spheres. */
static qmat_status reach_set(qmat_dual_complex *d, const double *spheres, uint32_t set, reachable_sphere *reachable,
                             size_t count, uint32_t *members) {
  size_t member_count = 0;
  for (size_t i = 0; i < count; i++) {
    if (reachable[i].set != set) continue;
    reachable[i].reached = true;
    members[member_count++] = (uint32_t)i;
  }
  for (size_t i = 0, next = 0; i < count; i++) {
    if (i % SPHERES_A_REPORT == 0) {
      const qmat_status status = qmat_progress(d->context, 0, 0, "components");
      if (status != QMAT_OK) return status;
    }
    if (reachable[i].reached) continue;
    while (next < member_count && members[next] < i) next++;
    improve_link(spheres, reachable, members, member_count, next, &reachable[i]);
  }
  return QMAT_OK;
}

/* Links the nearest two spheres of different components in the same solid, until that has only one, but for those whose
 * link would leave the solid too far (Prim 1957). */
static qmat_status link_nearest(qmat_dual_complex *d, const uint32_t *index, const uint32_t *homes, uint32_t *joined,
                                const double *spheres, size_t *links) {
  qmat_arena *arena = &d->context->arena;
  size_t count = 0;
  const contact *contacts = find_contacts(d, index, homes, &count);
  reachable_sphere *reachable = qmat_arena_alloc(arena, count, sizeof *reachable);
  uint32_t *members = qmat_arena_alloc(arena, count, sizeof *members);
  if (!contacts || !reachable || !members) return qmat_fail_memory(d->context, "components");
  qmat_status status = QMAT_OK;
  for (size_t first = 0, last; first < count && status == QMAT_OK; first = last) {
    size_t here = 0;
    for (last = first; last < count && contacts[last].site == contacts[first].site; last++) {
      const uint32_t sphere = contacts[last].sphere;
      reachable[here++] = (reachable_sphere){
          .best = {0, INFINITY, NONE, NONE}, .sphere = sphere, .set = qmat_set_leader(joined, index[sphere])};
    }
    sort_along(reachable, here, spheres);
    uint32_t newest = reachable[0].set;
    while (status == QMAT_OK && (status = reach_set(d, spheres, newest, reachable, here, members)) == QMAT_OK) {
      size_t next = here;
      for (size_t i = 0; i < here; i++)
        if (!reachable[i].reached && (next == here || better_link(&reachable[i].best, &reachable[next].best) < 0))
          next = i;
      if (next == here) break;
      newest = reachable[next].set;
      status = add_link(d, spheres, index, &reachable[next].best, joined, links);
    }
  }
  return status;
}

static qmat_status link_components(qmat_dual_complex *d, qmat_dual_component_counts *counts) {
  if (counts->components < 2) return QMAT_OK;
  qmat_arena *arena = &d->context->arena;
  uint32_t *index = qmat_arena_alloc(arena, d->sphere_count, sizeof *index);
  double *spheres = qmat_arena_alloc(arena, d->sphere_count, 4 * sizeof *spheres);
  size_t count = 0;
  const component *components = index && spheres ? find_components(d, index, &count) : NULL;
  uint32_t *joined = qmat_sets_new(d->context, count);
  const uint32_t *homes = components ? find_homes(d, index, count) : NULL;
  if (!joined || !homes) return qmat_fail_memory(d->context, "components");
  for (size_t cell = 0; cell < d->cells.count; cell++)
    if (d->kinds[cell]) memcpy(&spheres[4 * (size_t)d->sphere_of[cell]], &d->spheres[4 * cell], 4 * sizeof *spheres);
  qmat_status status = link_at_samples(d, index, homes, joined, spheres, &counts->links);
  if (status == QMAT_OK) status = link_nearest(d, index, homes, joined, spheres, &counts->links);
  counts->components -= counts->links;
  return status;
}

qmat_status qmat_dual_components_join(qmat_dual_complex *d, qmat_dual_component_counts *counts) {
  const qmat_status status = drop_specks(d, counts);
  return status == QMAT_OK ? link_components(d, counts) : status;
}
