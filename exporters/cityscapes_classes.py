"""Classes of Cityscapes by category and surface; ``cityscapes_classes.yaml`` has the tables.

Reference: Cordts et al., "The Cityscapes Dataset for Semantic Urban Scene Understanding", CVPR
2016; names, ids and colours come from cityscapesscripts.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from gen_data.core.scene import Instance

UInt8 = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class CityClass:
    """A class of Cityscapes.

    Attributes:
        color: RGB.
        counted: Whether its objects have numbers in instance images.
    """

    name: str
    number: int
    color: tuple[int, int, int]
    counted: bool


@dataclass(frozen=True, slots=True)
class Classes:
    """The tables.

    Attributes:
        by_name: All classes, in the order of their numbers, from 0 without gaps.
        categories: Class by category.
        ridden: Class by category of two-wheelers with a rider.
        surfaces: Class by surface.
    """

    by_name: Mapping[str, CityClass]
    categories: Mapping[str, str]
    ridden: Mapping[str, str]
    surfaces: Mapping[str, str]

    @property
    def colors(self) -> UInt8:
        """RGB by number, uint8 [n, 3]."""
        return np.array([c.color for c in self.by_name.values()], np.uint8)

    def of_surface(self, surface: str) -> CityClass:
        """Class of a surface of the background; ``unlabeled`` for others."""
        return self.by_name[self.surfaces.get(surface, "unlabeled")]

    def of_instance(self, instance: Instance) -> CityClass:
        """Class of an object or of scenery."""
        category = "_".join(instance.category.lower().split())
        name = self.categories.get(category, "dynamic" if instance.annotated else "static")
        if dict(instance.attributes).get("rider") == "yes":
            name = self.ridden.get(category, name)
        return self.by_name[name]


@cache
def city_classes() -> Classes:
    """Read the tables, once."""
    text = files(__package__).joinpath("cityscapes_classes.yaml").read_text("utf-8")
    tables: dict[str, Any] = yaml.safe_load(text)
    by_name = {
        name: CityClass(name, number, tuple(color), counted)
        for name, number, color, counted in tables["classes"]
    }
    return Classes(by_name, tables["categories"], tables["ridden"], tables["surfaces"])
