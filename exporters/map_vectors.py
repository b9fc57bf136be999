"""Vectors of the map around the ego, per frame, as detectors of vector maps (MapTR) learn them.

::

    <split>.jsonl              one line per sample
    <split>_map_anns.json      the same vectors as ground truth of MapTR's evaluation

A line has ``index``, ``scene``, ``view``, ``step``, ``time_s``, ``T_world_ego`` (4 x 4, level), and
``annotation`` with lists of lines, each n x 2 [m]:

* ``divider``: borders between driving lanes, of one or of opposite directions;
* ``ped_crossing``: outlines of crosswalks, closed;
* ``boundary``: outlines of carriageways, with the road to their right; exact, from kerb to kerb;
* ``centerline``: middles of driving lanes and of ways through junctions, in driving direction.

Lines are cut at the patch around the ego, ``patch_m`` long and wide, and joined where they meet.
Axes are the ego's, X forward, Y left; with ``axes: lidar`` nuScenes' scanner's, X right, Y
forward, as MapTR has them. Ground truth has ``sample_token``, the index with nine digits, and
``vectors`` with ``pts``, ``pts_num``, ``cls_name`` and ``type`` (0 divider, 1 ped_crossing,
2 boundary).

Reference: Liao et al., "MapTR: Structured Modeling and Learning for Online Vectorized HD Map
Construction", ICLR 2023, and the annotations that its map converter makes from nuScenes.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from gen_data.core.errors import ConfigError, did_you_mean, list_names
from gen_data.core.interfaces import AssetLibrary, DatasetInfo
from gen_data.core.lane_geometry import lane_borders
from gen_data.core.sample import Sample
from gen_data.core.scene import Lane, Scene
from gen_data.core.se3 import SE3, Array
from gen_data.exporters import base, fragments
from gen_data.exporters.conventions import SAMPLE, Conventions
from gen_data.exporters.road_map import Geometry, StreetExporter, drivable_areas, lane_area
from gen_data.exporters.sequences import write_json, write_text

CLASSES = ("divider", "ped_crossing", "boundary")
"""Classes of the evaluation, by ``type``."""
DECIMALS = 4
INSET_M = 0.2
"""Boundaries are cut this far inside the patch, so the patch's own edges are none."""
SHORT_M = 0.05
"""Shorter pieces of lines are left out."""


class MapVectors(StreetExporter):
    """Dividers, crosswalks, boundaries and centre lines around the ego, for MapTR and alike."""

    type: Literal["map_vectors"] = "map_vectors"
    conventions: ClassVar[Conventions] = Conventions(time=SAMPLE)
    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    rig: str = ""
    """Rig in the middle of the patch; empty = the first one."""
    patch_m: tuple[float, float] = (60.0, 30.0)
    """Length and width of the patch, along and across the ego."""
    axes: Literal["ego", "lidar"] = Field("ego")
    """Axes of the vectors: X forward, Y left, or X right, Y forward."""

    def check_scene(self, scene: Scene) -> None:
        """Reject scenes without a street or a rig.

        Raises:
            ConfigError: the text names the missing element.
        """
        super().check_scene(scene)
        self._ego(scene)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a line per sample. Raises ConfigError as ``check`` and ``check_scene`` do."""
        self.check(info)
        rows: dict[str, list[dict[str, Any]]] = {}
        latest: tuple[tuple[Lane, ...], dict[str, list[Geometry]]] | None = None
        for sample in samples:
            scene = sample.scene
            self.check_scene(scene)
            if latest is None or latest[0] != scene.lanes:
                latest = scene.lanes, world_lines(scene, self.library)
            T_world_ego = level_pose(scene.rig_pose(self._ego(scene)))
            row = {
                "index": sample.index,
                "scene": sample.scene_index,
                "view": sample.view_index,
                "step": sample.step_index,
                "time_s": scene.time_s,
                "T_world_ego": T_world_ego.matrix().tolist(),
                "annotation": self.vectors(latest[1], T_world_ego),
            }
            rows.setdefault(f"{sample.split}.images", []).append(row)
        fragments.write_fragments(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Join the lines of each split, and write the ground truth."""
        del info
        folders = [shard_dir / self.type for shard_dir in shard_dirs]
        for split, rows in fragments.split_rows(shard_dirs, self.type):
            lines = fragments.fragment_lines(folders, f"{split}.images")
            write_text(dataset_dir / f"{split}.jsonl", "".join(f"{line}\n" for line in lines))
            truth = {"GTs": [ground_truth(row) for _, row in rows]}
            write_json(dataset_dir / f"{split}_map_anns.json", truth)

    def vectors(
        self, lines: Mapping[str, Sequence[Geometry]], T_world_ego: SE3
    ) -> dict[str, list[list[list[float]]]]:
        """Lines of the world around the ego, by class; see the module."""
        import shapely
        from shapely import affinity

        length_m, width_m = self.patch_m
        patch = shapely.box(-0.5 * length_m, -0.5 * width_m, 0.5 * length_m, 0.5 * width_m)
        R, (x, y, _) = T_world_ego.rotation(), T_world_ego.translation_m
        c, s = float(R[0, 0]), float(R[1, 0])
        to_ego = (c, s, -s, c, -c * x - s * y, s * x - c * y)
        found: dict[str, list[list[list[float]]]] = {}
        for name, geometries in lines.items():
            here = [affinity.affine_transform(geometry, to_ego) for geometry in geometries]
            area = patch.buffer(-INSET_M, join_style="mitre") if name == "boundary" else patch
            cut = [geometry.intersection(area) for geometry in here if geometry.intersects(area)]
            found[name] = [self._points(line) for part in cut for line in _lines(part)]
        return found

    def _points(self, line: Array) -> list[list[float]]:
        if self.axes == "lidar":
            line = np.stack([-line[:, 1], line[:, 0]], axis=1)
        points: list[list[float]] = (np.round(line, DECIMALS) + 0.0).tolist()
        return points

    def _ego(self, scene: Scene) -> str:
        """Name of the rig. Raises ConfigError if there is none of that name."""
        known = [rig.name for rig in scene.rigs]
        name = self.rig or next(iter(known), "")
        if name not in known:
            raise ConfigError(
                f"exporter '{self.type}': there is no rig '{name}'; expected one of: "
                f"{list_names(known) or 'none; add an element ego'}{did_you_mean(name, known)}"
            )
        return name


