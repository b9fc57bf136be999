"""Masks of COCO annotations, drawn by pycocotools."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pycocotools import mask as coco_mask


def drawn_mask(row: Mapping[str, Any], coco: Mapping[str, Any]) -> NDArray[np.bool_]:
    """Mask of an annotation in the file it is from: polygons, or run lengths."""
    shape = row["segmentation"]
    if isinstance(shape, list):
        (image,) = (i for i in coco["images"] if i["id"] == row["image_id"])
        shape = coco_mask.merge(coco_mask.frPyObjects(shape, image["height"], image["width"]))
    mask: NDArray[np.bool_] = coco_mask.decode(shape).astype(bool)
    return mask
