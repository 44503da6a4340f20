"""Running the wizard: on a log as fast as it can be read, or with a person in front of it."""

from collections.abc import Callable, Sequence
from typing import Protocol

from lobstr_hw.drivers.driver import TrackerDriver
from lobstr_hw.drivers.replay import ReplayDriver
from lobstr_hw.errors import CalibrationError
from lobstr_hw.runtime.announcer import Spoken
from lobstr_hw.runtime.clock import Clock
from lobstr_hw.runtime.notices import notices
from lobstr_hw.runtime.wizard.flow import Wizard
from lobstr_hw.runtime.wizard.view import View

__all__ = ["Front", "run_on_log", "run_with_person"]

LOG_STEP_S = 0.1
TURN_S = 1.0 / 30.0


class Front(Protocol):
    """What stands between the wizard and a person."""

    def keys(self) -> str:
        """Keys pressed since the last call."""
        ...

    def show(self, view: View) -> None:
        """Put this on the screen."""
        ...

    def say(self, spoken: Sequence[Spoken]) -> None:
        """Say these together."""
        ...


def run_on_log(
    log: ReplayDriver,
    wizard: Wizard,
    stop: Callable[[], bool],
    world: TrackerDriver | None = None,
) -> None:
    """Go through an open log until the wizard is done, or is told to stop.

    Args:
        log: knows when it is over.
        wizard: looks at it.
        stop: asks for the end.
        world: the same log with its samples in one space; the log itself where None.

    Raises:
        CalibrationError: the log ended before it was done; says what was missing.
    """
    driver, turn = world or log, 0
    while not (wizard.done or stop()):
        now_s = turn * LOG_STEP_S
        wizard.add(now_s, driver.poll(now_s), driver.events(), driver.devices())
        if log.finished(now_s):
            wizard.end()
        if wizard.refused or (log.finished(now_s) and not wizard.done):
            raise wizard.failure()
        turn += 1


def run_with_person(
    driver: TrackerDriver,
    wizard: Wizard,
    front: Front,
    clock: Clock,
    stop: Callable[[], bool],
    timeout_s: float | None = None,
) -> None:
    """Go on until the wizard is done, the person stops it, or the time is over.

    Raises:
        CalibrationError: the time is over, or no try was right; says what was missing.
    """
    began_s = clock.now_s()
    while not (wizard.done or wizard.stopped or stop()):
        now_s = clock.now_s()
        if timeout_s is not None and now_s - began_s > timeout_s:
            raise CalibrationError(f"not done within {timeout_s:g} s: {wizard.failure()}")
        samples, events = driver.poll(now_s), driver.events()
        said = [Spoken(words) for words in notices(events)]
        said += wizard.add(now_s, samples, events, driver.devices())
        for key in front.keys():
            said += wizard.press(key)
        front.say(said)
        front.show(wizard.view())
        if wizard.refused:
            raise wizard.failure()
        clock.sleep(now_s + TURN_S - clock.now_s())
