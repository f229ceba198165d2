"""A world that is not as believed: each quantity does to light and force what it says; as believed, nothing."""

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from daemon_process import ROOT

from device.files.toml_record import as_table
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.pixel_scale import PixelScale
from device.simulation.hand import BESIDE_MM
from device.simulation.physics.image_formation import UNIT_RADIANCE
from device.simulation.physics.layer_table import EVEN
from device.simulation.physics.lens import Lens, Projection, TrueCamera
from device.simulation.physics.pressed_face import PressedFace, ProbePlacement
from device.simulation.physics.skin import ContactLaw, Skin, SkinTexture
from device.simulation.physics.slab import Slab
from device.simulation.physics.world import (
    AS_BELIEVED,
    OverLesion,
    PressTilts,
    Relaxation,
    TissueInDepth,
    TrueLight,
    World,
)
from device.simulation.physics.world_face import WorldFace
from device.simulation.scenario import Scenario, read_scenario
from device.simulation.virtual_probe import VirtualProbe

SHAPE, SCALE = (123, 193), PixelScale(0.125, 0.146)
LIT = (0.6, 0.6, 0.6, 0.6)
LESION, BESIDE = ProbePlacement(1.0, -0.5), ProbePlacement(*BESIDE_MM)
INCLUSION = Inclusion(10.0, 6.0, 80.0)


def frame(probe, place=LESION, force_n=0.5, **other):
    return probe.frame_counts(
        force_n=force_n, place=place, led_ratio=LIT, exposure_us=4000.0, gain=1.0, frame_number=1, **other
    )


@pytest.fixture(scope="module")
def light_of(tables):
    """The exact light of a press in a world, and the face that it shows."""

    def light(world, place=LESION, force_n=0.5, shape=SHAPE, scale=SCALE):
        probe = VirtualProbe(Scenario(world=world), tables, shape, scale)
        return probe._image.intensity(*probe._face.at(force_n, place), LIT, place=place)

    return light


class TestWhatIsAsBelieved:
    WRITTEN = (
        "[world]\ncell_span_ratio = 1\nface_motion_ratio = 0\n"
        "[world.contact]\nform = 'exponential'\nexponent = 1\n[world.camera]\n"
        "scale_x_ratio = 1\naxis_y_mm = 0\n[world.lesion]\n[world.tilt]\n[world.relaxation]\ntime_constant_s = 1\n"
        "[world.light]\nside_ratio = [1, 1, 1, 1]\n[world.texture]\nseed = 5\n"
    )

    @pytest.mark.parametrize("place", [LESION, BESIDE, ProbePlacement(20.0, 0.0, 1.0)])
    def test_a_world_of_defaults_gives_the_frames_of_none_to_the_last_bit(self, tables, tmp_path, place):
        (tmp_path / "scene.toml").write_text(self.WRITTEN)
        written, none = read_scenario(tmp_path / "scene.toml"), Scenario()
        frames = [frame(VirtualProbe(one, tables, SHAPE, SCALE), place) for one in (written, none)]
        np.testing.assert_array_equal(*frames)

    def test_a_probe_without_world_is_table_optics_and_lens_alone(self, tables):
        """The chain of before there were worlds, written out."""
        scene = Scenario()
        x_mm, y_mm = tables.light.x_mm, tables.light.y_mm
        ramps = tables.centred.ramps(scene.inclusion)
        face = PressedFace(ramps, tables.off_axis, scene.inclusion, x_mm[None, :], y_mm[:, None])
        radiance = tables.light.radiance(*face.at(0.5, LESION), LIT, scene.skin)
        light = Projection(scene.lens, x_mm, y_mm, SHAPE, SCALE)(radiance / np.float32(UNIT_RADIANCE))
        probe = VirtualProbe(scene, tables, SHAPE, SCALE)
        np.testing.assert_array_equal(probe._image.intensity(*probe._face.at(0.5, LESION), LIT), light)


