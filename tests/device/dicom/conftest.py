"""Fixtures of the hospital's formats."""

from dicom_sockets import no_sockets_left as no_sockets_left
