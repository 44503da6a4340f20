"""Buttons of the controllers -> commands, for somebody who cannot reach a keyboard.

    both triggers held 1.5 s           heading: look straight ahead, hips too, while you hold them
    both grips held 1.5 s              freeze the body; again: go on
    menu held 1.5 s (either hand)      sit; again: stand
    grip held, same hand's menu        right: the body 2 cm up (feet too low); left: 2 cm down

Held, so that no game's own use of a button does anything here. A controller without a menu button
has its B (or Y).
"""

from collections.abc import Callable, Sequence
from enum import StrEnum

from lobstr_hw.drivers.driver import DeviceEvent, EventKind
from lobstr_hw.trackers import TrackerRole

__all__ = ["HOLD_S", "Command", "Gestures"]

HOLD_S = 1.5
_SAME = {"b": "menu"}
_LEFT, _RIGHT = TrackerRole.LEFT_HAND, TrackerRole.RIGHT_HAND


class Command(StrEnum):
    """What a person, or another program, wants."""

    HEADING = "recentre"
    FREEZE = "freeze"
    SEAT = "seat"
    UP = "up"
    DOWN = "down"
    T_POSE = "calibrate"
    READY = "calibrate_ready"


BOTH = {"trigger": Command.HEADING, "grip": Command.FREEZE}
"""Held in both hands."""


class Gestures:
    """Told of events, says which commands they make; time comes with the events."""

    def __init__(self, role_of: Callable[[str], TrackerRole | None]) -> None:
        """Begin with nothing pressed.

        Args:
            role_of: the role of a device; buttons of anything but the hands do nothing.
        """
        self._role_of = role_of
        self._down_s: dict[tuple[TrackerRole, str], float] = {}
        self._used: set[tuple[TrackerRole, str]] = set()

    def add(self, now_s: float, events: Sequence[DeviceEvent]) -> list[Command]:
        """Commands at this time, oldest first.

        Args:
            now_s: the time of this turn.
            events: since the last one, oldest first.
        """
        commands = [command for event in events for command in self._take(event)]
        return commands + self._held(now_s)

    def _take(self, event: DeviceEvent) -> list[Command]:
        if event.kind is EventKind.COMMAND:
            return [Command(event.name)] if event.name in set(Command) else []
        hand = self._role_of(event.serial)
        if hand not in (_LEFT, _RIGHT):
            return []
        if event.kind is EventKind.GONE:
            for key in [key for key in self._down_s if key[0] is hand]:
                self._release(key)
            return []
        key = (hand, _SAME.get(event.name, event.name))
        if event.kind is EventKind.BUTTON_UP:
            self._release(key)
        if event.kind is not EventKind.BUTTON_DOWN:
            return []
        self._down_s.setdefault(key, event.time_s)
        if key[1] == "menu" and (hand, "grip") in self._down_s:
            self._used.update({key, (hand, "grip")})
            return [Command.UP if hand is _RIGHT else Command.DOWN]
        return []

    def _release(self, key: tuple[TrackerRole, str]) -> None:
        self._down_s.pop(key, None)
        self._used.discard(key)

    def _held(self, now_s: float) -> list[Command]:
        """Each way of holding counts once, until it is let go of."""
        commands = []
        for button, command in BOTH.items():
            if self._fires(now_s, (_LEFT, button), (_RIGHT, button)):
                commands.append(command)
        for hand in (_LEFT, _RIGHT):
            if self._fires(now_s, (hand, "menu")):
                commands.append(Command.SEAT)
        return commands

    def _fires(self, now_s: float, *keys: tuple[TrackerRole, str]) -> bool:
        long = all(now_s - self._down_s.get(key, float("inf")) >= HOLD_S for key in keys)
        if not long or self._used & set(keys):
            return False
        self._used.update(keys)
        return True
