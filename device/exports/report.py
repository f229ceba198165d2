"""One exam as a PDF to print and to file: whose it is, and each measurement that counts with picture and intervals.

It says what was measured, never what that means for a patient.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from reportlab.graphics.shapes import Drawing, Line
from reportlab.lib import colors
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable, Image, KeepTogether, SimpleDocTemplate, Spacer, Table

from device import __version__
from device.errors import DeviceError
from device.exports.printed_text import paragraph, printable, register_fonts
from device.exports.selection import Exported, Selection, local_time
from device.files.recording_file import read_head
from device.measurement.mode import FRAMES, MODES, mode_named
from device.measurement.quantities import InvalidQuantity, unit_of
from device.measurement.recording.tactile_image import FULL_CONTRAST
from device.measurement.repeats import PressMethod, Repeats, method_of, repeats_by_unknown
from device.measurement.shown_quantity import shown_interval, shown_mean_and_spread, shown_value
from device.records.listing import Wanted
from device.records.store import Store, StoredRecord

_PictureOf = Callable[[Path], bytes]
NAMES = {"size_mm": "Size", "depth_mm": "Depth of its top", "youngs_modulus_kpa": "Young's modulus"}
MOST = 50
"""So many measurements are printed, the newest; of more the page says how many it leaves out."""
MARGIN, FOOT, PICTURE = 16 * mm, 23 * mm, 50 * mm
INSIDE = MARGIN + 6
"""Where text begins: the library keeps six points within its margin."""
SCALE_MM = 5.0
INK, SOFT, RULE, ALERT = (colors.HexColor(one) for one in ("#1b2733", "#5b6b7a", "#c9d1d8", "#9a3412"))
TEXT = ParagraphStyle("text", fontName="Page", fontSize=9, leading=12, textColor=INK)
SMALL = ParagraphStyle("small", TEXT, fontSize=7.5, leading=10, textColor=SOFT)
STRONG = ParagraphStyle("strong", TEXT, fontName="Page-Bold")
NUMBER = ParagraphStyle("number", STRONG, fontSize=12, leading=15)
TITLE = ParagraphStyle("title", STRONG, fontSize=17, leading=21)
HEADING = ParagraphStyle("heading", STRONG, fontSize=11, leading=14)
WARNING = ParagraphStyle("warning", TEXT, textColor=ALERT)
AGREEMENT = (
    "Presses of this lesion that determine the quantity, by each mode and model. Repeatability index: two such presses "
    "differ by less than this part of the mean in 95 % of cases. Beyond an open end the probe cannot tell."
)
NOT_A_DIAGNOSIS = (
    "Not a diagnosis. This page says what the probe measured: size, depth and Young's modulus of an inclusion, each "
    "with the interval that holds it in 9 of 10 measurements. What it means is for a physician to say."
)


def report_of(store: Store, exam_id: str, serial: str, picture_of: _PictureOf) -> bytes:
    """Return the PDF of an exam, as it is now; raises as `Exams.exam`.

    `serial` is the probe's that prints it; `picture_of` the PNG of a kept recording.
    """
    exam = store.exams.exam(exam_id)
    measured = list(Selection.of_now(store, Wanted(exam_id=exam_id), with_void=True))
    counting = [one for one in measured if not one.measurement["voided"]]
    register_fonts()

    def parts() -> list[Flowable]:
        shown = [KeepTogether(_measurement(store, one, picture_of)) for one in counting[:MOST]]
        return [*_head(exam, serial), *_counted(len(counting), len(measured)), *_agreement(counting), *shown]

    pages, _ = _printed(parts(), exam, serial, pages=0)
    return _printed(parts(), exam, serial, pages)[1]


def _printed(parts: list[Flowable], exam: StoredRecord, serial: str, pages: int) -> tuple[int, bytes]:
    """Return how many pages the parts take, and the PDF whose pages say that there are `pages`."""
    content = io.BytesIO()
    page = SimpleDocTemplate(
        content, pagesize=A4, leftMargin=MARGIN, rightMargin=MARGIN, topMargin=MARGIN, bottomMargin=FOOT + 2 * mm,
        title="TSIS exam report", creator=f"TSIS {__version__}", author=f"Probe {serial}",
    )  # fmt: skip
    foot = _foot(exam, pages)
    page.build(parts, onFirstPage=foot, onLaterPages=foot)
    return page.page, content.getvalue()


def _head(exam: StoredRecord, serial: str) -> list[Flowable]:
    is_patient = exam["kind"] == "patient"
    rows = [
        ("Patient reference", exam["patient_ref"]) if is_patient else ("Exam of", "a phantom, not a patient"),
        ("Issued by", exam["patient_issuer"]),
        ("Order number", exam["order_number"]),
        ("Location", place_of(exam)),
        ("Examined by", exam["operator"]),
        ("Begun", local_time(exam["made_at"])),
        ("Note", exam["note"]),
        ("Exam", f"{exam['id']}, version {exam['version']}"),
        ("Printed by", f"probe {serial}, software {__version__}"),
    ]
    cells = [[paragraph(name, SMALL), paragraph(str(value), TEXT)] for name, value in rows if value]
    table = Table(
        cells, colWidths=[34 * mm, None], style=[*TIGHT, ("LINEABOVE", (0, 0), (-1, 0), 0.8, INK)], splitInRow=1
    )
    return [paragraph("Tactile imaging: report of an exam", TITLE), Spacer(0, 3 * mm), table]


TIGHT: list[Any] = [
    ("VALIGN", (0, 0), (-1, -1), "TOP"),
    ("LEFTPADDING", (0, 0), (-1, -1), 0),
    ("TOPPADDING", (0, 0), (-1, -1), 1.5),
    ("BOTTOMPADDING", (0, 0), (-1, -1), 1.5),
]


def patient_of(exam: StoredRecord) -> str:
    """Return whose an exam is: the reference, and who has issued it, for two issuers may give one to two people."""
    issuer = exam["patient_issuer"]
    return f"{exam['patient_ref']} ({issuer})" if issuer else str(exam["patient_ref"])


def place_of(exam: StoredRecord) -> str:
    """Return where the lesion is in words, "" when nobody said."""
    said = [
        f"{exam['side']} breast" if exam["side"] else "",
        f"{exam['clock_position']} o'clock" if exam["clock_position"] else "",
        f"{exam['nipple_distance_mm']:g} mm from the nipple" if exam["nipple_distance_mm"] is not None else "",
    ]
    return ", ".join(one for one in said if one)


def _counted(counting: int, measured: int) -> list[Flowable]:
    said = [f"{counting} measurement{'' if counting == 1 else 's'}, newest first."]
    if measured > counting:
        said.append(f"Voided and not shown: {measured - counting}.")
    if counting > MOST:
        said.append(f"The {counting - MOST} oldest are left out: export them as a table.")
    return [Spacer(0, 4 * mm), paragraph(" ".join(said), STRONG)]


def _agreement(counting: Sequence[Exported]) -> list[Flowable]:
    """Return how far the presses of the lesion agree by each method, nothing of fewer than two."""
    by_method: dict[PressMethod, list[StoredRecord]] = {}
    for one in counting:
        by_method.setdefault(method_of(one.measurement["estimate"]), []).append(one.measurement["estimate"])
    ordered = sorted(by_method, key=lambda method: (MODES.index(mode_named(method.mode)), method))
    repeats = {method: repeats_by_unknown(by_method[method]) for method in ordered}
    several = [(name, _method_words(method, ordered), repeats[method][name]) for name in NAMES for method in ordered]
    rows = [_agreed(name, method, one) for name, method, one in several if one.presses > 1]
    if not rows:
        return []
    head = ("", "mode", "presses", "mean", "spread", "repeatability index")
    cells = [[paragraph(cell, SMALL) for cell in head], *([paragraph(cell, TEXT) for cell in row] for row in rows)]
    table = Table(cells, colWidths=[34 * mm, 33 * mm, 16 * mm, 24 * mm, 24 * mm, None], style=TIGHT)
    return [Spacer(0, 2 * mm), table, paragraph(AGREEMENT, SMALL)]


def _method_words(method: PressMethod, among: Sequence[PressMethod]) -> str:
    """Return a method by its mode, and by its model, where the mode alone does not tell it from others."""
    if sum(other.mode == method.mode for other in among) == 1:
        return method.mode
    return f"{method.mode}, model {method.model[:12]}{', simulated' if method.is_simulated else ''}"


def _agreed(name: str, method: str, repeats: Repeats) -> tuple[str, ...]:
    """Return the row of an unknown that two presses by a method determine, or more."""
    of_what = NAMES[name], method, f"{repeats.presses}"
    if repeats.mean is None or repeats.spread is None:
        return *of_what, "", "", f"none: {repeats.open_presses} of {repeats.presses} have an open end"
    mean, spread = (f"{one} {unit_of(name)}" for one in shown_mean_and_spread(repeats.mean, repeats.spread))
    return *of_what, mean, spread, f"{repeats.repeatability_index:.2f}"


def _measurement(store: Store, one: Exported, picture_of: _PictureOf) -> list[Flowable]:
    measurement, estimate = one.measurement, one.measurement["estimate"]
    how = paragraph(_pressed(measurement), SMALL)
    right: list[Flowable] = [paragraph(local_time(one.taken_at), HEADING), how, Spacer(0, 2 * mm)]
    right.append(_numbers(estimate))
    if estimate["reason"]:
        right += [Spacer(0, 1.5 * mm), paragraph(estimate["reason"], TEXT)]
    if measurement.get("reached") is False:
        right.append(paragraph("Not as sure as asked for.", WARNING))
    if estimate["simulated"]:
        right.append(paragraph("Simulated press: of no patient's tissue.", WARNING))
    right += [paragraph(f"{each['code']} {each['title']}. {each['cause']}", WARNING) for each in told(measurement)]
    right.append(paragraph(f"{measurement['id']}, {_made_by(measurement)}", SMALL))
    left = _picture(store, measurement, picture_of)
    style = [*TIGHT, ("LINEABOVE", (0, 0), (-1, 0), 0.4, RULE), ("TOPPADDING", (0, 0), (-1, -1), 2.5 * mm)]
    return [Spacer(0, 3 * mm), Table([[left, right]], colWidths=[PICTURE + 8 * mm, None], style=style, splitInRow=1)]


def _pressed(measurement: StoredRecord) -> str:
    """Return the mode with its force, which over a ramp is a mean, and frames."""
    mode = mode_named(measurement["mode"])
    force = f"{'mean ' if FRAMES[mode].is_ramp else ''}{measurement['force_n']:.2f} N"
    return f"Mode {mode}, {force}, {measurement['frames']} frames"


def told(measurement: StoredRecord) -> Sequence[dict[str, str]]:
    """Return the warnings of a measurement that say what they are."""
    return [one for one in measurement["warnings"] if {"code", "title", "cause"} <= one.keys()]


def _numbers(estimate: StoredRecord) -> Table:
    head = [paragraph(name, SMALL) for name in ("", "value", "90 % interval")]
    rows = [[paragraph(NAMES[name], TEXT), *_spoken(name, estimate[name])] for name in NAMES]
    lines = [("LINEBELOW", (0, 0), (-1, -1), 0.3, RULE), ("VALIGN", (0, 0), (-1, -1), "MIDDLE")]
    return Table([head, *rows], colWidths=[34 * mm, 32 * mm, None], style=[*TIGHT, *lines])


def _spoken(name: str, quantity: dict[str, Any]) -> list[Flowable]:
    """Return value and interval; an open end is that of the trained range, beyond which the truth may lie."""
    if any(quantity[end] is None for end in ("low", "value", "high")):
        return [paragraph("not determined", TEXT), paragraph("", TEXT)]
    interval = paragraph(shown_interval(name, quantity), TEXT)
    if not quantity["identifiable"]:
        return [paragraph("not determined", TEXT), interval]
    return [paragraph(f"{shown_value(quantity)} {unit_of(name)}", NUMBER), interval]


def _made_by(measurement: StoredRecord) -> str:
    """Return which model answered, by which certificate, on which probe and software, as far as a measurement says."""
    estimate = measurement["estimate"]
    model = f"model {estimate['model']} {(estimate.get('model_card_sha256') or estimate['model_sha256'])[:12]}"
    of_whom = {
        "certificate": estimate["calibration_id"],
        "probe": measurement.get("serial"),
        "software": measurement.get("software"),
    }
    return ", ".join([model, *(f"{name} {said}" for name, said in of_whom.items() if said)])


def _picture(store: Store, measurement: StoredRecord, picture_of: _PictureOf) -> list[Flowable]:
    """Return the tactile image with its scale, or why there is none: the numbers stand without it."""
    try:
        path = store.recording_path(measurement["recording_id"])
        image = Image(io.BytesIO(picture_of(path)), kind="proportional", width=PICTURE, height=PICTURE)
        camera = read_head(path).camera
    except (DeviceError, InvalidQuantity, OSError) as error:
        return [paragraph(f"No picture: {error}", WARNING)]
    said = f"{SCALE_MM:g} mm on the probe's face. Dark: no contrast; yellow: {100 * FULL_CONTRAST:g} % and more."
    return [image, _scale(PICTURE / (camera.width_px * camera.mm_per_px_x)), paragraph(said, SMALL)]


def _scale(points_per_mm: float) -> Drawing:
    length = SCALE_MM * points_per_mm
    drawn = Drawing(PICTURE, 4 * mm)
    drawn.add(Line(0, 2 * mm, length, 2 * mm, strokeColor=INK, strokeWidth=1.2))
    for x in (0, length):
        drawn.add(Line(x, 1.2 * mm, x, 2.8 * mm, strokeColor=INK, strokeWidth=1.2))
    return drawn


def _foot(exam: StoredRecord, pages: int) -> Callable[[Canvas, Any], None]:
    """Return what draws the foot of each page: what it is not, whose it is, and its number."""
    whose = patient_of(exam) if exam["kind"] == "patient" else "Phantom"

    def drawn(canvas: Canvas, page: Any) -> None:
        width = A4[0] - 2 * INSIDE
        canvas.saveState()
        canvas.setStrokeColor(RULE)
        canvas.line(INSIDE, FOOT, INSIDE + width, FOOT)
        warning = paragraph(NOT_A_DIAGNOSIS, SMALL)
        _, height = warning.wrap(width, FOOT)
        warning.drawOn(canvas, INSIDE, FOOT - height - 1 * mm)
        canvas.setFont("Page", 7.5)
        canvas.setFillColor(SOFT)
        canvas.drawString(INSIDE, 9 * mm, printable(f"{whose}, exam {exam['id']}", "Page"))
        canvas.drawRightString(INSIDE + width, 9 * mm, f"Page {page.page} of {pages}")
        canvas.restoreState()

    return drawn
