"""The probe's images of light: exactly linear in the LEDs, symmetric, bright by contact, and refused input."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.simulation.physics.light_table import load_light_table
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.skin import Skin

MODELS = Path(__file__).parents[4] / "models" / "simulated_probe"
ALL = (1.0, 1.0, 1.0, 1.0)


@pytest.fixture(scope="module")
def optics():
    return LookupOptics.load(MODELS)


@pytest.fixture(scope="module")
def press(optics):
    """A dimple of 0.8 mm, off centre, with a pressure that rises over it."""
    x, y = np.meshgrid(optics.x_mm, optics.y_mm)
    bump = np.exp(-((x - 2) ** 2 + (y + 1) ** 2) / 18).astype(np.float32)
    return np.float32(0.8) * bump, np.float32(0.5) + 2 * bump


def flat(optics, p_kpa):
    shape = (len(optics.y_mm), len(optics.x_mm))
    return np.zeros(shape, np.float32), np.full(shape, p_kpa, np.float32)


def test_light_is_exactly_linear_in_the_leds(optics, press):
    ones = [optics.radiance(*press, tuple(np.eye(4)[k]), Skin()) for k in range(4)]
    mixed = optics.radiance(*press, (0.9, 0.1, 0.4, 0.7), Skin())
    expected = 0.9 * ones[0] + 0.1 * ones[1] + 0.4 * ones[2] + 0.7 * ones[3]
    np.testing.assert_allclose(mixed, expected, atol=2e-6 * mixed.max())


def test_no_led_no_light(optics, press):
    assert np.abs(optics.radiance(*press, (0, 0, 0, 0), Skin())).max() < 1e-10


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_turning_face_and_leds_turns_the_image(optics, press, quarters):
    # np.rot90 of an array [y, x] with y upwards turns from y to x: backwards, so the LEDs go back too.
    ratio = (1.0, 0.6, 0.3, 0.1)
    image = optics.radiance(*press, ratio, Skin())
    w, p = (np.ascontiguousarray(np.rot90(field, quarters)) for field in press)
    turned = optics.radiance(w, p, tuple(np.roll(ratio, -quarters)), Skin())
    np.testing.assert_allclose(turned, np.rot90(image, quarters), atol=1e-3 * image.max())


def test_each_led_is_brightest_where_its_steepest_trapped_light_meets_the_face(optics):
    # Just inside the critical angle light rises 5 mm over about 5 mm: 7 mm from the middle, on the LED's own side.
    for k, (dx, dy) in enumerate(((1, 0), (0, 1), (-1, 0), (0, -1))):
        image = optics.radiance(*flat(optics, 2.0), tuple(np.eye(4)[k]), Skin())
        row, column = np.unravel_index(np.argmax(image), image.shape)
        along = dx * optics.x_mm[column] + dy * optics.y_mm[row]
        assert 5.0 < along < 8.0


def test_a_probe_in_the_air_is_dark(optics, press):
    assert optics.radiance(*press, ALL, Skin(), touching=False).max() == 0.0


def test_contact_is_a_hundred_times_brighter_than_an_air_gap(optics):
    touched, gap = (optics.radiance(*flat(optics, p), ALL, Skin())[60:100, 60:100].mean() for p in (1e3, 0.0))
    assert touched > 100 * gap


def test_pressure_makes_the_inclusion_visible_and_gel_hides_it(optics, press):
    w, p = press
    inside, outside = (p > 2.0), (p < 1.0) & (np.hypot(*np.meshgrid(optics.x_mm, optics.y_mm)) < 6)

    def contrast(skin):
        inclusion, baseline = (optics.radiance(w, pressure, ALL, skin) for pressure in (p, np.full_like(p, 0.5)))
        return inclusion[inside].mean() / baseline[inside].mean()

    assert outside.any()
    assert contrast(Skin()) > 2.0
    assert contrast(Skin(wet_ratio=1.0)) == pytest.approx(1.0, abs=1e-3)


def test_light_that_spreads_out_of_a_contact_is_seen_through_the_gap_around_it(optics):
    # Through air the camera sees up to n_skin^2 of what it sees through contact; a spot of 0.6 mm loses some of it.
    w, p = flat(optics, 0.0)
    p[78:82, 78:82] = 50.0

    def spot(skin):
        return optics.radiance(w, p, ALL, skin) - optics.radiance(w, 0 * p, ALL, skin)

    near, far = spot(Skin(spread_mm=0.0)), spot(Skin(spread_mm=2.0))
    assert near[80, 80] > 10 * far[80, 80]
    assert 1.3 < far.sum() / near.sum() < 1.38**2


def test_skin_that_gives_nothing_back_is_black(optics, press):
    assert optics.radiance(*press, ALL, Skin(albedo=0.0)).max() == 0.0


def test_a_skin_is_not_remembered_for_the_next(optics, press):
    first = optics.radiance(*press, ALL, Skin())
    optics.radiance(*press, ALL, Skin(albedo=0.9, spread_mm=3.0))
    np.testing.assert_array_equal(optics.radiance(*press, ALL, Skin()), first)


def test_a_face_deeper_than_the_table_counts_as_its_deepest(optics):
    _, p = flat(optics, 1.0)
    deepest, deeper = (optics.radiance(np.full_like(p, w), p, ALL, Skin()) for w in (2.5, 9.0))
    np.testing.assert_allclose(deeper, deepest, rtol=1e-5)


def test_an_image_is_single_precision_and_nowhere_negative(optics, press):
    image = optics.radiance(*press, ALL, Skin())
    assert image.dtype == np.float32
    assert image.min() >= 0.0


def test_fields_of_another_grid_are_refused(optics, press):
    with pytest.raises(InvalidQuantity, match="w_mm and p_kpa"):
        optics.radiance(press[0][1:], press[1], ALL, Skin())


def test_a_deformation_that_is_no_number_is_refused(optics, press):
    broken = press[0].copy()
    broken[3, 4] = np.nan
    with pytest.raises(InvalidQuantity, match="w_mm"):
        optics.radiance(broken, press[1], ALL, Skin())


@pytest.mark.parametrize("ratio", [(1.0, 1.0), (1.0, 1.0, 1.0, np.nan)])
def test_other_than_four_leds_are_refused(optics, press, ratio):
    with pytest.raises(InvalidQuantity, match="led_ratio"):
        optics.radiance(*press, ratio, Skin())


@pytest.fixture
def copied(tmp_path):
    for suffix in ("npz", "json"):
        shutil.copy(MODELS / f"light_table.{suffix}", tmp_path)
    return tmp_path


def change_record(folder, **changes):
    path = folder / "light_table.json"
    record = json.loads(path.read_text())
    for name, value in changes.items():
        record[name] = {**record[name], **value} if isinstance(value, dict) else value
    path.write_text(json.dumps(record))


def test_a_table_reads_as_it_was_saved(copied):
    table = load_light_table(copied)
    table.save(copied / "again", {"rays": 1})
    np.testing.assert_array_equal(load_light_table(copied / "again").relative_irradiance, table.relative_irradiance)


def test_the_shipped_table_is_less_than_a_megabyte():
    assert (MODELS / "light_table.npz").stat().st_size < 1_000_000


@pytest.mark.parametrize(
    "changes", [{"sha256": "0" * 64}, {"block": {"refractive_index": 1.43}}], ids=["hash", "block's optics"]
)
def test_a_table_whose_hash_or_block_was_changed_is_refused(copied, changes):
    change_record(copied, **changes)
    with pytest.raises(InvalidQuantity, match="hash"):
        LookupOptics.load(copied)


def test_a_damaged_table_is_refused(copied):
    content = (copied / "light_table.npz").read_bytes()
    (copied / "light_table.npz").write_bytes(content[:-1])
    with pytest.raises(InvalidQuantity, match="hash"):
        LookupOptics.load(copied)


def test_a_table_of_another_schema_is_refused(copied):
    change_record(copied, schema="tsis.light_table/0")
    with pytest.raises(InvalidQuantity, match="schema"):
        LookupOptics.load(copied)


def test_a_missing_table_is_refused_with_what_to_run(tmp_path):
    with pytest.raises(InvalidQuantity, match="host_tools optics build"):
        LookupOptics.load(tmp_path)
