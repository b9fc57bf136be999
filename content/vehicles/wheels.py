"""Wheels of all vehicles, and their wheel wells."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.procedural.patches import Array, Patch, join_patches
from gen_data.content.procedural.surface_shapes import Point2, circle, fan, lathe
from gen_data.content.vehicles.body_shell import round_x_z, split_patch
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.core.asset_types import Keypoint
from gen_data.core.se3 import Vec3

_SEGMENTS = 18
_WELL_M = 0.32


@dataclass(frozen=True)
class WheelDesign:
    """Design of a wheel's face; shares are of the rim's radius.

    Attributes:
        kind: Single, paired, forked or twisted spokes; a cover with slots; a steel plate with
            holes.
        arms: Number of spokes or slots.
        width: Width of a spoke or slot.
        inner, outer: Radii between which spokes or slots extend.
        spread_deg: Angle from the axis of an arm to each of a pair, or between its ends.
        rim_share: Radius of the rim divided by the radius of the tyre.
    """

    kind: Literal["spokes", "twins", "forks", "twists", "cover", "plate"]
    arms: int
    width: float
    inner: float
    outer: float
    spread_deg: float
    rim_share: float


WHEELS = load_table(__package__, "wheel_designs", WheelDesign)


def wheel(radius_m: float, width_m: float, design: str) -> Patch:
    """A wheel about the origin, its axle along Y and its outer face towards +Y."""
    look = WHEELS[design]
    half, rim = 0.5 * width_m, look.rim_share * radius_m
    tread = [(rim, -half), (radius_m, -0.85 * half), (radius_m, 0.75 * half),
             (0.965 * radius_m, 0.98 * half), (1.02 * rim, half)]  # fmt: skip
    lip = [(1.02 * rim, half), (0.9 * rim, 0.9 * half), (0.88 * rim, 0.2 * half)]
    # Spokes stand in front of the brake disc.
    back = [(0.9 * rim, 0.2 * half), (0.62 * rim, 0.2 * half)]
    hub = [(0.2 * rim, 0.2 * half), (0.19 * rim, 0.8 * half), (0.0, 0.84 * half)]
    parts = [
        lathe(tread, _SEGMENTS, Slot.TYRE),
        lathe(lip, _SEGMENTS, Slot.RIM),
        lathe(back, _SEGMENTS, Slot.UNDERBODY),
        lathe([back[-1], (0.0, 0.2 * half)], 10, Slot.CHROME),
        lathe(hub, 10, Slot.RIM),
        *_face(look, rim, half),
    ]
    # A lathe's axle is Z: turned until its top faces +Y, and a corner of the tread faces down.
    return join_patches(parts).rotated("z", 0.5 * math.pi).rotated("x", -0.5 * math.pi)


def _face(look: WheelDesign, rim: float, half: float) -> list[Patch]:
    """Spokes, or a plate with dark slots."""
    if look.kind in ("cover", "plate"):
        step = [(0.92 * rim, 0.6 * half), (0.86 * rim, 0.82 * half), (0.3 * rim, 0.86 * half),
                (0.0, 0.84 * half)]  # fmt: skip
        if look.kind == "plate":
            step = [(0.92 * rim, 0.55 * half), (0.75 * rim, 0.7 * half), (0.6 * rim, 0.72 * half),
                    (0.52 * rim, 0.45 * half), (0.0, 0.45 * half)]  # fmt: skip
        top = 0.88 * half if look.kind == "cover" else 0.735 * half
        return [lathe(step, _SEGMENTS, Slot.RIM), *_arms(look, rim, (top, top), Slot.UNDERBODY)]
    return list(_arms(look, rim, (0.4 * half, 0.84 * half), Slot.RIM))


def _arms(look: WheelDesign, rim: float, heights_m: Point2, slot: int) -> Iterator[Patch]:
    """All spokes or slots, between two heights; equal ones give flat marks."""
    spread = math.radians(look.spread_deg)
    turns = {"twins": ((spread, spread), (-spread, -spread)),
             "forks": ((0.0, spread), (0.0, -spread)),
             "twists": ((-spread, spread),)}.get(look.kind, ((0.0, spread),))  # fmt: skip
    for k in range(look.arms):
        middle = 2.0 * math.pi * (k + 0.25) / look.arms
        for start, end in turns:
            ends = [
                share * rim * np.array([math.cos(middle + turn), math.sin(middle + turn)])
                for share, turn in ((look.inner, start), (look.outer, end))
            ]
            yield _arm(ends, 0.5 * look.width * rim, heights_m, slot)


def _arm(ends_m: list[Array], half_m: float, heights_m: Point2, slot: int) -> Patch:
    """A bar's top, lowered a little towards its outer end, and its sides."""
    along = ends_m[1] - ends_m[0]
    side = half_m * np.array([-along[1], along[0]]) / math.sqrt(float((along**2).sum()))
    # Narrower at the rim than at the hub.
    corners = [ends_m[0] - side, ends_m[1] - 0.8 * side, ends_m[1] + 0.8 * side, ends_m[0] + side]
    low, high = heights_m
    drop = 0.12 * (high - low)
    top = [(*corner, high - d) for corner, d in zip(corners, (0, drop, drop, 0), strict=True)]
    quads = [top]
    if high > low:
        base = [(*corner, low) for corner in corners]
        quads += [[base[k], base[k + 1], top[k + 1], top[k]] for k in (0, 2)]
    points = np.array(quads)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3, 3)
    return Patch(points, np.zeros((len(points), 3, 2)), np.full(len(points), slot, dtype=np.int64))


