"""All settings of the daemon by section: each with its type, unit, range, default and one sentence, as data.

Out-of-range values are refused, never clipped. Paths are relative to where the daemon is started. docs/settings.md is
made from here; which files are read, and in which order, is in device/settings/layers.py. What has to fit together is
compared when each setting holds alone. No NumPy is loaded: a short verb, as `config`, has to be quick.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, fields
from datetime import date
from itertools import combinations
from pathlib import Path
from typing import Annotated, Literal
from urllib.parse import urlsplit

from pydantic import Field
from pydantic.dataclasses import dataclass
from typing_extensions import Doc

from device.config_chips import (
    CHIP_ADDRESSES,
    GPIO_LINES,
    I2C_ADDRESSES,
    I2C_BUSES,
    OSCILLATOR_HZ,
    PWM_HZ,
    LightChip,
    LightWiring,
    RawFormat,
    RawMode,
)
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.files.toml_record import STRICT, InvalidRecord
from device.measurement.mode import RAMP_FROM_N, RAMP_TO_N, Mode
from device.measurement.quantities import Bound, InvalidQuantity
from device.measurement.recording.pixel_scale import PixelScale

SideRatio = Annotated[float, Bound(0.0, 1.0, "", low_included=False)]
SideCounts = Annotated[float, Bound(1.0, 255.0, "counts")]
CellProtocol = Literal["openscale", "mantracourt"]
CellCoding = Literal["twos_complement", "offset_binary"]
HELD_HZ = 8.0
"""Frames are this fast at least where a line is held from one to the next: three of them, late, and it still is."""
HEXADECIMAL = "hexadecimal"
"""Marks a number that is written so."""
SensorPixels = Annotated[int, Bound(64, 8192, "px")]
LightRatio = Annotated[float, Bound(0.01, 0.9, "")]


NetworkHost = Annotated[str, Field(min_length=1)]
DICOM_LINE = r"^[^\\\x00-\x1f\x7f]*$"
"""Text that DICOM takes for one value: a backslash would begin the next one (PS3.5 section 6.2)."""
AE_WORDS = "1 to 16 characters of ASCII, no backslash, no space at its ends"
AeTitle = Annotated[str, Field(pattern=r"^[!-\[\]-~]([ -\[\]-~]{0,14}[!-\[\]-~])?$", description=AE_WORDS)]
"""Name of a program in DICOM's network, 1 to 16 characters of ASCII without a backslash."""


WEBHOOK_WORDS = "an address of http or https without user, password, query or fragment"
WebhookUrl = Annotated[str, Field(pattern=r'^https?://[!"$->A-\[\]-~]+$', description=WEBHOOK_WORDS)]
"""An address without a user, a password or a query: the signature says who sends."""
CONTACT_WORDS = "mailto:, tel: or https:// and the rest, without a space"
ContactUrl = Annotated[str, Field(pattern=r"^(mailto:|tel:|https://)[!-~]+$", description=CONTACT_WORDS)]
SERIAL_WORDS = "1 to 63 letters, digits, dots, dashes and low lines, a letter or digit first"
SerialNumber = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,62}$", description=SERIAL_WORDS)]
"""It names files, and fields of DICOM: device/provisioning/identity.py asks for the same."""
Day = Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$", description="a day, as 2031-12-31")]
THIS_MACHINE = ("127.0.0.1", "::1", "localhost")


class Conflict(InvalidQuantity):
    """A value that holds alone but not beside `others`, the full names of the settings it has to fit."""

    def __init__(self, quantity: str, value: object, bound: str, others: tuple[str, ...], action: str = "") -> None:
        super().__init__(quantity, value, bound, action or f"correct it or {' or '.join(others)}")
        self.others = others


def conflict(name: str, value: float, bound: Bound, *others: str) -> Iterator[Conflict]:
    """Yield a `Conflict` when a value lies outside the bound that the settings `others` leave it."""
    if not bound.holds(value):
        yield Conflict(name, value, str(bound), others)


