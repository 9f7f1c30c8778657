#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The manual page and the completions: manual_test.sh PROGRAM
qmat=$1
. "$(dirname "$0")/../../lib.sh"
QMAT_CACHE=off
export QMAT_CACHE
mkdir bin
ln -s "$qmat" bin/qmat
PATH=$work/bin:$PATH
export PATH

# The page has every command, option and node, and the tools that read it find nothing to say.
qmat man >qmat.1 || die "qmat man"
if command -v mandoc >/dev/null; then
  mandoc -T lint -W warning qmat.1 >out.txt 2>&1
  holds "mandoc's lint" test ! -s out.txt
  mandoc -T ascii qmat.1 | sed 's/.\x08//g' >page.txt
else
  echo "skipped: mandoc (Debian: apt install mandoc)"
  sed 's/^\.S[HS] "\(.*\)"$/\1/; s/\\f[BR]//g; s/\\-/-/g' qmat.1 >page.txt
fi
if command -v groff >/dev/null && command -v man >/dev/null; then
  man --warnings -E UTF-8 -l qmat.1 2>out.txt >/dev/null
  holds "man's warnings" test ! -s out.txt
else
  echo "skipped: man's warnings (Debian: apt install man-db groff)"
fi
commands=$(qmat help | sed -n 's/^  \([a-z]*\) .*/\1/p')
holds "there are commands" test "$(echo "$commands" | wc -l)" -ge 15
for command in $commands; do
  holds "the page has qmat $command" grep -q "^ *qmat $command" page.txt
  for option in $(qmat help "$command" | sed -n 's/^  \(-., \)\{0,1\}--\([a-z-]*\).*/\2/p'); do
    [ "$option" = help ] || holds "the page has --$option of $command" grep -q -e "--$option" page.txt
  done
done
for node in $(qmat nodes | sed -n 's/^\([a-z]*\.[a-z_]*\) .*/\1/p'); do
  holds "the page has $node" grep -q "^ *$node" page.txt
done

# The scripts are scripts.
for shell in bash zsh fish; do
  qmat completion $shell >script.$shell || fail "qmat completion $shell"
  if command -v $shell >/dev/null; then
    holds "$shell reads its script" $shell -n script.$shell
  else
    echo "skipped: $shell (Debian: apt install $shell)"
  fi
done
expect 2 "did you mean 'fish'?" qmat completion fissh

# complete LINE EXPECTED: what bash makes of a line, in one line of output.
cat >complete.bash <<'END_OF_SCRIPT'
source ./script.bash
compopt() { :; }
COMP_LINE=$1 COMP_POINT=${#1}
_qmat
echo "${COMPREPLY[*]}"
END_OF_SCRIPT
complete() {
  bash complete.bash "$1" >out.txt 2>err.txt
  holds "bash: '$1' becomes '$2'" test "$(cat out.txt)" = "$2"
}
cat >mine.yaml <<'END_OF_GRAPH'
qmat: 1
nodes:
  first: { type: scene.read }
  second: { type: mesh.sdf, in: { mesh: first.mesh } }
outputs: { field: second.thickness }
END_OF_GRAPH
complete "qmat ba" "batch"
complete "qmat mat box.off --eps" "--epsilon"
complete "qmat run qmat_plus --set simple.eps" "simple.epsilon="
complete "qmat run mine.yaml --set second.ra" "second.rays="
complete "qmat mat --set=simple.on_exceed=st" "stop"
complete "qmat mat box.off --require " "none certified"
complete "qmat mat box.off --kind c" "capsules"
complete "qmat mat box.off -f us" "usda usdc usdz"
complete "qmat run qmat_plus --to th" "thickness"
complete "qmat node medial.simp" "medial.simplify"
complete "qmat run coll" "colliders"
complete "qmat mat box" "" # files
complete "qmat mat box.off -o " ""
if command -v fish >/dev/null; then
  HOME=$work fish -c 'source script.fish; complete -C "qmat run mine.yaml --set second.ra"' >out.txt 2>err.txt
  holds "fish: a node's parameter" grep -q '^second.rays=' out.txt
fi
if command -v zsh >/dev/null; then
  # What the script hands to compadd.
  cat >complete.zsh <<'END_OF_SCRIPT'
compadd() { while [[ $1 != -- ]]; do shift; done; shift; print -l -- "$@" }
compdef() { :; }
source ./script.zsh
words=(qmat run mine.yaml --set second.ra) CURRENT=5
_qmat
END_OF_SCRIPT
  zsh complete.zsh >out.txt 2>err.txt
  holds "zsh: a node's parameter" grep -q '^second.rays=$' out.txt
fi

finish
