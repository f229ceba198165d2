"""Puts the daemon together: real chips, or emulated ones under the very same drivers, and the hand that presses them.

Every part that fails to open is listed at once: device/assembly/opened_parts.py. The virtual hand reads the guidance of
whatever leads its presses. For presses on phantoms a probe is opened without model and certificate.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol, TypeVar

from device.assembly.answers import active_calibration, answers_of_start
from device.assembly.camera import emulated_camera, real_camera, require_open
from device.assembly.cell import commissioned, emulated_amplifier, open_cell, tared, tared_once_lifted
from device.assembly.light import emulated_line
from device.assembly.opened_parts import OpenedParts
from device.config import CameraSection, Config, LightSection
from device.config_chips import RAW_BITS
from device.errors import ConfigError
from device.files.bundle_file import read_paper_model
from device.files.shipped import SIMULATED_PROBE
from device.hardware.computer import SysfsComputer
from device.hardware.interfaces import Camera, Computer, Lights, LoadCell
from device.hardware.led_driver import led_driver, open_enabled_led_driver
from device.instrument.acquisition.bench import Bench, LitCamera
from device.instrument.acquisition.force_recorder import ForceRecorder
from device.instrument.acquisition.frame_check import FramePace
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.focusing import Focusing
from device.instrument.press.phantom_press import PhantomPress
from device.instrument.press.states import Guidance, before_contact
from device.instrument.procedure import Procedure
from device.instrument.status import StatusBoard
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.instrument.watch.clock_watch import ClockWatch
from device.instrument.watch.computer_watch import ComputerWatch
from device.instrument.watch.progress import ProgressBoard
from device.measurement.mode import Mode
from device.measurement.quantities import Inclusion
from device.measurement.recording.pixel_scale import PixelScale
from device.records.database import DATABASE
from device.records.disk import Disk
from device.records.store import Store
from device.simulation.chips.camera_server import CameraServer
from device.simulation.chips.emulated_amplifier import FreezingCell
from device.simulation.chips.emulated_computer import EmulatedComputer
from device.simulation.chips.emulated_storage import EmulatedBundles, EmulatedDisk
from device.simulation.chips.i2c_bus import EmulatedI2cBus, EmulatedLedChip
from device.simulation.chips.pca9685_chip import Pca9685Chip
from device.simulation.chips.remote_line import LineServer
from device.simulation.chips.tlc59116_chip import Tlc59116Chip
from device.simulation.chips.virtual_camera import ExposureRequest, VirtualPicamera2
from device.simulation.faults import NO_FAULTS, FaultTimeline
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables, VirtualProbe


class Guide(Protocol):
    """What leads an operator through presses: the guidance on its board, and word of each press that is to begin."""

    board: StatusBoard

    def on_request(self, listener: Callable[[Mode], None]) -> None:
        """Call `listener` with the mode whenever a press is to begin."""


SomeGuide = TypeVar("SomeGuide", bound=Guide)


def lead_by_hand(guide: Guide, probe: VirtualProbe) -> None:
    """Let the virtual hand read the screen: it takes up the probe when a press is requested."""

    def follow(guidance: Guidance) -> None:
        scan = guide.board.now.scan
        probe.hand.follow(guidance.code, time.monotonic(), scan.next_offset_mm if scan else None)

    def begin(mode: Mode) -> None:
        probe.hand.begin()
        guidance = guide.board.now.guidance
        if guidance is before_contact("reference", mode):  # shown since before the hand took up the probe
            follow(guidance)

    guide.board.on_guidance(follow)
    guide.on_request(begin)


def open_phantom_press(config: Config, scenario: Scenario | None) -> PhantomPress:
    """Return presses of the real probe, or of the virtual one on a scene.

    Raises `StartFailed` with every part that failed.
    """
    return open_simulated(config, scenario, _phantom_press) if scenario else open_real(config, _phantom_press)


def _phantom_press(probe: OpenedProbe) -> PhantomPress:
    progress = ProgressBoard()
    force, store = probe.force(progress), probe.store()
    bench = probe.bench(force, progress)
    assert store is not None  # or there were no bench
    is_simulated = probe.scenario is not None
    return PhantomPress(
        probe.config,
        bench,
        store,
        clock=probe.clock,
        opened=probe.parts.opened,
        simulated=is_simulated,
        computer=ComputerWatch(probe.computer),
    )


def open_focusing(config: Config, scenario: Scenario | None) -> Focusing:
    """Return light and camera alone of the real probe, or of the virtual one on a scene; no load cell need be there.

    Raises `StartFailed` with every part that failed.
    """
    return open_simulated(config, scenario, _focusing) if scenario else open_real(config, _focusing)


def _focusing(probe: OpenedProbe) -> Focusing:
    return Focusing(probe.lit_camera(ProgressBoard()), probe.parts.opened, partial(_count_light, probe))


def _count_light(probe: OpenedProbe, seconds: float) -> None:
    """Add to the hours of the LEDs, where they are kept: a store that is not there yet is the daemon's to make."""
    if (probe.config.data / DATABASE).is_file():
        with closing(Store(probe.config.data, probe.disk)) as store:
            store.add_light_on_s(seconds)


