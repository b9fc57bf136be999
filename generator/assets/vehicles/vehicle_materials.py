"""Material slots that all vehicles share, and their materials."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.assets.procedural.material_presets import hex_to_linear
from gen_data.generator.assets.procedural.variant_rng import VariantRng
from gen_data.generator.assets.vehicles import plates
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.se3 import Vec3


class VehicleSlot(IntEnum):
    """Index of a material in the result of ``materials``."""

    PAINT = 0
    GLASS = 1
    TRIM = 2
    UNDERBODY = 3
    TYRE = 4
    RIM = 5
    HEADLIGHT = 6
    TAILLIGHT = 7
    BRAKELIGHT = 8
    INDICATOR_LEFT = 9
    INDICATOR_RIGHT = 10
    PLATE = 11
    CHROME = 12
    SECOND_PAINT = 13
    SKIN = 14
    TOP = 15
    BOTTOM = 16
    SHOES = 17
    HELMET = 18


COLORS = load_table(__package__, "colors", tuple[str, ...])
SIDES = ((VehicleSlot.INDICATOR_LEFT, VehicleSlot.INDICATOR_RIGHT),)
"""Slots that a mirror image exchanges."""


def draw_paint(rng: VariantRng) -> Vec3:
    """Colour of a private car, linear RGB."""
    weights, codes = zip(*(row.split() for row in COLORS["cars"]), strict=True)
    shares = np.cumsum([float(weight) for weight in weights])
    index = int(np.searchsorted(shares, float(rng.random()), side="right"))
    return hex_to_linear(codes[min(index, len(codes) - 1)])


def materials(
    rng: VariantRng,
    paint: Vec3,
    second: Vec3 = (0.8, 0.8, 0.78),
    clothes: tuple[Vec3, ...] = (),
    plate_rows: int = 1,
) -> tuple[Material, ...]:
    """One material per slot; colours are linear RGB.

    Args:
        rng: Draws gloss, tint and licence plate.
        paint: Colour of the body.
        second: Colour of the load box, or a stripe.
        clothes: Skin, top, bottom, shoes and helmet of a rider.
        plate_rows: Of the licence plate.
    """
    tint = rng.between(0.015, 0.035)
    rim = rng.between(0.35, 0.75) if rng.random() < 0.75 else 0.04
    skin, top, bottom, shoes, helmet = clothes or ((0.4,) * 3,) * 5
    return (
        Material(paint, rng.between(0.15, 0.25), specular=0.6, role="paint"),
        Material((tint, 1.1 * tint, 1.15 * tint), 0.05, specular=0.8, role="glass"),
        Material((0.013, 0.013, 0.014), 0.5, specular=0.35, role="trim"),
        Material((0.008, 0.008, 0.008), 0.9, role="underbody"),
        Material((0.02, 0.02, 0.02), 0.85, role="tyre"),
        Material((rim, rim, 1.02 * rim), 0.3, 0.9, role="rim"),
        Material((0.62, 0.65, 0.68), 0.1, specular=0.9, role="headlight"),
        _lens((0.3, 0.008, 0.01), "taillight"),
        _lens((0.42, 0.012, 0.014), "brakelight"),
        _lens((0.72, 0.3, 0.05), "indicator_left"),
        _lens((0.72, 0.3, 0.05), "indicator_right"),
        _plate(rng, plate_rows),
        Material((0.75, 0.76, 0.77), 0.15, 1.0, role="chrome"),
        Material(second, 0.35, role="paint"),
        Material(skin, 0.5, role="skin"),
        Material(top, 0.85, role="top"),
        Material(bottom, 0.85, role="bottom"),
        Material(shoes, 0.6, role="shoes"),
        Material(helmet, 0.3, role="trim"),
    )


def _plate(rng: VariantRng, rows: int) -> Material:
    seed = int(rng.random() * plates.SEEDS)
    texture = plates.plate_id(seed, rows)
    return Material((0.9, 0.9, 0.9), 0.4, texture=texture, printed=True, role="plate")


def _lens(color: Vec3, role: str) -> Material:
    return Material(color, roughness=0.12, specular=0.7, role=role)
