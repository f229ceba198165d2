"""An archive on loopback that answers as it is told to, object by object: what a real one does only when it is ill."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from pydicom.dataset import Dataset
from pynetdicom import AE, evt

from device.config import DicomSection
from device.dicom.association import COMMITMENT, STUDY_FIND
from device.dicom.rejection import SOP_CLASSES

TITLE = "STANDIN"
TAKES, ABORTS = 0x0000, None


class StandInArchive:
    """Takes, refuses or aborts by `answers`, finds what it took but for `hidden`, and notes what `arrived`."""

    def __init__(self) -> None:
        self.answers: Callable[[str], int | None] = lambda uid: TAKES
        self.arrived: list[str] = []
        self.asked: list[list[str]] = []
        self.kept: set[str] = set()
        self.hidden: set[str] = set()
        self._program = AE(ae_title=TITLE)
        for sop_class in (*SOP_CLASSES.values(), STUDY_FIND, COMMITMENT):
            self._program.add_supported_context(sop_class)
        handlers: list[Any] = [(evt.EVT_C_STORE, self._store), (evt.EVT_C_FIND, self._find)]
        self._server: Any = self._program.start_server(("127.0.0.1", 0), block=False, evt_handlers=handlers)

    def settings(self) -> DicomSection:
        port = self._server.socket.getsockname()[1]
        return DicomSection(archive_host="127.0.0.1", archive_port=port, archive_title=TITLE)

    def close(self) -> None:
        self._server.shutdown()

    def _store(self, event: evt.Event) -> int:
        uid = str(event.request.AffectedSOPInstanceUID)
        self.arrived.append(uid)
        answer = self.answers(uid)
        if answer is ABORTS:
            event.assoc.abort(block=False)
            return 0x0110
        if answer == TAKES:
            self.kept.add(uid)
        return answer

    def _find(self, event: evt.Event) -> Iterator[tuple[int, Dataset | None]]:
        asked = event.identifier.SOPInstanceUID
        uids = [asked] if isinstance(asked, str) else list(asked)
        self.asked.append(uids)
        for uid in uids:
            if uid in self.kept - self.hidden:
                found = Dataset()
                found.QueryRetrieveLevel, found.SOPInstanceUID = "IMAGE", uid
                yield 0xFF00, found
