"""What `host_tools commission` says of what it was made of."""

import shlex
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import typer

from device.files.shipped import SIMULATED_PROBE
from device.measurement.quantities import InvalidQuantity
from host_tools.__main__ import app
from host_tools.calibration.gates import identity_of
from host_tools.commands import commission
from host_tools.commands.commission import CommissioningOrder, _hashes
from host_tools.commissioning import own_bundle
from host_tools.paper_network.export_refused import ExportRefused

ORDER = CommissioningOrder(
    recordings=(Path("ramps/A 1.zip"), Path("ramps/B2.zip")),
    probe=Path("my probe.toml"),
    phantoms=Path("phantoms.toml"),
    out=Path("models/TSIS-0007"),
    design=Path("models/standard"),
    table=Path("tables"),
    valid_days=90.0,
    seed=4,
    operator="A. Maker",
    quick_design=Path("models/other quick"),
)


@pytest.mark.parametrize(
    "order", [ORDER, replace(ORDER, operator="", quick_design=None, certificate=False)], ids=["all", "least"]
)
def test_the_command_that_is_kept_asks_for_the_same_again(order):
    program, verb, *words = shlex.split(order.command)
    asked = typer.main.get_command(app).commands[verb].make_context(verb, words).params
    asked["quick_design"] = asked["quick_design"] if asked["quick"] else None
    again = {name: asked[name] for name in asdict(order)}
    assert program == "host_tools"
    assert CommissioningOrder(**{name: _read(value) for name, value in again.items()}) == order


def _read(value: object) -> object:
    """Return what typer makes of a path, which it makes only when it calls the verb."""
    if isinstance(value, str) and value != ORDER.operator and value:
        return Path(value)
    return tuple(map(Path, value)) if isinstance(value, list | tuple) else value


def test_a_commissioning_says_of_which_files_and_recordings_it_is(tmp_path):
    probe, phantoms = tmp_path / "probe.toml", tmp_path / "phantoms.toml"
    probe.write_text('serial = "TSIS-0007"\n')
    phantoms.write_text('serial = "PH-7"\n')
    frames = [SimpleNamespace(counts=np.full((2, 2), counts, np.uint8)) for counts in (4, 90)]
    recording = SimpleNamespace(id="r-1", started_at="2027-01-01T00:00:00Z", frames=frames)
    told = _hashes(SimpleNamespace(names=["A1"], recordings=[recording]), probe, phantoms)
    assert told["recordings"] == [
        {
            "name": "A1",
            "id": "r-1",
            "started_at": "2027-01-01T00:00:00Z",
            "last_frame_sha256": identity_of(recording),
        }
    ]
    before = told["probe_file_sha256"], told["phantoms_file_sha256"]
    probe.write_text('serial = "TSIS-0008"\n')
    again = _hashes(SimpleNamespace(names=[], recordings=[]), probe, phantoms)
    assert again["probe_file_sha256"] != before[0]
    assert (again["phantoms_file_sha256"], len(before[1])) == (before[1], 64)


@pytest.fixture
def order(tmp_path, monkeypatch):
    """An order whose bundles are a file each, without computing anything."""

    def bundle(found, design, folder, **stated):
        folder.mkdir()
        (folder / "model.json").write_text(folder.name)

    def quick(made, ramps):
        if made == "refused":
            raise ExportRefused("spread of the exported network differs")
        bundle(None, None, own_bundle.quick_folder(ramps))

    monkeypatch.setattr(own_bundle, "write_own_bundle", bundle)
    monkeypatch.setattr(own_bundle, "write_own_quick", quick)
    monkeypatch.setattr(commission, "_hashes", lambda bench, probe, phantoms: {})
    return replace(ORDER, out=tmp_path / "models" / "TSIS-0007", table=SIMULATED_PROBE)


def made_with(own_quick):
    bench = SimpleNamespace(
        phantoms=SimpleNamespace(serial="PH-7", advice=list), probe=SimpleNamespace(serial="TSIS-0007"), recordings=[]
    )
    return SimpleNamespace(
        bench=bench,
        design="standard",
        found=SimpleNamespace(gates=[]),
        made_at=None,
        expires_at="",
        certificate=None,
        lacks=[InvalidQuantity("cell of A1", "missing", "slope and tare of the load cell", "record it again")],
        advice=[],
        own_quick=own_quick,
    )


def test_both_bundles_are_put_in_their_place(order):
    commission._write(order, made_with("trained"))
    folders = order.out, order.out.with_name("TSIS-0007-quick")
    assert [(folder / "model.json").read_text() for folder in folders] == [folder.name for folder in folders]
    assert sorted(order.out.parent.iterdir()) == sorted(folders)


def test_the_record_says_what_a_certificate_lacks(order):
    record = commission._record(order, made_with(None))
    assert record["certificate"] is None
    assert [one["quantity"] for one in record["lacks"]] == ["cell of A1"]


def test_without_mode_quick_there_is_one_bundle(order):
    commission._write(order, made_with(None))
    assert list(order.out.parent.iterdir()) == [order.out]


def test_a_refused_mode_quick_leaves_nothing_that_refuses_the_next_commissioning(order):
    with pytest.raises(ExportRefused):
        commission._write(order, made_with("refused"))
    assert list(order.out.parent.iterdir()) == []
    order.require_possible()
