"""A user's own folder: with an index, and without."""

import os
from pathlib import Path
from unittest.mock import Mock

import cv2
import numpy as np
import pytest
import trimesh
from PIL import Image

from gen_data.assets import asset_folder
from gen_data.assets.folder_index import MeshEntry
from gen_data.assets.importer import upright_transform
from gen_data.assets.library import Library, open_library
from gen_data.assets.triangle_soup import box
from gen_data.core.asset_types import Symmetry
from gen_data.core.errors import AssetError, ConfigError, UnknownAsset
from gen_data.core.kinematics import link_poses
from gen_data.core.se3 import SE3

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
    """A box as a mesh file in the format of the suffix."""
    path.parent.mkdir(parents=True, exist_ok=True)
    corners = box(size)
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    data = mesh.export(file_type=path.suffix[1:])
    path.write_bytes(data if isinstance(data, bytes) else data.encode())


def opened(folder: Path) -> Library:
    return open_library([folder], cache_dir=folder.parent / "cache")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    root = tmp_path / "props"
    root.mkdir()
    return root


def test_an_index_says_what_files_are(folder: Path) -> None:
    """Size, axes, category, tags, mass, material and origin of one entry."""
    write_box(folder / "meshes/crate.stl", (40.0, 60.0, 20.0))
    (folder / "assets.yaml").write_text(
        "licence: CC0-1.0\nauthor: Someone\nsource: workshop\n"
        "assets:\n"
        "  - {id: crate, file: meshes/crate.stl, category: wooden crate, tags: [graspable],\n"
        "     size_m: 0.3, up: y, mass_kg: 2.5, stackable: true, origin: floor, author: Else,\n"
        "     materials: {'*': {base_color: [0.1, 0.2, 0.3], roughness: 0.7}}}\n"
    )
    library = opened(folder)
    asset = library.get("user/crate")
    assert (asset.category, asset.mass_kg, asset.stackable) == ("wooden crate", 2.5, True)
    assert (asset.licence, asset.author, asset.source) == ("CC0-1.0", "Else", "workshop")
    assert asset.tags == ("graspable", "user", "wooden_crate")
    low, high = library.bounds_m("user/crate")
    # 40 x 60 x 20 with Y up: the longest edge, 60, stands and is 0.3 m.
    assert low == pytest.approx((-0.1, -0.05, 0.0), abs=1e-6)
    assert high == pytest.approx((0.1, 0.05, 0.3), abs=1e-6)
    (material,) = library.materials("user/crate")
    assert (material.base_color, material.roughness) == ((0.1, 0.2, 0.3), 0.7)
    assert [a.asset_id for a in library.find({"wooden_crate", "graspable"})] == ["user/crate"]


def test_a_folder_without_an_index_offers_every_mesh_and_panorama(folder: Path) -> None:
    """Category is the folder's name; files that are not meshes are skipped."""
    write_box(folder / "nut.stl", (0.02, 0.02, 0.01))
    write_box(folder / "bolts/m8 long.obj", (0.01, 0.01, 0.05))
    (folder / "notes.txt").write_text("nothing")
    cv2.imwrite(str(folder / "hall.hdr"), np.full((8, 16, 3), 2.0, np.float32))
    library = opened(folder)
    assert library.get("user/nut").category == "props"
    bolt = library.get("user/bolts/m8_long")
    assert (bolt.category, bolt.tags) == ("bolts", ("bolts", "user"))
    assert library.bounds_m(bolt.asset_id)[1] == pytest.approx((0.005, 0.005, 0.025))
    assert "user/hall" in [asset.asset_id for asset in library.find({"user"}, "environment")]


def test_a_wrong_index_is_told_with_line_and_column(folder: Path) -> None:
    """All faults at once, as everywhere in the configuration."""
    (folder / "assets.yaml").write_text(
        "assets:\n  - {id: a, file: a.obj, category: x, size_m: -1}\n  - {id: b, flie: b.obj}\n"
    )
    library = opened(folder)
    with pytest.raises(ConfigError) as told:
        library.get("user/a")
    message = str(told.value)
    assert "assets.yaml:2:" in message
    assert "size_m" in message
    assert "flie" in message


