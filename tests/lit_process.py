"""Stands for a daemon in the middle of a press: lights all sides, says so, and waits to be killed."""

import sys
import time
from pathlib import Path

from device.hardware.led_driver import open_led_driver
from device.settings.layers import read_config

if __name__ == "__main__":
    open_led_driver(read_config(Path(sys.argv[1])).light).set_ratio((0.6, 0.6, 0.6, 0.6))
    print("lit", flush=True)
    time.sleep(600)