class Section:
    """Base of a record of settings; raises `InvalidRecord` when those that hold alone do not fit together."""

    def __post_init__(self) -> None:
        if problems := list[InvalidQuantity](self.conflicts()):
            raise InvalidRecord(problems)

    def conflicts(self) -> Iterator[Conflict]:
        """Yield what does not fit together of settings that hold alone."""
        yield from ()


@dataclass(frozen=True, config=STRICT)
class CameraSection(Section):
    """The camera: frame size, pixel size on the face, fixed exposure and gain, frame rate.

    A frame may be made of a larger mode of the sensor: of its middle, each pixel the mean over an area.
    """

    width_px: Annotated[int, Bound(64, 4096, "px"), Doc("Columns of a frame.")] = 768
    height_px: Annotated[int, Bound(64, 4096, "px"), Doc("Rows of a frame.")] = 492
    mm_per_px_x: Annotated[float, Bound(1e-4, 1.0, "mm"), Doc("Width of a frame's pixel on the sensing face.")] = (
        0.03125
    )
    mm_per_px_y: Annotated[float, Bound(1e-4, 1.0, "mm"), Doc("Height of a frame's pixel on the sensing face.")] = (
        0.03646
    )
    axis_x_mm: Annotated[float, Bound(-2.0, 2.0, "mm"), Doc("Where the optical axis meets the face, along a row.")] = (
        0.0
    )
    axis_y_mm: Annotated[
        float, Bound(-2.0, 2.0, "mm"), Doc("Where the optical axis meets the face, down a column.")
    ] = 0.0
    rim_distortion_percent: Annotated[
        float,
        Bound(-10.0, 10.0, "%"),
        Doc("How much farther from the axis than its pixel says the face is seen, where that says 11 mm."),
    ] = 0.0
    raw_format: Annotated[RawFormat, Doc("Unpacked raw format of the sensor; frames have 8 bits all the same.")] = "R8"
    sensor_width_px: Annotated[
        SensorPixels | None, Doc("Columns of the sensor's mode; those of a frame unless given.")
    ] = None
    sensor_height_px: Annotated[
        SensorPixels | None, Doc("Rows of the sensor's mode; those of a frame unless given.")
    ] = None
    crop_width_px: Annotated[
        SensorPixels | None, Doc("Columns in the sensor's middle that a frame is made of; all unless given.")
    ] = None
    crop_height_px: Annotated[
        SensorPixels | None, Doc("Rows in the sensor's middle that a frame is made of; all unless given.")
    ] = None
    exposure_us: Annotated[int, Bound(10, 1e6, "us"), Doc("Exposure time of every frame, at most one frame long.")] = (
        4000
    )
    gain: Annotated[float, Bound(1.0, 16.0, ""), Doc("Analogue gain of every frame.")] = 1.0
    frame_rate_hz: Annotated[float, Bound(1.0, 240.0, "Hz"), Doc("Frames a second.")] = 30.0
    index: Annotated[int, Bound(0, 99, ""), Doc("Number of the camera on this board.")] = 0
    max_restarts: Annotated[
        int,
        Bound(0, 100, ""),
        Doc("How often in a minute the camera's process, when it hung or died, is started again."),
    ] = 5
    late_frames: Annotated[
        float, Bound(1.5, 100.0, "frame times"), Doc("A frame begun this long after it was asked for is late.")
    ] = 3.0
    tear_counts: Annotated[
        float,
        Bound(0.5, 255.0, "counts"),
        Doc("A step between two rows, compared with the frame before, above which one of the two frames is torn."),
    ] = 10.0

    def conflicts(self) -> Iterator[Conflict]:
        """Yield an exposure longer than a frame, and a part of the sensor that is not on it or less than a frame."""
        bound = Bound(10, 1e6 / self.frame_rate_hz, "us, one frame")
        yield from conflict("camera.exposure_us", self.exposure_us, bound, "camera.frame_rate_hz")
        mode = self.raw_mode
        for number, side in enumerate(("width_px", "height_px")):
            sensor_px, crop_px, frame_px = mode.sensor_px[number], mode.crop_px[number], mode.frame_px[number]
            sensor, crop, frame = f"camera.sensor_{side}", f"camera.crop_{side}", f"camera.{side}"
            too_small = [*conflict(sensor, sensor_px, Bound(frame_px, 8192, "px, a frame's or more"), frame)]
            within = Bound(frame_px, sensor_px, "px, from a frame's to the sensor's")
            yield from too_small or conflict(crop, crop_px, within, frame, sensor)

    @property
    def scale(self) -> PixelScale:
        """Size of a frame's pixel on the face."""
        return PixelScale(self.mm_per_px_x, self.mm_per_px_y)

    @property
    def sensor_scale(self) -> PixelScale:
        """Size of a sensor's pixel on the face."""
        (crop_x, crop_y), (width, height) = self.raw_mode.crop_px, self.raw_mode.frame_px
        return PixelScale(self.mm_per_px_x * width / crop_x, self.mm_per_px_y * height / crop_y)

    @property
    def raw_mode(self) -> RawMode:
        """The sensor's mode and what a frame is made of."""
        frame_px = (self.width_px, self.height_px)
        sensor_px = (self.sensor_width_px or self.width_px, self.sensor_height_px or self.height_px)
        crop_px = (self.crop_width_px or sensor_px[0], self.crop_height_px or sensor_px[1])
        return RawMode(sensor_px, crop_px, frame_px, self.raw_format)


