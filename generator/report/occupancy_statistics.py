"""Numbers of the voxels of a data set: by state and class, and how many of them are observed."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import SURFACES
from gen_data.core.sample import VOXEL_STATES, Occupancy
from gen_data.core.scene import Instance
from gen_data.report.report_tables import NOTHING, Table
from gen_data.runner.stored import StoredSamples

OTHER = "other"
"""Name of surfaces without a label and a name."""
SURFACE = VOXEL_STATES.index("surface")

Counts = NDArray[np.int64]


def observed_voxels(grid: Occupancy) -> NDArray[np.bool_]:
    """Voxels that any sensor observes, bool [x, y, z]."""
    seen = np.zeros(grid.state.shape, np.bool_)
    for mask in grid.observed.values():
        seen |= mask
    return seen


def grid_facts(grid: Occupancy) -> dict[str, Any]:
    """Facts about the grid of one sample: shape, voxels by state, observed ones with a surface."""
    surface = grid.state == SURFACE
    counts = np.bincount(grid.state.ravel(), minlength=len(VOXEL_STATES)).tolist()
    return {
        "shape": list(grid.state.shape),
        "voxel_m": grid.voxel_m,
        **dict(zip(VOXEL_STATES, counts, strict=True)),
        "observed_surface": int((observed_voxels(grid) & surface).sum()),
        "sensors": sorted(grid.observed),
    }


@dataclass
class OccupancyStatistics:
    """Counts of voxels in the grids of all samples.

    Attributes:
        grids: Number of grids.
        states: Voxels by state, int64 [3], of all (empty name), of the observed ones (``*``), and
            of the ones that each sensor observes, by its name.
        classes: Voxels with a surface, and observed ones, by category or else by surface.
    """

    grids: int = 0
    states: dict[str, Counts] = field(default_factory=dict)
    classes: dict[str, Counts] = field(default_factory=lambda: defaultdict(_pair))

    def add(self, grid: Occupancy, instances: Iterable[Instance]) -> None:
        """Count the voxels of a sample."""
        self.grids += 1
        seen = observed_voxels(grid)
        masks: Mapping[str, NDArray[np.bool_]] = {"*": seen, **grid.observed}
        self._count("", grid.state.ravel())
        for name, mask in masks.items():
            self._count(name, grid.state[mask])
        self._count_classes(grid, seen, instances)

    def _count(self, name: str, states: NDArray[np.uint8]) -> None:
        counts = np.bincount(states, minlength=len(VOXEL_STATES))
        self.states[name] = self.states.get(name, 0) + counts

    def _count_classes(
        self, grid: Occupancy, seen: NDArray[np.bool_], instances: Iterable[Instance]
    ) -> None:
        categories = {i.instance_id: i.category for i in instances if i.category_id}
        shown = grid.state == SURFACE
        kinds, labels = grid.surface[shown], grid.instance_id[shown]
        keys = labels.astype(np.int64) * 256 + kinds
        found, which, counts = np.unique(keys, return_inverse=True, return_counts=True)
        observed = np.bincount(which[seen[shown]], minlength=len(found))
        for key, *pair in zip(found.tolist(), counts.tolist(), observed.tolist(), strict=True):
            number, kind = divmod(key, 256)
            self.classes[categories.get(number) or SURFACES[kind] or OTHER] += pair

    def tables(self) -> tuple[Table, ...]:
        """A table of states and one of classes; none without grids."""
        if not self.grids:
            return ()
        sensors = sorted(set(self.states) - {"", "*"})
        rows = [
            (
                name,
                *_mean_and_share(self.states[""][number], self.states[""].sum(), self.grids),
                *(
                    _share(self.states[seen][number], self.states[""][number])
                    for seen in ("*", *sensors)
                ),
            )
            for number, name in enumerate(VOXEL_STATES)
        ]
        note = (
            "Means over samples. Observed: shares of the voxels of the row, by any or one sensor."
        )
        header = ("state", "voxels", "share", "observed", *sensors)
        ordered = sorted(self.classes.items(), key=lambda item: (-item[1][0], item[0]))
        surfaces = int(self.states[""][SURFACE])
        classes = [
            (name, *_mean_and_share(total, surfaces, self.grids), _share(seen, total))
            for name, (total, seen) in ordered
        ]
        return (
            Table("Occupancy", header, tuple(rows), note),
            Table(
                "Voxels with a surface",
                ("class or surface", "voxels", "share", "observed"),
                tuple(classes),
                "Means over samples; unlabelled surfaces by their kind.",
            ),
        )


def count_occupancy(stored: StoredSamples) -> OccupancyStatistics:
    """Counts of all samples of a data set; empty if the first one has no grid.

    Raises:
        StorageError: a file of a sample is missing or damaged.
    """
    found = OccupancyStatistics()
    for index in stored.indices:
        sample = stored.labelled(index)
        grid = None if sample.frame is None else sample.frame.occupancy
        if grid is None:
            break
        found.add(grid, sample.scene.instances)
    return found


def _pair() -> Counts:
    return np.zeros(2, np.int64)


def _mean_and_share(count: float, total: float, grids: int) -> tuple[str, str]:
    return f"{count / grids:.1f}", _share(count, total)


def _share(count: float, total: float) -> str:
    return f"{100.0 * count / total:.1f} %" if total else NOTHING
