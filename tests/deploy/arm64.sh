#!/usr/bin/env bash
# Builds the release file for aarch64, installs it in an emulated Debian, and compares its answers with those of this
# machine: arm64.sh FOLDER bookworm|trixie (root, network). Prints one line a claim; exits 1 when one does not hold.
# Speed, the camera and the kernel of a Raspberry Pi are not shown by this.
set -euo pipefail
# What is mounted below is seen by this script alone, and gone when it ends.
[[ -n ${TSIS_OWN_MOUNTS:-} ]] || TSIS_OWN_MOUNTS=1 exec unshare --mount --propagation private "$0" "$@"
folder=$(realpath -m "$1") system=$2
here=$(dirname "$(realpath "$0")")
project=$(realpath "$here/../..")
python=$project/.venv/bin/python
export PYTHONPATH=$project:$project/tests OPENBLAS_NUM_THREADS=1
# Without it QEMU emulates every extension there is: 20 times slower, and no Raspberry Pi has them.
export QEMU_CPU=${QEMU_CPU:-cortex-a72}
"$here/make_arm64_root.sh" "$folder" "$system"
root=$folder/root work=$folder/work keys=$(mktemp -d)
claim() { # name, command: prints what it says, and ends all where it fails
  local said
  said=$("${@:2}") || { printf '%s: FAILS: %s\n' "$1" "$said"; exit 1; }
  printf '%s: %s (%d s)\n' "$1" "$said" $((SECONDS - began))
  began=$SECONDS
}
began=$SECONDS

# The kernel starts programs of an aarch64 by the emulator that it holds open (F): so does a chroot without it.
name=tsis-aarch64 formats=/proc/sys/fs/binfmt_misc
mountpoint -q "$formats" || mount -t binfmt_misc binfmt_misc "$formats"
[[ ! -e $formats/$name ]] || echo -1 > "$formats/$name"
magic='\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00'
mask='\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff'
echo ":$name:M::$magic:$mask:$folder/qemu-aarch64:OPF" > "$formats/register"
ended() {
  [[ ! -x $root/usr/bin/systemctl ]] || inside / /usr/bin/systemctl stop tsis.service
  rm -r "$keys"
  [[ ! -e $formats/$name ]] || echo -1 > "$formats/$name"
}
trap ended EXIT
mount -t proc proc "$root/proc"
mount --bind /dev "$root/dev"
mount --bind /dev/pts "$root/dev/pts"
mount -t tmpfs tmpfs "$root/dev/shm"
port=18764
inside() { chroot "$root" /usr/bin/env -i -C "$1" PATH=/usr/bin:/bin HOME=/root QEMU_CPU="$QEMU_CPU" OPENBLAS_NUM_THREADS=1 "${@:2}"; }
claim "emulated" inside / /usr/bin/python3 -c 'import platform as p; print(p.machine(), p.python_version(), *p.libc_ver())'

rm -rf "$work" "$root/srv/tsis" "$root/opt/tsis" "$root/run/tsis-daemon.pid"
mkdir -p "$work" "$root/srv/tsis"
(cd "$project" && "$python" -m host_tools release key "$keys/key" --no-passphrase > "$root/srv/tsis/release_signers" 2> /dev/null
  "$python" -m host_tools release build --allow-dirty --system "$system" --key "$keys/key" --out "$work" > "$work/built.txt" 2> "$work/build.log") ||
  { cat "$work/build.log"; exit 1; }
cat "$work/built.txt"
release=$(echo "$work"/*.release)
claim "built" stat -c '%s bytes' "$release"

# The probe's own installer, run from the wheel in the release file: nothing of ours is in the root before. It starts the
# daemon, simulated, by a stand-in for systemctl, and commits it once its parts are ready.
tar -C "$root/srv/tsis" --strip-components=1 --wildcards -xf "$release" 'wheels/tsis-*.whl'
wheel=$(basename "$root"/srv/tsis/tsis-*.whl)
cp "$release" "$root/srv/tsis/update.release"
cp "$here/golden_answers.py" "$here/slow_scene.toml" "$root/srv/tsis/"
install -m 755 "$here/systemctl_stand_in.sh" "$root/usr/bin/systemctl"
install -D -m 644 "$root/srv/tsis/release_signers" "$root/etc/tsis/release_signers"
printf '[server]\nport = %d\n' "$port" > "$root/etc/tsis/config.toml"
echo "$port" > "$root/srv/tsis/port"
rm -rf "$root/var/lib/tsis-update"
inside /srv/tsis PYTHONPATH="/srv/tsis/$wheel" /usr/bin/python3 -m device.update --health-within 1200 --look-every 10 \
  install /srv/tsis/update.release > "$work/install.log" 2>&1 || { tail -20 "$work/install.log" "$root/srv/tsis/daemon.log"; exit 1; }
claim "installed and committed" readlink "$root/opt/tsis/current"
device=/opt/tsis/current/bin/python

# Not judged: on a busy machine a frame of the simulated camera takes longer than the 3 s that its process is given, and
# the daemon says E104. The computing of a press is judged below, on recordings.
tried() { "$python" "$here/press.py" "http://127.0.0.1:$port" quick || true; }
claim "a press by the daemon, not judged" tried
inside / /usr/bin/systemctl stop tsis.service

# By its unit's own words: the folder of packages has the Python's version in its name.
read -ra stated < <(sed -n 's/^Environment=//p' "$root/opt/tsis/updater/systemd/tsis-fallback.service")
claim "the page that stands in for a daemon is found" inside / "${stated[@]}" \
  /usr/bin/python3 -S -P -c 'import device.fallback.server as page; print(page.__file__)'

inside /srv/tsis "$device" golden_answers.py > "$work/golden.aarch64.json"
"$python" "$here/golden_answers.py" > "$work/golden.here.json"
compared() { "$python" "$here/compare_answers.py" "$work/$1.here.json" "$work/$1.aarch64.json" "$2"; }
claim "golden vectors" compared golden 1e-5

# The same recordings of simulated presses, analysed by both.
"$python" "$here/record_presses.py" "$root/srv/tsis/presses"
# Of a force ramp rounding alone draws other samples: an end of an interval then moves by up to half of the spread.
declare -A bounds=([paper]=1e-3 [quick]=1e-3 [standard]=0.5 [precise]=0.5)
for mode in paper quick standard precise; do
  inside /srv/tsis "$device" -m device analyse --mode $mode presses/$mode > "$work/$mode.aarch64.json"
  (cd "$root/srv/tsis" && "$python" -m device analyse --mode $mode presses/$mode > "$work/$mode.here.json")
  claim "a recording in mode $mode" compared $mode "${bounds[$mode]}"
done
