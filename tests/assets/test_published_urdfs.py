"""URDF files as others write them: materials, joints, empty shapes, packages, xacro."""

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from gen_data.assets.asset_folder import Folder
from gen_data.assets.library import Library, open_library
from gen_data.assets.robot_description import RobotDescription
from gen_data.assets.robot_formats import read_description
from gen_data.assets.robot_shapes import read_shape
from gen_data.core.errors import AssetError
from gen_data.core.se3 import SE3
from tests.assets.robot_files import TETRAHEDRON

BOX = '<geometry><box size="0.1 0.2 0.3"/></geometry>'


def link(name: str, inside: str = "", collision: str = BOX) -> str:
    return f'<link name="{name}">{inside}<collision>{collision}</collision></link>'


def joint(name: str, parent: str, child: str, inside: str = "", kind: str = "fixed") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<axis xyz="0 0 1"/>{inside}</joint>'
    )


def describe(tmp_path: Path, *parts: str, file: str = "a.urdf") -> RobotDescription:
    """Read a URDF that consists of these elements, one a line."""
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).write_text("\n".join(['<robot name="r">', *parts, "</robot>"]))
    return read_description(Folder(tmp_path), file)


def seen(tmp_path: Path, *parts: str) -> Library:
    describe(tmp_path, *parts)
    return open_library([tmp_path], tmp_path / "cache", tmp_path)


def visual(material: str = "", geometry: str = BOX) -> str:
    return f"<visual>{geometry}{material}</visual>"


@pytest.mark.slow
def test_alpha_of_a_colour_is_opacity(tmp_path: Path) -> None:
    """Of own and of shared materials; sRGB 0.5 is 0.214041 linear (IEC 61966-2-1)."""
    own = '<material name="m"><color rgba="0.5 0 0 0.3"/></material>'
    shared = '<material name="glass"><color rgba="0 0.5 0 0.4"/></material>'
    library = seen(
        tmp_path, shared, link("a", visual(own)), link("b", visual('<material name="glass"/>')),
        joint("j", "a", "b", '<origin xyz="0 0 1"/>'),
    )  # fmt: skip
    red, green = library.materials("user/a")
    assert (red.opacity, red.base_color) == (0.3, (0.214041, 0.0, 0.0))
    assert (green.opacity, green.base_color) == (0.4, (0.0, 0.214041, 0.0))


def test_materials_of_the_robot_win_over_links_and_clear_ones_are_omitted(tmp_path: Path) -> None:
    """As in urdfdom, wherever it stands; TALOS has two materials named DarkGrey."""
    described = describe(
        tmp_path,
        link("a", visual('<material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>')),
        link("b", visual('<material name="grey"/>')),
        '<material name="grey"><color rgba="0.2 0.2 0.2 1"/></material>',
        joint("j", "a", "b"),
    )
    assert described.links["b"].visuals[0].look.color == (0.2, 0.2, 0.2)
    clear = '<material name="m"><color rgba="1 0 0 0"/></material>'
    described = describe(tmp_path, link("a", visual(clear)))
    assert described.links["a"].visuals == ()
    assert "invisible (alpha 0)" in described.remarks[0]


def test_a_texture_is_whole_and_upright_on_every_face_of_a_box(tmp_path: Path) -> None:
    """Seen from outside with Z up, the image's left bottom is at the face's left bottom."""
    (tmp_path / "textures").mkdir()
    Image.new("RGB", (4, 4), (255, 0, 0)).save(tmp_path / "textures/tag.png")
    texture = '<material name="m"><texture filename="textures/tag.png"/></material>'
    library = seen(tmp_path, link("a", visual(texture)))
    mesh = library.mesh("user/a")
    (material,) = mesh.materials
    assert library.texture(material.texture).albedo[0, 0].tolist() == [255, 0, 0]
    corner = {tuple(np.round(v, 6).tolist()) for v in mesh.uvs}
    assert corner == {(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)}
    faces = {"+x": ((1, 0, 0), 1, 1), "-x": ((-1, 0, 0), 1, -1),
             "+y": ((0, 1, 0), 0, -1), "-y": ((0, -1, 0), 0, 1)}  # fmt: skip
    for normal, axis, sign in faces.values():
        on_face = np.flatnonzero((mesh.normals @ np.array(normal)) > 0.9)
        assert len(on_face) >= 4
        right, up = sign * mesh.vertices_m[on_face, axis], mesh.vertices_m[on_face, 2]
        assert ((mesh.uvs[on_face, 0] > 0.5) == (right > 0)).all()
        assert ((mesh.uvs[on_face, 1] > 0.5) == (up > 0)).all()