@dataclass(frozen=True)
class OpenedProbe:
    """The opened parts of a probe, None for one that failed, and what is simulated of it."""

    config: Config
    parts: OpenedParts
    lights: Lights | None
    camera: Camera | None
    cell: LoadCell | None
    clock: ClockWatch
    computer: Computer
    disk: Disk | None = None
    scenario: Scenario | None = None
    faults: FaultTimeline = NO_FAULTS
    folder_of: Callable[[Path], Path] = Path

    @property
    def simulated_truth(self) -> Inclusion | None:
        """What a simulated probe is pressed on."""
        return self.scenario.inclusion if self.scenario else None

    def force(self, progress: ProgressBoard) -> ForceRecorder | None:
        """Return the recorder of the tared load cell, or None when that failed."""
        cell = self.cell
        return self.parts.open(lambda: tared(self.config, cell, progress)) if cell else None

    def force_once_lifted(self, progress: ProgressBoard) -> ForceRecorder | None:
        """Return the same, also while its tare fails: that alone is told only beside what ends the start."""
        cell = self.cell
        force = self.parts.open(lambda: tared_once_lifted(self.config, cell, progress)) if cell else None
        if force and (fault := force.fault):
            self.parts.faults.append(fault)
        return force

    def store(self) -> Store | None:
        """Return the store of the settings' data folder, or None when it did not open."""
        return self.parts.open(lambda: Store(self.config.data, self.disk))

    def bench(self, force: ForceRecorder | None, progress: ProgressBoard) -> Bench:
        """Return light, camera and force as one, once no part has failed; the camera is waited for last."""
        lights, camera = self._lights_and_camera()
        assert force is not None  # or a part has failed
        return Bench(lights, camera, force, pace=self._pace(), budget=self._budget(), progress=progress)

    def lit_camera(self, progress: ProgressBoard) -> LitCamera:
        """Return light and camera as one, in the same way."""
        lights, camera = self._lights_and_camera()
        return LitCamera(lights, camera, pace=self._pace(), budget=self._budget(), progress=progress)

    def _lights_and_camera(self) -> tuple[Lights, Camera]:
        if camera := self.camera:
            self.parts.open(lambda: require_open(camera))
        self.parts.require_all()
        # require_all has raised if any of these is missing; the type checker cannot know.
        assert self.lights is not None
        assert self.camera is not None
        return self.lights, self.camera

    def _pace(self) -> FramePace:
        return FramePace(self.config.camera.late_frames / self.config.camera.frame_rate_hz)

    def _budget(self) -> LightBudget:
        return LightBudget(self.config.light.max_on_s)


def open_probe(config: Config, camera: Camera | None = None) -> Procedure:
    """Return the procedure of the real probe; raise `StartFailed` with every part that failed.

    `camera` is the probe's, if it is being opened already.
    """
    return open_real(config, _procedure, camera)


def open_simulated_probe(config: Config, scenario: Scenario) -> Procedure:
    """Return the procedure of a virtual probe; raise `StartFailed` as `open_probe` does."""
    return open_simulated(config, scenario, _procedure)


def open_real(config: Config, on_top: Callable[[OpenedProbe], SomeGuide], camera: Camera | None = None) -> SomeGuide:
    """Return what `on_top` makes of the real probe's parts; raise `StartFailed` with every part that failed."""
    parts = OpenedParts()
    camera = parts.open(lambda: camera or real_camera(config.camera))
    lights = parts.open(lambda: open_enabled_led_driver(config.light))
    cell = parts.open(lambda: open_cell(config, config.cell.device))
    clock = ClockWatch(config.clock.max_jump_s)
    return on_top(OpenedProbe(config, parts, lights, camera, cell, clock, SysfsComputer()))


def open_simulated(config: Config, scenario: Scenario, on_top: Callable[[OpenedProbe], SomeGuide]) -> SomeGuide:
    """Return the same of a virtual probe: emulated registers, serial bytes and frames, everything else real."""
    parts, faults = OpenedParts(), FaultTimeline(scenario.faults)
    scratch = Path(parts.opened.enter_context(TemporaryDirectory(prefix="tsis-")))
    bundles = EmulatedBundles(faults, scratch / "models")
    computer = SysfsComputer(EmulatedComputer(faults, scratch / "computer").root)
    config = replace(commissioned(config), paper_model=bundles.folder(config.paper_model))
    parts.open(lambda: _require_own_serial(config, scenario))
    width_px, height_px = config.camera.raw_mode.sensor_px
    shape, scale = (height_px, width_px), designed_scale(config.camera)
    probe: VirtualProbe | None = None

    def render(exposure: ExposureRequest) -> Any:
        assert probe is not None  # nobody asks for a frame before all is open
        return _render(probe, faults, exposure)

    chip: EmulatedLedChip = Pca9685Chip() if config.light.chip == "pca9685" else Tlc59116Chip(faults=faults)
    open_picam2 = partial(
        VirtualPicamera2,
        render,
        width_px=width_px,
        height_px=height_px,
        raw_formats=(config.camera.raw_format,),
        led_ratio_at=lambda t_s: faults.led_output(chip.ratio_at(t_s), t_s),
        faults=faults,
    )
    server = CameraServer(open_picam2)
    parts.opened.callback(server.close)
    camera = parts.open(lambda: emulated_camera(config.camera, server.address))
    probe = parts.open(
        lambda: VirtualProbe(scenario, ProbeTables.load(SIMULATED_PROBE), shape, scale), refused_as=ConfigError
    )
    parts.require_all()
    assert probe is not None  # require_all has raised otherwise
    line = emulated_amplifier(config, probe, faults)
    parts.opened.callback(line.close)
    bus = EmulatedI2cBus({config.light.chip_address: chip}, faults=faults)
    lights = parts.open(lambda: _emulated_lights(config.light, bus, chip, parts, faults))
    cell = parts.open(lambda: FreezingCell(open_cell(config, line.device_path), faults))
    clock = ClockWatch(config.clock.max_jump_s, faults.wall_time_s)
    disk = EmulatedDisk(faults)
    opened = OpenedProbe(config, parts, lights, camera, cell, clock, computer, disk, scenario, faults, bundles.folder)
    guide = on_top(opened)
    guide.on_request(lambda mode: faults.begin_press())
    lead_by_hand(guide, probe)
    return guide