def test_a_changed_file_is_another_asset(folder: Path) -> None:
    """The content hash follows the bytes, and the cache follows the hash."""
    write_box(folder / "cup.stl", (0.1, 0.1, 0.1))
    before = opened(folder)
    digest = before.get("user/cup").sha256
    before.mesh("user/cup")
    write_box(folder / "cup.stl", (0.1, 0.1, 0.25))
    after = opened(folder)
    assert after.get("user/cup").sha256 != digest
    assert after.bounds_m("user/cup")[1][2] == pytest.approx(0.125)


def test_a_users_robot_is_as_good_as_ours(folder: Path) -> None:
    (folder / "arm.urdf").write_text(ARM)
    (folder / "assets.yaml").write_text(
        "robots: [{id: arm, file: arm.urdf, tags: [arm], licence: MIT, author: me, source: here}]\n"
    )
    library = opened(folder)
    robot = library.robot("user/arm")
    assert (robot.links, robot.home) == (("base", "upper", "tip"), (1.0,))
    assert robot.movable[0].axis == (0.0, 1.0, 0.0)
    assert ("upper", "tip") in robot.no_collide
    assert ("base", "tip") in robot.no_collide
    assert "tip" not in robot.collisions
    assert library.bounds_m("user/arm/upper")[1] == pytest.approx((0.03, 0.03, 0.4))
    assert library.materials("user/arm/base")[0].base_color == (0.85, 0.0, 0.0)
    with pytest.raises(AssetError, match="without collision geometry"):
        library.convex_parts("user/arm/tip")
    (folder / "assets.yaml").write_text("robots: [{id: b, file: arm.urdf, home: {sholder: 1.0}}]\n")
    with pytest.raises(AssetError, match="did you mean 'shoulder'"):
        opened(folder).robot("user/b")


def test_textures_and_panoramas_can_be_listed(folder: Path) -> None:
    import cv2

    Image.fromarray(np.full((8, 8, 3), 200, np.uint8)).save(folder / "grey.jpg", quality=100)
    pixels = np.full((16, 32, 3), 4.0, np.float32)
    pixels[:8] = 12.0
    cv2.imwrite(str(folder / "sky.hdr"), pixels)
    (folder / "assets.yaml").write_text(
        "textures: [{id: grey, file: grey.jpg, tags: [surface]}]\n"
        "environments: [{id: sky, file: sky.hdr}]\n"
    )
    library = opened(folder)
    assert library.texture("user/grey").albedo == pytest.approx(200, abs=2)
    assert [a.asset_id for a in library.find({"surface"}, "texture")][-1] == "user/grey"
    radiance = library.environment("user/sky")
    # Both hemispheres weigh the same: (12 + 4) / 2 = 8.
    assert radiance[0, 0] == pytest.approx([1.5] * 3, rel=0.01)
    assert radiance[-1, 0] == pytest.approx([0.5] * 3, rel=0.01)
    with pytest.raises(AssetError, match="not a texture"):
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


def test_a_mimic_joint_has_its_multiplier_and_offset_and_stands_nowhere_else(folder: Path) -> None:
    """At home 0.3 the follower is at -1 * 0.3 + 0.1 = -0.2, and its link is turned so far."""
    (folder / "hand.urdf").write_text(HAND)
    (folder / "assets.yaml").write_text(HAND_INDEX % "finger: 0.3")
    robot = opened(folder).robot("user/hand")
    assert robot.home == pytest.approx((0.3, -0.2))
    poses = link_poses(robot, SE3(), robot.home)
    assert poses["right"].quaternion_wxyz == pytest.approx((0.99500417, 0.0, 0.0, -0.09983342))
    # Home positions that contradict the URDF are refused.
    (folder / "hand.urdf").write_text(HAND)
    (folder / "assets.yaml").write_text(HAND_INDEX % "finger: 0.3, knuckle: 0.3")
    with pytest.raises(AssetError, match=r"'knuckle' contradicts -0\.2 by its leader 'finger'"):
        opened(folder).robot("user/hand")


@pytest.mark.parametrize(
    ("mimic", "fault"),
    [('joint="fingr"', r"hand\.urdf:7:3: .*'knuckle' mimics 'fingr'.*did you mean 'finger'"),
     ('joint="knuckle"', r"hand\.urdf:7:3: .*'knuckle' mimics itself"),
     ('joint="finger" multiplier="x"', r"hand\.urdf:7:3: .*could not convert .*'x'"),
     ('joint="finger" offset="nan"', r"hand\.urdf:7:3: .*'nan' is not a number")],
)  # fmt: skip
def test_a_wrong_mimic_is_told_in_place(folder: Path, mimic: str, fault: str) -> None:
    """File, line and column of the joint."""
    changed = HAND.replace('joint="finger" multiplier="-1" offset="0.1"', mimic)
    (folder / "hand.urdf").write_text(changed)
    (folder / "assets.yaml").write_text(HAND_INDEX % "")
    with pytest.raises(AssetError, match=fault):
        opened(folder).robot("user/hand")


