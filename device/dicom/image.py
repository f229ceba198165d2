"""The picture of the tactile image as Secondary Capture, numbers and reason in rows below: what every viewer shows.

The size of its pixels on the skin is stated, so that a viewer measures in it. Who the patient is stands in no pixel.
Source: DICOM PS3.3 A.8.1; RGB, uncompressed, one frame.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from pydicom.dataset import Dataset
from pydicom.uid import SecondaryCaptureImageStorage

from device.dicom.shared_modules import MANUFACTURER, begun, local_time, set_acquisition, set_body_part, set_time
from device.dicom.subject import DicomSubject
from device.dicom.wording import remarks, rows, spoken_quantity
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from device.measurement.recording.frame_light import binned_scale
from device.measurement.recording.recording import REPAIR, CameraSettings
from device.measurement.recording.tactile_image import FULL_CONTRAST

ROW_PX, MARGIN_PX, FONT_SCALE = 24, 12, 0.5
COMMENT_LENGTH = 10240
"""Characters of VR LT, PS3.5 section 6.2."""


def image_of(subject: DicomSubject, picture: bytes) -> Dataset:
    """Return the picture (a PNG) of a measurement as an object; raise `InvalidQuantity` for one that is damaged."""
    phantom = subject.exam["kind"] == "phantom"
    drawn = decoded(picture)
    text = rows(subject.measurement, simulated=subject.head.simulated, phantom=phantom)
    taken_at = subject.measurement["taken_at"]
    data = begun(subject, "image", SecondaryCaptureImageStorage, "OT", taken_at)
    set_body_part(data, subject)
    set_acquisition(data, subject)
    set_time(data, "Acquisition", local_time(subject, taken_at))
    data.ConversionType = "WSD"
    data.SecondaryCaptureDeviceManufacturer = MANUFACTURER
    data.ImageType = ["DERIVED", "SECONDARY", "OTHER"]
    data.DerivationDescription = derivation(subject.measurement)
    data.PatientOrientation = ""
    data.BurnedInAnnotation = "NO"
    data.LossyImageCompression = "00"
    data.ImageComments = _comment(subject)
    _set_scale(data, mm_per_pixel(subject.head.camera, drawn.shape[1]))
    _set_pixels(data, with_rows(drawn, text))
    return data


def derivation(measurement: dict[str, Any]) -> str:
    """Return how the picture was made; a scan's shows its first press alone, which has the lesion in the middle."""
    of_which = " of the scan's first press on the lesion" if measurement.get("ramps", 1) > 1 else ""
    return f"Mean contrast of the pressed frames{of_which}, 0 to {100 * FULL_CONTRAST:g} % in false colours"


def decoded(picture: bytes) -> np.ndarray:
    """Return a PNG as RGB [height, width, 3]; raise `InvalidQuantity` when it is none."""
    counts = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR) if picture else None
    if counts is None:
        raise InvalidQuantity("picture", f"{len(picture)} bytes", "a readable PNG", REPAIR)
    return np.asarray(cv2.cvtColor(counts, cv2.COLOR_BGR2RGB))


def with_rows(drawn: np.ndarray, text: list[str]) -> np.ndarray:
    """Return a picture with rows of text below it, white on black; it is widened on the right where they need it."""
    longest = max(cv2.getTextSize(row, cv2.FONT_HERSHEY_SIMPLEX, FONT_SCALE, 1)[0][0] for row in text)
    height, width = drawn.shape[:2]
    whole = np.zeros((height + ROW_PX * len(text) + MARGIN_PX, max(width, longest + 2 * MARGIN_PX), 3), np.uint8)
    whole[:height, :width] = drawn
    for number, row in enumerate(text, start=1):
        at = MARGIN_PX, height + ROW_PX * number
        cv2.putText(whole, row, at, cv2.FONT_HERSHEY_SIMPLEX, FONT_SCALE, (255, 255, 255), 1, cv2.LINE_AA)
    return whole


def mm_per_pixel(camera: CameraSettings, picture_px: int) -> float:
    """Return the size on the skin of a pixel of the picture, which is square: binning drops what is left over."""
    factor = round(binned_scale(camera.scale).mm_per_px_x / camera.mm_per_px_x)
    return camera.width_px // factor * factor * camera.mm_per_px_x / picture_px


def _set_scale(data: Dataset, mm: float) -> None:
    data.PixelSpacing = [f"{mm:.8g}", f"{mm:.8g}"]
    data.PixelSpacingCalibrationType = "GEOMETRY"
    data.PixelSpacingCalibrationDescription = "Size on the sensing face, which lies on the skin"


def _set_pixels(data: Dataset, pixels: np.ndarray) -> None:
    data.SamplesPerPixel, data.PhotometricInterpretation, data.PlanarConfiguration = 3, "RGB", 0
    data.Rows, data.Columns = pixels.shape[:2]
    data.BitsAllocated, data.BitsStored, data.HighBit, data.PixelRepresentation = 8, 8, 7, 0
    content = pixels.tobytes()
    data.PixelData = content + b"\0" * (len(content) % 2)


def _comment(subject: DicomSubject) -> str:
    """Return numbers and remarks in words, one line each as DICOM breaks lines; what VR LT cannot hold is left out."""
    estimate = subject.measurement["estimate"]
    numbers = "; ".join(spoken_quantity(name, estimate[name]) for name in UNKNOWNS)
    said = [numbers, *remarks(subject.measurement, simulated=subject.head.simulated)]
    return "\r\n".join(said)[:COMMENT_LENGTH].rstrip()
