"""The frames of one press, and what all modes make of them: a corrected image, and its means on rings.

Modules in reading order: `recording`, `led_sides`, `pixel_scale`, `camera_geometry`, `tactile_image`,
`reference_light`, `frame_light`, `ring_means`, `untouched_face`, `flat_field_error`.

Nothing of a single mode or model.
"""