@dataclass(frozen=True, config=STRICT)
class LightSection(LightWiring, Section):
    """The LED driver: chip, I2C bus and address, the brightness of the four sides while measuring, when light is right.

    Lists have one number a side: +x, +y, -x, -y.
    """

    chip: Annotated[LightChip, Doc("LED driver on the board: a pca9685 needs an exposure of whole PWM periods.")] = (
        LightWiring.chip
    )
    bus: Annotated[int, I2C_BUSES, Doc("I2C bus of the LED driver.")] = LightWiring.bus
    address: Annotated[
        int | None,
        I2C_ADDRESSES,
        HEXADECIMAL,
        Doc("I2C address of the LED driver; 0x60 of a tlc59116 and 0x40 of a pca9685 unless given."),
    ] = LightWiring.address
    enable_chip: Annotated[str, Doc("GPIO chip of the line that enables the LEDs' outputs.")] = LightWiring.enable_chip
    enable_line: Annotated[
        int | None,
        GPIO_LINES,
        Doc(
            "Line of that chip that is wired to RESET of a tlc59116 or OE of a pca9685; "
            "unless given only the bus switches the light."
        ),
    ] = LightWiring.enable_line
    pwm_hz: Annotated[float, PWM_HZ, Doc("Frequency of the brightness of a pca9685.")] = LightWiring.pwm_hz
    oscillator_hz: Annotated[float, OSCILLATOR_HZ, Doc("Oscillator of a pca9685, as measured.")] = (
        LightWiring.oscillator_hz
    )
    ratio: Annotated[
        tuple[SideRatio, SideRatio, SideRatio, SideRatio],
        Doc("Brightness of each side while measuring, of the first press if it is held at light.target_counts."),
    ] = (0.6, 0.6, 0.6, 0.6)
    target_counts: Annotated[
        float | None,
        Bound(1.0, 150.0, "counts"),
        Doc(
            "Mean counts above dark at the target force that the light is held at from press to press; "
            "unless given the brightness stays."
        ),
    ] = None
    max_dark_counts: Annotated[
        float,
        Bound(0.0, 100.0, "counts"),
        Doc(
            "Mean of a frame without light, above which something shines; the sensor's black level, 16 of an OV9281 "
            "and 15 of an IMX296, is in it."
        ),
    ] = 24.0
    min_side_ratio: Annotated[
        LightRatio, Doc("A side that alone gives less than this part of the brightest one's light is dark.")
    ] = 0.3
    max_dimming_ratio: Annotated[
        LightRatio, Doc("Loss of a side's light, against commissioning or the first presses, that is warned of.")
    ] = 0.07
    commissioned_counts: Annotated[
        tuple[SideCounts, SideCounts, SideCounts, SideCounts] | None,
        Doc("Mean counts above dark at the target force of each side alone at full brightness."),
    ] = None
    min_contrast_ratio: Annotated[
        LightRatio, Doc("How much of a press's light must have come with the force; gel and sweat leave less.")
    ] = 0.3
    max_on_s: Annotated[
        float,
        Bound(1.0, 3600.0, "s"),
        Doc("Time with light, over all presses of one and a half times as long, after which the light goes off."),
    ] = 300.0
    untouched_s: Annotated[
        float,
        Bound(0.5, 60.0, "s"),
        Doc("Time with light in presses that nobody touches, one after the other, after which they wait in the dark."),
    ] = 5.0

    @property
    def wiring(self) -> LightWiring:
        """Where the chip is, without what is asked of its light."""
        return LightWiring(**{place.name: getattr(self, place.name) for place in fields(LightWiring)})

    def conflicts(self) -> Iterator[Conflict]:
        """Yield an address that the chip cannot have, or that is not its own."""
        taken = CHIP_ADDRESSES[self.chip]
        bound = Bound(taken.first, taken.last, f"of a {self.chip}")
        yield from conflict("light.address", self.chip_address, bound, "light.chip")
        if self.chip_address in taken.shared:
            other = f"not one that every {self.chip} answers at"
            yield Conflict("light.address", f"{self.chip_address:#04x}", other, ("light.chip",))

    def exposure_conflicts(self, exposure_us: float, frame_us: float) -> Iterator[Conflict]:
        """Yield an exposure of the chip's flashes that would differ from frame to frame."""
        if self.chip != "pca9685" or self.pwm_clock.is_whole(exposure_us):
            return
        period_us = self.pwm_clock.period_us
        nearest_us = self.pwm_clock.nearest_whole_us(exposure_us, frame_us)
        if nearest_us:
            bound = f"a whole number of the pca9685's periods of {period_us:.2f} us"
            others = "light.chip", "light.pwm_hz", "light.oscillator_hz"
            yield Conflict("camera.exposure_us", exposure_us, bound, others, f"set the nearest one, {nearest_us}")
        else:
            bound = f"one whose period, {period_us:.0f} us, fits into a frame of {frame_us:.0f} us"
            action = "raise it, or lower camera.frame_rate_hz"
            yield Conflict("light.pwm_hz", self.pwm_hz, bound, ("light.chip", "camera.frame_rate_hz"), action)


