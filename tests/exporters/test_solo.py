"""SOLO export, held against the street; in slow tests as pysolotools reads it."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from gen_data.exporters.id_colors import id_color, id_colors
from gen_data.exporters.solo import Solo
from tests.exporters.datasets import made_of

SIGNS = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), -1).reshape(-1, 3)


def read_json(root: Path) -> list[Any]:
    metadata = json.loads((root / "metadata.json").read_text())
    steps = metadata["totalFrames"] // metadata["totalSequences"]
    paths = [
        root / f"sequence.{k // steps}/step{k % steps}.frame_data.json"
        for k in range(metadata["totalFrames"])
    ]
    return [
        json.loads(path.read_text(), object_hook=lambda row: SimpleNamespace(**row))
        for path in paths
    ]


def unity(vector: Any) -> Any:
    """World coordinates of Unity: Y and Z exchanged."""
    x, y, z = vector
    return np.array([x, z, y])


def problems(root: Path, frames: Sequence[Any], samples: Sequence[Any]) -> Iterator[str]:
    if len(list(root.glob("sequence.*/*.frame_data.json"))) != len(frames):
        yield "metadata counts other frames"
    for number, (frame, sample) in enumerate(zip(frames, samples, strict=True), 1):
        if frame.frame != number:
            yield f"frame {frame.frame} is not {number}"
        for capture in frame.captures:
            folder = root / f"sequence.{frame.sequence}"
            for text in wrong_capture(folder, capture, sample):
                yield f"frame {number}, {capture.id}: {text}"


def wrong_capture(folder: Path, capture: Any, sample: Any) -> Iterator[str]:
    flat, solid, instances, labels = capture.annotations
    camera = sample.truth[capture.id].camera
    with Image.open(folder / capture.filename) as image:
        if list(image.size) != list(capture.dimension):
            yield "dimension"
    if not np.allclose(capture.position, unity(camera.T_world_camera.translation_m), atol=1e-8):
        yield "position"
    things = {thing.instance_id: thing for thing in sample.scene.instances}
    seen = [t.instance.instance_id for t in sample.truth[capture.id].objects if t.box]
    for annotation in (flat.values, solid.values, instances.instances):
        if [row.instanceId for row in annotation] != seen:
            yield "other instances"
            return
    for box, around in zip(flat.values, solid.values, strict=True):
        yield from wrong_box(capture, box, around, things[box.instanceId])
    yield from wrong_colors(folder, flat, instances, labels)


def wrong_box(capture: Any, box: Any, around: Any, thing: Any) -> Iterator[str]:
    """Boxes of one object, in the world and in the image."""
    turn = Rotation.from_quat(around.rotation)
    sensor = Rotation.from_quat(capture.rotation)
    pose = thing.T_world_instance
    middle = 0.5 * (np.array(thing.box_min_m) + np.array(thing.box_max_m))
    centre = capture.position + sensor.apply(around.translation)
    if not np.allclose(centre, unity(pose.apply(middle)), atol=1e-6):
        yield f"box of {box.instanceId} is not where the object stands"
    front = sensor.apply(turn.apply([0.0, 0.0, 1.0]))
    right = sensor.apply(turn.apply([1.0, 0.0, 0.0]))
    axes = pose.rotation()
    if not np.allclose(front, unity(axes[:, 0])) or not np.allclose(right, unity(-axes[:, 1])):
        yield f"box of {box.instanceId} is turned"
    length, width, height = np.subtract(thing.box_max_m, thing.box_min_m)
    if not np.allclose(around.size, [width, height, length]):
        yield f"size of {box.instanceId}"
    corners = around.translation + turn.apply(SIGNS * 0.5 * np.array(around.size))
    m = np.array(capture.matrix).reshape(3, 3)
    x, y = (corners[:, k] / corners[:, 2] * m[k, k] - m[k, 2] for k in (0, 1))
    w, h = capture.dimension
    u, v = np.clip(0.5 * (x + 1.0) * w, 0, w), np.clip(0.5 * (1.0 - y) * h, 0, h)
    left, top = box.origin
    right_px, bottom = left + box.dimension[0], top + box.dimension[1]
    if left < u.min() - 1 or top < v.min() - 1 or right_px > u.max() + 1 or bottom > v.max() + 1:
        yield f"2D box of {box.instanceId} leaves the 3D box"
    if thing.asset.endswith("box") and top > v.min() + 1 and bottom < v.max() - 1:
        yield f"3D box of {box.instanceId} is too large"


def wrong_colors(folder: Path, flat: Any, instances: Any, labels: Any) -> Iterator[str]:
    """Segmentation images against boxes and lists of colours."""
    pixels = [
        np.asarray(Image.open(folder / a.filename).convert("RGBA")) for a in (instances, labels)
    ]
    listed = [{tuple(row.color): row.labelName for row in instances.instances},
              {tuple(row.pixelValue): row.labelName for row in labels.instances}]  # fmt: skip
    for image, colors in zip(pixels, listed, strict=True):
        if {*map(tuple, np.unique(image.reshape(-1, 4), axis=0).tolist())} - {(0, 0, 0, 255)} != {
            *colors
        }:
            yield "colours of the image are not those listed"
            return
    for box, row in zip(flat.values, instances.instances, strict=True):
        here = (pixels[0] == row.color).all(-1)
        ys, xs = np.nonzero(here)
        extent = [xs.min(), ys.min(), np.ptp(xs) + 1, np.ptp(ys) + 1]
        if extent != [*box.origin, *box.dimension]:
            yield f"2D box of {box.instanceId} is not its mask's"
        if {listed[1][c] for c in {*map(tuple, pixels[1][here].tolist())}} != {row.labelName}:
            yield f"label of {box.instanceId}"


dataset = made_of(Solo())


def of_split(world: Any, split: str) -> list[Any]:
    return [sample for sample in world.samples if sample.split == split]


@pytest.mark.parametrize("split", ["train", "val"])
def test_frames_show_the_street(dataset: Path, world: Any, split: str) -> None:
    """Poses, boxes, colours and projection in Unity's left-handed frames."""
    root = dataset / split
    assert list(problems(root, read_json(root), of_split(world, split))) == []


