"""Categories and attributes of nuScenes; ``nuscenes_classes.yaml`` has the tables.

Reference: Caesar et al., "nuScenes", CVPR 2020, and Fong et al., "Panoptic nuScenes", RA-L 2022;
names and indices come from the devkit's ``category.json`` with lidarseg.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
import yaml
from numpy.typing import NDArray

from gen_data.core.asset_types import SURFACES
from gen_data.core.scene import Body, Instance, Scene

MOVING_M_S = 0.1
"""Speed above which an object counts as moving."""
SEATED = frozenset({"sit", "sitting", "lie", "lying"})
WALKING = frozenset({"walk", "walking", "run", "running"})
"""Values of the attribute ``pose``."""
EGO, OTHER_THING, OTHER_GROUND = "vehicle.ego", "static.other", "flat.other"


@dataclass(frozen=True)
class Classes:
    """The tables of ``nuscenes_classes.yaml``.

    Attributes:
        categories: Name and description by index.
        attributes: Description by name.
        things: nuScenes category by ``category`` or ``category/subcategory``.
        surfaces: Category by surface.
        challenge: Categories of each class of the lidarseg challenge, from class 1.
    """

    categories: tuple[tuple[str, str], ...]
    attributes: Mapping[str, str]
    things: Mapping[str, str]
    surfaces: Mapping[str, str]
    challenge: tuple[tuple[str, ...], ...]

    def index(self, name: str) -> int:
        """Index of a category."""
        return next(k for k, (known, _) in enumerate(self.categories) if known == name)


@cache
def classes() -> Classes:
    """Read the tables."""
    text = files("gen_data.exporters").joinpath("nuscenes_classes.yaml").read_text("utf-8")
    tables = yaml.safe_load(text)
    categories = tuple((name, meaning) for name, meaning in tables["categories"])
    challenge = tuple(map(tuple, tables["challenge"]))
    return Classes(
        categories, tables["attributes"], tables["things"], tables["surfaces"], challenge
    )


def category_of(instance: Instance) -> str:
    """Category of an object."""
    things = classes().things
    finer = f"{instance.category}/{instance.subcategory}"
    return things.get(finer, things.get(instance.category, OTHER_THING))


def detectable_categories() -> tuple[str, ...]:
    """Our categories that become movable nuScenes objects, which have boxes."""
    named = classes().things.items()
    return tuple(ours for ours, theirs in named if "/" not in ours and theirs[:7] != "static.")


def attribute_of(category: str, instance: Instance, body: Body | None, scene: Scene) -> str:
    """Attribute of an object; empty if its category has none.

    Args:
        category: Result of ``category_of``.
        instance: The object at the scene's instant.
        body: The body whose frame it has; None if there is none.
        scene: Scene with its trajectories and groups.
    """
    facts = dict(instance.attributes)
    moves = math.hypot(*instance.twist.velocity_m_s) > MOVING_M_S
    tracked = body is not None and scene.track(body.name) is not None
    match category.split("."):
        case ["vehicle", "bicycle" | "motorcycle"]:
            ridden = facts.get("rider") == "yes" or instance.category in ("cyclist", "motorcyclist")
            return "cycle.with_rider" if ridden else "cycle.without_rider"
        case ["vehicle", *_]:
            if moves:
                return "vehicle.moving"
            return "vehicle.stopped" if _is_in_traffic(body, scene, tracked) else "vehicle.parked"
        case ["human", "pedestrian", "adult" | "child" | "construction_worker" | "police_officer"]:
            if facts.get("pose") in SEATED or instance.category == "person_sitting":
                return "pedestrian.sitting_lying_down"
            walks = moves or (not tracked and facts.get("pose") in WALKING)
            return "pedestrian.moving" if walks else "pedestrian.standing"
    return ""


def _is_in_traffic(body: Body | None, scene: Scene, tracked: bool) -> bool:
    """Whether a standing vehicle is not parked: by its lanes, else if it moves at other times."""
    group = next((g for g in scene.groups if body is not None and g.name == body.group), None)
    if group is None or not group.lanes:
        return tracked
    return "parking" not in group.lanes


def point_classes(
    points: NDArray[np.void], members: NDArray[np.int64], scene: Scene, ego_id: int
) -> NDArray[np.uint8]:
    """Label each point with the index of its category, uint8 [n].

    Args:
        points: Records of ``POINT`` [n].
        members: Instance of each point, 0 = none [n].
        scene: Scene with the instances.
        ego_id: Instance id of the ego vehicle; 0 = none.
    """
    grounds = [classes().surfaces.get(name, OTHER_GROUND) for name in SURFACES]
    of_surface = np.array([*map(_index, grounds)], np.uint8)
    top = max((i.instance_id for i in scene.instances), default=0)
    named = np.full(max(top, int(members.max(initial=0))) + 1, _index(OTHER_THING), np.uint8)
    for thing in scene.instances:
        named[thing.instance_id] = _index(category_of(thing))
    if ego_id:
        named[ego_id] = _index(EGO)
    labels: NDArray[np.uint8] = np.where(members > 0, named[members], of_surface[points["surface"]])
    return labels


@cache
def challenge_classes() -> NDArray[np.uint8]:
    """Class of the lidarseg challenge by category, uint8 [categories]; 0 = ignored there."""
    found = np.zeros(len(classes().categories), np.uint8)
    for number, names in enumerate(classes().challenge, 1):
        for name in names:
            found[_index(name)] = number
    return found


@cache
def _index(name: str) -> int:
    return classes().index(name)
