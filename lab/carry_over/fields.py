"""Fields of configurations that change a quantity: what to change where two sets differ."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from gen_data.lab.carry_over.differences import Direction, Row
from gen_data.lab.carry_over.statistics import WHOLE

if TYPE_CHECKING:
    from gen_data.assemble.config import Config

FIELDS_MAX = 3
"""Fields that are named for one row."""


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a kind of plug-in, or of ``labels``.

    Attributes:
        kind: ``randomizer``, ``sensor``, ``element`` or ``labels``.
        type: Of the plug-in; empty for ``labels``.
        path: Dotted path in it.
        sign: 1 = larger values of the field make the quantity larger, -1 = smaller, 0 = neither.
        needs: Field that must be set, too; empty = none.
        without: Field that takes the place of this one if it is set; empty = none.
        of_group: The plug-in draws objects of one group, whose classes alone it changes.
    """

    kind: str
    type: str
    path: str
    sign: int = 0
    needs: str = ""
    without: str = ""
    of_group: bool = False

    @property
    def name(self) -> str:
        """Place in a configuration, for plug-ins of any name."""
        return f"{self.kind} {self.type}: {self.path}".replace(" :", ":")


def _of_groups(kind: str, *rows: tuple[str, str, int]) -> tuple[Field, ...]:
    return tuple(Field(kind, type_, path, sign, of_group=True) for type_, path, sign in rows)


_NEARER = (
    Field("randomizer", "camera_pose", "distance_m", -1, without="fills"),
    Field("randomizer", "camera_pose", "fills", 1),
    Field("randomizer", "room_camera", "away_m", -1),
    Field("randomizer", "ceiling_camera", "below_m", 1),
    Field("randomizer", "drone_flight", "height_m", -1),
    Field("randomizer", "camera_on_lane", "near_m", -1),
)
_FARTHER = tuple(replace(field, sign=-field.sign) for field in _NEARER)
_LARGER = (
    *_NEARER,
    Field("randomizer", "camera_intrinsics", "hfov_deg", -1),
    Field("sensor", "rgb_camera", "hfov_deg", -1),
    Field("labels", "", "min_box_px", 1),
)
_OBJECTS = _of_groups(
    "randomizer",
    ("objects", "count", 1),
    ("lane_objects", "count", 1),
    ("lane_objects", "occupancy", 1),
    ("lane_objects", "gap_m", -1),
    ("furnish", "clutter", 1),
)
_SCALES = _of_groups("randomizer", ("objects", "scale", 1), ("lane_objects", "scale", 1))
_ASSETS = (
    *_of_groups("element", ("objects", "assets", 0), ("lane_objects", "assets", 0)),
    *_of_groups("randomizer", ("objects", "weights", 0), ("lane_objects", "weights", 0)),
)
_OFF_CENTER = (Field("randomizer", "camera_pose", "off_center", needs="fills"),)
_ELEVATION = (Field("randomizer", "camera_pose", "elevation_deg"),)
_BRIGHTER = (
    Field("sensor", "rgb_camera", "image_pipeline.exposure_compensation_ev", 1),
    Field("sensor", "rgb_camera", "image_pipeline.metered_mean", 1),
    Field("sensor", "rgb_camera", "ev100", -1),
    Field("randomizer", "exposure", "ev100", -1),
    Field("randomizer", "lighting", "illuminance_lux", 1),
    Field("randomizer", "environment", "luminance_cd_m2", 1),
    Field("randomizer", "weather", "preset"),
)
_DARKER = (
    Field("sensor", "rgb_camera", "image_pipeline.contrast", 1),
    *(replace(field, sign=-field.sign) for field in _BRIGHTER),
)
_ECHOES = (
    Field("sensor", "lidar", "window", 1),
    Field("sensor", "lidar", "model"),
    *_ASSETS,
)

