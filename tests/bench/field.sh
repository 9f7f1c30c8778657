#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Error against number of spheres for ours, Q-MAT, PMAT, HEM, PC, SAT and VC, as one page:
#   field.sh [-o FOLDER] [--models LIST] [--folder FOLDER] [--planted N] [--limit SECONDS] [--fresh] [--page] [MODEL...]
# The default folder is tests/bench/field; it gets README.md, curves as SVG, and field.json. Models are those named and
# the model files of --folder; without any, the eleven of ../shared/data/surfaces, the generated ones (qmat_models), both
# only those in LIST (names with commas between them) where it is given, and N planted shapes whose medial mesh is known
# (default 4; target qmat_planted). Small files come first, SAT and HEM of all models last.
# A run that takes more than SECONDS processor seconds (default 120) is ended, and the page says so. A run that is stopped
# goes on where it was: what field.json has is not measured again, unless --fresh. --page measures nothing and makes the
# page of what field.json has. QMAT_BUILD is the build folder, by default build/release.
set -eu
out=
folder=
models=
planted=4
limit=120
fresh=no
page=no
options="-o --folder --models --planted --limit --fresh! --page!"
. "$(dirname "$0")/functions.sh"
out=${out:-$top/tests/bench/field}
command="sh tests/bench/field.sh$taken"
mkdir -p "$out"
rows=$work/rows
paper=$top/graphs/paper
counts="10 20 30 50 80 120 200 500"

# --- the models, "SECTION PATH" a line, small files first ---

# generated_models: the shapes of qmat_models, at a resolution that gives them some thousand triangles.
generated_models() {
  for name in box capsule curved-sheet l-bracket sheet sphere tapered-capsule torus; do
    "$build/qmat_models" $name --resolution 24 -o "$work/models/$name.off" >"$work/said"
    echo "generated $work/models/$name.off"
  done
}

# planted_models: chains, trees, rings and slabs in turn; every second round has 0.1 % of noise.
planted_models() {
  if [ "$planted" -gt 0 ]; then need_built qmat_planted; fi
  i=0
  while [ "$i" -lt "$planted" ]; do
    case $((i % 4)) in 0) kind=chain ;; 1) kind=tree ;; 2) kind=ring ;; *) kind=slab ;; esac
    case $((i / 4 % 2)) in 0) noise=0 ;; *) noise=0.001 ;; esac
    spheres=$((5 + i * 3 % 8))
    path=$work/models/planted-$kind-of-$spheres.off
    "$build/qmat_planted" $kind $spheres "$i" 5000 $noise "$path" "$work/planted.ma"
    echo "planted $path"
    i=$((i + 1))
  done
}

mkdir "$work/models"
{
  for path in "$@"; do echo "given $path"; done
  if [ -n "$folder" ]; then
    find "$folder" -type f | LC_ALL=C sort | grep -E '\.(off|obj|ply|stl|glb|gltf|usda|usdc|usdz)$' | sed 's/^/given /'
  fi
  if [ $# -eq 0 ] && [ -z "$folder" ]; then
    {
      generated_models
      given_models ant plane octopus spot knight bug chair fandisk homer pinion fertility | sed 's/^/surface /'
    } | while read -r section path; do
      case ",${models:-$(name_of "$path")}," in *",$(name_of "$path"),"*) echo "$section $path" ;; esac
    done
    planted_models
  fi
} >"$work/list"
for path in "$@"; do command="$command $(basename "$path")"; done
while read -r section path; do echo "$(wc -c <"$path") $section $path"; done <"$work/list" | sort -n |
  cut -d ' ' -f 2- >"$work/models.list"

# --- the methods ---

: >"$rows"
if [ $fresh = no ] && [ -e "$out/field.json" ]; then json_to_rows <"$out/field.json" >"$rows"; fi

# keep: rows become those of field.json, all at once.
keep() {
  rows_to_json <"$rows" >"$out/field.json.part"
  mv "$out/field.json.part" "$out/field.json"
}

# ours SECTION NAME MODEL: a run of the whole graph for each epsilon.
ours() {
  for epsilon in 8% 4% 2% 1%; do
    if timed "$build/qmat" run "$top/graphs/qmat_plus.yaml" --set "model=$3" --set "epsilon=$epsilon" --to errors \
      --report "$work/errors.json" --no-cache --quiet --progress off; then
      note "$1" "$2" ours
    else
      note "$1" "$2" ours late
    fi
  done
}

