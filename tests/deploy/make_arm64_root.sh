#!/usr/bin/env bash
# Puts a Debian for aarch64, and an emulator that runs it, into a folder: make_arm64_root.sh FOLDER bookworm|trixie (root,
# network).
# Half a minute and 0.4 GB; a folder that is complete is left as it is. The packages are unpacked, not configured: that
# is enough for Python and ssh-keygen, and a tenth of the time.
set -euo pipefail
folder=$(realpath -m "$1") system=$2
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
[[ $(id -u) == 0 ]] || { echo "An emulated Debian needs root: run this with sudo."; exit 1; }
[[ ! -e $folder/complete ]] || exit 0
command -v debootstrap > /dev/null || { echo "debootstrap is missing: apt-get install debootstrap."; exit 1; }
rm -rf "$folder"
mkdir -p "$folder/apt/lists/partial" "$folder/apt/cache/archives/partial" "$folder/root"

# QEMU of the backports: bookworm's own, 7.2, dies of `import onnxruntime`.
echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror bookworm-backports main" \
  > "$folder/apt/sources.list"
apt=(-qq -o "Dir::Etc::sourcelist=$folder/apt/sources.list" -o Dir::Etc::sourceparts=-
  -o "Dir::State::lists=$folder/apt/lists" -o "Dir::Cache=$folder/apt/cache" -o APT::Sandbox::User=root)
apt-get "${apt[@]}" update
(cd "$folder/apt" && apt-get "${apt[@]}" --target-release bookworm-backports download qemu-user)
dpkg -x "$folder"/apt/qemu-user_*.deb "$folder/apt/qemu"
mv "$folder/apt/qemu/usr/bin/qemu-aarch64" "$folder/qemu-aarch64"
rm -r "$folder/apt"

debootstrap --download-only --arch=arm64 --variant=minbase --include=python3,python3-venv,openssh-client \
  "$system" "$folder/root" "$mirror" > "$folder/debootstrap.log"
for package in "$folder"/root/var/cache/apt/archives/*.deb; do
  dpkg-deb --fsys-tarfile "$package" | tar -C "$folder/root" -xf -
done
rm -rf "$folder/root/var/cache/apt/archives" "$folder/root/debootstrap"
printf 'root:x:0:0:root:/root:/bin/sh\n' > "$folder/root/etc/passwd"
printf 'root:x:0:\n' > "$folder/root/etc/group"
echo '127.0.0.1 localhost' > "$folder/root/etc/hosts"
touch "$folder/complete"
