"""Sizes of real street clutter, and the triangles that a street affords for each piece."""

from typing import NamedTuple

Range = tuple[float, float]


class Limits(NamedTuple):
    """Ranges of the extents [m], where the front is at +X, and the largest number of triangles."""

    length_m: Range
    width_m: Range
    height_m: Range
    variants: int
    triangles: int = 3000


CLUTTER = {
    "fence": Limits((0.03, 0.25), (1.99, 2.02), (0.8, 1.9), 12),
    "garden_wall": Limits((0.2, 0.6), (1.99, 2.02), (0.6, 1.9), 6),
    "retaining_wall": Limits((2.0, 6.0), (2.99, 3.01), (0.55, 2.9), 15),
    "utility_pole": Limits((34.9, 35.1), (1.85, 1.95), (8.8, 10.0), 4),
    "power_box": Limits((0.2, 1.9), (0.4, 2.7), (0.9, 2.2), 6),
    "wheelie_bin": Limits((0.5, 1.8), (0.45, 1.5), (0.9, 2.3), 6),
    "rubbish_bags": Limits((0.4, 1.8), (0.4, 1.8), (0.35, 1.1), 6),
    "skip_container": Limits((1.8, 2.2), (3.2, 4.0), (1.1, 2.2), 4),
    "traffic_cone": Limits((0.2, 1.1), (0.2, 1.1), (0.2, 1.2), 6),
    "road_barrier": Limits((0.35, 0.9), (1.1, 2.6), (0.75, 1.5), 6),
    "construction_fence": Limits((0.6, 0.75), (3.4, 3.6), (1.9, 2.1), 4),
    "scaffold": Limits((0.7, 1.0), (2.5, 2.65), (6.5, 11.5), 4),
    # A row of three bicycles, each as detailed as one with a rider.
    "parked_bicycle": Limits((1.6, 2.0), (0.4, 2.1), (0.45, 1.25), 8, 8000),
    "kick_scooter": Limits((1.0, 1.2), (0.4, 1.3), (0.4, 1.25), 4),
    "trailer": Limits((3.2, 4.2), (1.4, 1.8), (0.8, 2.1), 4),
    "cafe_set": Limits((0.6, 3.1), (0.6, 3.1), (0.8, 2.9), 6),
    "parasol": Limits((0.6, 4.1), (0.6, 4.1), (2.6, 2.9), 6),
    "market_stall": Limits((2.0, 2.5), (2.4, 3.7), (2.4, 2.7), 4),
    "billboard": Limits((0.1, 0.7), (0.6, 3.8), (1.0, 6.0), 4),
    "advertising_column": Limits((1.3, 1.7), (1.3, 1.7), (3.0, 3.8), 3),
    "street_name_plate": Limits((0.05, 1.0), (0.7, 1.0), (2.4, 3.0), 4),
    "bus_shelter": Limits((1.4, 2.1), (3.0, 5.4), (2.6, 3.1), 4),
    "phone_box": Limits((0.6, 1.1), (0.8, 1.1), (2.0, 2.5), 3),
    "level_crossing_barrier": Limits((0.4, 0.6), (1.4, 6.8), (3.0, 6.5), 3),
    "petrol_canopy": Limits((6.9, 9.1), (10.9, 16.1), (5.3, 6.2), 2),
    "dog": Limits((0.25, 1.35), (0.12, 0.4), (0.24, 0.85), 12),
    "pram": Limits((0.85, 1.1), (0.45, 0.65), (0.95, 1.2), 4),
    "suitcase": Limits((0.2, 0.4), (0.25, 0.7), (0.35, 1.2), 5),
    "shopping_bags": Limits((0.1, 0.45), (0.2, 1.5), (0.3, 0.6), 4),
}
"""By family: ranges over all variants; sources stand in the families' own modules."""