def sized(folder: Path, entry: str, name: str = "a.obj") -> tuple[float, ...]:
    """Edges of the asset that an index entry makes of a box of 1 x 2 x 3 units."""
    write_box(folder / name, (1.0, 2.0, 3.0))
    (folder / "assets.yaml").write_text(f"assets: [{{id: a, file: {name}, {entry}}}]\n")
    low, high = opened(folder).bounds_m("user/a")
    return tuple(b - a for a, b in zip(low, high, strict=True))


@pytest.mark.parametrize(
    ("entry", "size"),
    [("unit: cm", (0.01, 0.02, 0.03)), ("unit: in", (0.0254, 0.0508, 0.0762)),
     ("size_m: [0.1, 0.2, 0.3]", (0.1, 0.2, 0.3)), ("size_m: 0.6, up: y", (0.2, 0.6, 0.4)),
     ("size_m: 0.6, up: x", (0.6, 0.4, 0.2)), ("front: y", (2.0, 1.0, 3.0)),
     ("front: -z, up: y", (3.0, 1.0, 2.0))],
)  # fmt: skip
def test_units_and_axes(folder: Path, entry: str, size: tuple[float, ...]) -> None:
    """By hand for a box of 1 x 2 x 3: the up axis becomes Z, the front axis X."""
    assert sized(folder, entry) == pytest.approx(size, rel=1e-6)


@pytest.mark.parametrize(("up", "front"), [("z", "-y"), ("y", "z"), ("y", "-x"), ("x", "y")])
def test_axes_that_are_named_come_to_z_and_x(up: str, front: str) -> None:
    """It is a rotation: nothing is mirrored."""
    names = {"x": (1.0, 0, 0), "y": (0, 1.0, 0), "z": (0, 0, 1.0), "-x": (-1.0, 0, 0),
             "-y": (0, -1.0, 0), "-z": (0, 0, -1.0)}  # fmt: skip
    turn = upright_transform(MeshEntry.model_validate({"file": "a.obj", "up": up, "front": front}))[
        :, :3
    ]
    assert turn @ names[up] == pytest.approx((0, 0, 1))
    assert turn @ names[front] == pytest.approx((1, 0, 0))
    assert np.linalg.det(turn) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("entry", "fault"),
    [("size_m: 1, unit: mm", "size_m or unit, not both"), ("size_m: 1, scale: 2", "not both"),
     ("scale: 2, unit: mm", "scale or unit, not both"),
     ("front: x, yaw_deg: 90", "front or yaw_deg, not both"),
     ("front: -z", "front is -z, but z points up"), ("unit: yards", "unit"),
     ("symmetries: [{axis: [0, 0, 0]}]", "an axis with non-zero length"),
     ("symmetries: [{axis: z, fold: 1}]", "fold"),
     ("materials: {'*': {maps: {}}}", "expected an image"),
     ("materials: {'*': {maps: {orm: a.png, metallic: b.png}}}", "not both")],
)  # fmt: skip
def test_a_contradiction_is_told_in_place(folder: Path, entry: str, fault: str) -> None:
    with pytest.raises(ConfigError, match=rf"(?s)assets\.yaml:1:\d+: assets\[0\].*{fault}"):
        sized(folder, entry)


def test_edges_that_do_not_fit_a_file_and_images_without_place_are_refused(folder: Path) -> None:
    """An STL has no texture coordinates."""
    with pytest.raises(AssetError, match=r"0\.1 x 0\.2 x 0\.3 m, not 0\.1 x 0\.3 x 0\.2 m"):
        sized(folder, "size_m: [0.1, 0.3, 0.2]")
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(folder / "w.png")
    with pytest.raises(AssetError, match="no texture coordinates; give texture_scale_m"):
        sized(folder, "materials: {'*': {maps: {color: w.png}}}", "a.stl")


