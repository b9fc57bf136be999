"""Whether a point is in the open: inside the room, outside of every body."""

from __future__ import annotations

from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.se3 import SE3, Vec3


def is_inside(point_m: Vec3, low_m: Vec3, high_m: Vec3) -> bool:
    """Whether a point lies in an axis-aligned box."""
    return all(a <= p <= b for p, a, b in zip(point_m, low_m, high_m, strict=True))


def is_in_the_open(point_m: Vec3, scene: Scene, assets: AssetIndex, margin_m: float) -> bool:
    """Whether a point is inside the scene's interior and no nearer than ``margin_m`` to a body."""
    return is_inside(point_m, *scene.interior_m) and is_clear(point_m, scene, assets, margin_m)


def is_clear(point_m: Vec3, scene: Scene, assets: AssetIndex, margin_m: float) -> bool:
    """Whether a point is no nearer than ``margin_m`` to a body.

    Bodies count with their bounding boxes; the background (the room itself) does not, but for the
    fixtures of lights.
    """
    fixtures = {light.body for light in scene.lights}
    for body in scene.bodies:
        if body.instance_id == 0 and body.name not in fixtures:
            continue
        local = (body.T_world_body.inverse() @ SE3(point_m)).translation_m
        low, high = assets.bounds_m(body.asset)
        grown_low = tuple(body.scale * v - margin_m for v in low)
        grown_high = tuple(body.scale * v + margin_m for v in high)
        if all(a <= p <= b for p, a, b in zip(local, grown_low, grown_high, strict=True)):
            return False
    return True
