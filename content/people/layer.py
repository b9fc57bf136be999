"""A layer over a body: zones of the template that form one sheet, and how it lies on them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from gen_data.content.people import body, edges
from gen_data.core.asset_types import Material

Profile = Sequence[tuple[float, float]]
"""(height in the template [m], distance from the body [m]), heights rising."""
Field = Callable[[body.Array], body.Array]
"""Function of positions in the template frame [n, 3]."""


@dataclass(frozen=True, eq=False, slots=True)
class Layer:
    """Zones of the template that form one sheet.

    Attributes:
        zones: Each zone and its material.
        profile: Distance of the sheet from the template.
        folds_m: Height of its wrinkles.
        waves_per_m: Frequency of the wrinkles.
        tapered: Whether the sheet's edge lies on the body (hair).
        smoothings: Number of smoothing passes: cloth spans hollows.
        mapped: Whether its materials have garment textures (``garment_layout``).
        layout: Texture coordinates [n, 2] of a sheet without seams; None = ``mapped`` decides.
        relief: Factor on the distance from the body; None = 1.
        keeps: Whether triangles with these middles are kept; None = all.
        tufts: Locks along its edge.
        collar: Strip along its neckline.
    """

    zones: tuple[tuple[str, Material], ...]
    profile: Profile = ((0.0, 0.0),)
    folds_m: float = 0.0
    waves_per_m: float = 6.0
    tapered: bool = False
    smoothings: int = 0
    mapped: bool = False
    layout: Field | None = None
    relief: Field | None = None
    keeps: Field | None = None
    tufts: edges.Tufts | None = None
    collar: edges.Collar | None = None
