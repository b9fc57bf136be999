"""TFRecord, read by the package tfrecord and protobuf."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from gen_data.lab.certificate import labelled_images
from gen_data.runner.stored import StoredSamples

SIDES = ("xmin", "ymin", "xmax", "ymax")


def load_tfrecord(root: Path, stored: StoredSamples) -> labelled_images.Loaded:
    """Read all records; boxes are fractions in 32 bits."""
    from tfrecord.reader import tfrecord_iterator

    del stored
    paths = sorted(root.glob("*.tfrecord"))
    images = [
        _image(path.name.split("-")[0], _features(bytes(record)))
        for path in paths
        for record in tfrecord_iterator(str(path))
    ]
    return labelled_images.Loaded(images, {"files": len(paths)})


def _features(record: bytes) -> Mapping[str, Any]:
    from tfrecord import example_pb2

    example = example_pb2.Example()
    example.ParseFromString(record)
    features = example.features.feature
    return {k: getattr(f, f.WhichOneof("kind") or "bytes_list").value for k, f in features.items()}


def _image(split: str, values: Mapping[str, Any]) -> labelled_images.LabelledImage:
    (width,), (height,) = values["image/width"], values["image/height"]
    columns = [values[f"image/object/bbox/{side}"] for side in SIDES]
    names = [name.decode() for name in values["image/object/class/text"]]
    objects = tuple(
        labelled_images.LabelledObject(name, (x0 * width, y0 * height, x1 * width, y1 * height))
        for name, x0, y0, x1, y1 in zip(names, *columns, strict=True)
    )
    sensor = values["image/sensor"][0].decode()
    with Image.open(io.BytesIO(values["image/encoded"][0])) as image:
        pixels = labelled_images.digest_pixels(np.asarray(image.convert("RGB")))
    return labelled_images.LabelledImage(
        values["image/sample"][0], sensor, split, (width, height), objects, pixels
    )
