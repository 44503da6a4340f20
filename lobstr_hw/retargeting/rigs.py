"""Which joint of a rig is which joint of the standard skeleton: tables of names."""

from collections.abc import Sequence
from dataclasses import dataclass

from lobstr_hw.errors import UnknownRig
from lobstr_hw.skeleton import HUMANOID_NAMES, Joint

__all__ = ["RIGS", "Rig", "match_rig"]

_OPTIONAL = {
    Joint.SPINE,
    Joint.CHEST,
    Joint.NECK,
    Joint.LEFT_SHOULDER,
    Joint.RIGHT_SHOULDER,
}
"""Joints that a rig may lack; they get a turn between their neighbours."""


@dataclass(frozen=True, slots=True)
class Rig:
    """A family of skeletons that share names.

    Attributes:
        name: for messages.
        trunk: rig joint for hips, spine, chest, upper chest, neck and head, "" where there is none.
        limbs: pattern for shoulder, upper arm, lower arm, hand, upper leg, lower leg, foot, toes;
            ``*`` is the side, ``|`` parts spellings.
        sides: what ``*`` is, left and right.
    """

    name: str
    trunk: tuple[str, str, str, str, str, str]
    limbs: tuple[str, str, str, str, str, str, str, str]
    sides: tuple[str, str] = ("Left", "Right")

    def find(self, names: Sequence[str]) -> dict[Joint, int] | None:
        """The rig's joints among ``names``, or None where a needed one is missing."""
        index = {_plain(n): i for i, n in reversed(list(enumerate(names)))}
        patterns = dict(zip(list(Joint)[:6], self.trunk, strict=True))
        for first, side in zip(
            (
                (Joint.LEFT_SHOULDER, Joint.LEFT_UPPER_LEG),
                (Joint.RIGHT_SHOULDER, Joint.RIGHT_UPPER_LEG),
            ),
            self.sides,
            strict=True,
        ):
            for k, pattern in enumerate(self.limbs):
                joint = Joint(first[0] + k if k < 4 else first[1] + k - 4)
                patterns[joint] = pattern.replace("*", side)
        found: dict[Joint, int] = {}
        for joint, pattern in patterns.items():
            hits = [index[_plain(n)] for n in pattern.split("|") if _plain(n) in index]
            if hits:
                found[joint] = hits[0]
            elif joint not in _OPTIONAL:
                return None
        return found


def _plain(name: str) -> str:
    """Without name space and case: ``mixamorig:Hips`` and ``HEad`` are met by Hips and Head."""
    return name.rsplit(":", 1)[-1].lower()


_ARM_LEG = (
    "*Shoulder",
    "*Arm",
    "*ForeArm",
    "*Hand",
    "*UpLeg",
    "*Leg",
    "*Foot",
    "*ToeBase|*Toe|*Toes",
)

RIGS = (
    Rig(
        "standard skeleton (HumanBodyBones)",
        ("Hips", "Spine", "Chest", "UpperChest|Chest", "Neck", "Head"),
        (
            "*Shoulder",
            "*UpperArm",
            "*LowerArm",
            "*Hand",
            "*UpperLeg",
            "*LowerLeg",
            "*Foot",
            "*Toes",
        ),
    ),
    Rig(
        "CMU (cgspeed BVH)",
        ("Hips", "LowerBack", "Spine", "Spine1", "Neck", "Head"),
        _ARM_LEG,
    ),
    Rig(
        "Mixamo, HumanIK, SNU with three spine joints",
        ("Hips", "Spine", "Spine1", "Spine2", "Neck", "Head"),
        _ARM_LEG,
    ),
    Rig(
        "SNU with two spine joints",
        ("Hips|root", "Spine", "", "Spine1", "Neck", "Head"),
        ("*Shoulder1|*Shoulder", *_ARM_LEG[1:]),
    ),
    Rig(
        "CMU (Acclaim ASF)",
        ("root", "lowerback", "upperback", "thorax", "lowerneck", "head"),
        ("*clavicle", "*humerus", "*radius", "*hand", "*femur", "*tibia", "*foot", "*toes"),
        ("l", "r"),
    ),
    Rig(
        "Reallusion iClone (CC_Base)",
        (
            "CC_Base_Pelvis",
            "CC_Base_Waist",
            "CC_Base_Spine01",
            "CC_Base_Spine02",
            "CC_Base_NeckTwist01",
            "CC_Base_Head",
        ),
        (
            "CC_Base_*_Clavicle",
            "CC_Base_*_Upperarm",
            "CC_Base_*_Forearm",
            "CC_Base_*_Hand",
            "CC_Base_*_Thigh",
            "CC_Base_*_Calf",
            "CC_Base_*_Foot",
            "CC_Base_*_ToeBase",
        ),
        ("L", "R"),
    ),
    Rig(
        "Bandai Namco",
        ("Hips", "Spine", "", "Chest", "Neck", "Head"),
        (
            "Shoulder_*",
            "UpperArm_*",
            "LowerArm_*",
            "Hand_*",
            "UpperLeg_*",
            "LowerLeg_*",
            "Foot_*",
            "Toes_*",
        ),
        ("L", "R"),
    ),
    Rig(
        "DeepMimic humanoid",
        ("root", "", "", "chest", "", "neck"),
        ("", "*_shoulder", "*_elbow", "*_wrist", "*_hip", "*_knee", "*_ankle", "*_toe"),
        ("left", "right"),
    ),
)


def match_rig(names: Sequence[str], where: str) -> tuple[Rig, dict[Joint, int]]:
    """The table that names the most joints of a file.

    Raises:
        UnknownRig: none names the joints that are needed.
    """
    hits = [(rig, found) for rig in RIGS if (found := rig.find(names)) is not None]
    if not hits:
        raise UnknownRig(
            f"{where}: no table names the joints of this rig: {', '.join(names)}. "
            f"Known rigs: {'; '.join(rig.name for rig in RIGS)}. "
            "Rename the joints to one of these or add a table to lobstr_hw/retargeting/rigs.py."
        )
    return max(hits, key=lambda hit: len(set(hit[1].values())))


def is_standard(names: Sequence[str]) -> bool:
    """Whether a file has this project's own joints, whose frames need no fitting."""
    return tuple(names) == HUMANOID_NAMES
