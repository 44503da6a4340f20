"""Buttons become commands only when they are meant so."""

import itertools

import pytest

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.runtime.gestures import HOLD_S, Command, Gestures
from lobstr_hw.trackers import TrackerRole

ROLES = {"L": TrackerRole.LEFT_HAND, "R": TrackerRole.RIGHT_HAND, "P": TrackerRole.PELVIS}
DOWN, UP = EventKind.BUTTON_DOWN, EventKind.BUTTON_UP
LONG = HOLD_S + 0.1

Happening = tuple[float, EventKind, str, str]
Done = list[tuple[float, Command]]


def played(*events: Happening, until_s: float = 10.0) -> Done:
    """Commands with their times when these events come, looked at 45 times a second."""
    gestures = Gestures(ROLES.get)
    left = sorted(events, key=lambda event: event[0])
    done: Done = []
    for k in range(int(until_s * 45)):
        now_s = k / 45.0
        due = [DeviceEvent(kind, who, at, name) for at, kind, who, name in left if at <= now_s]
        left = [event for event in left if event[0] > now_s]
        done += [(now_s, command) for command in gestures.add(now_s, due)]
    return done


def hold(who: str, button: str, start: float, end: float) -> list[Happening]:
    return [(start, DOWN, who, button), (end, UP, who, button)]


def names(done: Done) -> list[Command]:
    return [command for _, command in done]


@pytest.mark.parametrize(
    ("button", "command"), [("trigger", Command.HEADING), ("grip", Command.FREEZE)]
)
def test_held_in_both_hands_it_counts_once(button: str, command: Command) -> None:
    done = played(*hold("L", button, 1.0, 8.0), *hold("R", button, 1.4, 8.0))
    ((at, what),) = done
    assert what is command
    assert at == pytest.approx(1.4 + HOLD_S, abs=1 / 45)


@pytest.mark.parametrize("button", ["trigger", "grip"])
@pytest.mark.parametrize("who", ["L", "R"])
def test_one_hand_is_not_enough_however_long(button: str, who: str) -> None:
    assert not played(*hold(who, button, 1.0, 9.0))


@pytest.mark.parametrize("button", ["trigger", "grip", "menu"])
def test_short_presses_do_nothing_however_many(button: str) -> None:
    presses = [
        event
        for k, who in itertools.product(range(12), "LR")
        for event in hold(who, button, 0.5 + 0.7 * k, 0.5 + 0.7 * k + 0.4)
    ]
    assert not played(*presses)


def test_held_again_it_counts_again() -> None:
    twice = [
        event
        for start in (1.0, 4.0)
        for who in "LR"
        for event in hold(who, "grip", start, start + LONG)
    ]
    assert names(played(*twice)) == [Command.FREEZE] * 2


@pytest.mark.parametrize("who", ["L", "R"])
@pytest.mark.parametrize("button", ["menu", "b"])
def test_menu_or_b_of_either_hand_sits(who: str, button: str) -> None:
    assert names(played(*hold(who, button, 1.0, 1.0 + LONG))) == [Command.SEAT]


@pytest.mark.parametrize(("who", "command"), [("R", Command.UP), ("L", Command.DOWN)])
def test_grip_and_menu_of_one_hand_nudge_at_once_and_never_sit(who: str, command: Command) -> None:
    done = played(*hold(who, "grip", 1.0, 8.0), *hold(who, "menu", 2.0, 5.0))
    assert names(done) == [command]
    assert done[0][0] == pytest.approx(2.0, abs=1 / 45)


def test_every_press_of_menu_nudges_again_while_the_grip_is_held() -> None:
    presses = [event for k in range(3) for event in hold("R", "menu", 2.0 + k, 2.3 + k)]
    assert names(played(*hold("R", "grip", 1.0, 9.0), *presses)) == [Command.UP] * 3


def test_buttons_of_other_devices_do_nothing() -> None:
    events = [e for who in ("P", "?") for e in hold(who, "trigger", 1.0, 9.0)]
    assert not played(*events, *hold("P", "menu", 1.0, 9.0))


def test_a_controller_that_vanishes_lets_go() -> None:
    events = [*hold("L", "trigger", 1.0, 9.0), *hold("R", "trigger", 1.0, 9.0)]
    assert not played(*events, (1.5, EventKind.GONE, "R", ""))


@pytest.mark.parametrize("command", Command)
def test_other_programs_may_ask_for_everything_by_name(command: Command) -> None:
    assert names(played((1.0, EventKind.COMMAND, "", str(command)))) == [command]


def test_unknown_words_are_left_alone() -> None:
    assert not played((1.0, EventKind.COMMAND, "", "explode"), (1.0, EventKind.BACK, "L", ""))
