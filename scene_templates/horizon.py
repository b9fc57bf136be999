"""The end of the view around a street: tree lines, forests, hills, towns and skylines."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from gen_data.assets.families import declared
from gen_data.config.base_model import NAME_PATTERN
from gen_data.core import errors, interfaces
from gen_data.core.scene import Body, Lane, Scene
from gen_data.core.se3 import SE3, Array
from gen_data.core.variant_rng import VariantRng, variant_rng
from gen_data.scene_templates.element import Element, parametric_id

HorizonKind = Literal["trees", "forest", "town", "skyline", "hills"]
Season = Literal["spring", "summer", "autumn", "winter"]

_FAR: dict[HorizonKind, float] = {
    "trees": 1.0, "forest": 1.5, "town": 1.4, "skyline": 3.0, "hills": 4.0,
}  # fmt: skip
"""Distance of each layer, as a multiple of ``distance_m``."""
_VARIANTS: dict[HorizonKind, int] = {"trees": 8, "forest": 6, "town": 8, "skyline": 8, "hills": 6}
_OUTWARD = 16
"""Directions in which outermost points are sought."""
_INSIDE_M = 0.01
"""Depth below which a point is not a corner of the outline, whatever rounding does."""
_SUNK_M: dict[HorizonKind, float] = {
    "trees": 0.12, "forest": 0.12, "town": 0.12, "skyline": 0.12, "hills": 1.0,
}  # fmt: skip
"""Pieces stand this far below z = 0: no gap shows under them."""


class Horizon(Element):
    """A ring of scenery around all roads that ends the view; background, without labels.

    Each kind is a layer of pieces that face the roads. The ring follows the convex outline of all
    lanes: no piece stands on a road.

    Attributes:
        kinds: Layers: rows of trees, forests, roofs of a town, skylines, hills with fields.
        distance_m: Distance of the layer ``trees`` from the nearest lane; towns stand 1.4 times,
            forests 1.5 times, skylines 3 times and hills 4 times as far away.
        coverage: Share of the ring that trees and forests occupy; through their gaps, farther
            layers are seen.
        season: Foliage.
        arcs_deg: Directions from the middle of the roads to fill, each (from, to),
            counter-clockwise from world +X; empty = all around.
        seed: Seed of the choice and the places of pieces.
    """

    type: Literal["horizon"] = "horizon"
    kinds: tuple[HorizonKind, ...] = Field(("trees", "hills"), min_length=1)
    distance_m: float = Field(70.0, ge=20, le=1000)
    coverage: float = Field(0.85, ge=0, le=1)
    season: Season = "summer"
    arcs_deg: tuple[tuple[float, float], ...] = ()
    seed: int = Field(0, ge=0, le=1_000_000)
    name: str = Field("horizon", pattern=NAME_PATTERN)

    @property
    def follows_others(self) -> bool:
        """True: it surrounds every road."""
        return True

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add a static body per piece; background has no instance."""
        if not scene.lanes:
            raise errors.ConfigError(
                f"elements.{self.name}: there is no lane to surround; expected a road, a junction "
                "or a road network among the elements"
            )
        hull = convex_outline(_lane_points(scene.lanes))
        for kind in dict.fromkeys(self.kinds):
            rng = variant_rng(f"horizon/{kind}", self.seed)
            bodies = []
            for number, place in enumerate(self._places(hull, kind, rng)):
                parameters: dict[str, str | int] = {"seed": int(rng.random() * _VARIANTS[kind])}
                if kind not in ("town", "skyline") and self.season != "summer":
                    parameters["season"] = self.season
                asset = parametric_id(f"horizon/{kind}", **parameters)
                front = assets.bounds_m(asset)[1][0]
                pose = place @ SE3((-front, 0.0, -_SUNK_M[kind]))
                bodies.append(Body(f"{self.name}/{kind}/{number}", asset, pose.rounded()))
            scene = replace(scene, bodies=(*scene.bodies, *bodies))
        return scene

    def _places(self, hull_m: Array, kind: HorizonKind, rng: VariantRng) -> list[SE3]:
        """Poses of the middles of the fronts of one layer's pieces; X towards the roads."""
        far_m = self.distance_m * _FAR[kind]
        outline = offset_outline(hull_m, far_m)
        steps = np.sqrt(((np.roll(outline, -1, axis=0) - outline) ** 2).sum(axis=1))
        perimeter = float(steps.sum())
        piece_m: float = declared(f"horizon/{kind}", "length_m")
        count = max(3, math.ceil(perimeter / (0.94 * piece_m)))
        start = np.concatenate([[0.0], np.cumsum(steps)])
        closed = np.concatenate([outline, outline[:1]])
        centre = (0.5 * (hull_m.min(axis=0) + hull_m.max(axis=0))).tolist()
        drawn = []
        for k in range(count):
            at = perimeter * (k + rng.between(-0.06, 0.06) + 0.5) / count
            kept = rng.chance(self.coverage) or kind in ("hills", "town", "skyline")
            back = rng.between(0.0, 0.12) * far_m
            drawn.append((at, back, rng.between(-0.08, 0.08), kept))
        at_m = np.array([at for at, _, _, _ in drawn])
        before, here, after = (
            [np.interp(a, start, closed[:, i]).tolist() for i in (0, 1)]
            for a in (np.maximum(at_m - 4.0, 0.0), at_m, np.minimum(at_m + 4.0, perimeter))
        )
        made = []
        for k, (_, back, turn, kept) in enumerate(drawn):
            # The outline runs counter-clockwise: outside is on its right.
            yaw = math.atan2(after[1][k] - before[1][k], after[0][k] - before[0][k]) + 0.5 * math.pi
            x, y = here[0][k] - back * math.cos(yaw), here[1][k] - back * math.sin(yaw)
            if kept and self._is_in_arc(x - centre[0], y - centre[1]):
                made.append(SE3.about_z(yaw + turn, (x, y, 0.0)))
        return made

    def _is_in_arc(self, x_m: float, y_m: float) -> bool:
        """Whether the direction of a place from the middle of the roads is to be filled."""
        if not self.arcs_deg:
            return True
        bearing = math.degrees(math.atan2(y_m, x_m))
        return any((bearing - low) % 360.0 <= (high - low) for low, high in self.arcs_deg)


