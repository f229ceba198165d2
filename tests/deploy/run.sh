#!/usr/bin/env bash
# Makes a container a probe and sends it releases, good and bad, as an operator at a workstation would: run.sh FOLDER.
# Prints one line a claim; exits 1 when one does not hold, 77 with the reason where no container can be started.
set -euo pipefail
folder=$(realpath -m "$1")
here=$(dirname "$(realpath "$0")")
project=$(realpath "$here/../..")
cannot() { echo "skipped: $1"; exit 77; }

[[ $(id -u) == 0 ]] || cannot "a container needs root: run this with sudo."
command -v debootstrap > /dev/null || [[ -e $folder/bare/complete ]] || cannot "debootstrap is missing."
unshare --mount --propagation private true 2> /dev/null || cannot "this machine lets nobody have mounts of his own."
[[ -e /dev/loop-control ]] || cannot "this machine has no loop devices."
for port in 8000 18022 18091; do
  ! (: > "/dev/tcp/127.0.0.1/$port") 2> /dev/null || { echo "Port $port is taken on this machine, which the container shares."; exit 1; }
done

mkdir -p "$folder"
"$here/container.sh" "$folder" > "$folder/console.txt" 2>&1 &
container=$!
ended() {
  if kill "$container" 2> /dev/null; then wait "$container" || true; fi
}
trap ended EXIT
trap 'exit 143' TERM INT
cd "$project"
PYTHONPATH="$here" "$project/.venv/bin/python" -m stories "$folder"
