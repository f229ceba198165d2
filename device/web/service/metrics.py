"""Figures of the probe for Prometheus, at /metrics: what is well, what was pressed, and what the daemon uses.

They are read when they are asked for. No figure tells whose a measurement is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from datetime import datetime

from fastapi import FastAPI, Response
from prometheus_client import CollectorRegistry, ProcessCollector
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, InfoMetricFamily, Metric
from prometheus_client.exposition import CONTENT_TYPE_LATEST, generate_latest
from prometheus_client.registry import Collector

from device import __version__
from device.errors import DeviceError, StorageError
from device.instrument.procedure import Procedure
from device.measurement.calibration import moment
from device.records.store import ENDED, Store
from device.records.updates import RUNNING
from device.web.contract import media

TEXT = "text/plain"


class ProbeCollector(Collector):
    """The figures of a procedure and its store; those that cannot be read are left out."""

    def __init__(
        self, procedure: Procedure, store: Store, certificate_ends_s: Callable[[], Mapping[str, float]]
    ) -> None:
        """Take what is asked at each collection; certificates' ends are in s since 1970, by their settings."""
        self._procedure, self._store, self._certificate_ends_s = procedure, store, certificate_ends_s

    def describe(self) -> list[Metric]:
        """Return nothing: the probe may not be there yet when this is registered."""
        return []

    def collect(self) -> Iterator[Metric]:
        """Yield each figure as it is now."""
        yield from self._of_probe()
        yield from self._of_certificates()
        for figures in (self._of_disk, self._of_records):
            with suppress(StorageError):  # `tsis_part_ready` says that the store is not
                yield from figures()

    def _of_probe(self) -> Iterator[Metric]:
        procedure, now = self._procedure, self._procedure.board.now
        told = {"serial": procedure.config.serial, "software": __version__, "release": RUNNING}
        yield InfoMetricFamily("tsis_probe", "Which probe this is, and what runs on it.", told)
        yield _gauge("tsis_simulated", "Whether the probe is simulated.", procedure.is_simulated)
        yield _gauge("tsis_ready", "Whether a press can be measured.", _is_ready(procedure.require_ready))
        parts = GaugeMetricFamily("tsis_part_ready", "Whether a part was seen working just now.", labels=["part"])
        for name, health in procedure.parts().items():
            parts.add_metric([name], float(health.ready))
        yield parts
        shown = (now.fault, now.stall, *now.warnings, *now.of_network)
        faults = GaugeMetricFamily("tsis_fault", "Faults and warnings that are shown.", labels=["code", "severity"])
        for error in {one.code: one for one in shown if one}.values():
            faults.add_metric([error.code, error.severity], 1.0)
        yield faults
        is_pressed = bool(now.press and now.press.state not in ENDED)
        yield _gauge("tsis_press_under_way", "Whether a press was asked for and has not ended.", is_pressed)

    def _of_certificates(self) -> Iterator[Metric]:
        told = "When the first certificate of a setting ends, in seconds since 1970."
        ends = GaugeMetricFamily("tsis_certificate_expires_timestamp_seconds", told, labels=["setting"])
        for setting, ends_s in self._certificate_ends_s().items():
            ends.add_metric([setting], ends_s)
        yield ends
        if calibration := self._procedure.calibration.calibration:
            ends_s = moment(calibration.validity.expires_at, "expires_at").timestamp()
            name, told = "tsis_calibration_expires_timestamp_seconds", "When the calibration ends, in s since 1970."
            yield _gauge(name, told, ends_s)

    def _of_disk(self) -> Iterator[Metric]:
        yield _gauge("tsis_store_free_bytes", "Space that is left for recordings.", self._store.free_mb * 1e6)

    def _of_records(self) -> Iterator[Metric]:
        counts = self._store.listing.counts()
        presses = CounterMetricFamily("tsis_presses", "Presses that were kept, by their state.", labels=["state"])
        for state, count in sorted(counts.presses.items()):
            presses.add_metric([state], count)
        yield presses
        yield CounterMetricFamily("tsis_measurements", "Measurements that were kept.", counts.measurements)
        yield CounterMetricFamily("tsis_exams", "Exams that were kept.", counts.exams)
        unsaved = self._store.unsaved()
        saved_s = datetime.fromisoformat(unsaved.saved_at).timestamp() if unsaved.saved_at else 0.0
        yield _gauge("tsis_unsaved_measurements", "Measurements that the last backup does not hold.", unsaved.count)
        yield _gauge("tsis_last_backup_timestamp_seconds", "When the last backup was made, 0 without one.", saved_s)
        yield CounterMetricFamily("tsis_light_on_seconds", "How long the LEDs have been on.", self._store.light_on_s)


def _gauge(name: str, meaning: str, value: float) -> Metric:
    return GaugeMetricFamily(name, meaning, float(value))


def _is_ready(require_ready: Callable[[], None]) -> bool:
    try:
        require_ready()
    except DeviceError:
        return False
    return True


def add_metrics(
    app: FastAPI, procedure: Procedure, store: Store, certificate_ends_s: Callable[[], Mapping[str, float]] = dict
) -> None:
    """Add the route of the figures, those of the process among them."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(ProbeCollector(procedure, store, certificate_ends_s))
    ProcessCollector(registry=registry)

    @app.get(
        "/metrics",
        response_class=Response,
        responses=media(TEXT, "Figures in Prometheus' text format."),
        tags=["health"],
    )
    def get_metrics() -> Response:
        """Return the figures of the probe for a monitoring system."""
        return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)
