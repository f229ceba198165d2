#!/usr/bin/env bash
# Puts Debian bookworm with systemd and the device's packages into a folder: make_root.sh FOLDER (root, network).
# Some 1 GB; a folder that is complete is left as it is, but for packages whose pins have changed.
set -euo pipefail
root=$(realpath -m "$1")
here=$(dirname "$(realpath "$0")")
lock=$here/../../requirements/device.lock
[[ $(id -u) == 0 ]] || { echo "A container needs root: run this with sudo."; exit 1; }

if [[ ! -e $root/complete ]]; then
  command -v debootstrap > /dev/null || { echo "debootstrap is missing: apt-get install debootstrap."; exit 1; }
  rm -rf "$root"
  debootstrap --variant=minbase --include=systemd,systemd-sysv,systemd-container,udev,dbus,python3-venv,ca-certificates \
    bookworm "$root" "${DEBIAN_MIRROR:-http://deb.debian.org/debian}"
  # pip's index and certificates are those of the host.
  for file in /etc/pip.conf /etc/ssl/certs/ca-certificates.crt; do
    [[ ! -e $file ]] || install -D -m 644 "$file" "$root$file"
  done
  install -D -m 644 /etc/resolv.conf "$root/etc/resolv.conf"
  chroot "$root" python3 -m venv /opt/tsis/current
  touch "$root/complete"
fi

cmp -s "$lock" "$root/opt/tsis/device.lock" && exit 0
cp "$lock" "$root/opt/tsis/device.lock.new"
chroot "$root" /opt/tsis/current/bin/python -m pip install -qq --require-hashes -r /opt/tsis/device.lock.new
mv "$root/opt/tsis/device.lock.new" "$root/opt/tsis/device.lock"