def test_capsules_have_caps(tmp_path: Path) -> None:
    """Radius 0.05 and length 0.2 between the caps: 0.3 high, volume to 2 %."""
    shape = '<geometry><capsule radius="0.05" length="0.2"/></geometry>'
    library = seen(tmp_path, link("a", visual(geometry=shape), shape))
    mesh = library.mesh("user/a")
    assert np.ptp(mesh.vertices_m, axis=0) == pytest.approx([0.1, 0.1, 0.3], abs=1e-6)
    a, b, c = mesh.vertices_m.astype(np.float64)[mesh.faces].transpose(1, 0, 2)
    volume = (a * np.cross(b, c)).sum() / 6.0
    exact = math.pi * 0.05**2 * 0.2 + 4.0 / 3.0 * math.pi * 0.05**3
    assert volume == pytest.approx(exact, rel=0.02)


def test_a_joint_without_limits_is_refused_with_remedy_unless_it_mimics_one(tmp_path: Path) -> None:
    """Leader from -1 to 2, multiplier -0.5, offset 0.1: from -0.9 to 0.6."""
    leader = joint("j", "a", "b", '<limit lower="-1" upper="2" effort="1" velocity="1"/>',
                   "revolute")  # fmt: skip
    follower = joint("k", "a", "c", '<mimic joint="j" multiplier="-0.5" offset="0.1"/>', "revolute")
    described = describe(tmp_path, link("a"), link("b"), link("c"), leader, follower)
    limits = {j.name: (j.lower, j.upper) for j in described.joints}
    assert limits["k"] == pytest.approx((-0.9, 0.6))
    with pytest.raises(AssetError, match=r"a\.urdf:4:1: .*'j' has no limits; give it a <limit>"):
        describe(tmp_path, link("a"), link("b"), joint("j", "a", "b", kind="revolute"))


