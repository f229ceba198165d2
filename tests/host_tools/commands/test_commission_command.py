"""What `host_tools commission` says of what it was made of."""

from types import SimpleNamespace

import numpy as np

from host_tools.calibration.gates import identity_of
from host_tools.commands.calibrate import _hashes


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
