#!/usr/bin/env bash
# Puts a bare Debian bookworm with systemd and sshd into a folder, as a fresh Raspberry Pi OS Lite is: make_root.sh FOLDER
# (root, network). Some 0.4 GB; a folder that is complete is left as it is.
set -euo pipefail
root=$(realpath -m "$1")
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
[[ $(id -u) == 0 ]] || { echo "A container needs root: run this with sudo."; exit 1; }
[[ ! -e $root/complete ]] || exit 0
command -v debootstrap > /dev/null || { echo "debootstrap is missing: apt-get install debootstrap."; exit 1; }

rm -rf "$root"
# systemd-container is the container's own launcher; the others are what Raspberry Pi OS Lite has, too.
debootstrap --variant=minbase \
  --include=systemd,systemd-sysv,systemd-container,udev,dbus,kmod,procps,tzdata,ca-certificates,python3,sudo,openssh-server \
  bookworm "$root" "$mirror"
printf 'deb %s bookworm main\n' "$mirror" > "$root/etc/apt/sources.list"
# What Raspberry Pi's imager does: a user who may become root, who logs in by key.
chroot "$root" useradd --create-home --shell /bin/bash pi
echo 'pi ALL=(ALL) NOPASSWD: ALL' > "$root/etc/sudoers.d/pi"
# The container shares the host's loopback interface, so its port is another than the host's.
printf 'Port 18022\nListenAddress 127.0.0.1\n' > "$root/etc/ssh/sshd_config.d/port.conf"
touch "$root/complete"
