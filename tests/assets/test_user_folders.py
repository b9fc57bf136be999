"""A user's own folder: with an index, and without."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from generator.assets.library import open_library
from generator.assets.primitives import box
from generator.core.errors import AssetError, ConfigError
from generator.core.kinematics import link_poses
from generator.core.se3 import SE3

ARM = """<robot name="arm">
  <link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry>
    <material name="paint"><color rgba="1 0 0 1"/></material></visual>
    <collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>
  <link name="upper"><visual><origin xyz="0 0 0.2"/>
    <geometry><cylinder radius="0.03" length="0.4"/></geometry></visual>
    <collision><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.03" length="0.4"/></geometry>
    </collision></link>
  <link name="tip"><visual><geometry><sphere radius="0.05"/></geometry></visual></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.05"/><axis xyz="0 2 0"/><limit lower="0.5" upper="1.5"/></joint>
  <joint name="wrist" type="fixed"><parent link="upper"/><child link="tip"/>
    <origin xyz="0 0 0.4"/></joint>
</robot>"""


def write_box(path: Path, size: tuple[float, float, float]) -> None:
    """A box as a mesh file of the type that the suffix says."""
    path.parent.mkdir(parents=True, exist_ok=True)
    corners = box(size)
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    data = mesh.export(file_type=path.suffix[1:])
    path.write_bytes(data if isinstance(data, bytes) else data.encode())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An empty folder for assets."""
    root = tmp_path / "props"
    root.mkdir()
    return root


def test_an_index_says_what_files_are(folder: Path, tmp_path: Path) -> None:
    """Size, axes, category, tags, mass, material and origin of one entry."""
    write_box(folder / "meshes/crate.stl", (40.0, 60.0, 20.0))
    (folder / "assets.yaml").write_text(
        "licence: CC0-1.0\nauthor: Someone\nsource: workshop\n"
        "assets:\n"
        "  - {id: crate, file: meshes/crate.stl, category: wooden crate, tags: [graspable],\n"
        "     size_m: 0.3, up: y, mass_kg: 2.5, stackable: true, origin: floor, author: Else,\n"
        "     materials: {'*': {base_color: [0.1, 0.2, 0.3], roughness: 0.7}}}\n"
    )
    library = open_library([folder], cache_dir=tmp_path / "cache")
    asset = library.get("user/crate")
    assert (asset.category, asset.mass_kg, asset.stackable) == ("wooden crate", 2.5, True)
    assert (asset.licence, asset.author, asset.source) == ("CC0-1.0", "Else", "workshop")
    assert asset.tags == ("graspable", "wooden_crate")
    low, high = library.bounds_m("user/crate")
    # 40 x 60 x 20 with Y up: the longest edge, 60, stands and is 0.3 m.
    assert low == pytest.approx((-0.1, -0.05, 0.0), abs=1e-6)
    assert high == pytest.approx((0.1, 0.05, 0.3), abs=1e-6)
    (material,) = library.materials("user/crate")
    assert (material.base_color, material.roughness) == ((0.1, 0.2, 0.3), 0.7)
    assert [a.asset_id for a in library.find({"wooden_crate", "graspable"})] == ["user/crate"]


def test_a_folder_without_an_index_offers_every_mesh(folder: Path, tmp_path: Path) -> None:
    """Category is the folder's name; files that are no meshes are passed over."""
    write_box(folder / "nut.stl", (0.02, 0.02, 0.01))
    write_box(folder / "bolts/m8 long.obj", (0.01, 0.01, 0.05))
    (folder / "notes.txt").write_text("nothing")
    library = open_library([folder], cache_dir=tmp_path / "cache")
    assert library.get("user/nut").category == "props"
    bolt = library.get("user/bolts/m8_long")
    assert (bolt.category, bolt.tags) == ("bolts", ("bolts",))
    assert library.bounds_m(bolt.asset_id)[1] == pytest.approx((0.005, 0.005, 0.025))


