"""One frame under known light and force, and whether it may be trusted.

Modules in reading order: `bench`, `force_recorder`, `frame_check`, `frame_level`, `light_check`, `brightness_loop`,
`light_budget`, `load_limit`, `frame_quality`.

Nothing of a press's course but the window in which its force must be steady: what a frame is for is decided in
`device.instrument.press`.
"""
