"""What accuracy costs: each part's choices as points of time and error, measured in one run, and their Pareto fronts.

Modules in reading order: `yardstick`, `pareto`, `fronts`, `forward_models`,
`tolerance_times`, `light_models`, `press_frames`, `press_networks`, `press_modes`.

Public functions of other rooms are timed as they are; nothing is made faster or chosen here.
"""
