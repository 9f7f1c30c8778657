#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the packages in build/debian in a bare Debian, and runs the examples of the manual page and of the Python module
# there: bare.sh FOLDER [MIRROR]
# FOLDER becomes a chroot; remove it afterwards. Needs root, debootstrap, and qmat_models in build/release, which makes the
# models of the examples. The chroot takes its package sources from this machine.
set -eu
top=$(cd "$(dirname "$0")/.." && pwd)
folder=$1
mirror=${2:-http://deb.debian.org/debian}
[ -d "$folder/etc" ] || debootstrap --variant=minbase bookworm "$folder" "$mirror"
rm -f "$folder/etc/apt/sources.list"
for sources in sources.list sources.list.d apt.conf.d; do
  if [ -e "/etc/apt/$sources" ]; then cp -r "/etc/apt/$sources" "$folder/etc/apt/"; fi
done
cp /etc/resolv.conf "$folder/etc/"
home=$folder/root/examples
rm -rf "$home"
mkdir -p "$home/models"
cp "$top"/build/debian/*.deb "$top/examples/notebook.py" "$home/"
"$top/build/release/qmat_models" octopus -o "$home/octopus.off"
"$top/build/release/qmat_models" box -o "$home/crate.off"
cp "$home/octopus.off" "$home/crate.off" "$home/models/"
cat >"$home/run.sh" <<'END'
set -eu
cd /root/examples
export DEBIAN_FRONTEND=noninteractive
apt-get update -q
apt-get install -y -q --no-install-recommends ./*.deb
zcat /usr/share/man/man1/qmat.1.gz | sed -n '/^\.SH EXAMPLES/,/^\.SH EXIT/s/^\\fB\(.*\)\\fR$/\1/p' | sed 's/\\-/-/g' >commands
while read -r command; do
  echo "\$ $command"
  sh -c "$command" >output
  tail -n 3 output
done <commands
echo '$ python3 notebook.py'
python3 notebook.py picture.svg
END
# Never leaves this machine's /dev in a folder that is to be removed.
trap 'umount "$folder/proc" "$folder/dev" 2>/dev/null || true' EXIT
trap 'exit 1' HUP INT TERM
mount -t proc proc "$folder/proc"
mount --bind /dev "$folder/dev"
chroot "$folder" sh /root/examples/run.sh
