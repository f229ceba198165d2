import pytest
from daemon_process import ROOT

from device.measurement.quantities import InvalidQuantity
from host_tools.release.lock import needed, read_lock
from host_tools.release.target import OLDEST_GLIBC_MINOR, SYSTEMS, Target

AARCH64 = Target.named("aarch64")
HASH = f"--hash=sha256:{'0' * 64}"


def written(tmp_path, text):
    path = tmp_path / "device.lock"
    path.write_text(text)
    return path


@pytest.mark.parametrize("system", SYSTEMS)
def test_the_projects_own_lock_has_one_version_of_everything_for_each_machine_and_system(system):
    lock = read_lock(ROOT / "requirements" / "device.lock")
    for machine in OLDEST_GLIBC_MINOR:
        names = [one.name for one in needed(lock, Target.named(machine, system))]
        assert {"numpy", "onnxruntime", "gpiod", "uvicorn"} <= set(names)
        assert names == sorted(set(names))
    assert all(one.hashes for one in lock)


def test_a_marker_is_asked_of_the_target_and_not_of_this_machine(tmp_path):
    text = (
        f"numpy==2.4 ; python_full_version < '3.12' {HASH}\nnumpy==2.5 ; python_full_version >= '3.12' {HASH}\n"
        f"gpiod==2 ; sys_platform == 'linux' {HASH}\ncolorama==1 ; sys_platform == 'win32' {HASH}\n"
        f"arm-only==1 ; platform_machine == 'aarch64' {HASH}\n"
    )
    lock = read_lock(written(tmp_path, text))
    assert [one.pinned for one in needed(lock, AARCH64)] == ["arm-only==1", "gpiod==2", "numpy==2.4"]
    assert [one.pinned for one in needed(lock, Target.named("x86_64"))] == ["gpiod==2", "numpy==2.4"]
    assert [one.pinned for one in needed(lock, Target.named("x86_64", "trixie"))] == ["gpiod==2", "numpy==2.5"]


def test_all_hashes_of_a_continued_line_count(tmp_path):
    text = f"numpy==2.4 \\\n    --hash=sha256:{'a' * 64} \\\n    --hash=sha256:{'b' * 64}\n    # via tsis\n"
    assert read_lock(written(tmp_path, text))[0].hashes == {"a" * 64, "b" * 64}


@pytest.mark.parametrize("line", ["numpy==2.4", f"numpy>=2.4 {HASH}", f"numpy {HASH}", f"-e . {HASH}", "--pre"])
def test_a_line_that_pins_nothing_is_refused_by_name(tmp_path, line):
    with pytest.raises(InvalidQuantity, match="run `make lock`"):
        read_lock(written(tmp_path, f"{line}\n"))


def test_two_versions_for_one_target_are_refused(tmp_path):
    lock = read_lock(written(tmp_path, f"numpy==2.4 {HASH}\nNumPy==2.5 {HASH}\n"))
    with pytest.raises(InvalidQuantity, match="numpy==2.4 and NumPy==2.5, but must be one version of each"):
        needed(lock, AARCH64)
