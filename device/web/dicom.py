"""Exams in the hospital's format over REST: as files to download."""

from __future__ import annotations

from fastapi import FastAPI, Response

from device.dicom.hospital import Hospital
from device.web.contract import ZIP, media


def add_dicom(app: FastAPI, api: str, hospital: Hospital) -> None:
    """Add the routes below `api` of what the hospital's programs read."""

    @app.get(
        f"{api}/exams/{{exam_id}}/dicom.zip",
        response_class=Response,
        responses=media(ZIP, "An image and a report of each measurement that counts."),
        tags=["hospital"],
    )
    def get_dicom_files(exam_id: str) -> Response:
        """Return an exam as DICOM files, for a PC that fetches them itself."""
        return Response(hospital.files_of(exam_id), media_type=ZIP)
