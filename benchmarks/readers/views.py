"""Views: content of an image, a scan or a trajectory, read by any reader; their comparison."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import SE3


@dataclass(frozen=True)
class Thing:
    """An object, or other numbers with a name.

    Attributes:
        category: Name of its class.
        numbers: float64 [n], in the unit of the row of the table: left, top, right and bottom of a
            box in the image, along the edges of pixels; centre and half axes of a box in space.
        mask: Its pixels, bool [height, width]; None if the reader gives none.
    """

    category: str
    numbers: NDArray[np.float64]
    mask: NDArray[np.bool_] | None = None

    def __str__(self) -> str:
        """Category and the first numbers."""
        return f"{self.category} {self.numbers[:4]}"


@dataclass(frozen=True)
class View:
    """Content of one file, image or scan.

    Attributes:
        name: ``<sample>_<sensor>``.
        lens: fx, fy, cx, cy (pixel i has its centre at i + 0.5) and coefficients in OpenCV's order;
            None if the reader gives none.
    """

    name: str
    things: tuple[Thing, ...] = ()
    lens: tuple[float, ...] | None = None


def thing(category: str, numbers: Iterable[float], mask: object = None) -> Thing:
    """An object with plain values."""
    flat = np.array(numbers if isinstance(numbers, np.ndarray) else list(numbers), float).ravel()
    return Thing(category, flat, None if mask is None else np.asarray(mask).astype(bool))


def from_corner(category: str, box: Iterable[float], mask: object = None) -> Thing:
    """An object whose box is left, top, width and height."""
    x, y, width, height = (float(value) for value in box)
    return thing(category, (x, y, x + width, y + height), mask)


def of_pixels(category: str, mask: NDArray[np.bool_]) -> Thing:
    """An object with the box of its mask."""
    y, x = np.nonzero(mask)
    return thing(category, (x.min(), y.min(), x.max() + 1, y.max() + 1), mask)


def cube(category: str, pose: SE3, size_m: Iterable[float]) -> Thing:
    """An object in space: centre, and half its length, width and height along its axes [m]."""
    matrix = pose.matrix()
    axes = matrix[:3, :3].T * np.array(list(size_m))[:, None] / 2
    return thing(category, np.vstack([matrix[:3, 3], axes]))


@dataclass
class Comparison:
    """Differences between a reader's result and the data set.

    Attributes:
        objects: Number of objects compared.
        worst: Largest difference of a number.
        iou: Smallest overlap of masks; None without masks.
        lens: Largest difference of focal lengths and principal points [px] and coefficients; None
            without lenses.
        faults: Missing objects, and objects that the data set does not state.
    """

    objects: int = 0
    worst: float = 0.0
    iou: float | None = None
    lens: float | None = None
    faults: list[str] = field(default_factory=list)

    def add_views(self, stated: Iterable[View], found: Iterable[View], is_partial: bool) -> None:
        """Compare views of the same name.

        Args:
            stated: Views of the data set.
            found: Views found by a reader.
            is_partial: Whether the format omits objects by its definition.
        """
        others = {view.name: view for view in found}
        for view in stated:
            other = others.pop(view.name, None)
            if other is None:
                self.faults.append(f"{view.name} is missing")
            else:
                self._add_things(view, other, is_partial)
                self._add_lens(view, other)
        self.faults += [f"{name} is not in the data set" for name in others]

    def _add_things(self, view: View, other: View, is_partial: bool) -> None:
        stated, found = list(view.things), list(other.things)
        pairs = sorted(
            (float(np.abs(one.numbers - seen.numbers).max(initial=0.0)), k, n)
            for k, one in enumerate(stated)
            for n, seen in enumerate(found)
            if one.category == seen.category and one.numbers.shape == seen.numbers.shape
        )
        left, new = set(range(len(stated))), set(range(len(found)))
        for gap, k, n in pairs:
            if k in left and n in new:
                left.remove(k)
                new.remove(n)
                self.objects += 1
                self.worst = max(self.worst, gap)
                self._add_masks(stated[k], found[n])
        self.faults += [f"{view.name}: {found[n]} is not in the data set" for n in new]
        if not is_partial:
            self.faults += [f"{view.name}: {stated[k]} is missing" for k in left]

    def _add_masks(self, one: Thing, other: Thing) -> None:
        if one.mask is not None and other.mask is not None:
            overlap = _iou(one.mask, other.mask)
            self.iou = overlap if self.iou is None else min(self.iou, overlap)

    def _add_lens(self, view: View, other: View) -> None:
        if view.lens is None or other.lens is None:
            return
        # Absent coefficients are 0: some formats leave out those at the end.
        count = max(len(view.lens), len(other.lens))
        a, b = (np.pad(one, (0, count - len(one))) for one in (view.lens, other.lens))
        self.lens = max(self.lens or 0.0, float(np.abs(a - b).max()))


def _iou(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    if one.shape != other.shape:
        return 0.0
    union = (one | other).sum()
    return float((one & other).sum() / union) if union else 1.0
