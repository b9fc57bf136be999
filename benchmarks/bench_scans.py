"""Figures of simulated and real laser scans: ``python -m benchmarks.bench_scans --n 12``.

Scans come from the first and the last step of a configuration's scenes, or (``--kitti FOLDER``)
from the folders ``velodyne``, ``label_2`` and ``calib`` of KITTI's object format: real frames, or
the ``kitti/training`` of a finished data set. The table's first column refers to KITTI's scanner,
an HDL-64E S2. Definitions, the same for all sources:

* **cells**: 64 x 512 cells of the field between +3 and -25 degrees of elevation and 45 degrees to
  both sides of ahead, as in range images of this scanner (Wu et al., "SqueezeSeg", ICRA 2018); the
  share that contains a point.
* **ground**: points 4 to 20 m away, in patches of 4 m x 4 m that hold at least 30 points, all below
  1.2 m under the scanner's origin and within 0.1 m of the patch's own plane. The residual is the
  distance to that plane, kerbs included. Reflectance refers to the same points.
* **objects**: points in an annotated box whose lowest 0.2 m are left out, as they contain ground;
  boxes ahead, within 40 degrees and 5 to 50 m, of whose directions at most a fifth of the returns
  end in front of the box. Numbers of points at 10, 20 and 40 m: a straight line through log(points)
  over log(range), with its standard error there. The column ``own`` counts the points of the
  object itself instead of the points in its box, including those below 0.2 m; it exists for
  simulated scans only.

  The line is not a count. KITTI's 546 on a cyclist at 10 m exceeds the number of beams that hit any
  simulated cyclist there: 378 from behind, 512 from the side. KITTI labels distant people only if
  its annotators recognised them; simulated people count from one point on.
* **highest beam**: the 99.5th percentile of elevations, about the scanner's origin in the axes of
  the car.
"""

import argparse
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.real_figures import real_figures
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.sample import Sample

Float64 = NDArray[np.float64]
GROUND_M, PATCH_M, PATCH_POINTS = (4.0, 20.0), 4.0, 30
GROUND_BELOW_M, GROUND_BAND_M = 1.2, 0.1
BOX_FLOOR_M = 0.2
OBJECTS_M, AHEAD_DEG = (5.0, 50.0), 40.0
"""Boxes that count for numbers of points."""
HIDDEN_MAX = 0.2
"""Share of the returns in the directions of a box that end more than half a metre before it."""
KINDS = {"car": "car", "pedestrian": "pedestrian", "cyclist": "cyclist", "person": "pedestrian"}

HIGHEST = 0.995
"""Quantile of elevations that stands for the highest beam."""

REAL = real_figures("scans").rows


@dataclass(frozen=True, eq=False, slots=True)
class Directions:
    """Polar coordinates of points about the scanner's origin, [n] each."""

    azimuth_deg: Float64
    up_deg: Float64
    range_m: Float64

    @classmethod
    def of(cls, p_m: Float64) -> "Directions":
        """Elevations and azimuths of points [n, 3]."""
        level_m = np.hypot(p_m[:, 0], p_m[:, 1])
        return cls(
            np.degrees(np.arctan2(p_m[:, 1], p_m[:, 0])),
            np.degrees(np.arctan2(p_m[:, 2], level_m)),
            np.hypot(level_m, p_m[:, 2]),
        )


@dataclass(frozen=True, eq=False, slots=True)
class ObjectBox:
    """An annotated box: pose ``R``, ``t_m`` in the scanner's frame, ``size_m`` along its axes.

    ``instance_id`` is the id of its object's points; 0 = unknown.
    """

    kind: str
    R: Float64
    t_m: Float64
    size_m: Float64
    instance_id: int = 0

    def holds(self, p_m: Float64) -> NDArray[np.bool_]:
        """Whether points [n, 3] are in the box, above its lowest part."""
        local = (p_m - self.t_m) @ self.R
        inside = (np.abs(local) <= 0.5 * self.size_m).all(axis=1)
        return np.asarray(inside & (local[:, 2] >= BOX_FLOOR_M - 0.5 * self.size_m[2]))

    @property
    def range_m(self) -> float:
        """Level distance of its centre from the scanner."""
        return float(np.hypot(*self.t_m[:2]))

    def counts(self, seen: Directions) -> bool:
        """Whether it is ahead, in range, and mostly in the open among points of a scan."""
        ahead = abs(math.degrees(math.atan2(self.t_m[1], self.t_m[0]))) < AHEAD_DEG
        if not ahead or not OBJECTS_M[0] < self.range_m < OBJECTS_M[1]:
            return False
        signs = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, 8).T
        corners = self.t_m + (signs * self.size_m) @ self.R.T
        to = Directions.of(corners)
        toward = seen.azimuth_deg > to.azimuth_deg.min()
        toward &= seen.azimuth_deg < to.azimuth_deg.max()
        toward &= (seen.up_deg > to.up_deg.min()) & (seen.up_deg < to.up_deg.max())
        before = seen.range_m[toward] < to.range_m.min() - 0.5
        return bool(toward.any() and before.mean() <= HIDDEN_MAX)


