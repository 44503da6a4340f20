"""Write the default split from the clips' names: python tools/make_split.py DATA OUT.

DATA is the folder with one folder per set, each with its manifest.csv, and faults.csv.
"""

import csv
import json
import re
import sys
from pathlib import Path

import numpy as np

SEED = 2026
SHARE = 0.1

WHY = {
    "train": "people whose sets' licences let the weights ship: the actor woody2 "
    "(snu_tiling_patch, snu_ys2010), CMU subjects 69 and 02, basketball sessions s_003, s_004 and "
    "s_007, and the fighters",
    "validation": "nobody of train: the tennis player Kang and basketball session s_006; choices "
    "are made and training is watched here",
    "test": "nobody of train or validation: the actor mmk, basketball session s_008, CMU subjects "
    "01, 08, 09, 11, 13, 55. Who played in which basketball session is not known beyond the "
    "session's name, so a player of s_008 may also stand in another session",
    "test_same_actor": "clips of training people, about a tenth, drawn by families of takes (seed "
    "2026) so that no neighbouring take of a held-out one is in train; both takes on a chair "
    "(1_chair, 1_chair_1), the only real sitting there is",
    "left_out": {
        "bandai_namco_1, bandai_namco_2": "CC BY-NC 4.0: never for weights that ship",
        "deepmimic": "where its captures come from is not named",
        "cmu05_06_07_iclone": "three subjects retargeted to the body of one rig: neither three "
        "people to train on nor clean enough to judge by",
        "CMU subject 94": "foreign skeleton, flips",
    },
}


def main() -> None:
    data, out = Path(sys.argv[1]), Path(sys.argv[2])
    clips = [clip for folder in sorted(data.iterdir()) for clip in _clips(folder)]
    bad = _left_out_by_faults(data / "faults.csv")
    clips = [clip for clip in clips if clip not in bad]
    parts = {part: [c for c in clips if _part(c) == part] for part in WHY if part != "left_out"}
    held_out = _held_out(parts["train"])
    parts["test_same_actor"] = [c for c in parts["train"] if c in held_out]
    parts["train"] = [c for c in parts["train"] if c not in held_out]
    text = json.dumps({"why": WHY, **parts}, indent=1)
    out.write_text(text + "\n", encoding="utf-8")


def _clips(folder: Path) -> list[str]:
    manifest = folder / "manifest.csv"
    if not manifest.is_file():
        return []
    with manifest.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [f"{folder.name}/{Path(row['file']).stem}" for row in rows if "clips" in row["file"]]


def _left_out_by_faults(path: Path) -> set[str]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {f"{r['set']}/{r['clip']}" for r in rows if r["action"] == "leave_out"}


def _part(name: str) -> str:
    folder, clip = name.split("/")
    if folder == "snu_vsports_basketball":
        session = clip[:5]
        return {"s_006": "validation", "s_008": "test"}.get(session, "train")
    if folder == "snu_cmu69_cmu94":
        return "train" if clip.startswith("69") else "left_out"
    return {
        "snu_tiling_patch": "train",
        "snu_ys2010": "train",
        "cmu02_asfamc": "train",
        "snu_martial_arts": "train",
        "snu_tennis": "validation",
        "snu_tiling_patch_mmk": "test",
        "cmu13_exercise": "test",
        "cmu_01_08_09_11_55": "test",
    }.get(folder, "left_out")


def _held_out(train: list[str]) -> set[str]:
    """About a tenth of the families of each group of takes, and the chair."""
    rng = np.random.default_rng(SEED)
    groups: dict[str, dict[str, list[str]]] = {}
    for name in train:
        group, family = _family(name)
        groups.setdefault(group, {}).setdefault(family, []).append(name)
    out = {name for name in train if "chair" in name}
    for group in sorted(groups):
        families = sorted(groups[group])
        n = max(1, round(SHARE * len(families)))
        for i in rng.choice(len(families), n, replace=False):
            out.update(groups[group][families[i]])
    return out


def _family(name: str) -> tuple[str, str]:
    """Group and family of a clip; takes of one family resemble each other too much to be parted."""
    folder, clip = name.split("/")
    if folder in ("snu_tiling_patch", "snu_ys2010"):
        # both sets are of one actor and may share takes: the same words are one family
        words = re.sub(r"^(\d_|.*w[od]*[dy]+2_|motion_edit_)", "", clip.lower())
        return "woody2", re.sub(r"([_a-z]*?)_?\d*$", r"\1", words)
    if folder == "snu_cmu69_cmu94":
        return "cmu69", f"block {(int(clip.split('_')[1]) - 1) // 5:02d}"
    if folder == "snu_vsports_basketball":
        return clip[:5], clip[:7]  # all players of one take
    return folder, clip[:7] if folder == "snu_martial_arts" else clip


if __name__ == "__main__":
    main()
