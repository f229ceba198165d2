"""Signed updates that cannot brick the probe: verify, unpack beside, switch, watch, then commit or come back.

Modules in reading order: `layout`, `manifest`, `signature`, `release_file`, `wheel`, `contents`, `unpack`, `state`,
`progress`, `fits`, `services`, `gate`, `trial`, `install`, `boot_check`, `incoming`, `follow`.

Standard library only: it checks the boot when the packages of a release are broken, and on a fresh system it runs from
the wheel itself. Of ours it imports errors, durable files and the number of the store's schema.
"""
