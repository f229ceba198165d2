"""What the virtual probe is and presses on, where that differs from what the models believe: one record, all apart.

Whatever is as believed changes nothing, to the last bit. What differs between the lesion's press and the reference's
goes by where the probe stands: `World.lesion_share` is 1 at the lesion, 0 beside it, and smooth between.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from device.measurement.parameters import LAYER_TOPS_MM
from device.measurement.quantities import Bound, require
from device.measurement.recording.led_sides import SIDES, LedRatio
from device.simulation.physics.layer_table import EVEN, DepthRatios, LayerRatios
from device.simulation.physics.lens import TrueCamera
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.skin import ContactLaw, Skin, SkinTexture

ACTION = "name a probe that can be built, or a press that can be made"
LESION_TO_MM, BESIDE_FROM_MM = 12.0, 28.0
"""Where the lesion's skin and tissue end, and where those beside it begin: from the lesion's middle to the probe's."""
ALIKE: LedRatio = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True)
class OverLesion:
    """Skin and tissue over the lesion against beside it, where they are what the scene says; 1 is alike.

    The tissue's ratio is of its Young's modulus; the inclusion keeps its own.
    """

    contact_pressure_ratio: float = 1.0
    albedo_ratio: float = 1.0
    tissue_modulus_ratio: float = 1.0

    def __post_init__(self) -> None:
        for name in ("contact_pressure_ratio", "albedo_ratio"):
            require(f"world.lesion.{name}", getattr(self, name), Bound(0.5, 2.0, ""), ACTION)
        require("world.lesion.tissue_modulus_ratio", self.tissue_modulus_ratio, Bound(0.9, 1.1, ""), ACTION)

    def skin(self, beside: Skin, share: float) -> Skin:
        """Return the skin where so much of it is that over the lesion; raises for an albedo above 1."""
        return replace(
            beside,
            albedo=beside.albedo * self.albedo_ratio**share,
            contact_pressure_kpa=beside.contact_pressure_kpa * self.contact_pressure_ratio**share,
        )


@dataclass(frozen=True)
class TissueInDepth:
    """Young's moduli of the tissue's layers over the scene's, from the surface to the base: over the lesion and beside.

    Layers begin at `LAYER_TOPS_MM`.
    """

    lesion_ratio: DepthRatios = EVEN
    beside_ratio: DepthRatios = EVEN

    def __post_init__(self) -> None:
        for name in ("lesion_ratio", "beside_ratio"):
            for top_mm, ratio in zip(LAYER_TOPS_MM, getattr(self, name), strict=True):
                require(f"world.tissue.{name} from {top_mm:g} mm", ratio, Bound(0.5, 2.0, ""), ACTION)

    @property
    def is_alike(self) -> bool:
        """Whether layers over the lesion are as those beside it."""
        return self.lesion_ratio == self.beside_ratio


@dataclass(frozen=True)
class PressTilts:
    """How the probe leans on the lesion and beside it, in degrees, on top of how the hand leans on both."""

    lesion_x_deg: float = 0.0
    lesion_y_deg: float = 0.0
    beside_x_deg: float = 0.0
    beside_y_deg: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            require(f"world.tilt.{name}", getattr(self, name), Bound(-10.0, 10.0, "deg"), ACTION)

    def leaning(self, place: ProbePlacement, share: float) -> ProbePlacement:
        """Return the placement with the tilt of its press added."""
        return replace(
            place,
            tilt_x_deg=place.tilt_x_deg + share * self.lesion_x_deg + (1 - share) * self.beside_x_deg,
            tilt_y_deg=place.tilt_y_deg + share * self.lesion_y_deg + (1 - share) * self.beside_y_deg,
        )