@pytest.mark.slow
def test_a_pattern_stands_for_every_file_that_matches(folder: Path) -> None:
    """Ids and categories follow from paths; the rest of the entry holds for all."""
    for name in ("bolts/m8.stl", "bolts/long/m10.STL", "nuts/m8.stl", "nut.stl", ".git/x.stl"):
        write_box(folder / name, (10.0, 10.0, 20.0))
    (folder / "assets.yaml").write_text(
        "assets:\n  - {file: bolts/**/*.stl, unit: mm, tags: [metal]}\n"
        "  - {file: n*/m?.stl, category: nut, unit: cm}\n"
    )
    library = opened(folder)
    (nut,) = library.find({"nut", "user"})
    assert (nut.asset_id, nut.tags) == ("user/nuts/m8", ("nut", "user"))
    bolts = {asset.asset_id: asset.category for asset in library.find({"metal"})}
    assert bolts == {"user/bolts/m8": "bolts", "user/bolts/long/m10": "long"}
    assert library.bounds_m("user/bolts/m8")[1] == pytest.approx((0.005, 0.005, 0.01))
    assert "user/nut" not in library.find(())


@pytest.mark.parametrize(
    ("entry", "fault"),
    [
        ("{id: a, file: cap.stl}",
         r"2:19: assets\[0\]\.file: 'cap\.stl': no such file .*'cup\.stl'"),
        ("{file: '*.obj'}", r"2:12: assets\[0\]\.file: '\*\.obj': matches no file; .* 1 \.stl"),
        ("{id: a, file: cup.stl, materials: {x: {maps: {color: w.png}}}}",
         r"2:58: assets\[0\]\.materials\.x\.maps\.color: 'w\.png': no such file"),
        ("{file: ../cup.stl}",
         r"2:12: assets\[0\]\.file: '\.\./cup\.stl': is outside of the folder; expected a file in"),
        ("{file: /tmp/cup.stl}",
         r"2:12: assets\[0\]\.file: '/tmp/cup\.stl': is outside of the folder"),
    ],
)  # fmt: skip
def test_a_missing_file_is_told_in_place(folder: Path, entry: str, fault: str) -> None:
    """The message suggests the nearest name, or summarises the folder."""
    write_box(folder / "cup.stl", (0.1, 0.1, 0.1))
    (folder / "assets.yaml").write_text(f"assets:\n  - {entry}\n")
    with pytest.raises(ConfigError, match=rf"assets\.yaml:{fault}"):
        opened(folder).get("user/a")


def test_symmetries_and_keypoints_belong_to_the_asset(folder: Path) -> None:
    """A square box: quarter turns about Z, and every angle about a slanted axis of length 1."""
    write_box(folder / "a.stl", (0.1, 0.1, 0.2))
    (folder / "assets.yaml").write_text(
        "assets:\n  - file: a.stl\n    symmetries: [{axis: z, fold: 4}, {axis: [0, 3, 4]}]\n"
        "    keypoints: [{name: lid, position_m: [0, 0, 0.1]}]\n"
    )
    library = opened(folder)
    assert library.get("user/a").symmetries == (
        Symmetry((0.0, 0.0, 1.0), 4),
        Symmetry((0.0, 0.6, 0.8), 0),
    )
    assert library.keypoints("user/a")[0].name == "lid"


def test_images_of_a_folder_cover_a_mesh_and_make_textures(folder: Path) -> None:
    """Occlusion, roughness and metallic are red, green and blue of one image."""
    write_box(folder / "a.stl", (0.1, 0.1, 0.2))
    for name, color in (("color", (200, 100, 50)), ("orm", (10, 20, 30)), ("n", (128, 128, 255))):
        Image.fromarray(np.full((4, 4, 3), color, np.uint8)).save(folder / f"{name}.png")
    maps = "{color: color.png, orm: orm.png, normal: n.png}"
    (folder / "assets.yaml").write_text(
        f"assets: [{{file: a.stl, materials: {{'*': {{maps: {maps}, texture_scale_m: 0.2}}}}}}]\n"
        f"textures: [{{id: steel, maps: {maps}}}]\n"
    )
    library = opened(folder)
    (material,) = library.materials("user/a")
    assert (material.base_color, material.roughness, material.metallic) == ((1, 1, 1), 1, 1)
    assert material.texture_scale_m == 0.2
    for texture_id in (material.texture, "user/steel"):
        images = library.texture(texture_id)
        assert images.albedo[0, 0].tolist() == [200, 100, 50]
        assert images.normal is not None
        channels = (images.occlusion, images.roughness, images.metallic)
        assert [image[0, 0] for image in channels if image is not None] == [10, 20, 30]
    digest = library.get("user/a").sha256
    Image.fromarray(np.full((4, 4, 3), 7, np.uint8)).save(folder / "orm.png")
    assert opened(folder).get("user/a").sha256 != digest