# levels SECTION NAME METHOD MODEL GRAPH SETTING...: a chain of collapses of an initial medial mesh, and its levels.
levels() {
  section=$1 name=$2 method=$3 model=$4 graph=$5
  shift 5
  set -- "$graph" --set "model=$model" "$@"
  rm -rf "$work/cache"
  if ! timed qmat_run "$@" --to chain; then
    note "$section" "$name" "$method" late
    return
  fi
  of_method=$seconds
  for count in $counts; do
    if timed qmat_run "$@" --set "vertices=$count" -o "report=$work/errors.json"; then
      seconds=$of_method
      note "$section" "$name" "$method"
    else
      note "$section" "$name" "$method" late
    fi
    if [ "$(number spheres "$work/errors.json")" -lt "$count" ]; then break; fi # that was the initial medial mesh
  done
}

# measure SECTION NAME METHOD MODEL
measure() {
  case $3 in
    ours) ours "$1" "$2" "$4" ;;
    Q-MAT) levels "$@" "$top/tests/bench/curve.yaml" --set chain.compat=qmat ;;
    PMAT) levels "$@" "$top/tests/bench/curve.yaml" --set chain.cost=pmat --set chain.on_exceed=stop ;;
    HEM)
      levels "$@" "$top/tests/bench/curve.yaml" --set chain.cost=hausdorff --set chain.error=one_sided \
        --set chain.on_exceed=stop --set chain.finest=1%
      ;;
    PC) levels "$@" "$paper/curve_pc.yaml" --set chain.compat=qmat ;;
    SAT) levels "$@" "$paper/curve_sat.yaml" --set chain.compat=qmat ;;
    VC) levels "$@" "$paper/curve_vc.yaml" --set chain.compat=qmat ;;
  esac
}

again=0
missing=0
for methods in "ours Q-MAT PMAT PC VC" SAT HEM; do
  while read -r section path; do
    name=$(name_of "$path")
    for method in $methods; do
      if awk -F '\t' -v m="$name" -v k="$method" '$2 == m && $3 == k { found = 1 } END { exit !found }' "$rows"; then
        again=$((again + 1))
      elif [ $page = yes ]; then
        missing=$((missing + 1))
      else
        measure "$section" "$name" "$method" "$path"
        keep
      fi
    done
  done <"$work/models.list"
done

# --- the page ---

# The rows of a model follow each other, in the order of the methods.
order="ours;Q-MAT;PMAT;HEM;PC;SAT;VC"
awk -F '\t' -v order="$order" '!($2 in at) { name[++n] = $2; at[$2] = 1 } { of[$2, $3] = of[$2, $3] $0 "\n" }
  END {
    methods = split(order, method, ";")
    for (i = 1; i <= n; i++) for (k = 1; k <= methods; k++) printf "%s", of[name[i], method[k]]
  }' "$rows" >"$work/ordered"
rows=$work/ordered

# Groups of four models share a picture. A logarithmic axis has no zero.
rm -f "$out"/curves_*.svg
awk -F '\t' '
  function worse(a, b) { return a > b ? a : b }
  $4 ~ /^>/ { next }
  !($2 in at) { at[$2] = 1 + int(0.25 * n); n++ }
  { # runs that end with as many spheres: the best of them
    key = $2 SUBSEP $3 SUBSEP $5
    error = worse($6, $7)
    if (!(key in least)) order[++keys] = key
    if (!(key in least) || error < least[key]) {
      least[key] = error
      line[key] = sprintf("%d\t%s\t%s\t%d\t%.6g\t%.6g", at[$2], $2, $3, $5, worse($6, 1e-5), worse($7, 1e-5))
    }
  }
  END { for (i = 1; i <= keys; i++) print line[order[i]] }' "$rows" >"$work/points"
groups=$(awk -F '\t' '$1 > most { most = $1 } END { print most + 0 }' "$work/points")
group=0
while [ $((group += 1)) -le "$groups" ]; do
  awk -F '\t' -v g=$group '$1 == g' "$work/points" | cut -f 2- |
    awk -v order="$order" -f "$top/tests/bench/curve.awk" >"$out/curves_$group.svg"
done

