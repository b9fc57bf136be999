"""``assets.yaml``: what the files of a folder are, and how they come to the normal form.

The same document describes a user's folder and what pybullet installs (``pybullet.yaml``). A folder
without one offers every mesh and URDF file in it, named and categorised by file and folder.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Annotated, Literal

from pydantic import Field, model_validator

from generator.assets.folder import Folder
from generator.assets.readers import MESH_SUFFIXES
from generator.config.document import load
from generator.config.problems import Problems
from generator.config.strict import Strict
from generator.config.validation import validate
from generator.core.errors import AssetError

INDEX_NAME = "assets.yaml"
ROAD_SUFFIX = ".xodr"
"""Road networks: objects whose mesh is the surface of the roads."""
_MAX_FILES = 20_000

Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Luminance = Annotated[float, Field(ge=0.0)]
Id = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-]*(/[A-Za-z0-9_][A-Za-z0-9_.\-]*)*$",
                          max_length=120)]  # fmt: skip
Word = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_\-]*$", max_length=60)]


class Finish(Strict):
    """What to change in a material; what is not given stays as the file has it."""

    base_color: tuple[Fraction, Fraction, Fraction] | None = None
    """Linear RGB."""
    roughness: Fraction | None = None
    metallic: Fraction | None = None
    specular: Fraction | None = None
    coat: Fraction | None = None
    """Weight of a clear coat."""
    coat_roughness: Fraction | None = None
    transmission: Fraction | None = None
    """Share of the light under the surface that goes through."""
    ior: Annotated[float, Field(ge=1.0, le=4.0)] | None = None
    thin: bool | None = None
    """What transmits is a pane; false: a solid body that refracts."""
    opacity: Fraction | None = None
    emission_cd_m2: tuple[Luminance, Luminance, Luminance] | None = None
    printed: bool | None = None
    """The image is part of what the object is: randomizers leave it alone."""
    textured: Literal[False] | None = None
    """False: without the image that the file gives it."""
    role: Word | None = None
    """What it is on its object: paint, glass, tyre, ...; see ``generator.core.geometry``."""


class Point(Strict):
    """A keypoint; see ``generator.core.geometry``."""

    name: Word
    position_m: tuple[float, float, float]
    """In the frame of the finished asset."""
    radius_m: Annotated[float, Field(gt=0.0)] = 0.05


class Region(Strict):
    """Triangles of a material that are something of their own: a lamp in a textured body."""

    material: str
    """Pattern of the material's name in the file."""
    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    """Corners of the box that holds their centres, in the frame of the finished asset."""
    finish: Finish


class Origin(Strict):
    """Licence, author and source; an entry inherits from its document what it does not give."""

    licence: str = ""
    author: str = ""
    source: str = ""


class MeshEntry(Origin):
    """An object."""

    id: Id
    file: str
    """Mesh or URDF file, relative to the folder."""
    category: Annotated[str, Field(min_length=1, max_length=60)]
    subcategory: str = ""
    """A finer name than the category."""
    attributes: dict[Word, Word] = Field(default_factory=dict)
    """Further facts that labels carry."""
    tags: tuple[Word, ...] = ()
    count: Annotated[int, Field(ge=1, le=100_000)] = 1
    """More than 1: a series; in ``id`` and ``file``, ``000`` stands for the number, from 0."""
    except_for: tuple[Annotated[int, Field(ge=0)], ...] = ()
    """Numbers that a series leaves out."""
    scale: Annotated[float, Field(gt=0.0)] = 1.0
    """Metres per unit of the file."""
    size_m: Annotated[float, Field(gt=0.0)] | None = None
    """Longest edge of the bounding box; instead of scale."""
    up: Literal["y", "z"] | None = None
    """Axis of the file that points up; by default y for glTF, what a USD stage says, and z for
    all else."""
    yaw_deg: float = 0.0
    """Turn about the vertical that brings the front to +X."""
    origin: Literal["center", "floor"] = "center"
    """Of the bounding box: its centre, or the centre of its bottom (furniture)."""
    mass_kg: Annotated[float, Field(ge=0.0)] = 0.0
    stackable: bool = False
    collision: str = ""
    """Mesh file whose groups collide; by default what the URDF says, else the mesh itself."""
    parts: Annotated[int, Field(ge=1, le=24)] = 8
    """Bound on the convex parts that a concave mesh without a collision file is cut into."""
    max_faces: Annotated[int, Field(ge=100)] = 20_000
    materials: dict[str, Finish] = Field(default_factory=dict)
    """By the material's name in the file, or a pattern of it (``*`` = every other); the name
    itself goes before patterns, long patterns before short ones."""
    regions: tuple[Region, ...] = ()
    """Applied in this order, after ``materials``."""
    keypoints: tuple[Point, ...] = ()

    @model_validator(mode="after")
    def _one_size(self) -> MeshEntry:
        if self.size_m is not None and self.scale != 1.0:
            raise ValueError("give scale or size_m, not both")
        return self


class GripperEntry(Strict):
    """How a robot holds things; see ``generator.core.geometry.Gripper``."""

    link: str
    grasp_offset_m: float
    """From the link's origin to the point between the finger tips, along the link's Z."""
    finger_joints: tuple[str, ...]
    """Joints that close the hand; those that mimic one of them need not be listed."""
    stroke_m: Annotated[float, Field(gt=0.0)]
    open_at: Literal["lower", "upper"] = "upper"
    """Limit of the finger joints at which the hand is open (Robotiq's: lower)."""


