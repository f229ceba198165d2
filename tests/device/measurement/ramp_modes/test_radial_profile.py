"""A recording of two force ramps to contrast on rings: synthetic recordings whose contrast is known on paper."""

import json
from dataclasses import replace

import numpy as np
import pytest
from daemon_process import ROOT

from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.radial_profile import (
    COLUMNS,
    CONTRAST,
    FIRST,
    LARGEST_STEP_N,
    MIN_RAMP_FRAMES,
    NETWORK_NAMES,
    PROFILE_FORCES_N,
    RESPONSE,
    SECOND,
    bright_side_rad,
    first_harmonic,
    harmonic,
    network_rows,
    press_profile,
    press_profiles,
    seen_presses,
)
from device.measurement.recording.camera_geometry import CameraGeometry
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.recording import CameraSettings, Recording
from device.measurement.recording.ring_means import RING_MM, RING_RADII_MM, RingMeans
from device.measurement.recording.tactile_image import Frame

SIZE_PX, PITCH_MM, DARK = 192, 0.125, 1000
RAMP_N = np.linspace(0.08, 0.6, 10)
LIT = (0.6, 0.6, 0.6, 0.6)
AT_MM = (np.arange(SIZE_PX) - (SIZE_PX - 1) / 2) * PITCH_MM
X, Y = AT_MM[None, :], AT_MM[:, None]
R = np.hypot(X, Y)


def light(force_n):
    """The inclusion-free light above dark (counts of 16 bits): a cubic of the force, another one at each place."""
    return (60_000 * force_n - 30_000 * force_n**2 - 4_000 * force_n**3) * (1 - 0.02 * R)


def cone(force_n):
    """A contrast that falls linearly with the radius and with the force."""
    return (0.3 - 0.02 * R) * (1 - force_n)


def frame(role, force_n, counts):
    return Frame(np.rint(counts).astype(np.uint16), role, 0.0, float(force_n), LIT)


def recording(contrast=cone, reference_n=RAMP_N, press_n=RAMP_N):
    frames = [frame("dark", 0.0, np.full(R.shape, DARK))] * 2
    frames += [frame("reference", f, DARK + light(f)) for f in reference_n]
    frames += [frame("press", f, DARK + light(f) * (1 + contrast(f))) for f in press_n]
    return recording_of(frames)


def recording_of(frames, pitch_mm=PITCH_MM):
    height, width = frames[0].counts.shape
    bits = 8 * frames[0].counts.itemsize
    camera = CameraSettings(width, height, bits, pitch_mm, pitch_mm, exposure_us=4000.0, gain=1.0)
    return Recording("one", "SIM", "test", "2026-01-01T00:00:00Z", camera, tuple(frames))


def without(asked, role):
    return replace(asked, frames=tuple(f for f in asked.frames if f.role != role))


GEOMETRY = CameraGeometry(PixelScale(PITCH_MM, PITCH_MM), 0.4, -0.3, 3.0)


def test_a_camera_off_the_axis_that_distorts_gives_the_profile_of_an_ideal_one():
    """The same face drawn where that camera sees it: its profile is the ideal camera's as soon as it is known."""

    def seen(contrast, geometry):
        x_mm, y_mm = geometry.face_mm(X, Y)
        r_mm = np.hypot(x_mm, y_mm)

        def counts(force_n, is_press):
            light_of = (60_000 * force_n - 25_000 * force_n**2 * (1 + 2e-3 * r_mm**2)) * (1 - 2e-3 * r_mm**2)
            return DARK + light_of * (1 + is_press * contrast(x_mm, y_mm, force_n))

        frames = [frame("dark", 0.0, np.full(R.shape, DARK))] * 2
        frames += [frame(role, f, counts(f, role == "press")) for role in ("reference", "press") for f in RAMP_N]
        return recording_of(frames)

    def bump(x_mm, y_mm, force_n):
        return 0.6 * np.exp(-((x_mm - 1) ** 2 + (y_mm - 0.5) ** 2) / 8) * force_n

    ideal = press_profile(seen(bump, CameraGeometry(GEOMETRY.scale))).as_row()
    askew = seen(bump, GEOMETRY)
    known = replace(askew, camera=askew.camera.seen_as(GEOMETRY))
    assert np.abs(press_profile(askew).as_row() - ideal).max() > 5e-3
    assert np.abs(press_profile(known).as_row() - ideal).max() < 2e-4


