"""The updater needs nothing: no site-packages, no clock. From a wheel on the path it installs on a bare system."""

import shutil
import subprocess
import sys
import zipfile

import pytest
from daemon_process import ROOT
from updated_probe import QUICK

RUN = (
    "import runpy, sys; sys.path.insert(0, sys.argv.pop(1)); runpy.run_module('device.update', None, '__main__', True)"
)
CLOCK = """
#include <time.h>
#include <sys/time.h>
#include <sys/syscall.h>
#include <unistd.h>
time_t time(time_t *t) { if (t) *t = 4000; return 4000; }
int gettimeofday(struct timeval *t, void *z) { t->tv_sec = 4000; t->tv_usec = 0; return 0; }
int clock_gettime(clockid_t which, struct timespec *t) {
    if (which != CLOCK_REALTIME) return syscall(SYS_clock_gettime, which, t);
    t->tv_sec = 4000; t->tv_nsec = 0; return 0;
}
"""


@pytest.fixture
def packed(tmp_path):
    """Our code as a wheel has it, alone in a folder."""
    path = tmp_path / "alone" / "tsis-1.0-py3-none-any.whl"
    path.parent.mkdir()
    with zipfile.ZipFile(path, "w") as archive:
        for module in (ROOT / "device").rglob("*.py"):
            archive.write(module, module.relative_to(ROOT))
    return path


def from_wheel(probe, packed, *words):
    command = [sys.executable, "-S", "-s", "-E", "-c", RUN, str(packed), *words]
    environment = {name: value for name, value in probe.environment.items() if name != "PYTHONPATH"}
    return subprocess.run(command, env=environment, cwd=packed.parent, capture_output=True, text=True, timeout=60)


def test_the_wheel_alone_says_its_verbs(probe, packed):
    done = from_wheel(probe, packed, "--help")
    assert (done.returncode, done.stderr) == (0, "")
    assert "watch-incoming" in done.stdout


def test_the_wheel_alone_installs_a_release_on_a_system_without_any_of_our_folders(probe, packed):
    shutil.rmtree(probe.root / "opt")
    shutil.rmtree(probe.root / "var")
    file = probe.write("1.0", 10)
    done = from_wheel(probe, packed, "--root", str(probe.root), *QUICK, "install", str(file))
    assert (done.returncode, done.stderr) == (0, "")
    assert probe.require_whole() == "1.0+10"


def test_the_daemons_command_line_hands_the_verb_on(probe):
    command = [sys.executable, "-m", "device", "--root", str(probe.root), "update", "status", "--json"]
    done = subprocess.run(command, env=probe.environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert '"current": null' in done.stdout


def test_a_clock_in_1970_hinders_no_update(probe, tmp_path):
    compiler = shutil.which("cc")
    if not compiler:
        pytest.skip("no C compiler to set a process's clock with")
    (tmp_path / "clock.c").write_text(CLOCK)
    shim = tmp_path / "clock.so"
    subprocess.run([compiler, "-shared", "-fPIC", "-o", str(shim), str(tmp_path / "clock.c")], check=True)
    probe.environment["LD_PRELOAD"] = str(shim)
    seen = probe.run_code("-c", "import time; print(time.gmtime().tm_year)")
    assert seen.stdout == "1970\n"
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    assert {event.at for event in probe.state.history} == {"1970-01-01T01:06:40Z"}
    evil = probe.run("install", probe.write("1.0", 10))
    assert evil.returncode == 1
