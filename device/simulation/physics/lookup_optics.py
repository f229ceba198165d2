"""Deformed face and contact pressure to what the camera sees: tabulated light, let through by Fresnel, spread by skin.

Light of each LED and of its image in the bottom arrives as a narrow beam: its vector irradiance gives strength and
direction, the face's slope the angle. Wet places take nearly all of it, dry ones only what is steep enough to leave;
so contact, not deformation, makes the image. Left out: shadows of one part of the face on another, and light that
leaves the face by its slope and finds it again. Source: Gershun, The Light Field, J. Math. Phys. 18 (1939); frustrated
total reflection, Han, UIST 2005.

How much light passes the face is Fresnel's law, averaged over the width of its source. Total reflection at a dry face
begins at one exact angle, but an LED is seen under a range of angles; without that average the light that leaks out at
slopes would have false, sharp edges. Source: Hecht, Optics, section 4.6.

The light of one LED is kept for all four, since the block looks the same after a quarter turn. Maps are [..., y, x]
with ascending coordinates; the first LED is the one at +x, then +y, -x, -y.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Single
from device.measurement.quantities import InvalidQuantity
from device.simulation.physics.light_table import LightTable, load_light_table
from device.simulation.physics.skin import AS_ASSUMED, ContactLaw, Skin

LEDS = 4
FINER = 2
"""Render cells along one light cell: light is smooth, contact is not."""
DARK = np.float32(1e-12)
"""Irradiance (1/mm2) that keeps a direction defined where no light arrives."""
LOWEST_COSINE = -0.2
COSINES, WIDTHS = 1200, 32
WIDEST = 0.16
"""Half-width of the range of cosines under which a source is seen; wider ones count as this."""
_ACROSS = 41


class LookupOptics:
    """Radiance towards the camera on a square render grid; what depends on grid, light and skin alone is made once."""

    def __init__(self, table: LightTable) -> None:
        self._table = table
        half, n = table.number("half_width_mm"), table.stray.shape[-1]
        self._cell_mm = 2 * half / n
        self._x_mm: Single = ((np.arange(FINER * n) + 0.5) * (self._cell_mm / FINER) - half).astype(np.float32)
        self._beams = _beams(table, face_area_mm2=4 * half * half)
        self._stray, self._background = four_leds(table.stray), four_leds(table.background)
        k = np.fft.fftfreq(2 * n, self._cell_mm) * 2 * math.pi
        self._square_wavenumber = k[:, None] ** 2 + k[None, : n + 1] ** 2
        self._dry = passing(table.number("refractive_index"), 1.0)
        self._skin: Skin | None = None

    @classmethod
    def load(cls, folder: Path) -> LookupOptics:
        """Read the table of a folder; raise `InvalidQuantity` when it is missing or not what it says it is."""
        return cls(load_light_table(folder))

    @property
    def block(self) -> Mapping[str, float | str]:
        """Optics of the block that the table holds for, by name."""
        return self._table.block

    @property
    def x_mm(self) -> Single:
        """Centres [n] of the render grid's columns (mm)."""
        return self._x_mm

    @property
    def y_mm(self) -> Single:
        """Centres [n] of the render grid's rows (mm)."""
        return self._x_mm

    def radiance(
        self,
        w_mm: Single,
        p_kpa: Single,
        led_ratio: Sequence[float],
        skin: Skin,
        touching: bool = True,
        law: ContactLaw = AS_ASSUMED,
    ) -> Single:
        """Return the radiance towards the camera [ny, nx], 1/(sr mm2) per unit of light of all four LEDs at ratio 1.

        `w_mm` and `p_kpa` [ny, nx] on the render grid; `led_ratio` of the sides +x, +y, -x, -y, and exactly linear in
        it. Without `touching` there is no skin behind the face; `law` is how its contact grows. A face deeper than the
        table counts as its deepest.
        Raises `InvalidQuantity` for fields of another shape, a deformation that is no number, or no four LEDs.
        """
        ratio = self._require(w_mm, p_kpa, led_ratio) / np.float32(LEDS)
        haze = _finer(_lit(ratio, self._background))
        if not touching:
            return haze
        if skin != self._skin:
            self._prepare(skin)
        contact, w = skin.contact_ratio(p_kpa, law), np.asarray(w_mm, dtype=np.float32)
        given_back = _finer(self._given_back(_coarser(w), _coarser(contact), ratio, skin))
        slope_y, slope_x = _slopes(w, self._cell_mm / FINER)
        seen = self._seen_dry + (self._seen_wet - self._seen_dry) * contact
        seen /= np.sqrt(1 + slope_x * slope_x + slope_y * slope_y)
        return np.asarray(given_back * seen + haze)

    def _require(self, w_mm: Single, p_kpa: Single, led_ratio: Sequence[float]) -> Single:
        shape = (len(self._x_mm), len(self._x_mm))
        if w_mm.shape != shape or p_kpa.shape != shape:
            found = f"{w_mm.shape} and {p_kpa.shape}"
            raise InvalidQuantity("shape of w_mm and p_kpa", found, f"{shape}", "sample them on x_mm and y_mm")
        if not np.isfinite(w_mm).all():
            raise InvalidQuantity("w_mm", "not a number somewhere", "finite", "give the deformation of every cell")
        ratio = np.asarray(led_ratio, dtype=np.float32)
        if ratio.shape != (LEDS,) or not np.isfinite(ratio).all():
            raise InvalidQuantity("led_ratio", tuple(led_ratio), "four numbers", "give the sides +x, +y, -x, -y")
        return ratio

    def _prepare(self, skin: Skin) -> None:
        """Make what depends on the skin; kept until another skin comes.

        The camera looks straight up: radiance over squared index is conserved, and what face and glass let through at
        normal incidence hardly changes up to 25 degrees of slope.
        """
        n_block, n_skin = self._table.number("refractive_index"), skin.refractive_index
        self._wet = passing(n_block, n_skin)
        square = self._square_wavenumber * (skin.spread_mm / 2) ** 2
        self._spread = ((1 + square) ** -1.5 * skin.albedo).astype(np.float32)
        self._again_wet = np.float32(skin.albedo * diffuse_reflectance(n_skin, n_block))
        self._again_dry = np.float32(skin.albedo * diffuse_reflectance(1.0, n_block))
        through = _glass(self._table) * math.exp(
            -self._table.number("haze_per_mm") * self._table.number("thickness_mm")
        )
        straight = np.ones(1)
        self._seen_wet = np.float32(transmission(straight, n_block, n_skin)[0] * through / (math.pi * n_skin**2))
        self._seen_dry = np.float32(transmission(straight, n_block, 1.0)[0] * through / math.pi)
        self._skin = skin

    def _given_back(self, w: Single, contact: Single, ratio: Single, skin: Skin) -> Single:
        """Return the light the skin gives back per area (1/mm2) on the light grid.

        Spread is the convolution with 2 exp(-2 r / m) / (pi m^2), m its mean; its transform is (1 + (k m / 2)^2)^-3/2.
        Then what the face itself sends back into the skin, and what comes back once around the block, everywhere alike.
        """
        into_wet, into_dry = self._arriving(w, ratio)
        entering = into_dry + contact * (into_wet - into_dry)
        n, padded = len(w), (2 * len(w), 2 * len(w))
        once = np.fft.irfft2(np.fft.rfft2(entering, padded) * self._spread, padded)[:n, :n]
        again = 1 / (1 - self._again_dry - (self._again_wet - self._again_dry) * contact)
        once *= again
        from_wet = float(np.mean(once * contact))
        from_dry = float(np.mean(once)) - from_wet
        wet, dry = skin.albedo * (np.array([from_wet, from_dry]) @ self._table.returned_ratio)
        return np.asarray(once + (np.float32(dry) + np.float32(wet - dry) * contact) * again, dtype=np.float32)

    def _arriving(self, w: Single, ratio: Single) -> tuple[Single, Single]:
        """Return the light (1/mm2 of the light grid) that a wet and that a dry face would take in."""
        x, y, z, half_angle = self._at_depth(w)
        slope_y, slope_x = _slopes(w, self._cell_mm)
        stretch = np.sqrt(1 + slope_x * slope_x + slope_y * slope_y)
        strength = np.sqrt(x * x + y * y + z * z) + DARK
        cosine = (x * slope_x + y * slope_y + z) / (strength * stretch)
        # Raising the source turns its light by half_angle; this is how much of that changes the cosine.
        width = np.abs(1 / stretch - cosine * z / strength) * half_angle
        index = passing_index(cosine, width)
        strength *= stretch * ratio[:, None, None, None]
        wet, dry = (np.einsum("lcyx,lcyx->yx", strength, np.take(table, index)) for table in (self._wet, self._dry))
        stray = _lit(ratio, self._stray)
        return wet + stray[0], dry + stray[1]

    def _at_depth(self, w: Single) -> Single:
        """Return the beams [x y z half-angle, led, class, n, n] at the face's depth, linear between the table's."""
        depths = self._table.depths_mm
        place = np.clip((w - depths[0]) / (depths[1] - depths[0]), 0, np.float32(len(depths) - 1 - 1e-4)).ravel()
        level = np.floor(place)
        index = level.astype(np.intp) * w.size + np.arange(w.size)
        low = np.take(self._beams, index, axis=-1)
        high = np.take(self._beams, index + w.size, axis=-1)
        high -= low
        high *= place - level
        low += high
        return np.asarray(low.reshape(*low.shape[:-1], *w.shape))