class TestContact:
    def test_both_laws_have_the_same_contact_at_the_contact_pressure(self):
        skin = Skin(contact_pressure_kpa=2.5)
        found = [skin.contact_ratio(np.array([2.5]), ContactLaw(form, 1.3))[0] for form in ("exponential", "langmuir")]
        assert found == pytest.approx([1 - math.exp(-1)] * 2, rel=1e-6)

    def test_an_exponent_and_a_largest_contact_are_the_formula(self):
        p_kpa = np.array([0.0, 1.0, 8.0])
        found = Skin(largest_contact_ratio=0.9).contact_ratio(p_kpa, ContactLaw("exponential", 0.9, 0.8))
        expected = 0.72 * (1 - np.exp(-((p_kpa / 2) ** 0.9)))
        np.testing.assert_allclose(found, expected, rtol=1e-5)

    def test_the_law_of_the_world_is_that_of_the_light(self, tables, light_of):
        world = World(contact=ContactLaw(largest_ratio=0.8))
        other = VirtualProbe(Scenario(skin=Skin(largest_contact_ratio=0.8)), tables, SHAPE, SCALE)
        np.testing.assert_array_equal(light_of(world), other._image.intensity(*other._face.at(0.5, LESION), LIT))
        assert np.abs(light_of(World(contact=ContactLaw(exponent=0.97))) / light_of(AS_BELIEVED) - 1).max() > 3e-3


class TestCamera:
    X, Y = np.linspace(-12, 12, 193), np.linspace(-12, 12, 193)
    PLAIN = Lens(blur_px=0.0, vignetting=False)

    def seen(self, field, camera, lens=PLAIN):
        field = np.asarray(field(self.X[None, :], self.Y[:, None]), np.float32)
        return Projection(lens, self.X, self.Y, SHAPE, SCALE, camera)(field)

    def test_the_camera_sees_the_face_where_its_formula_says(self):
        camera = TrueCamera(1.01, 0.98, 0.4, -0.3, rim_distortion_percent=3.0)
        x_mm, y_mm = SCALE.coordinates_mm((61, 121))
        true_x, true_y = 1.01 * x_mm, 0.98 * y_mm
        farther = 1 + 0.03 * (true_x**2 + true_y**2) / 121
        for field, expected in (
            (lambda x, y: x + 0 * y, true_x * farther + 0.4),
            (lambda x, y: y + 0 * x, true_y * farther - 0.3),
        ):
            found = self.seen(field, camera)[31:92, 36:157]
            np.testing.assert_allclose(found, expected, atol=0.003)

    def test_a_sharp_field_is_as_sharp_as_without_distortion(self):
        """What the second interpolation costs: a tenth of a per cent of a bump of half a millimetre's width."""

        def bump(x, y):
            return np.exp(-((x - 5) ** 2 + y**2) / 0.5)

        straight, distorted = (self.seen(bump, TrueCamera(rim_distortion_percent=d)) for d in (0.0, 1e-9))
        assert np.abs(distorted - straight).max() < 2e-3

    def test_further_blur_is_in_millimetres_of_the_face(self):
        line = self.seen(lambda x, y: (np.abs(x) < 0.06) + 0 * y, TrueCamera(further_blur_mm=0.5))[60]
        x_mm = SCALE.coordinates_mm(SHAPE)[0].ravel()
        assert np.sqrt(np.average(x_mm**2, weights=line)) == pytest.approx(0.5, rel=0.03)


