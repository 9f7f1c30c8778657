#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The comparisons of the paper's section 4, ours beside them, as one page:
#   paper.sh [-o FOLDER] [--simplified] [--models LIST] [MODEL...]
# The default folder is tests/bench/paper. LIST is names of models of ../shared/data/surfaces with commas between them;
# without it and MODEL they are all taken, or generated ones.
# Writes README.md, SVG pictures and paper.json into the folder: initial medial meshes (table 1, figures 3, 4 and 8). With
# --simplified also table 2, figures 7, 9 and 10, and curves, of the first two models; HEM takes minutes. Seconds are
# processor seconds of a method alone: what it starts from comes from the cache. QMAT_BUILD is the build folder, by
# default build/release.
set -eu
. "$(dirname "$0")/functions.sh"
out=$top/tests/bench/paper
command="sh tests/bench/paper.sh"
first_models=0
if [ "${1:-}" = -o ]; then
  out=$2
  shift 2
fi
if [ "${1:-}" = --simplified ]; then
  first_models=2
  command="$command --simplified"
  shift
fi
names="ant plane octopus spot knight bug chair fandisk homer pinion fertility"
if [ "${1:-}" = --models ]; then
  names=$(echo "$2" | tr , ' ')
  command="$command --models $2"
  shift 2
fi
if [ $# -eq 0 ]; then
  # shellcheck disable=SC2086 # names are words
  given_models $names >"$work/models"
  while read -r model; do set -- "$@" "$model"; done <"$work/models"
else
  command="$command$(for model in "$@"; do printf ' %s' "$(basename "$model")"; done)"
fi
mkdir -p "$out"
page=$out/README.md.part
rows=$work/rows
paper=$top/graphs/paper
: >"$rows"

qmat_run() {
  "$build/qmat" run "$@" --cache "$work/cache" --quiet --progress off
}

# note_used: sets used to the processor seconds of the commands so far.
note_used() {
  times >"$work/times"
  used=$(awk 'NR == 2 { split($0, t, /[ms ]+/); print 60 * (t[1] + t[3]) + t[2] + t[4] }' "$work/times")
}

# timed COMMAND...: runs it and sets seconds to its processor seconds.
timed() {
  note_used
  before=$used
  "$@"
  note_used
  seconds=$(awk -v from="$before" -v to="$used" 'BEGIN { printf "%.2f", to - from }')
}

# say WORDS...: progress, with the time.
say() {
  echo "$(date +%H:%M:%S) $*" >&2
}

# note SECTION MODEL METHOD: one row of all figures, from seconds and errors.json.
note() {
  printf '%s\t%s\t%s\t%s' "$1" "$2" "$3" "$seconds" >>"$rows"
  for key in spheres surface_to_envelope_at_least envelope_to_surface_at_least components loops voids; do
    printf '\t%s' "$(number $key "$work/errors.json")" >>"$rows"
  done
  echo >>"$rows"
  say "$1: $2: $3: $seconds s"
}

# initial MODEL METHOD GRAPH SETTING...: times one initial medial mesh. `errors.json` and `medial.ma` are its own.
initial() {
  model=$1 method=$2 graph=$paper/$3
  shift 3
  set -- "$graph" --set "model=$model" "$@"
  case $method in
    VC) qmat_run "$@" --to model ;;
    *) qmat_run "$@" --to samples ;;
  esac
  case $method in
    ours) timed qmat_run "$@" --to initial --force ;; # thickness and samples are part of the method
    *) timed qmat_run "$@" --to initial ;;
  esac
  qmat_run "$@" -o "report=$work/errors.json" -o "medial=$work/medial.ma"
}

# simplified MODEL SETTING...: times one simplification.
simplified() {
  model=$1
  shift
  set -- "$paper/simplified.yaml" --set "model=$model" "$@"
  qmat_run "$@" --to initial
  timed qmat_run "$@" --to simple --report "$work/run.json"
  qmat_run "$@" -o "report=$work/errors.json" -o "medial=$work/medial.ma"
}

# draw FILE TITLE: medial.ma seen along the axis of its least extent.
draw() {
  awk -v title="$2" -f "$top/tests/bench/medial_svg.awk" "$work/medial.ma" >"$out/$1"
}

