"""SDF models: frames, joints, models inside models, materials and files of Gazebo."""

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gen_data.assets.asset_folder import Folder
from gen_data.assets.library import open_library
from gen_data.assets.robot_description import RobotDescription
from gen_data.assets.robot_shapes import read_shape
from gen_data.assets.sdf import read_sdf
from gen_data.core.errors import AssetError
from gen_data.core.se3 import SE3
from tests.assets.robot_files import TETRAHEDRON, poses_at

BOX = "<geometry><box><size>0.2 0.4 0.6</size></box></geometry>"


def link(name: str, pose: str = "", extra: str = "") -> str:
    return (
        f'<link name="{name}">{pose}<visual name="v">{BOX}{extra}</visual>'
        f'<collision name="c">{BOX}</collision></link>'
    )


def read(tmp_path: Path, *parts: str) -> RobotDescription:
    text = "\n".join(['<sdf version="1.9"><model name="m">', *parts, "</model></sdf>"])
    (tmp_path / "a.sdf").write_text(text)
    return read_sdf(Folder(tmp_path), "a.sdf")


def middle(described: RobotDescription, link_name: str, **positions: float) -> list[float]:
    (shape,) = described.links[link_name].visuals
    pose = poses_at(described, **positions)[link_name] @ shape.T_link_shape
    return [round(v, 6) + 0.0 for v in pose.translation_m]


HINGED = (
    link("frame", "<pose>0 0 0.5 0 0 0</pose>"),
    link("door", '<pose relative_to="frame">1 0 0 0 0 1.5707963267948966</pose>'),
    '<joint name="hinge" type="revolute"><parent>frame</parent><child>door</child>'
    "<pose>0 -0.5 0 0 0 0</pose><axis><xyz>0 0 1</xyz>"
    "<limit><lower>0</lower><upper>1.5</upper></limit></axis></joint>",
)


def test_a_door_turns_about_its_hinge(tmp_path: Path) -> None:
    """The door's frame is turned by 90 degrees, so that -0.5 along its Y is +0.5 along X.

    The hinge is at x = 1.5; half a metre before it the door's middle is at 1.0, and after a
    quarter turn at (1.5, -0.5).
    """
    described = read(tmp_path, *HINGED)
    assert middle(described, "door") == [1.0, 0.0, 0.5]
    assert middle(described, "door", hinge=math.pi / 2) == [1.5, -0.5, 0.5]
    (hinge,) = (j for j in described.joints if j.movable)
    assert (hinge.kind, hinge.lower, hinge.upper) == ("revolute", 0.0, 1.5)


@pytest.mark.parametrize(
    ("axis", "expected"),
    [("<xyz>0 1 0</xyz>", [0.9, 0.0, 0.5]),
     ('<xyz expressed_in="__model__">0 1 0</xyz>', [1.0, 0.1, 0.5]),
     ('<xyz expressed_in="frame">1 0 0</xyz>', [1.1, 0.0, 0.5]),
     ("<xyz>0 1 0</xyz><use_parent_model_frame>true</use_parent_model_frame>", [1.0, 0.1, 0.5])],
)  # fmt: skip
def test_axes_are_in_the_named_frame(tmp_path: Path, axis: str, expected: list[float]) -> None:
    """By default in the joint's own, which here has Y along the model's -X."""
    slide = HINGED[2].replace("revolute", "prismatic").replace("<xyz>0 0 1</xyz>", axis)
    described = read(tmp_path, *HINGED[:2], slide)
    assert middle(described, "door", hinge=0.1) == pytest.approx(expected)


