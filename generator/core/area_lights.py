"""Panels that shine: the light, and the body in which it is seen."""

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
"""A panel shines from this far before its fixture, which then does not shade it."""
LAMP = "lamp"
"""Role of the slots of a fixture that shine."""


def level_side(direction: Vec3) -> Vec3:
    """The level unit vector at right angles to a direction; along X for what looks up or down."""
    x, y, _ = direction
    level = math.hypot(x, y)
    if level < 1e-6:
        return (1.0, 0.0, 0.0)
    return (round(-y / level, 6), round(x / level, 6), 0.0)


def fixture_asset(light: Light) -> str:
    """Id of the fixture in which a panel is seen."""
    if light.kind == "disk":
        diameter_m = round(2.0 * light.radius_m, 6)
        return f"light_panel?shape=disk&size_m={diameter_m:g},{diameter_m:g}"
    return f"light_panel?size_m={light.size_m[0]:g},{light.size_m[1]:g}"


def add_fixture(scene: Scene, light: Light, materials: Sequence[Material]) -> tuple[Scene, Light]:
    """The scene with a body that shows a panel, and the panel as it moves with that body.

    The body is background: it has no instance, and nothing falls on it.

    Args:
        scene: Without it.
        light: Of kind rectangle or disk.
        materials: Of ``fixture_asset(light)``; the slots with the role ``lamp`` shine.
    """
    z = -np.asarray(light.direction, dtype=np.float64)
    x = np.asarray(light.side if light.kind == "rectangle" else level_side(light.direction))
    x = x - z * float((x * z).sum())
    x = x / math.sqrt(float((x * x).sum()))
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    matrix[:3, 3] = np.asarray(light.position_m) + GAP_M * z
    red, green, blue = (round(c * luminance_cd_m2(light), 4) for c in light.color)
    shining = tuple(
        replace(m, emission_cd_m2=(red, green, blue)) if m.role == LAMP else m for m in materials
    )
    pose = SE3.from_matrix(matrix).rounded()
    body = Body(light.name, fixture_asset(light), pose, collides=False, materials=shining)
    return replace(scene, bodies=(*scene.bodies, body)), replace(light, body=light.name)


def remove_lights(scene: Scene) -> Scene:
    """The scene without its lights, nor the fixtures of panels."""
    fixtures = {light.body for light in scene.lights if light.kind in PANEL_KINDS and light.body}
    bodies = tuple(b for b in scene.bodies if b.name not in fixtures or b.instance_id)
    return replace(scene, lights=(), bodies=bodies)
