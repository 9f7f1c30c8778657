#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds qmat with gcc and with clang and compares the files that both write at 1, 2 and 8 threads, byte by byte. Prints
# a Markdown table; exit code 0 when all files are the same.
#   compilers.sh [--epsilon E] [MODEL...]      measures the generated models and these, at 5 % by default; default
#                                              MODELs: spot and knight of ../shared/data/surfaces, where present
# clang needs the Debian packages clang and libomp-dev. Without them only the thread counts are compared, and the exit
# code is 77. The builds stay in the folder QMAT_BUILDS (default: build): gcc's in release, clang's in clang.
set -eu
epsilon=5%
options="--epsilon"
. "$(dirname "$0")/functions.sh"
if [ $# -eq 0 ]; then
  for path in "$top"/../shared/data/surfaces/spot.* "$top"/../shared/data/surfaces/knight.*; do
    if [ -e "$path" ]; then set -- "$@" "$path"; fi
  done
fi
builds=${QMAT_BUILDS:-$top/build}
QMAT_CACHE=off # each build has to compute its own results
export QMAT_CACHE

# build FOLDER C C++: an optimised build with these compilers, without warnings.
build() {
  if ! {
    cmake -S "$top" -B "$builds/$1" -G Ninja -DCMAKE_BUILD_TYPE=Release -DQMAT_WERROR=ON -DCMAKE_C_COMPILER="$2" \
      -DCMAKE_CXX_COMPILER="$3" && cmake --build "$builds/$1" --target qmat qmat_models
  } >"$work/$1.log" 2>&1; then
    tail -n 40 "$work/$1.log" >&2
    exit 1
  fi
}

build release gcc g++
compilers="release"
missing=
if ! command -v clang++ >"$work/which"; then
  missing=clang
elif ! echo 'int main(void) { return 0; }' | clang -fopenmp -x c - -o "$work/openmp" 2>"$work/openmp.log"; then
  missing="clang's OpenMP"
else
  build clang clang clang++
  compilers="release clang"
fi

"$builds/release/qmat_models" all "$work" >"$work/models.log"
for model in "$work"/*.off; do set -- "$@" "$model"; done

# run FOLDER THREADS MODEL GROUP: writes every kind of file, and the result of on_exceed=raise, into GROUP.
run() {
  mkdir "$4"
  "$builds/$1/qmat" mat "$3" -o "$4/mat.ma" -o "$4/mat.glb" -o "$4/mat.usda" -o "$4/mat.ply" --epsilon "$epsilon" \
    --threads "$2" --quiet --progress off
  "$builds/$1/qmat" mat "$3" -o "$4/raised.ma" --epsilon "$epsilon" --set simple.on_exceed=raise \
    --set "simple.finest=$epsilon" --threads "$2" --quiet --progress off
}

different=0
echo "| model | files | bytes | runs | different from gcc with one thread |"
echo "| --- | ---: | ---: | ---: | --- |"
for model in "$@"; do
  rm -rf "$work/first" "$work/other"
  run release 1 "$model" "$work/first"
  files=$(find "$work/first" -type f | wc -l)
  bytes=$(cat "$work"/first/* | wc -c)
  runs=1
  differ=
  for compiler in $compilers; do
    for threads in 1 2 8; do
      if [ "$compiler $threads" = "release 1" ]; then continue; fi
      run "$compiler" "$threads" "$model" "$work/other"
      runs=$((runs + 1))
      for file in "$work"/first/*; do
        if cmp -s "$file" "$work/other/$(basename "$file")"; then continue; fi
        differ="$differ $(basename "$file") ($compiler, $threads threads)"
        different=1
      done
      rm -r "$work/other"
    done
  done
  echo "| $(basename "${model%.*}") | $files | $bytes | $runs | ${differ:-none} |"
done
if [ -n "$missing" ]; then
  echo "$missing is missing (Debian: clang, libomp-dev): gcc's bytes were compared with gcc's alone" >&2
  if [ $different -eq 0 ]; then exit 77; fi
fi
exit $different
