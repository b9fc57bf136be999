"""Meshes and photographs that are dropped into the page: checked, kept, and put into the scene.

A mesh becomes an object with a class of its name; a photograph becomes a texture, which the walls
of a room can show. Both are copied to ``assets/`` next to the configuration.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from gen_data.config.merging import node_name
from gen_data.core.errors import AssetError, ConfigError
from gen_data.core.temporary_folders import temporary_folder
from gen_data.core.whole_files import write_whole
from gen_data.lab.edit import text_edits
from gen_data.lab.edit.files import read_file

if TYPE_CHECKING:
    from gen_data.assemble.config import Config
    from gen_data.assets.checking import Finding
    from gen_data.assets.library import Library
    from gen_data.lab.edit.samples import Studio

ASSETS = "assets"
"""Folder of the user's files, next to the configuration."""
PHOTOS = frozenset({".jpg", ".jpeg", ".png", ".webp"})
SIZE_MAX_BYTES = 200_000_000
"""Larger files are copied to the folder by hand: a browser reads them into memory."""
PERSON, MUG = "simple_person?seed=0", "mug?seed=0"
PERSON_FROM_M = 0.4
"""Longest edge from which a person stands next to an object, not only a mug."""


@dataclass(frozen=True)
class Checked:
    """A file as `gen-data assets check` sees it.

    Attributes:
        entry: Its entry in the index, in the section.
        finding: Size, unit, axis and doubts.
        jpeg: Picture with a mug, and for large objects a person, for scale; empty without one.
    """

    section: str
    entry: dict[str, Any]
    finding: Finding
    jpeg: bytes


@dataclass(frozen=True)
class CheckFile:
    """Check of one file in a process of its own limits.

    Attributes:
        entry: Entry of the index without the file, such as ``{unit: mm, up: y}``.
    """

    path: Path
    entry: tuple[tuple[str, Any], ...] = ()

    def run(self, studio: Studio) -> Checked:
        """Import the file as a run would, in a folder of its own."""
        del studio
        with temporary_folder("edit") as folder:
            shutil.copyfile(self.path, folder / self.path.name)
            return check_file(folder, self.path.name, dict(self.entry))


def check_file(folder: Path, name: str, changes: dict[str, Any]) -> Checked:
    """Check a file in a folder without an index, which is written.

    Raises:
        AssetError: it cannot be used; the text tells why.
    """
    from gen_data.assets.checking import check_folder
    from gen_data.assets.readers import MESH_SUFFIXES
    from gen_data.cli.own_meshes import guess_unit
    from gen_data.packs.provision import open_assets

    suffix = Path(name).suffix.lower()
    if suffix in PHOTOS:
        section, entry = "textures", {"file": name, "tags": [_word(name)]}
    elif suffix in MESH_SUFFIXES:
        section, entry = "assets", {"file": name, "category": _category(name), **changes}
    else:
        known = ", ".join(sorted({*PHOTOS, *MESH_SUFFIXES}))
        raise AssetError(f"{name}: is neither a mesh nor a photograph; expected {known}")
    _write_index(folder, section, entry)
    library = open_assets([folder])
    finding = next(iter(check_folder(folder, library)))
    if not finding.error and finding.unit == "m (assumed)" and finding.size_m and not changes:
        unit = guess_unit(max(finding.size_m))
        if unit != "m":
            return check_file(folder, name, {"unit": unit})
    if finding.error:
        raise AssetError(finding.error.replace(f"{folder}/", ""))
    return Checked(section, entry, finding, _picture(finding, library))


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
    from gen_data.lab.edit.samples import encode
    from gen_data.preview.thumbnails import picture_of, thumbnail
    from gen_data.renderers.warp.renderer import WarpRenderer
    from gen_data.renderers.warp.settings import RenderSettings

    renderer = WarpRenderer(library, "auto", RenderSettings())
    asset = library.get(finding.asset_id)
    if asset.kind != "object" or finding.size_m is None:
        return encode(thumbnail(asset, library, renderer, 320))
    names = [finding.asset_id, MUG, *([PERSON] if max(finding.size_m) > PERSON_FROM_M else [])]
    bodies, y_m = [], 0.0
    for name in names:
        low, high = library.bounds_m(name)
        gap_m = 0.15 * (high[1] - low[1]) + 0.03
        # Side by side along Y, on one level.
        place = (0.0, y_m - low[1], -low[2])
        bodies.append(Body(name, name, SE3(place)))
        y_m += high[1] - low[1] + gap_m
    return encode(picture_of(tuple(bodies), library, renderer, 320))


def keep_file(folder: Path, path: Path, checked: Checked) -> None:
    """Copy a checked file to the user's folder, and add it to its index.

    Raises:
        AssetError: a file of that name is there.
        StorageError: the index has changed meanwhile, or cannot be written.
    """
    target = folder / path.name
    if target.exists():
        raise AssetError(f"{target}: a file of that name is there; rename one of them")
    folder.mkdir(parents=True, exist_ok=True)
    index = read_file(folder / "assets.yaml")
    text = index.text or "licence: unknown\n"
    shutil.copyfile(path, target)
    index.save(text_edits.append_item(text, checked.section, checked.entry))


def add_to_scene(text: str, config: Config, checked: Checked) -> str:
    """The text of a configuration with a checked file in its scene.

    A mesh becomes a group of objects on the first surface; a photograph covers the walls.

    Raises:
        ConfigError: the scene has no surface or no walls for it.
    """
    folders = [
        node.text for node in (config.document.get("assets", "folders") or config.document).items
    ]
    if ASSETS not in folders:
        text = text_edits.set_value(text, ("assets", "folders"), [*folders, ASSETS])
    asset_id = checked.finding.asset_id
    if checked.section == "textures":
        return _on_walls(text, config, checked.entry["tags"][0])
    surface = _first(config, "elements", ("surface", "bin", "shelf", "plate"))
    if surface is None:
        raise ConfigError("elements: no surface holds the object; add one, such as a table")
    name = "".join(c if c.isalnum() else "_" for c in _category(str(checked.entry["file"])))
    group = {
        "type": "objects",
        "on": surface,
        "count": 2,
        "assets": {"ids": [asset_id]},
        "placement": "drop",
    }
    listed = _own_list(text)
    if listed:
        return text_edits.append_item(text, "elements", {"name": f"own_{name}", **group})
    return text_edits.set_value(text, ("elements", f"own_{name}"), group)


def _own_list(text: str) -> bool:
    """Whether the text itself lists the elements, instead of overriding those of a template."""
    from gen_data.config.yaml_tree import parse_yaml

    own = parse_yaml(text or "{}", "").get("elements")
    return own is not None and bool(own.items)


def _on_walls(text: str, config: Config, tag: str) -> str:
    backdrop = _first(config, "randomizers", ("backdrop",))
    if backdrop is None:
        raise ConfigError(
            "randomizers: none of them draws walls; add {type: backdrop, name: room}, or put "
            "objects on the photograph itself: docs/tutorials/photo_plates.md"
        )
    values = {"walls": [tag], "painted": False, "wall_scale_m": 2.8}
    for field, value in values.items():
        text = text_edits.set_value(text, ("randomizers", backdrop, field), value)
    return text


def _first(config: Config, section: str, kinds: tuple[str, ...]) -> str | None:
    for item in config.document.entries[section].items:
        kind = item.get("type")
        if kind is not None and kind.content in kinds:
            return node_name(item)
    return None


def with_entry(checked: Checked, **changes: Any) -> Checked:
    """The same file with other values of its entry, such as the unit."""
    return replace(checked, entry={**checked.entry, **changes})
