"""The whole daemon: an exam that was sent gets to the archive although that is down and the daemon is killed."""

from functools import partial

import pytest
from daemon_process import Daemon, wait_for
from orthanc import OWN_TITLE, TITLE, Orthanc, needs_orthanc
from written_exam import begin, measure

from device.records.store import Store

pytestmark = [needs_orthanc, pytest.mark.long]


def test_an_exam_waits_through_kills_for_an_archive_that_is_down(tmp_path):
    archive = Orthanc(tmp_path)
    store = Store(tmp_path / "var")
    exam = begin(store)
    for _ in range(3):
        measure(store, exam)
    store.close()
    scene = (
        f'[settings.dicom]\narchive_host = "127.0.0.1"\narchive_port = {archive.port}\n'
        f'archive_title = "{TITLE}"\nown_title = "{OWN_TITLE}"\n'
    )
    path = f"/api/v1/exams/{exam['id']}/dicom"
    daemon = Daemon(tmp_path, scene)
    try:
        sent = daemon.ask(path, "POST", {"by": "Ada"}, headers={"If-Match": '"1"'})
        assert sent.status == 202
        for _ in range(2):
            wait_for(partial(codes, daemon), lambda seen: "E030" in seen)
            daemon.process.kill()
            daemon.ended_code()
            daemon = Daemon(tmp_path, scene)
        archive.start()
        wait_for(lambda: daemon.ask("/api/v1/dicom").json["objects"], lambda seen: seen == {"confirmed": 6})
        wait_for(lambda: codes(daemon), lambda seen: "E030" not in seen)
        uids = [one["uid"] for one in daemon.ask(path).json["objects"]]
        assert sorted(one["SOPInstanceUID"] for one in archive.kept()) == sorted(uids)
    finally:
        daemon.stop()
        archive.close()
    assert exam["patient_ref"] not in daemon.log_text()


def codes(daemon):
    return [fault["code"] for fault in daemon.ask("/api/v1/status").json["faults"]]
