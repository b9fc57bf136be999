"""Statistics of the shown pictures and of real pictures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, median

from gen_data.core.errors import ConfigError
from gen_data.lab.carry_over.statistics import mean_grey
from gen_data.lab.edit.data_sets import Row
from gen_data.lab.edit.samples import Labelled, Shown
from gen_data.lab.matching.label_files import OCCLUSION_LEVELS
from gen_data.lab.matching.picture import Picture
from gen_data.lab.matching.real_files import choose_evenly, find_files
from gen_data.lab.study.real_pictures import read_image, read_real

PICTURES_MAX = 60
"""Number of real pictures read, evenly spaced."""


@dataclass(frozen=True)
class Class:
    """Boxes of a category.

    Attributes:
        per_picture: Mean number of boxes in a picture.
        width_px, height_px: Medians.
        occlusion: Mean in [0, 1]; None where no box states it.
    """

    per_picture: float
    width_px: float
    height_px: float
    occlusion: float | None


@dataclass(frozen=True)
class Summary:
    """Statistics of a set of pictures.

    Attributes:
        brightness: Mean grey value in [0, 1]; None without photographs.
        classes: By name in lower case, the most frequent first.
    """

    pictures: int
    brightness: float | None
    classes: dict[str, Class]


def summarise(shown: Sequence[Shown]) -> Summary:
    """Statistics of the pictures of the grid."""
    lights = [one.brightness for one in shown if one.brightness is not None]
    classes = _classes((item for one in shown for item in one.objects), len(shown))
    return Summary(len(shown), fmean(lights) if lights else None, classes)


def summarise_rows(listed: Sequence[Row]) -> Summary:
    """Statistics of images of a data set, whose photographs are not read."""
    classes = _classes((item for row in listed for item in row.objects), len(listed))
    return Summary(len(listed), None, classes)


def read_summary(folder: Path) -> Summary:
    """Statistics of a folder of real pictures; without labels, their brightness only.

    Raises:
        StorageError: the folder holds no picture that can be read.
    """
    try:
        real = read_real(folder, None, most=PICTURES_MAX)
    except ConfigError:
        paths = choose_evenly(find_files(folder).photos, PICTURES_MAX)
        return Summary(len(paths), _brightness(paths), {})
    things = [
        Labelled(
            thing.name,
            thing.box[2] - thing.box[0],
            thing.box[3] - thing.box[1],
            OCCLUSION_LEVELS.index(thing.occlusion) / (len(OCCLUSION_LEVELS) - 1)
            if thing.occlusion
            else None,
        )
        for picture in real.pictures
        for thing in picture.objects
        if not thing.is_ignored
    ]
    count = len(real.pictures)
    return Summary(count, _brightness(p.path for p in real.pictures), _classes(things, count))


def _brightness(paths: Iterable[Path]) -> float | None:
    values = [mean_grey(Picture(read_image(path)).grey) / 255.0 for path in paths]
    return fmean(values) if values else None


def _classes(things: Iterable[Labelled], pictures: int) -> dict[str, Class]:
    by_name: dict[str, list[Labelled]] = {}
    for thing in things:
        by_name.setdefault(thing.category.casefold(), []).append(thing)
    found = {}
    for name, listed in sorted(by_name.items(), key=lambda entry: (-len(entry[1]), entry[0])):
        hidden = [thing.occlusion for thing in listed if thing.occlusion is not None]
        found[name] = Class(
            len(listed) / max(pictures, 1),
            median(thing.width_px for thing in listed),
            median(thing.height_px for thing in listed),
            fmean(hidden) if hidden else None,
        )
    return found


def rows(ours: Summary, real: Summary | None) -> list[tuple[str, ...]]:
    """Cells of a table: class, then boxes a picture, width, height and occlusion of both sides."""
    names = dict.fromkeys([*ours.classes, *(real.classes if real else ())])
    return [
        (name, *_cells(ours.classes.get(name)), *(_cells(real.classes.get(name)) if real else ()))
        for name in names
    ]


def _cells(one: Class | None) -> tuple[str, ...]:
    if one is None:
        return ("", "", "")
    hidden = "" if one.occlusion is None else f"{one.occlusion:.2f}"
    return (f"{one.per_picture:.2g}", f"{one.width_px:.0f} x {one.height_px:.0f}", hidden)
