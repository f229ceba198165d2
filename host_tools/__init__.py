"""The workstation toolkit, and the researcher's door to it.

    import host_tools as tsis

    scene = tsis.Scene(tsis.Inclusion(size_mm=10, depth_mm=6, youngs_modulus_kpa=80), tsis.Press(force_n=0.2))
    solution = tsis.solve(scene, tolerance=0.01)
    solution.plot()

- the scene: `Scene`, `Inclusion`, `Press`, `Waveguide`, `Tissue`, `TissueLayer`, `Placement`, `read_scene`,
  `write_scene`
- solve it: `solve`, `solve_ramp`, `Solution`, `dataset_of`, `simulated_frame`
- many scenes, and a model of them: `sweep`, `read_sweep`, `train`, `export`
- what can be known: `limits`, `PressProtocol`, `read_protocol`
- recordings and answers: `Recording`, `read_recording`, `write_recording`, `simulated_probe`, `phantom_recording`,
  `Estimate`, `ModeModels`, `installed_models`, `analyse`
- refusals: `InvalidQuantity`, `PressFailed`, `ToleranceMissed`, `BundleRefused`

Modules in reading order: `door`, `workers`, `interrupts`.

Rooms in the order of a scene: `scenes`, `forward`, `data`, `optics`, `probe_tables`, `calibration`, `paper_network`,
`press_models`, `cramer_rao`, `scores`, `verification`, `replication`, `tradeoff`; `pages` writes documents, `release`
builds what a probe installs, `commands` holds the verbs. From the device it takes `measurement`, `simulation` and
`files`.

Everything is loaded when it is first asked for, so that the import costs nothing. All else of the toolkit is reached by
its module's path; what is listed here keeps its name.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from device.files.recording_file import read_recording as read_recording
    from device.files.recording_file import write_recording as write_recording
    from device.measurement.bundle import BundleRefused as BundleRefused
    from device.measurement.estimate import Estimate as Estimate
    from device.measurement.mode_models import ModeModels as ModeModels
    from device.measurement.quantities import Inclusion as Inclusion
    from device.measurement.quantities import InvalidQuantity as InvalidQuantity
    from device.measurement.recording.recording import Recording as Recording
    from host_tools.calibration.phantom import phantom_recording as phantom_recording
    from host_tools.cramer_rao.protocol import PressProtocol as PressProtocol
    from host_tools.cramer_rao.protocol import read_protocol as read_protocol
    from host_tools.door import analyse as analyse
    from host_tools.door import export as export
    from host_tools.door import installed_models as installed_models
    from host_tools.door import limits as limits
    from host_tools.door import read_sweep as read_sweep
    from host_tools.door import simulated_probe as simulated_probe
    from host_tools.door import solve as solve
    from host_tools.door import solve_ramp as solve_ramp
    from host_tools.door import sweep as sweep
    from host_tools.door import train as train
    from host_tools.forward.ladder import ToleranceMissed as ToleranceMissed
    from host_tools.forward.press_model import PressFailed as PressFailed
    from host_tools.forward.solution import Solution as Solution
    from host_tools.forward.solution_dataset import dataset_of as dataset_of
    from host_tools.optics.frame import simulated_frame as simulated_frame
    from host_tools.scenes.scene import Placement as Placement
    from host_tools.scenes.scene import Press as Press
    from host_tools.scenes.scene import Scene as Scene
    from host_tools.scenes.scene import Tissue as Tissue
    from host_tools.scenes.scene import TissueLayer as TissueLayer
    from host_tools.scenes.scene import Waveguide as Waveguide
    from host_tools.scenes.scene_file import read_scene as read_scene
    from host_tools.scenes.scene_file import write_scene as write_scene

_HOME = {
    "Scene": "host_tools.scenes.scene",
    "Inclusion": "device.measurement.quantities",
    "Press": "host_tools.scenes.scene",
    "Waveguide": "host_tools.scenes.scene",
    "Tissue": "host_tools.scenes.scene",
    "TissueLayer": "host_tools.scenes.scene",
    "Placement": "host_tools.scenes.scene",
    "read_scene": "host_tools.scenes.scene_file",
    "write_scene": "host_tools.scenes.scene_file",
    "solve": "host_tools.door",
    "solve_ramp": "host_tools.door",
    "Solution": "host_tools.forward.solution",
    "dataset_of": "host_tools.forward.solution_dataset",
    "simulated_frame": "host_tools.optics.frame",
    "sweep": "host_tools.door",
    "read_sweep": "host_tools.door",
    "train": "host_tools.door",
    "export": "host_tools.door",
    "limits": "host_tools.door",
    "PressProtocol": "host_tools.cramer_rao.protocol",
    "read_protocol": "host_tools.cramer_rao.protocol",
    "Recording": "device.measurement.recording.recording",
    "read_recording": "device.files.recording_file",
    "write_recording": "device.files.recording_file",
    "simulated_probe": "host_tools.door",
    "phantom_recording": "host_tools.calibration.phantom",
    "Estimate": "device.measurement.estimate",
    "ModeModels": "device.measurement.mode_models",
    "installed_models": "host_tools.door",
    "analyse": "host_tools.door",
    "InvalidQuantity": "device.measurement.quantities",
    "PressFailed": "host_tools.forward.press_model",
    "ToleranceMissed": "host_tools.forward.ladder",
    "BundleRefused": "device.measurement.bundle",
}

__all__ = [
    "BundleRefused",
    "Estimate",
    "Inclusion",
    "InvalidQuantity",
    "ModeModels",
    "Placement",
    "Press",
    "PressFailed",
    "PressProtocol",
    "Recording",
    "Scene",
    "Solution",
    "Tissue",
    "TissueLayer",
    "ToleranceMissed",
    "Waveguide",
    "analyse",
    "dataset_of",
    "export",
    "installed_models",
    "limits",
    "phantom_recording",
    "read_protocol",
    "read_recording",
    "read_scene",
    "read_sweep",
    "simulated_frame",
    "simulated_probe",
    "solve",
    "solve_ramp",
    "sweep",
    "train",
    "write_recording",
    "write_scene",
]


def __getattr__(name: str) -> Any:
    """Return a name of the door, and load its module (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(__all__)}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the names of the door, and no others."""
    return sorted(__all__)
