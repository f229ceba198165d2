"""What the daemon knows of the hospital: the one door to this room. It imports DICOM's libraries when first needed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from device.config import DicomSection
from device.records.store import Store


class Hospital:
    """Exams in the hospital's formats; all methods may be called from any thread."""

    def __init__(self, settings: DicomSection, store: Store, picture_of: Callable[[Path], bytes]) -> None:
        """Take the settings, the store, and who returns the picture (a PNG) of a kept recording."""
        self._settings, self._store, self._picture_of = settings, store, picture_of

    def files_of(self, exam_id: str) -> bytes:
        """Return an exam as DICOM files in one .zip; raises as `exam_zip`."""
        from device.dicom.exam_files import exam_zip
        from device.dicom.objects import DicomWriter

        writer = DicomWriter(self._store, self._picture_of, self._settings.institution)
        return exam_zip(self._store, writer, exam_id, None)
