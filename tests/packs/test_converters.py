"""From packages to assets, tried on packages of one or two members."""

import base64
import json
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.assets import image_decoding, installed_packs
from gen_data.assets.library import Library, open_library
from gen_data.content.packs import panoramas, robosuite, sweethome3d
from gen_data.content.packs.sweethome3d import (
    Group,
    Lamp,
    Model,
    ModelChoice,
    mesh_entry,
    read_selection,
)
from gen_data.core import errors, kinematics, se3
from tests.packs.converters import BOX

FACTS = """
name#7=Caf\xe9 box
model#7=/things/box/box.obj
width#7=20
depth#7=10.0
height#7=40
creator#7=A. Modeller
"""


def test_the_selection_is_sound() -> None:
    """Ids are unique, every finish that is named exists, every model has a category."""
    selection = read_selection()
    chosen = [(group, choice) for group in selection.groups.values() for choice in group.models]
    ids = [choice.id for _, choice in chosen]
    assert len(ids) == len(set(ids)) > 250
    for group, choice in chosen:
        entry = mesh_entry(choice, group, _model(Path()), selection.finishes)
        assert entry.category and installed_packs.TAG in entry.tags, choice.id


def test_every_vehicle_that_drives_has_wheels_in_order() -> None:
    """Front before rear, left before right, on the side in their name (left is +Y)."""
    selection = read_selection()
    vehicles = selection.groups["vehicles"]
    driving = {"car", "van", "truck", "bus"}
    for choice in vehicles.models:
        entry = mesh_entry(choice, vehicles, _model(Path()), selection.finishes)
        points = {point.name: point.position_m for point in entry.keypoints}
        if entry.category in driving:
            assert list(points) == [
                f"{what}_{side}"
                for what in ("wheel_front", "wheel_rear", "headlight", "taillight")
                for side in ("left", "right")
            ], choice.id
            for name, (x, y, z) in points.items():
                assert (x > 0) == ("front" in name or "headlight" in name), (choice.id, name)
                assert (y > 0) == name.endswith("left"), (choice.id, name)
                assert z > 0
            wheelbase_m = points["wheel_front_left"][0] - points["wheel_rear_left"][0]
            assert 1.7 < wheelbase_m < 18.0, choice.id


def test_only_standing_people_are_pedestrians() -> None:
    """Sitting and lying people are not placed on pavements."""
    people = read_selection().groups["people"].models
    assert len(people) == 29
    for choice in people:
        assert (choice.attributes["pose"] == "standing") == ("pedestrian" in choice.tags)


def _model(folder: Path) -> Model:
    return Model(folder, (0.2, 0.1, 0.4), "A. Modeller", "CC-BY-3.0")


def test_sizes_and_creators_come_from_the_package(tmp_path: Path) -> None:
    """Centimetres in Latin-1 properties; the licence by the zip."""
    for name in ("Scopia.sh3f", "BlendSwap-CC-0.sh3f"):
        (tmp_path / name).mkdir()
        data = FACTS.replace("things", name[:3]).encode("latin-1")
        (tmp_path / name / "PluginFurnitureCatalog.properties").write_bytes(data)
    models = sweethome3d.read_models(tmp_path)
    assert models["Sco/box/box.obj"].size_m == (0.2, 0.1, 0.4)
    assert models["Sco/box/box.obj"].creator == "A. Modeller"
    assert models["Sco/box/box.obj"].licence.startswith("CC-BY-3.0")
    assert models["Ble/box/box.obj"].licence == "CC0-1.0"


def test_the_hub_of_a_wheel_stands_for_two_which_count_as_seen_from_the_side_and_ahead() -> None:
    """A hub 0.3 m high in a tyre 0.2 m wide: 0.1 m deep from the side, 0.3 m from ahead.

    The far hub, 1.4 m behind the near one, is hidden either way.
    """
    choice = ModelChoice(
        id="car", category="car", model="car.obj", keypoints={"wheel_front": (1.2, 0.7, 0.3)}
    )
    left, right = mesh_entry(choice, Group(models=()), _model(Path()), {}).keypoints

    assert (left.name, left.position_m) == ("wheel_front_left", (1.2, 0.7, 0.3))
    assert (right.name, right.position_m) == ("wheel_front_right", (1.2, -0.7, 0.3))
    assert 0.3 < left.radius_m == right.radius_m < 1.4 - 0.2


def test_what_fits_between_fingers_is_graspable() -> None:
    """One of its edges must be at most 7 cm; the package states 20 x 10 x 40 cm."""
    choice = ModelChoice(id="mug", category="mug", model="mug.obj")
    for size_m, graspable in ((None, False), (0.28, True)):
        sized = choice.model_copy(update={"size_m": size_m})
        entry = mesh_entry(sized, Group(tags=("household",), models=()), _model(Path()), {})
        assert ("graspable" in entry.tags) == graspable


