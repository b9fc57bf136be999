"""Small data sets written by hand, without a renderer, whose statistics can be counted on paper."""

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.boxes import BoxPx, OrientedBox
from gen_data.core.capture import POINT, Capture, Channel, PointCloud, SensorReading
from gen_data.core.interfaces import DatasetInfo, Modality, SensorInfo, cloud_path, media_path
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import (
    BorderTruth,
    EgoTruth,
    ImageTruth,
    KeypointTruth,
    MaskPx,
    ObjectTruth,
    Sample,
)
from gen_data.core.scene import Camera, Instance, Lidar, Scene
from gen_data.core.se3 import IDENTITY, SE3
from gen_data.core.serialization import to_plain
from gen_data.runner.labels import labels_line
from gen_data.runner.plan import Plan, plan_bytes
from gen_data.runner.provenance import scene_line

WIDTH_PX, HEIGHT_PX = 64, 48
CAMERA = Camera("color", IDENTITY, Intrinsics.from_hfov(WIDTH_PX, HEIGHT_PX, math.radians(60)))
POINTS = np.zeros(3, POINT)
POINTS["position_m"] = [(0, 0, 2), (0.1, 0.2, 4), (0, 0, -2)]
HOSTILE = "</script><script>alert('x')</script><img src=x onerror=alert(1)>"
HOSTILE_NAME = HOSTILE.replace("/", "")
"""As a name of a category or a data set, which cannot have slashes."""


def make_object(number: int, category: str, x_px: int = 20, side_px: int = 8) -> ObjectTruth:
    """A cube 3 m ahead that is wholly visible; its +Z axis points to the camera.

    Its 3D box projects to a square around the middle of the 2D box.
    """
    instance = Instance(number, f"it/{number}", category, 1, "cube", attributes=(("pose", "<b>"),))
    box = BoxPx(x_px, 20, x_px + side_px, 20 + side_px)
    lens = CAMERA.intrinsics
    x_m = 3.0 * (x_px + 0.5 * side_px - lens.cx_px) / lens.fx_px
    y_m = 3.0 * (20 + 0.5 * side_px - lens.cy_px) / lens.fy_px
    side_m = 3.0 * (side_px + 2) / lens.fx_px
    # Turned by pi about X: Z points back to the camera.
    pose = SE3((x_m, y_m, 3.0), (0.0, 1.0, 0.0, 0.0))
    return ObjectTruth(
        instance,
        visible_px=side_px * side_px,
        box=box,
        amodal_box=box,
        box3d_camera=OrientedBox(pose, (side_m, side_m, side_m)),
        mask=MaskPx(x_px, 20, np.ones((side_px, side_px), bool)),
        visible_fraction=1.0,
        occlusion=0.0,
        truncation=0.0,
        keypoints=(KeypointTruth("nose", (0.0, 0.0, 1.0), (30.0, 20.0), 2),),
        lidar_points={"top": 7, "front": 4},
    )


def make_image(rng: np.random.Generator) -> NDArray[np.uint8]:
    patches = rng.integers(0, 256, (6, 8, 3), dtype=np.uint8)
    image: NDArray[np.uint8] = np.repeat(np.repeat(patches, 8, axis=0), 8, axis=1)
    return image


def write_dataset(
    folder: Path,
    samples: Sequence[Sequence[ObjectTruth]],
    categories: tuple[str, ...],
    images: Sequence[NDArray[np.uint8]],
    frames: Sequence[EgoTruth] = (),
    borders: tuple[BorderTruth, ...] | None = None,
    **changes: Any,
) -> Path:
    """A finished data set with a camera and a laser scanner, in one shard; images, frames in turn.

    Scene ``k`` is sample ``k``; every fourth sample is in the split ``val``. Depth is 2 m
    everywhere; the scanner has three points, of which one is behind the camera.
    """
    n = len(samples)
    sensors = (SensorInfo("color", Modality.CAMERA, channels=(Channel.RGB, Channel.Z_DEPTH)),
               SensorInfo("top", Modality.LIDAR))  # fmt: skip
    info = replace(DatasetInfo("hand", 3, n, 1, categories, sensors), **changes)
    shard = folder / "shards/000000"
    for path in (
        media_path(shard, "color", Channel.RGB, 0),
        media_path(shard, "color", Channel.Z_DEPTH, 0),
        cloud_path(shard, "top", 0),
    ):
        path.parent.mkdir(parents=True)
    (folder / "plan.json").write_bytes(
        plan_bytes(Plan({"template": "hand"}, "hand", 3, n, n, {"gen-data": "0"}, {}))
    )
    manifest = {"info": to_plain(info), "dataset_id": "ab" * 32, "bytes": 5_000_000,
                "rejections": 2}  # fmt: skip
    (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    (folder / "LICENSES-ASSETS.md").write_text(
        "# Assets of this data set\n\n| source | licence | author | assets |\n|---|---|---|---|\n"
        f"| pack | CC0-1.0 | {HOSTILE} | cube, a | b |\n",
        encoding="utf-8",
    )
    pngs = [cv2.imencode(".png", image)[1].tobytes() for image in images]
    height_px, width_px = images[0].shape[:2]
    camera = replace(CAMERA, intrinsics=Intrinsics.from_hfov(width_px, height_px, math.radians(60)))
    depth = np.full((height_px, width_px), 20_000, np.uint16)  # of 0.1 mm
    depth_png = cv2.imencode(".png", depth)[1].tobytes()
    with (
        (shard / "labels.jsonl").open("w", encoding="utf-8") as labels,
        (shard / "scenes.jsonl").open("w", encoding="utf-8") as scenes,
    ):
        for index, objects in enumerate(samples):
            frame = frames[index % len(frames)] if frames else None
            truth = {"color": ImageTruth(camera, tuple(objects), borders=borders)}
            sample = replace(_sample(index, objects, camera), frame=frame, truth=truth)
            labels.write(labels_line(sample) + "\n")
            scenes.write(scene_line(sample, None) + "\n")
            media_path(shard, "color", Channel.RGB, index).write_bytes(pngs[index % len(pngs)])
            media_path(shard, "color", Channel.Z_DEPTH, index).write_bytes(depth_png)
            np.save(cloud_path(shard, "top", index), POINTS)
    return folder


def _sample(index: int, objects: Sequence[ObjectTruth], camera: Camera) -> Sample:
    scene = Scene("hand", instances=tuple(o.instance for o in objects), cameras=(camera,))
    return Sample(
        index=index,
        scene_index=index,
        view_index=0,
        split="train" if index % 4 else "val",
        scene=scene,
        capture=Capture(
            {"color": SensorReading("color", camera, {})},
            {"top": PointCloud("top", Lidar("top", "color"), POINTS)},
        ),
        truth={},
    )
