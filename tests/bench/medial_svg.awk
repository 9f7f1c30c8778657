# SPDX-License-Identifier: GPL-3.0-or-later
# Draws a .ma file as an SVG, along the axis of its least extent: where slabs are in blue, cones that have no slab in red,
# and spheres where they are few. Slabs are drawn as the cells of a grid that they cover, since there may be thousands.
BEGIN {
  n = edges = faces = 0
  cell = 1.5
}
$1 == "v" {
  for (k = 0; k < 3; k++) {
    p[n, k] = $(2 + k)
    if (n == 0 || p[n, k] < low[k]) low[k] = p[n, k]
    if (n == 0 || p[n, k] > high[k]) high[k] = p[n, k]
  }
  r[n++] = $5
}
$1 == "e" { from[edges] = $2; to[edges++] = $3 }
$1 == "f" {
  for (k = 0; k < 3; k++) corner[faces, k] = $(2 + k)
  side[$2, $3] = side[$3, $4] = side[$2, $4] = 1
  faces++
}
function x(i) { return scale * (p[i, across] - low[across]) }
function y(i) { return scale * (high[up] - p[i, up]) }
function longest(a, b) {
  a = a < 0 ? -a : a
  b = b < 0 ? -b : b
  return a > b ? a : b
}
# Marks the grid's cells that the triangle of three spheres covers.
function cover(a, b, c,    ux, uy, vx, vy, steps, i, j) {
  ux = x(b) - x(a); uy = y(b) - y(a); vx = x(c) - x(a); vy = y(c) - y(a)
  steps = 1 + int(longest(longest(ux, uy), longest(vx, vy)) / cell * 1.5)
  for (i = 0; i <= steps; i++)
    for (j = 0; i + j <= steps; j++)
      covered[int((x(a) + (i * ux + j * vx) / steps) / cell), int((y(a) + (i * uy + j * vy) / steps) / cell)] = 1
}
END {
  if (!n) exit 1
  depth = 0
  for (k = 1; k < 3; k++) if (high[k] - low[k] < high[depth] - low[depth]) depth = k
  across = (depth + 1) % 3; up = (depth + 2) % 3
  wide = high[across] - low[across]; tall = high[up] - low[up]
  scale = 360 / longest(wide, tall)
  if (!(scale < 1e300)) scale = 1
  wide *= scale; tall *= scale
  for (f = 0; f < faces; f++) cover(corner[f, 0], corner[f, 1], corner[f, 2])
  printf "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" font-family=\"sans-serif\" fill=\"none\">\n", 460, 64 + tall
  printf "<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n<text x=\"20\" y=\"24\" font-size=\"14\" fill=\"#222\">%s: %d spheres</text>\n", title, n
  printf "<g transform=\"translate(20 44)\">\n<path fill=\"#56b4e9\" d=\""
  for (j = 0; j <= tall / cell; j++)
    for (i = 0; i <= wide / cell; i++) {
      if (!((i, j) in covered)) continue
      for (run = 1; (i + run, j) in covered;) run++
      printf "M%g %gh%gv%gh-%gz", i * cell, j * cell, run * cell, cell, run * cell
      i += run
    }
  printf "\"/>\n<path stroke=\"#d55e00\" d=\""
  for (i = 0; i < edges; i++)
    if (!((from[i], to[i]) in side)) printf "M%.0f %.0fL%.0f %.0f", x(from[i]), y(from[i]), x(to[i]), y(to[i])
  print "\"/>"
  if (n <= 400)
    for (i = 0; i < n; i++)
      printf "<circle cx=\"%.0f\" cy=\"%.0f\" r=\"%.1f\" stroke=\"#222\" stroke-opacity=\"0.4\"/>\n", x(i), y(i), scale * r[i]
  print "</g>\n</svg>"
}
