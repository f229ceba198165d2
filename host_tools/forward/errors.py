"""What can go wrong while a scene is solved, as opposed to a scene that cannot exist."""


class PressFailed(RuntimeError):  # noqa: N818 - reads as what it says
    """A press that no solution was found for; says how far it got and what to do."""
