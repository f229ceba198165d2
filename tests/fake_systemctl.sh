#!/bin/sh
# A `systemctl` for tests of updates: it starts and kills tests/fake_daemon.py. An update calls it many times: a shell
# starts in a tenth of the time that Python takes. TSIS_FAKE_PYTHON runs TSIS_FAKE_DAEMON.
state="$TSIS_FAKE_STATE" verb="" before=""
for word in "$@"; do
    before="$verb" verb="$word"
done
[ "$verb" = tsis.service ] && verb="$before"
echo "$*" >>"$state/systemctl.log"

# The daemon runs; one that has ended and is nobody's child any more counts as gone.
alive() {
    pid="" seen=""
    read -r pid <"$state/daemon.pid" 2>/dev/null
    [ -n "$pid" ] && read -r seen <"/proc/$pid/stat" 2>/dev/null
    case "${seen##*) }" in
    "" | Z* | X*) return 1 ;;
    esac
}

if [ -e "$state/refused" ] && grep -qw -e "$verb" "$state/refused"; then
    echo "Failed to $verb: as the test asked." >&2
    exit 1
fi
if [ "$verb" = stop ] && [ ! -e "$TSIS_FAKE_ROOT/opt/tsis/current" ]; then
    echo "Failed to stop tsis.service: Unit tsis.service not loaded." >&2
    exit 5
fi
if [ "$verb" = start ] && ! alive; then
    if [ -n "$TSIS_FAKE_ON_START" ]; then
        sh -c "$TSIS_FAKE_ON_START" || exit 1
    fi
    setsid "$TSIS_FAKE_PYTHON" -S -E "$TSIS_FAKE_DAEMON" </dev/null >/dev/null 2>&1 &
    echo $! >"$state/daemon.pid"
fi
if [ "$verb" = stop ] && alive; then
    kill -9 "$pid"
    while alive; do
        sleep 0.005
    done
fi
exit 0
