"""Grasps in the arrays of GraspNet-1Billion and SuctionNet-1Billion.

::

    <split>/000000012_color.png
    <split>/000000012_color_grasps.npy     float32 [n, 17]
    <split>/000000012_color_suctions.npy   float32 [n, 8]

Rows of grasps are score, width, height, depth, rotation (3 x 3, row by row; X = approach, Y =
opening), translation, object id; ``GraspGroup().from_npy`` of graspnetAPI reads them. Rows of
suctions are score, direction (out of the surface), translation, object id, as ``SuctionGroup`` of
suctionnetAPI has them. All are in the camera frame [m], of the objects that are annotated in the
image; object ids are instance ids. Height and depth refer to the fingers: ``finger_m`` and
``reach_m`` of the annotation ``grasps``. Width is the opening of the hand before it closes: the
distance of the contacts, with ``clearance_m`` on both sides. Fingers so far apart are free of
everything, as the fingers of graspnetAPI's collision test must be.
"""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import ImageTruth, Sample
from gen_data.exporters import coco, fragments, image_files, image_rows
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.sequences import write_bytes


class GraspNet(image_rows.ImageRowsExporter):
    """Grasps and suctions of the objects in every photograph.

    Attributes:
        height_m: Height of the fingers, as the annotation has it.
        depth_m: Reach of the fingers beyond the contacts, as the annotation has it.
        clearance_m: Distance between fingers and contacts before they close, as the annotation has
            it.
    """

    type: Literal["graspnet"] = "graspnet"
    conventions: ClassVar[Conventions] = Conventions(lens=ANY_LENS)
    annotators: ClassVar[frozenset[str]] = frozenset({"grasps"})

    height_m: float = Field(0.02, gt=0)
    depth_m: float = Field(0.015, ge=0)
    clearance_m: float = Field(0.003, ge=0)

    def image_row(self, info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
        """The rows of its arrays."""
        suffix = info.encoding(sensor, Channel.RGB).suffix
        return {
            "file_name": coco.image_name(sample.index, sensor, suffix),
            "grasps": self._grasps(sample, sensor),
            "suctions": _suctions(sample, sensor),
        }

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the arrays and link the images."""
        for split, rows in fragments.split_rows(shard_dirs, self.type):
            for shard_dir, row in rows:
                image = dataset_dir / split / row["file_name"]
                for name, columns in (("grasps", 17), ("suctions", 8)):
                    file = io.BytesIO()
                    np.save(file, np.array(row[name], np.float32).reshape(-1, columns))
                    write_bytes(image.with_name(f"{image.stem}_{name}.npy"), file.getvalue())
                image_files.link_photograph(info, shard_dir, row, image)

    def _grasps(self, sample: Sample, sensor: str) -> list[list[float]]:
        frame, truth = sample.frame, sample.truth[sensor]
        shown = _shown(truth)
        T_camera_world = truth.camera.T_world_camera.inverse()
        rows = []
        for grasp in (frame.grasps if frame else None) or ():
            if grasp.instance_id in shown:
                pose = T_camera_world @ grasp.T_world_grasp
                opening_m = grasp.width_m + 2.0 * self.clearance_m
                size = [grasp.score, opening_m, self.height_m, self.depth_m]
                place = [*pose.rotation().ravel().tolist(), *pose.translation_m]
                rows.append([*size, *place, grasp.instance_id])
        return rows


def _shown(truth: ImageTruth) -> set[int]:
    """Ids of the visible instances that count."""
    return {
        thing.instance.instance_id
        for thing in truth.objects
        if thing.box is not None and not thing.ignored
    }


def _suctions(sample: Sample, sensor: str) -> list[list[float]]:
    frame, truth = sample.frame, sample.truth[sensor]
    shown = _shown(truth)
    T_camera_world = truth.camera.T_world_camera.inverse()
    rows = []
    for suction in (frame.suctions if frame else None) or ():
        if suction.instance_id in shown:
            direction = T_camera_world.rotate(np.array(suction.normal)).tolist()
            place = T_camera_world.apply(np.array(suction.point_m)).tolist()
            rows.append([suction.score, *direction, *place, suction.instance_id])
    return rows
