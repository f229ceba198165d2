"""One press: its states, the frames that count, and what it leaves behind.

Modules in reading order: `states`, `machine`, `requests`, `capture`, `frame_choice`, `frame_outliers`,
`inclusion_spot`, `encoded_frames`, `remembered_ramps`, `scan`, `probe_answers`, `record`, `picture`, `phantom_press`,
`cost`.

No light and no load cell of its own: it asks the bench.
"""