def level_pose(pose: SE3) -> SE3:
    """The pose without roll and pitch: its X axis keeps its heading."""
    rotation = pose.rotation()
    yaw = math.atan2(float(rotation[1, 0]), float(rotation[0, 0]))
    return SE3.about_z(yaw, pose.translation_m).rounded()


def world_lines(scene: Scene, assets: AssetLibrary) -> dict[str, list[Geometry]]:
    """Lines and areas of the world by class: dividers, boundaries and centre lines are lines."""
    import shapely

    dividers = [np.asarray(border.points_m)[:, :2] for border in lane_borders(scene.lanes)
                if border.kind != "edge"]  # fmt: skip
    areas = drivable_areas(scene, assets)
    rings = [ring[::-1] for area in areas for ring in (area.exterior, *area.holes)]
    lanes = [lane for lane in scene.lanes if len(lane.center_m) > 1]
    driving = [lane for lane in lanes if lane.kind == "driving"]
    crosswalks = [lane for lane in lanes if lane.kind == "crosswalk"]
    return {
        "divider": _merged([shapely.LineString(line) for line in dividers]),
        "ped_crossing": [shapely.Polygon(lane_area([lane]).exterior) for lane in crosswalks],
        "boundary": [shapely.LinearRing(ring) for ring in rings],
        "centerline": [shapely.LineString(np.asarray(lane.center_m)[:, :2]) for lane in driving],
    }


def _merged(lines: Sequence[Geometry]) -> list[Geometry]:
    """Lines joined end to start."""
    import shapely

    joined = shapely.line_merge(shapely.MultiLineString(lines), directed=True)
    return list(getattr(joined, "geoms", [joined])) if lines else []


def _lines(geometry: Geometry) -> list[Array]:
    """Lines [n, 2] of a cut geometry; outlines of areas, closed."""
    import shapely

    parts = list(getattr(geometry, "geoms", [geometry]))
    areas = [np.asarray(p.exterior.coords) for p in parts if p.geom_type == "Polygon"]
    strings = [p for p in parts if p.geom_type in ("LineString", "LinearRing")]
    joined = _merged([shapely.LineString(p) for p in strings])
    return areas + [np.asarray(p.coords) for p in joined if p.length > SHORT_M]


def ground_truth(row: Mapping[str, Any]) -> dict[str, Any]:
    """Entry of a sample in the ground truth of the evaluation."""
    vectors = [
        {"pts": line, "pts_num": len(line), "cls_name": name, "type": number}
        for number, name in enumerate(CLASSES)
        for line in row["annotation"][name]
    ]
    return {"sample_token": f"{row['index']:09d}", "vectors": vectors}
