"""Statistics of labelled pictures, by class: a table of quantities, and their values in a set.

One reader reads both sides from one layout: rules of a format, such as KITTI's boxes around
projected 3D boxes, hold for both.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import Float32
from gen_data.core.errors import ConfigError, StorageError
from gen_data.core.se3 import Array
from gen_data.lab.matching.label_files import OCCLUSION_LEVELS, RealObject
from gen_data.lab.matching.picture import Picture
from gen_data.lab.matching.point_files import read_point_file
from gen_data.lab.study.real_pictures import RealPicture, read_image
from gen_data.sensors.calibration.frame_formats import kitti_calibration

DARK_GREY = 25.0
"""Pixels below this grey level (0 to 255) are dark."""
NEAR_M, MIDDLE_M, FAR_M = (5.0, 15.0), (15.0, 30.0), (30.0, 60.0)
"""Distances of which laser points are counted: about 10, 20 and 40 m."""
HEIGHTS_PX = (0.0, 25.0, 48.0, 96.0, 192.0, math.inf)
"""Edges of the bins of heights: KITTI's limits for labels, and doublings."""
WHOLE, EVERY = "pictures", "all classes"
"""Stand for a class in statistics of whole pictures, and of all classes together."""


@dataclass(frozen=True, eq=False, slots=True)
class Seen:
    """A labelled object in its picture.

    Attributes:
        grey: Grey values of the picture, 0 to 255 [h, w].
        points_m: Laser points in the frame of the camera [n, 3]; None = there are none.
    """

    thing: RealObject
    grey: Float32
    points_m: Array | None

    @property
    def crop(self) -> Float32:
        """Grey values inside the box."""
        x0, y0, x1, y1 = self.thing.box
        rows = slice(max(math.floor(y0), 0), max(math.ceil(y1), 0))
        return self.grey[rows, max(math.floor(x0), 0) : max(math.ceil(x1), 0)]


@dataclass(frozen=True, slots=True)
class Quantity:
    """A quantity of an object, or of the objects of a class in one picture.

    Attributes:
        measure: Its value; NaN = the labels do not state it.
        grain: Smallest spread that differences are measured by, in octaves if ``is_log``; assumed.
        is_log: Ratios count, not differences.
    """

    name: str
    measure: Callable[[Seen], float]
    grain: float
    is_log: bool = False


def _sides(seen: Seen) -> tuple[float, float]:
    x0, y0, x1, y1 = seen.thing.box
    return x1 - x0, y1 - y0


def _centre(seen: Seen, axis: int) -> float:
    low, high = seen.thing.box[axis], seen.thing.box[axis + 2]
    return 0.5 * (low + high) / int(seen.grey.shape[1 - axis])


def _occlusion(seen: Seen) -> float:
    level = seen.thing.occlusion
    return float(OCCLUSION_LEVELS.index(level)) if level else math.nan


def _truncation(seen: Seen) -> float:
    return math.nan if seen.thing.truncation is None else seen.thing.truncation


def _distance(seen: Seen) -> float:
    box = seen.thing.box3d
    return math.nan if box is None else math.hypot(box.bottom_m[0], box.bottom_m[2])


def _bottom(seen: Seen) -> float:
    return math.nan if seen.thing.box3d is None else seen.thing.box3d.bottom_m[1]


def _size(seen: Seen, axis: int) -> float:
    return math.nan if seen.thing.box3d is None else seen.thing.box3d.size_hwl_m[axis]


def _points(seen: Seen, limits_m: tuple[float, float]) -> float:
    box, points_m = seen.thing.box3d, seen.points_m
    if box is None or points_m is None or not limits_m[0] <= _distance(seen) < limits_m[1]:
        return math.nan
    return float((box.depths_m(points_m) >= 0.0).sum())


def dark_share(grey: Float32) -> float:
    """Share of dark pixels, by whole grey values; NaN without pixels."""
    return float((np.rint(grey) < DARK_GREY).mean()) if grey.size else math.nan


def mean_grey(grey: Float32) -> float:
    """Mean grey value; NaN without pixels."""
    return float(grey.mean()) if grey.size else math.nan