@dataclass(frozen=True, config=STRICT)
class CellSection(Section):
    """The load cell: its serial line, its sensitivity, and what it bears.

    The zero of commissioning and that of each start are two: how far they may lie apart tells a cell that was bent.
    """

    device: Annotated[str, Doc("Serial line of the load cell's amplifier.")] = "/dev/tsis-force"
    baud: Annotated[int, Bound(300, 4_000_000, "baud"), Doc("Speed of the serial line.")] = 115_200
    protocol: Annotated[
        CellProtocol, Doc("What the load cell's amplifier speaks; a mantracourt has a station, and a count of 1 nV/V.")
    ] = "openscale"
    station: Annotated[int, Bound(1, 999, ""), Doc("Station number of a mantracourt.")] = 1
    coding: Annotated[
        CellCoding, Doc("How an openscale sends its raw reading: about 8388608 at rest is offset_binary.")
    ] = "twos_complement"
    delay_s: Annotated[
        float,
        Bound(0.0, 0.5, "s"),
        Doc("By how much a reading of an openscale is later than the load that it shows: two of its conversions."),
    ] = 0.025
    sensitivity_counts_per_n: Annotated[
        float, Bound(1.0, 1e7, "counts/N"), Doc("Change of the amplifier's reading by one newton.")
    ] = 100_000.0
    tare_spread_n: Annotated[
        float,
        Bound(0.0001, 1.0, "N"),
        Doc("Readings that spread more than this while taring are not of an untouched probe."),
    ] = 0.02
    commissioned_tare_counts: Annotated[
        float | None,
        Bound(-(2.0**23), 2.0**23, "counts"),
        Doc("Reading of the free probe at commissioning; without it that of each start stands in."),
    ] = None
    tare_drift_n: Annotated[
        float, Bound(0.01, 5.0, "N"), Doc("How far from the commissioning tare the tare of a start may be.")
    ] = 0.2
    max_load_n: Annotated[
        float, Bound(1.0, 100.0, "N"), Doc("Load, from the commissioning tare, that is an overload.")
    ] = 5.0