def test_what_a_camera_does_not_see_of_a_ring_does_not_count():
    """Its middle is 2 mm beside the face's: of an even face a ring that is seen in part has the same mean."""
    frames = [frame("dark", 0.0, np.full(R.shape, DARK))] * 2
    frames += [frame(role, f, np.full(R.shape, DARK + 40_000 * f)) for role in ("reference", "press") for f in RAMP_N]
    aside = recording_of(frames)
    narrow = CameraGeometry(PixelScale(0.07, 0.07), axis_x_mm=2.0)
    found = press_profile(replace(aside, camera=aside.camera.seen_as(narrow)))
    grown = np.log(PROFILE_FORCES_N[:-1] / PROFILE_FORCES_N[-1])
    np.testing.assert_allclose(found.reference_response, np.repeat(grown[:, None], len(RING_RADII_MM), 1), atol=1e-3)


def test_a_contrast_linear_in_force_and_radius_comes_back_at_every_force_and_ring():
    """The ring at r sees a mean radius of r + h^2 / 6r, the one in the middle h / 2 (`test_ring_means`)."""
    radius = np.append(RING_MM / 2, RING_RADII_MM[1:] + RING_MM**2 / (6 * RING_RADII_MM[1:]))
    found = press_profile(recording())
    np.testing.assert_array_equal(found.force_n, PROFILE_FORCES_N)
    expected = (0.3 - 0.02 * radius) * (1 - PROFILE_FORCES_N[:, None])
    np.testing.assert_allclose(found.contrast, expected, atol=1e-3)
    assert found.residual < 1e-4


def test_reference_response_is_the_logarithm_of_the_inclusion_free_light_over_that_at_the_largest_force():
    """The same at every ring, since the light's cubic is one times a factor of the place."""
    baseline = np.array([light(f)[0, 0] for f in PROFILE_FORCES_N])
    found = press_profile(recording()).reference_response
    np.testing.assert_allclose(
        found, np.repeat(np.log(baseline[:-1] / baseline[-1])[:, None], len(RING_RADII_MM), 1), atol=1e-3
    )


def test_a_press_that_looks_like_the_reference_has_no_contrast_and_no_harmonics():
    found = press_profile(recording(lambda force_n: 0.0))
    for values in (found.contrast, found.first_harmonic, found.second_harmonic):
        np.testing.assert_allclose(values, 0.0, atol=1e-4)


@pytest.mark.parametrize("towards", [0.0, 2.0, -2.5])
def test_the_first_harmonic_is_a_length_along_its_own_direction(towards):
    """0.01 cos(angle - towards) on every ring at every force, wherever it points; a second one does not enter."""
    angle = np.arctan2(Y, X)
    found = press_profile(recording(lambda _: 0.01 * np.cos(angle - towards) + 0.02 * np.cos(2 * angle - towards)))
    assert found.first_harmonic.shape == (len(PROFILE_FORCES_N), len(RING_RADII_MM) - 1)
    np.testing.assert_allclose(found.first_harmonic, 0.01, atol=5e-4)


