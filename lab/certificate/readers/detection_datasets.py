"""YOLO and Pascal VOC, read by supervision."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from gen_data.lab.certificate import labelled_images
from gen_data.runner.stored import StoredSamples


def load_yolo(root: Path, stored: StoredSamples) -> labelled_images.Loaded:
    """Read the boxes of the task ``detect``, split by split."""
    from supervision import DetectionDataset

    del stored
    task = root / "detect"
    if not task.is_dir():
        raise ImportError("boxes are read from the task 'detect', which was not exported")
    images: list[labelled_images.LabelledImage] = []
    for folder in sorted((task / "images").iterdir()):
        dataset = DetectionDataset.from_yolo(
            str(folder), str(task / "labels" / folder.name), str(task / "data.yaml")
        )
        images += _images(dataset, lambda _, split=folder.name: split)  # type: ignore[misc]
    return labelled_images.Loaded(images)


def load_voc(root: Path, stored: StoredSamples) -> labelled_images.Loaded:
    """Read all boxes; splits come from ``ImageSets/Main``."""
    from supervision import DetectionDataset

    del stored
    (folder,) = (root / "VOCdevkit").iterdir()
    splits = {
        stem: path.stem
        for path in sorted((folder / "ImageSets/Main").glob("*.txt"))
        if path.stem in ("train", "val", "test")
        for stem in path.read_text().split()
    }
    dataset = DetectionDataset.from_pascal_voc(
        str(folder / "JPEGImages"), str(folder / "Annotations")
    )
    return labelled_images.Loaded(list(_images(dataset, lambda stem: splits.get(stem, "none"))))


def _images(
    dataset: Any, split_of: Callable[[str], str]
) -> Iterator[labelled_images.LabelledImage]:
    """Images of a ``DetectionDataset``; their names are ``<sample>_<camera>``."""
    for path, image, found in dataset:
        number, _, camera = Path(path).stem.partition("_")
        boxes, labels = found.xyxy.tolist(), found.class_id.tolist()
        things = (
            labelled_images.LabelledObject(dataset.classes[label], tuple(box))
            for box, label in zip(boxes, labels, strict=True)
        )
        height, width = image.shape[:2]
        # OpenCV has blue first. Files of JPEG may have been compressed again.
        pixels = "" if path.endswith(".jpg") else labelled_images.digest_pixels(image[..., ::-1])
        yield labelled_images.LabelledImage(
            int(number), camera, split_of(Path(path).stem), (width, height), tuple(things), pixels
        )
