#!/usr/bin/env bash
# Builds the release file for aarch64, installs it in an emulated Debian, and compares its answers with those of this
# machine: arm64.sh FOLDER (root, network). Prints one line a claim; exits 1 when one does not hold.
# Speed, the camera and the kernel of a Raspberry Pi are not shown by this.
set -euo pipefail
folder=$(realpath -m "$1")
here=$(dirname "$(realpath "$0")")
project=$(realpath "$here/../..")
python=$project/.venv/bin/python
export PYTHONPATH=$project:$project/tests OPENBLAS_NUM_THREADS=1
# Without it QEMU emulates every extension there is: 20 times slower, and no Raspberry Pi has them.
export QEMU_CPU=${QEMU_CPU:-cortex-a72}
"$here/make_arm64_root.sh" "$folder"
root=$folder/root work=$folder/work
claim() { printf '%s: %s (%d s)\n' "$1" "$2" $((SECONDS - began)); began=$SECONDS; }
began=$SECONDS

# The kernel starts programs of an aarch64 by the emulator that it holds open (F): so does a chroot without it.
name=tsis-aarch64 formats=/proc/sys/fs/binfmt_misc
mountpoint -q "$formats" || mount -t binfmt_misc binfmt_misc "$formats"
[[ ! -e $formats/$name ]] || echo -1 > "$formats/$name"
magic='\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00'
mask='\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff'
echo ":$name:M::$magic:$mask:$folder/qemu-aarch64:OPF" > "$formats/register"
daemon=
ended() {
  [[ -z $daemon ]] || { kill "$daemon" && wait "$daemon"; } 2> /dev/null || true
  [[ ! -e $formats/$name ]] || echo -1 > "$formats/$name"
  for mounted in dev/shm dev proc; do mountpoint -q "$root/$mounted" && umount "$root/$mounted"; done || true
}
trap ended EXIT
mountpoint -q "$root/proc" || mount -t proc proc "$root/proc"
mountpoint -q "$root/dev" || mount --bind /dev "$root/dev"
mountpoint -q "$root/dev/shm" || mount -t tmpfs tmpfs "$root/dev/shm"
inside() { chroot "$root" /usr/bin/env -i -C "$1" PATH=/usr/bin:/bin HOME=/root OPENBLAS_NUM_THREADS=1 "${@:2}"; }
claim "emulated" "$(inside / /usr/bin/python3 -c 'import platform as p; print(p.machine(), p.python_version(), *p.libc_ver())')"

rm -rf "$work" "$root/srv/tsis" "$root/opt/tsis"
mkdir -p "$work" "$root/srv/tsis"
(cd "$project" && "$python" -m host_tools release key "$work/key" --no-passphrase > "$root/srv/tsis/release_signers" 2> /dev/null
  "$python" -m host_tools release build --allow-dirty --key "$work/key" --out "$work" > "$work/built.txt" 2> "$work/build.log") ||
  { cat "$work/build.log"; exit 1; }
cat "$work/built.txt"
release=$(echo "$work"/*.release)
claim "built" "$(stat -c %s "$release") bytes"

# The seam to the probe's own installer: it takes a release file and leaves /opt/tsis/current.
cp "$release" "$root/srv/tsis/update.release"
cp "$here/unpack_release.py" "$here/golden_answers.py" "$root/srv/tsis/"
inside /srv/tsis /usr/bin/python3 unpack_release.py update.release release_signers /opt/tsis
claim "installed" "$(du -sm "$root/opt/tsis" | cut -f1) MB in /opt/tsis, $(readlink "$root/opt/tsis/current")"
device=/opt/tsis/current/bin/python

inside /srv/tsis "$device" golden_answers.py > "$work/golden.aarch64.json"
"$python" "$here/golden_answers.py" > "$work/golden.here.json"
claim "golden vectors" "$("$python" "$here/compare_answers.py" "$work/golden.here.json" "$work/golden.aarch64.json" 1e-5)"

# The same recordings of simulated presses, analysed by both.
"$python" "$here/record_presses.py" "$root/srv/tsis/presses"
for mode in paper quick standard precise; do
  inside /srv/tsis "$device" -m device analyse --mode $mode presses/$mode > "$work/$mode.aarch64.json"
  (cd "$root/srv/tsis" && "$python" -m device analyse --mode $mode presses/$mode > "$work/$mode.here.json")
  claim "a recording in mode $mode" \
    "$("$python" "$here/compare_answers.py" "$work/$mode.here.json" "$work/$mode.aarch64.json" 1e-3)"
done
