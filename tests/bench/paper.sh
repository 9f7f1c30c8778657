#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The comparisons of the paper's section 4, ours beside them, as one page:
#   paper.sh [-o FOLDER] [--models LIST] [--shown N] [--limit SECONDS] [MODEL...]
# The default folder is tests/bench/paper. LIST is names of models of ../shared/data/surfaces with commas between them;
# without it and MODEL they are all taken, or generated ones.
# Writes README.md, SVG pictures and paper.json into the folder: initial medial meshes of each model (table 1, figures 3, 4
# and 8), simplifications of the first N (table 2, figures 7, 9 and 10; default 3). Seconds are processor seconds of a
# method alone: what it starts from comes from the cache. A method that takes more than SECONDS of them (default 120) is
# ended, and its cell says so. QMAT_BUILD is the build folder, by default build/release. field.sh compares more models.
set -eu
out=
models=ant,plane,octopus,spot,knight,bug,chair,fandisk,homer,pinion,fertility
shown=3
limit=120
options="-o --models --shown --limit"
. "$(dirname "$0")/functions.sh"
out=${out:-$top/tests/bench/paper}
command="sh tests/bench/paper.sh$taken"
if [ $# -eq 0 ]; then
  # shellcheck disable=SC2046 # names are words
  given_models $(echo "$models" | tr , ' ') >"$work/models"
  while read -r model; do set -- "$@" "$model"; done <"$work/models"
else
  command="$command$(for model in "$@"; do printf ' %s' "$(basename "$model")"; done)"
fi
mkdir -p "$out"
page=$out/README.md.part
rows=$work/rows
paper=$top/graphs/paper
: >"$rows"
: >"$work/pc.md"
: >"$work/table_2.md"

# evaluated ARGUMENT...: writes errors.json and medial.ma, and keeps the seconds of the method.
evaluated() {
  of_method=$seconds
  timed qmat_run "$@" -o "report=$work/errors.json" -o "medial=$work/medial.ma" || return 1
  seconds=$of_method
}

# initial SECTION NAME METHOD MODEL GRAPH SETTING...: times one initial medial mesh and notes it. `errors.json`, `run.json`
# and `medial.ma` are its own. Fails where it takes too long.
initial() {
  section=$1 name=$2 method=$3 model=$4 graph=$paper/$5
  shift 5
  set -- "$graph" --set "model=$model" "$@"
  case $method in
    VC) qmat_run "$@" --to model ;;
    *) qmat_run "$@" --to samples ;;
  esac
  case $method in
    ours) force=--force ;; # thickness and samples are part of the method
    *) force=--force=initial ;;
  esac
  if timed qmat_run "$@" --to initial "$force" --report "$work/run.json" && evaluated "$@"; then
    note "$section" "$name" "$method"
  else
    note "$section" "$name" "$method" late
    return 1
  fi
}

# simplified SECTION NAME METHOD MODEL SETTING...: the same of a simplification.
simplified() {
  section=$1 name=$2 method=$3 model=$4
  shift 4
  set -- "$paper/simplified.yaml" --set "model=$model" "$@"
  qmat_run "$@" --to initial
  if timed qmat_run "$@" --to simple --force=simple --report "$work/run.json" && evaluated "$@"; then
    note "$section" "$name" "$method"
  else
    note "$section" "$name" "$method" late
    return 1
  fi
}

# draw FILE TITLE: medial.ma seen along the axis of its least extent.
draw() {
  awk -v title="$2" -f "$top/tests/bench/medial_svg.awk" "$work/medial.ma" >"$out/$1"
}

# --- table 1 and figure 8 ---

