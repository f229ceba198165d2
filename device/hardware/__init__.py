"""Drivers: the only room that imports smbus2, picamera2, serial and gpiod.

Modules in reading order: `interfaces`, `i2c_chip`, `led_driver`, `tlc59116`, `pca9685`, `enabled_lights`,
`enable_line`, `light_keeper`, `camera`, `frame_ring`, `camera_worker`, `camera_process`, `restart_limit`, `load_cell`,
`cell_line`, `openscale`, `mantracourt`, `computer`.

No simulation and no procedure: a driver cannot know what lies below its bus, nor what its readings are for.
"""
