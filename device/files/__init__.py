"""What stands on the disk: files that are whole or not there, and the formats that other programs read.

Modules in reading order: `shipped`, `durable`, `medium`, `file_reader`, `handed_over`, `plain_settings`, `start_note`,
`screen_choices`, `toml_record`, `recording_file`, `phantoms_file`, `bundle_file`, `certificate_file`, `table_file`,
`text_table`, `netcdf_file`.

No physics and no hardware; of ours it imports `device.measurement` only.
"""
