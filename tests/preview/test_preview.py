"""Drawings lie where the labels are."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gen_data.core.asset_types import Keypoint, Material, MeshData
from gen_data.core.boxes import BoxPx, OrientedBox
from gen_data.core.capture import POINT, Capture, Channel, PointCloud
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo, Modality, SensorInfo
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.motion import Trajectory
from gen_data.core.sample import KeypointTruth, ObjectTruth, Sample
from gen_data.core.scene import Body, Camera, Instance, Lidar, Rig, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import IDENTITY, SE3, look_at
from gen_data.core.skeletons import PERSON
from gen_data.exporters.label_colors import color_ids, id_color
from gen_data.preview.contact_sheet import GAP_PX, arrange_tiles
from gen_data.preview.overlay import BOX_EDGES, draw_box3d, draw_keypoints
from gen_data.preview.palette import color_depth, color_shares
from gen_data.preview.sensor_views import ROW_PX, point_colors, range_view, top_view
from tests.preview.recorded import Stream, photograph, recorded


def test_boxes_are_drawn_at_their_projection_and_not_behind_the_camera() -> None:
    """Twelve edges of a cuboid, none twice."""
    corners = OrientedBox(SE3(), (2.0, 2.0, 2.0)).corners()
    differing = [int((corners[a] != corners[b]).sum()) for a, b in BOX_EDGES]
    assert differing == [1] * 12
    assert len({frozenset(edge) for edge in BOX_EDGES}) == 12
    # The front face of a 2 m cube centred 4 m ahead spans f * 1 / 3 pixels to each side.
    intrinsics = Intrinsics(120, 120, 60.0, 60.0, 60.0, 60.0)
    image = np.zeros((120, 120, 3), np.uint8)
    draw_box3d(image, OrientedBox(SE3((0.0, 0.0, 4.0)), (2.0, 2.0, 2.0)), intrinsics, (255, 0, 0))
    rows, columns = np.nonzero(image[..., 0] > 128)
    assert (rows.min(), rows.max()) == (40, 80)
    assert (columns.min(), columns.max()) == (40, 80)
    # A box behind is not mirrored into the image.
    intrinsics = Intrinsics(64, 64, 60.0, 60.0, 32.0, 32.0)
    image = np.zeros((64, 64, 3), np.uint8)
    draw_box3d(image, OrientedBox(SE3((0.0, 0.0, -3.0)), (1.0, 1.0, 1.0)), intrinsics, (9, 9, 9))
    assert not image.any()


def test_a_skeleton_is_drawn_at_its_points_and_hidden_ones_are_rings() -> None:
    """Knee and ankle are joined; the hidden hip has no centre; others leave no trace."""
    image = np.zeros((40, 40, 3), np.uint8)
    far = (0.0, 0.0, 9.0)
    points = (
        KeypointTruth("left_ankle", far, (10.5, 30.5), 2),
        KeypointTruth("left_knee", far, (10.5, 15.5), 2),
        KeypointTruth("right_hip", far, (30.5, 20.5), 1),
        KeypointTruth("nose", far),
    )
    draw_keypoints(image, points, (255, 0, 0))
    red = image[..., 0]
    assert (red[15:31, 10] > 200).all()
    assert red[20, 30] < 100
    assert red[20, 32] > 100
    assert not red[:12].any()


def _info(**changes: Any) -> DatasetInfo:
    about = DatasetInfo("street", 1, 1, 1, ("car",), (SensorInfo("color", Modality.CAMERA),))
    return replace(about, **changes)


def test_a_recording_joins_the_keypoints_of_each_object_by_itself() -> None:
    """An entity per person; ids by the place in COCO's list; points outside the image left out."""
    camera = Camera("color", IDENTITY, Intrinsics(40, 40, 40.0, 40.0, 20.0, 20.0))
    points = (Keypoint("left_ankle", (0.0, 0.0, 2.0)), Keypoint("nose", (0.0, -9.0, 2.0)))
    people = tuple(
        ObjectTruth(
            Instance(k, f"person/{k}", "person", 1, "person", keypoints=points),
            visible_px=9,
            box=BoxPx(0, 0, 9, 9),
            keypoints=(
                KeypointTruth("left_ankle", (0.0, 0.0, 2.0), (20.0, 20.0), 2),
                KeypointTruth("nose", (0.0, -9.0, 2.0)),
            ),
        )
        for k in (4, 7)
    )
    scene = Scene("street", instances=tuple(item.instance for item in people))
    taken = replace(photograph({}, camera, objects=people), scene=scene)
    stream = recorded(taken, info=_info(categories=("person",)))
    prefix = "world/cameras/color/image/keypoints"
    logged = [(path, value) for path, value, _ in stream.logged if path.startswith(prefix)]
    assert [path for path, _ in logged] == [prefix, f"{prefix}/4", f"{prefix}/7"]
    for _, value in logged[1:]:
        assert value.keypoint_ids.as_arrow_array().to_pylist() == [PERSON.names.index("left_ankle")]
        assert value.class_ids.as_arrow_array().to_pylist() == [1]
    contexts = stream.at("/")
    (described,) = contexts[-1].context.as_arrow_array().to_pylist()
    bones = described[1]["class_description"]["keypoint_connections"]
    assert len(contexts) == 2
    assert [(b["keypoint0"], b["keypoint1"]) for b in bones] == list(PERSON.bones)