def test_lamps_are_cut_out_on_both_sides() -> None:
    """Two boxes, mirrored at the middle."""
    selection = read_selection()
    lamp = Lamp(material="m", finish="headlight", low_m=(1, 0.4, 0.5), high_m=(2, 0.9, 0.8))
    choice = ModelChoice(id="car", category="car", model="car.obj", lamps=(lamp,))
    regions = mesh_entry(choice, Group(models=()), _model(Path()), selection.finishes).regions
    assert [(r.low_m, r.high_m) for r in regions] == [
        ((1, 0.4, 0.5), (2, 0.9, 0.8)),
        ((1, -0.9, 0.5), (2, -0.4, 0.8)),
    ]


def library_with_box(tmp_path: Path, entry: dict[str, Any]) -> Library:
    """A library with ``test/box``, black and a quarter opaque, whose index entry has these keys."""
    folder = tmp_path / "packs" / "test"
    folder.mkdir(parents=True)
    (folder / "box.mtl").write_text("newmtl pane\nKd 0 0 0\nd 0.25\n", encoding="utf-8")
    text = "mtllib box.mtl\nusemtl pane\n" + BOX
    (folder / "box.obj").write_text(text, encoding="utf-8")
    entry = {"id": "box", "file": "box.obj", "category": "box", "up": "z", **entry}
    (folder / "index.json").write_text(json.dumps({"assets": [entry]}), encoding="utf-8")
    return open_library(cache_dir=tmp_path / "cache", packs=tmp_path / "packs")


@pytest.mark.slow
def test_a_region_takes_its_triangles_and_no_others(tmp_path: Path) -> None:
    """The upper face of a box becomes a lamp: 2 of 12 triangles."""
    entry = {
        "subcategory": "cube", "attributes": {"pose": "standing"},
        "keypoints": [{"name": "lamp", "position_m": [0, 0, 0.5]}],
        "regions": [{"material": "*", "low_m": [-1, -1, 0.45], "high_m": [1, 1, 0.55],
                     "finish": {"role": "lamp", "specular": 0.9}}],
    }  # fmt: skip
    library = library_with_box(tmp_path, entry)
    mesh = library.mesh("test/box")
    roles = [mesh.materials[slot].role for slot in mesh.face_slots]
    assert (len(roles), roles.count("lamp")) == (12, 2)
    asset = library.get("test/box")
    assert (asset.subcategory, asset.attributes) == ("cube", (("pose", "standing"),))
    assert [point.name for point in library.keypoints("test/box")] == ["lamp"]


@pytest.mark.parametrize(("finish", "expected"), [
    ({"base_color": [0.01, 0.01, 0.01]}, ((0.01, 0.01, 0.01), 1.0, 0.0)),
    ({"base_color": [0.5, 0.6, 0.6], "transmission": 0.9}, ((0.5, 0.6, 0.6), 1.0, 0.9)),
    ({"roughness": 0.1}, ((0.0, 0.0, 0.0), 0.25, 0.0)),
])  # fmt: skip
def test_a_finish_with_a_colour_hides_what_the_files_surface_let_through(
    finish: dict[str, object], expected: tuple[object, float, float], tmp_path: Path
) -> None:
    """A quarter opaque in the file; a finish without a colour keeps it so, or states another."""
    library = library_with_box(tmp_path, {"materials": {"pane": finish}})
    (material,) = library.mesh("test/box").materials
    assert (material.base_color, material.opacity, material.transmission) == expected


def test_a_package_without_a_selected_model_is_refused(tmp_path: Path) -> None:
    """It is another release of the catalogue."""
    with pytest.raises(errors.AssetError, match="holds no model"):
        sweethome3d.convert(tmp_path, tmp_path / "out")


def test_a_panorama_survives_the_radiance_file() -> None:
    """Read by OpenCV, within the half percent that eight bits of mantissa leave."""
    rows, columns = np.mgrid[0:8, 0:16]
    image = np.stack([rows + 0.01, columns * 100.0, 0.001 * rows * columns], axis=2)
    data = panoramas.encode_radiance(image.astype(np.float32))
    read = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)[..., ::-1]
    brightest = image.max(axis=2, keepdims=True)
    assert np.abs(read - image).max() > 0.0
    assert (np.abs(read - image) <= brightest / 256.0 + 1e-6).all()
    assert image_decoding.decode_radiance(data, "test").shape == (8, 16, 3)


def test_an_exr_in_a_script_is_read(tmp_path: Path) -> None:
    """A module that exports a data URL, as the npm package has them."""
    openexr = pytest.importorskip("OpenEXR")
    pixels = np.linspace(0.0, 40.0, 4 * 8 * 3, dtype=np.float32).reshape(4, 8, 3)
    path = tmp_path / "image.exr"
    openexr.File({"compression": openexr.ZIP_COMPRESSION}, {"RGB": pixels}).write(str(path))
    url = b"data:application/exr;base64," + base64.b64encode(path.read_bytes())
    data = panoramas.exr_bytes(b"export default '" + url + b"'", "test")
    assert np.array_equal(panoramas.read_exr(data, "test"), pixels)


@pytest.mark.parametrize("script", [b"", b"export default 1", b"base64,@@@"])
def test_a_script_without_an_image_is_an_error(script: bytes) -> None:
    with pytest.raises(errors.AssetError, match="no base64"):
        panoramas.exr_bytes(script, "test")


