"""Puts the load cell together: its line, real or emulated, its two tares, and the recorder of force on top.

A daemon whose probe is held, or its cell unplugged, while it starts has a recorder at fault, which tares once it is
lifted or plugged in.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

from device.config import Config
from device.hardware.interfaces import CellCounts, CellSample, ForceScale, LoadCell
from device.hardware.load_cell import measure_tare, open_load_cell
from device.instrument.acquisition.force_recorder import ForceRecorder, Zero
from device.instrument.acquisition.load_limit import LoadLimit
from device.instrument.watch.progress import ProgressBoard
from device.simulation.chips.emulated_amplifier import EmulatedAmplifier, EmulatedBridge
from device.simulation.chips.mantracourt_line import EmulatedMantracourt
from device.simulation.chips.openscale_line import EmulatedOpenScale
from device.simulation.faults import FaultTimeline
from device.simulation.scenario import CellSettings
from device.simulation.virtual_probe import VirtualProbe

log = logging.getLogger(__name__)

TARE_SAMPLES = 20


def open_cell(config: Config, device: str) -> LoadCell:
    """Open the line at a path by the settings' protocol, or let the first read do so that finds it plugged in."""
    settings = config.cell
    coding, delay_s = settings.coding, settings.delay_s
    return open_load_cell(device, settings.baud, settings.protocol, settings.station, coding=coding, delay_s=delay_s)


def emulated_amplifier(config: Config, probe: VirtualProbe, faults: FaultTimeline) -> EmulatedAmplifier:
    """Return the virtual probe's amplifier: it speaks what the settings expect."""
    cell = probe.scenario.cell
    bridge = EmulatedBridge(
        probe.cell_counts,
        noise_counts=cell.noise_counts,
        drift_counts_per_s=cell.drift_counts_per_s,
        seed=probe.scenario.seed,
        faults=faults,
    )
    if config.cell.protocol == "mantracourt":
        return EmulatedMantracourt(bridge, station=config.cell.station, faults=faults)
    is_offset_binary = config.cell.coding == "offset_binary"
    return EmulatedOpenScale(bridge, rate_hz=cell.rate_hz, is_offset_binary=is_offset_binary, faults=faults)


def commissioned(config: Config) -> Config:
    """Return the settings with the commissioning tare that every virtual probe left its maker with, unless they say."""
    if config.cell.commissioned_tare_counts is not None:
        return config
    return replace(config, cell=replace(config.cell, commissioned_tare_counts=CellSettings().zero_counts))


def tared(config: Config, cell: LoadCell, progress: ProgressBoard | None = None) -> ForceRecorder:
    """Take the tare of this start and record from then on; raise the `LoadCellError` that forbids it."""
    recorder = tared_once_lifted(config, cell, progress)
    if fault := recorder.fault:
        recorder.close()
        raise fault
    return recorder


def tared_once_lifted(config: Config, cell: LoadCell, progress: ProgressBoard | None = None) -> ForceRecorder:
    """Take the tare of this start and record from then on; until it holds, the recorder is at fault and tries again."""
    return ForceRecorder(cell, lambda read: _zero(config, read), progress)


def _zero(config: Config, read: Callable[[], CellSample]) -> Zero:
    """Return scale and limit by a tare: newtons count from it, overload from that of commissioning.

    Raises the `LoadCellError` that forbids it.
    """
    settings, sensitivity = config.cell, config.cell.sensitivity_counts_per_n
    tare_counts = measure_tare(read, samples=TARE_SAMPLES, max_spread_counts=settings.tare_spread_n * sensitivity)
    at_commissioning = settings.commissioned_tare_counts
    zero_counts = tare_counts if at_commissioning is None else CellCounts(at_commissioning)
    limit = LoadLimit(ForceScale(sensitivity, zero_counts), settings.max_load_n, settings.tare_drift_n)
    limit.require_tare(tare_counts)
    log.info("tare %.0f counts, at commissioning %s", tare_counts, at_commissioning)
    return ForceScale(sensitivity, tare_counts), limit
