"""Contact wires of tramways over the middle of a street.

Contact wires of 107 mm^2 are 12 mm thick; heights: assumed, 10 %. Frame: metres, Z up, X along the
road, origin on the ground in its middle.
"""

from itertools import pairwise

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural.material_presets import painted_material
from gen_data.content.procedural.patches import Patch
from gen_data.content.scenery import basic_shapes, tram_lines
from gen_data.content.scenery.clutter_shapes import bar, wire
from gen_data.core.errors import AssetError

WIRE_M = 5.5
"""Height of the contact wires."""
_RADIUS_M = 0.006


def contact_wires(
    *, span_m: float = 30.0, left_m: float = 6.5, right_m: float = 6.5, tracks_m: float = 1.7
) -> Solid:
    """One span of contact wires, held in its middle by a cross wire between two poles.

    Args:
        span_m: Length of the span.
        left_m: Distance of the left pole from the middle of the road.
        right_m: Distance of the right pole.
        tracks_m: Distance of each track's middle from it.

    Raises:
        AssetError: if a pole is not beyond its track.
    """
    if not 0.0 < tracks_m < min(left_m, right_m):
        raise AssetError(
            f"contact_wires: tracks_m={tracks_m:g} is not between 0 and {min(left_m, right_m):g}"
        )
    half = 0.5 * span_m
    # Flat enough that hangers of 0.3 m reach the contact wires.
    hung_m = WIRE_M + 0.3
    ends = [(0.0, -right_m, tram_lines.ANCHOR_M), (0.0, -tracks_m, hung_m), (0.0, tracks_m, hung_m),
            (0.0, left_m, tram_lines.ANCHOR_M)]  # fmt: skip
    parts: list[Patch] = [wire(a, b, _RADIUS_M) for a, b in pairwise(ends)]
    for y in (-tracks_m, tracks_m):
        parts.append(wire((-half, y, WIRE_M), (half, y, WIRE_M), _RADIUS_M))
        parts.append(bar((0.0, y, WIRE_M), (0.0, y, hung_m), 0.012, 4, 1))
        parts.append(bar((0.0, y - 0.35, hung_m), (0.0, y + 0.35, hung_m), 0.015, 4, 1))
    materials = (painted_material("#2b2724", 0.5), painted_material("#4a3a33", 0.6))
    sheet = np.array([[x, y, z] for x in (-half, half) for y in (-tracks_m, tracks_m)
                      for z in (WIRE_M, hung_m)])  # fmt: skip
    return basic_shapes.make_solid(parts, materials, [sheet])
