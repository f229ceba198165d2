"""What the computer says is told once, however short it was; one that says nothing, or hangs, disturbs nobody."""

from __future__ import annotations

import threading

from device.errors import ClockJumpError
from device.hardware.interfaces import ComputerState
from device.instrument.watch.computer_watch import ComputerWatch

FINE = ComputerState(is_supply_low=False, temperature_c=79.9)


class TalkingComputer:
    """Says one state after the other, then is fine; `asked` is set once all are said."""

    def __init__(self, *states: ComputerState) -> None:
        self._states, self.asked = list(states), threading.Event()

    def read(self) -> ComputerState:
        if not self._states:
            self.asked.set()
            return FINE
        return self._states.pop(0)


def codes(watch: ComputerWatch) -> list[str]:
    return [warning.code for warning in watch.taken()]


def test_a_low_voltage_between_two_looks_of_the_procedure_is_told_once() -> None:
    watch = ComputerWatch(TalkingComputer(FINE, ComputerState(True, 50.0), FINE))
    for _ in range(3):
        watch.look()
    assert codes(watch) == ["E015"]
    assert codes(watch) == []


def test_a_voltage_that_stays_low_is_told_again() -> None:
    watch = ComputerWatch(TalkingComputer(*[ComputerState(True, 50.0)] * 2))
    watch.look()
    [first] = watch.taken()
    watch.look()
    [second] = watch.taken()
    assert first.as_record() == second.as_record()  # so that a press that has told of it need not again


def test_a_computer_is_hot_from_80_degrees_on_and_says_how_hot() -> None:
    watch = ComputerWatch(TalkingComputer(ComputerState(False, 80.0), ComputerState(False, 86.2)))
    watch.look()
    [warning] = watch.taken()
    assert (warning.code, "at 80 degrees or more" in warning.cause) == ("E016", True)
    watch.look()
    assert "at 85 degrees or more" in watch.taken()[0].cause


def test_a_cool_computer_and_one_that_says_nothing_are_not_warned_of() -> None:
    watch = ComputerWatch(TalkingComputer(FINE, ComputerState()))
    watch.look()
    watch.look()
    assert watch.taken() == ()


def test_it_looks_by_itself_until_it_is_closed() -> None:
    computer = TalkingComputer(ComputerState(True, 90.0))
    watch = ComputerWatch(computer)
    watch.start()
    assert computer.asked.wait(10.0)  # so it has looked twice
    watch.close()
    assert sorted(codes(watch)) == ["E015", "E016"]


def test_a_look_that_hangs_keeps_nobody_waiting() -> None:
    reading, let_go = threading.Event(), threading.Event()

    class HangingComputer:
        def read(self) -> ComputerState:
            reading.set()
            let_go.wait()
            return FINE

    watch = ComputerWatch(HangingComputer())
    watch.start()
    assert reading.wait(10.0)
    assert watch.taken() == ()
    watch.close()
    let_go.set()


def test_a_date_that_nothing_has_set_is_told_until_something_has() -> None:
    """A time server may answer half a minute after the start: then it is taken off, and all else stays."""
    watch = ComputerWatch(TalkingComputer(*[ComputerState(is_clock_set=False)] * 2, ComputerState(is_clock_set=True)))
    other, shown, told = ClockJumpError("It was set.", "Look."), (), []
    for _ in range(3):
        watch.look()
        shown = watch.warned(shown if shown else (*shown, other))
        told.append([one.code for one in shown])
    assert told == [["E701", "E702"], ["E701", "E702"], ["E701"]]
