/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_CORE_GEOMETRY_RESERVE_CELLS_CGAL_H
#define QMAT_CORE_GEOMETRY_RESERVE_CELLS_CGAL_H

#include <cstddef>

/* Reserves memory for the cells of the next point of a CGAL triangulation; for adapters. CGAL records the new cells
 * around a point in a thread-local map. If memory runs out meanwhile, the map keeps stale cells and corrupts the
 * thread's next triangulation, so a shortage must occur before. CGAL uses that map for at most this many cells. Its
 * reserve() leaves blocks uninitialised if a later one of the same call fails, so each call asks for one block. */
template <class Triangulation>
void qmat_reserve_cells(Triangulation &triangulation) {
  constexpr std::size_t kMostCells = Triangulation::Triangulation_data_structure::maximal_nb_of_facets_of_small_hole;
  auto &cells = triangulation.tds().cells();
  while (cells.capacity() - cells.size() < kMostCells) cells.reserve(cells.capacity() + 1);
}

#endif