# row SECTION MODEL METHOD: its columns in Markdown: spheres, both errors, components, seconds.
row() {
  awk -F '\t' -v s="$1" -v m="$2" -v k="$3" '$1 == s && $2 == m && $3 == k {
    printf " %d | %.2f %% | %.2f %% | %d, %d, %d | %.2f |", $5, 100 * $6, 100 * $7, $8, $9, $10, $4 }' "$rows"
}

name_of() {
  basename "${1%.*}"
}

# --- table 1 and figure 8 ---

for path in "$@"; do
  name=$(name_of "$path")
  initial "$path" PC initial_pc.yaml && note initial "$name" PC
  if [ "$name" = octopus ]; then draw figure_8_pc.svg "octopus, PC"; fi
  pc=$(number spheres "$work/errors.json")
  initial "$path" SAT initial_sat.yaml && note initial "$name" SAT
  if [ "$name" = octopus ]; then draw figure_8_sat.svg "octopus, SAT"; fi
  lambda=1.5%
  if [ "$name" = octopus ]; then lambda=0.5%; fi # as in the paper
  initial "$path" VC initial_vc.yaml --set "lambda=$lambda" && note initial "$name" VC
  if [ "$name" = octopus ]; then draw figure_8_vc.svg "octopus, VC"; fi
  initial "$path" ours initial_ours.yaml && note initial "$name" ours
  simplified "$path" --set epsilon=0 --set on_exceed=stop --set "vertices=$pc" \
    --set errors.epsilon=5% && note initial "$name" "ours, as many as PC"
  if [ "$name" = octopus ]; then draw figure_8_ours.svg "octopus, ours with as many spheres as PC"; fi
done

# --- figure 3: a thin sheet ---

"$build/qmat_models" sheet --resolution 24 -o "$work/sheet.off" >"$work/said"
initial "$work/sheet.off" PC initial_pc.yaml && note sheet sheet PC
draw figure_3_pc.svg "sheet, PC of its vertices"
initial "$work/sheet.off" "PC, denser" initial_pc.yaml --set spacing=1.8% && note sheet sheet "PC, denser"
draw figure_3_pc_dense.svg "sheet, PC of many more samples"
initial "$work/sheet.off" ours initial_ours.yaml && note sheet sheet ours
draw figure_3_ours.svg "sheet, ours"

# --- figure 4 ---

say "figure 4"
for theta in 0 0.2 0.4 0.5 0.6 0.8 1; do
  qmat_run "$top/tests/bench/theta.yaml" --set "model=$1" --set "theta=$theta" --set errors.epsilon=1% \
    -o "report=$work/errors.json"
  echo "| $theta | $(number spheres "$work/errors.json") | $(percent 3 "$(number surface_to_envelope "$work/errors.json")") |" \
    "$(percent 4 "$(number surface_to_envelope_mean "$work/errors.json")") |"
done >"$work/theta.md"

# --- table 2, figures 7, 9 and 10, and the curves ---

shown=0
: >"$work/table_2.md"
for path in "$@"; do
  if [ $((shown += 1)) -gt "$first_models" ]; then break; fi
  name=$(name_of "$path")
  hem="--set error=one_sided --set on_exceed=stop --set epsilon=1%"
  # shellcheck disable=SC2086 # words
  simplified "$path" $hem --set cost=hausdorff && note hem "$name" HEM
  hem_seconds=$seconds hem_spheres=$(number spheres "$work/errors.json")
  # shellcheck disable=SC2086 # words
  simplified "$path" $hem && note hem "$name" "paper's rules"
  echo "| $name ($(number initial_spheres "$work/run.json")) | $hem_seconds s / $hem_spheres |" \
    "$seconds s / $(number spheres "$work/errors.json") |" \
    "$(awk -v a="$hem_seconds" -v b="$seconds" 'BEGIN { printf "%.1f", a / b }') |" >>"$work/table_2.md"
  simplified "$path" --set rules=qmat --set vertices=100 && note simplified "$name" "Q-MAT, 100"
  draw "figure_9_${name}_qmat.svg" "$name, Q-MAT with 100 spheres"
  simplified "$path" --set epsilon=1% && note simplified "$name" "ours, 1 %"
  draw "figure_9_${name}_ours.svg" "$name, ours at 1 %"
  simplified "$path" --set epsilon=1% --set protect=always && note simplified "$name" "ours, 1 %, tubes protected"
  draw "figure_7_$name.svg" "$name, ours at 1 %, tubular features protected"
  for vertices in 20 50 100 200 500; do
    for method in ours "Q-MAT" PMAT PC SAT VC; do
      graph=$top/tests/bench/curve.yaml
      setting=chain.on_exceed=raise
      case $method in
        Q-MAT) setting=chain.compat=qmat ;;
        PMAT) setting=chain.cost=pmat ;;
        PC) graph=$paper/curve_pc.yaml ;;
        SAT) graph=$paper/curve_sat.yaml ;;
        VC) graph=$paper/curve_vc.yaml ;;
      esac
      seconds=0
      qmat_run "$graph" --set "model=$path" --set "vertices=$vertices" --set "$setting" -o "report=$work/errors.json"
      note curve "$name" "$method"
    done
  done
