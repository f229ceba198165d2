"""What the drivers meet when no hardware is there: registers, bytes of a line, frames, a disk, a computer.

Modules in reading order: `i2c_bus`, `light_history`, `tlc59116_chip`, `pca9685_chip`, `remote_line`,
`emulated_amplifier`, `openscale_line`, `mantracourt_line`, `frame_clock`, `virtual_camera`, `faulty_frames`,
`camera_server`, `remote_camera`, `emulated_storage`, `emulated_computer`.

No physics: a chip asks the virtual probe what there is to be read.
"""
