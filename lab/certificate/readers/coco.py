"""COCO, read by pycocotools."""

import contextlib
import io
from pathlib import Path

import numpy as np
from PIL import Image

from gen_data.lab.certificate import labelled_images
from gen_data.runner.stored import StoredSamples


def load_coco(root: Path, stored: StoredSamples) -> labelled_images.Loaded:
    """Read the instances and pictures of every split."""
    from pycocotools.coco import COCO

    del stored
    images = []
    paths = sorted((root / "annotations").glob("instances_*.json"))
    for path in paths:
        with contextlib.redirect_stdout(io.StringIO()):
            coco = COCO(str(path))
        names = {row["id"]: row["name"] for row in coco.loadCats(coco.getCatIds())}
        for row in coco.loadImgs(coco.getImgIds()):
            objects = []
            for item in coco.loadAnns(coco.getAnnIds([row["id"]])):
                x, y, width, height = item["bbox"]
                mask = coco.annToRLE(item) if item["segmentation"] else None
                box = (x, y, x + width, y + height)
                objects.append(
                    labelled_images.LabelledObject(names[item["category_id"]], box, mask)
                )
            split, size_px = path.stem.removeprefix("instances_"), (row["width"], row["height"])
            images.append(
                labelled_images.LabelledImage(
                    row["sample"],
                    row["sensor"],
                    split,
                    size_px,
                    tuple(objects),
                    _digest_picture(root / split / row["file_name"]),
                )
            )
    return labelled_images.Loaded(images, {"files": len(paths)})


def _digest_picture(path: Path) -> str:
    with Image.open(path) as image:
        return labelled_images.digest_pixels(np.asarray(image.convert("RGB")))
