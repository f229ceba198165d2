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
answers() { (: > "/dev/tcp/127.0.0.1/$1") 2> /dev/null; }
for port in 8000 18022 18091; do
  if answers "$port"; then echo "Port $port is taken on this machine, whose ports the container shares."; exit 1; fi
done

console=$folder/console.txt
mkdir -p "$folder"
"$here/make_root.sh" "$folder/bare" > "$console" 2>&1 || cannot "no Debian can be fetched: $(tail -n 1 "$console")"
"$here/container.sh" "$folder" > "$console" 2>&1 &
container=$!
ended() {
  for process in "${stories:-}" "$container"; do
    if [[ -n $process ]] && kill "$process" 2> /dev/null; then wait "$process" || true; fi
  done
}
trap ended EXIT
trap 'exit 143' TERM INT
until answers 18022; do
  kill -0 "$container" 2> /dev/null || cannot "no container starts here: $(tail -n 1 "$console")"
  ((SECONDS < 300)) || cannot "the container does not boot: $(tail -n 1 "$console")"
  sleep 1
done
cd "$project"
PYTHONPATH="$here" "$project/.venv/bin/python" -m stories "$folder" &
stories=$!
wait "$stories"
