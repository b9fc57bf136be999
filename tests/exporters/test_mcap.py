"""MCAP export, read by the packages mcap and mcap-protobuf-support."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image

from gen_data.core.capture import POINT, Channel
from gen_data.core.se3 import SE3
from gen_data.exporters.mcap import START_NS, Mcap, point_fields
from tests.exporters.drives import drive_info

STEP_NS = 100_000_000
NUMPY_TYPES = {1: "u1", 3: "<u2", 7: "<f4"}


@pytest.fixture(scope="module")
def dataset(exported: Any) -> Path:
    return exported(Mcap())


def messages(path: Path) -> list[tuple[str, str, int, Any]]:
    """Topic, schema, time and decoded message, in the order of the file; sums are checked."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        decoded = reader.iter_decoded_messages(log_time_order=False)
        return [(c.topic, s.name, m.log_time, message) for s, c, m, message in decoded]


def summary_of(path: Path) -> Any:
    with path.open("rb") as file:
        return make_reader(file).get_summary()


def pose(translation: Any, rotation: Any) -> SE3:
    xyz = (translation.x, translation.y, translation.z)
    return SE3(xyz, (rotation.w, rotation.x, rotation.y, rotation.z))


def faults(path: Path, samples: Any) -> list[str]:
    try:
        found = messages(path)
    except (McapError, ValueError, OSError) as error:
        return [f"{type(error).__name__}"]
    by_time: dict[int, dict[str, list[Any]]] = {}
    for topic, _, time_ns, message in found:
        by_time.setdefault(time_ns, {}).setdefault(topic, []).append(message)
    if [time_ns for _, _, time_ns, _ in found] != sorted(t for _, _, t, _ in found):
        return ["order"]
    if list(by_time) != [START_NS + round(s.scene.time_s * 1e9) for s in samples]:
        return [f"times {list(by_time)}"]
    return [
        fault
        for sample, topics in zip(samples, by_time.values(), strict=True)
        for fault in instant_faults(topics, sample)
    ]


def instant_faults(topics: dict[str, list[Any]], sample: Any) -> list[str]:
    found = []
    parents = {t.child_frame_id: t for t in topics["/tf"]}

    def world_pose(frame: str) -> SE3:
        if frame == "world":
            return SE3()
        link = parents[frame]
        return world_pose(link.parent_frame_id) @ pose(link.translation, link.rotation)

    for name, truth in sample.truth.items():
        (image,) = topics[f"/camera/{name}/rgb"]
        pixels = np.asarray(Image.open(io.BytesIO(image.data)))
        if not np.array_equal(pixels, sample.capture.readings[name].channels[Channel.RGB]):
            found.append(f"{name} image")
        if not close(world_pose(f"camera/{name}"), truth.camera.T_world_camera):
            found.append(f"{name} pose")
        found += projection_faults(topics, name, world_pose(image.frame_id), sample)
    (cloud,) = topics["/lidar/top/points"]
    fields = {f.name: (NUMPY_TYPES[f.type], f.offset) for f in cloud.fields}
    formats, offsets = zip(*fields.values(), strict=True)
    kinds = {"names": [*fields], "formats": formats, "offsets": offsets}
    points = np.frombuffer(cloud.data, np.dtype(kinds | {"itemsize": cloud.point_stride}))
    expected = sample.capture.clouds["top"].points
    place = np.stack([points["x"], points["y"], points["z"]], axis=1)
    if not np.array_equal(place, expected["position_m"]):
        found.append("points")
    elif not np.array_equal(points["instance_id"], expected["instance_id"]):
        found.append("ids of points")
    else:
        found += box_faults(topics, world_pose(cloud.frame_id).apply(place), points["instance_id"])
    return found


def close(one: SE3, other: SE3) -> bool:
    return bool(np.allclose(one.matrix(), other.matrix(), atol=1e-6))


