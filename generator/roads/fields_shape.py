"""Shape of fields next to a road: parcels of crops, with tracks between them."""

from dataclasses import dataclass

import numpy as np

from gen_data.core.se3 import Array
from gen_data.core.variant_rng import variant_rng
from gen_data.roads.alignment import bent_line
from gen_data.roads.reference_line import ReferenceLine

TRACK_M = 3.0


@dataclass(frozen=True, slots=True)
class Parcel:
    """A field between two arc lengths of its road.

    Attributes:
        start_m, end_m: Arc lengths.
        crop: A word of ``CROPS``.
        across: Whether rows run away from the road, with a headland in front.
    """

    start_m: float
    end_m: float
    crop: str
    across: bool


@dataclass(frozen=True, slots=True)
class FieldsShape:
    """Fields on one side of a road.

    Attributes:
        length_m, curvature_per_m, bends: The road's reference line.
        side: 1 = left, -1 = right.
        inner_m: Distance from the reference line to their edge.
        depth_m: Width across the road.
        crops: Words of ``CROPS`` to draw from, joined by underscores.
        seed: Seed of parcels and textures.
    """

    length_m: float = 150.0
    curvature_per_m: float = 0.0
    side: float = 1.0
    inner_m: float = 8.0
    depth_m: float = 80.0
    crops: str = "maize_wheat_meadow"
    seed: int = 0
    bends: tuple[float, ...] = ()

    def line(self) -> ReferenceLine:
        """Reference line of the road."""
        return bent_line(self.length_m, self.curvature_per_m, self.bends)

    def parcels(self) -> tuple[Parcel, ...]:
        """Parcels from the road's start to its end; tracks of 3 m or nothing lie between them."""
        rng = variant_rng(f"fields/{self.side:g}", self.seed)
        words = self.crops.split("_")
        made: list[Parcel] = []
        start = 0.0
        while start < self.length_m - 12.0:
            end = start + rng.between(40.0, 130.0)
            end = self.length_m if end > self.length_m - 25.0 else end
            others = [word for word in words if not made or word != made[-1].crop] or words
            made.append(Parcel(start, end, rng.choose(others), rng.chance(0.45)))
            start = end + (TRACK_M if rng.chance(0.5) else 0.0)
        return tuple(made)

    def points(self, s_m: Array, away_m: Array) -> Array:
        """Points [..., 2] at arc lengths and distances from the inner edge, outwards."""
        t = self.side * (self.inner_m + away_m)
        flat: Array = self.line().points(s_m.ravel(), np.broadcast_to(t, s_m.shape).ravel())
        return flat.reshape(*s_m.shape, 2)
