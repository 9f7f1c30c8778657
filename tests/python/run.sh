#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs a Python test with the library of a build: run.sh SOURCE_FOLDER BUILD_FOLDER TEST.py
for python in python3 /usr/bin/python3; do
  if $python -c 'import cffi, numpy' 2>/dev/null; then
    QMAT_LIBRARY=$2/libqmat.so
    PYTHONPATH=$1/python
    PYTHONDONTWRITEBYTECODE=1
    export QMAT_LIBRARY PYTHONPATH PYTHONDONTWRITEBYTECODE
    unset QMAT_CACHE
    exec $python "$3" "$1" "$2/qmat"
  fi
done
echo "skipped: there is no Python with cffi and numpy (Debian: apt install python3-cffi python3-numpy)"
exit 77