@pytest.mark.parametrize("towards", [0.0, 1.6, -2.5])
def test_the_direction_is_that_of_the_bright_side_from_the_images_rows(towards):
    angle = np.arctan2(Y, X)
    found = press_profile(recording(lambda _: 0.01 * np.cos(angle - towards) + 0.02 * np.cos(2 * angle - 1.0)))
    assert found.direction_rad == pytest.approx(towards, abs=0.02)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_turned_frames_turn_the_direction_and_nothing_else(quarters):
    """`numpy.rot90` turns from the image's columns, which run downwards, to its rows: by -90 degrees."""
    spot = recording(lambda force_n: 0.3 * force_n * np.exp(-((X - 1.2) ** 2 + (Y - 0.5) ** 2) / 18))
    turned = replace(spot, frames=tuple(replace(f, counts=np.rot90(f.counts, quarters)) for f in spot.frames))
    found, expected = press_profile(turned), press_profile(spot)
    np.testing.assert_allclose(found.as_row(), expected.as_row(), atol=1e-6)
    np.testing.assert_allclose(found.second_harmonic, expected.second_harmonic, atol=1e-6)
    assert expected.direction_rad == pytest.approx(np.arctan2(0.5, 1.2), abs=0.01)
    by_rad = expected.direction_rad - found.direction_rad - quarters * np.pi / 2
    assert np.exp(1j * by_rad) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("towards", [0.0, 2.0])
def test_the_first_harmonic_of_each_force_is_along_the_direction_of_all_of_them(towards):
    """Waves of 0.02 (F - F0) across a constant one cancel in the mean over the forces, and so count nothing."""
    angle = np.arctan2(Y, X) - towards

    def contrast(force_n):
        along = (0.01 + 0.02 * force_n) * np.cos(angle)
        return along + 0.02 * (force_n - PROFILE_FORCES_N.mean()) * np.sin(angle)

    found = press_profile(recording(contrast)).first_harmonic
    expected = np.repeat((0.01 + 0.02 * PROFILE_FORCES_N)[:, None], len(RING_RADII_MM) - 1, axis=1)
    np.testing.assert_allclose(found, expected, atol=5e-4)


@pytest.mark.parametrize("bright", [0.0, 0.7, -2.5])
@pytest.mark.parametrize("stretched", [0.0, 0.7, 1.4])
def test_the_second_harmonic_is_told_along_and_across_the_bright_side(bright, stretched):
    """0.02 cos(2 (angle - s)) has 0.02 cos(2 (s - t)) along t and 0.02 sin(2 (s - t)) across, at every force."""
    angle = np.arctan2(Y, X)
    found = press_profile(
        recording(lambda _: 0.01 * np.cos(angle - bright) + 0.02 * np.cos(2 * (angle - stretched)))
    ).second_harmonic
    assert found.shape == (2, len(PROFILE_FORCES_N), len(RING_RADII_MM) - 2)
    np.testing.assert_allclose(found[0], 0.02 * np.cos(2 * (stretched - bright)), atol=5e-4)
    np.testing.assert_allclose(found[1], 0.02 * np.sin(2 * (stretched - bright)), atol=5e-4)


def test_the_second_harmonic_is_known_at_each_force_and_ring():
    """A line in the force times one in the radius; the bright side turns, and along is that of the forces' mean."""
    angle = np.arctan2(Y, X)

    def contrast(force_n):
        turning = np.cos(angle) + 3 * (force_n - PROFILE_FORCES_N.mean()) * np.sin(angle)
        return 0.02 * turning + (0.01 + 0.02 * force_n) * (1 - R / 20) * np.cos(2 * angle)

    found = press_profile(recording(contrast)).second_harmonic
    radius = RING_RADII_MM[1:-1] + RING_MM**2 / (6 * RING_RADII_MM[1:-1])
    expected = (0.01 + 0.02 * PROFILE_FORCES_N[:, None]) * (1 - radius / 20)
    np.testing.assert_allclose(found[0], expected, atol=5e-4)
    np.testing.assert_allclose(found[1], 0.0, atol=5e-4)


def random_rings(seed):
    rng, forces, rings = np.random.default_rng(seed), len(PROFILE_FORCES_N), len(RING_RADII_MM)
    return RingMeans(*(rng.normal(size=shape) for shape in ((forces, rings), *[(forces, 2, rings)] * 2)))


