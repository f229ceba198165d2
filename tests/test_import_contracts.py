"""Every import contract is kept, and each breaks at an import that it forbids: in a room, at its root, of a library."""

from __future__ import annotations

import copy
import tomllib
from typing import Any

import grimp
import pytest
from daemon_process import ROOT
from import_contracts import OnlyContract, ReservedContract, StandardLibraryContract
from importlinter import Contract
from importlinter.contracts.layers import LayersContract

SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
CONTRACTS = {entry["name"]: entry for entry in SETTINGS["contracts"]}
KINDS = {
    "only": OnlyContract,
    "reserved": ReservedContract,
    "standard_library": StandardLibraryContract,
    "layers": LayersContract,
}
FORBIDDEN = {
    "The device never imports the workstation toolkit": ("device.web.app", "host_tools.scenes.scene"),
    "The workstation takes only measurement, simulation, files and updates from the device": (
        "host_tools.scores.dial",
        "device.config",
    ),
    "Measurement is pure: it imports nothing else of ours": ("device.measurement.mode", "device.files.text_table"),
    "Files know what they hold, and nothing of the daemon": ("device.files.durable", "device.errors"),
    "Simulation stands below the drivers: it knows none of them": (
        "device.simulation.hand",
        "device.instrument.press.states",
    ),
    "Drivers know neither the simulation nor what their readings are for": (
        "device.hardware.openscale",
        "device.simulation.faults",
    ),
    "The instrument leads a press on parts that are handed to it": (
        "device.instrument.press.capture",
        "device.hardware.camera",
    ),
    "Records keep, and know nobody who asks": ("device.records.store", "device.instrument.status"),
    "The hospital's formats read records, and know nothing of the instrument or the web": (
        "device.dicom.objects",
        "device.instrument.press.picture",
    ),
    "Notices read records, and know nothing of the instrument or the web": (
        "device.webhook.notifier",
        "device.instrument.status",
    ),
    "Sending knows neither what is sent nor to whom": ("device.sending.persistent_sender", "device.records.outbox"),
    "Exports read records and files, and know nothing of the instrument or the web": (
        "device.exports.archive",
        "device.instrument.status",
    ),
    "Only the exports print pages": ("device.web.app", "reportlab"),
    "Only the files and the toolkit write netCDF": ("device.web.app", "h5netcdf"),
    "Care saves and restores what lies on the disk, whether a daemon runs or not": (
        "device.care.support",
        "device.instrument.status",
    ),
    "Settings are read before any part is opened": ("device.settings.layers", "device.hardware.interfaces"),
    "Provisioning runs where nothing of the probe is installed yet": ("device.provisioning.plan", "device.errors"),
    "Access judges a request, and knows nothing that could answer it": (
        "device.access.request_rules",
        "device.web.problems",
    ),
    "An update knows errors, durable files and the number of the store's schema": (
        "device.update.fits",
        "device.records.store",
    ),
    "An update runs on a machine that has Python alone": ("device.files.durable", "numpy"),
    "The page that stands in for a daemon runs by Python alone": ("device.fallback.page", "pydantic"),
    "Access is judged by Python alone, for the fallback too": ("device.access.scopes", "numpy"),
    "The fallback runs when nothing else does": ("device.fallback.situation", "device.files.durable"),
    "The web shows what the instrument and the records say": ("device.web.app", "device.hardware.interfaces"),
    "A release is built from files alone: its builder knows nothing of the toolkit": (
        "host_tools.release.own_wheel",
        "host_tools.forward.plan",
    ),
    "Only the drivers touch hardware libraries": ("device.assembly.probe", "serial"),
    "Only the hospital's formats touch DICOM's libraries": ("device.web.dicom", "pydicom"),
    "Only the toolkit touches the workstation's libraries": ("device.assembly.probe", "scipy"),
    "The rooms of the device stand in one order, and a new one has its place": ("device.errors", "device.config"),
    "The rooms of the toolkit stand in one order, and a new one has its place": (
        "host_tools.forward.plan",
        "host_tools.scores.dial",
    ),
}


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph(*SETTINGS["root_packages"], include_external_packages=True)


def contract(entry: dict[str, Any]) -> Contract:
    """As `lint-imports` makes it; it reads TOML's booleans as words."""
    options = {k: str(v) if isinstance(v, bool) else v for k, v in entry.items() if k not in ("name", "type")}
    return KINDS[entry["type"]](name=entry["name"], session_options=SETTINGS, contract_options=options)


@pytest.mark.parametrize("name", CONTRACTS)
def test_a_contract_is_kept_and_breaks_at_what_it_forbids(graph: grimp.ImportGraph, name: str) -> None:
    importer, imported = FORBIDDEN[name]
    assert importer in graph.modules
    assert imported in graph.modules
    assert contract(CONTRACTS[name]).check(copy.deepcopy(graph), verbose=False).kept
    injected = copy.deepcopy(graph)
    injected.add_import(importer=importer, imported=imported, line_number=1, line_contents=f"import {imported}")
    assert not contract(CONTRACTS[name]).check(injected, verbose=False).kept


@pytest.mark.parametrize("program", ["device", "host_tools"])
def test_a_room_that_has_no_place_in_the_order_breaks_it(graph: grimp.ImportGraph, program: str) -> None:
    entry = next(e for e in SETTINGS["contracts"] if e.get("containers") == [program])
    injected = copy.deepcopy(graph)
    injected.add_module(f"{program}.loft")
    assert not contract(entry).check(injected, verbose=False).kept