done
if [ $first_models -gt 0 ]; then
  awk -F '\t' 'BEGIN { OFS = "\t" } $1 == "curve" { print $2, $3, $5, $6, $7 }' "$rows" |
    awk -f "$top/tests/bench/curve.awk" >"$out/curves.svg"
fi

# --- the page ---

# simplified_sections: what the first models are simplified for.
simplified_sections() {
  echo
  echo "## Table 2: HEM"
  echo
  echo "The paper: Glasses 39.9 s / 42 and 3.8 s / 27; Ant 100.9 s / 75 and 9.7 s / 66; Chair 287.7 s / 83 and 14.1 s / 61;"
  echo "Hand 429.8 s / 64 and 20.6 s / 59; Table 568.7 s / 120 and 20.0 s / 112: ratios of 10.4 to 28.4."
  echo
  echo "| model (initial spheres) | HEM | the paper's rules | ratio of time |"
  echo "| --- | ---: | ---: | ---: |"
  cat "$work/table_2.md"
  echo
  echo "## Figures 7, 9 and 10: Q-MAT by count, ours by error"
  echo
  echo "| model | method | $columns"
  echo "| --- | --- | ---: | ---: | ---: | ---: | ---: |"
  awk -F '\t' '$1 == "simplified" {
    printf "| %s | %s | %d | %.2f %% | %.2f %% | %d, %d, %d | %.2f |\n", $2, $3, $5, 100 * $6, 100 * $7, $8, $9, $10, $4 }' "$rows"
  for picture in "$out"/figure_7_* "$out"/figure_9_*; do
    echo
    echo "![$(basename "$picture" .svg)]($(basename "$picture"))"
  done
  echo
  echo "## Error against count"
  echo
  echo "Each curve is one chain of collapses of an initial medial mesh: that of Q-MAT+ by three rules, and those of PC, SAT"
  echo "and VC (depth 7, lambda 0.5 %) by ours."
  echo
  echo "![Error against count](curves.svg)"
}

awk -F '\t' 'BEGIN { print "["; split("section model method seconds spheres surface_to_envelope envelope_to_surface components loops voids", key, " ") }
  {
    line = ""
    for (i = 1; i <= NF; i++) line = line sprintf("%s\"%s\": %s", (i > 1 ? ", " : ""), key[i], (i < 4 ? "\"" $i "\"" : $i + 0))
    printf "%s  {%s}", (NR > 1 ? ",\n" : ""), line
  }
  END { print "\n]" }' "$rows" >"$out/paper.json"

