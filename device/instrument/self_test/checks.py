"""The checks of the self-test: each measures one part, and says within which bound it must be and what to do if not.

Camera: noise below half a count is hidden by the rounding to whole counts and is given as half a count. Source: EMVA
Standard 1288, temporal noise from the difference of two images of equal exposure, no reliable estimate below 0.24
counts^2.

Light: each side is lit alone on a face that is held on the reference block. The half of the image that is nearer to an
LED is brighter than the opposite one, at the target force by a third; at a tenth of it the far half is brighter, so the
test needs the force. Where the block touches does not matter: each side's light is compared with that of all sides
together. An untouched face is dark by total reflection and tells nothing.
The light of two presses on the block may differ smoothly by about as much as the models believe in.

Model: the network in use was proved at the start; this proves that the next start will find it as it was.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from device.config import Config
from device.errors import ModelError, StorageError
from device.files.bundle_file import read_paper_model, read_quick_model, read_ramp_model
from device.instrument.self_test.report import CheckResult, broken, compared, not_tested
from device.measurement.bundle import GOLDEN_TOLERANCE, BundleRefused, ModelBundle
from device.measurement.quantities import Bound, InvalidQuantity
from device.measurement.recording.led_sides import SIDES
from device.measurement.recording.tactile_image import Counts
from device.records.store import Store

CAMERA = "Camera"
NOISE = Bound(-np.inf, 1.5, "counts")
"""A frame's noise that a mean over ten frames and a ring of pixels still makes small beside an inclusion's light."""
LEAST_NOISE_COUNTS = 0.24**0.5
HOT_COUNTS = 10.0
"""A pixel that is so much above the dark level in every frame is hot."""
HOT_SHARE = Bound(-np.inf, 2e-4, "of pixels")
"""75 of 768 x 492: that many are lost in a ring's mean."""


def camera_results(dark: Sequence[Counts], max_dark_counts: float) -> list[CheckResult]:
    """Return level, noise and hot pixels of an even number of frames [height, width] taken without light.

    `max_dark_counts` includes the black level.
    """
    frames = np.asarray(dark, dtype=np.float32)
    mean = frames.mean(axis=0)
    is_hot = mean > np.median(mean) + HOT_COUNTS
    level = Bound(-np.inf, max_dark_counts, "counts")
    return [
        compared(CAMERA, "dark level", mean.mean(), level, "Shade the probe, and check that no side stays on."),
        compared(
            CAMERA, "noise", _noise_counts(frames[:, ~is_hot]), NOISE, "Let it cool; then have the camera replaced."
        ),
        compared(CAMERA, "hot pixels", is_hot.mean(), HOT_SHARE, "Let it cool; then have the camera replaced."),
    ]


def _noise_counts(values: np.ndarray) -> float:
    """Return the standard deviation (counts) from frame to frame of values [frames, pixels], as far as it is known."""
    pairs = (values[1::2] - values[0::2]) / np.sqrt(2.0)
    return max(float(np.sqrt(np.mean(pairs**2))), LEAST_NOISE_COUNTS)


LIGHT = "Light"
OWN_SIDE = Bound(1.1, np.inf, "times")
"""Light in a side's own half over that in the opposite one.

The simulated probe has 1.3 (+x, -x) and 1.4 (+y, -y) at 0.5 N; swapped plugs have the inverse of it.
"""
BLOCK = "Repeat it with the probe held on the reference block: an untouched face is dark."


def untested_sides(remedy: str = BLOCK) -> list[CheckResult]:
    """Return that no side was tested, and what it takes."""
    return [not_tested(LIGHT, f"LED {side}", remedy) for side in SIDES]


def side_results(
    dark: Counts, lit: Sequence[Counts], ratio: Sequence[float], min_side_ratio: float
) -> list[CheckResult]:
    """Return one result a side, of frames [height, width]: without light, and each side alone at a brightness."""
    halves = np.array([(_halves(counts) - _halves(dark)) / part for counts, part in zip(lit, ratio, strict=True)])
    levels = np.maximum(halves.mean(axis=1), 0.0)
    fewest = Bound(min_side_ratio * float(levels.max()), np.inf, "counts", low_included=False)
    return [
        _side(number, halves) if fewest.holds(levels[number]) else _dark_side(number, levels[number], fewest)
        for number in range(len(SIDES))
    ]