@dataclass(frozen=True)
class Axles:
    """Two axles with equal wheels.

    Attributes:
        front_m, rear_m: x of the axles.
        hub_y_m: y of the middle of a left wheel.
        radius_m: Radius of the wheels.
        tyre_m: Width of the tyres; twin tyres behind are as wide as two.
        arch_m: Radius of the wheel arches.
        design: Name of the wheels' design.
        twin: Whether the rear wheels are twins.
    """

    front_m: float
    rear_m: float
    hub_y_m: float
    radius_m: float
    tyre_m: float
    arch_m: float
    design: str = "steel"
    twin: bool = False

    def wheels(self, steer_deg: float) -> Iterator[Patch]:
        """Four wheels; positive steering turns the front ones to the left."""
        made = wheel(self.radius_m, self.tyre_m, self.design)
        inner = made.moved(y=-1.1 * self.tyre_m)
        for (x, steered), sign in product(
            ((self.front_m, True), (self.rear_m, False)), (1.0, -1.0)
        ):
            one = made if steered or not self.twin else join_patches([made, inner])
            side = one if sign > 0 else one.rotated("z", math.pi)
            turn = math.radians(steer_deg) if steered else 0.0
            yield side.rotated("z", turn).moved(x, sign * self.hub_y_m, self.radius_m)

    def wells(self, patch: Patch, half_m: float) -> tuple[Patch, list[Patch]]:
        """Cut wheel openings into a left half of a body; also return the wells behind them."""
        inner = half_m - _WELL_M
        made = []
        for x in (self.front_m, self.rear_m):
            hub = (x, self.radius_m)
            _, patch, edge = split_patch(patch, round_x_z(*hub, self.arch_m, inner))
            if len(edge):
                made.append(_well(edge, hub, self.arch_m, inner))
        return patch, made

    def keypoints(self, headlight_m: Vec3, taillight_m: Vec3) -> tuple[Keypoint, ...]:
        """Hubs and lamps; the left lamps are given."""
        hubs = {
            "wheel_front": ((self.front_m, self.hub_y_m, self.radius_m), 0.5 * self.tyre_m + 0.05),
            "wheel_rear": ((self.rear_m, self.hub_y_m, self.radius_m), 0.5 * self.tyre_m + 0.05),
            "headlight": (headlight_m, 0.2),
            "taillight": (taillight_m, 0.2),
        }
        return tuple(
            Keypoint(f"{name}_{side}", (x, sign * y, z), radius)
            for name, ((x, y, z), radius) in hubs.items()
            for side, sign in (("left", 1.0), ("right", -1.0))
        )


def _well(edge_m: Array, hub_m: tuple[float, float], radius_m: float, inner_y_m: float) -> Patch:
    """The inside of a wheel well behind an edge, as segments [n, 2, 3]; it faces the hub."""
    inner = edge_m.copy()
    inner[..., 1] = inner_y_m
    a, b, c, d = edge_m[:, 0], edge_m[:, 1], inner[:, 1], inner[:, 0]
    corners = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.array([hub_m[0], 0.0, hub_m[1]]) - corners.mean(axis=1)
    away = (normal[:, [0, 2]] * inward[:, [0, 2]]).sum(axis=1) < 0
    corners[away] = corners[away, ::-1]
    liner = Patch(corners, np.zeros((len(corners), 3, 2)), np.zeros(len(corners), dtype=np.int64))
    x, z = circle(radius_m, 14, hub_m).T
    wall = fan(np.stack([x, np.full_like(x, inner_y_m), np.maximum(z, 0.16)], axis=1)[::-1])
    return join_patches([liner, wall]).painted(Slot.UNDERBODY)
