"""Protocols: the shipped files can be read, and what no measurement has is refused by name."""

from pathlib import Path

import numpy as np
import pytest

from device.measurement.mode import FRAMES, MODES, RAMP_FROM_N, RAMP_TO_N
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.radial_profile import LARGEST_STEP_N, PROFILE_FORCES_N
from host_tools.cramer_rao.protocol import PressProtocol, read_protocol

SHIPPED_FOLDER = Path(__file__).parents[3] / "protocols"
SHIPPED = sorted(SHIPPED_FOLDER.glob("*.toml"))


def test_every_shipped_protocol_can_be_read():
    found = {path.stem: read_protocol(path) for path in SHIPPED}
    assert found.keys() == set(MODES)
    assert {name: protocol.observable for name, protocol in found.items()} == {
        "quick": "image",
        "standard": "image",
        "precise": "image",
        "paper": "scalars",
    }


@pytest.mark.parametrize("mode", [mode for mode in MODES if not FRAMES[mode].is_scan])
def test_a_shipped_protocol_takes_the_frames_of_its_mode(mode):
    protocol, frames = read_protocol(SHIPPED_FOLDER / f"{mode}.toml"), FRAMES[mode]
    assert protocol.frames == protocol.reference_frames == frames.count
    assert (len(protocol.forces_n) > 1) == frames.is_ramp
    if frames.is_ramp:
        assert protocol.forces_n == tuple(PROFILE_FORCES_N)
        assert np.diff(protocol.forces_n).max() <= LARGEST_STEP_N
        assert RAMP_FROM_N <= protocol.forces_n[0] < protocol.forces_n[-1] <= RAMP_TO_N


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("forces_n", ()),
        ("forces_n", (0.3, 0.2)),
        ("forces_n", (0.2, 0.2)),
        ("forces_n", (-0.1, 0.2)),
        ("forces_n", (float("nan"),)),
        ("frames", 0),
        ("reference_frames", 0),
        ("observable", "heat"),
        ("strain", "huge"),
        ("mean_level_counts", 0.0),
        ("mean_level_counts", 300.0),
        ("tissue_modulus_spread_ratio", -0.1),
        ("contact_law_spread_ratio", float("inf")),
        ("systematic_ratio", -0.002),
        ("common_correlation_mm", 0.0),
        ("place_spread_mm", -1.0),
        ("zero_spread_n", -0.001),
    ],
)
def test_what_no_measurement_has_is_refused_by_name(field, value):
    with pytest.raises(InvalidQuantity) as refusal:
        PressProtocol(**{field: value})
    assert refusal.value.quantity == field


def test_a_bad_offset_is_refused_by_its_place():
    with pytest.raises(InvalidQuantity, match=r"offsets_mm\[1\]"):
        PressProtocol(offsets_mm=(6.0, 0.0))


def test_scalars_know_nothing_of_presses_beside_the_inclusion():
    with pytest.raises(InvalidQuantity, match="offsets_mm"):
        PressProtocol(observable="scalars", offsets_mm=(6.0,))


def test_a_misspelt_key_is_refused_with_what_was_meant(tmp_path):
    path = tmp_path / "protocol.toml"
    path.write_text("force_n = [0.5]")
    with pytest.raises(InvalidQuantity, match="did you mean forces_n"):
        read_protocol(path)
