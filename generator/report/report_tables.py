"""Tables and histograms of a report, for the terminal and the HTML page."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.config.data_files import load_data
from gen_data.report.label_files import Scan
from gen_data.report.label_statistics import Column, Survey


@dataclass(frozen=True, slots=True)
class KittiType:
    """One of KITTI's types: number of objects, and mean height, width and length [m]."""

    objects: int
    size_hwl_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Difficulty:
    """Limits for an object to count at a difficulty.

    Attributes:
        height_px: Smallest height of its box.
        occlusion_level, truncation: Largest values.
    """

    name: str
    height_px: float
    occlusion_level: int
    truncation: float


_KITTI = load_data(__package__, "kitti_statistics")
KITTI_IMAGES: int = _KITTI["images"]
POINTS_PER_SCAN: tuple[int, int] = tuple(_KITTI["points_per_scan"])
"""Points per scan of the raw recordings, and of the odometry sequences."""
TYPES = {name: KittiType(**row) for name, row in _KITTI["types"].items()}
DIFFICULTIES = tuple(Difficulty(**row) for row in _KITTI["difficulties"])

NOTHING = "-"
EVERY = "all"
TRUNCATED = 0.15
"""Fraction outside the image above which KITTI's easy level excludes an object."""


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of text under a header; the first column names the row."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True, slots=True)
class Histogram:
    """Counts between edges; the last bin includes all larger values.

    Attributes:
        edges: Edges of the bins [n + 1].
        counts: Counts [n] by the name of the counted objects.
    """

    title: str
    edges: Column
    counts: dict[str, NDArray[np.intp]]


def make_tables(found: Survey) -> tuple[Table, ...]:
    """All tables of a report; keypoints and the comparison with KITTI only if they apply."""
    made = [_images(found), _objects(found), _hidden(found), _sizes(found)]
    if found.assets:
        made.append(_diversity(found))
    if found.points:
        made.append(_keypoints(found))
    if any(kind in TYPES and kind != "Misc" for _, kind in found.numbers):
        made.append(_beside_kitti(found))
    return tuple(made)


def make_scan_tables(scans: Sequence[Scan]) -> tuple[Table, ...]:
    """Tables of laser scans; none without scans, and none of cars without cars."""
    if not scans:
        return ()
    points = np.array([scan.points for scan in scans], np.float64)
    dark = sum(scan.dark for scan in scans) / max(points.sum(), 1.0)
    row = (f"{len(scans)}", f"{points.mean():.0f}", *(f"{n}" for n in POINTS_PER_SCAN))
    header = ("scans", "points/scan", "KITTI", "KITTI odometry", "5 / 50 / 95 %", "reflectance 0")
    note = "KITTI: Geiger et al., IJRR 2013; odometry: Behley et al., ICCV 2019."
    rows = ((*row, _quantiles(points, 0), f"{100.0 * dark:.2f} %"),)
    cars = (_car_points(scans),) if any(scan.cars for scan in scans) else ()
    return (Table("Laser scans", header, rows, note), *cars)


def _car_points(scans: Sequence[Scan]) -> Table:
    cars = np.array([car for scan in scans for car in scan.cars], np.float64).reshape(-1, 2)
    rows = []
    for near_m in range(0, 80, 10):
        counts = cars[(cars[:, 0] >= near_m) & (cars[:, 0] < near_m + 10), 1]
        cells = (_number(counts, np.mean, 1), _quantiles(counts, 0), _share(counts == 0))
        rows.append((f"{near_m} to {near_m + 10}", f"{counts.size}", *cells))
    header = ("distance m", "cars", "points/car", "5 / 50 / 95 %", "without")
    return Table("Laser points on cars", header, tuple(rows), "Cars that are not occluded.")


