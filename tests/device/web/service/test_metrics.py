"""Figures for a monitoring system, read back by Prometheus' own parser: what is, and nothing of a patient."""

import asyncio
import json
import types

import httpx
import pytest
from kept_measurements import keep
from prometheus_client.parser import text_string_to_metric_families

from device.errors import ArchiveUnreachable, CertificateEnds, DimLightError, LightBusError, StorageError
from device.instrument.status import PressJob, StatusBoard
from device.instrument.watch.readiness import PartHealth
from device.records.exams import ExamContent
from device.records.saved import SAVED, SavedUntil
from device.web.app import create_app


class Probe:
    """A procedure that is as its test says."""

    def __init__(self):
        self.board, self.is_simulated = StatusBoard(), True
        self.config = types.SimpleNamespace(serial="TSIS-0042")
        self.calibration = types.SimpleNamespace(calibration=None)
        self.health = {"camera": PartHealth(ready=True, code=None), "store": PartHealth(ready=False, code="E601")}

    def require_ready(self):
        if self.board.now.hindrance:
            raise self.board.now.hindrance

    def parts(self):
        return self.health


@pytest.fixture
def probe():
    return Probe()


@pytest.fixture
def figures(probe, store):
    app = create_app(probe, store, certificate_ends_s=lambda: {"dicom.tls_authority": 1.9e9})

    def read():
        async def answer():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                return await client.get("/metrics")

        told = asyncio.run(answer())
        assert told.status_code == 200
        assert told.headers["content-type"].startswith("text/plain")
        samples = [sample for family in text_string_to_metric_families(told.text) for sample in family.samples]
        return {(one.name, *sorted(one.labels.values())): one.value for one in samples}

    return read


def test_a_well_probe_is_told_with_what_it_has_kept(figures, store):
    exam = store.exams.make(ExamContent(kind="patient", patient_ref="A-17", operator="Ada"))
    keep(store, 1, exam_id=exam["id"])
    keep(store, 2)
    store.save_press({"id": "p-9", "state": "cancelled"})
    store.add_light_on_s(12.5)
    told = figures()
    assert told[("tsis_ready",)] == told[("tsis_simulated",)] == 1.0
    assert (told[("tsis_part_ready", "camera")], told[("tsis_part_ready", "store")]) == (1.0, 0.0)
    assert (told[("tsis_presses_total", "done")], told[("tsis_presses_total", "cancelled")]) == (2.0, 1.0)
    assert (told[("tsis_measurements_total",)], told[("tsis_exams_total",)]) == (2.0, 1.0)
    assert told[("tsis_light_on_seconds_total",)] == 12.5
    assert told[("tsis_store_free_bytes",)] == pytest.approx(store.free_mb * 1e6, rel=0.1)
    assert told[("tsis_press_under_way",)] == 0.0
    assert told[("process_resident_memory_bytes",)] > 1e7
    assert any(name == "tsis_probe_info" and "TSIS-0042" in labels for name, *labels in told)
    assert not [key for key in told if "A-17" in key or "Ada" in key]


def test_what_no_backup_holds_is_told_with_when_the_last_one_was_made(figures, store):
    names = ("tsis_unsaved_measurements",), ("tsis_last_backup_timestamp_seconds",)
    first = keep(store, 1)
    keep(store, 2)
    assert [figures()[name] for name in names] == [2.0, 0.0]
    said = SavedUntil("2026-01-02T03:04:05.500Z", first["seq"], first["id"])
    (store.folder / SAVED).write_text(json.dumps(said.as_record()))
    assert [figures()[name] for name in names] == [1.0, 1767323045.5]


def test_faults_and_a_press_are_told_as_they_come(figures, probe):
    fault, warning = LightBusError("Stuck.", "Off."), DimLightError("Dim.", "Clean.")
    probe.board.update(fault=fault, warnings=(warning, warning), press=PressJob("p-1", "quick", "capturing"))
    told = figures()
    assert (told[("tsis_fault", "E202", "fault")], told[("tsis_fault", "E206", "warning")]) == (1.0, 1.0)
    assert (told[("tsis_ready",)], told[("tsis_press_under_way",)]) == (0.0, 1.0)
    probe.board.update(fault=None, warnings=(), archive=ArchiveUnreachable("Down.", "Look."))
    assert [key for key in figures() if key[0] == "tsis_fault"] == [("tsis_fault", "E030", "warning")]
    probe.board.update(archive=None, certificate=CertificateEnds("Soon.", "Renew."))
    assert [key for key in figures() if key[0] == "tsis_fault"] == [("tsis_fault", "E022", "warning")]
    probe.board.update(certificate=None)
    assert not [key for key in figures() if key[0] == "tsis_fault"]


def test_ends_of_certificates_and_of_the_calibration_are_told(figures, probe):
    name = "tsis_calibration_expires_timestamp_seconds"
    told = figures()
    assert told[("tsis_certificate_expires_timestamp_seconds", "dicom.tls_authority")] == 1.9e9
    assert (name,) not in told
    validity = types.SimpleNamespace(expires_at="2027-01-01T00:00:00Z")
    probe.calibration.calibration = types.SimpleNamespace(validity=validity)
    assert figures()[(name,)] == 1798761600.0


def test_a_store_that_cannot_be_read_leaves_the_other_figures(figures, store, monkeypatch):
    def gone():
        raise StorageError("The disk is gone.", "Check it.")

    monkeypatch.setattr(store.listing, "counts", gone)
    told = figures()
    assert ("tsis_ready",) in told
    assert ("tsis_measurements_total",) not in told
