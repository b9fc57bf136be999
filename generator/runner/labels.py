"""``labels.jsonl``: one line per sample of a shard, with its annotations.

With the images, point clouds, tables and ``scenes.jsonl`` of the shard, it is the whole sample:
exporters can write their formats from these files without a renderer.

The ``instance`` of an object is an instance id if the instance equals that of the sample's scene,
else (in an image of another instant) the whole instance.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from gen_data.generator.core.sample import EgoTruth, ImageTruth, ObjectTruth, Sample
from gen_data.generator.core.scene import Device, Instance, Lidar, Scene
from gen_data.generator.core.serialization import canonical_json, from_plain, to_plain

LABELS_NAME = "labels.jsonl"


@dataclass(frozen=True, slots=True)
class ImageInfo:
    """Instant and exposure of an image; see ``SensorReading``."""

    time_s: float
    ev100: float | None = None


@dataclass(frozen=True, slots=True)
class ScanInfo:
    """Instant and pose of a laser scan; see ``PointCloud``."""

    lidar: Lidar
    time_s: float


@dataclass(frozen=True, slots=True)
class TableInfo:
    """Instant and pose of a device's measurements; see ``Measurements``."""

    device: Device
    time_s: float


@dataclass(frozen=True, eq=False, slots=True)
class Labels:
    """The annotations of one sample, and the instants of its sensors.

    Attributes:
        index: Number of the sample.
        truth: Annotations by camera.
        frame: Annotations of the sample as a whole; None if there are none.
        images, scans, tables: By sensor, for those with a reading in this sample.
    """

    index: int
    truth: Mapping[str, ImageTruth]
    frame: EgoTruth | None
    images: Mapping[str, ImageInfo]
    scans: Mapping[str, ScanInfo] = field(default_factory=dict)
    tables: Mapping[str, TableInfo] = field(default_factory=dict)


_IMAGE_FIELDS = tuple(f.name for f in fields(ImageTruth) if f.name != "objects")
# Label maps, which set `ignored`, apply to exports only.
_OBJECT_FIELDS = tuple(f.name for f in fields(ObjectTruth) if f.name not in ("instance", "ignored"))


def labels_line(sample: Sample) -> str:
    """Format the line of a sample, without line break."""
    capture = sample.capture
    instances = {i.instance_id: i for i in sample.scene.instances}
    return canonical_json(
        {
            "index": sample.index,
            "truth": {name: _plain_image(t, instances) for name, t in sample.truth.items()},
            "frame": sample.frame,
            "images": {n: ImageInfo(r.time_s, r.ev100) for n, r in capture.readings.items()},
            "scans": {n: ScanInfo(c.lidar, c.time_s) for n, c in capture.clouds.items()},
            "tables": {n: TableInfo(t.device, t.time_s) for n, t in capture.tables.items()},
        }
    )


def read_labels(path: Path, scenes: Mapping[int, Scene]) -> Iterator[Labels]:
    """Read the annotations of a shard, in order.

    Args:
        path: Of the file.
        scenes: The scene of each sample by its index.

    Raises:
        ValueError, KeyError, TypeError: the file is damaged.
    """
    with path.open(encoding="utf-8") as lines:
        for line in lines:
            plain = json.loads(line)
            _resolve_instances(plain, scenes[plain["index"]])
            yield from_plain(Labels, plain)


def _resolve_instances(plain: Mapping[str, Any], scene: Scene) -> None:
    """Replace instance ids by the instances of the scene."""
    instances = {i.instance_id: i for i in scene.instances}
    for image in plain["truth"].values():
        for item in image["objects"]:
            if isinstance(item["instance"], int):
                item["instance"] = instances[item["instance"]]


def _plain_image(truth: ImageTruth, instances: Mapping[int, Instance]) -> dict[str, Any]:
    objects = [_plain_object(item, instances) for item in truth.objects]
    return {**{name: to_plain(getattr(truth, name)) for name in _IMAGE_FIELDS}, "objects": objects}


def _plain_object(truth: ObjectTruth, instances: Mapping[int, Instance]) -> dict[str, Any]:
    """Fields that are not None, which stands for annotations that were not requested."""
    values = ((name, getattr(truth, name)) for name in _OBJECT_FIELDS)
    plain = {name: to_plain(value) for name, value in values if value is not None or name == "box"}
    number = truth.instance.instance_id
    same = instances.get(number) == truth.instance
    return {**plain, "instance": number if same else to_plain(truth.instance)}
