#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# libqmat.so exports the functions of qmat.h under their versions in libqmat.map, and nothing else; its SONAME has the
# major version: abi_test.sh SOURCE_FOLDER LIBRARY MAJOR_VERSION
. "$(dirname "$0")/../lib.sh"
map=$1/graphs/libqmat.map
LC_ALL=C
export LC_ALL

# "FUNCTION@@VERSION" of each function in the list.
awk '/^[A-Z0-9_.]+ \{$/ { version = $1 } /^    qmat_/ { sub(/;/, "", $1); print $1 "@@" version }' "$map" | sort >listed.txt
nm -D --defined-only "$2" | awk '$2 != "A" { print $3 }' | sort >exported.txt
[ "$(wc -l <listed.txt)" -ge 20 ] || fail "the list of functions is not found in libqmat.map"
diff listed.txt exported.txt >out.txt || fail "the library exports (>) other symbols than libqmat.map lists (<)"

tr '\n' ' ' <"$1/graphs/qmat.h" | sed 's/QMAT_API/\n&/g' | sed -n 's/^QMAT_API [^(]*[ *]\(qmat_[a-z_]*\)(.*/\1/p' | sort >declared.txt
sed 's/@@.*//' listed.txt >names.txt
diff names.txt declared.txt >out.txt || fail "qmat.h declares (>) other functions than libqmat.map lists (<)"

objdump -p "$2" | sed -n 's/^ *SONAME *//p' >out.txt
[ "$(cat out.txt)" = "libqmat.so.$3" ] || fail "the SONAME"
finish
