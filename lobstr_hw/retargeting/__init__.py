"""Motion clips of any common rig, brought to the standard skeleton (docs/retargeting.md)."""

from lobstr_hw.retargeting.clips import ClipFile, Fault, find_clips, own_faults, read_faults
from lobstr_hw.retargeting.retarget import RATE_HZ, Note, retarget

__all__ = [
    "RATE_HZ",
    "ClipFile",
    "Fault",
    "Note",
    "find_clips",
    "own_faults",
    "read_faults",
    "retarget",
]
