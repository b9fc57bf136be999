"""Driveways: asphalt that rises over a kerb and crosses a sidewalk.

Frame: metres, Z up, X away from the road, origin at the kerb's foot in the middle of the driveway.
"""

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural.patches import make_solid_in_place
from gen_data.content.roads import deck, road_materials
from gen_data.core.errors import AssetError

RAMP_M = 0.45
"""Length of the ramp before the kerb (assumed, 30 %)."""
_KERB_M, _PROUD_M, _FLANK_M = 0.2, 0.012, 0.25
"""Width of the kerb under the ramp's end; height of the asphalt over the covered surface; width of
the flanks [m]."""


def driveway(
    *,
    seed: int = 0,
    width_m: float = 6.0,
    depth_m: float = 2.5,
    kerb_m: float = 0.12,
    rise_m: float = 0.18,
) -> Solid:
    """A strip of asphalt across the kerb and the strip behind it, with sloping flanks.

    Args:
        seed: Seed of the asphalt.
        width_m: Width along the road, without the flanks.
        depth_m: Distance from the kerb's foot to the end.
        kerb_m: Height of the kerb over the gutter.
        rise_m: Height at the end over the gutter.

    Raises:
        AssetError: it ends on the kerb.
    """
    if depth_m <= _KERB_M:
        raise AssetError(f"driveway: depth_m={depth_m:g} is not above {_KERB_M:g}")
    x = np.array([-RAMP_M, 0.0, _KERB_M, depth_m])
    covered = np.array([0.0, 0.0, kerb_m, rise_m])
    crown = np.array([0.0, 0.75 * kerb_m, kerb_m, rise_m]) + _PROUD_M
    crown[0] = 0.002
    half = 0.5 * width_m
    y = np.array([-half - _FLANK_M, -half, half, half + _FLANK_M])
    plan = np.stack(np.meshgrid(x, y, indexing="ij"), axis=2)
    z = np.stack([covered, crown, crown, covered], axis=1)
    top = deck.surface(np.concatenate([plan, z[..., None]], axis=2), plan, "pavement", 0)
    slab = np.array([[a, b, c] for a in (-RAMP_M, depth_m) for b in (-half, half)
                     for c in (0.0, max(kerb_m, rise_m, _PROUD_M))])  # fmt: skip
    return make_solid_in_place([top], (road_materials.ground_material("asphalt", seed),), [slab])
