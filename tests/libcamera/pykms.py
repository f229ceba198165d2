"""Stands for the package pykms, which picamera2 imports for a display that the tests do not have."""


class PixelFormat:
    """Any name of a pixel format is None."""

    def __getattr__(self, name: str) -> None: ...


PixelFormat = PixelFormat()
