"""Converter of the catalogue pack: models of Sweet Home 3D selected by ``catalogue.yaml``.

The package holds one zip per author or licence, each with OBJ models and a properties file with
their sizes [cm] and creators.
"""

import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from gen_data.assets import asset_folder, content_hashes, folder_index, installed_packs
from gen_data.config.base_model import Strict
from gen_data.core.errors import AssetError

SELECTION = Path(__file__).with_name("catalogue.yaml")
_PROPERTIES_NAME = "PluginFurnitureCatalog.properties"
_PROPERTY = re.compile(r"(\w+)#(\d+)=(.*)")
_SOURCE = "Sweet Home 3D furniture (Debian sweethome3d-furniture 1.8-1)"
_LICENCES = {"BlendSwap-CC-0": "CC0-1.0"}
_LICENCE = "CC-BY-3.0; converted, decimated, re-coloured"
_DENSITY = 250.0
"""Assumed mass per volume of the bounding box [kg/m^3]: household objects are light and partly
empty."""

_GRASPABLE_M = 0.07 + 1e-9
"""Slightly less than the usual opening of parallel grippers."""

Place = tuple[float, float, float]


class Lamp(Strict):
    """Triangles of a textured model in two mirrored boxes that form a pair of lamps."""

    material: str
    """Pattern of the material's name."""
    finish: str
    low_m: Place
    high_m: Place
    """Corners of the left box, in the frame of the finished asset."""


class Shared(Strict):
    """Properties shared by a group of models; each model may override them."""

    category: str = ""
    subcategory: str = ""
    attributes: dict[folder_index.Word, folder_index.Word] = Field(default_factory=dict)
    tags: tuple[folder_index.Word, ...] = ()
    origin: Literal["center", "floor"] | None = None
    yaw_deg: float | None = None
    """Rotation about the vertical that turns the front to +X; the catalogue's front is -Y."""
    max_faces: Annotated[int, Field(ge=100)] | None = None
    mass_kg: Annotated[float, Field(gt=0.0)] | None = None
    """By default estimated from the size."""
    parts: Annotated[int, Field(ge=1, le=24)] | None = None
    """Largest number of convex collision parts."""
    materials: dict[str, str] = Field(default_factory=dict)
    """Names of finishes by pattern of the material's name."""


class ModelChoice(Shared):
    """A selected model."""

    id: folder_index.Id
    model: str
    """Its OBJ file in the catalogue."""
    size_m: Annotated[float, Field(gt=0.0)] | None = None
    """Longest edge; by default the catalogue's."""
    stackable: bool = False
    keypoints: dict[folder_index.Word, Place] = Field(default_factory=dict)
    """A point with y != 0 is mirrored to a pair: ``<name>_left`` and ``<name>_right``."""
    lamps: tuple[Lamp, ...] = ()


class Group(Shared):
    """Models of one kind."""

    models: tuple[ModelChoice, ...]


class Selection(Strict):
    """Content of ``catalogue.yaml``."""

    finishes: dict[str, folder_index.Finish]
    groups: dict[str, Group]


@dataclass(frozen=True, slots=True)
class Model:
    """Properties of a model in the package.

    Attributes:
        folder: Folder of its extracted zip.
        size_m: Width, depth, height.
    """

    folder: Path
    size_m: Place
    creator: str
    licence: str


def convert(source: Path, target: Path) -> None:
    """Write the selected models and their index.

    Raises:
        AssetError: if the package lacks a selected model.
    """
    selection = read_selection()
    models = read_models(source)
    entries = []
    for group in selection.groups.values():
        for choice in group.models:
            if choice.model not in models:
                raise AssetError(f"{source}: holds no model '{choice.model}' ({choice.id})")
            model = models[choice.model]
            entries.append(mesh_entry(choice, group, model, selection.finishes))
            _copy_model(asset_folder.Folder(model.folder), choice.model, target)
    index = folder_index.FolderIndex(licence=_LICENCE, source=_SOURCE, assets=tuple(entries))
    installed_packs.write_index(target, index)


def read_selection(path: Path = SELECTION) -> Selection:
    """Read the selected models. Raises ConfigError listing every fault with its place."""
    return folder_index.read_document(path, Selection)[0]