class TestLesionAndBeside:
    def test_the_lesion_ends_smoothly_between_its_two_radii(self):
        shares = [AS_BELIEVED.lesion_share(ProbePlacement(0.6 * r, 0.8 * r)) for r in np.linspace(0, 40, 81)]
        assert (shares[0], shares[24], shares[56], shares[80]) == (1.0, 1.0, pytest.approx(0.0), 0.0)
        assert np.diff(shares).min() > -0.05
        assert (np.diff(shares) <= 0).all()

    @pytest.mark.parametrize(
        ("lesion", "skin"),
        [
            (OverLesion(albedo_ratio=1.1), Skin(albedo=0.55)),
            (OverLesion(contact_pressure_ratio=0.9), Skin(contact_pressure_kpa=1.8)),
        ],
    )
    def test_skin_over_the_lesion_is_another_and_beside_it_the_scenes(self, tables, light_of, lesion, skin):
        world = World(lesion=lesion)
        np.testing.assert_array_equal(light_of(world, BESIDE), light_of(AS_BELIEVED, BESIDE))
        other = VirtualProbe(Scenario(skin=skin), tables, SHAPE, SCALE)
        expected = other._image.intensity(*other._face.at(0.5, LESION), LIT)
        np.testing.assert_allclose(light_of(world), expected, rtol=1e-5)

    def test_tissue_over_the_lesion_is_another_slab(self, tables, light_of):
        world = World(lesion=OverLesion(tissue_modulus_ratio=0.95))
        np.testing.assert_array_equal(light_of(world, BESIDE), light_of(AS_BELIEVED, BESIDE))
        other = VirtualProbe(Scenario(tissue_modulus_kpa=4.75), tables, SHAPE, SCALE)
        expected = other._image.intensity(*other._face.at(0.5, LESION), LIT)
        np.testing.assert_allclose(light_of(world), expected, rtol=1e-3, atol=1e-5)
        assert np.abs(light_of(world) / expected - 1)[30:90, 40:150].max() < 1e-3

    def test_tilts_of_the_two_presses_add_to_the_hands(self, light_of):
        world = World(tilt=PressTilts(lesion_x_deg=0.5, beside_y_deg=-1.0))
        for place, leaning in (
            (LESION, replace(LESION, tilt_x_deg=0.5)),
            (replace(BESIDE, tilt_y_deg=0.4), replace(BESIDE, tilt_y_deg=-0.6)),
        ):
            np.testing.assert_allclose(light_of(world, place), light_of(AS_BELIEVED, leaning), rtol=1e-5)

    def test_light_drifts_between_the_presses_and_may_be_uneven_in_both(self, tables, light_of):
        world = World(light=TrueLight((1.1, 1.0, 0.9, 1.0), (1.0, 0.97, 1.0, 1.0)))
        probe = VirtualProbe(Scenario(), tables, SHAPE, SCALE)
        for place, lit in ((LESION, (0.66, 0.582, 0.54, 0.6)), (BESIDE, (0.66, 0.6, 0.54, 0.6))):
            expected = probe._image.intensity(*probe._face.at(0.5, place), lit)
            np.testing.assert_allclose(light_of(world, place), expected, rtol=1e-5)


class TestRelaxation:
    RELAXED = World(relaxation=Relaxation(0.1, 2.0))

    def test_the_modulus_is_stress_over_strain_of_a_steady_ramp(self):
        """Against the integral of the Prony series over a ramp's history."""
        t_s = np.linspace(0, 3.0, 30_001)
        stress = np.trapezoid(1 - 0.1 + 0.1 * np.exp(-(3.0 - t_s) / 2.0), t_s)
        assert self.RELAXED.relaxation.modulus_ratio(3.0) == pytest.approx(stress / 3.0, rel=1e-6)
        assert self.RELAXED.relaxation.modulus_ratio(0.0) == 1.0
        assert self.RELAXED.relaxation.modulus_ratio(1e6) == pytest.approx(0.9, rel=1e-5)

    def test_both_presses_relax_as_a_softer_slab_would(self, tables):
        probe = VirtualProbe(Scenario(world=self.RELAXED), tables, SHAPE, SCALE)
        for place in (LESION, BESIDE):
            ratio = self.RELAXED.relaxation.modulus_ratio(4.0)
            softer = VirtualProbe(Scenario(tissue_modulus_kpa=5.0 * ratio), tables, SHAPE, SCALE)
            (w, p), (w_expected, p_expected) = probe._face.at(0.5, place, 4.0), softer._face.at(0.5, place)
            assert np.abs(w - w_expected).max() < 2e-4 * w_expected.max()
            assert np.abs(p - p_expected).max() < 1e-3 * p_expected.max()

    def test_a_slower_ramp_on_the_lesion_is_deeper_there_alone(self, tables):
        slower = World(relaxation=Relaxation(0.1, 2.0, lesion_n_per_s=0.05))
        usual, slow = (VirtualProbe(Scenario(world=world), tables, SHAPE, SCALE) for world in (self.RELAXED, slower))
        np.testing.assert_array_equal(usual._face.at(0.5, BESIDE)[1], slow._face.at(0.5, BESIDE)[1])
        p_kpa, p_slow_kpa = (probe._face.at(0.5, LESION)[1] for probe in (usual, slow))
        assert 1e-3 < np.abs(p_slow_kpa - p_kpa).max() / p_kpa.max() < 0.05

    def test_where_a_clock_runs_its_time_counts(self, tables):
        probe = VirtualProbe(Scenario(world=self.RELAXED), tables, SHAPE, SCALE)
        usual_s = 0.5 / 0.15
        np.testing.assert_array_equal(frame(probe, pressed_s=usual_s), frame(probe))
        assert (frame(probe, pressed_s=60.0) != frame(probe)).mean() > 0.05

    def test_softest_tissue_of_the_bounds_can_be_pressed(self, tables):
        """An inclusion at either end of the table's range in a slab near either end of it."""
        for slab_kpa, inclusion_kpa, ratio in ((2.5, 95.0, 0.9), (27.0, 45.0, 1.1)):
            world = World(lesion=OverLesion(tissue_modulus_ratio=ratio), relaxation=Relaxation(0.1))
            scene = Scenario(Inclusion(12.0, 5.0, inclusion_kpa), tissue_modulus_kpa=slab_kpa, world=world)
            w_mm, p_kpa = VirtualProbe(scene, tables, SHAPE, SCALE)._face.at(0.5, ProbePlacement(3.0), 1e6)
            assert np.isfinite(w_mm).all()
            assert p_kpa.min() == 0.0


