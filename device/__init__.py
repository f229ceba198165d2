"""The probe's daemon: light, camera and force in; size, depth and Young's modulus out.

Modules in reading order: `config`, `config_chips`, `errors`, `fault_table`.

Rooms in the order of a press: `commands` (a verb a file), `assembly` (opens the parts), `hardware` (drivers),
`simulation` (what stands below them when nothing is there), `instrument` (leads the press), `measurement` (what it
means), `records` (keeps it), `access` (who may ask), `web` (shows it), `fallback` (shows why it does not run);
`provisioning` makes a fresh system a probe, `update` exchanges its software, `care` saves and restores it all;
`settings` and `files` serve them all. Nothing here imports `host_tools`.
"""

__version__ = "0.1.0"