def designed_scale(camera: CameraSection) -> PixelScale:
    """Return the size of a sensor's pixel on the face by the simulated probe's design, whatever the settings believe.

    What is true against that is the scenario's `[world.camera]`: pixel sizes that were found from it and are set since
    must not count once more.
    """
    designed = CameraSection()
    x_mm = designed.mm_per_px_x * (designed.width_px / camera.width_px)
    y_mm = designed.mm_per_px_y * (designed.height_px / camera.height_px)
    return replace(camera, mm_per_px_x=x_mm, mm_per_px_y=y_mm).sensor_scale


def _emulated_lights(
    light: LightSection, bus: EmulatedI2cBus, chip: EmulatedLedChip, parts: OpenedParts, faults: FaultTimeline
) -> Lights:
    """Return the driver on the emulated bus, and on an emulated line where the settings have one."""
    if light.enable_line is None:
        return led_driver(light, bus)

    def obey(is_enabled: bool) -> None:
        chip.enable(is_enabled or faults.is_active("enable_unwired"))

    server = LineServer(obey, lambda: faults.is_active("enable_busy"))
    parts.opened.callback(server.close)
    return led_driver(light, bus, emulated_line(server.address))


def _require_own_serial(config: Config, scenario: Scenario) -> None:
    """Refuse settings of another probe: a certificate made under one light is wrong under the other."""
    if config.serial != scenario.serial:
        raise ConfigError(
            f"serial is {config.serial}, but the simulated probe with {scenario.light} light is {scenario.serial}.",
            "Correct the setting, and its calibration with it.",
        )
    bits, raw_format = scenario.sensor.bits, config.camera.raw_format
    if bits != RAW_BITS[raw_format]:
        cause = f"The scene's sensor.bits is {bits}, but camera.raw_format is {raw_format}."
        raise ConfigError(cause, "Correct one of them.")


def _render(probe: VirtualProbe, faults: FaultTimeline, exposure: ExposureRequest) -> Any:
    return probe.frame_counts(
        force_n=probe.hand.force_n(exposure.t_s),
        place=probe.hand.place(exposure.t_s),
        led_ratio=exposure.led_ratio,
        exposure_us=exposure.exposure_us,
        gain=exposure.gain,
        frame_number=exposure.frame_number,
        pressed_s=probe.hand.pressed_s(exposure.t_s),
        wet_ratio=faults.wet_ratio(exposure.t_s),
        ambient_ratio=faults.ambient_ratio(exposure.t_s) + faults.stray_ratio(exposure.led_ratio, exposure.t_s),
    )


def _procedure(probe: OpenedProbe) -> Procedure:
    """Tare, load model and calibration, open the store; then nothing is missing but the tare of a held probe."""
    config, parts, progress = probe.config, probe.parts, ProgressBoard()
    force = probe.force_once_lifted(progress)
    bundle = parts.open(lambda: read_paper_model(config.paper_model))
    watch = parts.open(lambda: CalibrationWatch(active_calibration(config, bundle))) if bundle else None
    calibration = watch.calibration if watch else None
    answers = parts.open(lambda: answers_of_start(config, bundle, calibration)) if bundle else None
    store = probe.store()
    bench = probe.bench(force, progress)
    # Nothing has failed, or there were no bench; the type checker cannot know.
    assert answers is not None
    assert watch is not None
    assert store is not None
    watch.model_expires_at = answers.expires_at
    answers = answers.watched(progress, begin=partial(probe.faults.hold_up, "inference_frozen"))
    progress.exercise("inference", answers.prove)
    return Procedure(
        config,
        bench,
        answers,
        store,
        calibration=watch,
        opened=parts.opened,
        clock=probe.clock,
        computer=ComputerWatch(probe.computer),
        progress=progress,
        simulated_truth=probe.simulated_truth,
        folder_of=probe.folder_of,
    )
