#!/usr/bin/env bash
# Boots a fresh copy of a bare Debian as a stand-in for a probe, and stays until it is ended: container.sh FOLDER.
# sshd answers on 127.0.0.1:18022 to the key FOLDER/key (made here) as user pi. SIZE: of its disk, an ext4 in a file.
set -euo pipefail
folder=$(realpath -m "$1")
here=$(dirname "$(realpath "$0")")
bare=$folder/bare root=$folder/probe disk=$folder/probe.ext4
mkdir -p "$folder"
"$here/make_root.sh" "$bare"
[[ -e $folder/key ]] || ssh-keygen -q -t ed25519 -N '' -C 'make test-deploy' -f "$folder/key"

# All mounts end with this shell, for they are made in a name space of its own.
if [[ ${IN_OWN_MOUNTS:-} != yes ]]; then
  exec env IN_OWN_MOUNTS=yes unshare --mount --propagation private "$0" "$@"
fi
rm -rf "$disk" "$root"
mkdir "$root"
truncate --size="${SIZE:-5G}" "$disk"
mkfs.ext4 -q -m 0 "$disk"
mount -o loop "$disk" "$root"
cp -a "$bare/." "$root"
install -D -m 644 /etc/resolv.conf "$root/etc/resolv.conf"
for file in /etc/apt/apt.conf.d/*proxy* /etc/ssl/certs/ca-certificates.crt; do
  [[ ! -e $file ]] || install -D -m 644 "$file" "$root$file"
done
install -d -m 700 "$root/home/pi/.ssh"
install -m 600 "$folder/key.pub" "$root/home/pi/.ssh/authorized_keys"
chroot "$root" chown -R pi: /home/pi/.ssh
# What the boot partition of a Pi holds as far as it is provisioned.
install -d "$root/boot/firmware"
printf '[pi5]\ndtparam=ant2\n\n[all]\ncamera_auto_detect=1\n' > "$root/boot/firmware/config.txt"
echo 'console=tty1 root=PARTUUID=0-02 rootfstype=ext4 rootwait' > "$root/boot/firmware/cmdline.txt"

echo raspberrypi > "$root/etc/hostname"
echo '127.0.0.1 localhost raspberrypi' > "$root/etc/hosts"

# Packages are fetched once, also over several runs.
mkdir -p "$folder/packages/partial"
# The container's own systemd-nspawn, with its own libraries: the host needs neither. Where systemd is not PID 1 nobody
# can be asked for a scope. DevicePolicy= takes bpf and the unified control groups.
libraries=$root/usr/lib/x86_64-linux-gnu
# Its control groups then lie below those of this shell, which are its own, so that two containers do not meet.
scope=() before=() own=tsis-deploy-$$
if [[ ! -d /run/systemd/system ]]; then
  scope=(--keep-unit)
  while IFS=: read -r _ controllers path; do
    case $controllers in
      '') hierarchy=/sys/fs/cgroup/unified ;;
      name=systemd) hierarchy=/sys/fs/cgroup/systemd ;;
      *) continue ;;
    esac
    [[ -d $hierarchy ]] || hierarchy=/sys/fs/cgroup
    mkdir "$hierarchy$path/$own"
    echo $$ > "$hierarchy$path/$own/cgroup.procs"
    before+=("$hierarchy$path")
  done < /proc/self/cgroup
fi
boot() {
  "$root/lib64/ld-linux-x86-64.so.2" --library-path "$libraries:$libraries/systemd" \
    "$root/usr/bin/systemd-nspawn" --quiet --register=no "${scope[@]}" --directory="$root" --machine=tsis-probe \
    --system-call-filter=bpf --resolv-conf=off --timezone=off --link-journal=no --hostname=raspberrypi \
    --bind="$folder/packages:/var/cache/apt/archives" --boot --console=pipe < /dev/null &
  container=$!
}
ended() {
  if kill "$container" 2> /dev/null; then wait "$container" || true; fi
  for group in "${before[@]}"; do
    echo $$ > "$group/cgroup.procs"
    find "$group/$own" -depth -type d -exec rmdir {} + 2> /dev/null || true
  done
}
trap ended EXIT
trap 'exit 143' TERM INT

REBOOT=133 # systemd-nspawn(1)
status=$REBOOT
while [[ $status == "$REBOOT" ]]; do
  status=0
  boot
  wait "$container" || status=$?
done
[[ $status == 0 ]]
