"""What there is to see at one moment of the wizard, whoever draws it."""

from dataclasses import dataclass

from lobstr_hw.trackers import TrackerRole

__all__ = ["Bar", "DeviceRow", "View"]


@dataclass(frozen=True, slots=True)
class Bar:
    """One quality.

    Attributes:
        name: of it.
        share: 0 (hopeless) to 1 (perfect); half is the limit.
        ok: good enough.
        value: in words.
    """

    name: str
    share: float
    ok: bool
    value: str


@dataclass(frozen=True, slots=True)
class DeviceRow:
    """One device, by the number under which a person may name it."""

    number: int
    serial: str
    kind: str
    role: TrackerRole | None
    in_sight: bool
    battery: float | None


@dataclass(frozen=True, slots=True)
class View:
    """The whole screen.

    Attributes:
        title: of the step.
        position: which step of how many, from 1.
        instruction: what to do now.
        advice: what is wrong or could be better; empty if nothing.
        bars: qualities, live.
        devices: rows, where the step is about them.
        progress: 0 to 1 of the step, or None.
        countdown_s: until the step begins, or None.
        keys: what the keyboard does.
        heard: the newest words that were spoken.
    """

    title: str
    position: tuple[int, int]
    instruction: str
    advice: str = ""
    bars: tuple[Bar, ...] = ()
    devices: tuple[DeviceRow, ...] = ()
    progress: float | None = None
    countdown_s: float | None = None
    keys: str = ""
    heard: str = ""
