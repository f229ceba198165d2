"""A scene: probe, tissue, inclusion and press, in memory and as a TOML file.

Modules in reading order: `scene`, `scene_file`.

No solver: a scene says what there is, not how it is modelled.
"""
