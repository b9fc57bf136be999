"""Meshes and photographs that are dropped into the page: checked, kept, and put into the scene.

A mesh becomes an object with a class of its name; a photograph becomes the background of the scene,
or the walls of its room. Both are copied to ``assets/`` next to the configuration.
"""

from __future__ import annotations

import filecmp
import json
import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path, PurePath, PurePosixPath
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from gen_data.assets.folder_index import PlateEntry
from gen_data.assets.image_decoding import PHOTO_SUFFIXES, decode_image, why_unread
from gen_data.assets.plates.plate_import import locate_camera
from gen_data.config.merging import node_name
from gen_data.config.yaml_tree import parse_yaml
from gen_data.core.errors import AssetError, ConfigError, StorageError
from gen_data.core.plates import Plate, ground_points, tilt_and_roll
from gen_data.core.temporary_folders import temporary_folder
from gen_data.core.whole_files import write_whole
from gen_data.lab.edit import photographs, text_edits
from gen_data.lab.edit.files import ASSETS, read_file
from gen_data.lab.edit.photographs import Standpoint
from gen_data.lab.edit.samples import encode
from gen_data.preview.plate_overlay import plate_overlay

if TYPE_CHECKING:
    from gen_data.assemble.config import Config
    from gen_data.assets.checking import Finding
    from gen_data.assets.library import Library
    from gen_data.lab.edit.samples import Studio
    from gen_data.preview.overlay import Image

SIZE_MAX_BYTES = 200_000_000
"""Larger files are copied to the folder by hand: a browser reads them into memory."""
PICTURE_PX, PHOTO_PX = 480, 720
"""Longest edge of the picture of a checked mesh, and of a photograph."""
PERSON, MUG = "simple_person?seed=0", "mug?seed=0"
PERSON_FROM_M = 0.4
"""Longest edge from which a person stands next to an object, not only a mug."""


@dataclass(frozen=True)
class Checked:
    """A file as `gen-data assets check` sees it.

    Attributes:
        entry: Its entry in the index, in the section.
        finding: Size, unit, axis and doubts.
        jpeg: Picture: of a mesh with a mug, and for large objects a person, for scale; of a
            photograph with its horizon and a grid on its ground.
        size_px: Width and height of a photograph; None for a mesh.
        standpoint: Standpoint from which the entry of a photograph follows.
        tilt_roll_deg: Downward tilt of a photograph's camera, and slope of its horizon [deg].
    """

    section: str
    entry: dict[str, Any]
    finding: Finding
    jpeg: bytes
    size_px: tuple[int, int] | None = None
    standpoint: Standpoint = photographs.UNKNOWN
    tilt_roll_deg: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Misplaced:
    """A photograph whose ground is not usable as given.

    Attributes:
        text: Reason, and the control to change with the value it needs.
        jpeg: Picture with the horizon, and a grid on the part of the ground below it.
    """

    text: str
    jpeg: bytes
    size_px: tuple[int, int]
    standpoint: Standpoint
    tilt_roll_deg: tuple[float, float]


@dataclass(frozen=True)
class CheckFile:
    """Check of one file in a process with limits.

    Attributes:
        entry: Entry of a mesh in the index without the file, such as ``{unit: mm, up: y}``.
        standpoint: Standpoint of a photograph.
    """

    path: Path
    entry: tuple[tuple[str, Any], ...] = ()
    standpoint: Standpoint = photographs.UNKNOWN

    def run(self, studio: Studio) -> Checked | Misplaced:
        """Import the file as a run would, in a separate folder."""
        del studio
        with temporary_folder("edit") as folder:
            shutil.copyfile(self.path, folder / self.path.name)
            name = self.path.name
            if is_photograph(name):
                return check_photograph(folder, name, self.standpoint)
            return check_mesh(folder, name, dict(self.entry))


def plain_name(given: str) -> str:
    """Name of a file without folders that a browser, or an attacker, prepends."""
    name = PurePosixPath(given.replace("\\", "/")).name
    return "" if name.startswith(".") or not name.isprintable() else name


def is_photograph(name: str) -> bool:
    """Whether a file is a photograph by its name."""
    return Path(name).suffix.lower() in PHOTO_SUFFIXES


def check_mesh(folder: Path, name: str, changes: dict[str, Any]) -> Checked:
    """Check a mesh in a folder without an index; the index is written.

    Raises:
        AssetError: it cannot be used; the text states why.
    """
    from gen_data.assets.readers import MESH_SUFFIXES
    from gen_data.cli.own_meshes import guess_unit

    if Path(name).suffix.lower() not in MESH_SUFFIXES:
        known = ", ".join(sorted({*PHOTO_SUFFIXES, *MESH_SUFFIXES}))
        why = why_unread(PurePath(name)) or f"is neither a mesh nor a photograph; expected {known}"
        raise AssetError(f"{name}: {why}")
    checked = _check(folder, "assets", {"file": name, "category": _category(name), **changes})
    if checked.finding.unit == "m (assumed)" and checked.finding.size_m and not changes:
        unit = guess_unit(max(checked.finding.size_m))
        if unit != "m":
            return check_mesh(folder, name, {"unit": unit})
    return checked