def make_histograms(found: Survey) -> tuple[Histogram, ...]:
    """Histograms by category, and of the number of objects per image."""
    columns = {name: found.category_columns(name) for name in found.categories}
    images = {"images": found.objects_per_image()}
    most = max(images["images"].max(initial=0.0), 9.0)
    heights = [0, 10, 15, 25, 40, 60, 90, 130, 190, 270, 400, 600, 900]
    aspects = [0, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1, 1.25, 1.6, 2, 2.5, 3.2, 4, 6]
    values: dict[str, dict[str, Column]] = {
        column: {name: c[column] for name, c in columns.items()}
        for column in ("height_px", "distance_m", "visible_fraction")
    }
    shapes = {name: c["width_px"] / c["height_px"] for name, c in columns.items()}
    return (
        count_values("Objects per image", np.arange(0.0, most + 2.0), images),
        count_values("Height of the box [px]", np.array(heights, float), values["height_px"]),
        count_values("Aspect ratio of the box (width / height)", np.array(aspects), shapes),
        count_values("Distance [m]", _distance_edges(columns), values["distance_m"]),
        count_values("Visible fraction", np.linspace(0.0, 1.0, 11), values["visible_fraction"]),
    )


def counts_at(columns: dict[str, Column], level: Difficulty) -> NDArray[np.bool_]:
    """Mask [n] of the objects that count at one of KITTI's difficulties."""
    counted: NDArray[np.bool_] = (
        (columns["height_px"] >= level.height_px)
        & (columns["occlusion_level"] <= level.occlusion_level)
        & (columns["truncation"] <= level.truncation)
    )
    return counted


def _distance_edges(columns: dict[str, dict[str, Column]]) -> Column:
    """About a dozen edges in steps of 1, 2 or 5 times a power of ten."""
    known = [_drop_missing(c["distance_m"]) for c in columns.values()]
    far_m = max((float(v.max()) for v in known if v.size), default=1.0)
    rough_m = max(far_m, 1e-3) / 12.0
    power = 10.0 ** np.floor(np.log10(rough_m))
    step_m = next(power * k for k in (1.0, 2.0, 5.0, 10.0) if power * k >= rough_m)
    return np.asarray(np.arange(0.0, far_m + step_m, step_m))


def count_values(title: str, edges: Column, values: dict[str, Column]) -> Histogram:
    """Histogram of columns by name without their missing values (NaN); ends include the rest."""
    counted = {}
    for name, column in values.items():
        known = np.clip(_drop_missing(column), edges[0], edges[-1])
        counted[name] = np.histogram(known, edges)[0]
    return Histogram(title, edges, counted)


def _images(found: Survey) -> Table:
    splits = sorted({split for split, _ in found.images})
    rows = []
    for name, split in [*((s, s) for s in splits), ("all", None)]:
        objects = found.objects_per_image(split)
        shown = f"{np.median(objects):.0f} / {objects.max():.0f}" if objects.size else NOTHING
        totals = (f"{objects.size}", f"{objects.sum():.0f}", _share(objects == 0))
        rows.append((name, *totals, _number(objects, np.mean, 1), shown))
    header = ("split", "images", "objects", "empty", "objects/image", "median / most")
    return Table("Images", header, tuple(rows))


def _objects(found: Survey) -> Table:
    rows = []
    total = sum(found.images.values())
    for name in found.categories:
        c = found.category_columns(name)
        n = c["width_px"].size
        counts = (f"{n}", f"{100.0 * n / total:.1f} %", f"{n / max(len(found.images), 1):.2f}")
        sizes = (_quantiles(c["width_px"], 0), _quantiles(c["height_px"], 0))
        rows.append((name, *counts, *sizes, _quantiles(c["width_px"] / c["height_px"], 2)))
    header = ("category", "objects", "share", "per image", "width px", "height px", "aspect")
    note = "Boxes and distances: 5 %, 50 % and 95 % quantiles."
    return Table("Objects", header, tuple(rows), note)


def _hidden(found: Survey) -> Table:
    rows = []
    for name in found.categories:
        c = found.category_columns(name)
        level = _drop_missing(c["occlusion_level"])
        occluded = (_share(level == k) for k in range(3))
        truncated = _share(_drop_missing(c["truncation"]) > TRUNCATED)
        counted = (_share(counts_at(c, d)) if level.size else NOTHING for d in DIFFICULTIES)
        rows.append((name, *occluded, truncated, _quantiles(c["visible_fraction"], 2), *counted))
    header = (
        "category", "occluded 0", "1", "2", "truncated", "visible fraction",
        *(d.name for d in DIFFICULTIES),
    )  # fmt: skip
    note = (
        "Occluded: KITTI's levels. Truncated: more than 15 % outside the image. Easy, moderate, "
        "hard: KITTI's difficulties, each including the one before."
    )
    return Table("Occlusion and truncation", header, tuple(rows), note)


