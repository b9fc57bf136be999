"""Label Studio: tasks with annotations, and the configuration of their labelling interface.

::

    label_config.xml             interface: classes with colours, names of keypoints
    <split>/tasks.json           a task per image; the file to import
    <split>/images/000000012_color.png

Every visible object is one region, a brush mask, a polygon or a box: converters make one object of
each region. Its keypoints belong to it (``parentID``). The id of a region is the instance id.
Coordinates are percent of the image's width and height; polygons run 0.02 px inside the edges of
pixels, and lines without area join an object's parts and lead to its holes. A brush mask is the run
lengths of its image, all four channels of a pixel alike; Label Studio's converter to COCO leaves
brush masks out. Ids of tasks, which the converters need, are the image ids of ``coco``.

Images are referred to as ``url_prefix`` with their path in the data set; the default is Label
Studio's address of local files. Ignored objects are left out.

Reference: https://labelstud.io/guide/tasks and https://labelstud.io/tags; for run lengths, the
format of the package rle-pack of thi.ng/umbrella.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal
from urllib.parse import quote
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import MaskPx, ObjectTruth, Sample
from gen_data.exporters import coco, image_files, image_rows, label_colors, sequences
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.fragments import split_rows
from gen_data.exporters.mask_polygons import drawable_polygons, join_polygons

LOCAL_FILES = "/data/local-files/?d="
"""Label Studio's address of a file in its folder of local files."""

KEYPOINT_SIZE_PERCENT = 0.5

CHANNELS = 4
"""Values per pixel of a brush mask: red, green, blue and opacity."""

_RUN_MAX = 1 << 16
_RUN_BITS = 27
"""Bits of a run: 1 for a run, 11 for the last of four sizes, 16 of the length, 8 of the value."""

CONTROLS = {"mask": "BrushLabels", "polygon": "PolygonLabels", "box": "RectangleLabels"}
"""Tags of the interface by shape."""

Shape = Literal["mask", "polygon", "box"]


