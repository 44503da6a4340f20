"""From the T-pose's checks to the bars that a person sees."""

from collections.abc import Mapping, Sequence

from lobstr_hw.calibration import Check, TPoseQuality
from lobstr_hw.runtime.wizard.view import Bar

__all__ = ["quality_bars", "worst_advice"]

GROUPS: Mapping[str, tuple[str, ...]] = {
    "stillness": ("still", "steady"),
    "arms out": ("wide", "centred", "in line"),
    "level": ("raised", "lowered", "level"),
    "heading": ("facing",),
    "upright": ("standing", "hips below", "hips height"),
}
"""Bar -> the checks behind it; a check that is in none of them gets a bar of its own."""


def quality_bars(quality: TPoseQuality | None) -> tuple[Bar, ...]:
    """One bar a group: as good as the worst of its checks."""
    if quality is None:
        return tuple(Bar(name, 0.0, False, "") for name in GROUPS)
    checks = {check.name: check for check in quality.checks}
    groups = {name: [checks.pop(n) for n in names if n in checks] for name, names in GROUPS.items()}
    groups |= {name: [check] for name, check in checks.items()}
    return tuple(_bar(name, group) for name, group in groups.items() if group)


def _bar(name: str, checks: Sequence[Check]) -> Bar:
    worst = min(checks, key=_share)
    return Bar(name, _share(worst), all(check.ok for check in checks), _words(worst))


def _words(check: Check) -> str:
    """The number, and what was wanted where it is out of its range."""
    if check.unit:
        value, low, high, unit = check.value, check.low, check.high, f" {check.unit}"
    else:  # a share of the headset's height
        value, low, high = (100.0 * x for x in (check.value, check.low, check.high))
        unit = " % of eye height"
    digits = 2 if check.unit == "m" else 0
    words = f"{check.name} {value:.{digits}f}{unit}"
    return words if check.ok else f"{words}, wanted {low:.{digits}f} to {high:.{digits}f}"


def _share(check: Check) -> float:
    """1 in the middle of a range, or at 0 where it begins there; half at its limits."""
    middle = 0.0 if check.low == 0.0 else (check.low + check.high) / 2.0
    off = abs(check.value - middle) / (check.high - middle)
    return max(0.0, 1.0 - 0.5 * off)


def worst_advice(quality: TPoseQuality | None) -> str:
    """What to do about the check that is farthest out; empty if all are in."""
    if quality is None or quality.ok:
        return ""
    return max(quality.failed, key=lambda check: check.excess).advice
