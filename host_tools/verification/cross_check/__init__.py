"""The same scene solved by programs that share no code with ours: CalculiX and Mitsuba, in subprocesses.

Modules in reading order: `section`, `blocks`, `revolved_mesh`, `calculix_deck`, `calculix`, `mitsuba_scene`,
`mitsuba`, `mitsuba_render`.

No result is judged here.
"""
