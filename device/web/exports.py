"""Exports over REST: the measurements of an exam, a time, a mode or an outcome as table, arrays or recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import FastAPI, Query, Response
from fastapi.responses import StreamingResponse
from pydantic import BaseModel, Field

from device.errors import InvalidRequest
from device.exports.archive import archive_of
from device.exports.arrays import netcdf_of, npz_of
from device.exports.lesions import lesion_table, lesions_of
from device.exports.selection import Selection
from device.exports.table import long_table, wide_table
from device.measurement.repeats import repeats_by_unknown
from device.records.listing import Wanted
from device.records.store import Store
from device.web.contract import CSV, NETCDF, NPZ, PDF, ZIP, answers, media
from device.web.paging import MeasurementFilter


class Agreement(BaseModel):
    """Presses that determine an unknown, with their mean and spread (standard deviation) in its unit.

    `repeatability_index`: 1.96 sqrt(2) spread over mean, by which two presses differ at most in 19 of 20 cases. What
    too few presses do not tell is null. So are all three of several methods (modes, models, simulated or not), and
    while some of the presses, `open_presses`, have an interval with an open end.
    """

    presses: int
    mean: float | None
    spread: float | None
    repeatability_index: float | None
    open_presses: int


class LesionResource(BaseModel):
    """The presses of one lesion: how many measurements of an exam count, and how far they agree in each unknown."""

    exam_id: str
    measurements: int
    size_mm: Agreement
    depth_mm: Agreement
    youngs_modulus_kpa: Agreement


class ExportQuery(MeasurementFilter):
    """Which measurements are taken away."""

    with_void: bool = Field(default=False, description="Whether also those that do not count.")

    def selection(self, store: Store) -> Selection:
        """Return them as they are now; no exam of that id, or times in the wrong order, would make an empty file."""
        if self.exam_id:
            store.exams.exam(self.exam_id)
        if self.since and self.until and self.since > self.until:
            since, until = self.times["since"], self.times["until"]
            cause = f"query.from is {since}, but must not be later than query.to, {until}."
            raise InvalidRequest(cause, "Exchange the two times.")
        return Selection.of_now(store, self.wanted, with_void=self.with_void)


class TableQuery(ExportQuery):
    """Which measurements are taken away: as a row each, as a row for each quantity of each, or as a row a lesion."""

    form: Literal["wide", "long", "lesions"] = "wide"


TABLES = {"wide": wide_table, "long": long_table, "lesions": lesion_table}


def add_exports(
    app: FastAPI, api: str, store: Store, serial: Callable[[], str], picture_of: Callable[[Path], bytes]
) -> None:
    """Add the routes below `api` that hand out measurements as files; newest first, as in lists.

    `serial` says the probe's that prints, `picture_of` the PNG of a kept recording.
    """

    @app.get(
        f"{api}/exports/measurements.csv",
        response_class=Response,
        responses=media(CSV, "A header, and a row a measurement, a row a quantity, or a row a lesion."),
        tags=["exports"],
    )
    def export_table(asked: Annotated[TableQuery, Query()]) -> Response:
        """Return measurements with their exams as a table."""
        name = "lesions.csv" if asked.form == "lesions" else "measurements.csv"
        return _file(TABLES[asked.form](asked.selection(store)), CSV, name)

    @app.get(
        f"{api}/exports/measurements.npz",
        response_class=Response,
        responses=media(NPZ, "Arrays of NumPy, none of them pickled."),
        tags=["exports"],
    )
    def export_arrays(asked: Annotated[ExportQuery, Query()]) -> Response:
        """Return measurements with their exams and features as arrays."""
        return _file([npz_of(asked.selection(store))], NPZ, "measurements.npz")

    @app.get(
        f"{api}/exports/measurements.nc",
        response_class=Response,
        responses=media(NETCDF, "A netCDF-4 data set `tsis.measurements/1` with units."),
        tags=["exports"],
    )
    def export_dataset(asked: Annotated[ExportQuery, Query()]) -> Response:
        """Return measurements with their exams and features as a netCDF data set."""
        return _file([netcdf_of(asked.selection(store))], NETCDF, "measurements.nc")

    @app.get(
        f"{api}/exports/recordings.zip",
        response_class=Response,
        responses=media(ZIP, "`measurements.csv`, `recordings/` and `missing.csv`."),
        tags=["exports"],
    )
    def export_recordings(asked: Annotated[ExportQuery, Query()]) -> Response:
        """Return the recordings of measurements, and their table."""
        return _file(archive_of(store, asked.selection(store)), ZIP, "recordings.zip")

    @app.get(f"{api}/exams/{{exam_id}}/lesion", responses=answers(200, LesionResource), tags=["exports"])
    def get_lesion(exam_id: str) -> dict[str, Any]:
        """Say how far the measurements of an exam agree that count: they are presses of one lesion."""
        store.exams.exam(exam_id)
        lesions = lesions_of(Selection.of_now(store, Wanted(exam_id=exam_id)))
        estimates = lesions[0].estimates if lesions else []
        agreed = {name: asdict(one) for name, one in repeats_by_unknown(estimates).items()}
        return {"exam_id": exam_id, "measurements": len(estimates), **agreed}

    @app.get(
        f"{api}/exams/{{exam_id}}/report.pdf",
        response_class=Response,
        responses=media(PDF, "Whose exam it is, and each measurement that counts with picture and intervals."),
        tags=["exports"],
    )
    def get_report(exam_id: str) -> Response:
        """Return an exam as a page to print; it is not a diagnosis."""
        from device.exports.report import report_of  # its libraries take 15 MB, and most days nobody prints

        return _file([report_of(store, exam_id, serial(), picture_of)], PDF, f"exam-{exam_id}.pdf")


def _file(content: Iterable[bytes], media_type: str, name: str) -> Response:
    shown = {"Content-Disposition": f'attachment; filename="tsis-{name}"'}
    return StreamingResponse(content, media_type=media_type, headers=shown)
