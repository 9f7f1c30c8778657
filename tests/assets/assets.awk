# SPDX-License-Identifier: GPL-3.0-or-later
# Writes a small asset of a kind that people really have, as OFF: awk -v name=NAME -f assets.awk
# head: a sphere with a cut-off neck; holes: a sphere with ten holes; soup: its triangles apart, each facing anywhere;
# overlap: two spheres that reach into each other; crossing: a tube that crosses itself; plane, banner, shell,
# leaves: surfaces without volume; arcs, deep_arcs: two that cross; card: a plane of two sides.
function vertex(x, y, z) { v[vertices++] = sprintf("%.9g %.9g %.9g", x, y, z) }
function face(a, b, c) { f[faces++] = "3 " a " " b " " c }
# A sphere of `rows` rows; of the lowest `cut` there is none.
function sphere(x, rows, cut,   i, j, n, first, a, b) {
  n = 2 * rows
  first = vertices
  vertex(x, 0, 1)
  for (i = 1; i <= rows - (cut > 0 ? cut : 1); i++)
    for (j = 0; j < n; j++) {
      a = pi * i / rows
      b = 2 * pi * j / n
      vertex(x + sin(a) * cos(b), sin(a) * sin(b), cos(a))
    }
  for (j = 0; j < n; j++) face(first, first + 1 + j, first + 1 + (j + 1) % n)
  for (i = 1; i < rows - (cut > 0 ? cut : 1); i++)
    for (j = 0; j < n; j++) quad(first + 1 + (i - 1) * n + j, first + 1 + i * n + j,
                                 first + 1 + i * n + (j + 1) % n, first + 1 + (i - 1) * n + (j + 1) % n)
  if (cut > 0) return
  vertex(x, 0, -1)
  for (j = 0; j < n; j++) face(vertices - 1, first + 1 + (rows - 2) * n + (j + 1) % n, first + 1 + (rows - 2) * n + j)
}
function quad(a, b, c, d) { face(a, b, c); face(a, c, d) }
# A grid over the unit square, which place() puts into space.
function grid(columns, rows,   i, j, first) {
  first = vertices
  for (i = 0; i <= columns; i++) for (j = 0; j <= rows; j++) place(i / columns, j / rows)
  for (i = 0; i < columns; i++) for (j = 0; j < rows; j++)
    quad(first + i * (rows + 1) + j, first + (i + 1) * (rows + 1) + j, first + (i + 1) * (rows + 1) + j + 1,
         first + i * (rows + 1) + j + 1)
}
function place(u, w,   a, b, x, y) {
  if (name == "banner") vertex(2 * u, w, 0.2 * sin(5 * u) * (0.3 + u))
  else if (name == "shell") {
    a = 0.8 * pi * (u - 0.5)
    b = 0.8 * pi * (w - 0.5)
    vertex(cos(b) * sin(a), sin(b), cos(b) * cos(a))
  } else if (name == "leaves") {
    a = 2 * pi * leaf / 7
    x = 0.1 + u
    y = 0.3 * (w - 0.5) * sin(pi * (0.1 + 0.8 * u))
    vertex(x * cos(a) - y * sin(a), x * sin(a) + y * cos(a), 0.4 * sin(2 * u + leaf))
  } else if (name ~ /arcs$/) {
    x = sin(curvature * u) / curvature
    y = 0.9 * (w - 0.5)
    vertex(x * cos(turn) - y * sin(turn), x * sin(turn) + y * cos(turn), (1 - cos(curvature * u)) / curvature)
  } else vertex(u, 1.6 * w, 0)
}
# A tube along a figure of eight, which crosses itself in the middle.
function tube(along, around,   i, j, a, b, x, y, length_) {
  for (i = 0; i < along; i++) for (j = 0; j < around; j++) {
    a = 2 * pi * (i + 0.5) / along
    b = 2 * pi * j / around
    x = cos(2 * a)
    y = -cos(a)
    length_ = sqrt(x * x + y * y)
    vertex(sin(a) + 0.2 * cos(b) * x / length_, sin(2 * a) / 2 + 0.2 * cos(b) * y / length_, 0.2 * sin(b))
  }
  for (i = 0; i < along; i++) for (j = 0; j < around; j++)
    quad(i * around + j, (i + 1) % along * around + j, (i + 1) % along * around + (j + 1) % around,
         i * around + (j + 1) % around)
}
BEGIN {
  pi = atan2(0, -1)
  vertices = faces = 0
  if (name == "head") sphere(0, 16, 3)
  else if (name == "overlap") { sphere(0, 16, 0); sphere(1, 16, 0) }
  else if (name == "crossing") tube(64, 16)
  else if (name == "leaves") for (leaf = 0; leaf < 7; leaf++) grid(8, 4)
  else if (name ~ /arcs$/) {
    curvature = 1
    turn = 0
    grid(10, 4)
    curvature = name == "arcs" ? 2.5 : 3.5
    turn = 0.5
    grid(10, 4)
  } else if (name == "holes" || name == "soup") sphere(0, 16, 0)
  else if (name == "card") {
    grid(6, 10)
    other = faces
    for (i = 0; i < other; i++) { split(f[i], c, " "); face(c[2], c[4], c[3]) }
  } else grid(name == "plane" ? 8 : 24, name == "plane" ? 8 : 12)
  gone = 0
  for (i = 0; i < faces; i++) # every hundredth facet; they share no vertex
    if (name == "holes" && i % 96 == 50 && gone < 10) { f[i] = ""; gone++ }
  print "OFF"
  if (name != "soup") {
    print vertices, faces - gone, 0
    for (i = 0; i < vertices; i++) print v[i]
    for (i = 0; i < faces; i++) if (f[i] != "") print f[i]
    exit
  }
  print 3 * faces, faces, 0
  for (i = 0; i < faces; i++) { split(f[i], c, " "); for (k = 2; k <= 4; k++) print v[c[k]] }
  for (i = 0; i < faces; i++) {
    turn = i * i % 7 < 4
    print "3 " 3 * i " " 3 * i + 2 - turn " " 3 * i + 1 + turn
  }
}
