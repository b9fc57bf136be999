"""Cityscapes: label, instance and colour images of one camera, polygons, and its calibration.

::

    leftImg8bit/<split>/<city>/<city>_000012_000000_leftImg8bit.png
    gtFine/<split>/<city>/<city>_000012_000000_gtFine_labelIds.png      8-bit class
    gtFine/<split>/<city>/<city>_000012_000000_gtFine_instanceIds.png   16-bit
    gtFine/<split>/<city>/<city>_000012_000000_gtFine_color.png         RGB
    gtFine/<split>/<city>/<city>_000012_000000_gtFine_polygons.json
    camera/<split>/<city>/<city>_000012_000000_camera.json
    rightImg8bit/...  disparity/...                                     with a second camera

The city is the name of the data set, its letters and digits; numbers count the sequence and the
instant in it.

* **Classes** are the 34 of the benchmark with ids from 0: by category for objects and scenery, by
  surface for ground and sky, which need images of depth (``background_surfaces``). The vehicle that
  carries the camera is ``ego vehicle``. A rider and the two-wheeler are one object of the class
  ``rider``.
* **Instances** have ``1000 * class + k``, k from 0 within the class and image; pixels of other
  classes have the class alone. So do, as groups, objects of a counted class that are not annotated
  or that are below the thresholds; evaluation leaves groups out.
* **Ignored** objects are ``unlabeled``.
* **Polygons** run through the centres of pixels, larger ones first: drawn by cityscapesscripts
  they give ``labelIds`` again. An object in several parts has several polygons, which
  cityscapesscripts' ``json2instanceImg`` and detectron2's loader with ``from_json=True`` (its
  default) take for objects: ``instanceIds`` has one number per object.
* **Calibration**: the focal length in pixels, the principal point with pixel centres at whole
  numbers, and the pose on the rig (X forward, Y left, Z up; yaw, pitch, roll in radians, applied in
  this order; positive pitch looks down); zero without a rig.
* **Disparity**: 16-bit, ``(value - 1) / 256`` pixels, 0 = none.

Reference: Cordts et al., "The Cityscapes Dataset for Semantic Urban Scene Understanding", CVPR
2016; cityscapesscripts.
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core import boxes, scene_time, stereo
from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError, StorageError
from gen_data.core.interfaces import AssetLibrary, DatasetInfo, media_path
from gen_data.core.sample import Sample
from gen_data.core.scene import Camera, Scene
from gen_data.exporters import base, fragments, image_files, label_png, label_regions, png
from gen_data.exporters.background_surfaces import SURFACES, UInt16, read_surfaces
from gen_data.exporters.cityscapes_classes import city_classes
from gen_data.exporters.conventions import PINHOLE, Conventions
from gen_data.exporters.sensor_selection import (
    check_calibrations,
    check_partner,
    pinhole_camera,
    require_channels,
    rgb_cameras,
)
from gen_data.exporters.sequences import (
    camera_mount,
    check_frame_names,
    frame_facts,
    write_bytes,
    write_json,
    write_text,
)

PER_CLASS = 1000
"""Numbers of instances per class and image; further ones become groups."""
UNLABELED, EGO_VEHICLE = "unlabeled", "ego vehicle"
IMAGES = ("labelIds", "instanceIds", "color")


class Cityscapes(base.AssetExporter):
    """Cityscapes' fine annotations of one camera."""

    type: Literal["cityscapes"] = "cityscapes"
    conventions: ClassVar[Conventions] = Conventions(pixel_centre="i", lens=PINHOLE)
    own_classes: ClassVar[bool] = True
    camera: str = ""
    """Sensor of the images; empty = the first one, by name, with the rgb channel."""
    right: str = ""
    """Second camera of a rectified pair; empty = none. The first one then needs disparity."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: the camera is missing, is not a pinhole or lacks a channel, or there are
                too many samples or no classes.
        """
        base.check_classes(self.type, info, city_classes().categories)
        camera = pinhole_camera(info, self.camera, self.type)
        needed = [Channel.INSTANCE, *([Channel.DISPARITY] if self.right else [])]
        require_channels(info, camera, needed, self.type)
        others = [name for name in rgb_cameras(info) if name != camera]
        if self.right and self.right not in others:
            raise ConfigError(
                f"exporter '{self.type}': right: '{self.right}' is not another camera that writes "
                f"the rgb channel; expected one of: {', '.join(others) or 'none'}"
            )
        if self.right:
            check_partner(info, camera, self.right, self.type)
        check_calibrations(info, [camera, self.right] if self.right else [camera], self.type)
        check_frame_names(info, self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write label images, polygons and calibration of each sample, and a line for it.

        Raises:
            ConfigError: see ``check``, or the cameras are not a rectified pair.
            StorageError: an image is missing.
        """
        self.check(info)
        camera = pinhole_camera(info, self.camera, self.type)
        rows = []
        for sample in samples:
            if camera not in sample.truth or (self.right and self.right not in sample.truth):
                continue
            instances = find_instances(info, sample, camera, shard_dir, self.library)
            stem = shard_dir / self.type / f"{sample.index:09d}"
            for name, values in _values_of_codes().items():
                path = _beside(stem, f"{name}.png")
                write_bytes(path, label_png.encode_label_png(instances, values))
            polygons = {
                "imgHeight": instances.shape[0],
                "imgWidth": instances.shape[1],
                "objects": list(polygons_of(instances)),
            }
            # Thousands of plain numbers: converting them costs more than all images.
            text = json.dumps(polygons, sort_keys=True, separators=(",", ":"))
            write_text(_beside(stem, "polygons.json"), text + "\n")
            facts = camera_facts(sample.scene_of(camera), camera, self.right)
            write_json(_beside(stem, "camera.json"), facts)
            if self.right:
                source = media_path(shard_dir, camera, Channel.DISPARITY, sample.index)
                write_bytes(_beside(stem, "disparity.png"), disparity_png(source))
            rows.append(frame_facts(info, sample))
        fragments.write_fragment(shard_dir / self.type, "frames", rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the files of all shards under Cityscapes' names."""
        camera = pinhole_camera(info, self.camera, self.type)
        city = "".join(c for c in info.name if c.isalnum() and c.isascii()).lower() or "city"
        for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, "frames"):
            index = row["index"]
            name = f"{city}_{row['sequence']:06d}_{row['step']:06d}"
            stem = shard_dir / self.type / f"{index:09d}"
            links = [(_beside(stem, f"{k}.png"), f"gtFine_{k}.png") for k in IMAGES]
            links.append((_beside(stem, "polygons.json"), "gtFine_polygons.json"))
            links.append((_beside(stem, "camera.json"), "camera.json"))
            rgb = {"leftImg8bit": camera, **({"rightImg8bit": self.right} if self.right else {})}
            for kind, sensor in rgb.items():
                links.append((media_path(shard_dir, sensor, Channel.RGB, index), f"{kind}.png"))
            if self.right:
                links.append((_beside(stem, "disparity.png"), "disparity.png"))
            for source, suffix in links:
                kind = suffix.split("_")[0].split(".")[0]
                folder = dataset_dir / kind / row["split"] / city
                image_files.link_or_copy(source, folder / f"{name}_{suffix}")


