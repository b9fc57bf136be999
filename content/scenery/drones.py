"""Quadrotors: airframes with four rotors, and the camera that hangs below on a gimbal.

Frame: metres, X forward, Z up, origin on the ground below.
"""

import math

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import painted_material
from gen_data.content.procedural.surface_shapes import block
from gen_data.content.scenery.basic_shapes import make_solid, post, tube
from gen_data.core.variant_rng import variant_rng

PAINTS = ("#c9cbcd", "#2b2d30", "#e4e2dc", "#5a5f66")


def airframe(seed: int) -> Solid:
    """A folding quadrotor of 0.3 to 0.45 m between opposite rotors (assumed)."""
    rng = variant_rng("drone", seed)
    reach = 0.5 * rng.between(0.3, 0.45, "rotors_m")
    trunk = block((-0.11, -0.045, -0.03), (0.11, 0.045, 0.04), 0.012)
    parts = [trunk]
    for k in range(4):
        angle = math.pi * (0.25 + 0.5 * k)
        x, y = reach * math.cos(angle), reach * math.sin(angle)
        root = (0.07 * math.copysign(1.0, x), 0.03 * math.copysign(1.0, y), 0.01)
        parts.append(tube([root, (x, y, 0.015)], 0.009))
        parts.append(post(0.016, (0.0, 0.045), (x, y, 0.0), 12).painted(1))
        # Rotors at speed are a blur: a thin disc as the eye sees it is not drawn, blades are.
        blade = block((-0.09, -0.009, 0.047), (0.09, 0.009, 0.049))
        piece = blade.rotated("z", angle + rng.between(0.0, math.pi)).moved(x, y, 0.0).painted(1)
        parts.append(piece)
    paints = (painted_material(PAINTS[seed % len(PAINTS)], 0.4), painted_material("#1d1e20", 0.5))
    standing = [part.moved(0.0, 0.0, 0.03) for part in parts]
    return make_solid(standing, paints, [hulls.box((-reach, -reach, 0.0), (reach, reach, 0.08))])


def gimbal(seed: int) -> Solid:
    """A camera on its yoke, 0.05 m long; its lens ends at x = 0.025 m, 0.02 m above the ground."""
    grey = ("#1d1e20", "#3a3c40")[seed % 2]
    path = [(-0.01, 0.0, 0.035), (-0.01, 0.0, 0.08)]
    parts = [block((-0.025, -0.02, 0.0), (0.025, 0.02, 0.04), 0.005), tube(path, 0.006)]
    box = hulls.box((-0.025, -0.02, 0.0), (0.025, 0.02, 0.08))
    return make_solid(parts, (painted_material(grey, 0.4),), [box])
