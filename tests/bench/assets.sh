#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Prints a Markdown table of what `qmat mat` makes of the model files in a folder, and a summary line:
#   assets.sh [FOLDER] [--epsilon E] [--timeout SECONDS]      default: ../shared/data/assets at 2 %, a minute each
# Where the folder's README.md has a table whose first column names files, these are taken, else all model files.
# Class: closed, holes (borders were closed), sheets, or what is mixed. A result is "wrong" when it is written although
# an error is above 1.25 epsilon.
set -eu
epsilon=2%
timeout=60
options="--epsilon --timeout"
. "$(dirname "$0")/functions.sh"
need /usr/bin/time time
[ $# -le 1 ] || refuse "one folder, not $#"
folder=${1:-$top/../shared/data/assets}
if [ ! -d "$folder" ]; then
  echo "no folder $folder: name one with model files" >&2
  exit 2
fi
QMAT_CACHE=off # the times of real runs
export QMAT_CACHE

list_files() {
  if [ -e "$folder/README.md" ]; then
    awk -F '|' '/^\|/ { gsub(/^ +| +$/, "", $2); print $2 }' "$folder/README.md" | while read -r name; do
      if [ -f "$folder/$name" ]; then echo "$name"; fi
    done
  fi >"$work/listed"
  if [ -s "$work/listed" ]; then
    cat "$work/listed"
  else
    (cd "$folder" && find . -type f | sed 's/^\.\///' | LC_ALL=C sort |
      grep -iE '\.(gltf|glb|obj|off|ply|stl|usd|usda|usdc|usdz)$') || true
  fi
}

# sum KEY: the sum of all numbers of that name in the report.
sum() {
  awk -v key="\"$1\":" '$1 == key { gsub(/,/, "", $2); n += $2 } END { print n + 0 }' "$work/report.json"
}

class() {
  found=
  if [ "$(sum solids)" -gt "$(sum solids_with_holes)" ]; then found=closed; fi
  if [ "$(sum solids_with_holes)" -gt 0 ]; then found="$found holes"; fi
  if [ "$(sum sheet_triangles)" -gt 0 ]; then found="$found sheets"; fi
  echo "${found# }"
}

list_files >"$work/files"
echo '| file | class | triangles | spheres | surface to envelope | envelope to surface | certified | s | MB | reason |'
echo '| --- | --- | ---: | ---: | ---: | ---: | --- | ---: | ---: | --- |'
while read -r name; do
  rm -f "$work/report.json" "$work/out.glb"
  status=0
  /usr/bin/time -f '%U %S %M' -o "$work/cost" timeout "$timeout" "$build/qmat" mat "$folder/$name" -o "$work/out.glb" \
    --epsilon "$epsilon" --report "$work/report.json" --quiet --progress off 2>"$work/complaint" </dev/null || status=$?
  cost=$(tail -n 1 "$work/cost" | awk '{ printf "%.1f | %d", $1 + $2, $3 / 1024 }')
  reason=$(grep -v 'warning: ' "$work/complaint" | tail -n 1 | sed 's/|/\\|/g; s/^qmat: //' | cut -c 1-160)
  case $status in
    0)
      out=$(number surface_to_envelope "$work/report.json")
      in=$(number envelope_to_surface "$work/report.json")
      outcome=certified
      if ! sed -n '/"summary"/,$p' "$work/report.json" | grep -q '"certified": true'; then
        outcome=$(awk -v a="$out" -v b="$in" -v e="$epsilon" 'BEGIN {
          e = e ~ /%/ ? e / 100 : e
          print ((a > b ? a : b) > 1.25 * e ? "wrong" : "no")
        }')
      fi
      echo "| $name | $(class) | $(number triangles "$work/report.json") | $(number spheres "$work/report.json") |" \
        "$(percent 2 "$out") | $(percent 2 "$in") | $outcome | $cost | $reason |"
      ;;
    124) outcome='out of time' && echo "| $name | | | | | | out of time | $cost | |" ;;
    1 | 2) outcome=refused && echo "| $name | | | | | | refused | $cost | $reason |" ;;
    *) outcome=crash && echo "| $name | | | | | | crash | $cost | exit $status $reason |" ;;
  esac
  echo "$outcome | $cost" >>"$work/outcomes"
done <"$work/files"
touch "$work/outcomes"
awk -F '|' '{ gsub(/ +$/, "", $1); count[$1]++; if ($2 > slow) slow = $2; if ($3 > large) large = $3 }
  END {
    split("certified,no,wrong,refused,out of time,crash", order, ",")
    names["no"] = "not certified"
    printf "\n%d files:", NR
    for (i = 1; i <= 6; i++) if (order[i] in count)
      printf "%s %d %s", n++ ? "," : "", count[order[i]], order[i] in names ? names[order[i]] : order[i]
    printf "; at most %.1f s of processor time and %d MB each\n", slow, large
  }' "$work/outcomes"
