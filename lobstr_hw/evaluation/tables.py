"""Scores of clips, folders and all of them, as one document or as a table for people."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lobstr_hw.evaluation.metrics import Scores, Tally
from lobstr_hw.splits import clip_name

__all__ = ["COLUMNS", "ClipResult", "document", "markdown_row", "markdown_table", "total"]

COLUMNS = {
    "contact_accuracy": ("contact %", 100.0),
    "contact_balanced_accuracy": ("balanced %", 100.0),
    "contact_accuracy_1cm": ("1 cm label %", 100.0),
    "rotation_error_deg": ("rotation °", 1.0),
    "rotation_error_legs_deg": ("legs °", 1.0),
    "position_error_cm": ("toes cm", 1.0),
    "position_cost": ("toes + %", 100.0),
    "velocity_error_cm_s": ("velocity cm/s", 1.0),
    "skate_cm_s": ("skate cm/s", 1.0),
    "truth_skate_cm_s": ("true skate", 1.0),
    "held_skate_cm_s": ("held skate", 1.0),
    "jitter_ratio": ("jitter", 1.0),
    "penetration_cm": ("under floor cm", 1.0),
}
"""Key of the document -> heading of the table, and factor."""


@dataclass(frozen=True, slots=True)
class ClipResult:
    """What was counted over one clip, before and after lock, floor and IK."""

    name: str
    network: Tally
    after_ik: Tally

    @property
    def folder(self) -> str:
        """The set of the clip."""
        return clip_name(self.name).split("/")[0]

    def scores(self) -> dict[str, Scores]:
        """Of both; ``position_cost`` is the share of toe error that lock, floor and IK add."""
        before, after = self.network.scores(), self.after_ik.scores()
        return {
            "network": {**before, "position_cost": None},
            "after_ik": {**after, "position_cost": _added(before, after)},
        }


def total(results: Sequence[ClipResult]) -> ClipResult:
    """Of all clips together: each frame counts the same."""
    return ClipResult(
        "all",
        sum((r.network for r in results), Tally()),
        sum((r.after_ik for r in results), Tally()),
    )


def document(results: Sequence[ClipResult]) -> dict[str, Any]:
    """``{"all": {"network": ..., "after_ik": ...}, "folders": {...}, "clips": {...}}``."""
    folders = sorted({r.folder for r in results})
    return {
        "all": total(results).scores(),
        "folders": {f: total([r for r in results if r.folder == f]).scores() for f in folders},
        "clips": {r.name: r.scores() for r in results},
    }


def _added(before: Scores, after: Scores) -> float | None:
    was, now = before["position_error_cm"], after["position_error_cm"]
    return now / was - 1.0 if now is not None and was else None


def markdown_row(label: str, scores: Mapping[str, float | int | None]) -> str:
    """One line of the table."""
    cells = []
    for key, (_, factor) in COLUMNS.items():
        value = scores.get(key)
        cells.append("-" if value is None else f"{factor * value:.2f}")
    return f"| {label} | " + " | ".join(cells) + " |"


def markdown_table(rows: Sequence[tuple[str, Mapping[str, float | int | None]]]) -> str:
    """The whole table."""
    head = "| | " + " | ".join(heading for heading, _ in COLUMNS.values()) + " |"
    rule = "|---" * (len(COLUMNS) + 1) + "|"
    return "\n".join([head, rule, *(markdown_row(label, scores) for label, scores in rows)])
