"""Stands in the place of picamera2 on a machine without a camera: frames of the world at $TSIS_RIG_CAMERA."""

import os

from device.simulation.chips.remote_camera import RemotePicamera2


class Picamera2(RemotePicamera2):
    """The board's camera of any number."""

    def __init__(self, camera_num: int = 0) -> None:
        super().__init__(os.environ["TSIS_RIG_CAMERA"])
