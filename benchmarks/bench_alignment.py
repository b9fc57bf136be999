"""Grades and bends of streets next to real roads: ``python -m benchmarks.bench_alignment``.

Roads of ``--n`` scenes of ``street.yaml`` per group of districts, without objects, and published
figures of real networks. Grades are absolute, at each metre of road; bends are arcs with a radius
below 582 m (3 degrees in 100 ft), and the angles by which roads turn, per kilometre.

``--out FILE`` adds the table in Markdown to the end of a file.
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.assets.asset_ids import parse_asset_id
from gen_data.core.scene import Scene
from gen_data.roads.alignment import unpack
from gen_data.roads.cross_section import RoadShape

FILE = Path(__file__).with_name("alignment_figures.yaml")
Array = NDArray[np.float64]

TOWNS = (
    "{choice: {old_town: 2, residential: 3, leafy_suburb: 3, garden_villas: 1.5, arterial: 2.5, "
    "industrial: 1, campus: 1, park_edge: 1, village: 1.5}}"
)
GROUPS: Mapping[str, str] = {
    "built-up": TOWNS,
    "country road": "country_road",
    "motorway": "motorway",
}
SHARP_M = 582.0
EDGES = (0.03, 0.05, 0.08, 0.10)
ROWS = (
    "grade, median [%]", "grade, mean [%]", "below 3 %", "3 to 5 %", "5 to 8 %", "8 to 10 %",
    "10 % and more", "bends below 582 m per km", "turn per km [deg]",
)  # fmt: skip


@dataclass(frozen=True, eq=False, slots=True)
class Road:
    """A road of a scene.

    Attributes:
        grades: Absolute, at each metre.
        radii_m: Radii of its arcs.
        turn_deg: Sum of the angles by which it turns.
    """

    grades: Array
    radii_m: tuple[float, ...]
    turn_deg: float


def roads_of(scene: Scene) -> Iterator[Road]:
    """The roads of a scene, with their profiles on its relief."""
    profiles = scene.relief.roads if scene.relief else ()
    for body in scene.bodies:
        parsed = parse_asset_id(body.asset)
        if parsed.name != "road":
            continue
        names = {field.name for field in fields(RoadShape)}
        shape = RoadShape(**{k: v for k, v in parsed.parameters.items() if k in names})  # type: ignore[arg-type]
        x, y, _ = np.array(shape.line().poses(np.array([0.0, shape.length_m]))).T
        ends = body.T_world_body.apply(np.column_stack([x, y, 0.0 * x]))[:, :2]
        own = [
            profile for profile in profiles
            if np.hypot(*(ends - (profile.x_m, profile.y_m)).T).min() < 0.01
            and abs(profile.length_m - shape.length_m) < 0.01
        ]  # fmt: skip
        at = np.arange(0.5, shape.length_m)
        grades = [abs(own[0].slope(s)) for s in at] if own else 0.0 * at
        bends = list(unpack(shape.bends))
        turns = [abs(k) * (spiral + arc) for _, spiral, arc, k in bends]
        radii = tuple(1.0 / abs(k) for *_, k in bends)
        yield Road(np.array(grades), radii, float(np.degrees(sum(turns))))


def figures(roads: Sequence[Road]) -> dict[str, float]:
    """The rows of some roads."""
    grades = np.concatenate([road.grades for road in roads])
    km = 1e-3 * len(grades)
    cuts = np.searchsorted(np.sort(grades), EDGES) / len(grades)
    shares = np.diff([0.0, *cuts, 1.0])
    sharp = sum(radius < SHARP_M for road in roads for radius in road.radii_m)
    values = [
        100.0 * float(np.median(grades)), 100.0 * float(grades.mean()), *shares.tolist(),
        sharp / km, sum(road.turn_deg for road in roads) / km,
    ]  # fmt: skip
    return dict(zip(ROWS, values, strict=True))


def measure(group: str, n: int, overrides: Sequence[str]) -> dict[str, float]:
    """The rows of ``n`` scenes of a group of districts."""
    randomizers = load_config("street.yaml").resolved["randomizers"]
    names = [
        entry["name"] for entry in randomizers if entry["type"] not in ("relief", "camera_on_lane")
    ]
    config = load_config(
        "street.yaml", overrides=(f"shared.district={GROUPS[group]}", *overrides), without=names
    )
    with open_pipeline(config) as pipeline:
        return figures(
            [road for k in range(n) for road in roads_of(pipeline.accepted_scene(k).scene)]
        )


def main() -> None:
    """Print a table with a column per group and one per real network."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=400, help="scenes per group")
    parser.add_argument("--set", action="append", default=[], help="override one field")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    real: Mapping[str, Mapping[str, float]] = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    columns = {group: measure(group, given.n, given.set) for group in GROUPS} | dict(real)
    lines = ["| " + " | ".join(["", *columns]) + " |", "|---" * (len(columns) + 1) + "|"]
    for row in ROWS:
        values = (column.get(row, float("nan")) for column in columns.values())
        texts = ["-" if np.isnan(value) else f"{value:.3g}" for value in values]
        lines.append("| " + " | ".join([row, *texts]) + " |")
    text = "\n".join(lines) + "\n"
    print(text)
    if given.out is not None:
        with given.out.open("a", encoding="utf-8") as file:
            file.write(text)


if __name__ == "__main__":
    main()