def test_a_wrong_index_is_told_with_line_and_column(folder: Path, tmp_path: Path) -> None:
    """All faults at once, as everywhere in the configuration."""
    (folder / "assets.yaml").write_text(
        "assets:\n  - {id: a, file: a.obj, category: x, size_m: -1}\n  - {id: b, flie: b.obj}\n"
    )
    library = open_library([folder], cache_dir=tmp_path / "cache")
    with pytest.raises(ConfigError) as told:
        library.get("user/a")
    message = str(told.value)
    assert "assets.yaml:2:" in message
    assert "size_m" in message
    assert "flie" in message


def test_scale_and_size_exclude_each_other(folder: Path, tmp_path: Path) -> None:
    """One size."""
    (folder / "assets.yaml").write_text(
        "assets: [{id: a, file: a.obj, category: x, size_m: 1, scale: 2}]\n"
    )
    with pytest.raises(ConfigError, match="not both"):
        open_library([folder], cache_dir=tmp_path / "cache").get("user/a")


def test_two_folders_may_not_claim_one_id(tmp_path: Path) -> None:
    """Silently preferring one would make data sets differ between machines."""
    for name in ("one", "two"):
        write_box(tmp_path / name / "cup.stl", (0.1, 0.1, 0.1))
    library = open_library([tmp_path / "one", tmp_path / "two"], cache_dir=tmp_path / "cache")
    with pytest.raises(AssetError, match=r"user/cup.*one.*two"):
        library.get("user/cup")


def test_a_changed_file_is_another_asset(folder: Path, tmp_path: Path) -> None:
    """The content hash follows the bytes, and the cache follows the hash."""
    write_box(folder / "cup.stl", (0.1, 0.1, 0.1))
    before = open_library([folder], cache_dir=tmp_path / "cache")
    digest = before.get("user/cup").sha256
    before.mesh("user/cup")
    write_box(folder / "cup.stl", (0.1, 0.1, 0.25))
    after = open_library([folder], cache_dir=tmp_path / "cache")
    assert after.get("user/cup").sha256 != digest
    assert after.bounds_m("user/cup")[1][2] == pytest.approx(0.125)


def test_a_users_robot_is_as_good_as_ours(folder: Path, tmp_path: Path) -> None:
    """Primitives, fixed joints, a home position and a normalised axis."""
    (folder / "arm.urdf").write_text(ARM)
    (folder / "assets.yaml").write_text(
        "robots: [{id: arm, file: arm.urdf, tags: [arm], licence: MIT, author: me, source: here}]\n"
    )
    library = open_library([folder], cache_dir=tmp_path / "cache")
    robot = library.robot("user/arm")
    assert robot.links == ("base", "upper", "tip")
    assert robot.home == (1.0,)
    assert robot.movable[0].axis == (0.0, 1.0, 0.0)
    assert ("upper", "tip") in robot.no_collide
    assert ("base", "tip") in robot.no_collide
    assert "tip" not in robot.collisions
    assert library.bounds_m("user/arm/upper")[1] == pytest.approx((0.03, 0.03, 0.4))
    assert library.materials("user/arm/base")[0].base_color == (0.85, 0.0, 0.0)
    with pytest.raises(AssetError, match="does not collide"):
        library.convex_parts("user/arm/tip")


def test_a_robot_entry_that_names_a_missing_joint_is_refused(folder: Path, tmp_path: Path) -> None:
    """With the nearest name."""
    (folder / "arm.urdf").write_text(ARM)
    (folder / "assets.yaml").write_text(
        "robots: [{id: arm, file: arm.urdf, home: {sholder: 1.0}}]\n"
    )
    with pytest.raises(AssetError, match="did you mean 'shoulder'"):
        open_library([folder], cache_dir=tmp_path / "cache").robot("user/arm")


