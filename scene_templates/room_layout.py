"""Rooms by rules: shells, which the randomizer ``furnish`` redraws and fills."""

from dataclasses import replace
from typing import Literal

from gen_data.core import interfaces, streams
from gen_data.core.scene import ObjectGroup, Scene
from gen_data.rooms import bodies, options
from gen_data.rooms.floor_plan import Room, draw_plan
from gen_data.rooms.rules import APARTMENT, find_room_type
from gen_data.scene_templates.element import Element

_IN_SHELLS = {"blind", "window"}
"""Assets of shells that the nominal room may lack."""


class RoomLayout(Element):
    """An empty room of a type, with floor, ceiling, walls, a door and windows.

    The randomizer ``furnish`` of the same ``room`` draws its size, openings and furniture.

    Attributes:
        kind: living_room, kitchen, bedroom, office, bathroom, workshop, warehouse, or apartment:
            living room, kitchen, bedroom and bathroom with doors between them.
        annotate: Whether to write labels for floor, ceiling, walls, doors and windows too.
    """

    type: Literal["room_layout"] = "room_layout"
    kind: str = "living_room"
    annotate: bool = True

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the shell, and the group of everything that may furnish it."""
        field = f"elements.{self.name}.kind"
        families = options.families_of(self.kind, field)
        rooms = _nominal_plan(self.kind, field)
        builder = bodies.Builder(scene, assets, self.name, annotated=self.annotate)
        looks = bodies.Looks(
            assets.materials("floor")[0],
            assets.materials("wall")[0],
            assets.materials("ceiling")[0],
        )
        builder.add_shells(rooms, {room.name: looks for room in rooms})
        scene = builder.scene()
        ids = sorted(
            {i for ids in options.find_options(assets, families).values() for i in ids} | _IN_SHELLS
        )
        group = ObjectGroup(self.name, (), tuple(ids), 0, "scatter")
        x, y, z = rooms[0].size_m
        (mx, my) = rooms[0].center_m
        low, high = (mx - x / 2, my - y / 2, 0.0), (mx + x / 2, my + y / 2, z)
        return replace(scene, groups=(*scene.groups, group), interior_m=(low, high))


def _nominal_plan(kind: str, field: str) -> tuple[Room, ...]:
    """Rooms of the middle of their ranges, the same at every call."""
    if kind == APARTMENT:
        rng = streams.Streams(seed=0, scene=0).rng("room_layout")
        return draw_plan(kind, ((9.4, 9.4), (7.8, 7.8), (2.6, 2.6)), rng, field)
    middle = [round(0.5 * (low + high), 2) for low, high in find_room_type(kind, field).size_m]
    fixed = (middle[0], middle[0]), (middle[1], middle[1]), (middle[2], middle[2])
    return draw_plan(kind, fixed, streams.Streams(seed=0, scene=0).rng("room_layout"), field)
