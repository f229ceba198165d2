"""The whole daemon: whoever is told of by notice hears of every exam and press, though he is away and it is killed."""

from functools import partial

from daemon_process import QUICK_HAND, Daemon, wait_for
from notice_receiver import NoticeReceiver, write_secret


def test_an_exam_and_its_press_are_told_through_a_kill_to_an_address_that_is_down(tmp_path):
    found = NoticeReceiver()
    found.close()
    scene = QUICK_HAND + f'[settings.webhook]\nurl = "{found.url}"\nsecret_file = "{write_secret(tmp_path)}"\n'
    daemon = Daemon(tmp_path, scene)
    whose = {"kind": "patient", "patient_ref": "A-17-secret", "operator": "Ada Byron"}
    try:
        exam = daemon.ask("/api/v1/exams", "POST", whose).json
        wait_for(partial(codes, daemon), lambda seen: "E032" in seen)
        daemon.process.kill()
        daemon.ended_code()
        daemon = Daemon(tmp_path, scene)
        job = daemon.press("quick")
        there = NoticeReceiver(found.port)
        try:
            wait_for(lambda: there.types(), lambda types: types == ["exam.made", "measurement.taken"])
            wait_for(partial(codes, daemon), lambda seen: "E032" not in seen)
        finally:
            there.close()
        said = daemon.ask("/api/v1/webhook").json
        assert (said["fault"], said["address"]) == (None, f"127.0.0.1:{found.port}")
    finally:
        daemon.stop()
    assert [one["data"]["id"] for one in there.taken] == [exam["id"], job["measurement_id"]]
    told = "".join(one["sent"] for one in there.taken)
    assert "A-17-secret" not in told + daemon.log_text()
    assert "Byron" not in told


def codes(daemon):
    return [fault["code"] for fault in daemon.ask("/api/v1/status").json["faults"]]