def convex_outline(points_m: Array) -> Array:
    """Corners of the convex hull of points [n, 2], counter-clockwise, [k, 2].

    Source: Andrew, "Another efficient algorithm for convex hulls in two dimensions", Information
    Processing Letters 9, 1979.
    """
    ordered = np.unique(_near_hull(np.round(points_m, 6)), axis=0).tolist()
    chains = [_half_hull(ordered), _half_hull(ordered[::-1])]
    return np.array([*chains[0][:-1], *chains[1][:-1]] or ordered)


def _near_hull(points_m: Array) -> Array:
    """The points but those well inside the polygon of the outermost ones in some directions.

    Most points of a street are inside; numpy leaves them out faster than Python visits them.
    Source: Akl and Toussaint, "A fast convex hull algorithm", Information Processing Letters 7,
    1978.
    """
    turn = 2.0 * math.pi * np.arange(_OUTWARD) / _OUTWARD
    x, y = points_m.T
    corners = [int((x * math.cos(a) + y * math.sin(a)).argmax()) for a in turn]
    inside = np.ones(len(points_m), np.bool_)
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        along_x, along_y = x[b] - x[a], y[b] - y[a]
        margin = _INSIDE_M * math.hypot(along_x, along_y)
        if margin > 0.0:
            inside &= along_x * (y - y[a]) - along_y * (x - x[a]) > margin
    return points_m[~inside] if len(set(corners)) > 2 else points_m


def _half_hull(ordered: Sequence[Sequence[float]]) -> list[Sequence[float]]:
    chain: list[Sequence[float]] = []
    for p in ordered:
        x, y = p
        while len(chain) > 1:
            (ax, ay), (bx, by) = chain[-2], chain[-1]
            # Twice the signed area of a triangle: positive for a turn to the left.
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                break
            chain.pop()
        chain.append(p)
    return chain


def offset_outline(hull_m: Array, distance_m: float) -> Array:
    """Points on the line at a distance around a convex hull [k, 2], counter-clockwise, [n, 2]."""
    turn = 2.0 * math.pi * np.arange(360) / 360
    outward = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    corner = (hull_m @ outward.T).argmax(axis=0)
    points: Array = hull_m[corner] + distance_m * outward
    return points


def _lane_points(lanes: Sequence[Lane]) -> Array:
    """Points of both borders of all lanes, [n, 2]."""
    points = [np.asarray(lane.center_m, dtype=np.float64)[:, :2] for lane in lanes]
    square = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    wide = [
        (p[:, None, :] + 0.5 * lane.width_m * square).reshape(-1, 2)
        for p, lane in zip(points, lanes, strict=True)
    ]
    return np.concatenate(wide)