def test_edges_of_boxes_bow_with_the_lens() -> None:
    """The middle of a long edge is drawn where the lens puts it, and not on the chord."""
    lens = Lens("kannala_brandt", (0.0,) * 4)
    intrinsics = Intrinsics(200, 200, 60.0, 60.0, 100.0, 100.0, lens)
    image = np.zeros((200, 200, 3), np.uint8)
    bar = OrientedBox(SE3((0.0, 1.2, 1.0)), (6.0, 0.001, 0.001))
    draw_box3d(image, bar, intrinsics, (200, 200, 200))
    ends = intrinsics.project(np.array([[-3.0, 1.2, 1.0], [3.0, 1.2, 1.0]]))
    row = int(intrinsics.project(np.array([0.0, 1.2, 1.0]))[1])
    assert row - ends[:, 1].max() > 15
    assert image[row - 1 : row + 2, 100].any()
    assert not image[: int(ends[:, 1].min()) - 2].any()
    assert not image[int(ends[0, 1]) + 3 : row - 2, 100].any()


def test_images_that_rerun_cannot_place_in_space_are_shown_by_themselves() -> None:
    """A pinhole is logged for a pinhole only."""
    for lens, pinholes in ((Lens(), 1), (Lens("equirectangular"), 0)):
        camera = Camera("color", IDENTITY, Intrinsics(8, 4, 1.3, 1.3, 4.0, 2.0, lens))
        stream = recorded(photograph({}, camera), info=_info())
        assert len(stream.at("world/cameras/color/image")) == pinholes


def test_the_scene_opens_where_the_first_camera_is() -> None:
    """Inside a closed room, just before the camera's image; sent with the first sample."""
    pose = look_at((1.0, 2.0, 1.5), (1.0, 6.0, 1.5))
    camera = Camera("color", pose, Intrinsics(8, 4, 8.0, 8.0, 4.0, 2.0))
    taken = photograph({}, camera)
    (blueprint,) = recorded(taken, replace(taken, index=1), info=_info()).blueprints
    world = blueprint.root_container.contents[0]
    eye = world.properties["EyeControls3D"]
    (at,), (to,), (up,) = (
        batch.as_arrow_array().to_pylist() for batch in (eye.position, eye.look_target, eye.eye_up)
    )
    np.testing.assert_allclose(at, (1.0, 2.25, 1.5), atol=1e-6)
    np.testing.assert_allclose(np.subtract(to, at)[[0, 2]], 0.0, atol=1e-6)
    assert to[1] > at[1]
    assert up == [0.0, 0.0, 1.0]


