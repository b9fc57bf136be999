"""Photographs dropped into the page as backgrounds of scenes: their entries and scenes.

A photograph contains neither the height of its camera nor the area where objects may stand. Both
have sliders; the picture of the check shows the resulting horizon and a grid on the ground.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gen_data.config.merging import node_name
from gen_data.config.yaml_tree import Node
from gen_data.core.errors import ConfigError
from gen_data.core.plates import Plate, ground_points
from gen_data.lab.edit import text_edits

HFOV_DEG = 65.0
"""Assumed along the longest edge without EXIF data: main cameras of phones, 28 mm equivalent."""
TILT_DEG = 30.0
"""Assumed where the photograph has no edges that show its horizon."""
SCENE = """\
# Objects on a photograph.
assets: {{folders: [{folder}]}}
elements:
  - {{type: plate, name: plate, photos: [{photo}]}}
  - type: objects
    name: clutter
    on: plate
    count: 4
    placement: scatter
    assets: {{ids: [mug, banana, apple, bowl]}}
randomizers:
  - {{type: plate, name: plate, photos: [{photo}]}}
  - {{type: objects, name: clutter, count: {{uniform_integer: [2, 6]}}}}
sensors:
  - {{type: plate_camera, name: color, size_px: [{width}, {height}]}}
annotations: [boxes2d, instance_masks, visibility]
exporters:
  - {{type: coco}}
"""
"""Text for an empty file."""
IMAGE_PX = 640
"""Longest edge of the images of that text."""
RENDERED = "rendered"
"""Tag of the photographs shipped with gen-data; a user's photograph replaces it."""


Corners = tuple[tuple[float, float], ...]


def rectangle(across: tuple[float, float], down: tuple[float, float]) -> Corners:
    """Corners of a part of a photograph: near left, far left, far right, near right."""
    (left, right), (top, bottom) = across, down
    return (left, bottom), (left, top), (right, top), (right, bottom)


GROUND = rectangle((0.1, 0.9), (0.45, 0.95))
"""Assumed ground; valid for most photographs of tables and roads."""
LEAST_GROUND = 0.1
"""Least height of a ground below the horizon, as a share of the photograph's."""
LOWEST_DEG = 3.0
"""Smallest angle of ground below the horizon, where distances grow without bound."""


@dataclass(frozen=True)
class Standpoint:
    """Facts about camera and ground that a photograph does not contain.

    Attributes:
        height_m: Height of the camera above the ground, which may be the top of a table.
        tilt_deg: Downward tilt; None = estimated from straight edges.
        hfov_deg: Horizontal field of view; None = from EXIF data, otherwise estimated with the
            tilt; with a given tilt, ``HFOV_DEG``.
        ground: Corners of the ground, shares of the photograph's width from the left and height
            from the top; None = ``GROUND``, without its part above the horizon.
        roll_deg: Slope of the horizon, which falls to the right; only with a tilt.
    """

    height_m: float = 0.5
    tilt_deg: float | None = None
    hfov_deg: float | None = None
    ground: Corners | None = None
    roll_deg: float = 0.0

    def entry(self, name: str, data: bytes, size_px: tuple[int, int]) -> dict[str, Any]:
        """Entry of the photograph under ``plates`` of an index.

        Args:
            name: Name of its file.
            data: Content of the file, for its EXIF data.
            size_px: Width and height of the upright photograph.
        """
        from gen_data.assets.plates.plate_import import exif_focal_px

        width_px, height_px = size_px
        focal_px = None if self.hfov_deg else exif_focal_px(data, *size_px)
        entry: dict[str, Any] = {"file": name, "camera_height_m": self.height_m}
        if focal_px is None and (self.hfov_deg or self.tilt_deg is not None):
            hfov_deg = self.hfov_deg or _assumed_hfov_deg(width_px / max(size_px))
            entry["hfov_deg"] = hfov_deg
            focal_px = 0.5 * width_px / math.tan(math.radians(0.5 * hfov_deg))
        if self.tilt_deg is not None and focal_px is not None:
            rise_px = focal_px * math.tan(math.radians(self.tilt_deg))
            row_px = 0.5 * height_px - rise_px / math.cos(math.radians(self.roll_deg))
            entry["horizon"] = {"height_px": round(row_px, 1)}
            if self.roll_deg:
                entry["horizon"]["roll_deg"] = self.roll_deg
        corners = self.ground or GROUND
        entry["ground"] = [[round(x * width_px), round(y * height_px)] for x, y in corners]
        return entry

    def tilted(self) -> Standpoint:
        """The same with the assumed tilt."""
        return replace(self, tilt_deg=TILT_DEG)


