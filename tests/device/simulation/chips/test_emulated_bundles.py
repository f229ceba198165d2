"""An installed model with one bit of its network changed is refused; what is installed stays as it is."""

import pytest
from daemon_process import ROOT

from device.files.bundle_file import read_paper_model
from device.measurement.bundle import BundleRefused
from device.simulation.chips.emulated_storage import EmulatedBundles
from device.simulation.faults import NO_FAULTS, FaultTimeline, ScriptedFault

PAPER = ROOT / "models" / "paper"


def test_without_the_fault_the_installed_folder_is_read(tmp_path):
    assert EmulatedBundles(NO_FAULTS, tmp_path).folder(PAPER) == PAPER


def test_a_tampered_bundle_is_refused_for_its_hash_and_the_installed_one_is_not(tmp_path):
    bundles = EmulatedBundles(FaultTimeline([ScriptedFault("bundle_tampered")]), tmp_path)
    with pytest.raises(BundleRefused, match=r"sha256 of model\.onnx"):
        read_paper_model(bundles.folder(PAPER))
    assert read_paper_model(PAPER).name == read_paper_model(PAPER).card["name"]


def test_a_model_that_is_not_installed_stays_away(tmp_path):
    bundles = EmulatedBundles(FaultTimeline([ScriptedFault("bundle_tampered")]), tmp_path)
    assert not bundles.folder(tmp_path / "none").exists()