def test_every_channel_of_a_camera_is_in_the_recording() -> None:
    """Colour and depth lie over one another; a tint of classes would cover both."""
    camera = Camera("color", IDENTITY, Intrinsics(8, 4, 8.0, 8.0, 4.0, 2.0))
    depth_m = np.full((4, 8), 2.0, np.float32)
    ids = np.ones((4, 8), np.uint16)
    channels = {
        Channel.RGB: np.zeros((4, 8, 3), np.uint8),
        Channel.Z_DEPTH: depth_m,
        Channel.MEASURED_DEPTH: depth_m,
        Channel.CATEGORY: ids,
        Channel.INSTANCE: ids,
        Channel.NORMALS: np.zeros((4, 8, 3), np.float32),
        Channel.DISPARITY: depth_m,
        Channel.DEPTH_LAYERS: np.stack([depth_m, depth_m + 1.0], axis=-1),
        Channel.INSTANCE_LAYERS: np.stack([ids, ids + 1, 0 * ids], axis=-1),
    }
    stream = recorded(photograph(channels, camera), info=_info())
    logged = {path for path, *_ in stream.logged}
    for name in ("rgb", "depth", "measured_depth", "depth_layers/0", "depth_layers/1"):
        assert f"world/cameras/color/image/{name}" in logged
    layers = [f"instance_layers/{k}" for k in range(3)]
    for name in ("category", "instance", "normals", "disparity", *layers):
        assert f"channels/color/{name}" in logged


def test_ids_depths_and_shares_have_different_colours_and_nothing_is_black() -> None:
    """At least 60 grey levels in some channel between consecutive ids."""
    colors = np.array([id_color(i) for i in range(1, 200)], int)
    assert id_color(0) == (0, 0, 0)
    assert (np.abs(np.diff(colors, axis=0)).max(axis=1) >= 60).all()
    ids = np.array([[0, 3], [7, 3]], np.uint16)
    assert tuple(color_ids(ids)[0, 1]) == id_color(3)
    # Infinite depth is black; the nearest pixel is the brightest.
    shown = color_depth(np.array([[1.0, 2.0], [3.0, np.inf]]))[..., 0]
    assert shown[1, 1] == 0
    assert shown[0, 0] > shown[0, 1] > shown[1, 0] > 0
    # Shares outside [0, 1] are clipped.
    shown = color_shares(np.array([-1.0, 0.0, 0.5, 1.0, 2.0])).tolist()
    blue, green, red = [0, 0, 255], [0, 255, 0], [255, 0, 0]
    assert shown == [blue, blue, green, red, red]


def test_sheets_place_tiles_row_by_row_and_of_nothing_are_refused() -> None:
    """Five tiles in columns of three: the fifth is second in the second row."""
    images = [np.full((10, 20, 3), 50 * k, np.uint8) for k in range(1, 6)]
    sheet = arrange_tiles(images, columns=3)
    assert sheet.shape == (2 * (10 + GAP_PX) + GAP_PX, 3 * (20 + GAP_PX) + GAP_PX, 3)
    assert (sheet[GAP_PX * 2 + 10 + 5, GAP_PX * 2 + 20 + 5] == 250).all()
    with pytest.raises(ConfigError):
        arrange_tiles([], columns=3)


