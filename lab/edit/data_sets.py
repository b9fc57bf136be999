"""Images of finished data sets as rows to filter and sort, and their pictures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from gen_data.core.capture import Channel
from gen_data.lab.edit.overlays import View, draw_view
from gen_data.lab.edit.samples import Labelled, Shown, encode
from gen_data.report.image_statistics import measure_look
from gen_data.report.stored_labels import ImageLabels, read_images
from gen_data.runner.stored import StoredSamples

if TYPE_CHECKING:
    from gen_data.lab.edit.samples import Studio

PLAN = "plan.json"
IMAGES_MAX = 200_000
"""Images of a data set that are listed."""


@dataclass(frozen=True, slots=True)
class Row:
    """One image of a data set.

    Attributes:
        objects: Its labelled objects, in pixels of the image.
    """

    index: int
    camera: str
    split: str
    objects: tuple[Labelled, ...]

    @property
    def largest_px(self) -> float:
        """Height of its largest box; 0 without one."""
        return max((item.height_px for item in self.objects), default=0.0)

    @property
    def occlusion(self) -> float:
        """Largest occlusion of an object; 0 without a value."""
        return max((item.occlusion or 0.0 for item in self.objects), default=0.0)


ORDERS = {
    "number": lambda row: (row.index, row.camera),
    "most objects": lambda row: (-len(row.objects), row.index),
    "largest box": lambda row: (-row.largest_px, row.index),
    "smallest box": lambda row: (row.largest_px, row.index),
    "most occluded": lambda row: (-row.occlusion, row.index),
}
"""Ways to sort images."""


def is_data_set(folder: Path) -> bool:
    """Whether a folder holds a finished data set."""
    return (folder / PLAN).is_file()


def find_data_sets(folders: Iterable[Path]) -> list[Path]:
    """Finished data sets in folders, and in their folders ``out``."""
    places = [
        place for folder in folders for place in (folder, *folder.glob("*"), *folder.glob("out/*"))
    ]
    return sorted({place for place in places if is_data_set(place)})


def list_rows(folder: Path) -> list[Row]:
    """All images of a data set.

    Raises:
        StorageError: the folder holds no finished data set, or labels are damaged.
    """
    return [
        _row(image)
        for _, image in zip(range(IMAGES_MAX), read_images(StoredSamples(folder)), strict=False)
    ]


def _row(image: ImageLabels) -> Row:
    objects = [
        Labelled(
            item["instance"]["category"],
            item["box"]["x_max"] - item["box"]["x_min"],
            item["box"]["y_max"] - item["box"]["y_min"],
            item.get("occlusion"),
        )
        for item in image.objects
        if item.get("box") is not None
    ]
    return Row(image.index, image.camera, image.split, tuple(objects))


def choose(
    rows: Sequence[Row],
    *,
    category: str = "",
    split: str = "",
    least: int = 0,
    order: str = "number",
) -> list[Row]:
    """Images in a split with enough objects, one of a category (empty = any), sorted."""
    found = [
        row
        for row in rows
        if split in ("", row.split)
        and len(row.objects) >= least
        and (not category or any(item.category == category for item in row.objects))
    ]
    return sorted(found, key=ORDERS[order])


def count_categories(rows: Sequence[Row]) -> Counter[str]:
    """Number of objects by category."""
    return Counter(item.category for row in rows for item in row.objects)


@lru_cache(maxsize=2)
def _open(folder: str) -> StoredSamples:
    return StoredSamples(folder)


@dataclass(frozen=True)
class StoredOrder:
    """Order of the picture of a stored image.

    Attributes:
        width_px: Largest width; 0 = as stored.
    """

    folder: str
    index: int
    camera: str
    view: View
    width_px: int = 320

    def run(self, studio: Studio) -> Shown:
        """Draw the stored image with its labels."""
        del studio
        stored = _open(self.folder)
        sample = stored.labelled(self.index)
        unit = 1.5 if not self.width_px else 2.0
        reading = sample.capture.readings[self.camera]
        image = draw_view(sample, self.view.of(self.camera), {}, unit)
        if 0 < self.width_px < image.shape[1]:
            size_px = self.width_px, max(1, round(image.shape[0] * self.width_px / image.shape[1]))
            image = np.asarray(cv2.resize(image, size_px, interpolation=cv2.INTER_AREA), np.uint8)
        objects = [
            Labelled(o.instance.category, o.box.width_px, o.box.height_px, o.occlusion)
            for o in sample.truth[self.camera].objects
            if o.box is not None
        ]
        rgb = reading.channels.get(Channel.RGB)
        grey = None if rgb is None else cv2.cvtColor(np.asarray(rgb, np.uint8), cv2.COLOR_RGB2GRAY)
        return Shown(
            encode(image),
            self.index,
            {self.camera: "photo"},
            tuple(objects),
            {},
            None if grey is None else measure_look(np.asarray(grey, np.uint8)).brightness,
            1,
            1,
        )
