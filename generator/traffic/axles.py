"""Where a vehicle's axles are."""

from __future__ import annotations

from dataclasses import dataclass

from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.se3 import SE3

_OVERHANG = 0.2
"""Share of its length by which a vehicle of unknown wheels reaches over either axle."""


@dataclass(frozen=True, slots=True)
class Axles:
    """A vehicle on its wheels.

    Attributes:
        T_body_rear: On the ground below the middle of the rear axle, X forward, Z up.
        wheelbase_m: Between the axles.
        front_m, rear_m: From the rear axle to the vehicle's front and rear ends.
        width_m: Over everything.
    """

    T_body_rear: SE3
    wheelbase_m: float
    front_m: float
    rear_m: float
    width_m: float


def find_axles(assets: AssetIndex, asset: str, scale: float) -> Axles:
    """Axles by the keypoints ``wheel_front...`` and ``wheel_rear...``, else by the length."""
    (x0, y0, z0), (x1, y1, _) = assets.bounds_m(asset)
    points = assets.keypoints(asset)
    rear = [p.position_m[0] for p in points if p.name.startswith("wheel_rear")]
    front = [p.position_m[0] for p in points if p.name.startswith("wheel_front")]
    over = _OVERHANG * (x1 - x0)
    x_rear = sum(rear) / len(rear) if rear else x0 + over
    x_front = sum(front) / len(front) if front else x1 - over
    place = SE3((scale * x_rear, scale * 0.5 * (y0 + y1), scale * z0)).rounded()
    return Axles(
        place,
        scale * (x_front - x_rear),
        scale * (x1 - x_rear),
        scale * (x_rear - x0),
        scale * (y1 - y0),
    )
