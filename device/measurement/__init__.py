"""What a press means: numbers in, numbers out. Shared with the workstation.

Modules in reading order: `quantities`, `arrays`, `mode`, `wanted_accuracy`, `parameters`,
`feature_definitions`, `bundle`, `calibration`, `confidence_belt`, `estimate`, `shown_quantity`, `repeats`,
`scan_advice`, `mode_models`.

Rooms: `recording` (frames to a corrected image), `paper_mode`, `ramp_modes` (standard and precise), `quick_mode`. It
imports nothing else of ours; what it reads from a disk is read in `device.files`.

Its door, `from device.measurement import Recording`:

- quantities: `Inclusion`, `Bound`, `InvalidQuantity`, `require`; arrays: `Array`, `Single`
- recordings: `Recording`, `CameraSettings`, `Frame`, `TactileImage`; modes: `Mode`, `mode_named`, `mode_of`
- certificates and models: `Calibration`, `ModelBundle`, `BundleRefused`, `ModeModels`
- answers: `analysed`, `Estimate`, `Quantity`

Each is loaded when it is first asked for: whoever needs a quantity alone, as `device.commands.led_off`, loads no NumPy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from device.measurement.arrays import Array as Array
    from device.measurement.arrays import Single as Single
    from device.measurement.bundle import BundleRefused as BundleRefused
    from device.measurement.bundle import ModelBundle as ModelBundle
    from device.measurement.calibration import Calibration as Calibration
    from device.measurement.estimate import Estimate as Estimate
    from device.measurement.estimate import Quantity as Quantity
    from device.measurement.mode import Mode as Mode
    from device.measurement.mode import mode_named as mode_named
    from device.measurement.mode import mode_of as mode_of
    from device.measurement.mode_models import ModeModels as ModeModels
    from device.measurement.mode_models import analysed as analysed
    from device.measurement.quantities import Bound as Bound
    from device.measurement.quantities import Inclusion as Inclusion
    from device.measurement.quantities import InvalidQuantity as InvalidQuantity
    from device.measurement.quantities import require as require
    from device.measurement.recording.recording import CameraSettings as CameraSettings
    from device.measurement.recording.recording import Recording as Recording
    from device.measurement.recording.tactile_image import Frame as Frame
    from device.measurement.recording.tactile_image import TactileImage as TactileImage

_HOME = {
    "Inclusion": "device.measurement.quantities",
    "Bound": "device.measurement.quantities",
    "InvalidQuantity": "device.measurement.quantities",
    "require": "device.measurement.quantities",
    "Array": "device.measurement.arrays",
    "Single": "device.measurement.arrays",
    "Recording": "device.measurement.recording.recording",
    "CameraSettings": "device.measurement.recording.recording",
    "Frame": "device.measurement.recording.tactile_image",
    "TactileImage": "device.measurement.recording.tactile_image",
    "Mode": "device.measurement.mode",
    "mode_named": "device.measurement.mode",
    "mode_of": "device.measurement.mode",
    "Calibration": "device.measurement.calibration",
    "ModelBundle": "device.measurement.bundle",
    "BundleRefused": "device.measurement.bundle",
    "ModeModels": "device.measurement.mode_models",
    "analysed": "device.measurement.mode_models",
    "Estimate": "device.measurement.estimate",
    "Quantity": "device.measurement.estimate",
}

__all__ = [
    "Array",
    "Bound",
    "BundleRefused",
    "Calibration",
    "CameraSettings",
    "Estimate",
    "Frame",
    "Inclusion",
    "InvalidQuantity",
    "Mode",
    "ModeModels",
    "ModelBundle",
    "Quantity",
    "Recording",
    "Single",
    "TactileImage",
    "analysed",
    "mode_named",
    "mode_of",
    "require",
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
