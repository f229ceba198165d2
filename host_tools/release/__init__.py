"""The workstation's half of an update: builds a release file, signs it, and brings it to a probe by ssh.

Modules in reading order: `checkout`, `own_wheel`, `target`, `lock`, `locked_wheels`, `parts_list`, `advisories`,
`signing`, `release_file`, `build`, `remote_machine`, `send`, `provisioning`.

Same commit, same bytes: what goes in comes from git and from requirements/device.lock, never from the machine that
builds. Nothing here runs on a probe; what a probe makes of a release file is in the device's own rooms.
"""
