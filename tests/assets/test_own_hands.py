"""An arm of one file with a hand of another."""

from pathlib import Path

import pytest

from gen_data.assets.library import open_library
from gen_data.core.asset_types import RobotModel
from gen_data.core.errors import AssetError, ConfigError
from gen_data.core.kinematics import link_poses
from gen_data.core.se3 import SE3

BOX = '<geometry><box size="0.1 0.1 0.2"/></geometry>'
ARM = f"""<robot name="arm"><link name="base"><visual>{BOX}</visual></link>
<link name="flange"/><link name="marker"/>
<joint name="elbow" type="revolute"><origin xyz="0 0 1"/><parent link="base"/><child link="flange"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="fixed" type="fixed"><parent link="flange"/><child link="marker"/></joint></robot>"""
HAND = f"""<robot name="hand"><link name="palm"><visual>{BOX}</visual></link>
<link name="left"><visual>{BOX}</visual></link>
<joint name="open" type="prismatic"><origin xyz="0 0 0.1"/><parent link="palm"/>
<child link="left"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="1" velocity="1"/>
</joint></robot>"""
HAND_MJCF = """<mujoco><worldbody><body name="palm"><geom type="box" size="0.05 0.05 0.1"/>
<body name="left" pos="0 0 0.1"><joint name="open" type="slide" axis="0 1 0" range="0 0.04"/>
<geom type="box" size="0.05 0.05 0.1"/></body></body></worldbody></mujoco>"""
ENTRY = """robots:
  - id: arm
    file: arm.urdf
    tool: {{kind: file, file: {hand}, flange: flange, offset_m: 0.02, yaw_deg: 90, {more}}}
    gripper: {{link: palm, grasp_offset_m: 0.15, finger_joints: [{joint}], stroke_m: 0.08}}
"""


def robot(
    tmp_path: Path, hand: str = "hand.urdf", joint: str = "open", more: str = ""
) -> RobotModel:
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "hand.urdf").write_text(HAND)
    (tmp_path / "hand.xml").write_text(HAND_MJCF)
    text = ENTRY.format(hand=hand, joint=joint, more=more).replace(", }", "}")
    (tmp_path / "assets.yaml").write_text(text)
    return open_library([tmp_path], tmp_path / "cache", tmp_path).robot("user/arm")


@pytest.mark.slow
@pytest.mark.parametrize("hand", ["hand.urdf", "hand.xml"])
def test_a_hand_of_its_own_file_is_on_the_flange(tmp_path: Path, hand: str) -> None:
    """2 cm beyond it, turned by 90 degrees: at 0.03 m the finger is 0.03 m along -X."""
    model = robot(tmp_path, hand, more="instead_of: marker")
    poses = link_poses(model, SE3(), (0.0, 0.03))
    assert poses["palm"].translation_m == pytest.approx((0.0, 0.0, 1.02))
    assert poses["left"].translation_m == pytest.approx((-0.03, 0.0, 1.12))
    assert "marker" not in model.links
    assert model.gripper is not None
    assert (model.gripper.link, model.gripper.finger_joints) == ("palm", ("open",))


def test_a_changed_hand_changes_the_digest_and_one_that_misfits_is_refused(tmp_path: Path) -> None:
    robot(tmp_path)
    one = open_library([tmp_path], tmp_path / "cache", tmp_path).get("user/arm").sha256
    (tmp_path / "hand.urdf").write_text(HAND.replace("0.04", "0.05"))
    two = open_library([tmp_path], tmp_path / "cache", tmp_path).get("user/arm").sha256
    assert one != two
    with pytest.raises(AssetError, match=r"arm\.urdf: it has a link or joint 'base', as its tool"):
        robot(tmp_path, "arm.urdf")
    with pytest.raises(AssetError, match=r"no movable joint 'opn' \(did you mean 'open'\?\)"):
        robot(tmp_path, joint="opn")


@pytest.mark.parametrize("tool", ["{kind: file, flange: a}", "{kind: fingers, file: b, flange: a}"])
def test_kind_and_file_go_together(tmp_path: Path, tool: str) -> None:
    (tmp_path / "assets.yaml").write_text(f"robots:\n  - {{file: arm.urdf, tool: {tool}}}\n")
    (tmp_path / "arm.urdf").write_text(ARM)
    with pytest.raises(ConfigError, match=r"assets\.yaml:2:.*expected file with kind: file"):
        open_library([tmp_path], tmp_path / "cache", tmp_path).robot("user/arm")
