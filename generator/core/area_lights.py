"""Area lights: panels and the visible fixtures that represent them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.photometry import luminance_cd_m2
from gen_data.generator.core.scene import PANEL_KINDS, Body, Light, Scene
from gen_data.generator.core.se3 import SE3, Vec3

GAP_M = 1e-3
"""Distance of a panel in front of its fixture, so that the fixture does not shadow it."""
LAMP = "lamp"
"""Role of the emissive slots of a fixture."""


def level_side(direction: Vec3) -> Vec3:
    """The horizontal unit vector perpendicular to a direction; X for vertical directions."""
    x, y, _ = direction
    level = math.hypot(x, y)
    if level < 1e-6:
        return (1.0, 0.0, 0.0)
    return (round(-y / level, 6), round(x / level, 6), 0.0)


def fixture_asset(light: Light) -> str:
    """Asset id of a panel's fixture."""
    if light.kind == "disk":
        diameter_m = round(2.0 * light.radius_m, 6)
        return f"light_panel?shape=disk&size_m={diameter_m:g},{diameter_m:g}"
    return f"light_panel?size_m={light.size_m[0]:g},{light.size_m[1]:g}"


def add_fixture(scene: Scene, light: Light, materials: Sequence[Material]) -> tuple[Scene, Light]:
    """Add the fixture of a panel to a scene; return the scene and the panel attached to it.

    The fixture is background: it has no instance and does not collide. ``materials`` are those of
    ``fixture_asset(light)``; slots with the role ``lamp`` become emissive.
    """
    z = -np.asarray(light.direction, dtype=np.float64)
    x = np.asarray(light.side if light.kind == "rectangle" else level_side(light.direction))
    x = x - z * float((x * z).sum())
    x = x / math.sqrt(float((x * x).sum()))
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    matrix[:3, 3] = np.asarray(light.position_m) + GAP_M * z
    red, green, blue = (round(c * luminance_cd_m2(light), 4) for c in light.color)
    emissive = tuple(
        replace(m, emission_cd_m2=(red, green, blue)) if m.role == LAMP else m for m in materials
    )
    pose = SE3.from_matrix(matrix).rounded()
    body = Body(light.name, fixture_asset(light), pose, collides=False, materials=emissive)
    return replace(scene, bodies=(*scene.bodies, body)), replace(light, body=light.name)


def remove_lights(scene: Scene) -> Scene:
    """The scene without lights and fixtures."""
    fixtures = {light.body for light in scene.lights if light.kind in PANEL_KINDS and light.body}
    bodies = tuple(b for b in scene.bodies if b.name not in fixtures or b.instance_id)
    return replace(scene, lights=(), bodies=bodies)