@dataclass(frozen=True, config=STRICT)
class PressSection(Section):
    """The press: mode unless asked otherwise, target force and its band, what is contact, steady, and too much."""

    mode: Annotated[
        Mode | None,
        Doc(
            "How a press is measured unless it is asked for in another mode; unless given standard, or on a probe "
            "without a model of that quick or paper."
        ),
    ] = None
    target_n: Annotated[float, Bound(0.1, 20.0, "N"), Doc("Force of a hold.")] = 0.5
    band_ratio: Annotated[
        float, Bound(0.005, 0.2, ""), Doc("Frames of a hold are taken this near to the target, as a part of it.")
    ] = 0.05
    contact_n: Annotated[
        float, Bound(0.005, 0.75 * RAMP_FROM_N, "N"), Doc("Force that is contact, at most half the target.")
    ] = 0.05
    steady_n: Annotated[float, Bound(0.001, 1.0, "N"), Doc("Change of force within which a hold is steady.")] = 0.02
    overload_n: Annotated[
        float, Bound(1.2 * RAMP_TO_N, 50.0, "N"), Doc("Force that is too much, at least a fifth above the target.")
    ] = 1.0
    max_rate_n_per_s: Annotated[
        float,
        Bound(0.05, 5.0, "N/s"),
        Doc("A ramp's force may not change faster, or it would not be known at the exposure."),
    ] = 0.35
    max_offset_mm: Annotated[
        float,
        Bound(0.5, 30.0, "mm"),
        Doc(
            "An inclusion whose bright spot lies further off the middle of the face is off-centre: "
            "the press is rejected."
        ),
    ] = 2.5
    timeout_s: Annotated[float, Bound(1.0, 3600.0, "s"), Doc("A press that takes longer is given up.")] = 60.0

    def conflicts(self) -> Iterator[Conflict]:
        """Yield a contact that is too near to the target from below, and an overload from above."""
        contact = Bound(0.005, self.target_n / 2, "N, half the target")
        yield from conflict("press.contact_n", self.contact_n, contact, "press.target_n")
        overload = Bound(1.2 * self.target_n, 50.0, "N, a fifth above the target")
        yield from conflict("press.overload_n", self.overload_n, overload, "press.target_n")

    @property
    def band_n(self) -> tuple[float, float]:
        """Forces between which frames are taken."""
        return self.target_n * (1 - self.band_ratio), self.target_n * (1 + self.band_ratio)


@dataclass(frozen=True, config=STRICT)
class StoreSection(Section):
    """The disk: how much must be left before a press is taken, below how much it is warned, and when of no backup."""

    min_free_mb: Annotated[float, Bound(1.0, 1e6, "MB"), Doc("Space that must be left before a press is taken.")] = 50.0
    warn_free_mb: Annotated[
        float | None,
        Bound(1.0, 1e6, "MB"),
        Doc(
            "While less is left it is warned; unless given, ten times min_free_mb, "
            "and at most half way from min_free_mb to retention.free_mb."
        ),
    ] = None

    warn_unsaved_days: Annotated[
        float,
        Bound(0.0, 3650.0, "days"),
        Doc("It is warned while measurements have been in no backup for longer; 0 is never."),
    ] = 30.0

    def conflicts(self) -> Iterator[Conflict]:
        """Yield a warning that would come after the refusal."""
        if self.warn_free_mb is not None:
            above = Bound(self.min_free_mb, 1e6, "MB, below which no press is taken")
            yield from conflict("store.warn_free_mb", self.warn_free_mb, above, "store.min_free_mb")


