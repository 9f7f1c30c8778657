#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Types every command of README.md, in a fresh folder with an installed qmat: readme_test.sh SOURCE_FOLDER BUILD_FOLDER
#
# - A block of commands (```sh) is typed line by line. A command that fails is a failure. A block after a comment
#   `<!-- not typed: REASON -->` is listed with its reason instead. One after `<!-- interrupted -->` has to run until it
#   is interrupted.
# - A block of Python is run, as a file.
# - Of the code within sentences, `qmat ...` is typed; where it has a placeholder in capitals, the help of its command
#   is. `--set NODE.PARAMETER=VALUE` has to be accepted by the shipped graph, and any other `--option` has to be in the
#   help of a command.
set -u
source=$1
build=$2
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM
HOME=$work/home
export HOME
unset QMAT_CACHE XDG_CACHE_HOME QMAT_REMOTE_CACHE
mkdir -p "$HOME/.local/bin" "$work/folder"
failures=0

fail() {
  echo "FAILED: $*"
  sed 's/^/  /' "$work/said.txt" 2>/dev/null | head -n 10
  failures=$((failures + 1))
}

if ! cmake --install "$build" --prefix "$HOME/.local" >"$work/said.txt" 2>&1; then
  fail "the installation"
  exit 1
fi
for file in man/man1/qmat.1 bash-completion/completions/qmat zsh/site-functions/_qmat fish/vendor_completions.d/qmat.fish; do
  [ -s "$HOME/.local/share/$file" ] || fail "$file is not installed"
done
# The commands are typed where the build is; this program is not installed.
mkdir -p "$work/folder/build"
ln -s "$build" "$work/folder/build/release"
PATH=$HOME/.local/bin:$PATH
export PATH
module=$(find "$HOME/.local" -name qmat.py)
mistakes=7 python=
for candidate in python3 /usr/bin/python3; do
  if [ -z "$python" ] && $candidate -c 'import cffi, numpy' 2>/dev/null; then mistakes=8 python=$candidate; fi
done
cd "$work/folder" || exit 1

# blocks PAGE: "LINE<tab>COMMAND" for each command to be typed, "LINE<tab># REASON" for each block that is not,
# "LINE<tab>^COMMAND" for one that has to be interrupted, and "LINE<tab>!MISTAKE". A line that ends with a backslash continues.
blocks() {
  awk '
    function say(text) { print NR "\t" text }
    /^<!-- not typed: .*-->$/ { reason = $0; gsub(/^<!-- not typed: | *-->$/, "", reason); next }
    /^<!-- interrupted -->$/ { interrupted = 1; next }
    /^```/ && !fenced {
      fenced = 1
      language = substr($0, 4)
      typed = language == "sh" && reason == ""
      python = language == "python" && reason == ""
      if (python) say("@" FILENAME)
      if (reason != "") say("# " reason)
      else if (language !~ /^(sh|c|cmake|python|nginx|yaml|json|text)$/) say("!a block of code names its language")
      reason = ""
      next
    }
    /^```$/ { fenced = interrupted = 0; next }
    fenced {
      if (typed && $0 != "") {
        if (sub(/\\$/, "")) whole = whole $0
        else { say((interrupted ? "^" : "") whole $0); whole = "" }
      }
      next
    }
    NF { reason = "" }' "$1"
}

# spans PAGE: "LINE<tab>CODE" for each piece of code within sentences.
spans() {
  awk '/^```/ { fenced = !fenced; next }
    !fenced { n = split($0, piece, "`"); for (i = 2; i <= n; i += 2) print NR "\t" piece[i] }' "$1"
}

# type_it LINE COMMAND
type_it() {
  case $2 in
    *'| dot '*)
      if ! command -v dot >/dev/null; then
        echo "skipped: $2: there is no dot (Debian: apt install graphviz)"
        return
      fi
      ;;
  esac
  if timeout 600 bash -o pipefail -c "$2" >"$work/said.txt" 2>&1 </dev/null; then
    echo "ok      line $1: $2"
  else
    fail "line $1: $2"
  fi
}

# run_python LINE PAGE: the block of Python that starts on that line.
run_python() {
  awk -v first="$1" 'NR > first && /^```$/ { exit } NR > first' "$2" >block.py
  if [ -n "$python" ]; then
    type_it "$1" "PYTHONPATH=$(dirname "$module") $python block.py"
  else
    echo "skipped: line $1: there is no Python with cffi and numpy (Debian: apt install python3-cffi python3-numpy)"
  fi
}

# interrupt LINE COMMAND
interrupt() {
  timeout -s INT 5 bash -c "exec $2" >"$work/said.txt" 2>&1 </dev/null
  code=$?
  if [ $code -eq 124 ]; then
    echo "ok      line $1: $2"
  else
    fail "line $1: ended with exit code $code before it was interrupted: $2"
  fi
}

type_page() {
  blocks "$1" >"$work/blocks"
  spans "$1" | sort -u -k 2 | sort -n >"$work/spans"
  while IFS='	' read -r line command; do
    : >"$work/said.txt"
    case $command in
      '!'*) fail "line $line: ${command#!}" ;;
      '@'*) run_python "$line" "${command#@}" ;;
      '^'*) interrupt "$line" "${command#^}" ;;
      '# '*) echo "not typed: line $line: ${command#\# }" ;;
      *) type_it "$line" "$command" ;;
    esac
  done <"$work/blocks"
  while IFS='	' read -r line code; do
    : >"$work/said.txt"
    case $code in
      'qmat '*[A-Z]*) type_it "$line" "qmat help $(echo "$code" | cut -d ' ' -f 2)" ;;
      'qmat '*' '*) type_it "$line" "$code" ;;
      'qmat '*) type_it "$line" "qmat help ${code#qmat }" ;;
      '--set '*) type_it "$line" "qmat mat octopus.off -o of_a_span.ma --epsilon 5% --quiet ${code}" ;;
      --static) ;; # of pkg-config
      --*)
        option=$(echo "$code" | sed 's/[ =].*//')
        if ! grep -q -e "$option\\([^a-z-]\\|\$\\)" "$work/help"; then fail "line $line: no command has $option"; fi
        ;;
    esac
  done <"$work/spans"
}

qmat help >"$work/help" 2>&1
for command in $(sed -n 's/^  \([a-z]*\) .*/\1/p' "$work/help"); do qmat help "$command" >>"$work/help" 2>/dev/null; done

type_page "$source/README.md"
[ "$(grep -c -v '	[#!]' "$work/blocks")" -ge 10 ] || fail "README.md has fewer than ten commands: are they found?"
found=$failures

# The test fails when it should: a command, a parameter, an option and a block that are wrong.
cat >"$work/wrong.md" <<'END'
```sh
qmat mat no_such_model.off \
  -o wrong.ma
false | true
```
`qmat helq mat` and `--set simple.epsilom=1%` and `--no-such-option`
```
in no language
```
<!-- not typed: it would fail -->
```sh
false
```
<!-- interrupted -->
```sh
true
```
```python
print(len(V))
```
END
failures=0
type_page "$work/wrong.md" >"$work/wrong.txt"
if [ "$failures" -ne $mistakes ]; then
  cat "$work/wrong.txt"
  echo "FAILED: of $mistakes mistakes in a page $failures were found"
  found=$((found + 1))
fi
[ "$found" -eq 0 ]
