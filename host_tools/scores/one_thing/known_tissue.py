"""What it costs in size, depth and modulus that a patient's tissue may be any that people have, not a nominal one.

The bound of a ramp (Cramer-Rao, with the box as prior) is told twice for the same press: with tissue and slab known to
lie near the nominal ones, and known only to lie where people's do. The difference is what the wider range costs, since
nothing else changes. Every press is solved by finite elements in its tissue.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from device.files.shipped import PROTOCOLS
from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD, NEAR_NOMINAL, RANGES
from device.measurement.quantities import UNKNOWNS, Inclusion
from host_tools.cramer_rao.bounds import limit_of, std_of_box
from host_tools.cramer_rao.protocol import read_protocol
from host_tools.forward.derivatives.sensitive_presses import sensitive_ramp
from host_tools.forward.press_model import PressFailed
from host_tools.pages.benchmark import Chapter, Table, at_most
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.scenes.scene import Scene, Tissue

OF_TISSUE = "tissue_modulus_kpa", "slab_thickness_mm"
NEAR_KPA, NEAR_MM = (NEAR_NOMINAL[name][:2] for name in OF_TISSUE)
PEOPLES_KPA, PEOPLES_MM = (RANGES[name][:2] for name in OF_TISSUE)
TISSUES = ((5.0, 30.0), (3.0, 30.0), (10.0, 30.0), (20.0, 30.0), (5.0, 20.0), (5.0, 60.0))
"""Modulus (kPa) of tissue and thickness (mm) of the slab."""
INCLUSIONS = (Inclusion(10.0, 5.0, 60.0), Inclusion(8.0, 6.0, 120.0), Inclusion(12.0, 7.0, 40.0))
COSTS_AT_MOST = 1.1
"""Ratio of spreads: a tenth more is what two estimates of the same press differ by (docs/modes.md)."""
HEADER = ("tissue (kPa)", "slab (mm)", "size (mm)", "depth (mm)", "modulus (kPa)", "size +- (mm)", "depth +- (mm)",
          "modulus +-", "in people's tissue: size +- (mm)", "depth +- (mm)", "modulus +-")  # fmt: skip


def known_tissue_chapter(*, jobs: int = -1) -> Chapter:
    """Return the bounds of ramps where the tissue is known nearly, and where it may be any that people have."""
    presses = [(tissue, inclusion) for tissue in TISSUES for inclusion in INCLUSIONS]
    found = in_parallel(lambda number: _bounds(*presses[number]), len(presses), jobs, smallest_batch=1)
    told = [(*press, bounds) for press, bounds in zip(presses, found, strict=True) if bounds is not None]
    near, peoples = np.moveaxis(np.array([bounds for _, _, bounds in told]), 1, 0)
    return Chapter(
        title="What not knowing the tissue costs",
        claim=f"The least spreads of one ramp on {len(presses)} presses, of which {len(told)} can be followed to the "
        "protocol's largest force; tissue that folds at a rim before is left out.",
        source="Kay, Fundamentals of Statistical Signal Processing (1993), 3.4; host_tools/cramer_rao",
        benchmarks=tuple(
            at_most("one ramp, any tissue", f"largest ratio of the spread of {name}", float(ratio), COSTS_AT_MOST)
            for name, ratio in zip(UNKNOWNS, np.max(peoples / near, axis=0), strict=True)
        ),
        tables=(Table("Known at best, by the Cramer-Rao bound with the box as prior", HEADER, tuple(map(_row, told))),),
        facts={"near_kpa": NEAR_KPA, "near_mm": NEAR_MM, "peoples_kpa": PEOPLES_KPA, "peoples_mm": PEOPLES_MM},
    )


def _row(told: tuple[tuple[float, float], Inclusion, Array]) -> tuple[str, ...]:
    tissue, inclusion, bounds = told
    cells = (f"{spread:.0%}" if i % len(UNKNOWNS) == 2 else f"{spread:.2f}" for i, spread in enumerate(bounds.ravel()))
    return *(f"{value:g}" for value in (*tissue, *inclusion.as_tuple())), *cells


def _bounds(tissue: tuple[float, float], inclusion: Inclusion) -> Array | None:
    """Return the bounds [2, 3]; None where soft tissue folds at a rim before the largest force."""
    try:
        return known_at_best(tissue, inclusion)
    except PressFailed:
        return None


def known_at_best(tissue: tuple[float, float], inclusion: Inclusion) -> Array:
    """Return the bounds [2, 3] of size (mm), depth (mm) and ln E of a ramp on one tissue (kPa) and slab (mm).

    Both are known to lie near the nominal ones, or where people's do, evenly by their ratio. Raises `PressFailed` where
    the press cannot be followed to the protocol's largest force.
    """
    told = read_protocol(PROTOCOLS / "standard.toml")
    scene = Scene(inclusion, tissue=Tissue(youngs_modulus_kpa=tissue[0], thickness_mm=tissue[1]))
    ramps = sensitive_ramp(scene, told.forces_n, strain=told.strain).values()
    bounds = []
    for kpa, mm in ((NEAR_KPA, NEAR_MM), (PEOPLES_KPA, PEOPLES_MM)):
        tissue_ratio, slab_ratio = (float(np.log(high / low) * EVEN_STD / 2) for low, high in (kpa, mm))
        protocol = replace(told, tissue_modulus_spread_ratio=tissue_ratio, thickness_spread_ratio=slab_ratio)
        found = [limit_of(ramp, protocol, std_of_box(inclusion)).with_box.std for ramp in ramps]
        bounds.append(np.max(found, axis=0))
    return np.array(bounds) * (inclusion.size_mm, inclusion.depth_mm, 1.0)
