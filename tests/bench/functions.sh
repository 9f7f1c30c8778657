# SPDX-License-Identifier: GPL-3.0-or-later
# What the scripts of this folder share; they source it. QMAT_BUILD is the build folder, by default build/release.
top=$(cd "$(dirname "$0")/../.." && pwd)
build=${QMAT_BUILD:-$top/build/release}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# given_models NAME...: of each name the model of ../shared/data/surfaces, or a generated one that stands in for it; a
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
      octopus) stand_in=octopus ;;
      plane) stand_in=sheet ;;
      *) stand_in=l-bracket ;;
    esac
    "$build/qmat_models" "$stand_in" -o "$work/$stand_in.off"
    echo "$work/$stand_in.off"
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
