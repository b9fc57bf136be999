"""Sensors and classes of a finished data set that have no label at all."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from gen_data.core.sample import ImageTruth
from gen_data.exporters.label_map import AppliedLabelMap, LabelMap, category_of
from gen_data.runner.layout import MANIFEST_NAME
from gen_data.runner.stored import LabelledImages, StoredSamples

FEW_IMAGES = 5
"""With fewer images or scans, a sensor without labels proves nothing."""


@dataclass(frozen=True)
class LabelGaps:
    """Sensors and images without labels in a data set that was to have labels.

    Attributes:
        folder: Folder of the data set.
        cameras: Numbers of images of the cameras without any label.
        scanners: Numbers of scans of the laser scanners without a point on a labelled object.
        classes: Classes of the label map without an object, and their categories.
        is_total: No camera and no scanner has a label.
        samples: Number of samples.
    """

    folder: str
    cameras: Mapping[str, int]
    scanners: Mapping[str, int]
    classes: Mapping[str, tuple[str, ...]]
    is_total: bool
    samples: int

    def lines(self) -> Iterator[str]:
        """One line for each gap, with its remedy."""
        for name, count in self.cameras.items():
            if count >= FEW_IMAGES:
                yield (
                    f"0 labels in {count} images of camera '{name}': look at them with gen-data "
                    "contact-sheet, and compare its pose with the scene's, and labels.map with "
                    "the categories in view"
                )
        for name, count in self.scanners.items():
            if count >= FEW_IMAGES:
                yield (
                    f"0 points on labelled objects in {count} scans of '{name}'; compare its pose "
                    "and range with the scene's"
                )
        for name, categories in self.classes.items():
            yield (
                f"class '{name}' of the label map: 0 objects in {self.samples} samples, as "
                f"{', '.join(categories)} did not occur"
            )


def find_label_gaps(stored: StoredSamples) -> LabelGaps:
    """Find sensors and images without labels. Reading ends as soon as every sensor has one.

    Labels are visible, annotated objects that the label map of the configuration keeps and does not
    ignore, visible tracked points, visible borders of lanes, and text. A data set without
    annotations and exporters has no gaps.

    Raises:
        StorageError: a file is missing or damaged.
    """
    config = stored.config
    if not config.get("annotations") and not config.get("exporters"):
        return LabelGaps(str(stored.folder), {}, {}, {}, is_total=False, samples=stored.n)
    label_map = read_label_map(config)
    applied = AppliedLabelMap(label_map, stored.info)
    waiting = dict.fromkeys((*stored.info.cameras, *stored.info.lidars), 0)
    sensors = len(waiting)
    for index in stored.indices:
        if not waiting:
            break
        sample = stored.labelled(index)
        for name in _read_by(sample, waiting):
            waiting[name] += 1
            if _has_label(sample, name, applied):
                del waiting[name]
    counts = count_objects(stored)
    empty = {
        name: categories
        for name, categories in label_map.classes_of.items()
        if not isinstance(label_map.classes, str) and categories and not counts[name]
    }
    return LabelGaps(
        str(stored.folder),
        {name: count for name, count in waiting.items() if name in stored.info.cameras},
        {name: count for name, count in waiting.items() if name in stored.info.lidars},
        empty,
        is_total=0 < sensors == len(waiting),
        samples=stored.n,
    )


def read_label_map(config: Mapping[str, object]) -> LabelMap:
    """The label map of a resolved configuration."""
    labels = config.get("labels")
    plain = labels.get("map") if isinstance(labels, Mapping) else None
    return LabelMap.model_validate_json(json.dumps(plain or {}))


def _read_by(sample: LabelledImages, waiting: Mapping[str, int]) -> list[str]:
    return [n for n in waiting if n in sample.labels.images or n in sample.labels.scans]


def _has_label(sample: LabelledImages, name: str, applied: AppliedLabelMap) -> bool:
    if name in sample.labels.scans:
        ids = sample.capture.clouds[name].points["category_id"]
        return bool((ids > 0).any())
    tracks = None if sample.frame is None else sample.frame.tracks
    if tracks is not None and name in tracks.sensors and tracks.sensors[name].visible.any():
        return True
    truth: ImageTruth = applied.map_image(sample.truth[name])
    if truth.texts or any(any(border.visible) for border in truth.borders or ()):
        return True
    return any(
        seen.instance.annotated and seen.visible_px > 0 and not seen.ignored
        for seen in truth.objects
    )


def count_objects(stored: StoredSamples) -> dict[str, int]:
    """Numbers of visible annotated objects in all images, as the manifest states them.

    By class of the label map, before its limits; by category if the map has no classes. A class of
    subcategories has the number of their categories.
    """
    manifest = json.loads((stored.folder / MANIFEST_NAME).read_bytes())
    counts = dict.fromkeys(stored.categories, 0)
    for split in manifest["splits"]:
        for category, number in split["objects"].items():
            counts[category] = counts.get(category, 0) + number
    classes = read_label_map(stored.config).classes_of
    if not classes:
        return counts
    return {
        name: sum(counts.get(category, 0) for category in {category_of(source) for source in own})
        for name, own in classes.items()
    }
