"""The light behind the virtual probe: reference ray tracer, the table made from it, and the camera frame of a scene.

Modules in reading order: `fresnel`, `height_field`, `ray`, `compiled`, `emission`, `block_events`,
`face_events`, `traced`, `tracer`, `build_lookup`, `other_light`, `frame`.

No finite elements: deformation and pressure are handed in.
"""
