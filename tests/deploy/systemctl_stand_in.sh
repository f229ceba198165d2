#!/bin/sh
# What an emulated Debian has for systemctl: the daemon of /opt/tsis/current, simulated, started and stopped by hand.
# Of the caller nothing is passed on, as by systemd.
unset PYTHONPATH
running=/run/tsis-daemon.pid
case "$*" in
  *stop*)
    [ ! -e "$running" ] || kill "$(cat "$running")" 2> /dev/null
    while [ -e "$running" ] && kill -0 "$(cat "$running")" 2> /dev/null; do sleep 0.2; done
    rm -f "$running"
    ;;
  *start*)
    cd /srv/tsis || exit 1
    /opt/tsis/current/bin/python -m device --simulate --scene slow_scene.toml --port "$(cat port)" > daemon.log 2>&1 < /dev/null &
    echo $! > "$running"
    ;;
esac
