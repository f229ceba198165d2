"""The settings of the load cell: how its amplifier is read, what a count of it is worth, and what the cell bears.

The zero of commissioning and that of each start are two: how far they may lie apart tells a cell that was bent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from device.measurement.quantities import Bound
from device.settings.setting import Section, setting

CellProtocol = Literal["openscale", "mantracourt"]


@dataclass(frozen=True)
class CellSection(Section):
    """The load cell: its serial line, its sensitivity, and what it bears."""

    prefix = "cell."

    device: str = setting("/dev/tsis-force", "Serial line of the load cell's amplifier.")
    baud: int = setting(115_200, "Speed of the serial line.", Bound(300, 4_000_000, "baud"))
    protocol: CellProtocol = setting(
        "openscale",
        "What the load cell's amplifier speaks; a mantracourt has a station, and a count of 1 nV/V.",
        choices=get_args(CellProtocol),
    )
    station: int = setting(1, "Station number of a mantracourt.", Bound(1, 999, ""))
    sensitivity_counts_per_n: float = setting(
        100_000.0, "Change of the amplifier's reading by one newton.", Bound(1.0, 1e7, "counts/N")
    )
    tare_spread_n: float = setting(
        0.02, "Readings that spread more than this while taring are not of an untouched probe.", Bound(0.0001, 1.0, "N")
    )
    commissioned_tare_counts: float | None = setting(
        None,
        "Reading of the free probe at commissioning; without it that of each start stands in.",
        Bound(-(2.0**23), 2.0**23, "counts"),
    )
    tare_drift_n: float = setting(
        0.2, "How far from the commissioning tare the tare of a start may be.", Bound(0.01, 5.0, "N")
    )
    max_load_n: float = setting(5.0, "Load, from the commissioning tare, that is an overload.", Bound(1.0, 100.0, "N"))