@dataclass(frozen=True, eq=False, slots=True)
class Scan:
    """A sweep: points [n, 3] in the axes of the car, reflectance and instance [n], and boxes."""

    p_m: Float64
    reflectance: Float64
    instance_id: NDArray[np.int64]
    boxes: tuple[ObjectBox, ...]


def scans_of_config(
    name: str, scenes: Iterable[int], overrides: Sequence[str]
) -> Iterator[list[Scan]]:
    """Scans of each of these scenes, of their first and last step; cameras are made tiny.

    Building a scene takes most of the time; in its last step objects are at other ranges.
    """
    config = load_config(name, overrides=overrides)
    steps = config.general.views_per_scene * config.general.steps_per_scene
    tiny = [
        f"sensors[{k}].size_px=[64, 32]"
        for k, sensor in enumerate(config.sensors)
        if hasattr(sensor, "size_px")
    ]
    with open_pipeline(load_config(name, overrides=[*overrides, *tiny])) as pipeline:
        for scene in scenes:
            ends = sorted({0, config.general.steps_per_scene - 1})
            yield [scan_of_sample(pipeline.sample(scene * steps + step)) for step in ends]


def scan_of_sample(sample: Sample) -> Scan:
    """The first scan of a sample, in the axes of its carrier."""
    cloud = next(iter(sample.capture.clouds.values()))
    lidar = cloud.lidar
    R_car_lidar = lidar.T_rig_lidar.rotation()
    p_m = cloud.points["position_m"].astype(np.float64) @ R_car_lidar.T
    instance_id = cloud.points["instance_id"].astype(np.int64)
    seen = set(instance_id.tolist())
    boxes = []
    for thing in sample.scene.instances:
        kind = KINDS.get(thing.category)
        if kind is None or not thing.annotated or thing.instance_id not in seen:
            continue
        T = lidar.T_world_lidar.inverse() @ thing.box3d.T_frame_box
        centre_m = R_car_lidar @ np.asarray(T.translation_m)
        size_m = np.asarray(thing.box3d.size_m)
        R_car_box = R_car_lidar @ T.rotation()
        boxes.append(ObjectBox(kind, R_car_box, centre_m, size_m, thing.instance_id))
    return Scan(p_m, cloud.points["intensity"].astype(np.float64), instance_id, tuple(boxes))


def scans_of_kitti(folder: Path, n: int) -> Iterator[Scan]:
    """Scans of the first ``n`` frames of a folder in KITTI's object format."""
    for path in sorted((folder / "velodyne").glob("*.bin"))[:n]:
        rows = np.fromfile(path, "<f4").reshape(-1, 4).astype(np.float64)
        matrices = _read_matrices(folder / "calib" / f"{path.stem}.txt")
        R0, Tr = matrices["R0_rect"].reshape(3, 3), matrices["Tr_velo_to_cam"].reshape(3, 4)
        labels = (folder / "label_2" / f"{path.stem}.txt").read_text().splitlines()
        found = (_kitti_box(line.split(), R0 @ Tr[:, :3], R0 @ Tr[:, 3]) for line in labels)
        boxes = tuple(box for box in found if box is not None)
        yield Scan(rows[:, :3], rows[:, 3], np.zeros(len(rows), np.int64), boxes)


def _read_matrices(path: Path) -> Mapping[str, Float64]:
    lines = (line.partition(":") for line in path.read_text().splitlines())
    return {name: np.array(rest.split(), np.float64) for name, _, rest in lines if rest.strip()}