def _beams(table: LightTable, face_area_mm2: float) -> Single:
    """Return [x y z half-angle, led, class, depth * n * n], contiguous so that a depth is quick to take."""
    vectors = four_leds(table.relative_irradiance.astype(np.float32) / np.float32(face_area_mm2), turn_vectors)
    beams = np.concatenate([vectors, four_leds(table.half_angle)[:, :, None]], axis=2)
    by_component = np.moveaxis(beams, 2, 0)
    return np.ascontiguousarray(by_component.reshape(*by_component.shape[:3], -1))


def _glass(table: LightTable) -> float:
    """Return the share of vertical light that passes the glass plate, reflections inside it included."""
    straight, glass = np.ones(1), table.number("glass_refractive_index")
    first = transmission(straight, table.number("refractive_index"), glass)[0]
    second = transmission(straight, glass, 1.0)[0]
    return float(first * second / (1 - (1 - first) * (1 - second)))


def _lit(ratio: Single, maps: Single) -> Single:
    """Return the sum of the LEDs' maps [led, ...], each at its ratio."""
    return np.asarray(np.tensordot(ratio, maps, 1), dtype=np.float32)


def _coarser(field: Single) -> Single:
    """Return the means over 2 x 2 render cells."""
    return (field[::2, ::2] + field[1::2, ::2] + field[::2, 1::2] + field[1::2, 1::2]) * np.float32(0.25)