def check_photograph(folder: Path, name: str, standpoint: Standpoint) -> Checked | Misplaced:
    """Check a photograph in a folder without an index; the index is written.

    Without a tilt, the horizon is estimated from edges in the image; if they show none, or one
    below the whole ground, a tilt is assumed. A ground that was not given ends below the horizon.

    Raises:
        AssetError: it cannot be used; the text states why.
    """
    data = (folder / name).read_bytes()
    rgb = decode_image(data, name, color=True)
    size_px = rgb.shape[1], rgb.shape[0]

    def locate(one: Standpoint) -> Plate:
        entry = PlateEntry.model_validate_json(json.dumps(one.entry(name, data, size_px)))
        return locate_camera(entry, data, rgb, name)

    plate, standpoint = _with_ground(locate, standpoint)
    tilt_deg, roll_deg = (round(math.degrees(one), 1) for one in tilt_and_roll(plate))
    try:
        checked = _check(folder, "plates", standpoint.entry(name, data, size_px))
    except AssetError as error:
        ground = standpoint.ground or photographs.GROUND
        lowered = photographs.below_horizon(plate, ground)
        is_below = np.isfinite(ground_points(plate, np.array(plate.ground_px))).all()
        text = str(error) if is_below else f"{name}: {photographs.remedy(plate, ground)}"
        shown_px = [(x * size_px[0], y * size_px[1]) for x, y in lowered or ()]
        jpeg = encode(_shrink(plate_overlay(replace(plate, ground_px=tuple(shown_px)), rgb)))
        return Misplaced(text, jpeg, size_px, standpoint, (tilt_deg, roll_deg))
    return replace(
        checked, size_px=size_px, standpoint=standpoint, tilt_roll_deg=(tilt_deg, roll_deg)
    )


def _with_ground(
    locate: Callable[[Standpoint], Plate], standpoint: Standpoint
) -> tuple[Plate, Standpoint]:
    """A photograph's camera, and the standpoint with an assumed tilt and ground if necessary."""
    try:
        plate = locate(standpoint)
    except AssetError as error:
        if standpoint.tilt_deg is not None or "no horizon was found" not in str(error):
            raise
        standpoint = standpoint.tilted()
        plate = locate(standpoint)
    if standpoint.ground is not None:
        return plate, standpoint
    lowered = photographs.below_horizon(plate, photographs.GROUND)
    rows = [y for _, y in lowered or ()]
    if rows and max(rows) - min(rows) >= photographs.LEAST_GROUND:
        return plate, replace(standpoint, ground=lowered)
    if standpoint.tilt_deg is None:
        return _with_ground(locate, standpoint.tilted())
    return plate, standpoint


def _check(folder: Path, section: str, entry: dict[str, Any]) -> Checked:
    from gen_data.assets.checking import check_folder
    from gen_data.packs.provision import open_assets

    _write_index(folder, section, entry)
    library = open_assets([folder])
    finding = next(iter(check_folder(folder, library)))
    if finding.error:
        raise AssetError(finding.error.replace(f"{folder}/", ""))
    return Checked(section, entry, finding, _picture(finding, library))


def as_walls(checked: Checked) -> Checked:
    """A checked photograph as a texture for walls."""
    name = str(checked.entry["file"])
    return replace(checked, section="textures", entry={"file": name, "tags": [_word(name)]})


def _category(name: str) -> str:
    return PurePath(name).stem.replace("_", " ").strip().lower() or "thing"


def _word(name: str) -> str:
    """A tag from a file name, by which randomizers find the photograph."""
    return "photo_" + "".join(
        c if c.isalnum() and c.isascii() else "_" for c in PurePath(name).stem
    )


def _write_index(folder: Path, section: str, entry: dict[str, Any]) -> None:
    text = text_edits.append_item("licence: unknown\n", section, entry)
    write_whole({folder / "assets.yaml": text.encode()})


def _picture(finding: Finding, library: Library) -> bytes:
    from gen_data.core.scene import Body
    from gen_data.core.se3 import SE3
    from gen_data.preview.thumbnails import picture_of
    from gen_data.renderers.warp.renderer import WarpRenderer
    from gen_data.renderers.warp.settings import RenderSettings

    if finding.size_m is None:
        photo = library.texture(finding.asset_id).albedo
        return encode(_shrink(plate_overlay(library.plate(finding.asset_id), photo)))
    renderer = WarpRenderer(library, "auto", RenderSettings())
    names = [finding.asset_id, MUG, *([PERSON] if max(finding.size_m) > PERSON_FROM_M else [])]
    bodies, y_m = [], 0.0
    for name in names:
        low, high = library.bounds_m(name)
        gap_m = 0.15 * (high[1] - low[1]) + 0.03
        # Side by side along Y, on one level.
        place = (0.0, y_m - low[1], -low[2])
        bodies.append(Body(name, name, SE3(place)))
        y_m += high[1] - low[1] + gap_m
    return encode(picture_of(tuple(bodies), library, renderer, PICTURE_PX))


