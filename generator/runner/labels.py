"""``labels.jsonl``: one line per sample of a shard, with its annotations.

With the images, point clouds, tables and ``scenes.jsonl`` of the shard, it is the whole sample:
exporters can write their formats from these files without a renderer. Training needs no scenes: a
line has the ``instances`` of its objects, to which the objects refer by id. An object in an image
of another instant has its whole instance instead.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from gen_data.core import path_names, scene
from gen_data.core.sample import EgoTruth, ImageTruth, ObjectTruth, Sample
from gen_data.core.serialization import SPARSE, canonical_json, from_plain, to_plain

LABELS_NAME = "labels.jsonl"
_SPARSE = {SPARSE: True}


@dataclass(frozen=True, slots=True)
class ImageInfo:
    """Instant, exposure and faults of an image; see ``SensorReading``."""

    time_s: float
    ev100: float | None = None
    faults: Mapping[str, Any] = field(default_factory=dict, metadata=_SPARSE)


@dataclass(frozen=True, slots=True)
class ScanInfo:
    """Instant, pose and faults of a laser scan; see ``PointCloud``."""

    lidar: scene.Lidar
    time_s: float
    faults: Mapping[str, Any] = field(default_factory=dict, metadata=_SPARSE)


@dataclass(frozen=True, slots=True)
class TableInfo:
    """Instant, pose and faults of a device's measurements; see ``Measurements``."""

    device: scene.Device
    time_s: float
    faults: Mapping[str, Any] = field(default_factory=dict, metadata=_SPARSE)


@dataclass(frozen=True, eq=False, slots=True)
class Labels:
    """The annotations of one sample, and the instants of its sensors.

    Attributes:
        index, split: See ``Sample``.
        truth: Annotations by camera.
        frame: Annotations of the sample as a whole; None if there are none.
        images, scans, tables: By sensor, for the sensors with a reading in this sample.
    """

    index: int
    split: str
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
    shown = {o.instance.instance_id for t in sample.truth.values() for o in t.objects}
    return canonical_json(
        {
            "index": sample.index,
            "split": sample.split,
            "instances": [i for number, i in instances.items() if number in shown],
            "truth": {name: _plain_image(t, instances) for name, t in sample.truth.items()},
            "frame": sample.frame,
            "images": {
                n: ImageInfo(r.time_s, r.ev100, r.faults) for n, r in capture.readings.items()
            },
            "scans": {n: ScanInfo(c.lidar, c.time_s, c.faults) for n, c in capture.clouds.items()},
            "tables": {
                n: TableInfo(t.device, t.time_s, t.faults) for n, t in capture.tables.items()
            },
        }
    )


def parse_labels(line: bytes | str) -> Labels:
    """The inverse of ``labels_line``.

    Raises:
        ValueError, KeyError, TypeError: the line is damaged.
    """
    plain = json.loads(line)
    instances = {i["instance_id"]: from_plain(scene.Instance, i) for i in plain.pop("instances")}
    for image in plain["truth"].values():
        for item in image["objects"]:
            if isinstance(item["instance"], int):
                item["instance"] = instances[item["instance"]]
    labels = from_plain(Labels, plain)
    # They become parts of paths.
    for name in (labels.split, *labels.images, *labels.scans, *labels.tables):
        path_names.check_name(name)
    return labels


def _plain_image(truth: ImageTruth, instances: Mapping[int, scene.Instance]) -> dict[str, Any]:
    objects = [_plain_object(item, instances) for item in truth.objects]
    return {**{name: to_plain(getattr(truth, name)) for name in _IMAGE_FIELDS}, "objects": objects}


def _plain_object(truth: ObjectTruth, instances: Mapping[int, scene.Instance]) -> dict[str, Any]:
    """Fields that are not None, which stands for annotations that were not requested."""
    values = ((name, getattr(truth, name)) for name in _OBJECT_FIELDS)
    plain = {name: to_plain(value) for name, value in values if value is not None or name == "box"}
    number = truth.instance.instance_id
    same = instances.get(number) == truth.instance
    return {**plain, "instance": number if same else to_plain(truth.instance)}