def _sizes(found: Survey) -> Table:
    rows = []
    for name in found.categories:
        c = found.category_columns(name)
        sizes = (_format_spread(c[f"{side}_m"]) for side in ("height", "width", "length"))
        rows.append((name, _quantiles(c["distance_m"], 1), *sizes))
    header = ("category", "distance m", "height m", "width m", "length m")
    return Table("Distance and size", header, tuple(rows), "Sizes: mean and standard deviation.")


def _diversity(found: Survey) -> Table:
    families: dict[tuple[str, str], list[int]] = {}
    for (category, asset), n in sorted(found.assets.items()):
        family, question_mark, _ = asset.partition("?")
        families.setdefault((category, EVERY), []).append(n)
        if question_mark:
            families.setdefault((category, family), []).append(n)
    rows = [
        (category, family, f"{sum(counts)}", f"{len(counts)}", f"{entropy_bits(counts):.2f}")
        for (category, family), counts in sorted(families.items())
    ]
    header = ("category", "family", "objects", "variants", "entropy bits")
    note = (
        "Variants: different asset ids. Entropy (Shannon 1948): 3 bits are as diverse as 8 equally "
        "frequent variants."
    )
    return Table("Diversity", header, tuple(rows), note)


def entropy_bits(counts: Sequence[int]) -> float:
    """Shannon entropy of frequencies [bits]; 0 for a single value."""
    share = np.array(counts, np.float64) / sum(counts)
    return float(-(share * np.log2(share)).sum()) + 0.0


def _keypoints(found: Survey) -> Table:
    rows = []
    for name, counts in sorted(found.points.items()):
        total = max(sum(counts), 1)
        outside, hidden, visible = (f"{100.0 * n / total:.1f} %" for n in counts)
        rows.append((name, f"{sum(counts)}", visible, hidden, outside))
    header = ("category", "keypoints", "visible", "hidden", "not in the image")
    return Table("Keypoints", header, tuple(rows))


def _beside_kitti(found: Survey) -> Table:
    rows = []
    images = max(len(found.images), 1)
    for kind, kitti in TYPES.items():
        c = found.kind_columns(kind)
        n = c["width_px"].size
        row = [kind, f"{n}", f"{kitti.objects}", f"{n / images:.2f}"]
        row.append(f"{kitti.objects / KITTI_IMAGES:.2f}")
        for side, theirs in zip(("height", "width", "length"), kitti.size_hwl_m, strict=True):
            row += [_number(c[f"{side}_m"], np.mean, 2), f"{theirs:.2f}"]
        rows.append(tuple(row))
    header = (
        "type", "objects", "KITTI", "per image", "KITTI", "height m", "KITTI", "width m", "KITTI",
        "length m", "KITTI",
    )  # fmt: skip
    note = (
        f"KITTI: the {KITTI_IMAGES} training images of its object benchmark (Geiger et al., CVPR "
        "2012); mean sizes from Frustum PointNets (Qi et al., CVPR 2018)."
    )
    return Table("Compared with KITTI", header, tuple(rows), note)


def _drop_missing(column: Column) -> Column:
    return column[np.isfinite(column)]


def _number(column: Column, of: Callable[[Column], np.floating], digits: int) -> str:
    known = _drop_missing(column)
    return f"{of(known):.{digits}f}" if known.size else NOTHING


def _quantiles(column: Column, digits: int) -> str:
    known = _drop_missing(column)
    if not known.size:
        return NOTHING
    return " / ".join(f"{v:.{digits}f}" for v in np.quantile(known, [0.05, 0.5, 0.95]))


def _format_spread(column: Column) -> str:
    known = _drop_missing(column)
    return f"{known.mean():.2f} ± {known.std():.2f}" if known.size else NOTHING


def _share(true: NDArray[np.bool_]) -> str:
    return f"{100.0 * true.mean():.1f} %" if true.size else NOTHING
