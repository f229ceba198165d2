"""What a solution states of its own error: two orders in, a relative error of force and O1-O3 out.

Modules in reading order: `feature_slopes`, `dual_error`, `stated_error`, `foretold_error`.

Nothing is solved here, and nothing known of the true answer comes in.
"""
