/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "tests/bench/plain_delaunay_cgal.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <chrono>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

double qmat_plain_delaunay_seconds(const double *points, size_t count) {
  try {
    std::vector<Kernel::Point_3> sites;
    sites.reserve(count);
    for (size_t i = 0; i < count; i++) sites.emplace_back(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    const auto start = std::chrono::steady_clock::now();
    const CGAL::Delaunay_triangulation_3<Kernel> triangulation(sites.begin(), sites.end());
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
    return triangulation.number_of_vertices() > 0 ? passed.count() : -1;
  } catch (...) {
    return -1;
  }
}
