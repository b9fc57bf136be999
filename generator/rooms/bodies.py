"""Bodies of rooms in a scene: shells, pieces and their moving parts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from gen_data.assets.asset_ids import AssetId, ParameterValue
from gen_data.assets.families import declared
from gen_data.core.asset_types import Material
from gen_data.core.interfaces import AssetIndex
from gen_data.core.members import free_instance_ids
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.rooms import layout, rules
from gen_data.rooms.floor_plan import WALL_M, Opening, Room, direction, walls_of
from gen_data.rooms.outlook import Outlook

OUTSIDE = "outside"
LEADS_OUT = "leads_out"
"""Attribute of doors without a room behind them."""
_SPLASHBACK_M = (0.86, 1.45)
"""Edges of splashbacks: from behind worktops to the usual height of wall units."""
_BELOW_SILL_M = 0.03
_BLIND_M = 0.03
"""Depth of blinds, which hang in the reveals of windows."""


@dataclass(frozen=True, slots=True)
class Joint:
    """How a part moves on its piece.

    Attributes:
        keypoint: Where it hangs on the piece when it is closed.
        axis: Axis of the piece's frame about which it turns, or along which it slides.
        limit: Largest opening [rad or m]; turns are negative rotations about the axis.
    """

    keypoint: str
    kind: Literal["hinge", "slide"]
    axis: Literal["x", "y", "z"]
    limit: float


JOINTS: Mapping[str, Joint] = {
    "door": Joint("hinge", "hinge", "z", 1.7),
    "leaf": Joint("hinge", "hinge", "z", 1.57),
    "drawer": Joint("slide", "slide", "x", 0.28),
    "lid": Joint("lid", "hinge", "y", 1.95),
}
"""Joints by the last part of the names of bodies."""


@dataclass(frozen=True, slots=True)
class Looks:
    """Materials of a shell.

    Attributes:
        accent: Material of the wall of number ``accent_wall``; None = the material of the others.
        splashback: Material behind worktops; None = the wall's material.
        blind_drops: Share of each opening that a blind covers; 0, or none given, = no blind.
    """

    floor: Material
    walls: Material
    ceiling: Material
    door_style: int = 0
    blind_style: int = 0
    blind_drops: tuple[float, ...] = ()
    accent: Material | None = None
    accent_wall: int = 0
    splashback: Material | None = None

    def of_wall(self, wall: int) -> Material:
        """Material of one of the walls."""
        return self.accent if self.accent is not None and wall == self.accent_wall else self.walls


def part_pose(T_world_piece: SE3, at_m: Vec3, joint: Joint, opening: float) -> SE3:
    """``T_world_part`` of a part that is open by so much [rad or m]."""
    if joint.kind == "slide":
        return (T_world_piece @ SE3((at_m[0] + opening, at_m[1], at_m[2]))).rounded()
    half = -0.5 * opening
    c, s = math.cos(half), math.sin(half)
    turn = (c, 0.0, s, 0.0) if joint.axis == "y" else (c, 0.0, 0.0, s)
    return (T_world_piece @ SE3(at_m, turn)).rounded()


def keypoint_m(assets: AssetIndex, asset: str, name: str) -> Vec3 | None:
    """A keypoint of an asset; None if it has none of that name."""
    return next((k.position_m for k in assets.keypoints(asset) if k.name == name), None)


def find_splashback(room: Room, wall: int, pieces: Sequence[layout.Piece]) -> tuple[float, ...]:
    """The place of a wall's ``splashback``: behind its worktops, up to the lowest window there.

    Empty if there is no worktop.
    """
    c, s = direction(wall)
    x, y = room.center_m
    spans = []
    for piece in pieces:
        if (
            declared(piece.family, "worktop", False)
            and round(piece.yaw_rad / (0.5 * math.pi)) % 4 == wall
        ):
            px, py, *_, half = piece.footprint
            # The wall's X axis runs to the right as seen facing into the room.
            right = (px - x) * s - (py - y) * c
            spans.append((right - half, right + half))
    if not spans:
        return ()
    low, high = min(a for a, _ in spans), max(b for _, b in spans)
    top = min(
        (
            o.low_m - _BELOW_SILL_M
            for o in room.openings
            if o.wall == wall
            and low < -o.along_m + 0.5 * o.width_m
            and -o.along_m - 0.5 * o.width_m < high
        ),
        default=_SPLASHBACK_M[1],
    )
    edges = (low, high, _SPLASHBACK_M[0], min(top, _SPLASHBACK_M[1]))
    return tuple(round(edge, 4) for edge in edges)


def remove_room(scene: Scene, name: str) -> Scene:
    """The scene without the bodies and instances of a room element."""
    removed = {b.name for b in scene.bodies if b.name.partition("/")[0] == name}
    ids = {b.instance_id for b in scene.bodies if b.name in removed}
    return replace(
        scene,
        bodies=tuple(b for b in scene.bodies if b.name not in removed),
        instances=tuple(i for i in scene.instances if i.instance_id not in ids),
    )


@dataclass(frozen=True, slots=True)
class Part:
    """A part that moves on its piece.

    Attributes:
        name: Its name in ``JOINTS``.
        leads_out: Whether it is a door without a room behind it.
    """

    name: str
    asset: str
    leads_out: bool = False


class Builder:
    """Collects the bodies and instances of one room element."""

    def __init__(self, scene: Scene, assets: AssetIndex, name: str, *, annotated: bool) -> None:
        self._scene, self._assets, self._name, self._annotated = scene, assets, name, annotated
        self._bodies: list[Body] = []
        self._instances: list[Instance] = []
        self._ids = iter(free_instance_ids(scene, 4096))

    def scene(self) -> Scene:
        """The scene with everything that was added."""
        bodies, instances = tuple(self._bodies), tuple(self._instances)
        return replace(
            self._scene,
            bodies=(*self._scene.bodies, *bodies),
            instances=(*self._scene.instances, *instances),
        )

    def add(
        self,
        name: str,
        asset: str,
        pose: SE3,
        room: str,
        materials: tuple[Material, ...] = (),
        part: Part | None = None,
        *,
        group: str = "",
    ) -> None:
        """Add a body and its instance; with a part, two bodies of one instance."""
        number, pose = next(self._ids), pose.rounded()
        full = f"{self._name}/{name}"
        body = Body(full, asset, pose, instance_id=number, group=group, materials=materials)
        found = self._assets.get(asset)
        attributes: list[tuple[str, str]] = [("room", room)]
        if declared(asset, "vessel", False):
            attributes.append(("full", "1" if "contents" in dict(found.attributes) else "0"))
        if part is None:
            self._bodies.append(body)
        else:
            joint = JOINTS[part.name]
            at_m = keypoint_m(self._assets, asset, joint.keypoint)
            assert at_m is not None, f"{asset} has no keypoint {joint.keypoint}"
            closed = part_pose(pose, at_m, joint, 0.0)
            moving = replace(
                Body(f"{full}/{part.name}", part.asset, closed, instance_id=number, group=group),
                part_id=2,
            )
            self._bodies += [replace(body, part_id=1), moving]
            attributes.append(("open", "0"))
            if part.leads_out:
                attributes.append((LEADS_OUT, "1"))
        self._instances.append(
            Instance(
                number,
                full,
                found.category,
                0,
                asset,
                annotated=self._annotated or bool(group),
                parts=("body", part.name) if part else (),
                attributes=tuple(sorted(attributes)),
            )
        )

    def add_shells(
        self,
        rooms: Sequence[Room],
        looks: Mapping[str, Looks],
        pieces: Mapping[str, Sequence[layout.Piece]] | None = None,
    ) -> None:
        """Add floors, ceilings, walls, doors, windows and blinds.

        Args:
            rooms: The rooms.
            looks: Materials by name of the room.
            pieces: Furniture by name of the room; there are splashbacks behind worktops.
        """
        for room in rooms:
            self._add_shell(room, looks[room.name], (pieces or {}).get(room.name, ()))

    def add_outlook(self, outlook: Outlook) -> None:
        """Add the view from windows; it has no labels."""
        ground = Material((1.0, 1.0, 1.0), 1.0, texture=outlook.ground, texture_scale_m=3.0)
        name = f"{self._name}/{OUTSIDE}"
        at = SE3((0.0, 0.0, -outlook.ground_m))
        self._bodies.append(Body(name, OUTSIDE, at, collides=False, materials=(ground,)))
        for k, (asset, pose) in enumerate(outlook.things):
            self._bodies.append(Body(f"{name}_{k}", asset, pose, collides=False))

    def _add_shell(self, room: Room, looks: Looks, pieces: Sequence[layout.Piece]) -> None:
        x, y, z = room.size_m
        at, kind = room.center_m, room.kind
        base = room.name
        floor_at, top_at = SE3((*at, 0.0)), SE3((*at, z))
        self.add(
            f"{base}/floor", _id("floor", size_m=(x, y)), floor_at, kind, materials=(looks.floor,)
        )
        self.add(
            f"{base}/ceiling",
            _id("ceiling", size_m=(x, y)),
            top_at,
            kind,
            materials=(looks.ceiling,),
        )
        for wall, openings in walls_of(room):
            self._add_wall(room, wall, openings, looks, find_splashback(room, wall, pieces))
        for k, opening in enumerate(room.openings):
            if opening.framed:
                self._add_opening(room, k, opening, looks)

    def _add_wall(
        self,
        room: Room,
        wall: int,
        openings: tuple[Opening, ...],
        looks: Looks,
        splashback: tuple[float, ...],
    ) -> None:
        # A wall's X axis runs to the right as seen facing into the room.
        holes = [v for o in openings for v in (-o.along_m, o.width_m, o.low_m, o.high_m)]
        length = round(room.wall_length_m(wall) + 2 * WALL_M * (wall % 2), 4)
        parameters: dict[str, ParameterValue] = {"size_m": (length, room.size_m[2], WALL_M)}
        if holes:
            none = [0.0] * (4 * declared("wall", "openings_max") - len(holes))
            parameters["openings"] = (*holes, *none)
        if looks.splashback is not None and splashback:
            parameters["splashback"] = splashback
        pose = SE3.about_z(0.5 * math.pi * (wall - 1), (*room.at_wall(wall, 0.0, 0.0), 0.0))
        asset = _id("wall", **parameters)
        surface, skirting = looks.of_wall(wall), self._assets.materials(asset)[1]
        if not rules.find_room_type(room.kind, "").skirting:
            skirting = surface
        self.add(
            f"{room.name}/wall_{wall}",
            asset,
            pose,
            room.kind,
            materials=(surface, skirting, looks.splashback or surface),
        )

    def _add_opening(self, room: Room, k: int, opening: Opening, looks: Looks) -> None:
        yaw = 0.5 * math.pi * opening.wall
        shared = room.name in ("kitchen", "bathroom", "bedroom") and opening.kind == "door"
        depth = 2 * WALL_M if shared else WALL_M
        at = room.at_wall(opening.wall, opening.along_m, -0.5 * depth)
        pose = SE3.about_z(yaw, (*at, opening.low_m))
        width, height = opening.width_m, round(opening.high_m - opening.low_m, 4)
        name = f"{room.name}/{opening.kind}_{k}"
        if opening.kind == "window":
            panes = max(1, round(width / 0.75))
            asset = _id("window", size_m=(width, height, depth), panes=panes)
            self.add(name, asset, pose, room.kind)
            self._add_blind(room, k, opening, looks)
            return
        frame = _id("door_frame", size_m=(width, height, depth))
        leaf = _id(
            "door_leaf",
            size_m=(round(width - 0.06, 4), round(height - 0.03, 4)),
            style=looks.door_style,
        )
        part = Part("leaf", leaf, leads_out=not shared)
        self.add(name, frame, pose, room.kind, part=part)

    def _add_blind(self, room: Room, k: int, opening: Opening, looks: Looks) -> None:
        drop = looks.blind_drops[k] if k < len(looks.blind_drops) else 0.0
        if drop == 0.0:
            return
        at = room.at_wall(opening.wall, opening.along_m, -_BLIND_M)
        pose = SE3.about_z(0.5 * math.pi * opening.wall, (*at, opening.high_m))
        height = opening.high_m - opening.low_m
        size = (round(opening.width_m - 0.02, 4), round(drop * height, 4), _BLIND_M)
        asset = _id("blind", size_m=size, style=looks.blind_style)
        self.add(f"{room.name}/blind_{k}", asset, pose, room.kind)

    def add_pieces(
        self, room: Room, pieces: Sequence[layout.Piece], parts: Mapping[str, tuple[str, str]]
    ) -> None:
        """Add furniture and small objects.

        Args:
            room: The room that they are in.
            pieces: Where they are.
            parts: Name of the part and its family, by the family of the piece.
        """
        counts: dict[str, int] = {}
        for piece in pieces:
            number = counts[piece.family] = counts.get(piece.family, -1) + 1
            word = piece.family.replace("/", "_")
            part = None
            if piece.family in parts:
                kind, family = parts[piece.family]
                part = Part(kind, f"{family}?{piece.asset.partition('?')[2]}")
            self.add(
                f"{room.name}/{word}_{number}",
                piece.asset,
                piece.pose,
                room.kind,
                part=part,
                group=self._name,
            )


def _id(family: str, **parameters: ParameterValue) -> str:
    return str(AssetId(family, parameters))
