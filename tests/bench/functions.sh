# SPDX-License-Identifier: GPL-3.0-or-later
# What the scripts of this folder share. A script sources it after setting
#   options          its options and flags, in any order, before and after models: "--name" takes a value and sets $name to
#                    it, "--name!" sets $name to yes, "-o" sets $out. Any other option ends it (unset: all arguments stay)
#   default_models   the models that it measures when none is named (unset: it chooses them itself)
# and then has the models as its arguments, and the options that were given, but for flags and -o, as $taken.
# QMAT_BUILD is the build folder, by default build/release.
LC_ALL=C.UTF-8 # awk writes decimal points
export LC_ALL
top=$(cd "$(dirname "$0")/../.." && pwd)
build=${QMAT_BUILD:-$top/build/release}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM

# refuse WORDS...: ends the script, which cannot do what it was asked for.
refuse() {
  echo "$(basename "$0"): $*" >&2
  exit 2
}

# need PROGRAM PACKAGE: ends the script where the program is missing.
need() {
  command -v "$1" >/dev/null || refuse "there is no $1 (Debian: apt install $2)"
}

# need_built TARGET: the same for a program of the build folder.
need_built() {
  [ -x "$build/$1" ] || refuse "there is no $build/$1: cmake -DQMAT_TESTS=ON $build && cmake --build $build --target $1"
}

# given_models NAME...: the path of each model in ../shared/data/surfaces, or of a generated model that replaces it; a
# path a line, none twice.
given_models() {
  for name in "$@"; do
    for path in "$top/../shared/data/surfaces/$name".*; do
      if [ -e "$path" ]; then
        echo "$path"
        continue 2
      fi
    done
    case $name in
      octopus) generated=octopus ;;
      plane) generated=sheet ;;
      *) generated=l-bracket ;;
    esac
    "$build/qmat_models" "$generated" -o "$work/$generated.off"
    echo "$work/$generated.off"
  done >"$work/given"
  awk '!seen[$0]++' "$work/given"
}

# number KEY FILE: the last number of that name in a JSON file.
number() {
  tr ',{}' '\n\n\n' <"$2" | awk -F: -v key="\"$1\"" '{ gsub(/ /, "", $1) } $1 == key { x = $2 } END { print x + 0 }'
}

# percent DIGITS X
percent() {
  awk -v digits="$1" -v x="$2" 'BEGIN { printf "%.*f %%", digits, 100 * x }'
}

# name_of PATH: the name of a model.
name_of() {
  basename "${1%.*}"
}

# say WORDS...: progress, with the time.
say() {
  echo "$(date +%H:%M:%S) $*" >&2
}

# qmat_run ARGUMENT...: `qmat run` with the cache of this script.
qmat_run() {
  "$build/qmat" run "$@" --cache "$work/cache" --quiet --progress off
}

# note_used: sets used to the processor seconds of the commands so far.
note_used() {
  times >"$work/times"
  used=$(awk 'NR == 2 { split($0, t, /[ms ]+/); print 60 * (t[1] + t[3]) + t[2] + t[4] }' "$work/times")
}

# timed COMMAND...: runs it and sets seconds to its processor seconds, those of all threads. Fails where it is ended since
# it takes more than $limit of them (unset: it may take any).
timed() {
  note_used
  before=$used
  status=0
  (ulimit -t "${limit:-unlimited}" && "$@") || status=$?
  note_used
  seconds=$(awk -v from="$before" -v to="$used" 'BEGIN { printf "%.2f", to - from }')
  if [ "$status" -eq 0 ]; then return 0; fi
  if [ "$status" -lt 128 ] || awk -v s="$seconds" -v l="${limit:-1e9}" 'BEGIN { exit (s >= 0.8 * l) }'; then
    say "exit $status: $*"
    exit 1
  fi
  return 1
}

# --- rows of figures: a row has a section, a model, a method and what row_keys names, with tabs between them ---

row_keys="section model method seconds spheres surface_to_envelope envelope_to_surface components loops voids \
components_of_solid loops_of_solid voids_of_solid"

