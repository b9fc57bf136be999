"""Marks of use on plain objects: tide lines in cups, cutlery marks, scratches, fingerprints.

The image multiplies a material's own colour: one image serves objects of every colour. There are
``STEPS`` of each kind, from new to well used, shared by all variants. Dimensions and shares are
assumed, within a half.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from gen_data.assets.family import Solid, check_option
from gen_data.content.procedural import wear as traces
from gen_data.content.procedural.wear import COARSE, FINE, MEDIUM, Film, Size
from gen_data.core.asset_types import Material, TextureData, UInt8
from gen_data.core.noise import SIZE_PX
from gen_data.core.variant_rng import VariantRng, variant_rng

STEPS = 12
# Below this step objects are as new.
_FIRST = 4
# Length of a repeat [m]; 0 = the mesh's own coordinates.
_SCALES_M = {"vessel": 0.0, "dish": 0.27, "metal": 0.13, "plastic": 0.16}
_TEA, _GREASE = (0.56, 0.38, 0.2), (0.45, 0.39, 0.31)
_PENCIL, _GOUGE = (0.42, 0.42, 0.43), (0.5, 0.49, 0.48)


def use(solid: Solid, name: str, seed: int, marks: Mapping[int | str, str]) -> Solid:
    """A variant's solid with marks on its plain metals, plastics and glazes.

    Args:
        solid: The solid as new.
        name: Its family.
        seed: Its variant, which draws how worn it is.
        marks: Kind of marks by slot, or by ``all`` for the others; metals have their own kind.
    """
    step = int(variant_rng(f"{name}/wear", seed).random() * STEPS)
    if step < _FIRST:
        return solid
    materials = [
        _marked(m, "metal" if m.metallic > 0.5 else marks.get(k, marks.get("all", "")), step)
        for k, m in enumerate(solid.mesh.materials)
    ]
    return replace(solid, mesh=replace(solid.mesh, materials=tuple(materials)))


def _marked(material: Material, kind: str, step: int) -> Material:
    """The material with marks; prints, glass, lamps and contents stay as they are."""
    m = material
    if not kind or m.texture or m.printed or m.role or m.transmission or any(m.emission_cd_m2):
        return material
    return replace(
        material,
        texture=f"texture/use_marks?kind={kind}&seed={step}",
        texture_scale_m=_SCALES_M[kind],
        roughness=round(traces.dulled(material.roughness, _wear(step)), 4),
    )


def _wear(step: int) -> float:
    """Wear of a step; equally likely steps have the distribution of ``wear.draw_wear``."""
    return traces.skewed((step % STEPS + 0.5) / STEPS)


def use_marks(seed: int, kind: str = "metal") -> TextureData:
    """Marks of one kind, more with the seed; 512 x 256 for vessels.

    Raises:
        AssetError: if there is no such kind.
    """
    check_option("use_marks", "kind", kind, tuple(_KINDS))
    wear, rng = _wear(seed), variant_rng(f"use_marks/{kind}", seed)
    size_px = (SIZE_PX // 2, SIZE_PX) if kind == "vessel" else (SIZE_PX, SIZE_PX)
    films, dull = _KINDS[kind](wear, size_px, rng)
    tone = traces.ramp_bytes(traces.noise_bytes(MEDIUM, size_px, rng), -20.0, 1.0)
    clean = np.repeat(tone[..., None], 3, axis=2)
    return TextureData(traces.lay_films(clean, films), traces.roughness_factor(dull, wear))


Marks = tuple[list[Film], UInt8]


def _vessel(wear: float, size_px: Size, rng: VariantRng) -> Marks:
    """Inside of a cup: v runs from the rim (0) to the middle of the floor (1)."""
    height, _ = size_px
    v = 1.0 - (np.arange(height, dtype=np.float32)[:, None] + 0.5) / height
    wander = traces.noise_bytes(COARSE, size_px, rng) / np.float32(255.0) - np.float32(0.5)
    broken = traces.noise_bytes(MEDIUM, size_px, rng) / np.float32(255.0)
    stained = np.zeros(size_px, np.float32)
    for _ in range(int(1 + 3 * wear)):
        level, wide = rng.between(0.14, 0.5), rng.between(0.006, 0.016)
        below = v - np.float32(level) + 0.02 * wander
        line = np.clip(1.0 - np.abs(below) / np.float32(wide), 0.0, 1.0)
        film = np.clip(below * 30.0, 0.0, 1.0) * np.float32(0.3)
        stained = np.maximum(stained, (line + film) * rng.between(0.3, 1.0))
    # The last liquid dries in the corner of the floor and in its middle.
    floor = np.clip((v - np.float32(0.72)) * 4.0, 0.0, 1.0) * (0.25 + 0.5 * broken)
    share = wear * np.maximum(stained * (0.3 + 0.9 * broken), floor)
    stirred = traces.scratches(int(50 * wear), 60.0, size_px, rng, 0.4)
    stirred = (stirred * (v > 0.6)).astype(np.uint8)
    scraped = traces.ramp_bytes(stirred, 0.0, 1.0, 0.3 * wear)
    tea = traces.to_bytes(np.float32(0.62) * share)
    return [Film(tea, _TEA), Film(scraped, _PENCIL)], np.maximum(tea, scraped)


def _dish(wear: float, size_px: Size, rng: VariantRng) -> Marks:
    """A plate: metal that cutlery left on the glaze, and dull places."""
    fine = traces.scratches(int(10 + 170 * wear), 60.0, size_px, rng, 1.0)
    marks = traces.ramp_bytes(fine, 0.1, 1.2, 0.12 + 0.35 * wear)
    noise = traces.noise_bytes(COARSE, size_px, rng)
    stain = traces.ramp_bytes(noise, 0.62, 0.95, 0.08 * wear)
    dull = np.maximum(marks, traces.ramp_bytes(noise, 0.75 - 0.4 * wear, 1.0))
    return [Film(stain, _TEA), Film(marks, _PENCIL)], dull


def _metal(wear: float, size_px: Size, rng: VariantRng) -> Marks:
    """Fine scratches, dried drops and fingerprints, mostly in the gloss."""
    fine = traces.scratches(int(30 + 420 * wear), 90.0, size_px, rng, rng.choose((0.25, 1.0)))
    drops = traces.noise_bytes(FINE, size_px, rng)
    spots = traces.ramp_bytes(drops, 0.68, 0.8, 0.5 * wear)
    prints = _fingerprints(int(1 + 7 * wear), _SCALES_M["metal"], size_px, rng)
    soiled = traces.ramp_bytes(traces.noise_bytes(COARSE, size_px, rng), 0.5, 0.95, 0.18 * wear)
    films = [Film(soiled, _GREASE), Film(traces.ramp_bytes(fine, 0.0, 1.0, 0.3 * wear), _GOUGE),
             Film(traces.ramp_bytes(prints, 0.0, 1.0, 0.12), _GREASE)]  # fmt: skip
    return films, np.maximum(np.maximum(fine, prints), np.maximum(spots, soiled))


def _plastic(wear: float, size_px: Size, rng: VariantRng) -> Marks:
    """Grease where hands hold it, scuffs and fingerprints."""
    held = traces.noise_bytes(COARSE, size_px, rng)
    # A film without edges: edges at this scale look like marble.
    soiled = traces.ramp_bytes(held, 0.2, 1.0, 0.16 * wear)
    specks = traces.ramp_bytes(traces.noise_bytes(FINE, size_px, rng), 0.8, 1.0, 0.15 * wear)
    fine = traces.scratches(int(6 + 90 * wear), 110.0, size_px, rng, 0.6)
    prints = _fingerprints(int(1 + 6 * wear), _SCALES_M["plastic"], size_px, rng)
    films = [Film(soiled, _GREASE), Film(specks, _GREASE),
             Film(traces.ramp_bytes(fine, 0.0, 1.0, 0.1 + 0.3 * wear), _GOUGE)]  # fmt: skip
    return films, np.maximum(np.maximum(soiled, fine), prints)


_KINDS: Mapping[str, Callable[[float, Size, VariantRng], Marks]] = {
    "vessel": _vessel,
    "dish": _dish,
    "metal": _metal,
    "plastic": _plastic,
}


def _fingerprints(count: int, scale_m: float, size_px: Size, rng: VariantRng) -> UInt8:
    """Ovals of curved ridges, 0.5 mm apart, on tips of 9 mm by 13 mm."""
    image = np.zeros(size_px, np.uint8)
    per_m = size_px[1] / scale_m
    reach = math.ceil(0.0075 * per_m)
    if 2 * reach + 1 >= min(size_px):
        return image
    at = np.arange(-reach, reach + 1) / per_m
    for _ in range(count):
        row, column = (int(rng.between(reach, n - reach - 1)) for n in size_px)
        turn, strength = rng.between(0.0, math.pi), rng.between(0.25, 0.8)
        x = at[None, :] * math.cos(turn) + at[:, None] * math.sin(turn)
        y = at[:, None] * math.cos(turn) - at[None, :] * math.sin(turn)
        inside = np.clip(3.0 - 3.0 * ((x / 0.0045) ** 2 + (y / 0.0065) ** 2), 0.0, 1.0)
        core = np.sqrt(x**2 + (0.6 * (y + 0.002)) ** 2)
        ridges = 0.5 + 0.5 * np.cos(2.0 * math.pi * core / 0.0005)
        mark = traces.to_bytes((strength * inside * ridges).astype(np.float32))
        window = (slice(row - reach, row + reach + 1), slice(column - reach, column + reach + 1))
        image[window] = np.maximum(image[window], mark)
    return image