def _finer(field: Single) -> Single:
    """Return a field of the light grid on the render grid, bilinear between the cells' centres."""
    for axis in (0, 1):
        rows = np.moveaxis(field, axis, 0)
        padded = np.concatenate([rows[:1], rows, rows[-1:]])
        fine = np.empty((2 * len(rows), rows.shape[1]), dtype=np.float32)
        fine[::2] = np.float32(0.75) * rows + np.float32(0.25) * padded[:-2]
        fine[1::2] = np.float32(0.75) * rows + np.float32(0.25) * padded[2:]
        field = np.moveaxis(fine, 0, axis)
    return field


def _slopes(w: Single, step_mm: float) -> tuple[Single, Single]:
    """Return (dw/dy, dw/dx) by central differences, one-sided at the edges."""
    slope_y, slope_x = np.gradient(w, np.float32(step_mm))
    return np.asarray(slope_y), np.asarray(slope_x)


def quarter_turn(field: NDArray[Any]) -> NDArray[Any]:
    """Return a map of numbers [..., n, n] of one LED as that of the next one, a quarter turn from x to y."""
    return np.swapaxes(field[..., ::-1, :], -1, -2)


def turn_vectors(field: NDArray[Any]) -> NDArray[Any]:
    """Return a map of vectors [..., 3, m, n, n] of one LED as that of the next one."""
    x, y, z = np.moveaxis(quarter_turn(field), -4, 0)
    return np.stack([-y, x, z], axis=-4)


