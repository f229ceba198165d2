"""Makes a fresh Raspberry Pi OS a probe: a list of items, each of which says what differs and can put it right.

Modules in reading order: `target`, `item`, `plan`, `packages`, `accounts`, `boot_files`, `identity`, `installation`.

Applying all items twice is as applying them once, and `--check` only tells. Standard library only, and of ours
`device.files.durable`: it runs on a fresh machine from the wheel of a release file (`PYTHONPATH=WHEEL python3 -m
device.provisioning`), before anything of the probe is installed.
"""
