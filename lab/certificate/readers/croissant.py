"""Croissant tables, read by mlcroissant."""

import logging
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.lab.certificate import labelled_images
from gen_data.runner.stored import StoredSamples


def load_croissant(root: Path, stored: StoredSamples) -> labelled_images.Loaded:
    """Read the records of images, whose pictures are decoded, and of objects."""
    import mlcroissant

    del stored
    with _without_advice():
        dataset = mlcroissant.Dataset(jsonld=str(root / "croissant.json"))
        objects: dict[int, list[labelled_images.LabelledObject]] = defaultdict(list)
        for row in _rows(dataset, "objects"):
            x, y = row["x"], row["y"]
            box = (x, y, x + row["width"], y + row["height"])
            objects[row["image_id"]].append(
                labelled_images.LabelledObject(row["category"].decode(), box)
            )
        images = []
        for row in _rows(dataset, "images"):
            size_px = (row["width"], row["height"])
            image = labelled_images.LabelledImage(
                row["sample"],
                row["sensor"].decode(),
                row["split"].decode(),
                size_px,
                tuple(objects.pop(row["image_id"], ())),
                labelled_images.digest_pixels(np.asarray(row["content"].convert("RGB"))),
            )
            if row["content"].size != size_px:
                raise ValueError(f"{image}: its picture has {row['content'].size} px")
            images.append(image)
    faults = [f"objects of image {number}, which is not there" for number in objects]
    return labelled_images.Loaded(images, faults=faults)


def _rows(dataset: Any, name: str) -> Iterator[Mapping[str, Any]]:
    for record in dataset.records(name):
        yield {key.removeprefix(f"{name}/"): value for key, value in record.items()}


@contextmanager
def _without_advice() -> Iterator[None]:
    """Keep the reader from logging which recommended properties are absent."""
    before = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        yield
    finally:
        logging.disable(before)