class RobotEntry(Origin):
    """A robot."""

    id: Id
    file: str
    """URDF file, relative to the folder."""
    category: Annotated[str, Field(min_length=1, max_length=60)] = "robot"
    tags: tuple[Word, ...] = ()
    home: dict[str, float] = Field(default_factory=dict)
    """Position [rad or m] per joint; by default 0, or the middle where 0 is out of limits."""
    gripper: GripperEntry | None = None
    touching: tuple[tuple[str, str], ...] = ()
    """Link pairs that touch by design, besides neighbours."""
    palette: bool = False
    """The meshes' images only hold their colours: each material takes its median colour."""
    max_faces: Annotated[int, Field(ge=100)] = 2_000
    """Per link."""
    materials: dict[str, Finish] = Field(default_factory=dict)


class ImageEntry(Origin):
    """A texture (any image) or an environment (a panorama, Radiance .hdr or OpenEXR)."""

    id: Id
    file: str
    tags: tuple[Word, ...] = ()


class Index(Origin):
    """The document."""

    assets: tuple[MeshEntry, ...] = ()
    robots: tuple[RobotEntry, ...] = ()
    textures: tuple[ImageEntry, ...] = ()
    environments: tuple[ImageEntry, ...] = ()


Entry = MeshEntry | RobotEntry | ImageEntry
Kind = Literal["object", "robot", "texture", "environment"]


@dataclass(frozen=True)
class Listed:
    """An entry under its final id.

    Attributes:
        asset_id: Unique in the library.
        root: Folder that ``entry.file`` is relative to.
        origin: Licence, author and source, the document's where the entry gives none.
    """

    asset_id: str
    kind: Kind
    root: Path
    entry: Entry
    origin: Origin

    def tags(self) -> tuple[str, ...]:
        """What it is selected by: its own tags, and its category as one word."""
        category = getattr(self.entry, "category", "")
        own = {*self.entry.tags, category.replace(" ", "_")} - {""}
        return tuple(sorted(own))


def read_index(path: Path) -> Index:
    """The index in a YAML file. Raises ConfigError naming every fault with its place."""
    problems = Problems()
    index = validate(load(path), Index, problems)
    problems.raise_if_any()
    assert index is not None
    return index


def listed(index: Index, root: Path, prefix: str = "") -> Iterator[Listed]:
    """Every asset of an index; series are written out."""
    kinds: tuple[tuple[Kind, tuple[Entry, ...]], ...] = (
        ("object", index.assets),
        ("robot", index.robots),
        ("texture", index.textures),
        ("environment", index.environments),
    )
    for kind, entries in kinds:
        for entry in entries:
            origin = Origin(
                licence=entry.licence or index.licence,
                author=entry.author or index.author,
                source=entry.source or index.source,
            )
            for one in _series(entry):
                yield Listed(f"{prefix}{one.id}", kind, root, one, origin)


def user_folder(root: Path) -> Iterator[Listed]:
    """The assets of a user's folder, by its index or, without one, by what lies in it.

    Raises:
        AssetError: if the folder does not exist.
        ConfigError: if its index is wrong.
    """
    if not root.is_dir():
        raise AssetError(f"{root}: no such folder; create it or correct the list of asset folders")
    path = root / INDEX_NAME
    index = read_index(path) if path.exists() else _found(root)
    yield from listed(index, root, prefix="user/")


def _found(root: Path) -> Index:
    """An index of every mesh and URDF in a folder; meshes that a URDF uses are not listed twice."""
    files = []
    for path in sorted(root.rglob("*")):
        if path.suffix.lower() in {*MESH_SUFFIXES, ".urdf", ROAD_SUFFIX}:
            files.append(path.relative_to(root).as_posix())
        if len(files) > _MAX_FILES:
            raise AssetError(f"{root}: more than {_MAX_FILES} meshes; write an {INDEX_NAME}")
    used = {f for name in files if name.lower().endswith(".urdf") for f in _meshes_of(root, name)}
    return Index(
        licence="unknown",
        author="unknown",
        source=str(root.resolve().name),
        assets=tuple(
            MeshEntry(id=_id_of(name), file=name, category=_category(root, name),
                      tags=(_word(_category(root, name)),))
            for name in files if name not in used
        ),
    )  # fmt: skip


def _meshes_of(root: Path, urdf: str) -> tuple[str, ...]:
    from generator.assets.urdf import read_urdf

    try:
        return read_urdf(Folder(root), urdf).files()
    except AssetError:
        # Listed all the same: whoever asks for it is told what is wrong with it.
        return ()


def _category(root: Path, name: str) -> str:
    return PurePosixPath(name).parent.name or root.resolve().name


def _word(text: str) -> str:
    return "".join(c if c.isascii() and (c.isalnum() or c in "_-") else "_" for c in text) or "_"


def _id_of(name: str) -> str:
    path = PurePosixPath(name)
    return "/".join(_word(part).lstrip("-") or "_" for part in (*path.parent.parts, path.stem))


def _series(entry: Entry) -> Iterator[Entry]:
    count = getattr(entry, "count", 1)
    if count == 1:
        yield entry
        return
    left_out = frozenset(getattr(entry, "except_for", ()))
    for k in (k for k in range(count) if k not in left_out):
        number = f"{k:03d}"
        yield entry.model_copy(
            update={
                "id": entry.id.replace("000", number),
                "file": entry.file.replace("000", number),
            }
        )
