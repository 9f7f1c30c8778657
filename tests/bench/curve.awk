# SPDX-License-Identifier: GPL-3.0-or-later
# Draws error against vertices, both logarithmic, as an SVG. Input lines have model, method, vertices, surface to
# envelope and envelope to surface, separated by tabs. Each model is a column, each direction a row. With -v order="A;B"
# these methods have the first colours, whether they have points or not.
BEGIN {
  FS = "\t"
  width = 300; height = 220; left = 62; top = 62; gap_x = 24; gap_y = 70
  split("#0072b2 #009e73 #e69f00 #d55e00 #cc79a7 #56b4e9 #777777", colours, " ")
  split("surface to envelope;envelope to surface", directions, ";")
  methods = split(order, names, ";")
  for (m = 1; m <= methods; m++) method[names[m]] = m
  low_x = low_y = 1e9; high_x = high_y = 0
}
{
  if (!($1 in column)) { column[$1] = ++columns; models[columns] = $1 }
  if (!($2 in method)) { method[$2] = ++methods; names[methods] = $2 }
  n = ++count[$1, $2]
  x[$1, $2, n] = $3
  if ($3 < low_x) low_x = $3
  if ($3 > high_x) high_x = $3
  for (r = 1; r <= 2; r++) {
    y[$1, $2, n, r] = $(3 + r)
    if ($(3 + r) < low_y) low_y = $(3 + r)
    if ($(3 + r) > high_y) high_y = $(3 + r)
  }
}
function at_x(c, v) { return left + (c - 1) * (width + gap_x) + width * log(v / low_x) / log(high_x / low_x) }
function at_y(r, v) { return top + (r - 1) * (height + gap_y) + height * (1 - log(v / low_y) / log(high_y / low_y)) }
function escaped(s) { gsub(/&/, "\\&amp;", s); gsub(/</, "\\&lt;", s); return s }
function text(px, py, size, anchor, what) {
  printf "<text x=\"%.1f\" y=\"%.1f\" font-size=\"%d\" text-anchor=\"%s\">%s</text>\n", px, py, size, anchor, escaped(what)
}
function line(x1, y1, x2, y2, colour, thick) {
  printf "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" stroke-width=\"%g\"/>\n", x1, y1, x2, y2,
    colour, thick
}
function axes(c, r,    i, v, x0, x1, y0, y1) {
  x0 = at_x(c, low_x); x1 = at_x(c, high_x); y0 = at_y(r, low_y); y1 = at_y(r, high_y)
  for (i = 1; i in ticks_y; i++) {
    v = ticks_y[i] + 0
    if (v < low_y || v > high_y) continue
    line(x0, at_y(r, v), x1, at_y(r, v), v == 0.01 ? "#777" : "#e4e4e4", 1)
    if (c == 1) text(x0 - 6, at_y(r, v) + 4, 12, "end", 100 * v " %")
  }
  for (i = 1; i in ticks_x; i++) {
    v = ticks_x[i] + 0
    if (v < low_x || v > high_x) continue
    line(at_x(c, v), y0, at_x(c, v), y1, "#e4e4e4", 1)
    text(at_x(c, v), y0 + 16, 12, "middle", v)
  }
  printf "<rect x=\"%.1f\" y=\"%.1f\" width=\"%d\" height=\"%d\" fill=\"none\" stroke=\"#444\"/>\n", x0, y1, width, height
  text((x0 + x1) / 2, y1 - 8, 14, "middle", models[c] ": " directions[r])
  text((x0 + x1) / 2, y0 + 34, 12, "middle", "medial vertices")
}
function curve(c, r, m,    i, points, dots) {
  for (i = 1; i <= count[models[c], names[m]]; i++) {
    px = at_x(c, x[models[c], names[m], i]); py = at_y(r, y[models[c], names[m], i, r])
    points = points sprintf(" %.1f,%.1f", px, py)
    dots = dots sprintf("M%.1f,%.1fh0", px, py) # a dot: a line of no length with round ends
  }
  printf "<polyline points=\"%s\" fill=\"none\" stroke=\"%s\" stroke-width=\"2\"/>\n", substr(points, 2), colours[m]
  printf "<path d=\"%s\" stroke=\"%s\" stroke-width=\"7\" stroke-linecap=\"round\"/>\n", dots, colours[m]
}
END {
  if (!columns) exit 1
  low_x *= 0.9; high_x *= 1.1; low_y *= 0.8; high_y *= 1.25
  w = left + columns * (width + gap_x)
  if (w < left + methods * 190) w = left + methods * 190
  h = top + 2 * (height + gap_y) - 10
  printf "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" viewBox=\"0 0 %d %d\" ", w, h, w, h
  print "font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" fill=\"#222\">"
  printf "<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n", w, h
  for (m = 1; m <= methods; m++) {
    legend = left + (m - 1) * 190
    line(legend, 18, legend + 28, 18, colours[m], 3)
    text(legend + 36, 23, 14, "start", names[m])
  }
  if (columns > 2) text(w - gap_x, 23, 12, "end", "% of the diagonal")
  split("5 10 20 50 100 200 500 1000 2000 5000 10000", ticks_x, " ")
  split("0.0001 0.0002 0.0005 0.001 0.002 0.005 0.01 0.02 0.05 0.1 0.2 0.5 1 2 5", ticks_y, " ")
  for (c = 1; c <= columns; c++)
    for (r = 1; r <= 2; r++) {
      axes(c, r)
      for (m = methods; m >= 1; m--) curve(c, r, m) # the first on top
    }
  print "</svg>"
}
