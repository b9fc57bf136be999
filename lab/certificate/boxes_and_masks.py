"""Claim: 2D boxes are the tight boxes of masks, and masks have the stated number of pixels.

pycocotools decodes the runs and measures them: nothing here uses the code that made the labels.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Contradictions, Finding, not_checked


def check_boxes_and_masks(examined: Examined) -> Iterator[Finding]:
    """Compare boxes, masks and counts of all objects."""
    compared = {"objects": 0, "masks": 0}
    contradictions = Contradictions()
    for image in examined.images():
        for item in image.objects:
            compared["objects"] += 1
            box, mask = item.get("box"), item.get("mask")
            if mask is None:
                continue
            compared["masks"] += 1
            expected, area = measure_mask(mask)
            stated = box and (box["x_min"], box["y_min"], box["x_max"], box["y_max"])
            name = f"sample {image.index}, {image.camera}, {item['instance']['name']}"
            if (stated or None) != expected:
                contradictions.add(f"{name}: box {stated}, tight box of the mask {expected}")
            elif area != item["visible_px"]:
                contradictions.add(f"{name}: mask of {area} px, visible_px {item['visible_px']}")
    if not compared["masks"]:
        yield not_checked("", "no object has a mask: add the annotation instance_masks")
        return
    yield contradictions.judge("", compared)


def measure_mask(mask: Mapping[str, Any]) -> tuple[tuple[int, int, int, int] | None, int]:
    """Half-open box ``x_min, y_min, x_max, y_max`` [px] and area of a plain ``MaskPx``.

    The box is None for an empty mask.
    """
    from pycocotools import mask as coco_mask

    height, width = mask["pixels"]["size"]
    # COCO's runs go down the columns, gen-data's along the rows: runs of the transposed mask.
    runs = {"size": [width, height], "counts": mask["pixels"]["runs"]}
    encoded = coco_mask.frPyObjects(runs, width, height)
    area = int(coco_mask.area(encoded))
    y, x, rows, columns = (int(v) for v in coco_mask.toBbox(encoded))
    x, y = x + mask["x_px"], y + mask["y_px"]
    return ((x, y, x + columns, y + rows) if area else None), area