@pytest.mark.parametrize("order", [1, 2])
def test_the_mean_harmonic_is_to_the_bit_the_one_that_the_networks_have_learnt_from(order):
    """Amplitudes averaged over the forces first, then turned: another order of sums would round otherwise."""
    rings = random_rings(order)
    cosine, sine = (part[:, order - 1, 1:].mean(axis=0) for part in (rings.cosine, rings.sine))
    direction = np.arctan2(sine @ RING_RADII_MM[1:], cosine @ RING_RADII_MM[1:])
    learnt = np.asarray(cosine * np.cos(direction) + sine * np.sin(direction))
    assert harmonic(rings, order).tobytes() == learnt.tobytes()


@pytest.mark.parametrize("turned", [0.0, 1.0, -2.0])
def test_turning_the_face_turns_no_first_harmonic(turned):
    """Waves of a face turned by an angle: cosine and sine are those of the old ones, turned."""
    rings = random_rings(3)
    cosine, sine = rings.cosine, rings.sine
    other = RingMeans(
        rings.mean,
        cosine * np.cos(turned) - sine * np.sin(turned),
        cosine * np.sin(turned) + sine * np.cos(turned),
    )
    np.testing.assert_allclose(first_harmonic(other), first_harmonic(rings), atol=1e-12)
    by_rad = bright_side_rad(other) - bright_side_rad(rings) - turned
    assert np.exp(1j * by_rad) == pytest.approx(1.0, abs=1e-12)


def test_first_harmonics_lie_along_one_direction_of_all_forces_in_which_the_cut_ring_has_no_say():
    rings = random_rings(4)
    cosine, sine = rings.cosine[:, 0, 1:], rings.sine[:, 0, 1:]
    towards = np.arctan2(
        sine[:, :-1].mean(axis=0) @ RING_RADII_MM[1:-1], cosine[:, :-1].mean(axis=0) @ RING_RADII_MM[1:-1]
    )
    np.testing.assert_allclose(first_harmonic(rings), cosine * np.cos(towards) + sine * np.sin(towards), atol=1e-14)
    assert bright_side_rad(rings) == pytest.approx(towards, abs=1e-14)
    rings.sine[:, 0, -1] += 100.0
    assert bright_side_rad(rings) == pytest.approx(towards, abs=1e-14)
    np.testing.assert_allclose(
        first_harmonic(rings)[:, :-1], (cosine * np.cos(towards) + sine * np.sin(towards))[:, :-1], atol=1e-14
    )


def test_the_row_is_contrast_reference_response_and_both_harmonics_along_the_bright_side():
    found = press_profile(recording(lambda force_n: cone(force_n) + 0.01 * X / (1 + R)))
    row = found.as_row()
    assert row.shape == (COLUMNS,) == (153,)
    parts = found.contrast, found.reference_response, found.first_harmonic, found.second_harmonic[0]
    for columns, part in zip((CONTRAST, RESPONSE, FIRST, SECOND), parts, strict=True):
        np.testing.assert_array_equal(row[columns], part.ravel())


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_networks_read_the_names_of_their_numbers(kind):
    """Contrast and response as they are, the first harmonic's mean over the forces, and nothing of the second."""
    found = press_profile(recording(lambda force_n: cone(force_n) + 0.01 * (1 + force_n) * X / (1 + R)))
    read = network_rows(found.as_row().astype(kind))
    assert read.dtype == kind
    named = dict(zip(NETWORK_NAMES, read, strict=True))
    assert named["contrast_0.25_n_1.8_mm"] == kind(found.contrast[1, 2])
    assert named["growth_0.12_n_9.0_mm"] == kind(found.reference_response[0, -1])
    assert named["offset_0.9_mm"] == pytest.approx(found.first_harmonic[:, 0].mean(), rel=1e-6)
    assert named["offset_9.0_mm"] == pytest.approx(found.first_harmonic[:, -1].mean(), rel=1e-6)


