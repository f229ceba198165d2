"""What each thing alone costs in which a probe or its presses differ from what the models believe, in every mode.

Modules in reading order: `causes`, `tried_presses`, `press_answers`, `cost_figure`, `one_at_a_time`, `silent_errors`,
`solved_layers`, `solved_skins`, `uneven_tissue`, `named_blocks`, `known_tissue`, `other_tissue`; of everything at once
`held_presses`, of mode quick.

All is simulated; worlds of everything at once are in `foreign_probes`, and modes of ramps on them in `robustness`,
beside this room.
"""
