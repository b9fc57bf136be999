"""WebDataset, read by the package of that name."""

import gc
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.lab.certificate import labelled_images
from gen_data.runner.stored import StoredSamples


def load_webdataset(root: Path, stored: StoredSamples) -> labelled_images.Loaded:
    """Read all tar files of every split; images are decoded."""
    del stored
    images: list[labelled_images.LabelledImage] = []
    tars = 0
    for folder in sorted(path for path in root.iterdir() if path.is_dir()):
        paths = sorted(folder.glob("*.tar"))
        tars += len(paths)
        for sample in _samples(paths):
            labels = sample["json"]
            images += (
                _image(labels["index"], camera, folder.name, row, photograph)
                for camera, row in labels["cameras"].items()
                if (photograph := _find_photograph(sample, camera)) is not None
            )
    return labelled_images.Loaded(images, {"files": tars})


def _samples(paths: list[Path]) -> Iterator[Mapping[str, Any]]:
    import webdataset

    loaded = webdataset.WebDataset([str(path) for path in paths], shardshuffle=False)
    yield from loaded.decode("pil")
    # The reader leaves closing of its files to the garbage collector.
    del loaded
    gc.collect()


def _find_photograph(sample: Mapping[str, Any], camera: str) -> Any:
    """The photograph of a camera, as Pillow has it; None if there is none."""
    names = (key for key in sample if key.startswith(f"{camera}.rgb.".lower()))
    return next((sample[name] for name in names), None)


def _image(
    index: int, camera: str, split: str, row: Mapping[str, Any], photograph: Any
) -> labelled_images.LabelledImage:
    objects = []
    for item in row["annotations"]:
        x, y, width, height = item["bbox"]
        box = (x, y, x + width, y + height)
        objects.append(
            labelled_images.LabelledObject(item["category"], box, item["segmentation"] or None)
        )
    pixels = labelled_images.digest_pixels(np.asarray(photograph.convert("RGB")))
    return labelled_images.LabelledImage(
        index, camera, split, (row["width"], row["height"]), tuple(objects), pixels
    )
