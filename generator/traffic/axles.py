"""Axles of vehicles."""

from dataclasses import dataclass

from gen_data.core import interfaces, se3

_OVERHANG = 0.2
"""Overhang beyond either axle, as a fraction of the length, without wheel keypoints."""


@dataclass(frozen=True, slots=True)
class Axles:
    """Axles and extents of a vehicle.

    Attributes:
        T_body_rear: Frame on the ground below the middle of the rear axle, X forward, Z up.
        wheelbase_m: Distance between the axles.
        front_m, rear_m: Distances from the rear axle to the vehicle's front and rear ends.
        width_m: Overall width.
    """

    T_body_rear: se3.SE3
    wheelbase_m: float
    front_m: float
    rear_m: float
    width_m: float


def find_axles(assets: interfaces.AssetIndex, asset: str, scale: float) -> Axles:
    """Locate axles by the keypoints ``wheel_front...`` and ``wheel_rear...``, else by length."""
    (x0, y0, z0), (x1, y1, _) = assets.bounds_m(asset)
    points = assets.keypoints(asset)
    rear = [p.position_m[0] for p in points if p.name.startswith("wheel_rear")]
    front = [p.position_m[0] for p in points if p.name.startswith("wheel_front")]
    over = _OVERHANG * (x1 - x0)
    x_rear = sum(rear) / len(rear) if rear else x0 + over
    x_front = sum(front) / len(front) if front else x1 - over
    place = se3.SE3((scale * x_rear, scale * 0.5 * (y0 + y1), scale * z0)).rounded()
    sizes = (scale * v for v in (x_front - x_rear, x1 - x_rear, x_rear - x0, y1 - y0))
    return Axles(place, *sizes)
