"""Fixtures of the hospital's formats: a store, what is to be sent of it, and an archive that answers as it is told."""

import pytest
from dicom_sockets import no_sockets_left as no_sockets_left
from dicom_sockets import no_sockets_left_of_file as no_sockets_left_of_file
from stand_in_archive import StandInArchive

from device.dicom.objects import DicomWriter
from device.dicom.outgoing import Outgoing
from device.files.recording_file import read_picture
from device.records.store import Store


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


@pytest.fixture
def outgoing(store):
    return Outgoing(store, DicomWriter(store, read_picture), with_phantoms=False)


@pytest.fixture
def archive():
    """A module whose archive is another program has its own of that name."""
    running = StandInArchive()
    yield running
    running.close()
