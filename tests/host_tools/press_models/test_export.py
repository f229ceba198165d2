"""The bundle of the ramp modes: the networks NumPy has, surrogates and noise, both modes' critical values."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
from model_card import edit_card, write_card
from small_surrogate import COLUMNS, random_scan_surrogate, white_noise

from device.files.bundle_file import read_ramp_model
from device.measurement.bundle import BundleRefused
from device.measurement.parameters import HIGH, NUISANCES, PARAMETERS, RANGES, normalise_unknowns
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.ellipticity import elongation_deviations
from device.measurement.ramp_modes.model import RAMP_MODES, SURROGATE_FILE, CriticalValues, RampModel
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.radial_profile import NETWORK_NAMES, PROFILE_FORCES_N, network_rows
from device.measurement.ramp_modes.range_classifier import OUTPUT, RANGE_FILE
from device.measurement.ramp_modes.surrogate import OFFSET
from device.measurement.recording.ring_means import RINGS
from host_tools.paper_network.export_refused import ExportRefused
from host_tools.press_models import export as exporting
from host_tools.press_models.dense_network import LARGEST_LOG_VARIANCE, DenseLayer, InputScaling, initial_layers
from host_tools.press_models.export import GOLDEN_ROWS, export_ramp
from host_tools.press_models.mode_outcome import EvaluatedPresses, ModeOutcome
from host_tools.press_models.onnx_networks import build_network, build_range_network, physical_estimate
from host_tools.press_models.press_samples import PressSamples, draw_parameters
from host_tools.press_models.ramp_training import DRY_RUN, TrainedRamp
from host_tools.press_models.train_ensemble import DenseEnsemble
from host_tools.press_models.train_range import DEPTHS, SIZES, RangeNetwork, TrainedRange

SERIALS = ("SIM-0001", "SIM-0002")
PRESSES = 40


READ = len(NETWORK_NAMES)


def made_ensemble(read: np.ndarray, log_variance: float = -2.0) -> DenseEnsemble:
    """Return networks of rows [n, F] as `network_rows` gives them."""
    scaling = InputScaling.fit(read, np.eye(READ))
    members = []
    for seed in (1, 2):
        *hidden, last = initial_layers(2 * scaling.projection.shape[1], np.random.default_rng(seed))
        biases = np.repeat(np.float32([0.1, log_variance]), len(UNKNOWNS))
        members.append([*hidden, DenseLayer(0.5 * last.weights, biases)])
    return DenseEnsemble(scaling, tuple(members))


def made_outcome(misfit_ratio: float) -> ModeOutcome:
    truth = np.random.default_rng(7).uniform(-1, 1, (64, 3))
    seen = EvaluatedPresses(truth, truth + 0.05, truth - 0.1, truth + 0.2, np.ones((64, 3), bool))
    return ModeOutcome(CriticalValues(misfit_ratio, 2.0 + misfit_ratio, 0.3, 0.9), seen, seen, np.repeat([2, 3], 32))


def made_ranges(read: np.ndarray) -> TrainedRange:
    scaling, rng = InputScaling.fit(read, np.eye(READ)), np.random.default_rng(3)
    members = tuple(initial_layers(2 * scaling.projection.shape[1], rng, outputs=1) for _ in "ab")
    return TrainedRange(RangeNetwork(scaling, members), np.array([2e-4, 4e-4]), "0123", DRY_RUN.ranges)


@pytest.fixture(scope="module")
def trained() -> TrainedRamp:
    rng = np.random.default_rng(5)
    rows = rng.normal(0, 0.2, (PRESSES, COLUMNS))
    return TrainedRamp(
        answers=RampAnswers(random_scan_surrogate(), white_noise(2e-3, ErrorLevels())),
        surrogate_error=np.array([1e-4, 3e-4]),
        beside_error=np.array([2e-4, 5e-4]),
        ensemble=made_ensemble(network_rows(rows)),
        ranges=made_ranges(network_rows(rows)),
        outcomes={"standard": made_outcome(1.3), "precise": made_outcome(1.2)},
        samples=PressSamples(draw_parameters(PRESSES, rng), rows, rng.uniform(0, 2 * np.pi, PRESSES)),
        budget=DRY_RUN,
        seed=11,
    )


@pytest.fixture(scope="module")
def read(trained: TrainedRamp) -> np.ndarray:
    """What networks read of the presses of the training [n, F]."""
    return network_rows(trained.samples.rows)


def write(trained: TrainedRamp, folder: Path) -> Path:
    export_ramp(trained, folder, serials=SERIALS, software_version="1.2.3", training_command="host_tools train x")
    return folder


@pytest.fixture(scope="module")
def folder(trained: TrainedRamp, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(trained, tmp_path_factory.mktemp("models") / "demo")


@pytest.fixture(scope="module")
def model(folder: Path) -> RampModel:
    return read_ramp_model(folder)


def run(network: bytes, rows: np.ndarray) -> list[np.ndarray]:
    session = onnxruntime.InferenceSession(network, providers=["CPUExecutionProvider"])
    return session.run(["estimate", "spread"], {"features": rows.astype(np.float32)})


def test_the_exported_network_computes_what_numpy_does(trained: TrainedRamp) -> None:
    """Single precision all along: a few of its roundings of 6e-8."""
    rows = np.random.default_rng(8).normal(0, 0.3, (200, READ)).astype(np.float32)
    found = run(build_network(trained.ensemble), rows)
    for theirs, ours in zip(found, physical_estimate(trained.ensemble, rows.astype(float)), strict=True):
        assert theirs.dtype == np.float32
        np.testing.assert_allclose(theirs, ours, rtol=2e-5)
        assert np.std(ours, axis=0).min() > 0


def test_what_nobody_knows_is_held_at_the_largest_variance_in_both(read: np.ndarray) -> None:
    """So a spread is exp(1/2), or more where the members disagree."""
    ensemble = made_ensemble(read, log_variance=9.0)
    found = run(build_network(ensemble), read)[1]
    expected = physical_estimate(ensemble, read.astype(np.float32).astype(float))[1]
    np.testing.assert_allclose(found, expected, rtol=2e-5)
    assert found.min() == pytest.approx(np.exp(LARGEST_LOG_VARIANCE / 2), rel=0.1)
    assert found.min() >= np.exp(LARGEST_LOG_VARIANCE / 2) - 1e-5


def test_coordinates_of_the_network_are_millimetres_and_kilopascals(trained: TrainedRamp, read: np.ndarray) -> None:
    """Networks that always say 0.1: size 8.5 + 0.65, depth 8 + 0.4, modulus 40 x 4 to the power 0.1."""
    still = [
        [*layers[:-1], DenseLayer(0 * layers[-1].weights, layers[-1].biases)] for layers in trained.ensemble.members
    ]
    ensemble = replace(trained.ensemble, members=tuple(still))
    estimate, spread = run(build_network(ensemble), read)
    np.testing.assert_allclose(estimate, np.tile([9.15, 8.4, 40 * 4**0.1], (PRESSES, 1)), rtol=1e-5)
    np.testing.assert_allclose(spread, np.exp(-1), rtol=1e-5)


def test_the_device_gets_back_the_networks_coordinates_as_first_guesses(trained, model, read) -> None:
    found, expected = model.first_guesses(trained.samples.rows), trained.ensemble.estimate(read)[0]
    np.testing.assert_allclose(found, expected, atol=1e-5)
    assert found.shape == (PRESSES, len(UNKNOWNS))
    physical = physical_estimate(trained.ensemble, read)[0]
    np.testing.assert_allclose(found, normalise_unknowns(physical), atol=1e-5)


def test_the_device_gets_back_both_surrogates_and_the_noise(trained: TrainedRamp, model: RampModel) -> None:
    """The surrogates to single precision; error levels are the usual ones."""
    normalised = np.random.default_rng(9).uniform(-1, 1, (20, len(PARAMETERS)))
    normalised[10:, OFFSET] = 2 * np.linspace(2.5, 8.0, 10) / HIGH[OFFSET] - 1
    found, made = model.answers.surrogate, trained.answers.surrogate
    assert (found.near.to_mm, found.beside.from_mm, found.to_mm) == (2.0, 2.0, made.to_mm)
    direction_rad = np.random.default_rng(12).uniform(0, 2 * np.pi, 20)
    expected = made.rows(normalised, direction_rad)
    np.testing.assert_allclose(found.rows(normalised, direction_rad), expected, atol=1e-5 * np.abs(expected).max())
    np.testing.assert_array_equal(model.answers.noise.camera, trained.answers.noise.camera)
    assert model.answers.noise.levels == ErrorLevels()


def test_the_device_tells_as_many_deviations_from_round_as_the_training(trained, model) -> None:
    """To single precision of the surrogate."""
    second = np.random.default_rng(10).normal(0, 0.1, (2, len(PROFILE_FORCES_N), RINGS - 2))
    best = np.random.default_rng(11).uniform(-0.5, 0.5, len(PARAMETERS))
    direction_rad = np.array([0.7])
    found, expected = (
        elongation_deviations(second, one.answers.surrogate.rows(best[None], direction_rad)[0], one.answers.noise)
        for one in (model, trained)
    )
    assert found == pytest.approx(expected, rel=1e-3)
    assert expected > 1


def test_the_device_gets_back_the_log_odds(trained: TrainedRamp, model: RampModel) -> None:
    rows = np.random.default_rng(8).normal(0, 0.3, (50, COLUMNS)).astype(np.float32).astype(float)
    found, expected = model.ranges.log_odds(rows), trained.ranges.network.log_odds(network_rows(rows))
    np.testing.assert_allclose(found, expected, atol=2e-5)
    assert np.std(expected) > 0.01


def test_the_card_tells_how_wide_the_networks_of_the_ranges_have_seen(trained, folder, model) -> None:
    entry = model.bundle.card["range"]
    assert entry["sha256"] == hashlib.sha256((folder / RANGE_FILE).read_bytes()).hexdigest()
    assert (entry["size_mm"], entry["depth_mm"]) == (list(SIZES), list(DEPTHS))
    assert entry["dataset_sha256"] == "0123"
    budget = DRY_RUN.ranges
    assert (entry["effort"]["pool"], entry["effort"]["steps"]) == (budget.trained_on, budget.steps)
    assert entry["surrogate_error"] == {"largest": 4e-4, "mean": pytest.approx(3e-4)}
    expected = trained.ranges.network.log_odds(np.array(model.bundle.card["golden"]["features"]))
    assert list(entry["golden"]) == [OUTPUT]
    np.testing.assert_allclose(entry["golden"][OUTPUT], expected, atol=2e-5)


def test_networks_of_the_ranges_that_differ_from_numpy_are_refused(trained, tmp_path, monkeypatch) -> None:
    wrong = build_range_network(made_ranges(network_rows(trained.samples.rows * 1.01)).network)
    monkeypatch.setattr(exporting, "build_range_network", lambda network: wrong)
    with pytest.raises(ExportRefused, match="^standard of the exported network of the ranges differs from NumPy"):
        write(trained, tmp_path / "demo")
    assert list(tmp_path.iterdir()) == []


def test_the_device_gets_back_the_critical_values_of_each_mode(trained: TrainedRamp, model: RampModel) -> None:
    assert set(model.critical) == set(RAMP_MODES)
    for mode, misfit_ratio in (("standard", 1.3), ("precise", 1.2)):
        assert asdict(model.critical[mode]) == asdict(CriticalValues(misfit_ratio, 2.0 + misfit_ratio, 0.3, 0.9))


def test_the_card_tells_for_which_probes_and_ranges_and_where_it_comes_from(trained, folder, model) -> None:
    card = model.bundle.card
    assert tuple(card["serials"]) == SERIALS
    assert (card["name"], card["software_version"], card["seed"]) == ("demo", "1.2.3", 11)
    assert card["training_command"] == "host_tools train x"
    assert card["effort"]["members"] == DRY_RUN.members
    assert card["effort"]["judged"] == DRY_RUN.evaluated
    assert card["effort"]["ranges"]["pool"] == DRY_RUN.ranges.trained_on
    assert card["dataset_sha256"] == hashlib.sha256(trained.samples.rows.tobytes()).hexdigest()
    assert card["sha256"] == hashlib.sha256((folder / "model.onnx").read_bytes()).hexdigest()
    assert card["surrogate_sha256"] == hashlib.sha256((folder / SURROGATE_FILE).read_bytes()).hexdigest()
    assert (card["surrogate_error"]["largest"], card["surrogate_error"]["mean"]) == pytest.approx((3e-4, 2e-4))
    assert (card["beside_error"]["largest"], card["beside_error"]["mean"]) == pytest.approx((5e-4, 3.5e-4))
    ranges = card["training_range"]
    assert {name: tuple(ends) for name, ends in (ranges["unknowns"] | ranges["nuisances"]).items()} == {
        name: (RANGES[name].low, RANGES[name].high) for name in (*UNKNOWNS, *NUISANCES)
    }
    name, column = NETWORK_NAMES[-1], network_rows(trained.samples.rows)[:, -1]
    assert ranges["features"][name] == [column.min(), column.max()]
    assert tuple(feature["name"] for feature in card["features"]) == NETWORK_NAMES


def test_the_card_states_each_modes_errors_on_simulated_and_on_recorded_presses(model: RampModel) -> None:
    """Answers 0.05 of a coordinate too high: 0.2 mm of the depth."""
    for mode in ("standard", "precise"):
        entry = model.bundle.card["modes"][mode]
        for kind in ("simulated", "recorded"):
            assert entry[kind]["presses"] == 64
            assert entry[kind]["depth_mm"]["skill"] == pytest.approx(1 - 0.05 * np.sqrt(3), rel=1e-3)
            assert entry[kind]["joint"] == {"size_and_depth": 1.0, "all": 1.0}
            assert entry[kind]["size_mm"]["interval_score"] == pytest.approx(0.3)


def test_the_card_of_a_scan_says_how_narrow_intervals_become(model: RampModel) -> None:
    """Intervals of 0.3 coordinates: 0.6 mm of the depth either way, in scans of two ramps and of three."""
    card = model.bundle.card["modes"]
    assert card["precise"]["reachable_half_width"]["depth_mm"] == pytest.approx(0.6)
    assert list(card["precise"]["half_width_by_ramps"]) == ["2", "3"]
    assert card["precise"]["half_width_by_ramps"]["3"]["depth_mm"] == pytest.approx([0.6] * 19)
    assert not card["standard"].keys() & {"reachable_half_width", "half_width_by_ramps"}


def test_golden_rows_are_of_the_training_and_spread_over_it(trained: TrainedRamp, model: RampModel) -> None:
    golden = model.bundle.card["golden"]
    features = np.array(golden["features"])
    assert features.shape == (GOLDEN_ROWS, READ)
    chosen = trained.samples.rows[:: PRESSES // GOLDEN_ROWS].astype(np.float32)
    np.testing.assert_array_equal(features, network_rows(chosen.astype(float)))
    np.testing.assert_allclose(golden["estimate"], physical_estimate(trained.ensemble, features)[0], rtol=1e-4)
    np.testing.assert_allclose(golden["spread"], physical_estimate(trained.ensemble, features)[1], rtol=1e-4)


def test_the_same_parts_give_the_same_bytes(trained: TrainedRamp, folder: Path, tmp_path: Path) -> None:
    twice = folder, write(trained, tmp_path / "demo")
    first, again = ({path.name: path.read_bytes() for path in at.iterdir()} for at in twice)
    assert first == again
    assert set(first) == {"model.onnx", "model.json", "model.json.sha256", SURROGATE_FILE, RANGE_FILE}


def changed(trained: TrainedRamp, tmp_path: Path, file: str) -> Path:
    folder = write(trained, tmp_path / "demo")
    content = bytearray((folder / file).read_bytes())
    content[len(content) // 2] ^= 1
    (folder / file).write_bytes(bytes(content))
    return folder


@pytest.mark.parametrize(
    ("file", "named"),
    [
        (SURROGATE_FILE, "surrogate.npz is [0-9a-f]{64}"),
        (RANGE_FILE, "range.onnx is [0-9a-f]{64}"),
        ("model.onnx", "sha256"),
    ],
)
def test_a_changed_bit_is_refused_by_the_device(trained, tmp_path, file, named) -> None:
    with pytest.raises(BundleRefused, match=named):
        read_ramp_model(changed(trained, tmp_path, file))


@pytest.mark.parametrize("file", [SURROGATE_FILE, RANGE_FILE])
def test_a_missing_file_is_refused_by_the_device(trained: TrainedRamp, tmp_path: Path, file: str) -> None:
    folder = write(trained, tmp_path / "demo")
    (folder / file).unlink()
    with pytest.raises(BundleRefused, match=f"{file} is missing, but must be in the bundle's folder"):
        read_ramp_model(folder)


def test_a_card_that_states_no_hash_of_the_surrogate_is_refused_by_the_device(trained, tmp_path) -> None:
    folder = write(trained, tmp_path / "demo")
    edit_card(folder, lambda card: card.pop("surrogate_sha256"))
    with pytest.raises(BundleRefused, match=r"hash of surrogate.npz is missing, but must be in the card: use a bundle"):
        read_ramp_model(folder)


@pytest.mark.parametrize("value", ["none", None, [1.0]])
def test_a_critical_value_that_is_no_number_is_refused_by_the_device(trained, tmp_path, value) -> None:
    folder = write(trained, tmp_path / "demo")
    edit_card(folder, lambda card: card["modes"]["standard"].update(misfit_ratio=value))
    with pytest.raises(BundleRefused, match="modes"):
        read_ramp_model(folder)


def test_a_card_without_a_modes_usual_elongation_is_refused_by_the_device(trained, tmp_path) -> None:
    folder = write(trained, tmp_path / "demo")
    card = json.loads((folder / "model.json").read_text())
    del card["modes"]["precise"]["elongation_deviations"]
    write_card(folder, json.dumps(card))
    with pytest.raises(BundleRefused, match="elongation_deviations"):
        read_ramp_model(folder)


def test_a_card_without_limits_is_refused_by_the_device(trained, tmp_path) -> None:
    folder = write(trained, tmp_path / "demo")
    card = json.loads((folder / "model.json").read_text())
    del card["modes"]
    write_card(folder, json.dumps(card))
    with pytest.raises(BundleRefused, match="incomplete .*modes"):
        read_ramp_model(folder)


def test_a_network_that_differs_from_numpy_is_refused_and_nothing_is_written(trained, tmp_path, monkeypatch) -> None:
    """An output bias off by 1e-2 moves a size of some 8.5 mm by 65 um: nearly a hundredth."""
    members = [
        [*layers[:-1], DenseLayer(layers[-1].weights, layers[-1].biases + np.float32(1e-2))]
        for layers in trained.ensemble.members
    ]
    wrong = build_network(replace(trained.ensemble, members=tuple(members)))
    monkeypatch.setattr(exporting, "build_network", lambda ensemble: wrong)
    with pytest.raises(ExportRefused, match="differs from NumPy by"):
        write(trained, tmp_path / "demo")
    assert list(tmp_path.iterdir()) == []