@dataclass(frozen=True, config=STRICT)
class RetentionSection(Section):
    """Which recordings are deleted by rule, none unless it says so; measurements and the audit stay for ever."""

    keep_days: Annotated[
        float | None, Bound(1.0, 36500.0, "days"), Doc("Recordings that are older are deleted; none unless given.")
    ] = None
    free_mb: Annotated[
        float | None,
        Bound(1.0, 1e6, "MB"),
        Doc("While less is left the oldest recordings are deleted; none unless given."),
    ] = None
    saved_first: Annotated[bool, Doc("Only recordings that a backup holds are deleted.")] = True


@dataclass(frozen=True, config=STRICT)
class ClockSection(Section):
    """The wall clock: by how much it may be set before `taken_at` is doubted."""

    max_jump_s: Annotated[
        float, Bound(0.1, 3600.0, "s"), Doc("The clock may be set by so much before the time of a press is doubted.")
    ] = 2.0


@dataclass(frozen=True, config=STRICT)
class ServerSection(Section):
    """Where the screen and the REST API are served; loopback unless told otherwise."""

    host: Annotated[
        str,
        Field(min_length=1),
        Doc("Address at which screen and REST API are served; 0.0.0.0 serves the network, by TLS and with tokens."),
    ] = "127.0.0.1"
    port: Annotated[
        int, Bound(0, 65535, ""), Doc("Port of screen and REST API at the probe itself; 0 takes any free one.")
    ] = 8000
    tls_port: Annotated[
        int, Bound(0, 65535, ""), Doc("Port of both for other machines, by TLS; 0 takes any free one.")
    ] = 8443
    certificate: Annotated[
        str, Doc("File of the certificate for other machines with those above it, PEM; unless given the probe's own.")
    ] = ""
    certificate_key: Annotated[str, Doc("File of that certificate's key, PEM.")] = ""
    client_authority: Annotated[
        str, Doc("File of certificates, PEM, of which one must vouch for a client's; unless given none is asked for.")
    ] = ""
    hosts: Annotated[
        tuple[str, ...],
        Doc("More names by which the probe is asked, as a proxy's; its addresses and its host name are known."),
    ] = ()

    def conflicts(self) -> Iterator[Conflict]:
        """Yield a certificate without its key, and a key without its certificate."""
        given = {"server.certificate": self.certificate, "server.certificate_key": self.certificate_key}
        for (name, path), other in zip(given.items(), reversed(given), strict=True):
            if not path and given[other]:
                yield Conflict(name, path, f"a file beside {other}", (other,), f"name it, or leave out {other}")


@dataclass(frozen=True, config=STRICT)
class DicomSection(Section):
    """The hospital's archive and worklist: where they are, and what the probe is called there.

    Without a host of either nothing is sent or asked.
    """

    archive_host: Annotated[
        NetworkHost | None, Doc("Name or address of the archive that results are sent to; unless given none are.")
    ] = None
    archive_port: Annotated[int, Bound(1, 65535, ""), Doc("Port of the archive.")] = 104
    archive_title: Annotated[AeTitle, Doc("Application entity title of the archive.")] = "ARCHIVE"
    worklist_host: Annotated[
        NetworkHost | None, Doc("Name or address of what keeps the modality worklist; unless given it is not asked.")
    ] = None
    worklist_port: Annotated[int, Bound(1, 65535, ""), Doc("Port of the worklist.")] = 104
    worklist_title: Annotated[AeTitle, Doc("Application entity title of the worklist.")] = "WORKLIST"
    worklist_of_all: Annotated[
        bool, Doc("Whether all steps of the worklist are asked for, and not those for this probe's own title alone.")
    ] = False
    own_title: Annotated[AeTitle, Doc("Application entity title of this probe.")] = "TSIS"
    commitment_port: Annotated[
        int | None,
        Bound(1, 65535, ""),
        Doc(
            "Port at which the probe hears the archive's storage commitment, open only while one is awaited; "
            "unless given it asks the archive what it has."
        ),
    ] = None
    institution: Annotated[
        str,
        Field(max_length=64, pattern=DICOM_LINE, description="one line without a backslash"),
        Doc("Name of the hospital in every object."),
    ] = ""
    send_phantoms: Annotated[
        bool, Doc("Whether exams of phantoms and simulated presses, marked as such, may be sent, too.")
    ] = False
    demographics_days: Annotated[
        int,
        Bound(0, 365, "days"),
        Doc("A name and date of birth from the worklist are erased so long after the archive has the exam."),
    ] = 7
    tls_authority: Annotated[
        Path | None, Doc("Certificates (PEM) that the archive's and worklist's have to be signed by; then TLS is used.")
    ] = None
    tls_certificate: Annotated[Path | None, Doc("This probe's own certificate (PEM), if they ask for one.")] = None
    tls_key: Annotated[Path | None, Doc("Key (PEM) of this probe's certificate.")] = None

    def conflicts(self) -> Iterator[Conflict]:
        """Yield a certificate without its key, a key without it, and either without TLS."""
        given = {name: getattr(self, name) is not None for name in ("tls_authority", "tls_certificate", "tls_key")}
        if given["tls_certificate"] != given["tls_key"]:
            name, other = sorted(("tls_certificate", "tls_key"), key=lambda one: given[one])
            yield Conflict(f"dicom.{name}", "not set", "set", (f"dicom.{other}",))
        elif given["tls_certificate"] and not given["tls_authority"]:
            yield Conflict("dicom.tls_authority", "not set", "set", ("dicom.tls_certificate",))
        elif given["tls_authority"] and self.commitment_port and not given["tls_certificate"]:
            yield Conflict("dicom.tls_certificate", "not set", "set", ("dicom.commitment_port",))


