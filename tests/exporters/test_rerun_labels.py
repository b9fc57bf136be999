"""Lanes, tracks, occupancy, layers and mirrors in Rerun's recordings, read back by rerun-sdk."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.core.asset_types import SURFACES
from gen_data.core.capture import Channel
from gen_data.core.lane_geometry import LaneBorder
from gen_data.core.sample import BorderTruth, EgoTruth, Occupancy, PointTracks, Sample, SensorTracks
from gen_data.core.se3 import SE3
from gen_data.exporters.label_colors import SURFACE_COLORS, UNLABELLED, id_color
from gen_data.exporters.label_parts import BORDER_COLORS, LIFT_M
from gen_data.exporters.rerun import Rerun
from tests.exporters.datasets import imaging, with_sensor
from tests.exporters.drives import drive_info
from tests.exporters.test_delivery import with_record
from tests.exporters.test_rerun import Table, tables
from tests.preview.recorded import recorded

VISIBLE, OCCLUDED, OUTSIDE = 0, 2, 3
MEDIA = (
    Channel.RGB, Channel.DEPTH_LAYERS, Channel.INSTANCE_LAYERS, Channel.MATERIAL_LAYERS,
    Channel.SEEN_IN_MIRROR, Channel.MIRRORED_POSITION,
)  # fmt: skip
LINE = ((-90.0, 0.0, 0.5), (0.0, 2.0, 0.5), (90.0, 0.0, 0.5))
IN_IMAGE = BorderTruth(
    "lane:left", "lane", ((5.0, 100.0), (20.0, 90.0), (40.0, 80.0)), (True, True, False)
)


def make_grid(sample: Sample) -> Occupancy:
    """4 x 3 x 2 voxels: asphalt, on it one voxel of the first instance and one without a label."""
    state, ids = np.zeros((4, 3, 2), np.uint8), np.zeros((4, 3, 2), np.uint16)
    state[..., 0], state[1, 2, 1], state[2, 0, 1] = 1, 1, 1
    ids[1, 2, 1] = sample.scene.instances[0].instance_id
    surface = np.where(state == 1, SURFACES.index("asphalt"), 0).astype(np.uint8)
    surface[..., 1] = 0
    pose = SE3.about_z(0.3, (float(sample.index), 2.0, 0.0))
    seen = {"left": np.ones(state.shape, np.bool_)}
    return Occupancy(pose, (-1.0, 0.0, -0.5), 0.5, state, ids, surface, seen)


def make_tracks(sample: Sample) -> PointTracks:
    """Three points, of which the left camera sees one, and has one outside of its image."""
    k = sample.index
    state = np.array([VISIBLE, OCCLUDED, OUTSIDE], np.uint8)
    places = np.array([[20.5 + k, 20.5], [40.5, 45.5], [-9.0, 5.0]], np.float32)
    seen = SensorTracks(np.ones((3, 3), np.float32), places, state, np.zeros(3, np.uint16))
    position = np.arange(9, dtype=np.float32).reshape(3, 3) + k
    return PointTracks(np.zeros(3, np.uint16), position, {"left": seen, "right": seen})


def make_mirror(shape: tuple[int, ...], number: int) -> Any:
    """A mirror in the right half of the image: X grows with the column, Y with the row [m]."""
    v, u = np.indices(shape)
    places = np.stack([0.25 * u, 0.5 * v, np.full(shape, number)], axis=-1).astype(np.float32)
    places[u < shape[1] // 2] = np.nan
    return places


def labelled(sample: Sample) -> Sample:
    """A sample of the drive with all further labels; the left camera has two layers."""
    left = sample.capture.readings["left"].channels
    depth, ids = left[Channel.Z_DEPTH], left[Channel.INSTANCE]
    images = {
        Channel.DEPTH_LAYERS: np.stack([np.full_like(depth, 2.5), depth], axis=-1),
        Channel.INSTANCE_LAYERS: np.stack([np.zeros_like(ids), ids], axis=-1),
        Channel.MATERIAL_LAYERS: np.stack([np.full_like(ids, 2), np.zeros_like(ids)], axis=-1),
        Channel.SEEN_IN_MIRROR: ids[::-1].copy(),
        Channel.MIRRORED_POSITION: make_mirror(ids.shape, sample.index),
    }
    frame = EgoTruth(
        "ego",
        borders=(LaneBorder("lane:left", "road", LINE),),
        occupancy=make_grid(sample),
        tracks=make_tracks(sample),
    )
    truth = {**sample.truth, "left": replace(sample.truth["left"], borders=(IN_IMAGE,))}
    return replace(imaging(sample, "left", images), truth=truth, frame=frame)


def info_of(world: Any) -> Any:
    media = {"left": MEDIA, "right": (Channel.RGB,)}
    return world.info(8, ("left", "right"), ("top",), media=media, steps_per_scene=4)


@pytest.fixture(scope="module")
def drive(samples: Any) -> list[Sample]:
    return [labelled(sample) for sample in samples]


@pytest.fixture(scope="module")
def read(world: Any, drive: list[Sample], tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder: Path = world.export(Rerun(), info_of(world), drive, tmp_path_factory.mktemp("rerun"))
    (path,) = folder.glob("train/*.rrd")
    return tables(path)


def training(drive: list[Sample]) -> list[Sample]:
    return [sample for sample in drive if sample.split == "train"]


def rgb(packed: Any) -> list[tuple[int, ...]]:
    """Colours of 32-bit numbers, red in the highest bits."""
    return [(v >> 24 & 255, v >> 16 & 255, v >> 8 & 255) for v in packed]


def test_voxels_have_their_places_and_colours_in_the_frame_of_the_grid(
    read: dict[str, Table], drive: list[Sample]
) -> None:
    frames, boxes = read["/world/occupancy"], read["/world/occupancy/voxels"]
    for sample in training(drive):
        k = sample.index
        assert frames["Transform3D:translation"][k] == [[float(k), 2.0, 0.0]]
        (quaternion,) = frames["Transform3D:quaternion"][k]
        np.testing.assert_allclose(quaternion, [0, 0, np.sin(0.15), np.cos(0.15)], atol=1e-6)
        centers = {tuple(place) for place in boxes["Boxes3D:centers"][k]}
        floor = {(-0.75 + 0.5 * x, 0.25 + 0.5 * y, -0.25) for x in range(4) for y in range(3)}
        assert centers == floor | {(-0.25, 1.25, 0.25), (0.25, 0.25, 0.25)}
        assert {tuple(half) for half in boxes["Boxes3D:half_sizes"][k]} == {(0.25, 0.25, 0.25)}
        colors = dict(
            zip(map(tuple, boxes["Boxes3D:centers"][k]), rgb(boxes["Boxes3D:colors"][k]),
                strict=True)
        )  # fmt: skip
        category_id = sample.scene.instances[0].category_id
        assert colors[-0.25, 1.25, 0.25] == id_color(category_id)
        assert colors[0.25, 0.25, 0.25] == UNLABELLED
        assert colors[-0.75, 0.25, -0.25] == tuple(SURFACE_COLORS["asphalt"])


def test_lanes_are_in_the_world_once_a_sequence_and_in_each_image_in_parts(
    read: dict[str, Table], drive: list[Sample]
) -> None:
    world, image = read["/world/lanes"], read["/world/cameras/left/image/lanes"]
    first = training(drive)[0].index
    assert list(world["LineStrips3D:strips"]) == [first]
    lifted = np.add(LINE, (0.0, 0.0, LIFT_M))
    np.testing.assert_allclose(world["LineStrips3D:strips"][first], [lifted], atol=1e-5)
    assert rgb(world["LineStrips3D:colors"][first]) == [BORDER_COLORS["road"]]
    dark = tuple(round(0.5 * value) for value in BORDER_COLORS["lane"])
    for sample in training(drive):
        k = sample.index
        assert image["LineStrips2D:strips"][k] == [
            [[5.0, 100.0], [20.0, 90.0]], [[20.0, 90.0], [40.0, 80.0]],
        ]  # fmt: skip
        assert rgb(image["LineStrips2D:colors"][k]) == [BORDER_COLORS["lane"], dark]
    assert "/world/cameras/right/image/lanes" not in read


def test_tracked_points_are_in_the_world_and_inside_images(
    read: dict[str, Table], drive: list[Sample]
) -> None:
    world, image = read["/world/tracks"], read["/world/cameras/left/image/tracks"]
    for sample in training(drive):
        k = sample.index
        places = np.arange(9).reshape(3, 3) + k
        np.testing.assert_array_equal(world["Points3D:positions"][k], places)
        assert rgb(world["Points3D:colors"][k]) == [id_color(n) for n in (1, 2, 3)]
        assert image["Points2D:positions"][k] == [[20.5 + k, 20.5], [40.5, 45.5]]
        assert image["Points2D:keypoint_ids"][k] == [0, 1]
        assert rgb(image["Points2D:colors"][k]) == [id_color(1), id_color(2)]
        # Negative radii are pixels of the screen; the hidden one is smaller.
        assert image["Points2D:radii"][k] == [-3.0, -1.5]


def decoded(table: Table, name: str, index: int) -> Any:
    ((blob,),) = (table[f"{name}:blob"][index],)
    return cv2.imdecode(np.array(blob, np.uint8), cv2.IMREAD_UNCHANGED)


def test_each_layer_is_an_image(read: dict[str, Table], drive: list[Sample]) -> None:
    """Depth in units of the data set; ids in their colours."""
    for sample in training(drive):
        k, channels = sample.index, sample.capture.readings["left"].channels
        table = read["/world/cameras/left/image/depth_layers/0"]
        near = decoded(table, "EncodedDepthImage", k)
        (units_per_m,) = table["EncodedDepthImage:meter"][k]
        assert set(near.ravel().tolist()) == {round(2.5 * units_per_m)}
        far = decoded(read["/world/cameras/left/image/depth_layers/1"], "EncodedDepthImage", k)
        depth = channels[Channel.Z_DEPTH]
        seen = np.isfinite(depth) & (depth * units_per_m < 65_535)
        assert (np.abs(far[seen] - depth[seen] * units_per_m) <= 0.51).all()
        ids = channels[Channel.INSTANCE]
        colors = np.array([id_color(n) for n in range(int(ids.max()) + 1)])
        for path, wanted in (
            ("instance_layers/0", np.zeros_like(ids)),
            ("instance_layers/1", ids),
            ("material_layers/0", np.full_like(ids, 2)),
            ("seen_in_mirror", ids[::-1]),
        ):
            shown = decoded(read[f"/channels/left/{path}"], "EncodedImage", k)
            palette = (
                colors if wanted.max() < len(colors) else np.array([id_color(n) for n in range(3)])
            )
            assert (shown[..., ::-1] == palette[wanted]).all(), path


def test_points_in_mirrors_are_in_the_world_in_the_colours_of_their_image(
    read: dict[str, Table], drive: list[Sample]
) -> None:
    """Of every fourth pixel and row, from the third; red grows with X, green with Y."""
    table = read["/world/mirrored/left"]
    for sample in training(drive):
        k, height, width = (
            sample.index,
            *sample.capture.readings["left"].channels[Channel.RGB].shape[:2],
        )
        expected = [
            (0.25 * u, 0.5 * v, float(k))
            for v in range(2, height, 4)
            for u in range(2, width, 4)
            if u >= width // 2
        ]
        places = np.array(table["Points3D:positions"][k])
        assert np.abs(places - expected).max() < 0.05
        image = decoded(read["/channels/left/mirrored_position"], "EncodedImage", k)[..., ::-1]
        u, v = (places[:, :2] / (0.25, 0.5)).round().astype(int).T
        assert rgb(table["Points3D:colors"][k]) == [tuple(c) for c in image[v, u].tolist()]
        assert not image[:, : width // 2].any()
        assert (np.diff(image[..., width // 2 :, 0].astype(int), axis=1) >= 0).all()
        assert (np.diff(image[:, width // 2 :, 1].astype(int), axis=0) >= 0).all()


def test_deliveries_are_numbers_over_time_of_sensors_that_have_such_faults(
    world: Any, samples: Any, tmp_path: Path
) -> None:
    """One image is lost, one arrives twice and late; a scan is late, the other camera is sound."""
    records = {1: {"lost": True}, 2: {"doubled": True, "arrived_s": samples[2].scene.time_s + 0.25}}
    drive = [with_record(s, {"left"}, records.get(s.index, {})) for s in samples]
    late = {"arrived_s": drive[3].capture.clouds["top"].time_s + 0.125}
    drive[3] = with_record(drive[3], {"top"}, late)
    info = with_sensor(drive_info(world), "left", faults=("lost", "doubled"))
    folder = world.export(Rerun(), info, drive, tmp_path)
    read = tables(*sorted(folder.rglob("*.rrd")))
    arrivals = read["/delivery/left/arrivals"]["Scalars:scalars"]
    assert {k: v for k, (v,) in arrivals.items()} == {
        s.index: {1: 0.0, 2: 2.0}.get(s.index, 1.0) for s in samples
    }
    late_s = read["/delivery/left/late_s"]["Scalars:scalars"]
    assert {k: v for k, (v,) in late_s.items() if v} == {2: pytest.approx(0.25)}
    assert read["/delivery/top/late_s"]["Scalars:scalars"] == {3: [pytest.approx(0.125)]}
    assert not any(path.startswith("/delivery/right") for path in read)


def test_recordings_of_exports_and_previews_show_the_same(
    world: Any, read: dict[str, Table], drive: list[Sample]
) -> None:
    """Components that the preview logs for lanes, tracks and voxels."""
    scene = replace(drive[0].scene, bodies=(), rigs=(), devices=(), tracks=())
    sample = replace(training(drive)[0], scene=scene)
    stream = recorded(sample, info=info_of(world))
    compared = 0
    for path in ("world/lanes", "world/tracks", "world/occupancy/voxels",
                 "world/cameras/left/image/lanes", "world/cameras/left/image/tracks"):  # fmt: skip
        (shown,) = stream.at(path)
        for batch in shown.as_component_batches():
            name = batch.component_descriptor().component
            if name in ("Points2D:class_ids", "Points2D:show_labels"):
                continue
            values = batch.as_arrow_array().to_pylist()
            assert read[f"/{path}"][name][sample.index] == values, (path, name)
            compared += 1
    assert compared > 12
    (mirrored,) = stream.at("world/mirrored/left")
    places = mirrored.positions.as_arrow_array().to_pylist()
    stored = read["/world/mirrored/left"]["Points3D:positions"][sample.index]
    assert np.abs(np.subtract(places, stored)).max() < 0.005  # half a unit of the file


def test_a_data_set_without_these_labels_has_none_of_their_entities(
    world: Any, samples: Any, tmp_path: Path
) -> None:
    folder = world.export(Rerun(), drive_info(world), samples, tmp_path)
    (path,) = folder.glob("train/*.rrd")
    found = " ".join(tables(path))
    assert not any(word in found for word in ("lanes", "tracks", "occupancy", "channels"))
