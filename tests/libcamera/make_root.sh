#!/usr/bin/env bash
# Puts Debian trixie with picamera2, libcamera's virtual camera and pytest into a folder: make_root.sh FOLDER (root, network).
# No camera and no kernel module are needed: dmabuf_shim.c stands in for the buffers' provider, three grey pictures for
# the scene. Some 1.7 GB; a folder that is complete is left as it is.
set -euo pipefail
root=$(realpath -m "$1")
here=$(dirname "$(realpath "$0")")
[[ -e $root/complete ]] && exit 0
[[ $(id -u) == 0 ]] || { echo "A chroot needs root: run this with sudo."; exit 1; }
command -v debootstrap > /dev/null || { echo "debootstrap is missing: apt-get install debootstrap."; exit 1; }

mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
rm -rf "$root"
debootstrap --variant=minbase trixie "$root" "$mirror"
{
  echo "deb $mirror trixie main"
  echo "deb $mirror trixie-updates main"
  echo "deb $mirror trixie-backports main"
} > "$root/etc/apt/sources.list"
install -D -m 644 /etc/resolv.conf "$root/etc/resolv.conf"
inside() { chroot "$root" /usr/bin/env DEBIAN_FRONTEND=noninteractive "$@"; }
install=(apt-get install -y -qq --no-install-recommends)
inside apt-get update -qq
inside "${install[@]}" python3-venv python3-dev build-essential libcap-dev ca-certificates
inside "${install[@]}" -t trixie-backports libcamera-tools libcamera-ipa python3-libcamera # 0.4 of trixie has broken metadata
# pip's index and certificates are those of the host.
for file in /etc/pip.conf /etc/ssl/certs/ca-certificates.crt; do
  [[ ! -e $file ]] || install -D -m 644 "$file" "$root$file"
done
inside python3 -m venv --system-site-packages /venv
inside /venv/bin/pip install --quiet picamera2 pytest

install -D -m 644 "$here/virtual.yaml" "$root/usr/share/libcamera/pipeline/virtual/virtual.yaml"
install -D -m 644 "$here/dmabuf_shim.c" "$root/opt/tsis/dmabuf_shim.c"
inside gcc -O2 -Wall -Werror -shared -fPIC -o /opt/tsis/dmabuf_shim.so /opt/tsis/dmabuf_shim.c -ldl
inside mkdir -p /opt/tsis/frames /src
inside /venv/bin/python -c '
from PIL import Image
for number, grey in enumerate((40, 70, 100)):
    Image.new("L", (768, 492), grey).convert("RGB").save(f"/opt/tsis/frames/{number}.jpg", quality=100)'
touch "$root/complete"
