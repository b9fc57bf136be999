"""CVAT for images 1.1: one folder per split, to be opened as a task of the annotation tool CVAT.

::

    <split>/annotations.xml
    <split>/images/000000012_color.png

Every object is a mask, or a box, or one polygon per part; parts of an object have its instance id
as ``group_id``. Masks are run lengths of their crop, row by row, zeros first. Polygons run along
the edges of pixels; one line leads to each hole and back. ``occluded`` is 1 if more than 5 % of the
silhouette in the image are hidden. Images are numbered from 0 in the order of samples.

Ignored objects are left out. Attributes of objects are not written, because a task declares the
possible values of each in advance.

Reference: https://docs.cvat.ai, "CVAT for images 1.1".
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import MaskPx, ObjectTruth, Sample
from gen_data.exporters import coco, image_files, image_rows, label_colors, rle
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.fragments import split_rows
from gen_data.exporters.mask_polygons import drawable_polygons

OCCLUDED = 0.05
"""Hidden share of the silhouette in the image above which ``occluded`` is 1."""


class Cvat(image_rows.ImageRowsExporter):
    """CVAT for images: objects of all cameras with the rgb channel, as shapes to be edited."""

    type: Literal["cvat"] = "cvat"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5",
        box="left, top, right, bottom along the edges of pixels",
        lens=ANY_LENS,
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"instance_masks", "visibility"})

    shapes: Literal["mask", "polygon", "box"] = "mask"
    """Shape of every object."""

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Number the images of each split, join their shapes, and link the images."""
        for split, rows in split_rows(shard_dirs, self.type):
            path = dataset_dir / split / "annotations.xml"
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("w", encoding="utf-8", newline="\n") as file:
                file.write(_head(info, split))
                for number, (shard_dir, row) in enumerate(rows):
                    name = row["file_name"]
                    file.write(
                        f'  <image id="{number}" name={quoteattr(name)} '
                        f'width="{row["width"]}" height="{row["height"]}">\n'
                        f"{row['shapes']}  </image>\n"
                    )
                    image_files.link_photograph(info, shard_dir, row, path.parent / "images" / name)
                file.write("</annotations>\n")

    def image_row(self, info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
        """The elements of its shapes."""
        camera = sample.truth[sensor].camera.intrinsics
        suffix = info.encoding(sensor, Channel.RGB).suffix
        elements = [
            line
            for thing in sample.truth[sensor].objects
            if thing.box is not None and not thing.ignored
            for line in shape_elements(thing, info, self.shapes)
        ]
        return {
            "file_name": coco.image_name(sample.index, sensor, suffix),
            "width": camera.width_px,
            "height": camera.height_px,
            "shapes": "".join(f"    {line}\n" for line in elements),
        }


def shape_elements(
    thing: ObjectTruth, info: DatasetInfo, shapes: Literal["mask", "polygon", "box"]
) -> list[str]:
    """XML elements of a visible object; polygons may be several."""
    assert thing.box is not None, "invisible objects are not listed"
    assert thing.mask is not None, "the annotation instance_masks is in `needs`"
    assert thing.occlusion is not None, "the annotation visibility is in `needs`"
    instance, box = thing.instance, thing.box
    common = (
        f'label={quoteattr(info.categories[instance.category_id - 1])} source="file" '
        f'occluded="{int(thing.occlusion > OCCLUDED)}" group_id="{instance.instance_id}" '
        'z_order="0"'
    )
    if shapes == "box":
        corners = f'xtl="{box.x_min}" ytl="{box.y_min}" xbr="{box.x_max}" ybr="{box.y_max}"'
        return [f"<box {common} {corners}/>"]
    if shapes == "mask":
        runs = ", ".join(map(str, row_runs(thing.mask)))
        place = f'left="{box.x_min}" top="{box.y_min}"'
        size = f'width="{box.width_px}" height="{box.height_px}"'
        return [f'<mask {common} rle="{runs}" {place} {size}/>']
    outlines = (";".join(f"{x},{y}" for x, y in p.tolist()) for p in drawable_polygons(thing.mask))
    return [f'<polygon {common} points="{points}"/>' for points in outlines]


def row_runs(mask: MaskPx) -> list[int]:
    """Lengths of the runs of a mask's crop, row by row, zeros first."""
    height, width = mask.pixels.shape
    return rle.run_lengths(MaskPx(0, 0, mask.pixels.T), width, height)


def _head(info: DatasetInfo, split: str) -> str:
    """Beginning of a file: the task and its labels."""
    labels = "".join(
        f"      <label><name>{escape(name)}</name><color>#{bytes(color).hex()}</color>"
        "<type>any</type><attributes></attributes></label>\n"
        for name, color in zip(info.categories, _colors(len(info.categories)), strict=True)
    )
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n<annotations>\n  <version>1.1</version>\n'
        f"  <meta>\n    <task>\n      <name>{escape(info.name)} {escape(split)}</name>\n"
        "      <mode>annotation</mode>\n      <overlap>0</overlap>\n      <labels>\n"
        f"{labels}      </labels>\n    </task>\n  </meta>\n"
    )


def _colors(count: int) -> list[list[int]]:
    colors: list[list[int]] = label_colors.voc_palette()[1 + np.arange(count) % 255].tolist()
    return colors
