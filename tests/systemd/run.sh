#!/usr/bin/env bash
# Runs systemd/tsis.service under a real systemd, in a container without hardware: run.sh FOLDER.
# Prints one line a claim; exits 1 when one does not hold. With a second word, `simulated` or `real`, only those stories.
set -euo pipefail
root=$(realpath -m "$1")
here=$(dirname "$(realpath "$0")")
project=$here/../..
"$here/make_root.sh" "$root"

# The daemon, as docs/contracts.md says under "On a probe".
rm -rf "$root/src" "$root/etc/tsis" "$root/var/lib/tsis" "$root"/etc/systemd/system/tsis*
mkdir "$root/src" "$root/etc/tsis"
tar -C "$project" --exclude=__pycache__ -cf - \
  device host_tools models protocols systemd docs/templates tests pyproject.toml setup.py README.md LICENSE |
  tar -C "$root/src" --no-same-owner -xf -
inside() { chroot "$root" /usr/bin/env -C / "$@"; }
inside /opt/tsis/current/bin/python -m pip install -qq --root-user-action=ignore --no-deps --no-build-isolation \
  --no-index --force-reinstall /src
install -D -m 644 "$project/systemd/tsis.service" "$root/usr/lib/systemd/system/tsis.service"
install -D -m 644 "$project/systemd/tsis-fallback.service" "$root/usr/lib/systemd/system/tsis-fallback.service"
install -D -m 644 "$project/systemd/tsis.sysusers.conf" "$root/usr/lib/sysusers.d/tsis.conf"
install -D -m 644 "$project/systemd/tsis-force.rules" "$root/usr/lib/udev/rules.d/60-tsis-force.rules"
install -D -m 644 "$project/systemd/tsis-light.rules" "$root/usr/lib/udev/rules.d/60-tsis-light.rules"
inside systemd-sysusers
# The fallback runs from the last good release, here the same; there is one before it, and whom to ask for that.
rm -rf "$root/opt/tsis/updater" "$root/var/lib/tsis-update"
mkdir -p "$root/opt/tsis/updater/lib/python3.11/site-packages" "$root/var/lib/tsis-update/incoming"
cp -r "$root/src/device" "$root/opt/tsis/updater/lib/python3.11/site-packages"
echo '{"committed": "0.2.0+2", "previous": "0.1.0+1"}' > "$root/var/lib/tsis-update/state.json"
inside groupadd --force --system tsis-update
inside chgrp tsis-update /var/lib/tsis-update/incoming
chmod 770 "$root/var/lib/tsis-update/incoming"

# What the container adds: no hardware, and a look into the unit's sandbox.
etc=$root/etc/systemd/system
install -D -m 644 "$here/simulated.conf" "$etc/tsis.service.d/simulated.conf"
install -D -m 644 "$project/systemd/tsis.service" "$etc/tsis-shut-in.service"
install -D -m 644 "$here/shut_in.conf" "$etc/tsis-shut-in.service.d/shut_in.conf"
install -D -m 644 "$here/tsis-stories.service" "$etc/tsis-stories.service"
sed -i "s/-m stories$/-m stories ${2:-}/" "$etc/tsis-stories.service"
# The same C library is in the container, so the host's compiler will do.
command -v gcc > /dev/null || { echo "gcc is missing: apt-get install gcc libc6-dev."; exit 1; }
mkdir -p "$root/opt/tsis-rig"
gcc -O2 -shared -fPIC -o "$root/opt/tsis-rig/i2c_shim.so" "$project/tests/rig/i2c_shim.c" -ldl
mkdir -p "$etc/multi-user.target.wants" "$root/home/someone"
ln -sf ../tsis-stories.service "$etc/multi-user.target.wants/"

results=$root/results.txt console=$root/console.txt
: > "$results"
# The container's own systemd-nspawn, with its own libraries: the host needs neither. Where systemd is not PID 1 nobody
# can be asked for a scope, and the mounts have to be private. DevicePolicy= takes bpf and the unified control groups.
libraries=$root/usr/lib/x86_64-linux-gnu
scope=()
[[ -d /run/systemd/system ]] || scope=(--keep-unit)
export SYSTEMD_NSPAWN_UNIFIED_HIERARCHY=1
unshare --mount --propagation private \
  "$root/lib64/ld-linux-x86-64.so.2" --library-path "$libraries:$libraries/systemd" \
  "$root/usr/bin/systemd-nspawn" --quiet --register=no "${scope[@]}" --directory="$root" --machine=tsis-stories \
  --system-call-filter=bpf --private-network --resolv-conf=off --timezone=off --link-journal=no --boot --console=pipe \
  < /dev/null > "$console" 2>&1 &
container=$!
ended() {
  if kill "$container" 2> /dev/null; then wait "$container" || true; fi
  [[ ${#scope[@]} == 0 ]] || rmdir /sys/fs/cgroup/*/{payload/init.scope,payload,supervisor} 2> /dev/null || true
}
trap ended EXIT
tail --pid="$container" --follow --lines=+1 "$results"
wait "$container" || true
grep -qE '^[0-9]+ passed, 0 failed$' "$results" || { echo "The container's console: $console"; exit 1; }