def read_models(source: Path) -> dict[str, Model]:
    """Read the properties of every model of the package, by OBJ file."""
    models: dict[str, Model] = {}
    for path in sorted(source.rglob(_PROPERTIES_NAME)):
        facts: dict[str, dict[str, str]] = {}
        # Java's properties files are Latin-1.
        for line in path.read_text(encoding="latin-1").splitlines():
            match = _PROPERTY.fullmatch(line.strip())
            if match:
                facts.setdefault(match[2], {})[match[1]] = match[3].strip()
        licence = _LICENCES.get(path.parent.name.removesuffix(".sh3f"), _LICENCE)
        for fact in facts.values():
            sizes = (float(fact[name]) / 100.0 for name in ("width", "depth", "height"))
            width, depth, height = sizes
            models[fact["model"].lstrip("/")] = Model(
                path.parent, (width, depth, height), fact.get("creator", "unknown"), licence
            )
    return models


def mesh_entry(
    choice: ModelChoice, group: Group, model: Model, finishes: Mapping[str, folder_index.Finish]
) -> folder_index.MeshEntry:
    """Index entry of a selected model."""
    width, depth, height = model.size_m
    size_m = choice.size_m or max(model.size_m)
    scale = size_m / max(model.size_m)
    guess_kg = max(_DENSITY * width * depth * height * scale**3, 0.005)
    named = {**group.materials, **choice.materials}
    return folder_index.MeshEntry(
        id=choice.id,
        file=choice.model,
        category=choice.category or group.category,
        subcategory=choice.subcategory or group.subcategory,
        attributes={**group.attributes, **choice.attributes},
        tags=_tags(choice, group, min(model.size_m) * scale),
        size_m=size_m,
        up="y",
        yaw_deg=_first_given(choice.yaw_deg, group.yaw_deg, 90.0),
        origin=choice.origin or group.origin or "center",
        mass_kg=_first_given(choice.mass_kg, group.mass_kg, float(f"{guess_kg:.2g}")),
        stackable=choice.stackable,
        max_faces=choice.max_faces or group.max_faces or 4000,
        parts=choice.parts or group.parts or 8,
        materials={pattern: finishes[name] for pattern, name in named.items()},
        keypoints=tuple(
            p for name, place in choice.keypoints.items() for p in _mirror_points(name, place)
        ),
        regions=tuple(
            region for lamp in choice.lamps for region in _mirror_regions(lamp, finishes)
        ),
        licence=model.licence,
        author=model.creator,
    )


def _tags(choice: ModelChoice, group: Group, thickness_m: float) -> tuple[str, ...]:
    tags = {*group.tags, *choice.tags, installed_packs.TAG}
    if "household" in tags and thickness_m <= _GRASPABLE_M:
        tags.add("graspable")
    return tuple(sorted(tags))


def _first_given(*values: float | None) -> float:
    return next(value for value in values if value is not None)


def _mirror_points(name: str, place: Place) -> tuple[folder_index.Point, ...]:
    x, y, z = place
    sides = (("", 1.0),) if y == 0.0 else (("_left", 1.0), ("_right", -1.0))
    radius_m = _radius_m(name, place)
    return tuple(
        folder_index.Point(name=f"{name}{side}", position_m=(x, sign * y, z), radius_m=radius_m)
        for side, sign in sides
    )


def _radius_m(name: str, place: Place) -> float:
    """Radius of a keypoint: lamps lie at the surface, wheel hubs up to a wheel's radius below it.

    That depth, the hub's own height, occurs where a wheel is seen from ahead or is turned. The
    extra tenth covers hubs measured slightly low; bodywork before the far wheels is much thicker.
    """
    return round(1.1 * place[2], 3) if name.startswith("wheel") else 0.15


def _mirror_regions(
    lamp: Lamp, finishes: Mapping[str, folder_index.Finish]
) -> tuple[folder_index.Region, folder_index.Region]:
    (x0, y0, z0), (x1, y1, z1) = lamp.low_m, lamp.high_m
    finish = finishes[lamp.finish]
    return (
        folder_index.Region(
            material=lamp.material, low_m=lamp.low_m, high_m=lamp.high_m, finish=finish
        ),
        folder_index.Region(
            material=lamp.material, low_m=(x0, -y1, z0), high_m=(x1, -y0, z1), finish=finish
        ),
    )


def _copy_model(folder: asset_folder.Folder, model: str, target: Path) -> None:
    """Copy a model and the files it refers to, under their own names."""
    for name in content_hashes.find_referenced_files(folder, model):
        path = target / name
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(folder.path(name), path)