def projection_faults(
    topics: dict[str, list[Any]], name: str, T_world_camera: SE3, sample: Any
) -> list[str]:
    """Centres of cubes, projected with the written calibration, lie as OpenCV would draw them."""
    (calibration,) = topics[f"/camera/{name}/calibration"]
    k = np.array(calibration.K).reshape(3, 3)
    truth = sample.truth[name]
    (update,) = topics["/objects"]
    for entity in update.entities:
        (cube,) = entity.cubes
        center = pose(cube.pose.position, cube.pose.orientation).translation_m
        point = T_world_camera.inverse().apply(np.array([center]))
        if point[0, 2] < 0.5:
            continue
        u, v = (k @ point[0])[:2] / point[0, 2]
        ours = truth.camera.intrinsics.project(point)[0]
        # OpenCV's first pixel has its centre at 0, ours at 0.5.
        if not np.allclose([u + 0.5, v + 0.5], ours, atol=1e-3):
            return [f"{name} calibration"]
    boxes = topics[f"/camera/{name}/annotations"][0]
    written = [[(p.x, p.y) for p in (b.points[0], b.points[2])] for b in boxes.points]
    visible = [t for t in truth.objects if t.box is not None]
    expected = [[(t.box.x_min, t.box.y_min), (t.box.x_max, t.box.y_max)] for t in visible]
    if written != expected or [t.text for t in boxes.texts] != [
        t.instance.category for t in visible
    ]:
        return [f"{name} boxes"]
    return []


def box_faults(topics: dict[str, list[Any]], points: Any, ids: Any) -> list[str]:
    """Points of an instance lie in its cube and fill most of one side."""
    (update,) = topics["/objects"]
    found = []
    for entity in update.entities:
        (cube,) = entity.cubes
        mine = points[ids == int(entity.id)]
        T_box_world = pose(cube.pose.position, cube.pose.orientation).inverse()
        share = np.abs(T_box_world.apply(mine)) / (
            0.5 * np.array([cube.size.x, cube.size.y, cube.size.z])
        )
        if len(mine) and not (share.max() < 1.001 and share.max() > 0.9):
            found.append(f"cube {entity.id}")
    return found


def test_messages_agree_with_the_samples_in_foxgloves_schemas(dataset: Path, samples: Any) -> None:
    """Images, transforms, calibrations, clouds and cubes, in order of time."""
    assert faults(dataset / "train/street-000000.mcap", samples[:4]) == []
    assert faults(dataset / "val/street-000001.mcap", samples[4:]) == []
    assert len([p for p in dataset.rglob("*") if p.is_file()]) == 2
    # And the summary counts all messages.
    path = dataset / "train/street-000000.mcap"
    found = messages(path)
    names = ("FrameTransform", "CompressedImage", "CameraCalibration", "ImageAnnotations",
             "PointCloud", "SceneUpdate")  # fmt: skip
    assert {name for _, name, _, _ in found} == {f"foxglove.{name}" for name in names}
    assert summary_of(path).statistics.message_count == len(found)


def test_compressed_files_hold_the_same(dataset: Path, exported: Any) -> None:
    """Chunks of zstd; every message is equal."""
    path = Path("train/street-000000.mcap")
    plain, compressed = dataset / path, exported(Mcap(compression="zstd")) / path
    assert compressed.stat().st_size < plain.stat().st_size
    assert {chunk.compression for chunk in summary_of(compressed).chunk_indexes} == {"zstd"}
    assert str(messages(compressed)) == str(messages(plain))


def test_sensors_have_their_own_instants(world: Any, slow: Any, tmp_path: Path) -> None:
    """The right camera and the scanner read at every second step."""
    path = world.export(Mcap(), drive_info(world), slow, tmp_path) / "train/street-000000.mcap"
    times = [(topic, time_ns) for topic, _, time_ns, _ in messages(path)]
    every = [START_NS + k * STEP_NS for k in range(4)]
    for name, read in (
        ("/camera/left/rgb", every),
        ("/camera/right/rgb", every[::2]),
        ("/lidar/top/points", every[::2]),
    ):
        assert [t for topic, t in times if topic == name] == read


def test_fields_of_points_cover_the_record() -> None:
    """Without gaps, in the record's own types."""
    fields = list(point_fields())
    sizes = {1: 1, 3: 2, 7: 4}
    ends = [f["offset"] + sizes[f["type"]] for f in fields]
    assert [f["offset"] for f in fields] == [0, *ends[:-1]]
    assert ends[-1] == POINT.itemsize