@pytest.mark.parametrize(("version", "stated", "expected"), [
    ("1.3", "", [1.0, 0.1, 0.5]),
    ("1.4", "", [1.0, 0.1, 0.5]),
    ("1.4", "<use_parent_model_frame>false</use_parent_model_frame>", [0.9, 0.0, 0.5]),
    ("1.5", "", [0.9, 0.0, 0.5]),
    ("1.6", "<use_parent_model_frame>True</use_parent_model_frame>", [1.0, 0.1, 0.5]),
])  # fmt: skip
def test_before_version_1_5_axes_are_in_the_frame_of_the_model(
    tmp_path: Path, version: str, stated: str, expected: list[float]
) -> None:
    """As libsdformat converts such files (``sdf/1.5/1_4.convert``)."""
    slide = HINGED[2].replace("revolute", "prismatic")
    slide = slide.replace("<xyz>0 0 1</xyz>", f"<xyz>0 1 0</xyz>{stated}")
    door = HINGED[1].replace(' relative_to="frame"', "").replace(">1 0 0 ", ">1 0 0.5 ")
    read(tmp_path, HINGED[0], door, slide)
    text = (tmp_path / "a.sdf").read_text().replace('version="1.9"', f'version="{version}"')
    (tmp_path / "a.sdf").write_text(text)
    described = read_sdf(Folder(tmp_path), "a.sdf")
    assert middle(described, "door", hinge=0.1) == pytest.approx(expected)


@pytest.mark.parametrize("tag", ["visual", "collision"])
def test_poses_of_shapes_follow_the_frame_that_they_name(tmp_path: Path, tag: str) -> None:
    """A link at (0, 0, 1), turned; its shape 1 m above a frame at (0, 0, 5), which follows it."""
    text = (
        f'<link name="a"><pose>0 0 1 0 0 1.5707963267948966</pose><{tag} name="v">'
        f'<pose relative_to="mark">0.5 0 1 0 0 0</pose>{BOX}</{tag}></link>'
        '<frame name="mark"><pose>0 0 5 0 0 0</pose></frame>'
    )
    described = read(tmp_path, text)
    (shape,) = (*described.links["a"].visuals, *described.links["a"].collisions)
    pose = poses_at(described)["a"] @ shape.T_link_shape
    np.testing.assert_allclose(pose.matrix(), SE3((0.5, 0.0, 6.0)).matrix(), atol=1e-9)


def test_poses_follow_frames_degrees_and_quaternions(tmp_path: Path) -> None:
    """A frame 1 m along X and turned by 90 degrees about Z; 1 m along its X is (1, 1, 0)."""
    described = read(
        tmp_path,
        link("base"),
        '<frame name="f" attached_to="base"><pose degrees="true">1 0 0 0 0 90</pose></frame>',
        link("a", '<pose relative_to="f">1 0 0 0 0 0</pose>'),
        link("b", f'<pose relative_to="f" rotation_format="quat_xyzw">0 2 0 0 0 {0.5**0.5} '
             f"{0.5**0.5}</pose>"),
    )  # fmt: skip
    assert middle(described, "a") == [1.0, 1.0, 0.0]
    assert middle(described, "b") == [-1.0, 0.0, 0.0]
    x = poses_at(described)["b"].rotate(np.array([1.0, 0.0, 0.0]))
    assert x == pytest.approx([-1.0, 0.0, 0.0], abs=1e-9)


def test_models_inside_models_have_prefixed_names_and_their_own_frames(tmp_path: Path) -> None:
    """Included from a model folder with ``model.config``, 2 m up, and joined to the outer one."""
    (tmp_path / "hand").mkdir()
    (tmp_path / "hand/model.config").write_text(
        '<model><name>hand</name><sdf version="1.5">old.sdf</sdf><sdf version="1.9">new.sdf</sdf>'
        "</model>"
    )
    (tmp_path / "hand/new.sdf").write_text(
        '<sdf version="1.9"><model name="hand"><pose>9 9 9 0 0 0</pose>'
        f"{link('palm', '<pose>0 0 1 0 0 0</pose>')}</model></sdf>"
    )
    described = read(
        tmp_path,
        link("arm"),
        "<include><uri>model://hand</uri><name>left</name><pose>0 0 2 0 0 0</pose></include>",
        '<joint name="wrist" type="fixed"><parent>arm</parent><child>left::palm</child></joint>',
    )
    assert list(described.links) == ["__model__", "arm", "left::palm"]
    assert middle(described, "left::palm") == [0.0, 0.0, 3.0]
    assert described.included == ("hand/model.config", "hand/new.sdf")