FLAT_FIELD = "flat field"
FLAT_FIELD_RATIO = 2.0
"""Of the level that is believed in. The face shows some 26 independent parts of a field of 2 mm, so one level is known
to a seventh: twice as much is no chance.
"""
NO_RAMP_MODEL = "No model of force ramps is installed, which says how alike presses must be."
UNLIKE_PRESSES = "The two presses cannot be compared: press slowly, and hold it until the screen says so."
WIPE = "Wipe face and block and repeat the test; if it stays, commission the probe again."


def untested_flat_field(remedy: str = BLOCK) -> list[CheckResult]:
    """Return that the flat field was not tested, and what it takes."""
    return [not_tested(LIGHT, FLAT_FIELD, remedy)]


def flat_field_result(level_ratio: float, believed_ratio: float) -> CheckResult:
    """Return whether the light of two presses on the block differs by as little as the models believe."""
    bound = Bound(-np.inf, 100 * FLAT_FIELD_RATIO * believed_ratio, "%")
    return compared(LIGHT, FLAT_FIELD, 100 * level_ratio, bound, WIPE)


def _side(number: int, halves: NDArray[np.float64]) -> CheckResult:
    """Judge a side that gives light: `halves` [sides, halves] has each side's light in each half."""
    share = halves[number] / np.maximum(halves.sum(axis=0), 1e-6)
    opposite = (number + 2) % len(SIDES)
    own_ratio = share[number] / max(share[opposite], 1e-6)
    lights = int(np.argmax(share))
    remedy = "Hold it with its middle on the block and repeat the test."
    if lights != number:
        remedy = f"It lights {SIDES[lights]}: put the plugs of {SIDES[number]} and {SIDES[lights]} where they belong."
    return compared(LIGHT, f"LED {SIDES[number]}", own_ratio, OWN_SIDE, remedy)


def _dark_side(number: int, level: float, fewest: Bound) -> CheckResult:
    remedy = "It gives no light: check the LED board's cable; have the LED replaced."
    return compared(LIGHT, f"LED {SIDES[number]}", level, fewest, remedy)


