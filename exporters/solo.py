"""SOLO, the format of Unity's Perception package.

::

    <split>/metadata.json, {annotation,metric,sensor}_definitions.json
    <split>/sequence.0/step0.frame_data.json
    <split>/sequence.0/step0.color.png
    <split>/sequence.0/step0.color.instance segmentation.png
    <split>/sequence.0/step0.color.semantic segmentation.png

A sequence is a view with its steps. Where SOLO's conventions differ from ours:

* **Frames** are left-handed. World: ours with Y and Z exchanged (Y up). Sensor: X right, Y up, Z
  forward. Boxes: X right, Y up, Z to the object's front; ``size`` in that order. An object whose
  centre is behind the sensor has no 3D box.
* **Quaternions** are ``x y z w``.
* **matrix** is the upper left part of OpenGL's projection matrix, row by row, with the far plane at
  infinity: ``m00 = 2 fx / W``, ``m11 = 2 fy / H``.
* **Segmentation** images have a colour per instance, which is a function of its id, or per label;
  black is everything else.
* **Readers** derive the place of a frame from the numbers of frames and sequences: all
  sequences must have the same length.

References: SOLO's schema in the documentation of Unity's Perception package 1.0; pysolotools.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from gen_data.core import errors, intrinsics
from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.motion import Twist
from gen_data.core.reported import reported
from gen_data.core.sample import ObjectTruth, Sample
from gen_data.core.scene import Camera, Scene
from gen_data.core.se3 import SE3, Array, Vec3, rotation_to_quaternion
from gen_data.exporters import base, fragments, image_files, label_png
from gen_data.exporters.conventions import EDGES, PINHOLE, READING, Conventions
from gen_data.exporters.id_colors import id_color, id_colors
from gen_data.exporters.oxts import rig_motion
from gen_data.exporters.sensor_selection import check_pinholes, rgb_camera, rgb_cameras, stamp_s
from gen_data.exporters.sequences import camera_mount, frame_facts, write_bytes, write_json

FORMAT_VERSION = "1.0.0-preview.1"
"""Version of Unity's Perception package whose schema the files follow."""

PREFIX = "type.unity.com/unity.solo."
IMAGE_FORMATS = {"png": "Png", "jpeg": "Jpg"}
"""Unity's name by image format."""
BOX2D, BOX3D = "bounding box", "bounding box 3D"
INSTANCES, LABELS = "instance segmentation", "semantic segmentation"
TYPES = {
    BOX2D: "BoundingBox2DAnnotation",
    BOX3D: "BoundingBox3DAnnotation",
    INSTANCES: "InstanceSegmentationAnnotation",
    LABELS: "SemanticSegmentationAnnotation",
}
DESCRIPTIONS = {
    BOX2D: "Tight boxes of visible pixels.",
    BOX3D: "Oriented boxes in the sensor's frame.",
    INSTANCES: "A colour per visible object.",
    LABELS: "A colour per label.",
}

UNITY_WORLD = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
"""Our world's axes in Unity's: Y and Z are exchanged. Equal to its inverse."""
UNITY_SENSOR = np.diag([1.0, -1.0, 1.0])
"""Our camera's axes in Unity's: Y points up. Equal to its inverse."""
UNITY_OBJECT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Axes of our objects (X front, Y left, Z up) in Unity's (X right, Y up, Z front)."""

FRAMES = "frames"