for path in "$@"; do
  name=$(name_of "$path")
  pc=0
  if initial initial "$name" PC "$path" initial_pc.yaml; then
    pc=$(number spheres "$work/errors.json")
    echo "| $name | $(number samples_triangulated "$work/run.json") | $(number poles "$work/run.json") |" \
      "$(number inner_poles "$work/run.json") | $pc | $seconds |" >>"$work/pc.md"
    if [ "$name" = octopus ]; then draw figure_8_pc.svg "octopus, PC"; fi
  fi
  if initial initial "$name" SAT "$path" initial_sat.yaml && [ "$name" = octopus ]; then
    draw figure_8_sat.svg "octopus, SAT"
  fi
  lambda=1.5%
  if [ "$name" = octopus ]; then lambda=0.5%; fi # as in the paper
  if initial initial "$name" VC "$path" initial_vc.yaml --set "lambda=$lambda" && [ "$name" = octopus ]; then
    draw figure_8_vc.svg "octopus, VC"
  fi
  initial initial "$name" ours "$path" initial_ours.yaml || true
  if simplified initial "$name" "ours, as many as PC" "$path" --set epsilon=0 --set on_exceed=stop \
    --set "vertices=$pc" --set errors.epsilon=5% && [ "$name" = octopus ]; then
    draw figure_8_ours.svg "octopus, ours with as many spheres as PC"
  fi
done

# --- figure 3: a thin sheet ---

"$build/qmat_models" sheet --resolution 24 -o "$work/sheet.off" >"$work/said"
initial sheet sheet PC "$work/sheet.off" initial_pc.yaml
draw figure_3_pc.svg "sheet, PC of its vertices"
initial sheet sheet "PC, denser" "$work/sheet.off" initial_pc.yaml --set spacing=1.8%
draw figure_3_pc_dense.svg "sheet, PC of many more samples"
initial sheet sheet ours "$work/sheet.off" initial_ours.yaml
draw figure_3_ours.svg "sheet, ours"

# --- figure 4 ---

say "figure 4"
for theta in 0 0.2 0.4 0.5 0.6 0.8 1; do
  if timed qmat_run "$top/tests/bench/theta.yaml" --set "model=$1" --set "theta=$theta" --set errors.epsilon=1% \
    -o "report=$work/errors.json"; then
    echo "| $theta | $(number spheres "$work/errors.json") | $(percent 3 "$(number surface_to_envelope "$work/errors.json")") |" \
      "$(percent 4 "$(number surface_to_envelope_mean "$work/errors.json")") |"
  else
    echo "| $theta | more than $limit s | | |"
  fi
done >"$work/theta.md"

# --- table 2, figures 7, 9 and 10 ---

# hem_cell FAILED: "SECONDS / SPHERES" of the last simplification, or what it took at least.
hem_cell() {
  if [ "${1:-}" = late ]; then
    echo "more than $limit s"
  else
    echo "$seconds s / $(number spheres "$work/errors.json")"
  fi
}

count=0
rm -f "$out"/figure_7_* "$out"/figure_9_* "$out"/figure_10_*
for path in "$@"; do
  if [ $((count += 1)) -gt "$shown" ]; then break; fi
  name=$(name_of "$path")
  papers="--set error=one_sided --set on_exceed=stop --set epsilon=1% --set finest=1%"
  late=
  # shellcheck disable=SC2086 # words
  simplified hem "$name" HEM "$path" $papers --set cost=hausdorff || late=late
  hem=$(hem_cell "$late") hem_seconds=$seconds
  # shellcheck disable=SC2086 # words
  simplified hem "$name" "paper's rules" "$path" $papers
  echo "| $name ($(number initial_spheres "$work/run.json")) | $hem | $(hem_cell) |" \
    "$(awk -v a="$hem_seconds" -v b="$seconds" -v late="$late" 'BEGIN {
      printf "%s%.0f", (late == "" ? "" : "more than "), a / b }') |" >>"$work/table_2.md"
  simplified simplified "$name" "Q-MAT, 100 spheres" "$path" --set rules=qmat --set vertices=100
  draw "figure_9_${name}_qmat.svg" "$name, Q-MAT"
  simplified simplified "$name" "ours, 1 %" "$path" --set epsilon=1%
  draw "figure_9_${name}_ours.svg" "$name, ours at 1 %"
  simplified simplified "$name" "ours, 100 spheres, tubes protected" "$path" --set epsilon=0 --set on_exceed=stop \
    --set vertices=100 --set protect=always
  draw "figure_10_${name}_ours.svg" "$name, ours with tubes protected"
  echo "| $name | $(number refused_by_protection "$work/run.json") |" >>"$work/figure_7.md"
  simplified simplified "$name" "ours, 2 %, tubes protected" "$path" --set epsilon=2% --set protect=always
  draw "figure_7_${name}.svg" "$name, ours at 2 %, tubes protected"
