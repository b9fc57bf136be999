"""Wheels of all vehicles, and their wheel wells."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from gen_data.generator.assets.procedural.patches import Array, Patch, join_patches
from gen_data.generator.assets.procedural.surface_shapes import block, circle, fan, lathe
from gen_data.generator.assets.vehicles.body_shell import round_x_z, split_patch
from gen_data.generator.assets.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.generator.core.asset_types import Keypoint
from gen_data.generator.core.se3 import Vec3

_SEGMENTS = 18
_WELL_M = 0.32


def wheel(radius_m: float, width_m: float, spokes: int, rim_share: float = 0.68) -> Patch:
    """A wheel about the origin, its axle along Y and its outer face towards +Y."""
    half, rim = 0.5 * width_m, rim_share * radius_m
    tread = [(rim, -half), (radius_m, -0.85 * half), (radius_m, 0.75 * half),
             (0.965 * radius_m, 0.98 * half), (1.02 * rim, half)]  # fmt: skip
    lip = [(1.02 * rim, half), (0.9 * rim, 0.9 * half), (0.88 * rim, 0.2 * half)]
    back = [(0.9 * rim, 0.2 * half), (0.0, 0.2 * half)]
    hub = [(0.2 * rim, 0.2 * half), (0.19 * rim, 0.8 * half), (0.0, 0.84 * half)]
    parts = [
        lathe(tread, _SEGMENTS, Slot.TYRE),
        lathe(lip, _SEGMENTS, Slot.RIM),
        lathe(back, _SEGMENTS, Slot.UNDERBODY),
        lathe(hub, 10, Slot.RIM),
        *_spokes(rim, half, spokes),
    ]
    # A lathe's axle is Z: turned so that its top faces +Y, and a corner of the tread down.
    return join_patches(parts).rotated("z", 0.5 * math.pi).rotated("x", -0.5 * math.pi)


def _spokes(rim: float, half: float, count: int) -> list[Patch]:
    """Bars from the hub to the rim; none = a plate with a step, as steel wheels have."""
    if count == 0:
        plate = [(0.92 * rim, 0.55 * half), (0.62 * rim, 0.75 * half), (0.55 * rim, 0.45 * half),
                 (0.0, 0.45 * half)]  # fmt: skip
        return [lathe(plate, _SEGMENTS, Slot.RIM)]
    width = 1.25 * rim / (count + 1.5)
    bar = block((0.12 * rim, -0.5 * width, 0.45 * half), (0.92 * rim, 0.5 * width, 0.82 * half))
    # The lower face is never visible.
    up = np.cross(
        bar.corners_m[:, 1] - bar.corners_m[:, 0], bar.corners_m[:, 2] - bar.corners_m[:, 0]
    )
    kept = (up[:, 2] > -1e-12) & (np.abs(up[:, 0]) < 1e-12)
    seen = Patch(bar.corners_m[kept], bar.uvs[kept], bar.slots[kept]).painted(Slot.RIM)
    return [seen.rotated("z", 2 * math.pi * (k + 0.25) / count) for k in range(count)]


@dataclass(frozen=True)
class Axles:
    """Two axles with equal wheels.

    Attributes:
        front_m, rear_m: x of the axles.
        hub_y_m: y of the middle of a left wheel.
        radius_m: Of the wheels.
        tyre_m: Width of the tyres; twin tyres behind are as wide as two.
        arch_m: Radius of the wheel arches.
        spokes: 0 = steel wheels.
        twin: Whether the rear wheels are twins.
    """

    front_m: float
    rear_m: float
    hub_y_m: float
    radius_m: float
    tyre_m: float
    arch_m: float
    spokes: int
    twin: bool = False

    def wheels(self, steer_deg: float) -> Iterator[Patch]:
        """Four wheels; positive steering turns the front ones to the left."""
        made = wheel(self.radius_m, self.tyre_m, self.spokes)
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
