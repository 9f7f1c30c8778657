# SPDX-License-Identifier: GPL-3.0-or-later
# What the shell tests share: a working folder, counted failures, and a small model. Sourced first; a test that has
# something to stop defines clean_up, which runs before the folder is removed. The last line of a test is `finish`.
LC_ALL=C.UTF-8 # awk writes decimal points, and the program may write any character
export LC_ALL
work=$(mktemp -d) || exit 1
clean_up() { :; }
trap 'clean_up; rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM # dash runs no EXIT trap after a signal
cd "$work" || exit 1
: >out.txt
: >err.txt
failures=0

# fail WHAT: counts a failure, and shows what the last program printed.
fail() {
  echo "FAILED: $*"
  cat out.txt err.txt
  failures=$((failures + 1))
}

# die WHAT: the same where the test cannot continue.
die() {
  fail "$@"
  exit 1
}

# holds WHAT COMMAND...: the command must succeed.
holds() {
  what=$1
  shift
  if ! "$@"; then fail "$what"; fi
}

# expect CODE TEXT COMMAND...: the exit code, and a text on either output ("" for any).
expect() {
  code=$1
  text=$2
  shift 2
  "$@" >out.txt 2>err.txt
  got=$?
  if [ "$got" -ne "$code" ]; then
    fail "exit $got, not $code: $*"
  elif [ -n "$text" ] && ! cat out.txt err.txt | grep -qF -e "$text"; then
    fail "no '$text': $*"
  fi
}

# is_taken PORT: whether anybody listens on that port of this machine, on any of its addresses.
is_taken() {
  cat /proc/net/tcp /proc/net/tcp6 2>/dev/null | grep -q "$(printf '^ *[0-9]*: [0-9A-F]*:%04X 0*:0000 0A ' "$1")"
}

finish() {
  if [ $failures -ne 0 ]; then echo "$failures failed"; fi
  [ $failures -eq 0 ]
  exit
}

# write_box FILE [WIDTH]: a box of quads, WIDTH (2) x 1 x 1.
write_box() {
  cat >"$1" <<END
OFF
8 6 0
0 0 0
${2:-2} 0 0
${2:-2} 1 0
0 1 0
0 0 1
${2:-2} 0 1
${2:-2} 1 1
0 1 1
4 0 3 2 1
4 4 5 6 7
4 0 1 5 4
4 1 2 6 5
4 2 3 7 6
4 3 0 4 7
END
}

# write_graph FILE SPACING [MODEL]: the shipped graph up to the initial medial mesh. Runs take no time.
write_graph() {
  cat >"$1" <<END
qmat: 1
nodes:
  model:     { type: scene.read${3:+, params: { path: $3 \}} }
  thickness: { type: mesh.sdf, in: { mesh: model.mesh } }
  samples:   { type: mesh.sample, params: { spacing: $2 }, in: { mesh: model.mesh, thickness: thickness.thickness } }
  initial:   { type: medial.delaunay, in: { mesh: model.mesh, thickness: thickness.thickness, samples: samples.samples } }
  asset:     { type: scene.write, in: { scene: model.scene, medial: initial.medial } }
inputs: { model: model.path, spacing: samples.spacing }
outputs: { asset: asset.file }
END
}