@pytest.mark.parametrize(("rgba", "base", "vertex"), [
    ("1 0 0 1", (1.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
    ("1 1 1 1", (1.0, 1.0, 1.0), (0.0, 1.0, 0.0)),
])  # fmt: skip
def test_a_colour_of_the_description_replaces_colours_of_vertices_but_white_does_not(
    tmp_path: Path, rgba: str, base: tuple[float, ...], vertex: tuple[float, ...]
) -> None:
    """Red over green vertices is red, not their product, which is black."""
    lines = [f"v {x} {y} 0 0 1 0" for x, y in ((0, 0), (1, 0), (0, 1))]
    (tmp_path / "a.obj").write_text("\n".join([*lines, "f 1 2 3\n"]))
    mesh = '<geometry><mesh filename="a.obj"/></geometry>'
    material = f'<material name="m"><color rgba="{rgba}"/></material>'
    described = describe(tmp_path, link("a", visual(material, mesh)))
    soup = read_shape(Folder(tmp_path), described.links["a"].visuals[0], SE3()).soup
    assert soup.slots[0].material.base_color == base
    assert soup.colors is not None
    assert (soup.colors == vertex).all()


def test_colours_beyond_1_are_limited_and_named(tmp_path: Path) -> None:
    """RViz limits them as well: of 255 0 0, red remains."""
    own = '<material name="m"><color rgba="255 0 -1 1.5"/></material>'
    described = describe(tmp_path, link("a", visual(own)))
    (shape,) = described.links["a"].visuals
    assert (shape.look.color, shape.look.opacity) == ((1.0, 0.0, 0.0), 1.0)
    (remark,) = described.remarks
    assert remark.startswith("rgba '255 0 -1 1.5':2:")
    assert remark.endswith("is limited to [0, 1]")


@pytest.mark.parametrize(("inside", "kind", "remark"), [
    ('<limit effort="9" velocity="1"/>', "revolute",
     "joint 'j':4:1 does not move: its limits are both 0"),
    ('<limit lower="-inf" upper="inf"/>', "prismatic",
     "joint 'j':4:1: limits of -inf and inf m are none; it stays at its origin"),
    ('<limit lower="0" upper="1e16"/>', "prismatic",
     "joint 'j':4:1: limits of 0 and 1e+16 m are none; it stays at its origin"),
    ('<limit lower="0" upper="1"/><safety_controller soft_upper_limit="0.5" k_velocity="1"/>',
     "revolute", "not used: 1 <safety_controller>"),
])  # fmt: skip
def test_limits_that_have_another_effect_than_their_numbers_are_named(
    tmp_path: Path, inside: str, kind: str, remark: str
) -> None:
    described = describe(tmp_path, link("a"), link("b"), joint("j", "a", "b", inside, kind))
    assert described.remarks == (remark,)
    (found,) = described.joints
    assert found.movable == ("stays" not in remark)
    assert math.isfinite(found.lower) and math.isfinite(found.upper)


def test_as_an_object_joints_keep_their_limits_and_follow_those_that_they_mimic(
    tmp_path: Path,
) -> None:
    """A knee of -2.8 to -1.2 rad is at -2.0; fingers that mimic 0 are at their offset of 0.03 m."""
    parts = [link(name, visual()) for name in ("hip", "shin", "left", "right")]
    slides = '<limit lower="0" upper="0.05"/>'
    library = seen(
        tmp_path, *parts,
        joint("knee", "hip", "shin", '<limit lower="-2.8" upper="-1.2"/>', "revolute"),
        joint("a", "hip", "left", slides, "prismatic"),
        joint("b", "hip", "right", f'{slides}<mimic joint="a" multiplier="-1" offset="0.03"/>',
              "prismatic"),
    )  # fmt: skip
    described = read_description(Folder(tmp_path), "a.urdf")
    poses = described.poses_at_rest()
    turn = np.array([[math.cos(-2.0), -math.sin(-2.0)], [math.sin(-2.0), math.cos(-2.0)]])
    np.testing.assert_allclose(poses["shin"].rotation()[:2, :2], turn, atol=1e-8)
    assert poses["left"].translation_m == (0.0, 0.0, 0.0)
    assert poses["right"].translation_m == pytest.approx((0.0, 0.0, 0.03))
    # Boxes of 0.3 m height, the right one 3 cm higher.
    low, high = library.bounds_m("user/a")
    assert high[2] - low[2] == pytest.approx(0.33)


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_floating_and_planar_joints_stay_at_their_origin(tmp_path: Path, kind: str) -> None:
    """The robot is read; a remark names the joint and its line."""
    described = describe(
        tmp_path, link("a"), link("b"),
        joint("j", "a", "b", '<origin xyz="0 0 1"/>', kind),
    )  # fmt: skip
    assert described.joints[0].kind == "fixed"
    assert described.poses_at_rest()["b"].translation_m == (0.0, 0.0, 1.0)
    assert described.remarks == (f"joint 'j':4:1 is {kind} and stays at its origin",)


@pytest.mark.parametrize(
    ("shape", "what"),
    [('<sphere radius="0"/>', "a sphere of size 0"), ('<box size="0 1 1"/>', "a box of size 0"),
     ('<cylinder radius="0.1" length="0"/>', "a cylinder of size 0"),
     ('<capsule radius="0" length="1"/>', "a capsule of size 0"), ("", "without geometry")],
)  # fmt: skip
def test_markers_without_volume_are_left_out_by_name(tmp_path: Path, shape: str, what: str) -> None:
    """Contact points of legs are spheres of radius 0; the robot around them is used."""
    marker = link("contact", collision=f"<geometry>{shape}</geometry>")
    described = describe(tmp_path, link("a", visual()), marker, joint("j", "a", "contact"))
    assert described.links["contact"].collisions == ()
    (remark,) = described.remarks
    assert "link 'contact':3:22: <collision>" in remark
    assert what in remark
    assert "left out" in remark


@pytest.mark.parametrize(
    "shape", ['<sphere radius="-1"/>', '<box size="1 -1 1"/>', '<cylinder radius="1" length="-1"/>']
)
def test_negative_sizes_are_refused_with_link_and_line(tmp_path: Path, shape: str) -> None:
    """They are slips of the pen, and their meaning cannot be guessed."""
    with pytest.raises(AssetError, match=r"a\.urdf:3:\d+: .*link 'b': <collision>: .* size -1"):
        describe(tmp_path, link("a"), link("b", collision=f"<geometry>{shape}</geometry>"))


@pytest.mark.parametrize(
    "part",
    ['<xacro:include filename="$(find r)/gripper.xacro"/>', '<xacro:gripper parent="a"/>',
     link("b", visual(geometry='<geometry><box size="${w} 1 1"/></geometry>')),
     '<link name="$(arg prefix)b"/>'],
)  # fmt: skip
def test_a_xacro_file_is_refused_with_the_command_for_it(tmp_path: Path, part: str) -> None:
    """At the line of the first macro or expression."""
    (tmp_path / "a.urdf").write_text(
        f'<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">\n{part}\n{link("a")}\n</robot>'
    )
    with pytest.raises(AssetError, match=r"a\.urdf:2:\d+: .*xacro a\.urdf\.xacro > a\.urdf$"):
        read_description(Folder(tmp_path), "a.urdf")


PACKAGED = link("a", visual(geometry='<geometry><mesh filename="package://arm_description/meshes/'
                'a.obj"/></geometry>'))  # fmt: skip


@pytest.mark.parametrize(
    ("urdf", "mesh", "xml"),
    [("urdf/a.urdf", "meshes/a.obj", "package.xml"),
     ("src/arm/urdf/a.urdf", "src/arm/meshes/a.obj", "src/arm/package.xml"),
     ("a.urdf", "arm_description/meshes/a.obj", ""),
     ("one/urdf/a.urdf", "arm_description/meshes/a.obj", ""), ("urdf/a.urdf", "meshes/a.obj", "")],
)  # fmt: skip
def test_a_ros_package_is_an_asset_folder(tmp_path: Path, urdf: str, mesh: str, xml: str) -> None:
    """Whatever its folder is called: ``package.xml`` names it."""
    (tmp_path / mesh).parent.mkdir(parents=True)
    (tmp_path / mesh).write_text(TETRAHEDRON)
    if xml:
        text = "<package><name>arm_description</name></package>"
        (tmp_path / xml).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / xml).write_text(text)
    assert describe(tmp_path, PACKAGED, file=urdf).files() == (mesh,)


def test_a_third_slash_of_a_package_uri_counts_nothing_but_a_name_does(tmp_path: Path) -> None:
    """``package.xml`` has another name: the path that is looked for is the one in that package."""
    (tmp_path / "arm_description/meshes").mkdir(parents=True)
    (tmp_path / "arm_description/meshes/a.obj").write_text(TETRAHEDRON)
    described = describe(tmp_path, PACKAGED.replace("package://", "package:///"))
    assert described.files() == ("arm_description/meshes/a.obj",)
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/a.obj").write_text(TETRAHEDRON)
    (tmp_path / "package.xml").write_text("<package><name>other</name></package>")
    (tmp_path / "arm_description").rename(tmp_path / "elsewhere")
    described = describe(tmp_path, PACKAGED, file="urdf/a.urdf")
    assert described.files() == ("urdf/arm_description/meshes/a.obj",)


def test_links_named_with_slashes_have_meshes(tmp_path: Path) -> None:
    """Slashes separate a link from its robot in ids."""
    describe(tmp_path, link("left/hand", visual()))
    (tmp_path / "assets.yaml").write_text("robots: [{id: r, file: a.urdf}]\n")
    library = open_library([tmp_path], tmp_path / "cache", tmp_path)
    assert library.robot("user/r").links == ("left_hand",)
    assert len(library.mesh("user/r/left_hand").faces) == 12


def test_y_of_a_gltf_mesh_points_up_in_a_description(tmp_path: Path) -> None:
    """Y of the file is Z of the link, as in RViz (ros2/rviz pull request 1482) and Drake.

    A box whose lowest corner is (0, 0, 0) and whose highest is (1, 2, 3): Z of the file becomes -Y.
    The scale counts along the link's axes.
    """
    box = trimesh.creation.box(bounds=[(0.0, 0.0, 0.0), (1.0, 2.0, 3.0)])
    (tmp_path / "a.glb").write_bytes(box.export(file_type="glb"))
    mesh = '<geometry><mesh filename="a.glb" scale="1 1 10"/></geometry>'
    (link_a,) = describe(tmp_path, link("a", visual(geometry=mesh))).links.values()
    source = read_shape(Folder(tmp_path), link_a.visuals[0], SE3())
    corners = source.soup.corners.reshape(-1, 3)
    assert corners.min(axis=0) == pytest.approx([0.0, -3.0, 0.0])
    assert corners.max(axis=0) == pytest.approx([1.0, 0.0, 20.0])
