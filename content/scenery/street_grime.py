"""Grime on street furniture: splashes at the foot, streaks below upper edges.

The image multiplies a material's own colour. Its coordinates depend on the position: v runs from
the ground to the top, u along X plus Y, once per ``_REPEAT_M``. Shares are assumed, within a half.
"""

from dataclasses import replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import wear as traces
from gen_data.content.procedural.place_coordinates import map_by_place
from gen_data.content.procedural.wear import COARSE, FINE, MEDIUM, Film
from gen_data.core.asset_types import Float32, Material, TextureData
from gen_data.core.variant_rng import variant_rng

STEPS = 8
# Below this step surfaces are as new.
_FIRST = 2
_SIZE_PX = (128, 256)
_REPEAT_M = 0.9
# Border of the image: coarse mip levels must not mix foot and top.
_MARGIN = 0.06
_SOOT, _MUD = (0.2, 0.19, 0.17), (0.36, 0.3, 0.22)


def soil(solid: Solid, name: str, seed: int) -> Solid:
    """A variant with the grime of its age on its plain materials."""
    step = int(variant_rng(f"{name}/wear", seed).random() * STEPS)
    plain = [k for k, m in enumerate(solid.mesh.materials) if _is_plain(m)]
    if step < _FIRST or not plain:
        return solid
    texture = f"texture/street_grime?seed={step}"
    materials = tuple(
        replace(m, texture=texture, roughness=traces.dulled(m.roughness, _wear(step)))
        if k in plain
        else m
        for k, m in enumerate(solid.mesh.materials)
    )
    top_m = solid.mesh.bounds_m()[1][2]

    def coordinates(points_m: Float32) -> Float32:
        x, y, z = points_m.T
        v = _MARGIN + (1.0 - 2.0 * _MARGIN) * np.clip(z / np.float32(top_m), 0.0, 1.0)
        return np.stack([(x + y) / np.float32(_REPEAT_M), v], axis=1).astype(np.float32)

    mesh = replace(solid.mesh, materials=materials)
    return replace(solid, mesh=map_by_place(mesh, plain, coordinates))


def _is_plain(m: Material) -> bool:
    return not (m.texture or m.printed or m.role or m.transmission or any(m.emission_cd_m2))


def _wear(step: int) -> float:
    return traces.skewed((step % STEPS + 0.5) / STEPS)


def street_grime(seed: int) -> TextureData:
    """Grime, more with the seed; 256 x 128."""
    wear, rng = _wear(seed), variant_rng("street_grime", seed)
    rows, _ = _SIZE_PX
    below = ((np.arange(rows, dtype=np.float32) + 0.5) / rows - _MARGIN) / (1.0 - 2.0 * _MARGIN)
    below = np.clip(below, 0.0, 1.0)[:, None]
    # A streak keeps its column; noise of one row determines its start and length.
    source = traces.noise_bytes(FINE, (1, _SIZE_PX[1]), rng) / np.float32(255.0)
    broad = traces.noise_bytes(MEDIUM, (1, _SIZE_PX[1]), rng) / np.float32(255.0)
    length = np.float32(0.15) + 0.7 * broad
    run = np.clip(1.0 - below / length, 0.0, 1.0) * np.clip(4.0 * (source - 0.5), 0.0, 1.0)
    uneven = traces.noise_bytes(COARSE, _SIZE_PX, rng) / np.float32(255.0)
    specks = traces.noise_bytes(MEDIUM, _SIZE_PX, rng) / np.float32(255.0)
    foot = np.exp((below - 1.0) / np.float32(0.11)) * (0.4 + 0.8 * specks)
    veil = 0.22 * np.clip(2.0 * uneven - 0.6, 0.0, 1.0)
    sooty = traces.to_bytes(np.float32(wear) * np.maximum(0.45 * run, veil))
    muddy = traces.to_bytes(np.float32(0.15 + 0.6 * wear) * foot)
    clean = np.full((*_SIZE_PX, 3), 252, np.uint8)
    albedo = traces.lay_films(clean, [Film(sooty, _SOOT), Film(muddy, _MUD)])
    return TextureData(albedo, traces.roughness_factor(np.maximum(sooty, muddy), wear))