def test_scans_from_above_and_range_images_have_their_points_where_they_are() -> None:
    """X to the right, Y up: a point 25 m ahead and 10 m to the left, coloured by its category."""
    points = np.zeros(2, POINT)
    points["position_m"] = [(25.0, 10.0, 0.0), (25.0, 10.0, -1.0)]
    points["category_id"] = [3, 0]
    cloud = PointCloud("top", Lidar("top", "color"), points)
    view = top_view(cloud, Scene("t"), aspect=2.0)
    assert view.shape == (480, 960, 3)
    (row,), (column,) = np.nonzero(view.any(axis=-1))
    assert (row, column) == (240 - 96, 480 + 240)
    assert tuple(view[row, column]) == id_color(3)
    # Strong returns are red, weak ones blue, whatever they are.
    points = np.zeros(2, POINT)
    points["intensity"] = [0.0, 1.0]
    points["category_id"] = 3
    cloud = PointCloud("top", Lidar("top", "color"), points)
    assert point_colors(cloud, "intensity").tolist() == [[0, 0, 255], [255, 0, 0]]
    assert tuple(point_colors(cloud)[0]) == id_color(3)
    # Three panels of two rings; the nearer of two points in one pixel is shown.
    points = np.zeros(3, POINT)
    points["position_m"] = [(2.0, -0.001, 0.0), (50.0, -0.025, 0.0), (0.0, 100.0, 0.0)]
    points["ring"] = [0, 0, 1]
    view = range_view(PointCloud("top", Lidar("top", "color"), points))
    assert view.shape == (3 * 2 * ROW_PX, 960, 3)
    assert view[0, 480].tolist() == [0, 0, 255]
    assert view[ROW_PX, 240].tolist() == [255, 0, 0]
    assert int(view[: 2 * ROW_PX].any(axis=-1).sum()) == 2 * ROW_PX


class _Triangles:
    """A library in which every asset is one triangle."""

    def mesh(self, asset_id: str) -> MeshData:
        corners = np.eye(3, dtype=np.float32)
        return MeshData(
            vertices_m=corners,
            faces=np.array([[0, 1, 2]], np.int32),
            normals=corners,
            uvs=np.zeros((3, 2), np.float32),
            face_slots=np.zeros(1, np.int32),
            materials=(Material(),),
        )


def _moving(step_index: int, *, first: int = 0) -> Sample:
    """An ego car that drives 1 m per step past a house; frames 0.1 s apart."""
    knots = tuple(SE3((float(k), 0.0, 0.0)) for k in range(4))
    scene = Scene(
        "street",
        bodies=(Body("house", "house"), Body("ego", "car")),
        rigs=(Rig("ego", "ego", SE3((0.0, 0.0, 2.0))),),
        tracks=(Trajectory("ego", 0.1, knots),),
    )
    shown = scene_at(scene, 0.1 * step_index)
    index = first + step_index
    return Sample(index, 0, 0, "train", shown, Capture({}), {}, step_index=step_index)


def _driven(*samples: Sample) -> Stream:
    return recorded(*samples, info=_info(steps_per_scene=4), assets=_Triangles())


def test_sequences_follow_each_other_and_send_meshes_once_and_ways() -> None:
    """The house is sent once, the car's mesh once and its place at each of three steps."""
    stream = _driven(*(_moving(k) for k in range(3)))

    def count(path: str, kind: str) -> int:
        return [type(value).__name__ for value in stream.at(path)].count(kind)

    assert [count("world/bodies/house", k) for k in ("Mesh3D", "Transform3D")] == [1, 1]
    assert [count("world/bodies/ego", k) for k in ("Mesh3D", "Transform3D")] == [1, 3]
    assert count("world/rigs/ego", "Transform3D") == 3
    # 3 m ahead from the first step, logged once; it is lifted off the ground.
    (way,) = stream.at("world/ways")
    (strip,) = way.strips.as_arrow_array().to_pylist()
    assert strip[0] == pytest.approx([0.0, 0.0, 0.05])
    assert strip[-1] == pytest.approx([3.0, 0.0, 0.05])
    # Four steps of 0.1 s make a sequence of 0.4 s; the second begins where the first ended.
    stream = _driven(_moving(2), _moving(0, first=4))
    seconds = dict.fromkeys(s for path, _, s in stream.logged if path == "world/rigs/ego")
    assert list(seconds) == pytest.approx([0.2, 0.4])
