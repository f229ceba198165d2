"""What there is: scene, probe and phantoms, in memory and as TOML files.

Modules in reading order: `scene`, `scene_file`, `light_block`, `stated`, `probe`, `probe_file`, `probe_scene`,
`phantom_set`.

No solver: a scene says what there is, not how it is modelled.
"""