{
  echo "# The field's benchmark"
  echo
  {
    made_by "$command"
    if [ $again -gt 0 ]; then
      echo "$again pairs of a model and a method were measured by earlier runs."
    fi
    if [ $missing -gt 0 ]; then echo "$missing pairs are not measured yet: the command goes on with them."; fi
  } | fold -s -w 118 | sed 's/ *$//'
  cat <<END_OF_PART

[field.json](field.json) has all figures. Errors are those of \`medial.evaluate\` for every method: distances that some point
attains, as shares of the diagonal; a level counts with the larger of both. "Ours" is the graph of \`qmat mat\`, run once for
each of four epsilons. The others are chains of collapses down to fixed numbers of spheres: Q-MAT, PMAT and HEM of our
initial medial mesh, each by its own rules; PC, SAT and VC (depth 7, lambda 0.5 %) of their own initial medial meshes, by the
rules of Q-MAT, as its authors used PC and SAT. Seconds are those from the file to the level: for ours, of the run that the
column of 1 % shows; for a chain, of all levels. A run that takes more than $limit s is ended.

## All models

Spheres at 1 % are the fewest of the measured levels whose errors are both at most 1 %. Their share is that of ours, as the
geometric mean over models on which both get there. Betti numbers are right where they are those of the solid at that level.

| method | models | reach 1 % | spheres, ours is 1 | right Betti numbers | reach 2 % | s in all |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
END_OF_PART
  awk -F '\t' '
    function worse(a, b) { return a > b ? a : b }
    {
      if (!(($2, $3) in seen)) { seen[$2, $3] = 1; models[$3]++ }
      if (!($2 in known)) { known[$2] = 1; name[++n] = $2 }
    }
    $4 ~ /^>/ { if (!(($2, $3) in spent)) { late[$3]++; spent[$2, $3] = substr($4, 2) } next }
    {
      e = worse($6, $7)
      if ($3 == "ours") total[$3] += $4; else if (!(($2, $3) in spent)) { spent[$2, $3] = $4; total[$3] += $4 }
      if (e <= 0.01 && (!(($2, $3) in one) || $5 < one[$2, $3])) {
        one[$2, $3] = $5
        right[$2, $3] = $8 == $11 && $9 == $12 && $10 == $13
      }
      if (e <= 0.02) two[$2, $3] = 1
    }
    END {
      m = split("ours Q-MAT PMAT HEM PC SAT VC", methods, " ")
      for (k = 1; k <= m; k++) {
        method = methods[k]; sum = both = reached = twos = correct = 0
        for (i = 1; i <= n; i++) {
          if ((name[i], method) in two) twos++
          if (!((name[i], method) in one)) continue
          reached++
          correct += right[name[i], method]
          if ((name[i], "ours") in one) { sum += log(one[name[i], method] / one[name[i], "ours"]); both++ }
        }
        printf "| %s | %d | %d | %s | %d | %d | %.0f%s |\n", method, models[method], reached,
          both ? sprintf("%.1f", exp(sum / both)) : "", correct, twos, total[method],
          late[method] ? sprintf(", and %d ended", late[method]) : ""
      }
    }' "$rows"
  cat <<END_OF_PART

## Each model

The fewest spheres of the measured levels with both errors at most that; Betti numbers (components, loops, voids) are those
of the level at 1 %, or of the one with the least error.

| model (its Betti numbers) | method | 8 % | 4 % | 2 % | 1 % | Betti numbers | least error | s |
| --- | --- | ---: | ---: | ---: | ---: | --- | ---: | ---: |
END_OF_PART
  awk -F '\t' '
    function flush(    j, line) {
      if (key == "") return
      if (!levels) { printf "| %s | %s | | | | | | | more than %s |\n", title, method, bound; return }
      line = ""
      for (j = 1; j <= 4; j++) line = line " | " ((j in least) ? least[j] : "")
      printf "| %s | %s%s | %s | %.2f %% | %s |\n", title, method, line, betti, 100 * best, spent
    }
    BEGIN { split("0.08 0.04 0.02 0.01", target, " ") }
    $2 SUBSEP $3 != key {
      flush()
      key = $2 SUBSEP $3; method = $3; levels = 0; best = 1e9; at_one = 0; split("", least)
    }
    $4 ~ /^>/ { bound = substr($4, 2); if (!levels) title = $2; next }
    {
      levels++
      title = $2 " (" $11 ", " $12 ", " $13 ")"
      e = $6 > $7 ? $6 : $7
      for (j = 1; j <= 4; j++) if (e <= target[j] && (!(j in least) || $5 < least[j])) {
        least[j] = $5 + 0
        if (j == 4) { at_one = 1; betti = $8 ", " $9 ", " $10; spent = $4 }
      }
      if (e < best) { best = e; if (!at_one) { betti = $8 ", " $9 ", " $10; spent = $4 } }
    }
    END { flush() }' "$rows"
  echo
  echo "## Curves"
  group=0
  while [ $((group += 1)) -le "$groups" ]; do
    echo
    echo "![Errors against spheres](curves_$group.svg)"
  done
} >"$out/README.md.part"
mv "$out/README.md.part" "$out/README.md"
