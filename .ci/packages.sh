#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs those Debian packages of packages.txt that are missing. Where none is, it needs neither the network nor root.
set -eu
cd "$(dirname "$0")/.."

if ! command -v dpkg-query >/dev/null 2>&1; then
  echo "packages.sh: this is not a Debian system; install by hand what packages.txt names" >&2
  exit 1
fi
missing=
while read -r package; do
  case $(dpkg-query -W -f '${Status}' "$package" 2>/dev/null) in
    *' installed') ;;
    *) missing="$missing $package" ;;
  esac
done <packages.txt
[ -n "$missing" ] || exit 0

echo "Installing:$missing"
if [ "$(id -u)" -eq 0 ]; then
  root=
elif command -v sudo >/dev/null 2>&1; then
  root=sudo
else
  echo "packages.sh: not root, and there is no sudo; please run: apt-get install$missing" >&2
  exit 1
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
install_missing() {
  # shellcheck disable=SC2086 # the list is words
  $root env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $missing >>"$log" 2>&1
}
# The lists of packages may be absent or old on a fresh system.
if ! install_missing; then
  if ! $root apt-get update -qq >>"$log" 2>&1 || ! install_missing; then
    tail -n 15 "$log" >&2
    echo "packages.sh: apt-get could not install:$missing" >&2
    exit 1
  fi
fi