@cache
def _values_of_codes() -> dict[str, NDArray[Any]]:
    """Values of each image of labels by code of ``instanceIds``, [34000] or [34000, 3]."""
    classes = city_classes()
    codes = np.arange(PER_CLASS * len(classes.by_name))
    numbers = np.where(codes < PER_CLASS, codes, codes // PER_CLASS)
    numbers[len(classes.by_name) : PER_CLASS] = 0
    values = (numbers.astype(np.uint8), codes.astype(np.uint16), classes.colors[numbers])
    return dict(zip(IMAGES, values, strict=True))


def find_instances(
    info: DatasetInfo, sample: Sample, camera: str, shard_dir: Path, assets: AssetLibrary
) -> UInt16:
    """Find the code of every pixel: ``instanceIds``, [h, w].

    Raises:
        StorageError: an image is missing.
    """
    ids, surfaces = read_surfaces(info, sample, camera, shard_dir, assets)
    classes, scene = city_classes(), sample.scene_of(camera)
    size = 1 + max(int(ids.max()), max((i.instance_id for i in scene.instances), default=0))
    of_surface = [classes.of_surface(name).number for name in SURFACES]
    # Codes of instances, then of surfaces.
    code_of = np.array([0] * size + of_surface, np.uint16)
    truth = {thing.instance.instance_id: thing for thing in sample.truth[camera].objects}
    ego, counts = _carrier(scene, camera), dict.fromkeys(classes.by_name, 0)
    for instance in sorted(scene.instances, key=lambda i: i.instance_id):
        number = instance.instance_id
        thing = truth.get(number)
        kind = classes.of_instance(instance)
        if number == ego:
            kind = classes.by_name[EGO_VEHICLE]
        elif thing is not None and thing.ignored:
            kind = classes.by_name[UNLABELED]
        code_of[number] = kind.number
        shown = thing is not None and thing.box is not None
        if kind.counted and shown and counts[kind.name] < PER_CLASS:
            code_of[number] = PER_CLASS * kind.number + counts[kind.name]
            counts[kind.name] += 1
    return code_of[np.where(ids > 0, ids, surfaces + np.uint16(size))]


def polygons_of(instances: UInt16) -> Iterator[dict[str, Any]]:
    """Yield the objects of a polygons file: outlines through centres of pixels, larger ones first.

    Regions in holes of others are smaller than these and are drawn later.
    """
    classes = list(city_classes().by_name.values())
    outlines: list[tuple[float, str, list[list[int]]]] = []
    # Pixels of one part have common edges: its enclosed areas, also of pixels that only touch at
    # corners, then consist of other parts.
    parts, found = label_regions.find_parts(instances)
    for part, (code, box) in enumerate(found):
        kind = classes[code // PER_CLASS if code >= PER_CLASS else code]
        name = kind.name + ("group" if kind.counted and code < PER_CLASS else "")
        area, points = _outline(parts, part, box)
        outlines.append((area, name, points))
    for _, name, points in sorted(outlines, key=lambda item: -item[0]):
        yield {"label": name, "polygon": points}


def _outline(
    parts: NDArray[np.int32], part: int, box: boxes.BoxPx
) -> tuple[float, list[list[int]]]:
    """Area [px] and outline of a part, at least three points."""
    first, last = [box.x_min, box.y_min], [box.x_max - 1, box.y_max - 1]
    if box.width_px == 1 or box.height_px == 1:
        # Most parts are single pixels or lines. Drawing needs three points.
        return 0.0, [first, last, last]
    piece = (parts[box.y_min : box.y_max, box.x_min : box.x_max] == part).view(np.uint8)
    (contour,), _ = cv2.findContours(
        piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE, offset=first
    )
    return cv2.contourArea(contour), contour[:, 0].tolist()


def camera_facts(scene: Scene, camera: str, right: str) -> dict[str, Any]:
    """Content of a camera file. Raises ConfigError if the cameras are not a rectified pair."""
    view = scene.camera(camera)
    pose = camera_mount(scene, camera).T_rig_sensor @ scene_time.RIG_AXES
    r = pose.rotation()
    x, y, z = pose.translation_m if view.rig else (0.0, 0.0, 0.0)
    extrinsic = {
        "baseline": _baseline(view, scene.camera(right)) if right else 0.0,
        "pitch": math.asin(max(-1.0, min(1.0, -float(r[2, 0])))),
        "roll": math.atan2(float(r[2, 1]), float(r[2, 2])),
        "yaw": math.atan2(float(r[1, 0]), float(r[0, 0])),
        "x": x,
        "y": y,
        "z": z,
    }
    k = view.intrinsics
    intrinsic = {"fx": k.fx_px, "fy": k.fy_px, "u0": k.cx_px - 0.5, "v0": k.cy_px - 0.5}
    return {"extrinsic": _rounded(extrinsic), "intrinsic": _rounded(intrinsic)}


def disparity_png(source: Path) -> bytes:
    """Convert an image of disparities, 256 per pixel and 0 = none, to Cityscapes' offset of 1.

    Raises:
        StorageError: the file is missing or no PNG.
    """
    image = cv2.imread(str(source), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise StorageError(f"{source}: missing or no PNG")
    units = np.where(image > 0, np.minimum(image.astype(np.uint32) + 1, 65_535), 0)
    return png.encode_png(units.astype(np.uint16), png.RowFilter.SUB, 1)


def _carrier(scene: Scene, camera: str) -> int:
    """Instance id of the vehicle that carries a camera; 0 without a rig."""
    rig = scene.camera(camera).rig
    return scene.body(scene.rig(rig).body).instance_id if rig else 0


def _baseline(left: Camera, right: Camera) -> float:
    try:
        return stereo.baseline_m(left, right)
    except ValueError as error:
        raise ConfigError(
            f"exporter 'cityscapes': cameras '{left.name}' and '{right.name}' are not a rectified "
            f"pair: {error}"
        ) from error


def _rounded(values: Mapping[str, float]) -> dict[str, float]:
    return {name: round(value, 9) + 0.0 for name, value in values.items()}


def _beside(stem: Path, name: str) -> Path:
    return stem.parent / f"{stem.name}_{name}"
