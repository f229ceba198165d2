"""Calibration on phantoms of a file: their truths and tissue count, and what contradicts the recordings is told."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.scenario import Scenario
from host_tools.calibration.calibrate import calibrate
from host_tools.calibration.gates import CalibrationRejected
from host_tools.calibration.known_bench import KnownBench, on_bench
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.scenes.phantom_set import PhantomSet, StatedPhantom
from host_tools.scenes.probe_file import simulated_probe
from host_tools.scenes.scene import Press, Scene, Tissue, Waveguide

DESIGNS = [
    (14.0, 4.5, 110.0),
    (12.0, 7.0, 60.0),
    (9.0, 5.0, 80.0),
    (11.0, 9.0, 100.0),
    (6.0, 6.0, 50.0),
    (8.0, 4.5, 90.0),
]
NAMES = [f"A{i}" for i in range(len(DESIGNS))]
TISSUE_KPA = 6.0


def phantom(name, truth, tissue_kpa=TISSUE_KPA):
    size, depth, modulus = (
        (value, tolerance, "calliper") for value, tolerance in zip(truth, (0.1, 0.1, 2.0), strict=True)
    )
    return StatedPhantom(name, "dusted", tissue_kpa, 0.1, "cylinder", 30.0, 0.2, "calliper", *size, *depth, *modulus)


BLOCK = StatedPhantom("B0", "dusted", TISSUE_KPA, 0.1, "cylinder", 30.0, 0.2, "calliper")
SET = PhantomSet("PH-7", (*(phantom(*one) for one in zip(NAMES, DESIGNS, strict=True)), BLOCK))


def recorded(tables, tissue_kpa):
    """In the paper's light, in which an image follows the deformation by one line whatever the tissue."""
    made_of = Scenario(light="linear", tissue_modulus_kpa=tissue_kpa)
    protocol = PhantomProtocol(frames=3)
    return [
        phantom_recording(Inclusion(*truth), tables, seed=i, protocol=protocol, scenario=made_of)
        for i, truth in enumerate(DESIGNS)
    ]


@pytest.fixture(scope="module")
def stiffer(tables):
    return recorded(tables, TISSUE_KPA)


@pytest.mark.long
def test_with_the_tissue_of_the_file_the_lines_are_nearer_those_of_tissue_of_5_kpa(stiffer, tables, bundle, table):
    """Phantoms of 6 kPa: slopes off by 7 and 10 % where 5 kPa is assumed, by 3 and 4 % where it is known.

    The rest is no mistake: the image is a ratio to a reference press, which stiffer tissue changes as well.
    """
    of_nominal = calibrate(recorded(tables, 5.0), bundle, table, force_n=0.5).certificate
    made, bench = on_bench(stiffer, NAMES, None, SET)
    known = calibrate(made, bundle, table, force_n=0.5, bench=bench).certificate
    assumed = calibrate(stiffer, bundle, table, force_n=0.5).certificate
    slopes = [np.array([line.slope for line in one.lines.regressions[:2]]) for one in (of_nominal, known, assumed)]
    of_known, of_assumed = (np.abs(one / slopes[0] - 1) for one in slopes[1:])
    assert (of_known < 0.5 * of_assumed).all()
    assert (of_known < 0.05).all()
    assert known.phantom_serial == "PH-7"


def test_the_features_of_a_line_are_solved_in_the_phantoms_tissue_under_the_probe():
    waveguide = Waveguide(layer_moduli_kpa=(90.0, 40.0, 20.0))
    scene = KnownBench(waveguide, (SET.phantoms[0].tissue,)).scene(0, Inclusion(*DESIGNS[0]), 0.5)
    assert scene == Scene(
        Inclusion(*DESIGNS[0]), Press(force_n=0.5), waveguide, Tissue(youngs_modulus_kpa=6.0, thickness_mm=30.0)
    )


def test_without_files_nothing_changes(stiffer):
    made, bench = on_bench(stiffer, NAMES, None, None)
    assert made == stiffer
    assert (bench.waveguide, bench.tissues, bench.contradictions) == (Waveguide(), (), ())
    scene = bench.scene(0, Inclusion(10.0, 6.0, 80.0), 0.5)
    assert (scene.tissue.youngs_modulus_kpa, scene.press.force_n) == (5.0, 0.5)


def test_a_recording_is_known_by_its_name_or_else_by_its_truth_and_has_the_files_numbers(stiffer):
    entered = [replace(one, truth=Inclusion(one.truth.size_mm + 0.2, *one.truth.as_tuple()[1:])) for one in stiffer]
    for names in (NAMES, [f"recording{i}" for i in range(len(NAMES))]):
        made, bench = on_bench(entered, names, None, SET)
        assert bench.contradictions == ()
        assert [one.truth.as_tuple() for one in made] == DESIGNS
    made, _ = on_bench([replace(one, truth=None) for one in stiffer], NAMES, None, SET)
    assert [one.truth.as_tuple() for one in made] == DESIGNS


def test_one_inclusion_in_two_tissues_is_told_by_name_alone(stiffer):
    both = PhantomSet("PH-7", (*SET.phantoms, phantom("C0", DESIGNS[0], 4.4)))
    _, bench = on_bench(stiffer[:1], ["C0"], None, both)
    assert (bench.contradictions, bench.tissues[0].youngs_modulus_kpa) == ((), 4.4)
    _, bench = on_bench(stiffer[:1], ["recording"], None, both)
    assert "phantom of recording is A0 and C0, but must be one of the set" in str(bench.contradictions[0])


def test_all_that_contradicts_the_files_is_told_at_once_with_all_else(stiffer, bundle, table):
    probe = replace(simulated_probe(), cell=replace(simulated_probe().cell, counts_per_n=90_000.0))
    wrong = [
        stiffer[0],
        replace(stiffer[1], truth=Inclusion(12.0, 8.0, 60.0)),
        replace(stiffer[2], phantom_serial="PH-3"),
        stiffer[3],
    ]
    made, bench = on_bench(wrong, ["B0", "A1", "A2", "A3"], probe, SET)
    with pytest.raises(CalibrationRejected) as rejection:
        calibrate(made, bundle, table, force_n=0.5, bench=bench)
    found = [problem.quantity.partition(" of ") for problem in rejection.value.problems]
    assert [name for name, _, _ in found].count("serial") == [name for name, _, _ in found].count("counts_per_n") == 4
    assert [f"{name} of {which}" for name, _, which in found if which in ("B0", "A1", "A2")] == [
        "phantom of B0",
        "truth of A1",
        "phantom_serial of A2",
    ]
    assert found[-1][0] == "phantoms"
