"""Geometry of the steps of demonstrations, as arrays of the same shapes in a whole data set.

Objects, contacts and relations, which differ in number from step to step, fill the first rows of
their arrays; the other rows are 0, and ids of instances start at 1. Poses are in the world.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from gen_data.core import demonstrations, se3
from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.lens import COEFFICIENTS
from gen_data.core.reported import reported
from gen_data.core.sample import Predicate, Sample
from gen_data.exporters.image_files import read_pixels
from gen_data.exporters.sensor_selection import require_channels
from gen_data.exporters.sequences import Frame

Part = Literal["depth", "instances", "poses", "contacts", "relations", "calibration"]
IMAGES = {"depth": Channel.Z_DEPTH, "instances": Channel.INSTANCE}
"""Parts that are images of the shards, uint16."""
PREDICATES: tuple[str, ...] = get_args(Predicate)
POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
OBJECTS = "annotation.objects"
"""Categories of the objects, a text; separated by commas, in the order of ``object_id``."""


@dataclass(frozen=True, slots=True)
class Array:
    """A feature of every step.

    Attributes:
        shape: In one step; -1 = as many rows as the step with most rows has, at least one.
        names: Names of the columns; empty = they have none.
    """

    dtype: Literal["float32", "int64", "uint16"]
    shape: tuple[int, ...]
    names: tuple[str, ...] = ()


TABLES: Mapping[str, Mapping[str, Array]] = {
    "poses": {
        "annotation.object_id": Array("int64", (-1,)),
        "annotation.object_pose": Array("float32", (-1, 7), POSE),
    },
    "contacts": {
        "annotation.contact_id": Array("int64", (-1, 2), ("one", "other")),
        "annotation.contact": Array("float32", (-1, 4), ("force_n", "x_m", "y_m", "z_m")),
    },
    "relations": {
        "annotation.relation": Array("int64", (-1, 3), ("subject", "predicate", "object"))
    },
}
"""Arrays with a row per object, contact or relation; predicates count from 0 in ``PREDICATES``."""
_CAMERA = {"K": (3, 3), "T_world_camera": (4, 4)}
_LENSES = {len(names): names for names in COEFFICIENTS.values()}
"""Names of the coefficients of a lens by their number, which differs from model to model."""


def check(info: DatasetInfo, parts: Sequence[Part], cameras: Sequence[str], exporter: str) -> None:
    """Reject parts that the cameras do not see, or whose lenses no matrix describes.

    Raises:
        ConfigError: a camera lacks a channel, or the calibration of a panorama is asked for.
    """
    for camera in cameras if "calibration" in parts else ():
        if info.sensor(camera).lens == "equirectangular":
            raise ConfigError(
                f"exporter '{exporter}': camera '{camera}' has a lens of the model "
                "'equirectangular', which K does not describe; leave 'calibration' out of the "
                "exporter's geometry, or list the others in its cameras"
            )
    for part, channel in IMAGES.items():
        remedy = f", or leave '{part}' out of the exporter's geometry"
        for camera in cameras if part in parts else ():
            require_channels(info, camera, [channel], exporter, remedy)


def step_values(
    sample: Sample,
    step: demonstrations.DemonstrationStep | None,
    parts: Sequence[Part],
    cameras: Iterable[str],
) -> dict[str, Any]:
    """Plain values of a step by feature, without padding and without images."""
    scene = sample.scene
    values: dict[str, Any] = {}
    if "poses" in parts:
        objects = [i for i in scene.instances if i.annotated]
        values[OBJECTS] = ", ".join(i.category for i in objects)
        values["annotation.object_id"] = [i.instance_id for i in objects]
        values["annotation.object_pose"] = [_pose(i.T_world_instance) for i in objects]
    if "contacts" in parts:
        ids = {body.name: body.instance_id for body in scene.bodies}
        pairs = [pair.split(" + ") for pair in step.contacts] if step else []
        forces = zip(step.contact_forces_n, step.contact_points_m, strict=True) if step else ()
        values["annotation.contact_id"] = [[ids.get(name, 0) for name in pair] for pair in pairs]
        values["annotation.contact"] = [[force_n, *point_m] for force_n, point_m in forces]
    if "relations" in parts:
        related = sample.frame.relations if sample.frame else None
        values["annotation.relation"] = [
            [r.subject, PREDICATES.index(r.predicate), r.object] for r in related or ()
        ]
    for camera in cameras if "calibration" in parts else ():
        seen = sample.truth[camera].camera
        values[f"annotation.K.{camera}"] = seen.intrinsics.matrix().tolist()
        pose = reported(seen).T_world_camera
        values[f"annotation.T_world_camera.{camera}"] = pose.matrix().tolist()
        if seen.intrinsics.lens.coefficients:
            values[f"annotation.distortion.{camera}"] = list(seen.intrinsics.lens.coefficients)
    return values


def array_features(
    parts: Sequence[Part], images: Mapping[str, Mapping[str, Any]], most: Mapping[str, int]
) -> dict[str, Array]:
    """Arrays of a data set by feature.

    Args:
        parts: Parts to write.
        images: ``image_sums`` by camera, which have the sizes.
        most: Largest length of the values of ``step_values``, by feature, at least 1.
    """
    found: dict[str, Array] = {}
    for part in parts:
        for name, array in TABLES.get(part, {}).items():
            found[name] = Array(array.dtype, (most[name], *array.shape[1:]), array.names)
        for camera, sums in images.items():
            if part in IMAGES:
                size = (sums["size_px"][1], sums["size_px"][0])
                found[f"annotation.{IMAGES[part].value}.{camera}"] = Array("uint16", size)
            if part == "calibration":
                for name, shape in _CAMERA.items():
                    found[f"annotation.{name}.{camera}"] = Array("float32", shape)
                if (bent := f"annotation.distortion.{camera}") in most:
                    found[bent] = Array("float32", (most[bent],), _LENSES[most[bent]])
    return found


def step_array(
    info: DatasetInfo, name: str, array: Array, frame: Frame
) -> NDArray[np.float32] | NDArray[np.int64] | NDArray[np.uint16]:
    """Value of an array of one frame, with zeros where there is nothing."""
    if array.dtype == "uint16":
        return read_pixels(image_path(info, name, frame)).astype(np.uint16)
    value = np.zeros(array.shape, array.dtype)
    given = frame.row["geometry"][name]
    if given:
        value[: len(given)] = given
    return value


def image_path(info: DatasetInfo, name: str, frame: Frame) -> Path:
    """File of an array that is an image."""
    _, channel, camera = name.split(".", 2)
    return info.media_path(frame.shard_dir, camera, Channel(channel), frame.index)


def _pose(pose: se3.SE3) -> list[float]:
    return [*pose.translation_m, *pose.quaternion_wxyz]
