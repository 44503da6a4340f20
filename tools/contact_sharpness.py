"""How sharp the truth of a contact is: what other labels, and labels told late, would score.

    python tools/contact_sharpness.py DATA [--part test] [--write]

DATA is the folder with one folder per set. Balanced accuracy against the labels that everything is
scored by. With --write the section is put into docs/results.md, else it is printed.
"""

import argparse
import datetime
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
from results_page import write_section
from split_clips import truths

from lobstr_hw.contact_labels import HEIGHT_M, SPEED_M_S, contact_labels
from lobstr_hw.evaluation.truth import Truth
from lobstr_hw.training.dataset import RATE_HZ

Bools = npt.NDArray[np.bool_]

OTHERS = ((0.02, 0.25), (0.04, 0.25), (0.03, 0.2), (0.03, 0.3))
LATE_FRAMES = (1, 2, 3)
AIM = "The network's aim, 94 %, is every contact right and told between one and two frames late."


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--part", default="test")
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    rows = _rows(list(truths(args.data, args.part)))
    text = "\n".join([_head(args.part), *rows, "", AIM])
    print(text)
    if args.write:
        write_section(text)
    return 0


def _head(part: str) -> str:
    date = datetime.datetime.now(tz=datetime.UTC).date()
    return f"""## How sharp a contact is

`python tools/contact_sharpness.py DATA --part {part}`, {date}: the balanced accuracy that other
labels of the same true feet would have against the labels that everything is scored by
({100 * HEIGHT_M:g} cm over the local floor, {100 * SPEED_M_S:g} cm/s), and these labels themselves,
told late.

| | balanced % |
|---|---|"""


def _rows(clips: list[Truth]) -> Iterator[str]:
    truth = [clip.contact for clip in clips]
    for height_m, speed_m_s in OTHERS:
        labels = [contact_labels(c.p_toes, RATE_HZ, height_m, speed_m_s) for c in clips]
        name = f"under {100 * height_m:g} cm and {100 * speed_m_s:g} cm/s"
        yield _row(name, _balanced(labels, truth))
    for frames in LATE_FRAMES:
        late = [labels[:-frames] for labels in truth]
        on_time = [labels[frames:] for labels in truth]
        name = f"told {1e3 * frames / RATE_HZ:.0f} ms late"
        yield _row(name, _balanced(late, on_time))


def _row(name: str, share: float) -> str:
    return f"| {name} | {100.0 * share:.1f} |"


def _balanced(said: list[Bools], truth: list[Bools]) -> float:
    """The mean of both recalls over all feet and frames."""
    a, b = np.concatenate(said), np.concatenate(truth)
    return float(0.5 * ((a & b).sum() / b.sum() + (~a & ~b).sum() / (~b).sum()))


if __name__ == "__main__":
    raise SystemExit(main())
