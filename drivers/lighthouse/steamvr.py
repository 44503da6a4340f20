"""Whether SteamVR runs: it holds the same devices, and a change of their mode would disturb it.

HID devices can be opened twice on every system, so nothing else would keep the two apart.
"""

import subprocess
import sys
from contextlib import suppress
from pathlib import Path

__all__ = ["steamvr_runs"]

SERVER = "vrserver"
ANSWER_S = 5.0
LIST_TASKS = ("tasklist", "/FI", f"IMAGENAME eq {SERVER}.exe", "/NH")


def steamvr_runs(proc: Path = Path("/proc")) -> bool:
    """True when its server is among the processes; False also where that cannot be found out."""
    if sys.platform == "win32":
        with suppress(OSError, subprocess.SubprocessError):
            told = subprocess.run(LIST_TASKS, capture_output=True, text=True, timeout=ANSWER_S)
            return SERVER in told.stdout
        return False
    for path in proc.glob("[0-9]*/comm"):
        with suppress(OSError):  # it ended meanwhile
            if path.read_text(encoding="utf-8", errors="replace").strip() == SERVER:
                return True
    return False