class TestTexture:
    def test_a_texture_has_its_level_and_its_length(self):
        x_mm = np.arange(-60, 60, 0.5)[None, :]
        light = SkinTexture(2.0, 2.0, seed=3).light_ratio(x_mm, x_mm.T) - 1
        assert light.std() == pytest.approx(0.02, rel=0.1)
        apart_2_mm = np.mean(light[:, 4:] * light[:, :-4]) / light.var()
        assert apart_2_mm == pytest.approx(math.exp(-0.5), abs=0.06)

    def test_it_moves_with_the_skin_and_is_another_at_another_place(self, light_of):
        world = World(texture=SkinTexture(1.0, 2.0))
        wide, scale = (96, 96), PixelScale(0.125, 0.125)  # pixels are render cells: no interpolation between
        fields = [
            light_of(world, ProbePlacement(x_mm), shape=wide, scale=scale)
            / light_of(AS_BELIEVED, ProbePlacement(x_mm), shape=wide, scale=scale)
            for x_mm in (0.0, 1.0, 40.0)
        ]
        np.testing.assert_allclose(fields[1][20:-20, 20:60], fields[0][20:-20, 28:68], atol=3e-4)
        assert abs(np.corrcoef(fields[0].ravel(), fields[2].ravel())[0, 1]) < 0.5

    def test_an_untouched_face_shows_no_skin(self, light_of):
        world = World(texture=SkinTexture(5.0))
        np.testing.assert_array_equal(light_of(world, force_n=0.0), light_of(AS_BELIEVED, force_n=0.0))