ARM = """<mujoco model="arm"><asset>
  <material name="blue" rgba="0 0 1 1"/><mesh name="box" file="box.obj"/></asset>
<worldbody><body name="base"><geom type="box" size="0.1 0.1 0.1"/>
  <body name="link" pos="0 0 1" quat="0 0 0 1">
    <joint name="elbow" axis="0 1 0" range="-1 2"/>
    <geom type="mesh" mesh="box" material="blue" contype="0" conaffinity="0" group="1"/>
    <body name="{flange}" pos="0 0.5 0" quat="0.5 0.5 0.5 0.5"/>
  </body></body></worldbody></mujoco>"""
HAND = """<mujoco model="hand"><worldbody><body name="gripper_base">
  <body name="left" pos="0 0.01 0.04"><joint name="l_finger_joint" type="slide" axis="0 1 0"
    range="-0.0115 0.020833"/><geom type="sphere" size="0.01"/></body>
  <body name="right" pos="0 -0.01 0.04"><joint name="r_finger_joint" type="slide" axis="0 1 0"
    range="-0.020833 0.0115"/><geom type="sphere" size="0.01"/></body>
</body></worldbody></mujoco>"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(robosuite, "ARMS", (robosuite.Arm("mini", "nobody", {"elbow": 0.5}),))
    root = tmp_path / "robosuite" / "models" / "assets"
    for name, text in (
        ("robots/mini/robot.xml", ARM.replace("{flange}", "right_hand")),
        ("robots/mini/box.obj", BOX),
        ("grippers/rethink_gripper.xml", HAND),
    ):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    return tmp_path


def test_an_mjcf_arm_becomes_a_robot(package: Path, tmp_path: Path) -> None:
    """Poses, limits and colours; the hand sits on the flange; fingers count from closed.

    Nothing is bluer than 0.85: the library's bound on the colours that files claim.
    """
    folder = tmp_path / "packs" / "robots"
    folder.mkdir(parents=True)
    robosuite.convert(package, folder)
    library = open_library(cache_dir=tmp_path / "cache", packs=tmp_path / "packs")
    robot = library.robot("robots/mini")
    elbow = robot.movable[0]
    assert (elbow.name, elbow.lower, elbow.upper) == ("elbow", -1.0, 2.0)
    assert robot.gripper is not None and robot.gripper.finger_joints == robosuite._FINGERS
    poses = kinematics.link_poses(robot, se3.SE3(), (0.0, 0.0, 0.0))
    # Half a turn about Z takes +Y to -Y; the flange's quaternion maps X to Y, Y to Z, Z to X.
    assert np.allclose(poses["gripper_base"].translation_m, (0.0, -0.5, 1.0))
    turned = poses["gripper_base"].rotation() @ np.eye(3)
    assert np.allclose(turned, np.diag([-1.0, -1.0, 1.0]) @ np.eye(3)[[2, 0, 1]])
    opened = kinematics.link_poses(robot, se3.SE3(), (0.0, 0.03, 0.03))
    for finger, side in (("left", 1.0), ("right", -1.0)):
        moved = poses["gripper_base"].inverse() @ opened[finger]
        rest = poses["gripper_base"].inverse() @ poses[finger]
        step = np.subtract(moved.translation_m, rest.translation_m)
        assert np.allclose(step, (0.0, side * 0.03, 0.0), atol=1e-9)
    assert library.materials("robots/mini/link")[0].base_color == (0.0, 0.0, 0.85)


def test_a_body_with_two_joints_is_refused(package: Path, tmp_path: Path) -> None:
    path = package / "robosuite/models/assets/robots/mini/robot.xml"
    text = path.read_text(encoding="utf-8")
    joint = '<joint name="elbow" axis="0 1 0" range="-1 2"/>'
    path.write_text(text.replace(joint, joint + joint.replace("elbow", "two")), encoding="utf-8")
    (tmp_path / "out").mkdir()
    with pytest.raises(errors.AssetError, match="only one hinge or slide"):
        robosuite.convert(package, tmp_path / "out")


def test_gimbal_lock_keeps_the_rotation(tmp_path: Path) -> None:
    """A quarter turn about Y has no unique roll and yaw, but one rotation."""
    from xml.etree.ElementTree import Element

    from gen_data.content.packs.mjcf import _add_origin

    for w, x, y, z in ((1, 0, 1, 0), (1, 0, -1, 0), (0.5, 0.5, 0.5, 0.5), (1, 2, 3, 4)):
        element = Element("visual")
        _add_origin(element, Element("geom", quat=f"{w} {x} {y} {z}"))
        roll, pitch, yaw = (float(v) for v in element[0].attrib["rpy"].split())
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        expected = se3.SE3((0, 0, 0), (w / norm, x / norm, y / norm, z / norm)).rotation()
        assert np.allclose(_about(2, yaw) @ _about(1, pitch) @ _about(0, roll), expected, atol=1e-8)


def _about(axis: int, angle: float) -> np.ndarray:
    """Rotation about a fixed axis; URDF: fixed-axis roll, pitch, yaw."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = ((1, 2), (2, 0), (0, 1))[axis]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix
