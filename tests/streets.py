"""Streets of which little but the traffic is left: quick to draw, make and render."""

from collections.abc import Sequence

from gen_data.assemble.config import Config, load_config

SCENERY = (
    "buildings", "back_row", "retaining_walls", "paths", "poles", "lamps", "trees", "fronts",
    "garden_cars", "garden_trees", "garden_plants", "back_trees", "weeds", "furniture", "signs",
    "bins", "cafes", "stalls", "billboards", "two_wheelers", "road_works", "scaffolds", "trailers",
    "trams", "waiting_cyclists", "belongings", "umbrellas",
)  # fmt: skip
"""Randomizers of ``street.yaml`` that place what stands beside the road."""
FEW = (
    "shared.district=residential",
    "shared.weather=CloudyNoon",
    "randomizers.parked.count=2",
    "randomizers.traffic.count=2",
    "randomizers.cyclists.count=1",
    "randomizers.people.count=2",
)


def thin_street(config: str, *overrides: str, without: Sequence[str] = ()) -> Config:
    """A shipped street with two parked cars, two cars in traffic, a cyclist and two people."""
    return load_config(config, overrides=(*FEW, *overrides), without=(*SCENERY, *without))


STRAIGHT = (
    "shared.district=residential", "shared.junction=none", "shared.course=straight",
    "shared.course_on=straight", "shared.landmark=none", "randomizers.parked.count=8",
    "randomizers.traffic.count=8", "randomizers.people.count=12",
)  # fmt: skip
HILLS = (
    "randomizers.relief.grade={uniform: [-0.12, 0.12]}",
    "randomizers.relief.side_slope={uniform: [-0.15, 0.15]}",
)
