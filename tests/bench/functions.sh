# SPDX-License-Identifier: GPL-3.0-or-later
# What the scripts of this folder share. A script sources it after setting
#   epsilon          its default, which the option --epsilon E replaces (unset: the script has no such option)
#   default_models   the models that it measures when none is named (unset: it chooses them itself)
# and then has the models as its arguments. QMAT_BUILD is the build folder, by default build/release.
top=$(cd "$(dirname "$0")/../.." && pwd)
build=${QMAT_BUILD:-$top/build/release}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

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

if [ -n "${epsilon:-}" ] && [ "${1:-}" = --epsilon ]; then
  epsilon=$2
  shift 2
fi
if [ -n "${default_models:-}" ] && [ $# -eq 0 ]; then
  # shellcheck disable=SC2086 # names are words
  given_models $default_models >"$work/models"
  while read -r model; do set -- "$@" "$model"; done <"$work/models"
fi
