"""The catalogue pack: what ``catalogue.yaml`` selects of the 820 models of Sweet Home 3D.

The package holds one zip per author or licence, each with OBJ models and a properties file that
gives their sizes in centimetres and their creators.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from gen_data.generator.assets.asset_folder import Folder
from gen_data.generator.assets.content_hashes import find_referenced_files
from gen_data.generator.assets.folder_index import (
    Finish,
    FolderIndex,
    Id,
    MeshEntry,
    Point,
    Region,
    Word,
)
from gen_data.generator.assets.installed_packs import INDEX_NAME, TAG
from gen_data.generator.config.base_model import Strict
from gen_data.generator.config.problems import Problems
from gen_data.generator.config.validation import validate
from gen_data.generator.config.yaml_tree import load_yaml
from gen_data.generator.core.errors import AssetError

SELECTION = Path(__file__).with_name("catalogue.yaml")
_FACTS = "PluginFurnitureCatalog.properties"
_FACT = re.compile(r"(\w+)#(\d+)=(.*)")
_SOURCE = "Sweet Home 3D furniture (Debian sweethome3d-furniture 1.8-1)"
_LICENCES = {"BlendSwap-CC-0": "CC0-1.0"}
_LICENCE = "CC-BY-3.0; converted, decimated, re-coloured"
_DENSITY = 250.0
"""Mass per volume of the bounding box [kg/m^3]: household things are half air, half light."""

_GRASPABLE_M = 0.07 + 1e-9
"""What parallel grippers open to, a little less."""

Place = tuple[float, float, float]


class Lamp(Strict):
    """Triangles of a textured model that are a lamp: those in two mirrored boxes."""

    material: str
    """Pattern of the material's name."""
    finish: str
    low_m: Place
    high_m: Place
    """Corners of the box on the left, in the frame of the finished asset."""


class Shared(Strict):
    """What the models of a group have in common, and each may say for itself."""

    category: str = ""
    subcategory: str = ""
    attributes: dict[Word, Word] = Field(default_factory=dict)
    tags: tuple[Word, ...] = ()
    origin: Literal["center", "floor"] | None = None
    yaw_deg: float | None = None
    """Turn about the vertical that brings the front to +X; the catalogue's front is -Y."""
    max_faces: Annotated[int, Field(ge=100)] | None = None
    mass_kg: Annotated[float, Field(gt=0.0)] | None = None
    """By default guessed from the size."""
    parts: Annotated[int, Field(ge=1, le=24)] | None = None
    """Bound on the convex parts that it collides with."""
    materials: dict[str, str] = Field(default_factory=dict)
    """Name of a finish by pattern of the material's name."""


class ModelChoice(Shared):
    """One model."""

    id: Id
    model: str
    """Its OBJ file in the catalogue."""
    size_m: Annotated[float, Field(gt=0.0)] | None = None
    """Longest edge; by default what the catalogue says."""
    stackable: bool = False
    keypoints: dict[Word, Place] = Field(default_factory=dict)
    """Off the middle (y > 0) a point stands for two: ``<name>_left`` and ``<name>_right``."""
    lamps: tuple[Lamp, ...] = ()


class Group(Shared):
    """Models of one kind."""

    models: tuple[ModelChoice, ...]


class Selection(Strict):
    """The document."""

    finishes: dict[str, Finish]
    groups: dict[str, Group]