def test_the_cells_span_error_is_in_its_counts(tables):
    probe = VirtualProbe(Scenario(world=World(cell_span_ratio=1.02)), tables, SHAPE, SCALE)
    probe.hand.begin()
    probe.hand.follow("press_beside", 0.0)
    assert probe.cell_counts(0.0) == 8200.0
    assert probe.cell_counts(5.0) - 8200.0 == pytest.approx(1.02e5 * probe.hand.force_n(5.0))


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("cell_span_ratio = 0", "world.cell_span_ratio"),
        ("face_motion_ratio = 1.1", "world.face_motion_ratio"),
        ("span = 1", "world.span"),
        ("[world.contact]\nform = 'linear'", "world.contact.form"),
        ("[world.contact]\nexponent = 3", "world.contact.exponent"),
        ("[world.contact]\nlargest_ratio = 0", "world.contact.largest_ratio"),
        ("[world.camera]\nscale_x_ratio = 1.2", "world.camera.scale_x_ratio"),
        ("[world.camera]\naxis_x_mm = 3", "world.camera.axis_x_mm"),
        ("[world.camera]\nrim_distortion_percent = 11", "world.camera.rim_distortion_percent"),
        ("[world.camera]\nfurther_blur_mm = -1", "world.camera.further_blur_mm"),
        ("[world.camera]\naxis_x_px = 3", "world.camera.axis_x_px"),
        ("[world.lesion]\ntissue_modulus_ratio = 0.5", "world.lesion.tissue_modulus_ratio"),
        ("[world.lesion]\nalbedo_ratio = 3", "world.lesion.albedo_ratio"),
        ("[world.lesion]\nalbedo_ratio = 1.5\n[skin]\nalbedo = 0.8", "skin.albedo"),
        ("[world.tilt]\nlesion_x_deg = 11", "world.tilt.lesion_x_deg"),
        ("[world.relaxation]\nlost_ratio = 0.2", "world.relaxation.lost_ratio"),
        ("[world.relaxation]\ntime_constant_s = 0", "world.relaxation.time_constant_s"),
        ("[world.relaxation]\nlesion_n_per_s = 0", "world.relaxation.lesion_n_per_s"),
        ("[world.light]\nside_ratio = [1, 1, 1]", "world.light.side_ratio[3]"),
        ("[world.light]\nside_ratio = [1, 1, 2, 1]", "world.light.side_ratio of -x"),
        ("[world.tissue]\nlesion_ratio = [1, 1, 1, 1]", "world.tissue.lesion_ratio[4]"),
        ("[world.tissue]\nbeside_ratio = [1, 1, 3, 1, 1]", "world.tissue.beside_ratio from 8 mm"),
        ("[world.texture]\nlevel_percent = 11", "world.texture.level_percent"),
        ("[world.texture]\nlength_mm = 0.1", "world.texture.length_mm"),
    ],
)
def test_what_no_world_can_be_is_refused_by_its_key(tmp_path, text, key):
    (tmp_path / "scene.toml").write_text(f"[world]\n{text}\n")
    with pytest.raises(InvalidQuantity) as refusal:
        read_scenario(tmp_path / "scene.toml")
    assert refusal.value.quantity == key


def test_linear_light_has_no_world_but_the_believed():
    assert Scenario(light="linear", world=World()).world == AS_BELIEVED
    with pytest.raises(InvalidQuantity, match="world is given, but must be absent with linear light"):
        Scenario(light="linear", world=World(cell_span_ratio=1.01))


def test_a_world_that_changes_tissue_is_refused_where_ramps_are_given(tables):
    ramps = tables.centred.ramps(INCLUSION)
    with pytest.raises(InvalidQuantity, match="world's tissue"):
        VirtualProbe(Scenario(world=World(relaxation=Relaxation(0.05))), tables, SHAPE, SCALE, ramps=ramps)


def test_a_face_as_believed_is_the_one_that_is_given():
    asked = []

    class Face:
        def at(self, force_n, place):
            return force_n, place

    def face_in(slab, depth_ratios):
        asked.append((slab, depth_ratios))
        return Face()

    assert WorldFace(AS_BELIEVED, Slab(4.4), face_in).at(0.3, LESION) == (0.3, LESION)
    assert asked == [(Slab(4.4), EVEN)]


def test_layers_over_the_lesion_and_beside_it_are_pressed_where_they_are():
    stiff, soft = (1.2, 1.0, 1.0, 1.0, 1.0), (0.8, 1.0, 1.0, 1.0, 1.0)

    class Face:
        def __init__(self, ratio):
            self.ratio = ratio

        def at(self, force_n, place):
            return (np.full((1, 1), self.ratio * force_n, np.float32),) * 2

    def pressed(tissue, place):
        face = WorldFace(World(tissue=tissue), Slab(), lambda slab, depth_ratios: Face(depth_ratios[0]))
        return float(face.at(0.5, place)[0][0, 0])

    unlike, between = TissueInDepth(stiff, soft), ProbePlacement(x_mm=20.0)
    assert [pressed(unlike, one) for one in (LESION, BESIDE)] == pytest.approx([0.6, 0.4])
    assert pressed(unlike, between) == pytest.approx(0.5)  # half way
    assert [pressed(TissueInDepth(stiff, stiff), one) for one in (LESION, between)] == pytest.approx([0.6, 0.6])


def test_the_page_lists_every_key_with_its_default():
    page = (ROOT / "docs" / "simulated_probe.md").read_text(encoding="utf-8")
    shown = page.partition("## Another world")[2].partition("```toml\n")[2].partition("```")[0]
    assert tomllib.loads(shown) == {"world": as_table(AS_BELIEVED)}