FIELDS: Mapping[str, Sequence[Field]] = {
    "long side": (*_LARGER, *_SCALES),
    "height px": (*_LARGER, Field("sensor", "rgb_camera", "size_px", 1), *_SCALES),
    "width / height": (
        *_of_groups("randomizer", ("objects", "upright", 0), ("lane_objects", "yaw_deg", 0)),
        *_ELEVATION,
        *_ASSETS,
    ),
    "centre x": (
        *_OFF_CENTER,
        Field("randomizer", "camera_on_lane", "yaw_deg"),
        Field("sensor", "rgb_camera", "yaw_deg", needs="rig"),
        *_of_groups("randomizer", ("lane_objects", "lateral", 0)),
    ),
    "centre y": (
        *_OFF_CENTER,
        *_ELEVATION,
        Field("randomizer", "camera_on_lane", "pitch_deg", 1),
        Field("randomizer", "room_camera", "pitch_deg", 1),
        Field("randomizer", "drone_flight", "pitch_deg", 1),
        Field("sensor", "rgb_camera", "pitch_deg", 1, needs="rig"),
    ),
    "count": (*_OBJECTS, *_FARTHER),
    "area share": (*_OBJECTS, *_NEARER),
    "grey in box": _BRIGHTER,
    "dark in box": _DARKER,
    "grey": _BRIGHTER,
    "dark share": _DARKER,
    "occlusion": (*_OBJECTS, Field("randomizer", "distractors", "count", 1), *_ELEVATION),
    "truncation": (*_OFF_CENTER, *_NEARER),
    "distance m": (
        *_FARTHER,
        Field("labels", "", "min_box_px", -1),
        *_of_groups("randomizer", ("lane_objects", "roads", 0), ("lane_objects", "gap_m", 0)),
    ),
    "bottom m": (
        Field("randomizer", "relief", "grade"),
        Field("randomizer", "camera_on_lane", "height_m", 1),
        Field("sensor", "rgb_camera", "offset_m", needs="rig"),
    ),
    "height m": (*_SCALES, *_ASSETS),
    "width m": (*_SCALES, *_ASSETS),
    "length m": (*_SCALES, *_ASSETS),
    "points 5-15 m": _ECHOES,
    "points 15-30 m": _ECHOES,
    "points 30-60 m": _ECHOES,
}
"""By quantity; the most direct field first."""


def remedies(row: Row, config: Config | None, groups: Collection[str]) -> list[str]:
    """Changes of fields that bring our values closer to the real ones, the most direct first.

    Args:
        row: A row that differs.
        config: Our configuration; None = unknown.
        groups: Names of the groups that draw objects of the row's class; empty = unknown.
    """
    fields = FIELDS[row.quantity]
    named = [] if config is None else [*_in_use(fields, config, groups, row.label)]
    if not named:
        return [f"set {field.name}" for field in fields[:FIELDS_MAX]]
    return [f"{_verb(field, row.direction)} {place}" for field, place in named[:FIELDS_MAX]]


def _verb(field: Field, direction: Direction) -> str:
    if direction in ("wider", "narrower"):
        return "narrow" if direction == "wider" else "widen"
    if not field.sign:
        return "change"
    return "lower" if (direction == "larger") == (field.sign > 0) else "raise"


def _in_use(
    fields: Sequence[Field], config: Config, groups: Collection[str], label: str
) -> Iterator[tuple[Field, str]]:
    """Fields of the plug-ins of a configuration, with their paths as ``--set`` takes them."""
    probe = config.probes[0]
    used: Mapping[str, Sequence[Any]] = {
        "randomizer": probe.randomizers,
        "sensor": config.sensors,
        "element": probe.elements,
    }
    for field in fields:
        if field.kind == "labels":
            yield field, f"labels.{field.path}"
            continue
        for plugin in used[field.kind]:
            group = getattr(plugin, "group", "") or plugin.name
            is_of_class = not field.of_group or label == WHOLE or not groups or group in groups
            if plugin.type == field.type and is_of_class and _is_used(plugin, field):
                yield field, f"{field.kind}s.{plugin.name}.{field.path}"


def _is_used(plugin: Any, field: Field) -> bool:
    """Whether the plug-in has a value there; another field takes the place of one without."""
    if (field.needs and not getattr(plugin, field.needs)) or (
        field.without and getattr(plugin, field.without) is not None
    ):
        return False
    value = plugin
    for key in field.path.split("."):
        value = getattr(value, key, None)
    return value is not None
