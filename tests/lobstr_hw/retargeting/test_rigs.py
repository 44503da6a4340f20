"""Tables of joint names: every common rig is known, an unknown one is told with its names."""

import pytest

from lobstr_hw.errors import UnknownRig
from lobstr_hw.retargeting.rigs import match_rig
from lobstr_hw.skeleton import HUMANOID_NAMES, Joint

SIDES = ("Left", "Right")
SNU_20 = (
    *("Hips", "RightUpLeg", "RightLeg", "RightFoot", "RightToes", "Spine", "Spine1", "HEad"),
    *("LeftShoulder1", "LeftArm", "LeftForeArm", "LeftHand"),
    *("RightShoulder", "RightArm", "RightForeArm", "RightHand"),
    *("LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToes"),
)
MIXAMO = tuple(
    "mixamorig:" + name
    for name in (
        *("Hips", "Spine", "Spine1", "Spine2", "Neck", "Head"),
        *(s + n for s in SIDES for n in ("Shoulder", "Arm", "ForeArm", "Hand", "HandThumb1")),
        *(s + n for s in SIDES for n in ("UpLeg", "Leg", "Foot", "ToeBase")),
    )
)
CGSPEED = (
    *("Hips", "LHipJoint", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase"),
    *("RHipJoint", "RightUpLeg", "RightLeg", "RightFoot", "RightToeBase"),
    *("LowerBack", "Spine", "Spine1", "Neck", "Neck1", "Head"),
    *(s + n for s in SIDES for n in ("Shoulder", "Arm", "ForeArm", "Hand", "FingerBase")),
)
ASF = (
    *("root", "lowerback", "upperback", "thorax", "lowerneck", "upperneck", "head"),
    *(s + n for s in "lr" for n in ("hipjoint", "femur", "tibia", "foot", "toes")),
    *(s + n for s in "lr" for n in ("clavicle", "humerus", "radius", "wrist", "hand", "thumb")),
)


def name_of(names: tuple[str, ...], joint: Joint) -> str:
    return names[match_rig(names, "clip.bvh")[1][joint]]


@pytest.mark.parametrize("names", [HUMANOID_NAMES, MIXAMO, CGSPEED, ASF])
def test_all_22_joints_of_a_full_rig_are_found_each_once(names: tuple[str, ...]) -> None:
    _, found = match_rig(names, "clip.bvh")
    assert sorted(found) == list(Joint)
    assert len(set(found.values())) == 22


@pytest.mark.parametrize("names", [HUMANOID_NAMES, MIXAMO, CGSPEED, ASF, SNU_20])
def test_left_joints_are_on_the_left(names: tuple[str, ...]) -> None:
    _, found = match_rig(names, "clip.bvh")
    for joint in Joint:
        if joint in found and "_" in joint.name and joint is not Joint.UPPER_CHEST:
            name = names[found[joint]].split(":")[-1].lower()
            assert name.startswith(joint.name.split("_")[0].lower()[0])


def test_a_misspelt_head_and_a_numbered_shoulder_are_known() -> None:
    assert name_of(SNU_20, Joint.HEAD) == "HEad"
    assert name_of(SNU_20, Joint.LEFT_SHOULDER) == "LeftShoulder1"


def test_two_spine_joints_are_the_lowest_and_the_highest() -> None:
    _, found = match_rig(SNU_20, "clip.bvh")
    assert name_of(SNU_20, Joint.SPINE) == "Spine"
    assert name_of(SNU_20, Joint.UPPER_CHEST) == "Spine1"
    assert Joint.CHEST not in found
    assert Joint.NECK not in found


def test_the_same_word_means_another_joint_where_there_is_a_lower_back() -> None:
    assert name_of(CGSPEED, Joint.CHEST) == "Spine"
    assert name_of(MIXAMO, Joint.SPINE) == "mixamorig:Spine"


def test_an_unknown_rig_is_told_with_its_joints_and_a_cure() -> None:
    names = ("Bip01", "Bip01 Pelvis", "Bip01 L Thigh")
    with pytest.raises(UnknownRig, match=r"walk\.bvh.*Bip01 Pelvis, Bip01 L Thigh.*add a table"):
        match_rig(names, "walk.bvh")
