"""Where the motion data comes from and on what terms: weights carry it on their card."""

from collections.abc import Iterable

__all__ = ["SOURCES", "notices"]

_CMU = (
    "CMU Graphics Lab Motion Capture Database; free for research and commercial use. "
    "The data used in this project was obtained from mocap.cs.cmu.edu. "
    "The database was created with funding from NSF EIA-0196217."
)
SOURCES = {
    "snu_tiling_patch": "snumrl/TillingPatch, Apache-2.0",
    "snu_ys2010": "snumrl/ys2010, Apache-2.0",
    "snu_tiling_patch_mmk": "snumrl/TillingPatch, Apache-2.0",
    "snu_cmu69_cmu94": f"snumrl/InteractiveAnimation, Apache-2.0; motion: {_CMU}",
    "snu_tennis": "snumrl/InteractiveAnimation, Apache-2.0",
    "snu_vsports_basketball": "snumrl/VSports, Apache-2.0",
    "snu_martial_arts": "snumrl/TimeCriticalResponse, BSD-3-Clause, "
    "(c) 2020 NCSOFT Corporation & SNU R&D Foundation",
    "cmu02_asfamc": f"cyun9601/CMU-MOCAP-Data; {_CMU}",
    "cmu13_exercise": f"michaelchughes/mocap6dataset; {_CMU}",
    "cmu_01_08_09_11_55": f"facebookresearch/fairmotion and nv-tlabs/ASE; {_CMU}",
}
"""Folder of clips -> origin and licence."""


def notices(folders: Iterable[str]) -> dict[str, str]:
    """Origin and licence of each folder; one that is not known says so."""
    return {folder: SOURCES.get(folder, "not known to this project") for folder in folders}