class LabelStudio(image_rows.ImageRowsExporter):
    """Label Studio: objects of all cameras with the rgb channel, as regions to be edited."""

    type: Literal["label_studio"] = "label_studio"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5",
        box="left, top, width, height along the edges of pixels, in percent of the image",
        lens=ANY_LENS,
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"instance_masks"})

    shapes: Shape = "polygon"
    """Shape of every object."""
    kind: Literal["annotations", "predictions"] = "annotations"
    """Whether regions are finished annotations, or predictions that an annotator starts from."""
    url_prefix: str = LOCAL_FILES
    """Prefix of the path of an image."""

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the tasks of each split, link their images, and describe the interface."""
        keypoints: set[str] = set()
        for split, rows in split_rows(shard_dirs, self.type):
            path = dataset_dir / split / "tasks.json"
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("w", encoding="utf-8", newline="\n") as file:
                separator = "[\n"
                for shard_dir, row in rows:
                    file.write(separator + row["task"])
                    separator = ",\n"
                    keypoints.update(row["keypoints"])
                    target = path.parent / "images" / row["file_name"]
                    image_files.link_photograph(info, shard_dir, row, target)
                file.write("\n]\n")
        config = label_config(info.categories, self.shapes, sorted(keypoints))
        sequences.write_text(dataset_dir / "label_config.xml", config)

    def image_row(self, info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
        """Its regions, as a task."""
        camera = sample.truth[sensor].camera.intrinsics
        regions = [
            region
            for thing in sample.truth[sensor].objects
            if thing.box is not None and not thing.ignored
            for region in object_regions(thing, info, camera, self.shapes)
        ]
        name = coco.image_name(sample.index, sensor, info.encoding(sensor, Channel.RGB).suffix)
        path = f"{self.type}/{sample.split}/images/{name}"
        data = {
            "image": self.url_prefix + quote(path),
            "sample": sample.index,
            "sensor": sensor,
            "split": sample.split,
        }
        facts: dict[str, Any] = {"result": regions}
        if self.kind == "annotations":
            facts["ground_truth"] = True
        else:
            facts.update(model_version="gen-data", score=1.0)
        task = {"id": sample.image_id(sensor), "data": data, self.kind: [facts]}
        return {
            "file_name": name,
            "keypoints": sorted(_keypoint_names(regions)),
            # As text, which merging copies: regions have thousands of numbers.
            "task": json.dumps(task, separators=(",", ":")),
        }


def object_regions(
    thing: ObjectTruth, info: DatasetInfo, camera: Intrinsics, shapes: Shape
) -> Iterator[dict[str, Any]]:
    """Regions of a visible object: its shape, then its keypoints."""
    instance = thing.instance
    first = f"{instance.instance_id}"
    label = info.categories[instance.category_id - 1]
    value = _shape_value(thing, camera, shapes)
    yield _region(first, first, CONTROLS[shapes], label, value, camera)
    for point in thing.keypoints or ():
        if point.visibility:
            x_px, y_px = point.image_px
            place = {
                "x": _percent(x_px, camera.width_px),
                "y": _percent(y_px, camera.height_px),
                "width": KEYPOINT_SIZE_PERCENT,
            }
            name = f"{first}.{point.name}"
            yield _region(name, first, "KeyPointLabels", point.name, place, camera)


def _shape_value(thing: ObjectTruth, camera: Intrinsics, shapes: Shape) -> dict[str, Any]:
    width, height, box = camera.width_px, camera.height_px, thing.box
    assert box is not None, "invisible objects are not listed"
    assert thing.mask is not None, "the annotation instance_masks is in `needs`"
    if shapes == "box":
        return {
            "x": _percent(box.x_min, width),
            "y": _percent(box.y_min, height),
            "width": _percent(box.width_px, width),
            "height": _percent(box.height_px, height),
            "rotation": 0,
        }
    if shapes == "mask":
        return {"format": "rle", "rle": brush_rle(thing.mask, height, width)}
    outline = join_polygons(drawable_polygons(thing.mask))
    return {"points": np.round(100.0 * outline / (width, height), 9).tolist(), "closed": True}


def _region(
    name: str, first: str, control: str, label: str, value: Mapping[str, Any], camera: Intrinsics
) -> dict[str, Any]:
    kind = control.lower()
    return {
        "id": name,
        "type": kind,
        "from_name": kind,
        "to_name": "image",
        "original_width": camera.width_px,
        "original_height": camera.height_px,
        "image_rotation": 0,
        "value": {**value, kind: [label]},
        **({} if name == first else {"parentID": first}),
    }


def _percent(length_px: float, size_px: int) -> float:
    return round(100.0 * length_px / size_px, 9)


def brush_rle(mask: MaskPx, height_px: int, width_px: int) -> list[int]:
    """Encode a mask in an image as bytes of rle-pack: 255 inside, row by row."""
    height, width = mask.pixels.shape
    lines: NDArray[np.int8] = np.zeros((height, width_px), np.int8)
    lines[:, mask.x_px : mask.x_px + width] = mask.pixels
    changes = np.flatnonzero(np.diff(lines.ravel(), prepend=0, append=0)) + mask.y_px * width_px
    ends = np.append(changes, height_px * width_px) * CHANNELS
    lengths = np.diff(ends, prepend=0)
    values = 255 * (np.arange(len(lengths)) % 2)
    lengths, values = lengths[lengths > 0], values[lengths > 0]
    copies = -(-lengths // _RUN_MAX)
    runs = np.repeat(values, copies)
    parts = np.full(len(runs), _RUN_MAX)
    parts[np.cumsum(copies) - 1] = lengths - (copies - 1) * _RUN_MAX
    words = 0b111 << 24 | (parts - 1) << 8 | runs
    bits = words[:, None] >> np.arange(_RUN_BITS - 1, -1, -1) & 1
    stream = np.append(_rle_header(height_px * width_px), bits).astype(np.uint8)
    data: list[int] = np.packbits(stream).tolist()
    return data


def _rle_header(pixels: int) -> NDArray[np.int64]:
    """Bits of the number of values, of their size, and of the four sizes of run lengths."""
    fields = [(pixels * CHANNELS, 32), (8 - 1, 5), *((size - 1, 4) for size in (3, 4, 8, 16))]
    text = "".join(f"{value:0{bits}b}" for value, bits in fields)
    return np.array([int(bit) for bit in text], np.int64)


def _keypoint_names(regions: Iterable[Mapping[str, Any]]) -> set[str]:
    return {name for region in regions for name in region["value"].get("keypointlabels", ())}


def label_config(categories: Sequence[str], shapes: Shape, keypoints: Sequence[str]) -> str:
    """XML of the labelling interface."""
    controls = [(CONTROLS[shapes], categories)]
    if keypoints:
        controls.append(("KeyPointLabels", keypoints))
    lines = ["<View>", '  <Image name="image" value="$image" zoom="true"/>']
    for control, names in controls:
        lines.append(f'  <{control} name="{control.lower()}" toName="image">')
        colors = label_colors.voc_palette()[1 + np.arange(len(names)) % 255].tolist()
        lines += [
            f'    <Label value={quoteattr(name)} background="#{bytes(color).hex()}"/>'
            for name, color in zip(names, colors, strict=True)
        ]
        lines.append(f"  </{control}>")
    return "\n".join([*lines, "</View>", ""])