def _kitti_box(fields: list[str], R_cam_velo: Float64, t_cam_velo: Float64) -> ObjectBox | None:
    """The box of a line of ``label_2`` in the scanner's frame; None for other objects."""
    kind = KINDS.get(fields[0].lower())
    if kind is None:
        return None
    height, width, length, x, y, z, heading = (float(v) for v in fields[8:15])
    c, s = math.cos(heading), math.sin(heading)
    # The box's axes (ahead, left, up) as columns, in the camera's frame: y points down.
    R_cam_box = np.array([[c, s, 0.0], [0.0, 0.0, -1.0], [-s, c, 0.0]])
    centre = np.array([x, y - 0.5 * height, z]) - t_cam_velo
    size_m = np.array([length, width, height])
    return ObjectBox(kind, R_cam_velo.T @ R_cam_box, R_cam_velo.T @ centre, size_m)


@dataclass(frozen=True, eq=False, slots=True)
class ObjectFigures:
    """Figures of one object: points in its box, its own points, and mean reflectance in the box."""

    kind: str
    range_m: float
    points: int
    own: int
    reflectance: float


@dataclass(frozen=True, eq=False, slots=True)
class ScanFigures:
    """Figures of one scan."""

    seen: Directions
    reflectance: Float64
    cells: float
    residuals_m: Float64
    ground: Float64
    objects: tuple[ObjectFigures, ...]


def measure(scan: Scan) -> ScanFigures:
    """Figures of one scan."""
    ground, residuals_m = _ground(scan.p_m)
    seen = Directions.of(scan.p_m)
    objects = []
    for box in scan.boxes:
        inside = box.holds(scan.p_m)
        if inside.any() and box.counts(seen):
            mean = float(scan.reflectance[inside].mean())
            own = int((scan.instance_id == box.instance_id).sum()) if box.instance_id else 0
            found = ObjectFigures(box.kind, box.range_m, int(inside.sum()), own, mean)
            objects.append(found)
    return ScanFigures(
        seen,
        scan.reflectance,
        _share_of_cells(seen),
        residuals_m,
        scan.reflectance[ground],
        tuple(objects),
    )


def _share_of_cells(seen: Directions) -> float:
    row = np.floor((3.0 - seen.up_deg) / 28.0 * 64.0).astype(np.int64)
    column = np.floor((seen.azimuth_deg + 45.0) / 90.0 * 512.0).astype(np.int64)
    inside = (row >= 0) & (row < 64) & (column >= 0) & (column < 512)
    return len(np.unique(512 * row[inside] + column[inside])) / (64.0 * 512.0)


def _ground(p_m: Float64) -> tuple[NDArray[np.intp], Float64]:
    """Indices of points of the ground, and their distances to its planes [m]."""
    away_m = np.hypot(p_m[:, 0], p_m[:, 1])
    low, high = GROUND_M
    near = np.flatnonzero((away_m > low) & (away_m < high))
    patch = np.floor(p_m[near, :2] / PATCH_M).astype(np.int64)
    _, number = np.unique(patch, axis=0, return_inverse=True)
    number = number.ravel()
    order = np.argsort(number, kind="stable")
    groups = np.split(near[order], np.flatnonzero(np.diff(number[order])) + 1)
    indices, residuals_m = [np.zeros(0, np.intp)], [np.zeros(0)]
    for group in groups:
        p = p_m[group]
        if len(group) < PATCH_POINTS or p[:, 2].max() > -GROUND_BELOW_M:
            continue
        design = np.column_stack([p[:, :2] - p[:, :2].mean(axis=0), np.ones(len(p))])
        plane, *_ = np.linalg.lstsq(design, p[:, 2], rcond=None)
        up = 1.0 / math.sqrt(1.0 + plane[0] ** 2 + plane[1] ** 2)
        away = (p[:, 2] - design @ plane) * up
        flat = np.abs(away) < GROUND_BAND_M
        indices.append(group[flat])
        residuals_m.append(away[flat])
    return np.concatenate(indices), np.concatenate(residuals_m)


POINTS_AT = tuple(
    (kind, range_m) for kind in ("car", "pedestrian", "cyclist") for range_m in (10.0, 20.0, 40.0)
)