@dataclass(frozen=True)
class Relaxation:
    """Tissue that gives way while it is pressed: a Prony series of one term.

    `lost_ratio` of the modulus is lost in the end, with `time_constant_s`. Where no clock runs (phantoms, rows of a
    profile) a force is reached at `beside_n_per_s` and `lesion_n_per_s`.
    """

    lost_ratio: float = 0.0
    time_constant_s: float = 5.0
    beside_n_per_s: float = 0.15
    lesion_n_per_s: float = 0.15

    def __post_init__(self) -> None:
        require("world.relaxation.lost_ratio", self.lost_ratio, Bound(0.0, 0.1, ""), ACTION)
        require("world.relaxation.time_constant_s", self.time_constant_s, Bound(0.1, 1e3, "s"), ACTION)
        for name in ("beside_n_per_s", "lesion_n_per_s"):
            require(f"world.relaxation.{name}", getattr(self, name), Bound(0.01, 10.0, "N/s"), ACTION)

    def pressed_s(self, force_n: float, share: float) -> float:
        """Return how long a force is on its way where no clock runs."""
        return force_n / (math.pow(self.lesion_n_per_s, share) * math.pow(self.beside_n_per_s, 1 - share))

    def modulus_ratio(self, pressed_s: float) -> float:
        """Return the modulus, against that of a sudden press, of tissue that is pressed ever deeper since then.

        Stress over strain of a steady ramp: 1 - lost (1 - (1 - exp(-t)) / t), t in time constants.
        """
        t = pressed_s / self.time_constant_s
        return 1 - self.lost_ratio * (1 + math.expm1(-t) / t) if t > 0 else 1.0


@dataclass(frozen=True)
class TrueLight:
    """Light of the sides +x, +y, -x, -y over what their brightness says: `side_ratio` always, `lesion_side_ratio` on
    the lesion only.
    """

    side_ratio: LedRatio = ALIKE
    lesion_side_ratio: LedRatio = ALIKE

    def __post_init__(self) -> None:
        for name in ("side_ratio", "lesion_side_ratio"):
            for side, ratio in zip(SIDES, getattr(self, name), strict=True):
                require(f"world.light.{name} of {side}", ratio, Bound(0.5, 1.5, ""), ACTION)

    def lit(self, led_ratio: LedRatio, share: float) -> LedRatio:
        """Return the light of the sides, which may be above 1."""
        x, y, left, below = (
            led * always * lesion**share
            for led, always, lesion in zip(led_ratio, self.side_ratio, self.lesion_side_ratio, strict=True)
        )
        return x, y, left, below


@dataclass(frozen=True)
class World:
    """A probe and its presses as they truly are.

    `cell_span_ratio`: counts of a newton over the certificate's. `face_motion_ratio`: 0 draws the face where it was
    before the press, with pressures per area of then, as tables and models have it; 1 where the camera sees it.
    """

    contact: ContactLaw = field(default_factory=ContactLaw)
    camera: TrueCamera = field(default_factory=TrueCamera)
    lesion: OverLesion = field(default_factory=OverLesion)
    tilt: PressTilts = field(default_factory=PressTilts)
    relaxation: Relaxation = field(default_factory=Relaxation)
    light: TrueLight = field(default_factory=TrueLight)
    layers: LayerRatios = field(default_factory=LayerRatios)
    tissue: TissueInDepth = field(default_factory=TissueInDepth)
    texture: SkinTexture = field(default_factory=SkinTexture)
    cell_span_ratio: float = 1.0
    face_motion_ratio: float = 0.0

    def __post_init__(self) -> None:
        require("world.cell_span_ratio", self.cell_span_ratio, Bound(0.5, 2.0, ""), ACTION)
        require("world.face_motion_ratio", self.face_motion_ratio, Bound(0.0, 1.0, ""), ACTION)

    def lesion_share(self, place: ProbePlacement) -> float:
        """Return how much of what is pressed is over the lesion: 1 at it, 0 beside, by a cubic between."""
        from_lesion_mm = math.hypot(place.x_mm, place.y_mm)
        beside = min(max((from_lesion_mm - LESION_TO_MM) / (BESIDE_FROM_MM - LESION_TO_MM), 0.0), 1.0)
        return 1 - beside * beside * (3 - 2 * beside)

    def tissue_ratio(self, place: ProbePlacement, pressed_s: float) -> float:
        """Return the tissue's modulus over the scene's, where the probe stands and after so long."""
        local = math.pow(self.lesion.tissue_modulus_ratio, self.lesion_share(place))
        return local * self.relaxation.modulus_ratio(pressed_s)

    def tissue_ratios(self) -> tuple[float, float]:
        """Return the least and the largest tissue ratio of any press."""
        ends = 1.0, self.lesion.tissue_modulus_ratio
        return min(ends) * (1 - self.relaxation.lost_ratio), max(ends)


AS_BELIEVED = World()
