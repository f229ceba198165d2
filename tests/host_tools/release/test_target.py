from pathlib import Path

import pytest

from device.measurement.quantities import InvalidQuantity
from host_tools.release.target import Target


def rank(name: str, machine: str = "aarch64", system: str = "bookworm") -> int | None:
    return Target.named(machine, system).rank(Path(name))


@pytest.mark.parametrize(
    "tag",
    [
        "cp311-cp311-manylinux_2_36_aarch64",
        "cp311-cp311-manylinux2014_aarch64.manylinux_2_17_aarch64",
        "cp37-abi3-manylinux_2_28_aarch64",
        "cp311-none-manylinux_2_34_aarch64",
        "py3-none-manylinux2014_aarch64",
        "py2.py3-none-any",
    ],
)
def test_wheels_that_debian_12_on_an_arm_runs_are_taken(tag):
    assert rank(f"some-1.0-{tag}.whl") is not None


@pytest.mark.parametrize(
    "tag",
    [
        "cp311-cp311-manylinux_2_37_aarch64",  # a newer glibc
        "cp311-cp311-musllinux_1_2_aarch64",
        "cp311-cp311-manylinux_2_28_x86_64",
        "cp311-cp311-linux_aarch64",
        "cp312-cp312-manylinux_2_28_aarch64",
        "cp312-abi3-manylinux_2_28_aarch64",  # the stable interface of a newer Python
        "cp311-cp311-macosx_11_0_arm64",
    ],
)
def test_wheels_that_it_does_not_run_are_not(tag):
    assert rank(f"some-1.0-{tag}.whl") is None


@pytest.mark.parametrize(
    ("tag", "is_taken"),
    [
        ("cp313-cp313-manylinux_2_41_aarch64", True),
        ("cp37-abi3-manylinux_2_28_aarch64", True),
        ("cp313-cp313-manylinux_2_42_aarch64", False),
        ("cp311-cp311-manylinux_2_28_aarch64", False),  # the Python of Debian 12
        ("cp313-cp313t-manylinux_2_28_aarch64", False),  # a Python without its lock
    ],
)
def test_debian_13_runs_wheels_of_its_own_python_and_glibc(tag, is_taken):
    assert (rank(f"some-1.0-{tag}.whl", system="trixie") is not None) is is_taken


def test_a_name_that_is_no_wheels_is_not_taken():
    assert rank("some-1.0.whl") is None


def test_old_names_of_manylinux_count_on_the_other_machine():
    for tag in ("manylinux1_x86_64", "manylinux2010_x86_64", "manylinux_2_5_x86_64"):
        assert rank(f"some-1.0-cp311-cp311-{tag}.whl", "x86_64") is not None
    assert rank("some-1.0-cp311-cp311-manylinux_2_16_aarch64.whl") is None  # there is none such


def test_the_nearest_wheel_is_the_best():
    own, newer = "some-1.0-cp311-cp311-manylinux_2_28_aarch64.whl", "some-1.0-cp311-cp311-manylinux_2_34_aarch64.whl"
    stable, pure = "some-1.0-cp37-abi3-manylinux_2_28_aarch64.whl", "some-1.0-py3-none-any.whl"
    assert sorted([pure, stable, own, newer], key=lambda name: rank(name) or 0) == [newer, own, stable, pure]


def test_another_machine_is_refused_with_those_there_are():
    with pytest.raises(InvalidQuantity, match="machine is 'riscv64', but must be one of aarch64, x86_64"):
        Target.named("riscv64")


def test_another_system_is_refused_with_those_there_are():
    with pytest.raises(InvalidQuantity, match="system is 'buster', but must be one of bookworm, trixie"):
        Target.named("aarch64", "buster")