def test_an_unknown_id_tells_what_the_folders_hold(folder: Path) -> None:
    """The nearest id, with and without ``user/``; else a count by kind, and some ids."""
    for name in ("cup", "plate"):
        write_box(folder / f"{name}.stl", (0.1, 0.1, 0.1))
    library = opened(folder)
    with pytest.raises(UnknownAsset, match="did you mean 'user/plate'"):
        library.get("user/plates")
    with pytest.raises(UnknownAsset, match="did you mean 'user/plate'"):
        library.get("plaate")
    with pytest.raises(UnknownAsset, match="hold 2 objects: user/cup, user/plate"):
        library.get("user/something_else")


def test_endless_unreadable_and_foreign_folders_are_refused_by_name(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """/proc is endless, changes while it is read, and holds unreadable files."""
    with pytest.raises(AssetError, match=r"/proc"):
        open_library([Path("/proc")], cache_dir=folder.parent / "cache").find({"user"})
    for k in range(6):
        (folder / f"{k}.txt").write_text("")
    with monkeypatch.context() as patch:
        patch.setattr(asset_folder, "MAX_ENTRIES", 5)
        with pytest.raises(AssetError, match="more than 5 files and folders"):
            opened(folder).find({"user"})
    error = PermissionError(13, "Permission denied", str(folder / "locked"))
    monkeypatch.setattr(os, "scandir", Mock(side_effect=error))
    with pytest.raises(AssetError, match=r"locked: Permission denied; all folders"):
        asset_folder.list_files(folder)


def write_car(path: Path) -> None:
    """A body of 4 x 1.8 x 1.5 m and two parts called mirrors, which make it 2.2 m wide."""
    scene = trimesh.Scene()
    for name, size, at in (
        ("Body", (4.0, 1.8, 1.5), (0.0, 0.0, 0.0)),
        ("Side_Mirror_L", (0.1, 0.2, 0.2), (1.0, 1.0, 0.3)),
        ("SideMirror_R", (0.1, 0.2, 0.2), (1.0, -1.0, 0.3)),
    ):
        made = trimesh.Trimesh(
            box(size).reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False
        )
        scene.add_geometry(made.apply_translation(at), name, name)
    data = scene.export(file_type=path.suffix[1:])
    path.write_bytes(data if isinstance(data, bytes) else data.encode())


@pytest.mark.parametrize("suffix", ["obj", "glb"])
def test_mirrors_are_outside_the_body_of_a_vehicle(folder: Path, suffix: str) -> None:
    """A cabinet with the same parts is measured with its mirrors."""
    write_car(folder / f"a.{suffix}")
    (folder / "assets.yaml").write_text(
        f"assets:\n  - {{id: car, file: a.{suffix}, category: car, up: z, front: x}}\n"
        f"  - {{id: cabinet, file: a.{suffix}, category: cabinet, up: z, front: x}}\n"
    )
    for _ in range(2):  # The second library reads the cache.
        library = opened(folder)
        low, high = library.bounds_m("user/car")
        assert np.subtract(high, low) == pytest.approx((4.0, 2.2, 1.5), abs=1e-5)
        bounds = library.body_bounds_m("user/car")
        assert bounds is not None
        assert np.subtract(bounds[1], bounds[0]) == pytest.approx((4.0, 1.8, 1.5), abs=1e-5)
        assert library.body_bounds_m("user/cabinet") is None


def test_a_vehicle_without_named_mirrors_is_measured_whole(folder: Path) -> None:
    """So is one that consists of a mirror alone."""
    write_box(folder / "car/plain.obj", (4.0, 1.8, 1.5))
    (folder / "car/all.obj").write_text(
        "o wing mirror\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    )
    library = opened(folder)
    assert library.get("user/car/plain").category == "car"
    assert library.body_bounds_m("user/car/plain") is None
    assert library.body_bounds_m("user/car/all") is None