def test_textures_and_panoramas_can_be_listed(folder: Path, tmp_path: Path) -> None:
    """A panorama comes with mean luminance 1 over the sphere."""
    import cv2

    Image.fromarray(np.full((8, 8, 3), 200, np.uint8)).save(folder / "grey.jpg", quality=100)
    pixels = np.full((16, 32, 3), 4.0, np.float32)
    pixels[:8] = 12.0
    cv2.imwrite(str(folder / "sky.hdr"), pixels)
    (folder / "assets.yaml").write_text(
        "textures: [{id: grey, file: grey.jpg, tags: [surface]}]\n"
        "environments: [{id: sky, file: sky.hdr}]\n"
    )
    library = open_library([folder], cache_dir=tmp_path / "cache")
    assert library.texture("user/grey").albedo == pytest.approx(200, abs=2)
    assert [a.asset_id for a in library.find({"surface"}, "texture")][-1] == "user/grey"
    radiance = library.environment("user/sky")
    # Both hemispheres weigh the same: (12 + 4) / 2 = 8.
    assert radiance[0, 0] == pytest.approx([1.5] * 3, rel=0.01)
    assert radiance[-1, 0] == pytest.approx([0.5] * 3, rel=0.01)
    with pytest.raises(AssetError, match="no texture"):
        library.texture("user/sky")


HAND = """<robot name="hand">
  <link name="palm"/>
  <link name="left"><visual><geometry><box size="0.02 0.02 0.1"/></geometry></visual></link>
  <link name="right"><visual><geometry><box size="0.02 0.02 0.1"/></geometry></visual></link>
  <joint name="finger" type="revolute"><parent link="palm"/><child link="left"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.8"/></joint>
  <joint name="knuckle" type="revolute"><parent link="palm"/><child link="right"/>
    <axis xyz="0 0 1"/><limit lower="-0.9" upper="0.9"/>
    <mimic joint="finger" multiplier="-1" offset="0.1"/></joint>
</robot>"""
HAND_INDEX = "robots: [{id: hand, file: hand.urdf, home: {%s}}]\n"


def test_a_joint_that_mimics_another_has_its_multiplier_and_offset(
    folder: Path, tmp_path: Path
) -> None:
    """At home 0.3 the follower is at -1 * 0.3 + 0.1 = -0.2, and its link is turned so far."""
    (folder / "hand.urdf").write_text(HAND)
    (folder / "assets.yaml").write_text(HAND_INDEX % "finger: 0.3")
    robot = open_library([folder], cache_dir=tmp_path / "cache").robot("user/hand")
    assert robot.home == pytest.approx((0.3, -0.2))
    poses = link_poses(robot, SE3(), robot.home)
    assert poses["right"].quaternion_wxyz == pytest.approx((0.99500417, 0.0, 0.0, -0.09983342))


def test_a_follower_cannot_be_told_to_stand_elsewhere(folder: Path, tmp_path: Path) -> None:
    """Home positions that contradict the URDF are refused."""
    (folder / "hand.urdf").write_text(HAND)
    (folder / "assets.yaml").write_text(HAND_INDEX % "finger: 0.3, knuckle: 0.3")
    with pytest.raises(AssetError, match=r"'knuckle', which mimics 'finger' and is at -0\.2"):
        open_library([folder], cache_dir=tmp_path / "cache").robot("user/hand")


@pytest.mark.parametrize(
    ("mimic", "fault"),
    [
        ('joint="fingr"', r"hand\.urdf:7:3: .*'knuckle' mimics 'fingr'.*did you mean 'finger'"),
        ('joint="knuckle"', r"hand\.urdf:7:3: .*'knuckle' mimics itself"),
        ('joint="finger" multiplier="x"', r"hand\.urdf:7:3: .*could not convert .*'x'"),
        ('joint="finger" offset="nan"', r"hand\.urdf:7:3: .*'nan' is not a number"),
    ],
)
def test_a_wrong_mimic_is_refused_with_its_place(
    folder: Path, tmp_path: Path, mimic: str, fault: str
) -> None:
    """File, line and column of the joint."""
    changed = HAND.replace('joint="finger" multiplier="-1" offset="0.1"', mimic)
    (folder / "hand.urdf").write_text(changed)
    (folder / "assets.yaml").write_text(HAND_INDEX % "")
    with pytest.raises(AssetError, match=fault):
        open_library([folder], cache_dir=tmp_path / "cache").robot("user/hand")
