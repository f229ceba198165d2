"""What `import host_tools` offers as functions: each a few words over the module that does the work.

A tolerance is a ratio: 0.01 is 1 %. Folders of models and of the simulated probe are those of this repository unless
given. Nothing here computes anything of its own, and each function imports what it needs: whoever solves a scene does
not wait for what reads recordings.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from device import __version__
from device.files.shipped import CERTIFICATES, MODELS, PROTOCOLS, SIMULATED_PROBE
from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.scenes.scene import WITHIN_S, AskedStrain, Press, Scene

if TYPE_CHECKING:
    import xarray as xr

    from device.measurement.bundle import ModelBundle
    from device.measurement.calibration import Calibration
    from device.measurement.estimate import Estimate
    from device.measurement.mode_models import ModeModels
    from device.measurement.recording.recording import Recording
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.cramer_rao.bounds import Limits
    from host_tools.cramer_rao.protocol import PressProtocol
    from host_tools.forward.solution import Solution
    from host_tools.paper_network.train import Trained

STANDARD_PROTOCOL = PROTOCOLS / "standard.toml"


def solve(
    scene: Scene,
    *,
    tolerance: float | None = None,
    strain: AskedStrain = "auto",
    within_s: float = WITHIN_S,
    best: bool = False,
) -> Solution:
    """Solve a scene by the cheapest model that holds a tolerance: the face, the force, O1-O3, and errors.

    `tolerance` is the relative error allowed on force and O1-O3: 0.01 is 1 %. What is stated is compared with it, and
    higher levels are taken until it holds, for `within_s` seconds. Without one 0.5 % is aimed at, and a `UserWarning`
    says where it is missed. `strain` "auto" takes finite strain where small
    strain departs by more than that; "small" is the paper's model, whose departure is then not counted. Raise
    `InvalidQuantity` for a scene that no model serves, `PressFailed` for a press that cannot be reached, and
    `ToleranceMissed` where no level holds what was asked for; `best` returns the best instead. Of a press that was
    found without what it errs, stated errors are infinite.
    """
    return solve_ramp(scene, [scene.press], tolerance=tolerance, strain=strain, within_s=within_s, best=best)[0]


def solve_ramp(
    scene: Scene,
    presses: Sequence[Press],
    *,
    tolerance: float | None = None,
    strain: AskedStrain = "auto",
    within_s: float = WITHIN_S,
    best: bool = False,
) -> tuple[Solution, ...]:
    """Solve a scene at several presses, all by indentation or all by force, ascending; one path serves all.

    As `solve`; `dataset_of` makes one data set of them.
    """
    from host_tools.forward.ladder import climb, held
    from host_tools.forward.plan import DEFAULT_TOLERANCE

    if not presses:
        raise InvalidQuantity("presses", "none", "at least one", "give the loads")
    _require_rising(presses)
    require("within_s", within_s, Bound(0.0, 1e6, "s", low_included=False), "allow some time")
    aim = DEFAULT_TOLERANCE if tolerance is None else tolerance
    takes_best = best or tolerance is None
    allowed = require("tolerance", aim, Bound(0.0, 1.0, "", low_included=False), "give a ratio, 0.01 for 1 %")
    climbed = climb(scene, presses, tolerance=allowed, strain=strain, within_s=within_s, best=takes_best)
    if tolerance is None and not best and climbed.missed:
        warnings.warn(climbed.missed, stacklevel=3)
    return held(climbed, best=takes_best).solutions


def _require_rising(presses: Sequence[Press]) -> None:
    """Raise `InvalidQuantity` unless all are by indentation or all by force, each more than the one before."""
    loads = [press.indentation_mm if presses[0].force_n is None else press.force_n for press in presses]
    known = [load for load in loads if load is not None]
    if len(known) < len(loads) or any(after <= before for before, after in pairwise(known)):
        raise InvalidQuantity("presses", loads, "all by indentation or all by force, rising", "give them in that order")


def sweep(
    scenes: int,
    out: Path | str,
    *,
    seed: int = 1,
    forces_n: Sequence[float] = (0.5,),
    strain: AskedStrain | None = None,
    jobs: int = -1,
    scheduler: str | None = None,
    tolerance: float | None = None,
    within_s: float = WITHIN_S,
    replace: bool = False,
) -> xr.Dataset:
    """Solve random scenes of the paper's box under rising forces into a netCDF file; return it as a data set.

    On all cores, or on a Dask cluster (`scheduler` "tcp://host:port"). Interrupted, the same call goes on. All scenes
    are solved at one level, since features would jump where a plan changes its mind, and in small strain unless told,
    whose departure from finite strain no row states. With a `tolerance` (a ratio) each climbs as `solve` does, for
    `within_s` at most, in the strain measure that the tolerance asks for unless told; its `level` says where it came
    to. A scene that fails, or cannot hold it, is a row of NaN with its `reason`. A file that holds this sweep is read
    as it is; raise `InvalidQuantity` for one that holds anything else, unless `replace`.
    """
    from host_tools.data.plan import SweepPlan, asked_strain
    from host_tools.data.sweep import sweep as solve_scenes

    measure = asked_strain(strain, tolerance)
    plan = SweepPlan(scenes, seed, tuple(forces_n), measure, tolerance=tolerance, within_s=within_s)
    return read_sweep(solve_scenes(plan, Path(out), jobs=jobs, scheduler=scheduler, replace=replace))


def read_sweep(path: Path | str) -> xr.Dataset:
    """Return the data set of a sweep: a row a scene, in the names of `Solution.to_xarray`, with the unit of each.

    `attrs` hold schema and origin (JSON). Raise `InvalidQuantity` for a file that is no sweep.
    """
    from host_tools.data.dataset import read_dataset
    from host_tools.forward.solution_dataset import named_as_solutions

    return named_as_solutions(read_dataset(Path(path)))


def train(sweep_file: Path | str, *, trials: int = 100, seed: int = 1) -> Trained:
    """Train the paper's network, `trials` times, on a sweep's file; nine of its scenes are kept apart to score it.

    Raise `InvalidQuantity` for a sweep of too few scenes, several loads or finite strain.
    """
    from host_tools.data.dataset import require_enough, training_rows
    from host_tools.paper_network.train import train as train_networks

    rows = training_rows(Path(sweep_file))
    require_enough(rows, Path(sweep_file))
    return train_networks(rows, trials=trials, seed=seed)


def export(trained: Trained, folder: Path | str) -> ModelBundle:
    """Write a trained model's bundle, ONNX and card, to a folder; return it as the probe would load it.

    An older bundle there is replaced; raise `InvalidQuantity` for a folder of anything else.
    """
    from device.files.bundle_file import read_paper_model
    from host_tools.paper_network.export import export as write_bundle

    write_bundle(trained, Path(folder), software_version=__version__)
    return read_paper_model(Path(folder))


def limits(scene: Scene, protocol: PressProtocol | Path | str = STANDARD_PROTOCOL) -> Limits:
    """Return the Cramer-Rao bound: how well any method could know size, depth and modulus in a scene.

    `protocol` says what is measured and how uncertain the rest is, itself or its TOML file; by default that of mode
    standard. Raise `InvalidQuantity` for a scene off the axis, layered or without inclusion.
    """
    from host_tools.cramer_rao.bounds import limits as bounds
    from host_tools.cramer_rao.protocol import read_protocol

    return bounds(scene, read_protocol(Path(protocol)) if isinstance(protocol, Path | str) else protocol)


def installed_models(folder: Path | str = MODELS) -> ModeModels:
    """Return the models of all modes in a folder; raise `BundleRefused` for one that does not hold."""
    from device.files.bundle_file import read_models, read_paper_model

    models = Path(folder)
    return read_models(read_paper_model(models / "paper"), models / "quick", models / "standard")


def simulated_probe(folder: Path | str = SIMULATED_PROBE) -> ProbeTables:
    """Return the tables of the simulated probe, which stand in for finite elements and ray tracing."""
    from device.simulation.virtual_probe import ProbeTables

    return ProbeTables.load(Path(folder))


def analyse(
    recording: Recording | Path | str,
    *,
    mode: str = "",
    models: ModeModels | None = None,
    calibration: Calibration | None = None,
) -> Estimate:
    """Return size, depth and modulus of a recording, or of its folder or .zip, as the probe would answer.

    `mode` quick, standard, precise or paper; by default the one that reads most of the frames. Models and certificate
    are those of the simulated probe unless given. Raise `InvalidQuantity` where recording, mode, model and certificate
    do not belong together.
    """
    from device.files.certificate_file import read_calibration
    from device.files.recording_file import read_recording
    from device.measurement.mode import mode_named
    from device.measurement.mode_models import analysed

    taken = read_recording(Path(recording)) if isinstance(recording, Path | str) else recording
    certificate = calibration or read_calibration(SIMULATED_PROBE / CERTIFICATES["physical"])
    return analysed(taken, models or installed_models(), certificate, mode_named(mode) if mode else None)