def _halves(counts: Counts) -> NDArray[np.float64]:
    """Return the mean counts of the right, lower, left and upper half, in the order of `SIDES`: +y is down."""
    height, width = counts.shape
    right, left = counts[:, -(width // 2) :], counts[:, : width // 2]
    lower, upper = counts[-(height // 2) :], counts[: height // 2]
    return np.array([half.mean() for half in (right, lower, left, upper)])


LOAD_CELL = "Load cell"
WEIGHT_TOLERANCE_RATIO = 0.02
"""A calibration holds at one force; an error of the force of 2 % is one of the light by as much."""


def rest_results(force_n: float, zero_shift_n: float, max_rest_n: float, max_shift_n: float) -> list[CheckResult]:
    """Return the zero of the free probe: from the last tare, and from that of commissioning (N)."""
    free = "Hold the probe free and repeat the test; if it stays, tare."
    moved = "Hold the probe free and start again; if it stays, have the load cell checked and commissioned anew."
    rest, shift = Bound(-max_rest_n, max_rest_n, "N"), Bound(-max_shift_n, max_shift_n, "N")
    return [
        compared(LOAD_CELL, "zero", force_n, rest, free),
        compared(LOAD_CELL, "zero since commissioning", zero_shift_n + force_n, shift, moved),
    ]


def weight_result(force_n: float, weight_n: float, max_rest_n: float) -> CheckResult:
    """Return whether a known weight is measured as what it is, within 2 % or the zero's tolerance."""
    tolerance_n = max(WEIGHT_TOLERANCE_RATIO * weight_n, max_rest_n)
    bound = Bound(weight_n - tolerance_n, weight_n + tolerance_n, "N")
    return compared(
        LOAD_CELL, "known weight", force_n, bound, "Check cell.sensitivity_counts_per_n, or calibrate the cell."
    )


def untested_weight(remedy: str = "Repeat it with a known weight.") -> CheckResult:
    """Return that no weight was measured, and what it takes."""
    return not_tested(LOAD_CELL, "known weight", remedy)


CLOCK = "Clock"
NOT_BEFORE = datetime(2025, 1, 1, tzinfo=UTC)
"""Older than this software: a board whose clock has lost its battery begins in 1970, or at the date of its image."""
DATE = Bound(0.0, float("inf"), "days")
SYNCHRONISED = Path("/run/systemd/timesync/synchronized")
"""Made once the time has been set by a server: systemd-timesyncd.service(8). Other time services do not make it."""
SET_IT = "Set the clock, check its battery, and give the board a time server."


def clock_results(drift_s: float, max_jump_s: float, now: str, synchronised: Path = SYNCHRONISED) -> list[CheckResult]:
    """Return the judgement of a change of wall against monotonic time (s), and of the time now (RFC 3339)."""
    age_days = (datetime.fromisoformat(now) - NOT_BEFORE).total_seconds() / 86_400
    steady = Bound(-max_jump_s, max_jump_s, "s")
    return [
        compared(CLOCK, "steady clock", drift_s, steady, "Check the board's clock and its time server."),
        compared(CLOCK, f"date after {NOT_BEFORE:%Y-%m-%d}", age_days, DATE, SET_IT),
        _time_server(synchronised),
    ]


def _time_server(synchronised: Path) -> CheckResult:
    if synchronised.exists():
        return CheckResult(CLOCK, "time server", "passed")
    return not_tested(CLOCK, "time server", "No time server is known to keep this clock: compare it with another one.")


STORAGE = "Storage"
PROBE_BYTES = 2**18
WHOLE = Bound(float("-inf"), 0.0, "bytes wrong")


def disk_results(store: Store, min_free_mb: float) -> list[CheckResult]:
    """Return the space that is left, and how much of a file that was written, synchronised and read is wrong."""
    return [_free_space(store, min_free_mb), _read_back(store)]


def _free_space(store: Store, min_free_mb: float) -> CheckResult:
    bound = Bound(min_free_mb, float("inf"), "MB")
    try:
        return compared(STORAGE, "free space", store.free_mb, bound, "Copy recordings away and delete them there.")
    except StorageError as error:
        return broken("free space", error)


def _read_back(store: Store) -> CheckResult:
    content = os.urandom(PROBE_BYTES)
    try:
        found = store.read_back(content)
    except StorageError as error:
        return broken("write and read", error)
    wrong = abs(len(found) - len(content)) + sum(a != b for a, b in zip(found, content, strict=False))
    return compared(STORAGE, "write and read", wrong, WHOLE, "Save the recordings and have the disk replaced.")


MODEL = "Model"
GOLDEN = Bound(float("-inf"), GOLDEN_TOLERANCE, "relative")
"""The largest deviation from the golden vectors."""
REINSTALL = "Install the bundle again."


def model_results(config: Config, folder_of: Callable[[Path], Path]) -> list[CheckResult]:
    """Return one result a model; `folder_of` says where an installed one lies."""
    loaders: dict[Path, Callable[[Path], ModelBundle]] = {
        config.paper_model: read_paper_model,
        config.quick_model: lambda folder: read_quick_model(folder).bundle,
        config.standard_model: lambda folder: read_ramp_model(folder).bundle,
    }
    return [_result(installed.name, folder_of(installed), load) for installed, load in loaders.items()]


def _result(name: str, folder: Path, load: Callable[[Path], ModelBundle]) -> CheckResult:
    check = f"model {name}"
    if not folder.exists():
        return not_tested(MODEL, check, "It is not installed.")
    try:
        bundle = load(folder)
    except (BundleRefused, InvalidQuantity) as error:
        return broken(check, ModelError(str(error), REINSTALL))
    return compared(MODEL, check, bundle.golden_error_ratio, GOLDEN, REINSTALL)
