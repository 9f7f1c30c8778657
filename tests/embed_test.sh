#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs qmat and builds examples/embed.c on top in four ways: with the shared and the static library, by pkg-config
# and by CMake: embed_test.sh SOURCE_FOLDER BUILD_FOLDER
source=$1
built=$2
. "$(dirname "$0")/lib.sh"
QMAT_CACHE=$work/cache
export QMAT_CACHE

cmake --install "$built" --prefix "$work/installed" >out.txt 2>&1 || die "the installation"
# The installation may be moved.
mv installed moved
cp "$source/examples/embed.c" .
"$built/qmat_embed" 10% >right.txt 2>err.txt || die "the program of the build tree"
grep -q '^[1-9][0-9]* spheres' right.txt || die "no spheres"

# check PROGRAM shared|static
check() {
  "$1" 10% >out.txt 2>err.txt || die "$1 does not run"
  cmp -s out.txt right.txt || die "$1 prints something else"
  linked=static
  if ldd "$1" | grep -q libqmat; then linked=shared; fi
  [ $linked = "$2" ] || die "$1 is linked with the $linked library"
}

# Linkers prefer a shared library to a static one, so the static one is tried on its own.
cp -r moved alone
rm "$(dirname "$(find "$work/alone" -name libqmat.a)")"/libqmat.so*
for kind in shared static; do
  prefix=$work/moved option=
  if [ $kind = static ]; then prefix=$work/alone option=--static; fi
  PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name qmat.pc)")
  export PKG_CONFIG_PATH
  # pkg-config writes a space in a path as a shell reads it.
  eval "cc embed.c -o by_pkg_config_$kind $(pkg-config $option --cflags --libs qmat) \
    -Wl,-rpath,$(pkg-config --variable=libdir qmat)" >out.txt 2>err.txt || die "pkg-config $option"
  check ./by_pkg_config_$kind $kind
done

cat >CMakeLists.txt <<'END'
cmake_minimum_required(VERSION 3.25)
project(embed LANGUAGES C)
find_package(qmat REQUIRED)
add_executable(by_cmake_shared embed.c)
target_link_libraries(by_cmake_shared PRIVATE qmat::qmat)
add_executable(by_cmake_static embed.c)
target_link_libraries(by_cmake_static PRIVATE qmat::qmat_static)
END
cmake -S . -B build -DCMAKE_PREFIX_PATH="$work/moved" >out.txt 2>err.txt || die "configuring"
cmake --build build >out.txt 2>err.txt || die "building with CMake"
for kind in shared static; do check build/by_cmake_$kind $kind; done
