#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the missing Debian packages of the given lists, or of packages.txt: packages.sh [LIST...]
# It first says what will be downloaded. When nothing is missing it needs neither the network nor root.
set -eu
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- packages.txt

if ! command -v dpkg-query >/dev/null 2>&1; then
  echo "packages.sh: this is not a Debian system; install what is listed in: $*" >&2
  exit 1
fi
missing=
for package in $(cat "$@"); do
  case $(dpkg-query -W -f '${Status}' "$package" 2>/dev/null) in
    *' installed') ;;
    *) missing="$missing $package" ;;
  esac
done
if [ -z "$missing" ]; then
  echo "Debian packages: all of $* are installed, nothing to download."
  exit 0
fi

if [ "$(id -u)" -eq 0 ]; then
  root=
elif command -v sudo >/dev/null 2>&1; then
  root=sudo
else
  echo "packages.sh: not root, and there is no sudo; please run: apt-get install$missing" >&2
  exit 1
fi
log=$(mktemp)
policy=
clean_up() {
  rm -f "$log"
  if [ -n "$policy" ]; then $root rm -f "$policy"; fi
}
trap clean_up EXIT
trap 'exit 1' HUP INT TERM

# install OPTION...: apt-get install of what is missing.
install() {
  # shellcheck disable=SC2086 # the list is words
  $root env LC_ALL=C DEBIAN_FRONTEND=noninteractive apt-get install --no-install-recommends "$@" $missing >"$log" 2>&1
}

# On a fresh system the lists of packages are absent or old.
if ! install --simulate; then $root env LC_ALL=C apt-get update -qq >"$log" 2>&1 || true; fi
install --assume-no || true
sizes=$(sed -n 's/^Need to get \(.*\) of archives.*/download \1/p; s/^After this operation, \(.*\) of additional.*/\1 on disk/p' "$log" |
  paste -s -d ';' | sed 's/;/, /')
echo "Debian packages:$missing"
echo "They and what they depend on: ${sizes:-size unknown}."

# Servers are installed for tests, which start their own: they are not started as services.
if [ ! -e /usr/sbin/policy-rc.d ]; then
  policy=/usr/sbin/policy-rc.d
  printf '#!/bin/sh\nexit 101\n' | $root tee "$policy" >/dev/null
  $root chmod 755 "$policy"
fi
if ! install -qq -y; then
  $root env LC_ALL=C apt-get update -qq >>"$log" 2>&1 || true
  if ! install -qq -y; then
    tail -n 15 "$log" >&2
    echo "packages.sh: apt-get could not install:$missing" >&2
    exit 1
  fi
fi
