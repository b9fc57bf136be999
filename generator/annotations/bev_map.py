"""Bird's-eye-view maps: masks of the ground around the ego vehicle."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.annotations.bev_raster import Grid, covered_cells, footprints, ribbon, strips
from gen_data.config.base_model import Strict
from gen_data.core import capture, errors, interfaces, lane_geometry, sample, se3
from gen_data.core.scene import Body, Instance, Scene
from gen_data.roads.carriageway import carriageways

LINE_PX = 1.5
"""Width of borders: wide enough that rasterised lines have no gaps."""
PEOPLE = frozenset({"pedestrian", "person"})


Layers = dict[str, NDArray[np.bool_]]
HEAD_M = 1.9
"""Objects that hang higher leave the floor below them free."""
FLAT_M = 0.03
"""Lower objects, such as rugs, are walked on."""


class BevMap(Strict):
    """Masks of the ground around the ego's rig, seen from above, its front up.

    ``drivable``: carriageways, parking strips and junctions; ``parking``, ``crosswalk``,
    ``sidewalk``: areas of those lanes; ``lane_divider``, ``road_divider``: borders between lanes of
    the same and of opposite directions; ``vehicles``, ``people``: footprints of the boxes of
    annotated instances, by their assets' tags; ``free_space``: drivable and unoccupied. The layers
    follow nuScenes' maps.

    In rooms the layers are ``floor``, ``wall``, ``door``, ``window``, ``occupied`` and
    ``free_space``: a two-dimensional occupancy map.

    Attributes:
        px_m: Side of a pixel.
        reach_m: Distance from the ego to the nearest edge of the map.
    """

    channels: ClassVar[frozenset[capture.Channel]] = frozenset()
    type: Literal["bev_map"] = "bev_map"
    px_m: float = Field(0.2, ge=0.02, le=5)
    reach_m: float = Field(40.0, ge=1, le=500)

    def annotate_frame(
        self, scenes: Mapping[str, Scene], assets: interfaces.AssetLibrary, truth: sample.EgoTruth
    ) -> sample.EgoTruth:
        """Fill in ``birdseye``. Raises ConfigError if the scene has no rig."""
        if not truth.rig:
            raise errors.ConfigError(
                "annotation 'bev_map': the scene has no rig to centre the map on; add an element"
                " 'ego' or 'carrier'"
            )
        scene = scenes[""]
        T_world_map = level_pose(truth.T_world_ego)
        grid = Grid(T_world_map, self.px_m, 2 * math.ceil(self.reach_m / self.px_m))
        layers = (
            _room_layers if any(i.category == "floor" for i in scene.instances) else _street_layers
        )
        own = scene.body(scene.rig(truth.rig).body).instance_id
        return replace(
            truth,
            birdseye=sample.BirdseyeMap(T_world_map, self.px_m, layers(grid, scene, assets, own)),
        )


def _street_layers(grid: Grid, scene: Scene, assets: interfaces.AssetLibrary, own: int) -> Layers:
    drivable = covered_cells(grid, carriageways(scene, assets))
    standing = [b for b in scene.bodies if b.instance_id not in (0, own)]
    kinds = {i.instance_id: frozenset(assets.get(i.asset).tags) for i in scene.instances}
    shown = [i for i in scene.instances if i.annotated]
    vehicles = [i for i in shown if "vehicle" in kinds[i.instance_id]]
    people = [i for i in shown if kinds[i.instance_id] & PEOPLE]
    return {
        "drivable": drivable,
        "parking": covered_cells(grid, _lanes(scene, "parking")),
        "crosswalk": covered_cells(grid, _lanes(scene, "crosswalk")),
        "sidewalk": covered_cells(grid, _lanes(scene, "sidewalk")),
        "lane_divider": covered_cells(grid, _borders(scene, "lane", LINE_PX * grid.cell_m)),
        "road_divider": covered_cells(grid, _borders(scene, "road", LINE_PX * grid.cell_m)),
        "vehicles": covered_cells(grid, _floors(vehicles)),
        "people": covered_cells(grid, _floors(people)),
        "free_space": drivable & ~covered_cells(grid, footprints(standing, assets)),
    }


def _room_layers(grid: Grid, scene: Scene, assets: interfaces.AssetLibrary, own: int) -> Layers:
    """Layers of rooms: an occupancy map, and the contents of walls.

    ``occupied`` is covered by furniture and objects whose lowest point is below ``HEAD_M``, rugs
    left out, or by open doors; ``free_space`` is the rest of the floor, and of doorways.
    """

    def outlines(category: str) -> NDArray[np.bool_]:
        ids = {i.instance_id for i in scene.instances if i.category == category}
        bodies = (b for b in scene.bodies if b.instance_id in ids and b.part_id < 2)
        return covered_cells(grid, footprints(bodies, assets))

    shell = {
        i.instance_id
        for i in scene.instances
        if i.category in ("floor", "ceiling", "wall", "window")
    }
    doors = {i.instance_id for i in scene.instances if i.category == "door"}
    standing = [
        b for b in scene.bodies
        if b.instance_id not in (0, own) and b.instance_id not in shell
        and not (b.instance_id in doors and b.part_id == 1)
        and _height_m(b, assets, 0) < HEAD_M and _height_m(b, assets, 1) > FLAT_M
    ]  # fmt: skip
    floor = outlines("floor")
    door = outlines("door")
    occupied = covered_cells(grid, footprints(standing, assets))
    return {
        "floor": floor,
        "wall": outlines("wall") & ~door,
        "door": door,
        "window": outlines("window"),
        "occupied": occupied,
        "free_space": (floor | door) & ~occupied,
    }


def _height_m(body: Body, assets: interfaces.AssetLibrary, corner: int) -> float:
    """Height of the lowest (0) or highest (1) point of an upright body."""
    return body.T_world_body.translation_m[2] + body.scale * assets.bounds_m(body.asset)[corner][2]


def level_pose(pose: se3.SE3) -> se3.SE3:
    """The pose with roll and pitch removed: the X axis keeps its heading.

    Only square roots are used: it has the same bits on every processor.
    """
    ahead = pose.rotate(np.array([1.0, 0.0, 0.0]))
    length = math.sqrt(float(ahead[0]) ** 2 + float(ahead[1]) ** 2)
    if length < 1e-6:
        return se3.SE3(pose.translation_m)
    c, s = float(ahead[0]) / length, float(ahead[1]) / length
    turn = (math.sqrt(0.5 * max(1.0 + c, 0.0)), math.sqrt(0.5 * max(1.0 - c, 0.0)))
    return se3.SE3(pose.translation_m, (turn[0], 0.0, 0.0, math.copysign(turn[1], s))).rounded()


def _lanes(scene: Scene, kind: str) -> se3.Array:
    return strips(lane for lane in scene.lanes if lane.kind == kind)


def _borders(scene: Scene, kind: str, width_m: float) -> se3.Array:
    """Triangles [n, 3, 3] of ribbons along borders of lanes."""
    parts = [np.zeros((0, 3, 3))]
    for border in lane_geometry.lane_borders(scene.lanes):
        if border.kind == kind:
            line = np.asarray(border.points_m)
            aside = 0.5 * width_m * lane_geometry.left_normals(line)
            parts.append(ribbon(line + aside, line - aside))
    return np.concatenate(parts)


def _floors(instances: list[Instance]) -> se3.Array:
    """Bottom faces of boxes, as triangles [n, 3, 3]."""
    parts = [np.zeros((0, 3, 3))]
    for instance in instances:
        corners = instance.box3d.corners()
        # Corners 0, 2, 4, 6 are the lower ones: (x-, y-), (x-, y+), (x+, y-), (x+, y+).
        parts.append(np.stack([corners[[0, 4, 6]], corners[[0, 6, 2]]]))
    return np.concatenate(parts)
