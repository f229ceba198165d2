"""Measurements over REST: list them, and read one with its features, its picture and its recording."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any

from fastapi import FastAPI, Query, Response

from device.measurement.recording.tactile_image import FULL_CONTRAST
from device.records.store import Store
from device.web.contract import PNG, ZIP, answers, media
from device.web.exams import tagged
from device.web.kept_files import KeptFiles
from device.web.paging import MeasurementQuery, page_of
from device.web.schema import ForceCurve, MeasuredFeatures, Measurement, MeasurementList


def add_measurements(app: FastAPI, api: str, store: Store) -> None:
    """Add the routes below `api` of measurements and of what was kept of them."""

    @app.get(f"{api}/measurements", responses=answers(200, MeasurementList, "ETag"), tags=["measurements"])
    def list_measurements(asked: Annotated[MeasurementQuery, Query()]) -> dict[str, Any]:
        """Return measurements, newest first, all or those of an exam, a time, a mode and an outcome."""
        return page_of("measurements", store.listing.measurements(asked.wanted, before=asked.before, limit=asked.limit))

    one = f"{api}/measurements/{{measurement_id}}"

    @app.get(one, responses=answers(200, Measurement, "ETag"), tags=["measurements"])
    def get_measurement(measurement_id: str, response: Response) -> dict[str, Any]:
        """Return one measurement."""
        return tagged(response, store.measurement(measurement_id))

    @app.get(
        f"{one}/features",
        responses=answers(200, MeasuredFeatures, "ETag"),
        tags=["measurements"],
    )
    def get_features(measurement_id: str) -> dict[str, float]:
        """Return the features of one measurement."""
        return dict(store.measurement(measurement_id)["features"])

    kept = KeptFiles(store)

    @app.get(f"{one}/forces", responses=answers(200, ForceCurve, "ETag"), tags=["measurements"])
    def get_forces(measurement_id: str) -> dict[str, Any]:
        """Return the force of every frame of one measurement."""
        return {"frames": [asdict(frame) for frame in kept.forces(measurement_id)]}

    @app.get(
        f"{one}/image.png",
        response_class=Response,
        responses=media(PNG, f"The contrast in colours, of every press from 0 to {100 * FULL_CONTRAST:g} %.", "ETag"),
        tags=["measurements"],
    )
    async def get_image(measurement_id: str) -> Response:
        """Return the tactile image as a picture."""
        return await kept.picture(measurement_id)

    @app.get(
        f"{one}/recording.zip",
        response_class=Response,
        responses=media(ZIP, "A `tsis.recording`.", "ETag"),
        tags=["measurements"],
    )
    def get_recording(measurement_id: str) -> Response:
        """Return the recording that the measurement was computed from."""
        return kept.recording(measurement_id)