def test_rows_of_many_presses_are_read_as_each_alone():
    rows = np.random.default_rng(1).normal(size=(2, 3, COLUMNS))
    read = network_rows(rows)
    assert read.shape == (2, 3, len(NETWORK_NAMES))
    np.testing.assert_array_equal(read[1, 2], network_rows(rows[1, 2]))


def test_the_committed_networks_read_these_names():
    card = json.loads((ROOT / "models" / "standard" / "model.json").read_text(encoding="utf-8"))
    assert [feature["name"] for feature in card["features"]] == list(NETWORK_NAMES)


def scan_of(contrasts):
    """Return one reference ramp, and a ramp on the lesion for each contrast: the last one first, as files may be."""
    frames = [f for f in recording().frames if f.role != "press"]
    for ramp, contrast in reversed(list(enumerate(contrasts))):
        frames += [replace(f, ramp=ramp) for f in recording(contrast).frames if f.role == "press"]
    return recording_of(frames)


def test_each_ramp_of_a_scan_has_the_profile_that_it_has_alone():
    contrasts = cone, lambda force_n: 0.5 * cone(force_n), lambda force_n: cone(force_n) + 0.01 * X / (1 + R)
    found = press_profiles(scan_of(contrasts))
    assert len(found) == len(contrasts)
    for profile, contrast in zip(found, contrasts, strict=True):
        np.testing.assert_array_equal(profile.as_row(), press_profile(recording(contrast)).as_row())


def test_of_presses_rows_harmonics_and_directions_are_seen_in_their_order():
    contrasts = [lambda _, t=t: 0.01 * np.cos(np.arctan2(Y, X) - t) for t in (0.5, -2.0)]
    profiles = press_profiles(scan_of(contrasts))
    seen = seen_presses(profiles)
    assert seen.second_harmonics.shape == (2, 2, len(PROFILE_FORCES_N), len(RING_RADII_MM) - 2)
    for number, profile in enumerate(profiles):
        np.testing.assert_array_equal(seen.rows[number], profile.as_row())
        np.testing.assert_array_equal(seen.second_harmonics[number], profile.second_harmonic)
    np.testing.assert_allclose(seen.direction_rad, [0.5, -2.0], atol=0.02)


def test_of_a_scan_the_first_ramps_profile_is_the_presses_own():
    found = press_profile(scan_of((cone, lambda force_n: 0.5 * cone(force_n))))
    np.testing.assert_array_equal(found.as_row(), press_profile(recording()).as_row())


def test_a_ramp_of_a_scan_that_is_none_is_refused():
    frames = list(scan_of((cone, cone)).frames)
    short = [f for f in frames if f.ramp != 1 or f.force_n < 0.4]
    with pytest.raises(InvalidQuantity, match="^largest press force is .*press slowly harder"):
        press_profiles(recording_of(short))