@pytest.mark.slow
def test_the_official_converter_makes_coco_of_it(dataset: Path, world: Any, tmp_path: Path) -> None:
    """Boxes of SOLO2COCOConverter are as in the samples."""
    from pysolotools.consumers import Solo as Reader
    from pysolotools.converters.solo2coco import SOLO2COCOConverter

    SOLO2COCOConverter(Reader(data_path=str(dataset / "train"))).convert(
        output_path=str(tmp_path), dataset_name="coco"
    )
    (path,) = tmp_path.rglob("instances.json")
    rows = json.loads(path.read_text())["annotations"]
    boxes = [
        [t.box.x_min, t.box.y_min, t.box.width_px, t.box.height_px]
        for sample in of_split(world, "train")
        for t in sample.truth["color"].objects
    ]
    # The converter appends frames as its processes finish them.
    assert sorted(row["bbox"] for row in rows) == sorted(boxes)


@pytest.mark.slow
def test_sequences_have_steps(world: Any, samples: Any, tmp_path: Path) -> None:
    """Two cameras on a moving rig; each split numbers its sequences from 0."""
    info = world.info(8, ("left", "right"), steps_per_scene=4)
    root = world.export(Solo(), info, samples, tmp_path)
    for split, members in (("train", samples[:4]), ("val", samples[4:])):
        frames = read_json(root / split)
        assert [(f.sequence, f.step, len(f.captures)) for f in frames] == [
            (0, k, 2) for k in range(4)
        ]
        assert list(problems(root / split, frames, members)) == []
    left = read_json(root / "train")[2].captures[0]
    # 10 m/s on a circle to the left; the camera is 0.3 m before the rig's origin.
    assert np.linalg.norm(left.velocity) == pytest.approx(np.hypot(10.0, 0.06), abs=0.02)
    assert left.velocity[0] > 9.0 and left.velocity[2] > 0.0
    assert read_json(root / "train")[2].timestamp == pytest.approx(0.2)


def test_centres_behind_the_sensor_have_no_3d_box(world: Any, tmp_path: Path) -> None:
    """Readers divide by their depth; the 2D box stays."""
    near = world.instance(1, "car", -0.5, 1.6, 0.0)
    far = world.instance(2, "crate", 9.0, 0.0, 0.0)
    sample = world.sample(0, (near, far), [world.camera()])
    assert [t.instance.instance_id for t in sample.truth["color"].objects] == [1, 2]
    root = world.export(Solo(), world.info(1), [sample], tmp_path)
    (frame,) = read_json(root / "train")
    flat, solid, *_ = frame.captures[0].annotations
    assert [row.instanceId for row in flat.values] == [1, 2]
    assert [row.instanceId for row in solid.values] == [2]


def test_colors_differ() -> None:
    """Of all ids that an instance may have; only 0 is black."""
    colors = [id_color(number) for number in range(65_536)]
    assert len(set(colors)) == 65_536
    assert colors[0] == (0, 0, 0)
    ids = np.arange(65_536, dtype=np.uint16).reshape(256, 256)
    np.testing.assert_array_equal(id_colors()[ids].reshape(-1, 3), colors)