SIZE, HEIGHT, COUNT, COVER = "long side", "height px", "count", "area share"
OF_OBJECTS = (
    Quantity(SIZE, lambda s: max(_sides(s)) / max(s.grey.shape), 0.1, is_log=True),
    Quantity(HEIGHT, lambda s: _sides(s)[1], 0.1, is_log=True),
    Quantity("width / height", lambda s: _sides(s)[0] / _sides(s)[1], 0.1, is_log=True),
    Quantity("centre x", lambda s: _centre(s, 0), 0.02),
    Quantity("centre y", lambda s: _centre(s, 1), 0.02),
    Quantity("grey in box", lambda s: mean_grey(s.crop), 4.0),
    Quantity("dark in box", lambda s: dark_share(s.crop), 0.02),
    Quantity("occlusion", _occlusion, 0.1),
    Quantity("truncation", _truncation, 0.02),
    Quantity("distance m", _distance, 0.1, is_log=True),
    Quantity("bottom m", _bottom, 0.05),
    Quantity("height m", partial(_size, axis=0), 0.02, is_log=True),
    Quantity("width m", partial(_size, axis=1), 0.02, is_log=True),
    Quantity("length m", partial(_size, axis=2), 0.02, is_log=True),
    *(
        Quantity(
            f"points {near:g}-{far:g} m", partial(_points, limits_m=(near, far)), 0.1, is_log=True
        )
        for near, far in (NEAR_M, MIDDLE_M, FAR_M)
    ),
)
OF_PICTURES: Mapping[str, float] = {"grey": 4.0, "dark share": 0.02}
"""Grains of quantities of whole pictures."""
QUANTITIES: Mapping[str, Quantity] = {
    quantity.name: quantity
    for quantity in (
        *OF_OBJECTS,
        Quantity(COUNT, lambda _: math.nan, 0.25),
        Quantity(COVER, lambda _: math.nan, 0.1, is_log=True),
        *(Quantity(name, lambda _: math.nan, grain) for name, grain in OF_PICTURES.items()),
    )
}
"""All quantities by name; count and area share are of a class in one picture."""


@dataclass(frozen=True, eq=False, slots=True)
class Values:
    """Values of one quantity of one class.

    Attributes:
        values: As measured [n], without NaN.
        units: Numbers of the independent units, pictures or scenes, that they come from [n].
    """

    values: Array
    units: NDArray[np.intp]


Measured = Mapping[tuple[str, str], Values]
"""By class and name of the quantity."""


def measure(
    pictures: Sequence[RealPicture], units: Sequence[int], label_of: Mapping[str, str]
) -> Measured:
    """Measure all quantities of a set of pictures.

    Args:
        pictures: Labelled pictures; ignored objects do not count.
        units: Number of the independent unit of each picture, from 0.
        label_of: Class of the comparison by name in the labels; others are left out.

    Raises:
        StorageError: an image or a scan cannot be read.
    """
    rows: dict[tuple[str, str], list[tuple[float, int]]] = {}
    for picture, unit in zip(pictures, units, strict=True):
        for key, value in _measure_picture(picture, label_of):
            if not math.isnan(value):
                rows.setdefault(key, []).append((value, unit))
    return {
        key: Values(np.array([v for v, _ in found]), np.array([u for _, u in found]))
        for key, found in rows.items()
    }


def _measure_picture(
    picture: RealPicture, label_of: Mapping[str, str]
) -> Iterator[tuple[tuple[str, str], float]]:
    grey = Picture(read_image(picture.path)).grey
    points_m = None if picture.scan is None else read_scan(picture.scan)
    yield (WHOLE, "grey"), mean_grey(grey)
    yield (WHOLE, "dark share"), dark_share(grey)
    classes = dict.fromkeys(label_of.values(), 0)
    counts = Counter({EVERY: 0, **classes} if len(classes) > 1 else classes)
    areas: dict[str, float] = {}
    for thing in picture.objects:
        label = label_of.get(thing.name)
        if label is None or thing.is_ignored:
            continue
        seen = Seen(thing, grey, points_m)
        area = math.prod(_sides(seen)) / grey.size
        values = [(quantity.name, quantity.measure(seen)) for quantity in OF_OBJECTS]
        for one in (label, EVERY) if EVERY in counts else (label,):
            counts[one] += 1
            areas[one] = areas.get(one, 0.0) + area
            yield from (((one, name), value) for name, value in values)
    yield from (((label, COUNT), float(count)) for label, count in counts.items())
    yield from (((label, COVER), area) for label, area in areas.items())


def read_scan(path: Path) -> Array:
    """Points of KITTI's scan in the frame of the labels [n, 3].

    Raises:
        StorageError: the scan or its calibration cannot be read.
    """
    calib = path.parent.parent / f"calib/{path.stem}.txt"
    try:
        frames = kitti_calibration(calib.read_text(encoding="utf-8"), str(calib)).frames
        return frames["velodyne"].T_parent_frame.apply(read_point_file(path)[:, :3])
    except KeyError:
        raise StorageError(
            f"{calib}: has no Tr_velo_to_cam; expected KITTI's calibration"
        ) from None
    except (OSError, ValueError, ConfigError) as error:
        raise StorageError(
            f"{path}: cannot be read with its calibration {calib} ({error}); expected KITTI's "
            "files, or no folder velodyne"
        ) from error


def heights_per_picture(measured: Measured, label: str) -> list[float]:
    """Mean number of boxes in a picture by bins of ``HEIGHTS_PX``."""
    pictures = measured[label, COUNT].values.size
    found = measured.get((label, HEIGHT))
    counts = np.histogram([] if found is None else found.values, HEIGHTS_PX)[0]
    return [float(count) / pictures for count in counts]
