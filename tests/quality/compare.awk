# SPDX-License-Identifier: GPL-3.0-or-later
# Compares measured rows with those of the quality table: awk -f compare.awk TABLE FIGURES. One line a row; exit code 1
# when a row is worse than the table says. Rows of the table that were not measured fail, unless -v partial=1 says that
# only some models were asked for; rows of surfaces/ are skipped without -v surfaces=1.
function worse(what) { bad = bad (bad ? ", " : "") what }
function better(what) { good = good (good ? ", " : "") what }
function compare(what, now, table) {
  if (now > table) worse(now " " what ", the table says " table)
  if (now < table) better(now " " what ", the table says " table)
}
# How far a Betti number is from the solid's. A number that is not known is as far away as can be.
function distance(number, solid) {
  if (number == "-") return 1e9
  if (solid == "-") return 0
  return number > solid ? number - solid : solid - number
}
function compare_betti(k, now, then) {
  now = distance($(6 + k), $(9 + k))
  then = distance(expected[k], expected[3 + k])
  if ($(9 + k) != expected[3 + k]) worse("the solid has " $(9 + k) " " names[k] ", the table says " expected[3 + k])
  else if (now > then) worse($(6 + k) " " names[k] ", the table says " expected[k])
  else if (now < then) better($(6 + k) " " names[k] ", the table says " expected[k])
  else if ($(6 + k) != expected[k] && $(9 + k) == "-") worse($(6 + k) " " names[k] ", the table says " expected[k])
}

BEGIN { split("components loops voids", names) }
/^#/ || NF == 0 { next }
FNR == NR { table[$1 " " $2] = $0; next }
{
  row = "quality: " $1 " at " $2
  bad = good = ""
  measured[$1 " " $2] = 1
  if (!(($1 " " $2) in table)) worse("the table has no such row")
  else if (NF != 12) worse("no figures: " substr($0, length($1 " " $2) + 2))
  else {
    split(table[$1 " " $2], fields)
    for (k = 1; k <= 6; k++) expected[k] = fields[6 + k]
    compare("spheres", $3 + 0, fields[3] + 0)
    compare("% from surface to envelope", $4 + 0, fields[4] + 0)
    compare("% from envelope to surface", $5 + 0, fields[5] + 0)
    if ($6 != fields[6]) { if ($6 == "yes") better("certified"); else worse("not certified") }
    for (k = 1; k <= 3; k++) compare_betti(k)
  }
  if (bad) { failed = 1; print "FAILED  " row ": " bad }
  else print "ok      " row ": " $3 " spheres, " $4 " % and " $5 " %" \
    (good ? "; renew the table (sh tests/quality/gate.sh --renew): better: " good : "")
}
END {
  for (row in table) {
    if (row in measured || partial) continue
    if (row ~ /^surfaces\// && !surfaces) { absent++; list = list (list ? ", " : "") row }
    else { failed = 1; print "FAILED  quality: " row ": was not measured" }
  }
  if (absent) print "skipped: quality of " list ": the folder ../shared/data/surfaces is not present"
  exit failed
}
