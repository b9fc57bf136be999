"""Traffic lights: lenses that are dark until they are lit by their role.

Lenses face +X, towards the traffic that they control. Lens diameters of 200 and 300 mm and
heights above the road follow EN 12368 and the German RiLSA.
"""

import math
from collections.abc import Sequence

import numpy as np

from gen_data.assets.family import Facts, Solid, choose_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import painted_material
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.scenery.basic_shapes import make_solid, post, tube
from gen_data.content.scenery.street_furniture import GALVANISED
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import variant_rng

MOUNTS = ("pole", "mast_arm")
HOUSING, POLE, BOARD = 0, 1, 2
_FIRST_LENS = 3
VEHICLE_LENSES = ("lens_red", "lens_yellow", "lens_green")
PEDESTRIAN_LENSES = ("lens_stop", "lens_walk")
FIGURES = load_table(__package__, "signal_figures", tuple[tuple[tuple[float, float], ...], ...])
_RED, _YELLOW, _GREEN = (0.09, 0.008, 0.006), (0.11, 0.06, 0.006), (0.006, 0.06, 0.035)
_OFF: dict[str, Vec3] = dict(zip(VEHICLE_LENSES, (_RED, _YELLOW, _GREEN), strict=True))
_OFF |= zip(PEDESTRIAN_LENSES, (_RED, _GREEN), strict=True)


def traffic_light(seed: int, mount: str) -> Solid:
    """A signal for vehicles, on a pole or also on an arm over the road.

    The arm reaches towards -Y: to the left of a driver who approaches the lenses.
    Slots: housing, pole, board, and one per lens by its role.

    Raises:
        AssetError: for an unknown mount.
    """
    rng = variant_rng("traffic_light", seed)
    arm = _choose_mount(seed, mount) == "mast_arm"
    lens_m = 0.15 if arm else rng.choose((0.1, 0.1, 0.15), "lens_m")
    low = head(VEHICLE_LENSES, 0.1 if arm else lens_m).moved(0.11, 0.0, rng.between(2.15, 2.5))
    radius = 0.09 if arm else 0.055
    top = rng.between(5.6, 6.2, "top_m") if arm else float(low.bounds_m()[1][2]) + 0.1
    parts = [low, post(radius, (0.0, top), sides=12).painted(POLE)]
    if arm:
        reach = rng.between(3.5, 5.5, "reach_m")
        path = [(0.0, 0.0, top - 0.1), (0.0, -0.6 * reach, top + 0.05), (0.0, -reach, top + 0.1)]
        high = head(VEHICLE_LENSES, lens_m)
        plate = _backboard(high)
        parts += [tube(path, 0.055, 8).painted(POLE)]
        parts += [part.moved(0.1, -reach + 0.25, top - 0.75) for part in (high, plate)]
    elif rng.chance(0.35):
        parts.append(_backboard(low))
    hull = hulls.frustum((radius, 0.0), (radius, top), 10)
    return make_solid(parts, _materials(VEHICLE_LENSES, rng.choose(("#262829", "#2f4236"))), [hull])


def traffic_light_facts(seed: int, mount: str) -> Facts:
    """Its kind and its mount."""
    return Facts("vehicle", {"mount": _choose_mount(seed, mount)})


def pedestrian_signal(seed: int) -> Solid:
    """A red and green signal for people, with a push button. Slots as above."""
    rng = variant_rng("pedestrian_signal", seed)
    signal = head(PEDESTRIAN_LENSES, 0.1).moved(0.11, 0.0, rng.between(2.1, 2.3, "height_m"))
    top = float(signal.bounds_m()[1][2]) + 0.1
    button = shapes.rounded_box((0.09, 0.11, 0.2), 0.02, 1).moved(0.06, 0.0, 1.05).painted(BOARD)
    parts = [signal, button, post(0.052, (0.0, top), sides=12).painted(POLE)]
    hull = hulls.frustum((0.052, 0.0), (0.052, top), 10)
    materials = list(_materials(PEDESTRIAN_LENSES, "#262829"))
    materials[BOARD] = painted_material("#d9a520", 0.5)
    return make_solid(parts, materials, [hull])


def head(lenses: Sequence[str], lens_m: float) -> Patch:
    """Chambers above one another, the first lens on top; the lowest edge at z = 0.

    Args:
        lenses: Roles, from top to bottom.
        lens_m: Radius of a lens.
    """
    cell, half, deep = 2.7 * lens_m, 1.4 * lens_m, 0.16
    parts = []
    for k, role in enumerate(lenses):
        z = cell * (len(lenses) - k - 0.5)
        chamber = shapes.rounded_box((deep, 2 * half, cell - 0.006), 0.025, 1).moved(0.0, 0.0, z)
        x = 0.5 * deep
        lens = _figure(lens_m, role) if role in FIGURES else _bulge(lens_m)
        visor = _visor(1.08 * lens_m, 1.7 * lens_m).moved(x - 0.002, 0.0, z)
        parts += [chamber, lens.moved(x, 0.0, z).painted(_FIRST_LENS + k), visor]
    return join_patches(parts)


def _bulge(radius: float) -> Patch:
    """A lens that curves out of its chamber."""
    profile = [(radius, 0.004), (0.8 * radius, 0.016), (0.45 * radius, 0.026), (0.0, 0.03)]
    return shapes.lathe(profile, 20).rotated("y", 0.5 * math.pi)


def _figure(radius: float, role: str) -> Patch:
    """The luminous figure of a signal for people: its head, and convex pieces of its body."""
    pieces = [shapes.circle(0.17, 12, (0.0, 0.62)), *(np.array(piece) for piece in FIGURES[role])]
    return join_patches(
        shapes.fan(np.column_stack([np.full(len(p), 0.006), radius * p])) for p in pieces
    )


def _visor(radius: float, reach: float) -> Patch:
    """A tube that is open below, cut back towards its lower ends."""
    turn = np.linspace(-0.2 * math.pi, 1.2 * math.pi, 15)
    y, z = radius * np.cos(turn), radius * np.sin(turn)
    tip = reach * (0.45 + 0.55 * np.clip(0.5 + z / radius, 0.0, 1.0))
    rows = [np.stack([0.0 * y, y, z], axis=1), np.stack([tip, y, z], axis=1)]
    return shapes.grid(np.stack(rows)).flipped()


def _backboard(signal: Patch) -> Patch:
    """A dark plate behind a head, wider than it: lenses stand out against the sky."""
    low, high = signal.bounds_m()
    x, (y0, z0), (y1, z1) = float(low[0]) - 0.012, low[1:] - 0.14, high[1:] + 0.14
    outer = shapes.block((x, y0, z0), (x + 0.01, y1, z1), slot=BOARD)
    inner = shapes.block((x + 0.003, y0 + 0.03, z0 + 0.03), (x + 0.013, y1 - 0.03, z1 - 0.03))
    return join_patches([outer, inner.painted(HOUSING)])


def _materials(lenses: Sequence[str], housing: str) -> tuple[Material, ...]:
    lit = (Material(_OFF[role], roughness=0.25, specular=0.5, role=role) for role in lenses)
    return (painted_material(housing, 0.5), GALVANISED, painted_material("#e9e8e3", 0.4), *lit)


def _choose_mount(seed: int, mount: str) -> str:
    # One variant in four has an arm.
    return choose_option("traffic_light", "mount", mount, MOUNTS, int(seed % 4 == 2))