columns="spheres | surface to envelope | envelope to surface | components, loops, voids | s |"
{
  echo "# The paper's comparisons"
  echo
  echo "Made by \`$command\` on $(date -u +%Y-%m-%d), on a machine with $(nproc) processors" \
    "($(awk -F ': ' '/^model name/ { print $2; exit }' /proc/cpuinfo)). [paper.json](paper.json) has all figures."
  echo
  echo "PC is \`medial.poles\`, SAT \`medial.scale_axis\`, VC \`medial.voxel_cores\`, with the paper's settings; HEM, PMAT and Q-MAT"
  echo "are costs and rules of \`medial.simplify\`. The graphs are in [graphs/paper](../../../graphs/paper)."
  echo "Errors are distances that some point attains, as shares of the diagonal. Seconds are processor seconds of the"
  echo "method alone; those of our initial medial meshes include reading, thickness and samples. The paper's models are not ours, so its numbers are a frame"
  echo "and not a target."
  echo
  echo "## Table 1 and figure 8: initial medial meshes"
  echo
  echo "The paper, in seconds on an i5 at 3.2 GHz (vertices of the model):"
  echo
  echo "| model | PC | SAT | VC | Q-MAT+ |"
  echo "| --- | ---: | ---: | ---: | ---: |"
  echo "| Airplane (5,631) | 3.0 | 52.5 | 7.0 | 3.7 |"
  echo "| Cat (7,207) | 3.2 | 67.5 | 50.7 | 6.5 |"
  echo "| Fish (6,833) | 3.8 | 92.9 | 11.7 | 5.0 |"
  echo "| Octopus (1,343) | 1.3 | 62.0 | 17.1 | 1.8 |"
  echo
  echo "Here, with what the paper left out:"
  echo
  echo "| model | method | $columns"
  echo "| --- | --- | ---: | ---: | ---: | ---: | ---: |"
  for path in "$@"; do
    for method in PC SAT VC ours "ours, as many as PC"; do
      echo "| $(name_of "$path") | $method |$(row initial "$(name_of "$path")" "$method")"
    done
  done
  echo
  awk -F '\t' '$1 == "initial" { s[$2, $3] = $4; e[$2, $3] = $6 > $7 ? $6 : $7; if ($3 == "PC") name[++n] = $2 }
    END {
      for (i = 1; i <= n; i++) {
        m = name[i]
        order += (s[m, "PC"] < s[m, "ours"]) && (s[m, "ours"] < s[m, "VC"]) && (s[m, "VC"] < s[m, "SAT"])
        slower += (s[m, "ours"] < s[m, "VC"])
        pc += (e[m, "ours"] < e[m, "PC"])
        sat += (e[m, "ours"] < e[m, "SAT"])
        vc += (e[m, "ours"] < e[m, "VC"])
      }
      printf "The paper'"'"'s order in time, PC before ours before VC before SAT, holds for %d of %d models, ours before VC for %d. The", order, n, slower
      printf " larger of the two errors is smaller with ours than with PC for %d, with SAT for %d, with VC for %d; the paper has all.\n", pc, sat, vc
    }' "$rows"
  echo
  echo "The order in time differs from the paper's since the methods are made anew. PC and SAT share our triangulation,"
  echo "which is quicker than that of the public programs. SAT takes its balls from poles instead of converting the mesh, so that"
  echo "it is no longer the slowest. VC triangulates lattice points with 64-bit integers, which decide cospherical points at once;"
  echo "its seconds include the voxelisation, which the paper leaves out. Of the public PC only seconds are known: 1.2 for"
  echo "5,002 points, 2.6 for 8,640, 2.1 for 10,141; no count of spheres."
  echo
  echo "SAT leaves components in limbs that are thinner than the spacing of the samples: few poles are inside there, and the"
  echo "medial axis of a union of balls has the components of the union. Of the 69 on the octopus, 68 have at most 11 spheres and"
  echo "radii of at most 0.35 % of the diagonal, at a spacing of 1 %; at a spacing of 0.25 % their radii are at most 0.15 %."
  echo "That is the method: the paper says that it \"could not guarantee the connections for thin features\"."
  for picture in figure_8_pc figure_8_sat figure_8_vc figure_8_ours; do
    if [ -e "$out/$picture.svg" ]; then
      echo
      echo "![$picture]($picture.svg)"
    fi
  done
  echo
  echo "## Figure 3: a thin sheet"
  echo
  echo "| method | $columns"
  echo "| --- | ---: | ---: | ---: | ---: | ---: |"
  for method in PC "PC, denser" ours; do echo "| $method |$(row sheet sheet "$method")"; done
  for picture in figure_3_pc figure_3_pc_dense figure_3_ours; do
    echo
    echo "![$picture]($picture.svg)"
  done
  echo
  echo "## Figure 4: theta"
  echo
  echo "Of $(name_of "$1"), with the paper's samples and incentres alone. The paper shows it for models that are not ours."
  echo
  echo "| theta | spheres | surface to envelope, at most | mean |"
  echo "| ---: | ---: | ---: | ---: |"
  cat "$work/theta.md"
  if [ $first_models -gt 0 ]; then simplified_sections; fi
} >"$page"
mv "$page" "$out/README.md"
