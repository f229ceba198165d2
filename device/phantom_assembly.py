"""Opens a probe for presses on phantoms: as the daemon does, but without model and certificate."""

from __future__ import annotations

from device.assembly import OpenedProbe, open_real, open_simulated
from device.config import Config
from device.instrument.phantom_press import PhantomPress
from device.instrument.progress import ProgressBoard
from device.simulation.scenario import Scenario


def open_phantom_press(config: Config, scenario: Scenario | None) -> PhantomPress:
    """Return presses of the real probe, or of the virtual one on a scene.

    Raises `StartFailed` with every part that failed.
    """
    return open_simulated(config, scenario, _phantom_press) if scenario else open_real(config, _phantom_press)


def _phantom_press(probe: OpenedProbe) -> PhantomPress:
    progress = ProgressBoard()
    force, store = probe.force(progress), probe.store()
    bench = probe.bench(force, progress)
    assert store is not None  # or there were no bench
    is_simulated = probe.scenario is not None
    return PhantomPress(
        probe.config, bench, store, clock=probe.clock, opened=probe.parts.opened, simulated=is_simulated
    )