def test_frames_of_eight_and_of_sixteen_bits_agree():
    """Counts of 16 bits that are 256 times those of 8."""
    eight = [replace(f, counts=(f.counts // 256).astype(np.uint8)) for f in recording().frames]
    sixteen = [replace(f, counts=f.counts.astype(np.uint16) * 256) for f in eight]
    one, other = (press_profile(recording_of(frames)) for frames in (eight, sixteen))
    np.testing.assert_allclose(one.as_row(), other.as_row(), atol=1e-6)


def test_noise_of_the_pixels_does_not_raise_the_contrast():
    """Noise of a fifth of the reference: the ratio of unbinned pixels would be 0.4 x 0.2^2 x 1.2 = 2 % too high."""
    random, shape = np.random.default_rng(5), (4 * SIZE_PX, 4 * SIZE_PX)

    def noisy(role, force_n, level):
        counts = 20_000 + level * (1 + 0.2 * random.standard_normal(shape, dtype=np.float32))
        return Frame(np.rint(counts).astype(np.uint16), role, 0.0, force_n, LIT)

    frames = [noisy("dark", 0.0, 0.0)]
    frames += [noisy("reference", f, 10_000 + 5_000 * f) for f in RAMP_N]
    frames += [noisy("press", f, 1.2 * (10_000 + 5_000 * f)) for f in RAMP_N]
    found = press_profile(recording_of(frames, PITCH_MM / 4)).contrast
    assert float(found[1:, 3:].mean()) == pytest.approx(0.2, abs=3e-3)


def test_press_frames_weaker_or_stronger_than_the_reference_count_nothing():
    """From the first touch on: there is no reference at 0.01 N, and the one at 0.06 N is five times as bright."""
    press_n = np.concatenate([[0.0, 0.01, 0.03, 0.05], RAMP_N, [0.9]])
    found = press_profile(recording(press_n=press_n))
    np.testing.assert_allclose(found.contrast, press_profile(recording()).contrast, atol=1e-6)


def test_reference_frames_of_the_untouched_face_count_nothing():
    reference_n = np.concatenate([[0.0, 0.0, 0.001], RAMP_N])
    found = press_profile(recording(reference_n=reference_n))
    np.testing.assert_allclose(found.as_row(), press_profile(recording()).as_row(), atol=1e-6)


@pytest.mark.parametrize("role", ["dark", "reference", "press"])
def test_a_missing_role_is_refused_by_its_name(role):
    with pytest.raises(InvalidQuantity, match=f"^{role} frames is 0, but must be at least"):
        press_profile(without(recording(), role))


@pytest.mark.parametrize("name", ["reference", "press"])
@pytest.mark.parametrize(
    ("forces_n", "quantity"),
    [
        (RAMP_N[:: len(RAMP_N) // (MIN_RAMP_FRAMES - 2)], "{} frames"),
        (np.full(10, 0.5), "smallest {} force"),
        (np.linspace(0.18, 0.6, 10), "smallest {} force"),
        (np.linspace(0.08, 0.48, 10), "largest {} force"),
        ([0.1] * 5 + [0.6] * 5, "largest step of the {} force"),
        ([0.1, 0.12, 0.15, 0.16 + LARGEST_STEP_N, 0.45, 0.6], "largest step of the {} force"),
    ],
)
def test_a_press_that_is_no_ramp_is_refused_with_what_it_lacks(name, forces_n, quantity):
    with pytest.raises(InvalidQuantity, match=f"^{quantity.format(name)} is .*press slowly harder"):
        press_profile(recording(**{f"{name}_n": forces_n}))


@pytest.mark.parametrize("times", [0.5, 1.4])
def test_press_frames_under_another_brightness_give_the_same_profile(times):
    """Half the LEDs' ratio, half the light above dark: a recording says how its frames were lit."""
    usual = recording()
    ratio = tuple(times * side for side in LIT)
    dimmed = tuple(
        replace(f, counts=np.rint(DARK + times * (f.counts.astype(float) - DARK)).astype(np.uint16), led_ratio=ratio)
        if f.role == "press"
        else f
        for f in usual.frames
    )
    found = press_profile(replace(usual, frames=dimmed))
    np.testing.assert_allclose(found.as_row(), press_profile(usual).as_row(), atol=2e-4)


@pytest.mark.parametrize("ratio", [(0.0, 0.0, 0.0, 0.0), (0.6, 0.6, 0.6, 0.3)])
def test_frames_that_say_they_were_dark_or_lit_from_other_sides_are_refused(ratio):
    usual = recording()
    frames = tuple(replace(f, led_ratio=ratio) if f.role == "press" else f for f in usual.frames)
    with pytest.raises(InvalidQuantity, match=r"led_ratio of a frame is .* in the proportion of \(0\.6, 0\.6"):
        press_profile(replace(usual, frames=frames))
