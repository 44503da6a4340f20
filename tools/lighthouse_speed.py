"""How fast recordings are decoded and tracked, and what three trackers cost live.

    python tools/lighthouse_speed.py FILE... [--stations FOLDER] [--write docs/results.md]

What ``lobstr-bench lighthouse`` prints, as a section of the results. FOLDER may hold NAME.json for
recordings whose stations were solved before (lobstr-log import --save-stations).
"""

import argparse
import datetime
from pathlib import Path

from results_page import write_section

from lobstr_hw.runtime.commands.bench_lighthouse import HEAD, measure, measure_live

HEADING = "## Lighthouse: speed"
TEXT = """\
CPU time of one process on two shared cores; the yardstick is 20,000 products of 3x3 matrices in
numpy, timed in between (on a busy machine all takes up to twice as long). Decoded: file to angles.
Tracked: file to poses, decoding included, in batches of 12 ms as live. Asked: three devices with
two stations in real time on at most 40 % of one core; libsurvive (in C) does 15,000 to 44,000
events per second tracked, 80,000 to 116,000 decoded."""


def main() -> None:
    """Print the section, write it where asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", type=Path, nargs="*", metavar="FILE")
    parser.add_argument("--stations", type=Path, metavar="FOLDER")
    parser.add_argument("--seconds", type=float, default=8.0, help="of the made room (8)")
    parser.add_argument("--write", type=Path, help="a file with such a section, to be replaced")
    asked = parser.parse_args()
    rows = [row.line() for row in measure([], None, asked.seconds)]
    print(rows[0], flush=True)
    for path in asked.files:
        known = asked.stations / f"{path.name.split('.')[0]}.json" if asked.stations else None
        *_, row = measure([path], known if known and known.exists() else None, 0.2)
        rows.append(row.line())
        print(rows[-1], flush=True)
    live = f"L{measure_live(asked.seconds).line()}".replace("Lthree", "Three") + "."
    names = " ".join(path.name for path in asked.files)
    command = f"`python tools/lighthouse_speed.py {names}`, {datetime.date.today()}."
    text = "\n".join([HEADING, "", TEXT, "", command, "", HEAD, *rows, "", live])
    print(live)
    if asked.write is not None:
        write_section(text, asked.write)


if __name__ == "__main__":
    main()