INCLUDED = (
    '<sdf version="1.9"><model name="hand">'
    f"{link('palm', '<pose>0 0 1 0 0 0</pose>')}"
    '<frame name="tip" attached_to="palm"><pose>0.5 0 0 0 0 0</pose></frame></model></sdf>'
)


def test_models_are_merged_placed_by_a_frame_and_found_by_their_bare_names(tmp_path: Path) -> None:
    """Names have no prefix; poses stay in its own frame, which is 2 m along X and half turned."""
    (tmp_path / "hand.sdf").write_text(INCLUDED)
    described = read(
        tmp_path,
        link("arm"),
        '<include merge="true"><uri>hand.sdf</uri><pose>2 0 0 0 0 3.141592653589793</pose>'
        "</include>",
        '<joint name="wrist" type="fixed"><parent>arm</parent><child>palm</child></joint>',
        link("ring", '<pose relative_to="tip">0 0 0 0 0 0</pose>'),
    )
    assert list(described.links) == ["__model__", "arm", "palm", "ring"]
    assert middle(described, "palm") == [2.0, 0.0, 1.0]
    assert middle(described, "ring") == [1.5, 0.0, 1.0]
    # ``tip`` at (0, 0, 3) puts the palm half a metre before it.
    (tmp_path / "hand.sdf").write_text(INCLUDED)
    include = (
        "<include><uri>hand.sdf</uri><name>h</name><pose>0 0 3 0 0 0</pose>"
        "<placement_frame>tip</placement_frame></include>"
    )
    described = read(tmp_path, link("arm"), include)
    assert middle(described, "h::palm") == [-0.5, 0.0, 3.0]
    placed = INCLUDED.replace('name="hand">', 'name="hand" placement_frame="tip">')
    (tmp_path / "hand.sdf").write_text(placed)
    unnamed = include.replace("<placement_frame>tip</placement_frame>", "")
    assert middle(read(tmp_path, link("arm"), unnamed), "h::palm") == [-0.5, 0.0, 3.0]
    # As Gazebo does with the folders of its resource path; the file may hold an include only.
    (tmp_path / "hand").mkdir()
    (tmp_path / "hand/model.sdf").write_text(INCLUDED)
    (tmp_path / "robot").mkdir()
    text = '<sdf version="1.9"><include><uri>hand</uri></include></sdf>'
    (tmp_path / "robot/model.sdf").write_text(text)
    assert middle(read_sdf(Folder(tmp_path), "robot/model.sdf"), "palm") == [0.0, 0.0, 1.0]


@pytest.mark.parametrize(("outer", "inner", "moves"), [
    ("", "", True), ("<static>true</static>", "", False), ("", "<static>1</static>", False),
])  # fmt: skip
def test_joints_of_models_inside_static_ones_do_not_move(
    tmp_path: Path, outer: str, inner: str, moves: bool
) -> None:
    """Of a model in the file and of one that is included."""
    (tmp_path / "door").mkdir()
    (tmp_path / "door/model.sdf").write_text(
        f'<sdf version="1.9"><model name="door">{"".join(HINGED)}</model></sdf>'
    )
    include = f"<include><uri>model://door</uri><name>a</name>{inner}</include>"
    nested = f'<model name="b">{inner}{"".join(HINGED)}</model>'
    described = read(tmp_path, outer, include, nested)
    assert [joint.movable for joint in described.joints if "hinge" in joint.name] == [moves] * 2


def test_before_version_1_7_a_joint_may_have_the_name_of_its_link(tmp_path: Path) -> None:
    joint = HINGED[2].replace('name="hinge"', 'name="door"')
    with pytest.raises(AssetError, match="joint 'door': its name is missing or used twice"):
        read(tmp_path, *HINGED[:2], joint)
    text = (tmp_path / "a.sdf").read_text().replace('version="1.9"', 'version="1.6"')
    (tmp_path / "a.sdf").write_text(text)
    (hinge,) = (j for j in read_sdf(Folder(tmp_path), "a.sdf").joints if j.movable)
    assert (hinge.name, hinge.child) == ("door_joint", "door")