@dataclass(frozen=True, config=STRICT)
class WebhookSection(Section):
    """The hospital's address for notices of each new or changed measurement and exam; without one none is sent."""

    url: Annotated[
        WebhookUrl | None,
        Doc("Address that gets a signed notice of each new or changed measurement and exam; https, or this machine."),
    ] = None
    secret_file: Annotated[
        Path | None, Doc("File with the secret that notices are signed with: `whsec_` and 24 to 64 bytes in base64.")
    ] = None
    tls_authority: Annotated[
        Path | None, Doc("Certificates (PEM) that the address' own must be signed by; the system's unless given.")
    ] = None

    def conflicts(self) -> Iterator[Conflict]:
        """Yield an address that is none or in clear to another machine, and one without a secret."""
        if self.url is None:
            return
        if not _is_guarded(self.url):
            yield Conflict(
                "webhook.url", self.url, "https, or http to 127.0.0.1", (), "name a port below 65536 and https"
            )
        if self.secret_file is None:
            yield Conflict(
                "webhook.secret_file", "not set", "a file", ("webhook.url",), "make one; see docs/webhook.md"
            )


@dataclass(frozen=True, config=STRICT)
class MakerSection(Section):
    """Who made this probe and mends it; the probe tells it to whoever finds a vulnerability."""

    security_contact: Annotated[
        ContactUrl | None, Doc("Where a vulnerability is reported: mailto:, tel: or https: and the rest.")
    ] = None
    updates_until: Annotated[Day | None, Doc("Until when there are updates for it, as 2031-12-31.")] = None

    def conflicts(self) -> Iterator[Conflict]:
        """Yield a contact without a day, a day without a contact, and a day that no calendar has."""
        given = {"maker.security_contact": self.security_contact, "maker.updates_until": self.updates_until}
        for (name, value), other in zip(given.items(), reversed(given), strict=True):
            if value is None and given[other] is not None:
                yield Conflict(name, "not set", "set", (other,))
        if self.updates_until is not None and not _is_day(self.updates_until):
            yield Conflict("maker.updates_until", self.updates_until, "a day of the calendar", (), "correct it")


def _is_day(text: str) -> bool:
    try:
        date.fromisoformat(text)
    except ValueError:
        return False
    return True


def _is_guarded(url: str) -> bool:
    """Return whether nobody on the way reads what is sent to an address, and it names a host and a port that is one."""
    try:
        place = urlsplit(url)
        is_place = place.hostname is not None and place.port != 0
    except ValueError:
        return False
    return is_place and (place.scheme == "https" or place.hostname in THIS_MACHINE)