class Solo(base.ExporterBase):
    """Unity SOLO: images of all cameras with boxes and segmentation, one data set per split."""

    type: Literal["solo"] = "solo"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5", box=EDGES, lens=PINHOLE, time=READING
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"instance_masks", "boxes3d"})

    image_formats: ClassVar[frozenset[str]] = base.PNG_OR_JPEG

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no camera writes the rgb channel, one of them is not a pinhole, or the last
                sequence is incomplete.
        """
        rgb_camera(info, "", self.type)
        check_pinholes(info, rgb_cameras(info), self.type)
        if info.n % info.steps_per_scene:
            raise errors.ConfigError(
                f"exporter '{self.type}': all sequences must have the same length; expected a "
                f"multiple of {info.steps_per_scene} samples, not {info.n}"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write segmentation images and a JSON line per frame.

        Raises:
            ConfigError: see ``check``.
        """
        self.check(info)
        folder = shard_dir / self.type
        rows = []
        for sample in samples:
            cameras = [name for name in rgb_cameras(info) if name in sample.truth]
            for name in cameras:
                _write_segmentation(folder, sample, name)
            if cameras:
                captures = [_capture(info, sample, name) for name in cameras]
                time_s = round(stamp_s(sample, cameras[0]), 9)
                rows.append({**frame_facts(info, sample), "time_s": time_s, "captures": captures})
        fragments.write_fragment(folder, FRAMES, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Number sequences and frames of each split, and link their images."""
        counts: dict[str, _Counter] = {}
        for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, FRAMES):
            counter = counts.setdefault(row["split"], _Counter())
            counter.advance(row["sequence"])
            folder = dataset_dir / row["split"] / f"sequence.{counter.sequence}"
            stem = f"step{counter.step}"
            captures = [_numbered(info, capture, stem) for capture in row["captures"]]
            frame = {
                "frame": counter.frames,
                "sequence": counter.sequence,
                "step": counter.step,
                "timestamp": row["time_s"],
                "captures": captures,
                "metrics": [],
            }
            write_json(folder / f"{stem}.frame_data.json", frame)
            for capture in captures:
                _link_images(info, shard_dir, capture, row["index"], folder)
        for split, counter in counts.items():
            _write_definitions(info, dataset_dir / split, counter)


@dataclass(slots=True)
class _Counter:
    """Numbers of the latest frame of a split, from 0.

    Attributes:
        frames: Number of the frame, from 1: SOLO numbers frames of a simulation.
        original: Number of its sequence in the whole data set.
    """

    frames: int = 0
    sequence: int = -1
    step: int = -1
    original: int = -1

    def advance(self, original: int) -> None:
        """Go on to the next frame, which belongs to the given sequence."""
        self.frames += 1
        self.step += 1
        if original != self.original:
            self.original, self.step = original, 0
            self.sequence += 1


def _capture(info: DatasetInfo, sample: Sample, name: str) -> dict[str, Any]:
    truth = sample.truth[name]
    camera = truth.camera
    T_world_camera = reported(camera).T_world_camera
    rotation = UNITY_WORLD @ T_world_camera.rotation() @ UNITY_SENSOR
    twist = _camera_twist(sample.scene_of(name), camera)
    seen = [thing for thing in truth.objects if thing.box is not None and not thing.ignored]
    size = [camera.intrinsics.width_px, camera.intrinsics.height_px]
    return {
        "@type": f"{PREFIX}RGBCamera",
        "id": name,
        "description": "",
        "position": _numbers(UNITY_WORLD @ T_world_camera.translation_m),
        "rotation": _quaternion_xyzw(rotation),
        "velocity": _numbers(UNITY_WORLD @ twist.velocity_m_s),
        "acceleration": _numbers(UNITY_WORLD @ twist.acceleration_m_s2),
        "imageFormat": IMAGE_FORMATS[info.encoding(name, Channel.RGB).format],
        "dimension": size,
        "projection": "Perspective",
        "matrix": _projection(camera.intrinsics),
        "annotations": [
            {**_head(BOX2D, name), "values": [_box2d(thing) for thing in seen]},
            {
                **_head(BOX3D, name),
                "values": [_box3d(t, camera.T_world_camera) for t in seen if _is_ahead(t)],
            },
            {
                **_head(INSTANCES, name),
                "imageFormat": "Png",
                "dimension": size,
                "instances": [
                    {**_label(thing), "color": _rgba(thing.instance.instance_id)} for thing in seen
                ],
            },
            {
                **_head(LABELS, name),
                "imageFormat": "Png",
                "dimension": size,
                "instances": [
                    {"labelName": label, "pixelValue": _rgba(number)}
                    for number, label in sorted(
                        {(t.instance.category_id, t.instance.category) for t in seen}
                    )
                ],
            },
        ],
    }


def _rgba(number: int) -> list[int]:
    return [*id_color(number), 255]


def _head(annotation: str, sensor: str) -> dict[str, Any]:
    return {
        "@type": PREFIX + TYPES[annotation],
        "id": annotation,
        "sensorId": sensor,
        "description": DESCRIPTIONS[annotation],
    }


def _label(thing: ObjectTruth) -> dict[str, Any]:
    instance = thing.instance
    return {
        "instanceId": instance.instance_id,
        "labelId": instance.category_id,
        "labelName": instance.category,
    }


def _box2d(thing: ObjectTruth) -> dict[str, Any]:
    assert thing.box is not None, "invisible objects are not listed"
    box = thing.box
    return {
        **_label(thing),
        "origin": [box.x_min, box.y_min],
        "dimension": [box.width_px, box.height_px],
    }


def _is_ahead(thing: ObjectTruth) -> bool:
    """Whether the centre of an object's 3D box lies in front of the camera."""
    assert thing.box3d_camera is not None, "the annotation boxes3d is in `needs`"
    return thing.box3d_camera.T_frame_box.translation_m[2] > 0.0


def _box3d(thing: ObjectTruth, T_world_camera: SE3) -> dict[str, Any]:
    assert thing.box3d_camera is not None, "the annotation boxes3d is in `needs`"
    box = thing.box3d_camera
    rotation = UNITY_SENSOR @ box.T_frame_box.rotation() @ UNITY_OBJECT.T
    twist = thing.instance.twist.seen_along(T_world_camera)
    return {
        **_label(thing),
        "translation": _numbers(UNITY_SENSOR @ box.T_frame_box.translation_m),
        "size": _numbers(np.abs(UNITY_OBJECT) @ box.size_m),
        "rotation": _quaternion_xyzw(rotation),
        "velocity": _numbers(UNITY_SENSOR @ twist.velocity_m_s),
        "acceleration": _numbers(UNITY_SENSOR @ twist.acceleration_m_s2),
    }


def _camera_twist(scene: Scene, camera: Camera) -> Twist:
    """Motion of a camera over the ground; it stands still without a rig."""
    return rig_motion(scene, camera_mount(scene, camera.name, true=True)).twist


def _projection(camera: intrinsics.Intrinsics) -> list[float]:
    """Upper left part of the projection matrix, row by row; the far plane is at infinity."""
    width, height = camera.width_px, camera.height_px
    shift_x, shift_y = 1.0 - 2.0 * camera.cx_px / width, 2.0 * camera.cy_px / height - 1.0
    rows = [
        [2.0 * camera.fx_px / width, 0.0, shift_x],
        [0.0, 2.0 * camera.fy_px / height, shift_y],
        [0.0, 0.0, -1.0],
    ]
    return [value for row in rows for value in _numbers(row)]


def _quaternion_xyzw(rotation: Array) -> list[float]:
    w, x, y, z = rotation_to_quaternion(rotation)
    return _numbers([x, y, z, w])


def _numbers(values: Vec3 | Iterable[float] | Array) -> list[float]:
    # Adding 0.0 turns -0.0 into 0.0.
    return [round(float(value), 9) + 0.0 for value in values]


def _write_segmentation(folder: Path, sample: Sample, name: str) -> None:
    """Write the visible masks in the colours of instances, and of labels."""
    truth = sample.truth[name]
    camera = truth.camera.intrinsics
    seen = [thing for thing in truth.objects if thing.box is not None and not thing.ignored]
    numbers = label_png.number_masks(seen, camera.height_px, camera.width_px)
    for kind, ids in (
        (INSTANCES, [0, *(thing.instance.instance_id for thing in seen)]),
        (LABELS, [0, *(thing.instance.category_id for thing in seen)]),
    ):
        path = folder / _shard_name(sample.index, name, kind)
        write_bytes(path, label_png.encode_label_png(numbers, id_colors()[ids]))


def _shard_name(index: int, sensor: str, kind: str) -> str:
    return f"{index:09d}.{sensor}.{kind}.png"


def _numbered(info: DatasetInfo, capture: Mapping[str, Any], stem: str) -> dict[str, Any]:
    """The capture with the names of its files."""
    annotations = [
        {**a, "filename": f"{stem}.{capture['id']}.{a['id']}.png"} if "instances" in a else a
        for a in capture["annotations"]
    ]
    suffix = info.encoding(capture["id"], Channel.RGB).suffix
    name = f"{stem}.{capture['id']}{suffix}"
    return {**capture, "filename": name, "annotations": annotations}


def _link_images(
    info: DatasetInfo, shard_dir: Path, capture: Mapping[str, Any], index: int, folder: Path
) -> None:
    sensor = capture["id"]
    rgb = info.media_path(shard_dir, sensor, Channel.RGB, index)
    image_files.link_or_copy(rgb, folder / capture["filename"])
    for annotation in capture["annotations"]:
        if "filename" in annotation:
            source = shard_dir / "solo" / _shard_name(index, sensor, annotation["id"])
            image_files.link_or_copy(source, folder / annotation["filename"])


def _write_definitions(info: DatasetInfo, folder: Path, counter: _Counter) -> None:
    documents = {
        "metadata": {
            "unityVersion": "",
            "perceptionVersion": FORMAT_VERSION,
            "renderPipeline": "",
            "simulationStartTime": "",
            "simulationEndTime": "",
            "scenarioRandomSeed": info.seed,
            "scenarioActiveRandomizers": [],
            "totalFrames": counter.frames,
            "totalSequences": counter.sequence + 1,
            "sensors": list(rgb_cameras(info)),
            "metricCollectors": [],
            "annotators": [{"name": name, "type": PREFIX + kind} for name, kind in TYPES.items()],
        },
        "annotation_definitions": {"annotationDefinitions": list(_annotation_definitions(info))},
        "metric_definitions": {"metricDefinitions": []},
        "sensor_definitions": {
            "sensorDefinitions": [
                {
                    "@type": f"{PREFIX}RGBCamera",
                    "id": name,
                    "modality": "camera",
                    "description": "",
                    "firstCaptureFrame": 0,
                    "captureTriggerMode": "Scheduled",
                    "simulationDeltaTime": info.step_s,
                    "framesBetweenCaptures": 0,
                    "manualSensorsAffectTiming": False,
                }
                for name in rgb_cameras(info)
            ]
        },
    }
    for name, document in documents.items():
        write_json(folder / f"{name}.json", document)


def _annotation_definitions(info: DatasetInfo) -> Iterator[dict[str, Any]]:
    names = list(enumerate(info.categories, 1))
    ids = [{"label_id": number, "label_name": name} for number, name in names]
    colors = [{"label_name": name, "pixel_value": _rgba(number)} for number, name in names]
    for annotation, kind in TYPES.items():
        yield {
            "@type": PREFIX + kind,
            "id": annotation,
            "description": DESCRIPTIONS[annotation],
            "spec": colors if annotation == LABELS else ids,
        }