@pytest.mark.slow
def test_meshes_materials_and_textures_of_gazebo(tmp_path: Path) -> None:
    """Diffuse colours replace the mesh's; sRGB 0.5 is 0.214041 linear (IEC 61966-2-1)."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/a.obj").write_text(TETRAHEDRON)
    Image.new("RGB", (4, 4), (0, 255, 0)).save(tmp_path / "meshes/a.png")
    materials = {
        "half": "<material><diffuse>0.5 0 0 1</diffuse></material>"
                "<transparency>0.25</transparency>",
        "named": "<material><script><name>Gazebo/Red</name></script></material>",
        "image": "<material><pbr><metal><albedo_map>meshes/a.png</albedo_map><roughness>0.3"
                 "</roughness><metalness>1</metalness></metal></pbr></material>",
    }  # fmt: skip
    mesh = ("<geometry><mesh><uri>model://thing/meshes/a.obj</uri><scale>0.1 0.1 0.1</scale></mesh>"
            "</geometry>")  # fmt: skip
    for name, extra in materials.items():
        text = link("a", extra=extra).replace(BOX, mesh)
        (tmp_path / f"{name}.sdf").write_text(
            f'<sdf version="1.9"><model name="m">{text}</model></sdf>'
        )
    library = open_library([tmp_path], tmp_path / "cache", tmp_path)
    found = {name: library.materials(f"user/{name}")[0] for name in materials}
    assert (found["half"].base_color, found["half"].opacity) == ((0.214041, 0.0, 0.0), 0.75)
    assert found["named"].base_color == (0.85, 0.0, 0.0)
    assert (found["image"].roughness, found["image"].metallic) == (0.3, 1.0)
    assert library.texture(found["image"].texture).albedo[0, 0].tolist() == [0, 255, 0]
    assert library.bounds_m("user/half")[1] == pytest.approx((0.05, 0.05, 0.05))


def test_a_mimic_follows_its_leader_from_a_reference(tmp_path: Path) -> None:
    """2 (x - 0.1) + 0.3 = 2 x + 0.1 (SDF 1.11)."""
    mimic = (
        "</limit><mimic joint='hinge'><multiplier>2</multiplier><offset>0.3</offset>"
        "<reference>0.1</reference></mimic>"
    )
    second = HINGED[2].replace("hinge", "other").replace("<child>door", "<child>leaf")
    second = second.replace("</limit>", mimic)
    described = read(tmp_path, *HINGED, link("leaf"), second)
    (other,) = (j for j in described.joints if j.name == "other")
    assert (other.mimic, other.mimic_multiplier, other.mimic_offset) == ("hinge", 2.0, 0.1)


def test_one_object_of_a_mesh_file_is_used_and_centered(tmp_path: Path) -> None:
    """Of a file with a tetrahedron at the origin and one 9 m along X, scaled by 2."""
    moved = "\n".join(f"v {x} {y} {z}" for x, y, z in ((9, 0, 0), (10, 0, 0), (9, 1, 0), (9, 0, 1)))
    second = f"o wheel\n{moved}\nf 5 7 6\nf 5 6 8\nf 6 7 8\nf 7 5 8\n"
    (tmp_path / "car.obj").write_text(f"o body\n{TETRAHEDRON}{second}")
    bounds = {}
    for center in ("false", "true"):
        part = f"<submesh><name>wheel</name><center>{center}</center></submesh>"
        mesh = f"<geometry><mesh><uri>car.obj</uri><scale>2 2 2</scale>{part}</mesh></geometry>"
        described = read(tmp_path, f'<link name="a"><visual name="v">{mesh}</visual></link>')
        (shape,) = described.links["a"].visuals
        x = read_shape(Folder(tmp_path), shape, SE3()).soup.corners[..., 0]
        bounds[center] = (x.min(), x.max())
    assert bounds == {"false": (18.0, 20.0), "true": (-1.0, 1.0)}
    wrong = f'<link name="a"><visual name="v">{mesh.replace("wheel", "weel")}</visual></link>'
    (shape,) = read(tmp_path, wrong).links["a"].visuals
    with pytest.raises(AssetError, match=r"car\.obj: has no part 'weel' \(did you mean 'wheel'\?"):
        read_shape(Folder(tmp_path), shape, SE3())


def test_what_is_not_used_is_named_and_a_loop_cut_after_its_first_joint(tmp_path: Path) -> None:
    """As of a closed loop of MJCF; the other one is named."""
    brace = '<joint name="brace" type="fixed"><parent>frame</parent><child>door</child></joint>'
    described = read(tmp_path, *HINGED, brace)
    assert [j.name for j in described.joints if j.movable] == ["hinge"]
    assert described.remarks == ("not used: 1 joint 'brace' (it closes a loop)",)
    described = read(tmp_path, "<static>true</static>", *HINGED)
    assert not any(joint.movable for joint in described.joints)
    assert middle(described, "door") == [1.0, 0.0, 0.5]
    # Sensors, plugins, joints of several positions, and geometry without a surface.
    described = read(
        tmp_path,
        *HINGED[:2],
        HINGED[2].replace("revolute", "ball"),
        '<plugin name="p" filename="x.so"/>',
        '<link name="eye"><sensor name="s" type="camera"/><visual name="v"><geometry><plane>'
        "<normal>0 0 1</normal></plane></geometry></visual></link>",
    )
    assert described.remarks == (
        "not used: 1 ball joint (it stays at its origin)",
        "not used: 1 plane geometry",
        "not used: 1 plugin",
        "not used: 1 sensor",
    )


@pytest.mark.parametrize(
    ("part", "reason"),
    [
        ('<joint name="j" type="magic"><parent>frame</parent><child>door</child></joint>',
         r":2:1: .*joint 'j': its type is 'magic'"),
        ('<joint name="j" type="fixed"><parent>frame</parent><child>dor</child></joint>',
         "there is no link or frame 'dor'"),
        (link("x", '<pose relative_to="y">0 0 0 0 0 0</pose>'), "there is no frame 'y'"),
        (link("x", '<pose relative_to="x">0 0 0 0 0 0</pose>'), "relative to itself"),
        ('<link name="x"><visual name="v"><pose relative_to="y">0 0 0 0 0 0</pose>' + BOX
         + "</visual></link>", "there is no frame 'y'"),
        (link("x", "<pose>0 0 0</pose>"), r":2:\d+: .*link 'x': '0 0 0' is not 6 numbers"),
        (link("x").replace("0.2 0.4 0.6", "0.2 -0.4 0.6"), r":2:\d+: .*<box> has a negative"),
        (link("frame"), "link 'frame': its name is missing or used twice"),
        ("<include><uri>model://../../etc</uri></include>", "outside"),
        ("<include><uri>a.sdf</uri></include>", "includes itself"),
    ],
)  # fmt: skip
def test_faults_have_one_clear_error(tmp_path: Path, part: str, reason: str) -> None:
    with pytest.raises(AssetError, match=rf"a\.sdf.*{reason}"):
        read(tmp_path, part, *HINGED[:2])


def test_entities_and_files_with_two_models_are_refused(tmp_path: Path) -> None:
    """The intended one is ambiguous."""
    (tmp_path / "a.sdf").write_text("<!DOCTYPE a [<!ENTITY b 'c'>]><sdf><model name='&b;'/></sdf>")
    with pytest.raises(AssetError, match=r"a\.sdf: .*declares a document type"):
        read_sdf(Folder(tmp_path), "a.sdf")
    (tmp_path / "a.sdf").write_text(
        '<sdf version="1.9"><world name="w"><model name="a"/><model name="b"/></world></sdf>'
    )
    with pytest.raises(AssetError, match=r"a\.sdf: holds 2 models"):
        read_sdf(Folder(tmp_path), "a.sdf")