@dataclass(frozen=True, config=STRICT)
class Config(Section):
    """All settings of the daemon."""

    serial: Annotated[SerialNumber, Doc("Serial number of this probe; model and certificate are for it.")] = "TSIS-0000"
    paper_model: Annotated[Path, Doc("Folder of the model that answers in mode paper.")] = MODELS / "paper"
    quick_model: Annotated[
        Path, Doc("Folder of the model of mode quick, offered where it is installed and for this probe.")
    ] = MODELS / "quick"
    standard_model: Annotated[
        Path,
        Doc("Folder of the model of modes standard and precise, offered where it is installed and for this probe."),
    ] = MODELS / "standard"
    calibration: Annotated[
        Path, Doc("Folder of this probe's certificates, of which one is active; or one certificate, NAME.json.")
    ] = Path("/var/lib/tsis/calibrations")
    data: Annotated[Path, Doc("Folder of measurements and recordings.")] = Path("/var/lib/tsis")
    updates: Annotated[Path, Doc("Folder in which the updater tells of releases and takes files.")] = Path(
        "/var/lib/tsis-update"
    )
    camera: CameraSection = field(default_factory=CameraSection)
    light: LightSection = field(default_factory=LightSection)
    cell: CellSection = field(default_factory=CellSection)
    press: PressSection = field(default_factory=PressSection)
    store: StoreSection = field(default_factory=StoreSection)
    retention: RetentionSection = field(default_factory=RetentionSection)
    clock: ClockSection = field(default_factory=ClockSection)
    server: ServerSection = field(default_factory=ServerSection)
    dicom: DicomSection = field(default_factory=DicomSection)
    webhook: WebhookSection = field(default_factory=WebhookSection)
    maker: MakerSection = field(default_factory=MakerSection)

    @property
    def warn_free_mb(self) -> float:
        """Space (1e6 bytes) below which it is warned: where a rule makes space by itself, once it has come too late."""
        store, rule_mb = self.store, self.retention.free_mb
        if store.warn_free_mb is not None:
            return store.warn_free_mb
        warn_mb = 10 * store.min_free_mb
        return warn_mb if rule_mb is None else min(warn_mb, (store.min_free_mb + rule_mb) / 2)

    def conflicts(self) -> Iterator[Conflict]:
        """Yield exposure and frame rate that the light does not allow, and a chip at the bus and address of another."""
        if self.light.enable_line is not None:
            held = Bound(HELD_HZ, 240.0, "Hz, to hold the enable line from frame to frame")
            yield from conflict("camera.frame_rate_hz", self.camera.frame_rate_hz, held, "light.enable_line")
        if self.retention.free_mb is not None:
            above = Bound(self.store.min_free_mb, 1e6, "MB, what a press needs")
            yield from conflict("retention.free_mb", self.retention.free_mb, above, "store.min_free_mb")
        yield from self.light.exposure_conflicts(self.camera.exposure_us, 1e6 / self.camera.frame_rate_hz)
        chips = {name: part for name, part in vars(self).items() if hasattr(part, "chip_address")}
        for (other, theirs), (name, ours) in combinations(chips.items(), 2):
            if (ours.bus, ours.chip_address) == (theirs.bus, theirs.chip_address):
                bound = f"another than that of {other} on the same bus"
                yield Conflict(f"{name}.address", hex(ours.chip_address), bound, (f"{other}.address",))


RENAMED = {"model": "paper_model", "profile_model": "standard_model"}
"""Settings of earlier versions and what each is called now: they are read, and it is told to rename them."""

SIMULATED = {"SIM-0001": "calibration.json", "SIM-LINEAR": "calibration_linear.json"}
"""Certificate of each simulated probe."""


def simulated_config(serial: str = "SIM-0001") -> Config:
    """Return the settings of a simulated probe: its certificate and data folder. Each kind of light has a serial.

    Only the paper's regressions can be had for the paper's light.
    """
    calibration = SIMULATED_PROBE / SIMULATED.get(serial, SIMULATED["SIM-0001"])
    return Config(serial=serial, calibration=calibration, data=Path("var"))