@dataclass(frozen=True, slots=True)
class Model:
    """What the package says about a model.

    Attributes:
        folder: Of the zip it comes from.
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
            _copy(Folder(model.folder), choice.model, target)
    index = FolderIndex(licence=_LICENCE, source=_SOURCE, assets=tuple(entries))
    text = index.model_dump_json(exclude_defaults=True)
    (target / INDEX_NAME).write_text(text, encoding="utf-8")


def read_selection(path: Path = SELECTION) -> Selection:
    """The selected models. Raises ConfigError naming every fault with its place."""
    problems = Problems()
    selection = validate(load_yaml(path), Selection, problems)
    problems.raise_if_any()
    assert selection is not None
    return selection


def read_models(source: Path) -> dict[str, Model]:
    """Every model of the package by its OBJ file."""
    models: dict[str, Model] = {}
    for path in sorted(source.rglob(_FACTS)):
        facts: dict[str, dict[str, str]] = {}
        # Java's properties files are Latin-1.
        for line in path.read_text(encoding="latin-1").splitlines():
            match = _FACT.fullmatch(line.strip())
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
    choice: ModelChoice, group: Group, model: Model, finishes: Mapping[str, Finish]
) -> MeshEntry:
    """How the library shall import a selected model."""
    width, depth, height = model.size_m
    size_m = choice.size_m or max(model.size_m)
    scale = size_m / max(model.size_m)
    guess_kg = max(_DENSITY * width * depth * height * scale**3, 0.005)
    named = {**group.materials, **choice.materials}
    return MeshEntry(
        id=choice.id,
        file=choice.model,
        category=choice.category or group.category,
        subcategory=choice.subcategory or group.subcategory,
        attributes={**group.attributes, **choice.attributes},
        tags=_tags(choice, group, min(model.size_m) * scale),
        size_m=size_m,
        up="y",
        yaw_deg=_first(choice.yaw_deg, group.yaw_deg, 90.0),
        origin=choice.origin or group.origin or "center",
        mass_kg=_first(choice.mass_kg, group.mass_kg, float(f"{guess_kg:.2g}")),
        stackable=choice.stackable,
        max_faces=choice.max_faces or group.max_faces or 4000,
        parts=choice.parts or group.parts or 8,
        materials={pattern: finishes[name] for pattern, name in named.items()},
        keypoints=tuple(
            p for name, place in choice.keypoints.items() for p in _points(name, place)
        ),
        regions=tuple(region for lamp in choice.lamps for region in _regions(lamp, finishes)),
        licence=model.licence,
        author=model.creator,
    )


def _tags(choice: ModelChoice, group: Group, thickness_m: float) -> tuple[str, ...]:
    tags = {*group.tags, *choice.tags, TAG}
    if "household" in tags and thickness_m <= _GRASPABLE_M:
        tags.add("graspable")
    return tuple(sorted(tags))


def _first(*values: float | None) -> float:
    return next(value for value in values if value is not None)


def _points(name: str, place: Place) -> tuple[Point, ...]:
    x, y, z = place
    if y == 0.0:
        return (Point(name=name, position_m=place, radius_m=_radius_m(name, place)),)
    return tuple(
        Point(name=f"{name}_{side}", position_m=(x, sign * y, z), radius_m=_radius_m(name, place))
        for side, sign in (("left", 1.0), ("right", -1.0))
    )


def _radius_m(name: str, place: Place) -> float:
    """Lamps are at the surface; hubs can lie a wheel's radius, their own height, below the tyre.

    So deep they are where a wheel is seen from ahead, or turned. A tenth more is for hubs that
    were measured a little low; bodywork before the far wheels is much thicker.
    """
    return round(1.1 * place[2], 3) if name.startswith("wheel") else 0.15


def _regions(lamp: Lamp, finishes: Mapping[str, Finish]) -> tuple[Region, Region]:
    (x0, y0, z0), (x1, y1, z1) = lamp.low_m, lamp.high_m
    finish = finishes[lamp.finish]
    return (
        Region(material=lamp.material, low_m=lamp.low_m, high_m=lamp.high_m, finish=finish),
        Region(material=lamp.material, low_m=(x0, -y1, z0), high_m=(x1, -y0, z1), finish=finish),
    )


def _copy(folder: Folder, model: str, target: Path) -> None:
    """A model and the files it refers to, under their own names."""
    for name in find_referenced_files(folder, model):
        path = target / name
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(folder.path(name), path)