def four_leds(field: NDArray[np.floating], turn: Callable[[NDArray[Any]], NDArray[Any]] = quarter_turn) -> Single:
    """Return a map [...] of the LED at +x for all LEDs [4, ...] as float32; vectors turn by `turn_vectors`."""
    maps: list[NDArray[Any]] = [field]
    for _ in range(LEDS - 1):
        maps.append(turn(maps[-1]))
    return np.stack(maps).astype(np.float32)


def transmission(cosine: NDArray[np.float64], n_from: float, n_to: float) -> NDArray[np.float64]:
    """Return the share of unpolarised light that passes an interface; 0 at total reflection and from behind."""
    c = np.clip(cosine, 0.0, 1.0)
    squared = 1 - (n_from / n_to) ** 2 * (1 - c**2)
    refracted = np.sqrt(np.maximum(squared, 0.0))
    with np.errstate(invalid="ignore"):
        perpendicular = (n_from * c - n_to * refracted) / (n_from * c + n_to * refracted)
        parallel = (n_to * c - n_from * refracted) / (n_to * c + n_from * refracted)
    passed = 1 - (perpendicular**2 + parallel**2) / 2
    return np.where((squared > 0) & (c > 0), passed, 0.0)


def diffuse_reflectance(n_from: float, n_to: float) -> float:
    """Return the reflected share of Lambertian light that arrives at an interface: the mean of R over cos^2."""
    squares = (np.arange(2000) + 0.5) / 2000
    return float(1 - transmission(np.sqrt(squares), n_from, n_to).mean())


@lru_cache(maxsize=4)
def passing(n_from: float, n_to: float) -> Single:
    """Return [COSINES * WIDTHS] the mean of cosine * transmission over a round source seen from a place.

    Row: cosine between the light's mean direction and the face's normal, from LOWEST_COSINE to 1. Column: half-width
    of the range of cosines, 0..WIDEST. A disc seen from its side is a semicircle's distribution. Kept, not made again,
    for an index that was asked for before.
    """
    cosine = np.linspace(LOWEST_COSINE, 1.0, COSINES)[:, None, None]
    width = np.linspace(0.0, WIDEST, WIDTHS)[None, :, None]
    angle = (np.arange(_ACROSS) + 0.5) * math.pi / _ACROSS
    weight = np.sin(angle) ** 2
    seen = np.clip(cosine + width * np.cos(angle), -1.0, 1.0)
    mean = (np.maximum(seen, 0.0) * transmission(seen, n_from, n_to) * weight).sum(axis=2) / weight.sum()
    table = np.asarray(mean.ravel(), dtype=np.float32)
    table.setflags(write=False)
    return table


def passing_index(cosine: Single, width: Single) -> NDArray[np.intp]:
    """Return where in the table of `passing` a cosine and a half-width of cosines are, to the nearest entry."""
    row = (cosine - np.float32(LOWEST_COSINE)) * np.float32((COSINES - 1) / (1 - LOWEST_COSINE)) + np.float32(0.5)
    column = width * np.float32((WIDTHS - 1) / WIDEST) + np.float32(0.5)
    row, column = np.clip(row, 0, COSINES - 1), np.minimum(column, WIDTHS - 1)
    return np.asarray(row.astype(np.intp) * WIDTHS + column.astype(np.intp))
