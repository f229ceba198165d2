#!/usr/bin/env bash
# Runs the camera's contract test on the real picamera2 and libcamera's virtual camera: run.sh FOLDER [PYTEST ARGUMENT]...
set -euo pipefail
root=$1
shift
here=$(dirname "$(realpath "$0")")
"$here/make_root.sh" "$root"
rm -rf "$root/src"
mkdir "$root/src"
tar -C "$here/../.." --exclude=__pycache__ -cf - device tests | tar -C "$root/src" -xf -
# The conftest of all tests needs the workstation's packages; libcamera's own warnings are not ours.
exec chroot "$root" /usr/bin/env -C /src TSIS_LIBCAMERA=1 LD_PRELOAD=/opt/tsis/dmabuf_shim.so \
  LIBCAMERA_LOG_LEVELS='*:ERROR' PYTHONPATH=/src:/src/tests/libcamera \
  /venv/bin/python -m pytest --noconftest -p no:cacheprovider -q tests/device/hardware/test_camera_contract.py "$@"