UNKNOWN = Standpoint()
"""Standpoint before the user has set any control."""


def _assumed_hfov_deg(share: float) -> float:
    """Horizontal field of view of a photograph whose width is a share of its longest edge."""
    half = math.atan(share * math.tan(math.radians(0.5 * HFOV_DEG)))
    return round(math.degrees(2.0 * half), 1)


def below_horizon(plate: Plate, ground: Corners) -> Corners | None:
    """Corners of a ground, moved straight down if above the horizon; None if impossible."""
    width_px, height_px = plate.size_px
    reach_m = plate.T_world_camera.translation_m[2] / math.tan(math.radians(LOWEST_DEG))
    lowered = []
    for x, y in ground:
        rows = np.linspace(y, 1.0, 201)
        points = ground_points(plate, np.stack([np.full(201, x * width_px), rows * height_px], 1))
        is_near = np.hypot(*points.T) <= reach_m
        if not is_near.any():
            return None
        lowered.append((x, float(rows[int(np.argmax(is_near))])))
    return tuple(lowered)


def remedy(plate: Plate, ground: Corners) -> str:
    """Advice for a ground with a corner above the horizon."""
    highest = min(y for _, y in ground)
    rise = math.atan((0.5 - highest) * plate.size_px[1] / plate.focal_px)
    tilt_deg = math.ceil(math.degrees(rise) + LOWEST_DEG)
    text = (
        "a corner of the ground (yellow) is above the horizon (red), or too far away: give "
        f"'looks down' {tilt_deg} or more"
    )
    lowered = below_horizon(plate, ground)
    if lowered is None:
        return text
    top = math.ceil(100.0 * max(new[1] for new in set(lowered) - set(ground)))
    return f"{text}, or begin 'ground from top to bottom' at {top} or more"


def begin_scene(folder: str, photo: str, size_px: tuple[int, int]) -> str:
    """Text of a configuration with household objects on a photograph.

    Args:
        folder: Folder of the assets, as the text names it.
        photo: Id of the photograph.
        size_px: Its width and height; images have their shape.
    """
    scale = min(1.0, IMAGE_PX / max(size_px))
    # Video encoders and many networks require multiples of 16.
    width, height = (max(16, round(edge * scale / 16) * 16) for edge in size_px)
    return SCENE.format(folder=folder, photo=photo, width=width, height=height)


def show_behind(text: str, document: Node, photo: str) -> str:
    """The text of a configuration with another photograph behind its scenes.

    Raises:
        ConfigError: its scenes have no plate, or its photographs have no place in the text.
    """
    found = [
        (section, item)
        for section in ("elements", "randomizers")
        for item in document.entries[section].items
        if (kind := item.get("type")) is not None and kind.content == "plate"
    ]
    if not any(section == "elements" for section, _ in found):
        raise ConfigError(
            "elements: this scene is built of meshes and has no {type: plate}, behind which a "
            "photograph could stand; begin an empty file with the photograph, or cover the walls "
            "with it"
        )
    for section, item in found:
        listed = item.get("photos")
        old = [node.text for node in listed.items] if listed else []
        photos = [name for name in old if name not in (RENDERED, photo)]
        text = text_edits.set_value(text, (section, node_name(item), "photos"), [*photos, photo])
    return text


def is_empty(text: str) -> bool:
    """Whether a text contains only comments."""
    return not any(line.strip() and not line.strip().startswith("#") for line in text.splitlines())