def points_at(objects: Sequence[tuple[float, int]], range_m: float) -> tuple[float, float]:
    """Points on an object at a range, and the standard error as a share of it.

    By a power law through (range [m], points) of all objects; NaN below three with points.
    """
    seen = [pair for pair in objects if pair[1] > 0]
    if len(seen) < 3:
        return math.nan, math.nan
    r, n = np.log(np.array(seen, np.float64)).T
    away = r - r.mean()
    slope = float(away @ n / (away @ away))
    spread = float(np.sqrt(((n - n.mean() - slope * away) ** 2).sum() / (len(n) - 2)))
    ahead = math.log(range_m) - float(r.mean())
    error = spread * math.sqrt(1.0 / len(n) + ahead * ahead / float(away @ away))
    return math.exp(float(n.mean()) + slope * ahead), error


def summarise(scans: Sequence[ScanFigures]) -> dict[str, tuple[float, float, float]]:
    """Figures of all scans together, by the names of ``REAL``; NaN where there is no object.

    Each is a value, its standard error as a share of it, and the value by the objects' own points;
    the last two are NaN but for numbers of points.
    """
    range_m = np.concatenate([figures.seen.range_m for figures in scans])
    up_deg = np.concatenate([figures.seen.up_deg for figures in scans])
    reflectance = np.concatenate([figures.reflectance for figures in scans])
    ground = np.concatenate([figures.ground for figures in scans])
    residuals_m = np.concatenate([figures.residuals_m for figures in scans])
    objects = [thing for figures in scans for thing in figures.objects]

    def mean_of(kind: str) -> float:
        found = [(thing.points, thing.reflectance) for thing in objects if thing.kind == kind]
        if not found:
            return math.nan
        counts, means = np.array(found).T
        return float((counts * means).sum() / counts.sum())

    values = [
        len(range_m) / len(scans),
        float(np.mean([figures.cells for figures in scans])),
        1e3 * math.sqrt(float((residuals_m**2).mean())) if len(residuals_m) else math.nan,
        float(ground.mean()) if len(ground) else math.nan,
        float(ground.std()) if len(ground) else math.nan,
        float(reflectance.mean()),
        float(np.quantile(reflectance, 0.95)),
        float((reflectance == 0.0).mean()),
        mean_of("car"),
        mean_of("pedestrian"),
        mean_of("cyclist"),
    ]
    counted = []
    for kind, away_m in POINTS_AT:
        of_kind = [thing for thing in objects if thing.kind == kind]
        value, error = points_at([(thing.range_m, thing.points) for thing in of_kind], away_m)
        own, _ = points_at([(thing.range_m, thing.own) for thing in of_kind], away_m)
        counted.append((value, error, own))
    ends = [float(np.quantile(range_m, 0.999)), float(np.quantile(up_deg, HIGHEST))]
    rows = [(value, math.nan, math.nan) for value in values]
    rows += [*counted, *((value, math.nan, math.nan) for value in ends)]
    return dict(zip(REAL, rows, strict=True))


def main() -> None:
    """Print the table; the last column is the deviation from the real figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--config", default="kitti_rig.yaml")
    source.add_argument("--kitti", type=Path, help="folder with velodyne, label_2 and calib")
    parser.add_argument("--n", type=int, default=12, help="number of scenes, or of frames of KITTI")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="override; default: shared.weather=ClearNoon, as KITTI was recorded in dry weather",
    )
    arguments = parser.parse_args()
    if arguments.kitti is not None:
        scans = scans_of_kitti(arguments.kitti, arguments.n)
    else:
        overrides = arguments.set or ["shared.weather=ClearNoon"]
        found = scans_of_config(arguments.config, range(arguments.n), overrides)
        scans = (scan for scene in found for scan in scene)
    figures_of = [measure(scan) for scan in scans]
    figures = summarise(figures_of)
    kinds = [thing.kind for scan in figures_of for thing in scan.objects]
    seen = ", ".join(f"{kinds.count(kind)} {kind}s" for kind in ("car", "pedestrian", "cyclist"))
    print(f"{len(figures_of)} scans with {seen}")
    print(f"{'':32} {'real':>9} {'here':>9} {'':7} {'error':>6} {'own':>9}")
    for name, real in REAL.items():
        value, error, own = figures[name]
        more = "" if math.isnan(error) else f" {error:6.0%}"
        more += "" if math.isnan(own) else f" {own:9.4g}"
        print(f"{name:32} {real:9.4g} {value:9.4g} {value / real - 1.0:+7.0%}{more}")


if __name__ == "__main__":
    main()
