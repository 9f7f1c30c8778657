#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Makes the Debian packages qmat, libqmat0, libqmat-dev and python3-qmat in build/debian, of the sources beside this
# script: debian.sh [OPTION_OF_CMAKE...]
# $QMAT_MAINTAINER is the address in them. The same sources and libraries make the same bytes: dates are that of the newest
# commit, or $SOURCE_DATE_EPOCH.
set -eu
cd "$(dirname "$0")/.."
build=build/debian
sh .ci/packages.sh packages.txt packaging/packages.txt
if [ -z "${SOURCE_DATE_EPOCH-}" ]; then SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null || date +%s); fi
export SOURCE_DATE_EPOCH
umask 022
rm -f "$build"/*.deb
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr -DQMAT_TESTS=OFF -DQMAT_DEBIAN=ON \
  -DQMAT_PYTHON_DIR=lib/python3/dist-packages -DQMAT_ZSH_DIR=share/zsh/vendor-completions -DQMAT_MAINTAINER="${QMAT_MAINTAINER:-qmat@users.noreply.github.com}" \
  -DCMAKE_SHARED_LINKER_FLAGS='-Wl,-z,relro,-z,now' -DCMAKE_EXE_LINKER_FLAGS='-Wl,-z,relro,-z,now' "$@"
cmake --build "$build" -j "$(nproc)"
(cd "$build" && cpack)
ls -l "$build"/*.deb