# note SECTION MODEL METHOD [late]: adds a row to the file $rows: seconds, and the rest from errors.json. A row of a method
# that was ended has the limit and nothing else.
note() {
  if [ "${4:-}" = late ]; then
    printf '%s\t%s\t%s\t>%s\t-\t-\t-\t-\t-\t-\t-\t-\t-\n' "$1" "$2" "$3" "$limit" >>"$rows"
    say "$1: $2: $3: more than $limit s"
    return
  fi
  printf '%s\t%s\t%s\t%s' "$1" "$2" "$3" "$seconds" >>"$rows"
  for key in spheres surface_to_envelope_at_least envelope_to_surface_at_least components loops voids \
    components_of_solid loops_of_solid voids_of_solid; do
    printf '\t%s' "$(number $key "$work/errors.json")" >>"$rows"
  done
  echo >>"$rows"
  say "$1: $2: $3: $seconds s, $(number spheres "$work/errors.json") spheres"
}

# rows_to_json: rows as JSON, an object a line. A method that was ended has "more_than_seconds" and nothing else.
rows_to_json() {
  awk -F '\t' -v keys="$row_keys" 'BEGIN { n = split(keys, key, " "); print "[" }
    {
      late = $4 ~ /^>/
      line = ""
      for (i = 1; i <= (late ? 4 : n); i++)
        line = line sprintf("%s\"%s\": %s", i > 1 ? ", " : "", late && i == 4 ? "more_than_seconds" : key[i],
          i < 4 ? "\"" $i "\"" : late ? substr($i, 2) : $i + 0)
      printf "%s  {%s}", (NR > 1 ? ",\n" : ""), line
    }
    END { print "\n]" }'
}

# json_to_rows: the reverse.
json_to_rows() {
  awk '/^  {/ {
      gsub(/^  {|},?$/, "")
      late = /"more_than_seconds"/
      n = split($0, part, /(^|, )"[a-z_]+": /)
      line = ""
      for (i = 2; i <= n; i++) {
        gsub(/"/, "", part[i])
        line = line (i > 2 ? "\t" : "") (late && i == 5 ? ">" : "") part[i]
      }
      print line (late ? "\t-\t-\t-\t-\t-\t-\t-\t-\t-" : "")
    }'
}

# markdown_rows SECTION: its rows as lines of a table: model, method, spheres, both errors, Betti numbers, seconds.
markdown_columns="| model | method | spheres | surface to envelope | envelope to surface | components, loops, voids | s |"
markdown_rows() {
  echo "$markdown_columns"
  echo "| --- | --- | ---: | ---: | ---: | ---: | ---: |"
  awk -F '\t' -v s="$1" '$1 != s { next }
    $4 ~ /^>/ { printf "| %s | %s | | | | | more than %s |\n", $2, $3, substr($4, 2); next }
    { printf "| %s | %s | %d | %.2f %% | %.2f %% | %d, %d, %d | %.2f |\n", $2, $3, $5, 100 * $6, 100 * $7, $8, $9, $10, $4 }'
}

started=$(date +%s)
used=0

# made_by COMMAND: how, when and where a page was made. The processor time is that of all timed commands.
made_by() {
  echo "Made by \`$1\` on $(date -u +%Y-%m-%d), on a machine with $(nproc) processors" \
    "($(awk -F ': ' '/^model name/ { print $2; exit }' /proc/cpuinfo), $(awk '/^MemTotal/ { printf "%.0f GB", $2 / 1e6 }' /proc/meminfo))" \
    "with a load of $(cut -d ' ' -f 1 /proc/loadavg). It took $(awk -v s="$used" 'BEGIN { printf "%.0f", s / 60 }') minutes of" \
    "processor time, $((($(date +%s) - started + 59) / 60)) by the clock. The machine may be shared, so all seconds are" \
    "processor seconds, summed over threads."
}

taken=
if [ -n "${options+set}" ]; then
  left=$#
  while [ "$left" -gt 0 ]; do
    left=$((left - 1))
    case $1 in
      -?*) ;;
      *)
        set -- "$@" "$1"
        shift
        continue
        ;;
    esac
    variable=${1#--}
    if [ "$1" = -o ]; then variable=out; fi
    case " $options " in
      *" $1! "*) eval "$variable=yes" ;;
      *" $1 "*)
        [ "$left" -gt 0 ] || refuse "$1 needs a value"
        if [ "$1" != -o ]; then taken="$taken $1 $(basename -- "$2")"; fi
        eval "$variable=\$2"
        left=$((left - 1))
        shift
        ;;
      *) refuse "$1 is no option" ;;
    esac
    shift
  done
fi
if [ -n "${default_models:-}" ] && [ $# -eq 0 ]; then
  # shellcheck disable=SC2086 # names are words
  given_models $default_models >"$work/models"
  while read -r model; do set -- "$@" "$model"; done <"$work/models"
fi
