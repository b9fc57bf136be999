"""OpenLane: lines of lanes in space and in images, one JSON file per photograph.

::

    images/<split>/<segment>/000000012.png             links to the photographs (PNG, or JPEG)
    lane3d_1000/<split>/<segment>/000000012.json       lines of lanes
    lane3d_1000/<split>.txt                            files of a split, one a line

Splits are ``training``, ``validation`` and ``test``; a segment is a sequence of one camera.

A file has ``intrinsic`` (3 x 3, pixel centres are whole numbers), ``extrinsic`` (4 x 4, pose of the
camera in the vehicle's frame, both X forward, Y left, Z up), ``file_path`` (below ``images``) and
``lane_lines``. A line has

* ``category``: 1 white dashed, 2 white solid, 3 and 4 double, 7 to 10 the same in yellow,
  20 and 21 edges without paint left and right of the camera;
* ``xyz`` (3 x n): points in the camera frame, X forward, Y left, Z up [m], from near to far;
* ``uv`` (2 x n): the same points in the image; ``visibility`` (n): 1 visible, 0 hidden;
* ``attribute``: 1 left-left, 2 left, 3 right, 4 right-right of the camera, 0 none of these four;
* ``track_id``: number of the border, the same in all frames of a scene.

Borders without paint between lanes are left out, and points outside the image. The origin of the
vehicle is on the ground: below the middle of the rear axle, or below a camera that is on no rig.

Reference: Chen et al., "PersFormer: 3D Lane Detection via Perspective Transformer and the OpenLane
Benchmark", ECCV 2022, and the annotation format of OpenLane 1.x.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.core.scene_time import RIG_AXES
from gen_data.core.se3 import Array
from gen_data.exporters import base, fragments, image_files, sequences
from gen_data.exporters.conventions import PINHOLE, Conventions
from gen_data.exporters.lane_lines import (
    LaneLine,
    PaintedWorlds,
    lane_lines,
    level_pose,
    vehicle_pose,
)
from gen_data.exporters.nuscenes_frames import intrinsic_rows
from gen_data.exporters.road_map import StreetExporter
from gen_data.exporters.sensor_selection import check_pinholes, photographs, rgb_cameras

SPLITS = {"train": "training", "val": "validation", "test": "test"}
LANES = "lane3d_1000"
LEFT_EDGE, RIGHT_EDGE, YELLOW = 20, 21, 6
"""Categories of edges; the difference between the categories of yellow and of white lines."""
ATTRIBUTES = {-2: 1, -1: 2, 1: 3, 2: 4}
DECIMALS = 4


class OpenLane(StreetExporter):
    """OpenLane 1.x: lines of lanes in space and in images, with visibility of every point."""

    type: Literal["openlane"] = "openlane"
    conventions: ClassVar[Conventions] = Conventions(pixel_centre="i", lens=PINHOLE)
    annotators: ClassVar[frozenset[str]] = frozenset({"lanes"})
    own_classes: ClassVar[bool] = True
    image_formats: ClassVar[frozenset[str]] = base.PNG_OR_JPEG

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: there is no photograph, a camera is not a pinhole, or Shapely is missing.
        """
        check_pinholes(info, rgb_cameras(info), self.type)
        super().check(info)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a file per photograph."""
        self.check(info)
        rows, worlds = [], PaintedWorlds(self.library)
        for sample, sensor in photographs(info, samples):
            name = _path(info, sample, sensor)
            suffix = info.encoding(sensor, Channel.RGB).suffix
            lines = lane_lines(sample, sensor, worlds.dividers(sample, sensor))
            content = frame(sample, sensor, lines) | {"file_path": f"{name}{suffix}"}
            sequences.write_json(shard_dir / self.type / f"{name}.json", content)
            rows.append({"sample": sample.index, "sensor": sensor, "name": name, "suffix": suffix})
        sequences.write_frames(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link images and files, and list them."""
        lists: dict[str, list[str]] = {}
        for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, sequences.FRAMES):
            name = row["name"]
            source = shard_dir / self.type / f"{name}.json"
            image_files.link_or_copy(source, dataset_dir / LANES / f"{name}.json")
            target = dataset_dir / "images" / f"{name}{row['suffix']}"
            image_files.link_photograph(info, shard_dir, row, target)
            lists.setdefault(name.partition("/")[0], []).append(f"{name}.json\n")
        for split, names in lists.items():
            sequences.write_text(dataset_dir / LANES / f"{split}.txt", "".join(names))


def _path(info: DatasetInfo, sample: Sample, sensor: str) -> str:
    """Path of a photograph below ``images``, without its suffix."""
    segment = f"segment-{sequences.sequence_number(info, sample.index):06d}_{sensor}"
    return f"{SPLITS.get(sample.split, sample.split)}/{segment}/{sample.index:09d}"


def frame(sample: Sample, sensor: str, lines: Iterable[LaneLine]) -> dict[str, Any]:
    """Content of the file of a photograph, without ``file_path``."""
    scene, camera = sample.scene_of(sensor), sample.truth[sensor].camera
    T_vehicle_camera = vehicle_pose(scene, camera).inverse()
    if camera.T_sensor_reported is not None:
        T_vehicle_camera = T_vehicle_camera @ camera.T_sensor_reported
    T_vehicle_camera = T_vehicle_camera @ RIG_AXES
    T_camera_level = (level_pose(scene, camera) @ RIG_AXES).inverse()
    return {
        "intrinsic": intrinsic_rows(camera.intrinsics),
        "extrinsic": np.round(T_vehicle_camera.matrix(), 9).tolist(),
        "lane_lines": [
            {
                "category": category(line),
                "visibility": [float(seen) for seen in line.visible],
                "uv": _rows(line.points_px - 0.5),
                "xyz": _rows(T_camera_level.apply(line.points_m)),
                "attribute": ATTRIBUTES.get(line.side, 0),
                "track_id": line.number,
            }
            for line in lines
        ],
    }


def category(line: LaneLine) -> int:
    """Category of a line: of its paint, else of an edge."""
    paint = line.paint
    if paint.style == "none":
        return LEFT_EDGE if line.left_m >= 0.0 else RIGHT_EDGE
    return 1 + (paint.style == "solid") + 2 * paint.is_double + YELLOW * paint.is_yellow


def _rows(points: Array) -> list[list[float]]:
    """Coordinates of points [n, k] as k rows."""
    rows: list[list[float]] = (np.round(points.T, DECIMALS) + 0.0).tolist()
    return rows
