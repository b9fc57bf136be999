"""Hugging Face data sets, read by the package datasets."""

from pathlib import Path

import numpy as np

from gen_data.core.temporary_folders import temporary_folder
from gen_data.lab.certificate import labelled_images
from gen_data.runner.stored import StoredSamples


def load_huggingface(root: Path, stored: StoredSamples) -> labelled_images.Loaded:
    """Read every split by the card of the data set; images are decoded."""
    import datasets

    del stored
    images = []
    with temporary_folder("datasets") as cache:
        datasets.disable_progress_bars()
        loaded = datasets.load_dataset(str(root), cache_dir=str(cache))
        for split in sorted(loaded):
            names = loaded[split].features["objects"]["category"].feature.names
            for row in loaded[split]:
                size_px = (row["width"], row["height"])
                objects, things = [], row["objects"]
                for k, (x, y, width, height) in enumerate(things["bbox"]):
                    box = (x, y, x + width, y + height)
                    runs = things["rle"] and things["rle"][k]
                    mask = {"size": [size_px[1], size_px[0]], "counts": runs} if runs else None
                    objects.append(
                        labelled_images.LabelledObject(names[things["category"][k]], box, mask)
                    )
                pixels = labelled_images.digest_pixels(np.asarray(row["image"].convert("RGB")))
                image = labelled_images.LabelledImage(
                    row["sample"], row["sensor"], split, size_px, tuple(objects), pixels
                )
                images.append(image)
                if row["image"].size != size_px:
                    raise ValueError(f"{image}: its picture has {row['image'].size} px")
    return labelled_images.Loaded(images)
