#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Includes point down, and no two modules need each other: includes.sh SOURCE_FOLDER
#
# The table below says which folders a folder may include. A module is NAME.h with NAME.c or NAME.cpp. Two modules form a
# circle when each includes the other's header, in any of its files, directly or through others.
set -eu
cd "$1"
find core io nodes graphs -name '*.[ch]' -o -name '*.cpp' -o -name '*.c.in' | LC_ALL=C sort | xargs awk '
  # An area is a folder. In graphs/ itself the C interface qmat.[ch] is an area above the graph language.
  function area(path) {
    if (path ~ /^graphs\/qmat\.(c|h)$/) return "graphs/qmat"
    sub(/\/[^\/]*$/, "", path)
    return path
  }
  function module(path) {
    sub(/\.(c|h|cpp|c\.in)$/, "", path)
    return path
  }
  function allow(from, to) { allowed[from] = " " from " " to " " }
  function wrong(text) { print text; bad = 1 }
  BEGIN {
    allow("core", "")
    allow("core/geometry", "core")
    formats = "core core/geometry io io/mesh io/gltf io/page io/usd"
    allow("io", formats)
    allow("io/mesh", formats)
    allow("io/gltf", formats)
    allow("io/page", "core io")
    allow("io/usd", formats)
    allow("nodes/measure", "core core/geometry")
    allow("nodes/initial", "core core/geometry nodes/measure")
    allow("nodes/mesh", "core core/geometry nodes/measure")
    allow("nodes/colliders", "core core/geometry nodes/measure")
    allow("nodes/skin", "core core/geometry nodes/measure")
    allow("nodes/descriptor", "core nodes/mesh")
    allow("nodes/simplify", "core core/geometry nodes/descriptor nodes/initial nodes/measure")
    allow("nodes/page", "core core/geometry io io/page nodes/measure nodes/simplify")
    nodes = "core core/geometry nodes nodes/colliders nodes/descriptor nodes/initial nodes/measure nodes/mesh nodes/page nodes/simplify nodes/skin"
    allow("nodes", formats " " nodes)
    allow("graphs", formats " " nodes)
    allow("graphs/cache", formats " " nodes " graphs")
    allow("graphs/run", formats " " nodes " graphs graphs/cache")
    allow("graphs/qmat", formats " " nodes " graphs graphs/cache graphs/run")
    allow("graphs/cli", formats " " nodes " graphs graphs/cache graphs/run graphs/qmat")
  }
  FNR == 1 {
    from = area(FILENAME)
    if (!(from in allowed)) wrong(FILENAME ": tests/house/includes.sh has no row for the folder " from)
  }
  /^[ \t]*#[ \t]*include[ \t]*"/ {
    split($0, piece, "\"")
    target = piece[2]
    if (target !~ /\//) {
      wrong(FILENAME ":" FNR ": an include names the path from the root: \"" target "\"")
      next
    }
    to = area(target)
    if (from in allowed && index(allowed[from], " " to " ") == 0)
      wrong(FILENAME ":" FNR ": " from " must not include " to " (" target ")")
    a = module(FILENAME)
    b = module(target)
    if (a == b || (a, b) in edge) next
    edge[a, b] = FILENAME ":" FNR
    for (i = 1; i <= 2; i++) {
      name = i == 1 ? a : b
      if (!(name in degree)) { degree[name] = 0; order[++count] = name }
    }
    degree[a]++
    next_of[a] = next_of[a] " " b
    uses[b] = uses[b] " " a
  }
  # Modules that include nothing are taken away, again and again. What remains is on a circle or above one.
  function take_away(  i, j, n, user, again) {
    do {
      again = 0
      for (i = 1; i <= count; i++) {
        if (order[i] in done || degree[order[i]] > 0) continue
        done[order[i]] = again = 1
        n = split(uses[order[i]], user, " ")
        for (j = 1; j <= n; j++) degree[user[j]]--
      }
    } while (again)
  }
  # Each module that remains includes one that remains, so a path of them comes back to itself: that part is a circle.
  function report_circle(at,  step, path, length_of, follower, text, i, j, n, user) {
    for (length_of = 1; !(at in step); length_of++) {
      step[at] = length_of
      path[length_of] = at
      n = split(next_of[at], follower, " ")
      for (j = 1; j < n && follower[j] in done; j++) continue
      at = follower[j]
    }
    path[length_of] = at
    text = at ": a circle of includes:"
    for (i = step[at]; i < length_of; i++) {
      text = text (i > step[at] ? ", " : " ") edge[path[i], path[i + 1]] " includes " path[i + 1] ".h"
      done[path[i]] = 1
      n = split(uses[path[i]], user, " ")
      for (j = 1; j <= n; j++) degree[user[j]]--
    }
    wrong(text)
  }
  END {
    take_away()
    for (i = 1; i <= count; i++) {
      if (order[i] in done) continue
      report_circle(order[i])
      take_away()
    }
    exit bad
  }'
