"""How well a grid target tells a simulated camera, and what rows of a press gain by it.

The grid is seen by the whole world of a scenario: its light, blur and camera, 8 bits with noise. The press for the rows
is of that camera in an otherwise ideal world, almost without noise, so that the camera alone makes the difference.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from device.files.shipped import SIMULATED_PROBE
from device.measurement.arrays import Array
from device.measurement.quantities import Bound, Inclusion, require
from device.measurement.ramp_modes.radial_profile import press_profile
from device.measurement.recording.recording import Recording
from device.simulation.grid_target import GridTarget
from device.simulation.physics.sensor import Sensor
from device.simulation.physics.world import World
from device.simulation.scenario import Scenario, read_scenario
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.camera_fit import FittedCamera, GridPrint, camera_of
from host_tools.calibration.phantom import CAMERA, grid_recordings, phantom_recording
from host_tools.press_models.recorded_presses import protocol_of

LEAST_PLAY_MM = 1e-4
QUIET = Sensor(
    bits=10, sensitivity_e_per_us=500.0, full_well_e=1e6, read_noise_e=0.0, gain_spread_ratio=0.0, offset_spread_e=0.0
)
"""Shot noise a tenth of the probe's, and hardly any other."""
INCLUSION, OFFSET_MM, DIRECTION_RAD = Inclusion(10.0, 6.0, 80.0), 1.5, 0.7
HEADER = """\
| world | dots | scale x, y % | axis x, y um | distortion % | rows before | after |
|---|---|---|---|---|---|---|"""


@dataclass(frozen=True, eq=False)
class CameraTrial:
    """Errors [5] of one camera: pixel sizes (%), axis (mm), distortion (%), with the stated deviations of each.

    `before`, `after`: root mean square difference of a press's row from the ideal camera's.
    """

    errors: Array
    deviations: Array
    dots: int
    before: float
    after: float

    def as_line(self, name: str) -> str:
        """Return it as a line of the table."""
        x, y, axis_x, axis_y, distortion = self.errors
        axis = f"{1000 * axis_x:+.1f}, {1000 * axis_y:+.1f}"
        rows = f"{1000 * self.before:.2f} | {1000 * self.after:.2f}"
        return f"| {name} | {self.dots} | {x:+.3f}, {y:+.3f} | {axis} | {distortion:+.3f} | {rows} |"


def trial_table(worlds: Sequence[Path], *, grids: int, play_mm: float, seed: int) -> Iterator[str]:
    """Yield the lines of a table of all worlds, and below it the root mean squares and largest errors."""
    require("grids", grids, Bound(1, 100, "recordings"), "record the grid at least once")
    require("play_mm", play_mm, Bound(0.0, 1.0, "mm"), "give the play of the cap")
    tables, trials = ProbeTables.load(SIMULATED_PROBE), list[CameraTrial]()
    ideal = press_profile(_press(tables, World())).as_row()
    yield HEADER
    for number, path in enumerate(worlds):
        trials.append(_trial(tables, read_scenario(path), ideal, grids, play_mm, seed + number))
        yield trials[-1].as_line(path.stem)
    for name, of in (("rms", _rms), ("largest", lambda values: np.abs(values).max(axis=0))):
        errors, rows = of(np.array([one.errors for one in trials])), of(np.array([(t.before, t.after) for t in trials]))
        yield CameraTrial(errors, errors, sum(one.dots for one in trials), *map(float, rows)).as_line(name)
    ratios = _rms(np.array([one.errors / one.deviations for one in trials]))
    yield f"\nErrors over their stated deviations (rms): {', '.join(f'{ratio:.2f}' for ratio in ratios)}."


def _rms(values: Array) -> Array:
    return np.asarray(np.sqrt((values**2).mean(axis=0)))


def _trial(tables: ProbeTables, scenario: Scenario, ideal: Array, grids: int, play_mm: float, seed: int) -> CameraTrial:
    made = grid_recordings(grids, GridTarget(), tables, play_mm=play_mm, seed=seed, scenario=scenario)
    printed = GridPrint(play_mm=max(play_mm, LEAST_PLAY_MM))
    found = camera_of({f"grid{number}": one for number, one in enumerate(made)}, printed)
    errors, deviations = _errors(found, scenario)
    seen = _press(tables, World(camera=scenario.world.camera))
    known = replace(seen, camera=seen.camera.seen_as(found.geometry))
    before, after = (float(_rms(press_profile(one).as_row() - ideal)) for one in (seen, known))
    return CameraTrial(errors, deviations, found.dots, before, after)


def _errors(found: FittedCamera, scenario: Scenario) -> tuple[Array, Array]:
    """Return errors and stated deviations [5], those of pixel sizes in per cent of them."""
    true, sizes = scenario.world.camera, np.array([CAMERA.mm_per_px_x, CAMERA.mm_per_px_y])
    sizes = sizes * (true.scale_x_ratio, true.scale_y_ratio)
    truth = np.array([*sizes, true.axis_x_mm, true.axis_y_mm, true.rim_distortion_percent])
    per_cent = np.array([*(100 / sizes), 1, 1, 1])
    values, deviations = np.array([(value, deviation) for _, value, deviation, _ in found.rows()]).T
    return per_cent * (values - truth), per_cent * deviations


def _press(tables: ProbeTables, world: World) -> Recording:
    """Return the recording of one press in mode standard, off the axis, with forces as they are asked for."""
    protocol = replace(protocol_of("standard", OFFSET_MM, DIRECTION_RAD), stray_n=0.0)
    return phantom_recording(INCLUSION, tables, seed=1, protocol=protocol, scenario=Scenario(world=world, sensor=QUIET))