def _shrink(image: Image) -> Image:
    scale = PHOTO_PX / max(image.shape[:2])
    size_px = [max(1, round(edge * scale)) for edge in image.shape[1::-1]]
    return np.asarray(cv2.resize(image, size_px, interpolation=cv2.INTER_AREA))


def keep_file(folder: Path, path: Path, checked: Checked) -> None:
    """Copy a checked file to the user's folder, and add it to its index.

    An existing file is not copied; its entry is replaced, for example after a change of an angle.

    Raises:
        AssetError: another file of that name is there.
        StorageError: the index has changed meanwhile, or cannot be written.
    """
    target = folder / path.name
    try:
        if target.exists() and not filecmp.cmp(path, target, shallow=False):
            raise AssetError(f"{target}: another file of that name is there; rename one of them")
        folder.mkdir(parents=True, exist_ok=True)
        index = read_file(folder / "assets.yaml")
        if not target.exists():
            shutil.copyfile(path, target)
    except OSError as error:
        raise StorageError(f"{error.filename}: {error.strerror}; drop {path.name} again") from error
    text = index.text or "licence: unknown\n"
    number = _entry_number(text, checked)
    if number is None:
        index.save(text_edits.append_item(text, checked.section, checked.entry))
    else:
        index.save(text_edits.set_value(text, (checked.section, number), checked.entry))


def _entry_number(text: str, checked: Checked) -> int | None:
    """Place of a file's entry in its section of an index; None without one."""
    section = parse_yaml(text, "").get(checked.section)
    files = [item.get("file") for item in section.items] if section else []
    names = [node.content if node else "" for node in files]
    return names.index(checked.entry["file"]) if checked.entry["file"] in names else None


def add_to_scene(text: str, config: Config | None, checked: Checked) -> str:
    """The text of a configuration with a checked file added to its scene.

    A mesh becomes a group of objects on the first surface; each scene draws one to three of them. A
    photograph becomes the background of the scene, or of a new scene if the text is empty; as a
    texture, it covers the walls.

    Args:
        text: Text of the editor.
        config: Its configuration; None for a text with faults, or an empty one.
        checked: The file.

    Raises:
        ConfigError: the scene has no surface, plate or walls for it, or the text has faults.
    """
    asset_id = checked.finding.asset_id
    if photographs.is_empty(text):
        if checked.section == "plates" and checked.size_px is not None:
            return text + photographs.begin_scene(ASSETS, asset_id, checked.size_px)
        raise ConfigError(
            "the file is empty: begin with a line such as 'extends: tabletop.yaml', or with a "
            "photograph"
        )
    if config is None:
        raise ConfigError("the text has faults; correct them first")
    folders = [
        node.text for node in (config.document.get("assets", "folders") or config.document).items
    ]
    if ASSETS not in folders:
        text = text_edits.set_value(text, ("assets", "folders"), [*folders, ASSETS])
    if checked.section == "plates":
        return photographs.show_behind(text, config.document, asset_id)
    if checked.section == "textures":
        return _on_walls(text, config, checked.entry["tags"][0])
    surface = next(_named(config, "elements", ("surface", "bin", "shelf", "plate")), None)
    if surface is None:
        raise ConfigError("elements: no surface holds the object; add one, such as a table")
    name = "".join(c if c.isalnum() else "_" for c in _category(str(checked.entry["file"])))
    if f"own_{name}" in _named(config, "elements", ("objects",)):
        return text
    group = {
        "type": "objects",
        "on": surface,
        "count": 2,
        "assets": {"ids": [asset_id]},
        "placement": "scatter" if surface in _named(config, "elements", ("plate",)) else "drop",
    }
    if _own_list(text):
        text = text_edits.append_item(text, "elements", {"name": f"own_{name}", **group})
    else:
        text = text_edits.set_value(text, ("elements", f"own_{name}"), group)
    # Without a randomizer, it would lie at the same place in every scene.
    drawn = {"type": "objects", "name": f"own_{name}", "count": {"uniform_integer": [1, 3]}}
    return text_edits.append_item(text, "randomizers", drawn)


def _own_list(text: str) -> bool:
    """Whether the text lists the elements itself instead of overriding elements of a template."""
    own = parse_yaml(text or "{}", "").get("elements")
    return own is not None and bool(own.items)


def _on_walls(text: str, config: Config, tag: str) -> str:
    backdrop = next(_named(config, "randomizers", ("backdrop",)), None)
    if backdrop is None:
        raise ConfigError(
            "randomizers: none of them draws walls; add {type: backdrop, name: room} to a scene "
            "with a room"
        )
    values = {"walls": [tag], "painted": False, "wall_scale_m": 2.8}
    for field, value in values.items():
        text = text_edits.set_value(text, ("randomizers", backdrop, field), value)
    return text


def _named(config: Config, section: str, kinds: tuple[str, ...]) -> Iterator[str]:
    """Names of the items of a section that have one of these types."""
    for item in config.document.entries[section].items:
        kind = item.get("type")
        if kind is not None and kind.content in kinds:
            yield node_name(item)
