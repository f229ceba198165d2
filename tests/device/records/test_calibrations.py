"""A folder of certificates and the pointer to the active one."""

import pytest
from small_certificate import small_certificate

from device.errors import MissingCalibration
from device.files import durable
from device.files.durable import write_once
from device.records.calibrations import Calibrations

FIRST, SECOND = small_certificate(), small_certificate(operator="Another")


@pytest.fixture
def folder(tmp_path):
    for certificate in (FIRST, SECOND):
        write_once(tmp_path / f"{certificate.id}.json", certificate.to_json().encode())
    return tmp_path


def test_without_a_pointer_no_certificate_is_active(folder):
    calibrations = Calibrations(folder)
    assert (calibrations.active_name(), calibrations.active()) == (None, None)


def test_an_activated_certificate_is_active_until_another_is(folder):
    for certificate in (FIRST, SECOND):
        Calibrations(folder).activate(certificate.id)
        assert Calibrations(folder).active().id == certificate.id
    assert sorted(path.name for path in folder.iterdir()) == sorted([f"{FIRST.id}.json", f"{SECOND.id}.json", "active"])


def test_a_power_cut_while_activating_leaves_the_one_before(folder, monkeypatch):
    Calibrations(folder).activate(FIRST.id)

    def cut(path, content):
        path.write_bytes(content[:3])
        raise OSError("power cut")

    monkeypatch.setattr(durable, "write_and_sync", cut)
    with pytest.raises(OSError, match="power cut"):
        Calibrations(folder).activate(SECOND.id)
    assert Calibrations(folder).active().id == FIRST.id


@pytest.mark.parametrize("name", ["none", "", "../" + FIRST.id, "active"])
def test_what_is_not_there_is_neither_read_nor_activated(folder, name):
    for ask in (Calibrations(folder).read, Calibrations(folder).activate):
        with pytest.raises(MissingCalibration, match="calibration list"):
            ask(name)
    assert not (folder / "active").exists()


def test_a_pointer_to_a_certificate_that_is_gone_is_refused_by_its_path(folder):
    Calibrations(folder).activate(FIRST.id)
    (folder / f"{FIRST.id}.json").unlink()
    with pytest.raises(MissingCalibration, match=FIRST.id):
        Calibrations(folder).active()


def test_a_changed_certificate_is_refused_and_listed_with_its_problem(folder):
    file = folder / f"{FIRST.id}.json"
    file.chmod(0o644)
    file.write_text(file.read_text().replace("N. N.", "M. M."))
    with pytest.raises(MissingCalibration, match="sha256"):
        Calibrations(folder).activate(FIRST.id)
    known = {one.name: one for one in Calibrations(folder).all()}
    assert "sha256" in known[FIRST.id].problem
    assert known[SECOND.id].as_record()["operator"] == "Another"


def test_a_certificate_under_another_name_is_refused(folder):
    (folder / f"{FIRST.id}.json").rename(folder / "mine.json")
    with pytest.raises(MissingCalibration, match=f"is {FIRST.id}, not mine"):
        Calibrations(folder).read("mine")


def test_a_pointer_that_cannot_be_read_is_refused(folder):
    (folder / "active").mkdir()
    with pytest.raises(MissingCalibration, match="pointer"):
        Calibrations(folder).active()


def test_a_folder_that_is_not_there_is_refused_and_has_no_certificates(tmp_path):
    calibrations = Calibrations(tmp_path / "none")
    with pytest.raises(MissingCalibration, match="none is not there"):
        calibrations.active()
    assert calibrations.all() == []


def test_one_file_is_the_only_certificate_and_active(folder):
    calibrations = Calibrations((folder / f"{FIRST.id}.json").rename(folder / "calibration.json"))
    assert calibrations.active_name() == calibrations.active().id == FIRST.id
    assert [one.name for one in calibrations.all()] == [FIRST.id]
    with pytest.raises(MissingCalibration, match="no other to activate"):
        calibrations.activate(FIRST.id)
    with pytest.raises(MissingCalibration, match=f"not {SECOND.id}"):
        calibrations.read(SECOND.id)


def test_one_file_that_is_not_there_is_refused_and_listed_with_its_problem(tmp_path):
    calibrations = Calibrations(tmp_path / "calibration.json")
    with pytest.raises(MissingCalibration, match="readable certificate"):
        calibrations.active()
    [entry] = calibrations.all()
    assert (entry.name, entry.calibration) == ("calibration", None)