done

# --- the page ---

# pictures FIGURE: links to its pictures.
pictures() {
  for picture in "$out/$1"_*.svg; do
    echo
    echo "![$(basename "$picture" .svg | tr _ ' ')]($(basename "$picture"))"
  done
}

rows_to_json <"$rows" >"$out/paper.json"
{
  echo "# The paper's comparisons"
  echo
  made_by "$command" | fold -s -w 118 | sed 's/ *$//'
  cat <<END_OF_PART

[paper.json](paper.json) has all figures. PC is \`medial.poles\`, SAT \`medial.scale_axis\`, VC \`medial.voxel_cores\`, with
the paper's settings; HEM and Q-MAT are a cost and rules of \`medial.simplify\`. The graphs are in
[graphs/paper](../../../graphs/paper). An error is a distance that some point attains, as a share of the diagonal.
Seconds are those of the method alone; those of our initial medial meshes include reading, thickness and samples. A
method that takes more than $limit s is ended. The paper's models are not ours, so its numbers are a frame and not a
target. [The field's benchmark](../field/README.md) compares the methods on more models by error and count.

## Table 1 and figure 8: initial medial meshes

The paper, in seconds on an i5 at 3.2 GHz (vertices of the model):

| model | PC | SAT | VC | Q-MAT+ |
| --- | ---: | ---: | ---: | ---: |
| Airplane (5,631) | 3.0 | 52.5 | 7.0 | 3.7 |
| Cat (7,207) | 3.2 | 67.5 | 50.7 | 6.5 |
| Fish (6,833) | 3.8 | 92.9 | 11.7 | 5.0 |
| Octopus (1,343) | 1.3 | 62.0 | 17.1 | 1.8 |

Here, with what the paper left out:

END_OF_PART
  markdown_rows initial <"$rows"
  echo
  echo "The paper's order in time is PC, ours, VC, SAT; its order in error puts ours first. Here:"
  echo
  awk -F '\t' '$1 == "initial" {
      late = $4 ~ /^>/
      s[$2, $3] = late ? 1e9 : $4 + 0
      e[$2, $3] = late ? 1e9 : $6 > $7 ? $6 : $7
      if ($3 == "PC") name[++n] = $2
    }
    function quicker(a, b,    i, k) { for (i = 1; i <= n; i++) k += s[name[i], a] < s[name[i], b]; return k + 0 }
    function nearer(a, b,    i, k, which) {
      for (i = 1; i <= n; i++)
        if (e[name[i], a] < e[name[i], b]) k++; else which = which (which == "" ? "" : ", ") name[i]
      return (k + 0) (which == "" ? "" : ", not " which)
    }
    END {
      print "| of " n " models | quicker, as in the paper |\n| --- | --- |"
      print "| PC before ours | " quicker("PC", "ours") " |"
      print "| ours before VC | " quicker("ours", "VC") " |"
      print "| ours before SAT | " quicker("ours", "SAT") " |"
      print "| VC before SAT | " quicker("VC", "SAT") " |\n"
      print "| of " n " models | smaller larger error, as in the paper |\n| --- | --- |"
      print "| ours before PC | " nearer("ours", "PC") " |"
      print "| ours before SAT | " nearer("ours", "SAT") " |"
      print "| ours before VC | " nearer("ours", "VC") " |"
      print "| ours with as many spheres as PC before PC | " nearer("ours, as many as PC", "PC") " |"
    }' "$rows"
  cat <<END_OF_PART

Why the order in time is another one where it is:

- PC and ours both triangulate once. PC has the vertices of the model alone and no test of what is inside; ours has as many
  samples as thin parts need, and measures the thickness. Where a model needs few more samples, both take the same time.
- The paper says that its SAT spends much time on converting the mesh into a union of balls. \`medial.scale_axis\` takes its
  balls from the poles of the samples, and CGAL's regular triangulation of them is quick. So SAT comes before VC.
- VC triangulates the centres of all boundary voxels, many more points than the model has vertices. Lattice points are
  decided with 64-bit integers, so that it takes seconds. Its seconds include the voxelisation, which the paper leaves out.

Why the order in error is another one where it is: PC's spheres are the poles of all vertices. On a model whose vertices are
dense everywhere (plane) they describe the surface to a small part of a per cent. With thin parts and few vertices (octopus,
knight) PC and SAT lose whole parts.

SAT leaves components in limbs that are thinner than the spacing of the samples: few poles are inside there, and the
medial axis of a union of balls has the components of the union. Of the 69 on the octopus, 68 have at most 11 spheres and
radii of at most 0.35 % of the diagonal, at a spacing of 1 %; at a spacing of 0.25 % their radii are at most 0.15 %.
That is the method: the paper says that it "could not guarantee the connections for thin features".
END_OF_PART
  if [ -e "$out/figure_8_pc.svg" ]; then pictures figure_8; fi
  cat <<END_OF_PART

## PC beside the public program

The public program needs 1.2 s for 5,002 points (ant), 2.6 s for 8,640 (bug) and 2.1 s for 10,141, on two cores like these.
Its source writes a ball for each inner pole: a Voronoi vertex that is the pole of several samples counts once, and a second
pole is left out where the sampling constant says that it is too near. \`medial.poles\` has the same rules. A sample has at
most one inner pole, so the spheres are at most as many as the samples. The program itself was not at hand. A separate count
of the two poles of each vertex, with an exact inside test instead of labels, gives 4,836 inner poles for the ant, 8,423 for
the bug, 9,187 for the pinion and 9,635 for the chair.

| model | points | poles | inner poles | spheres | s |
| --- | ---: | ---: | ---: | ---: | ---: |
$(cat "$work/pc.md")

## Figure 3: a thin sheet

END_OF_PART
  markdown_rows sheet <"$rows"
  pictures figure_3
  cat <<END_OF_PART

## Figure 4: theta

Of $(name_of "$1"), with the paper's samples and incentres alone. The paper shows it for models that are not ours.

| theta | spheres | surface to envelope, at most | mean |
| ---: | ---: | ---: | ---: |
$(cat "$work/theta.md")

## Table 2: HEM

The paper: Glasses 39.9 s / 42 and 3.8 s / 27; Ant 100.9 s / 75 and 9.7 s / 66; Chair 287.7 s / 83 and 14.1 s / 61;
Hand 429.8 s / 64 and 20.6 s / 59; Table 568.7 s / 120 and 20.0 s / 112: ratios of 10.4 to 28.4. Here, with one bounded
error of 1 %, ended by the first collapse that exceeds it:

| model (initial spheres) | HEM | the paper's rules | ratio of time |
| --- | --- | --- | ---: |
$(cat "$work/table_2.md")

## Figures 7, 9 and 10: Q-MAT by count, ours by error, tubes protected

Figure 9 compares Q-MAT with 100 spheres and ours at 1 %. Figure 10 compares Q-MAT with 100 spheres and ours with as many,
with tubular features protected: protected edges do not collapse, so that more than 100 spheres may be left. Q-MAT's spheres outside of the model are in its error from the envelope to the surface.

END_OF_PART
  markdown_rows simplified <"$rows"
  pictures figure_9
  pictures figure_10
  cat <<END_OF_PART

Figure 7: the edges that are found as tubular features have no slab and are drawn in red. Collapses that protection refuses
on the way to 100 spheres:

| model | refused |
| --- | ---: |
$(cat "$work/figure_7.md")
END_OF_PART
  pictures figure_7
} >"$page"
mv "$page" "$out/README.md"
