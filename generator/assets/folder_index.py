"""``assets.yaml``: what the files of a folder are, and how they come to the normal form.

The same document describes a user's folder and what pybullet installs (``pybullet.yaml``). A folder
without one offers every mesh, URDF file and panorama in it, named and categorised by file and
folder.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Annotated, Literal

from pydantic import Field, model_validator

from gen_data.generator.assets.asset_folder import Folder
from gen_data.generator.assets.discovery import (
    category_of,
    files_below,
    id_of,
    is_pattern,
    matching,
    word_of,
)
from gen_data.generator.assets.readers import MESH_SUFFIXES
from gen_data.generator.assets.texture_maps import TextureMaps as Maps
from gen_data.generator.config.base_model import Strict
from gen_data.generator.config.problems import Problems
from gen_data.generator.config.validation import validate
from gen_data.generator.config.yaml_tree import Node, find_text, load_yaml
from gen_data.generator.core.errors import AssetError, did_you_mean
from gen_data.generator.core.se3 import Vec3

INDEX_NAME = "assets.yaml"
ROAD_SUFFIX = ".xodr"
"""Road networks: objects whose mesh is the surface of the roads."""
PANORAMA_SUFFIXES = frozenset({".hdr", ".exr"})
USER_TAG = "user"
"""Every asset of a user's folder carries it."""
METRES_PER_UNIT = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254, "ft": 0.3048}

Length = Annotated[float, Field(gt=0.0)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Luminance = Annotated[float, Field(ge=0.0)]
Id = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-]*(/[A-Za-z0-9_][A-Za-z0-9_.\-]*)*$",
                          max_length=120)]  # fmt: skip
Category = Annotated[str, Field(min_length=1, max_length=60)]
Axis = Literal["x", "-x", "y", "-y", "z", "-z"]
Word = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_\-]*$", max_length=60)]


class TextureMaps(Strict):
    """Image files of one surface, relative to the folder; all are stretched to one size.

    Attributes:
        color: sRGB.
        alpha: Grey: where it is darker than half, there is a hole.
        normal: Tangent space, +Y up (OpenGL).
        orm: Occlusion in red, roughness in green, metallic in blue, as glTF packs them.
        roughness, metallic, occlusion: Instead of ``orm``: grey images.
        emission: sRGB.
    """

    color: str = ""
    alpha: str = ""
    normal: str = ""
    orm: str = ""
    roughness: str = ""
    metallic: str = ""
    occlusion: str = ""
    emission: str = ""

    @model_validator(mode="after")
    def _check_images(self) -> TextureMaps:
        if not self.files():
            raise ValueError("expected an image: color, normal, orm, ...")
        if self.orm and (self.roughness or self.metallic or self.occlusion):
            raise ValueError("give orm, or roughness, metallic and occlusion, not both")
        return self

    def files(self) -> tuple[str, ...]:
        """The image files, each once."""
        return tuple(sorted({file for file in self.model_dump().values() if file}))

    def name(self) -> str:
        """Name of the texture that these images make; see ``texture_maps``."""
        orm = self.orm
        return Maps(
            albedo=self.color,
            alpha=self.alpha,
            normal=self.normal,
            occlusion=f"{orm}!0" if orm else self.occlusion,
            roughness=f"{orm}!1" if orm else self.roughness,
            metallic=f"{orm}!2" if orm else self.metallic,
            emission=self.emission,
        ).name()


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
    maps: TextureMaps | None = None
    """Images instead of the file's own; ``base_color``, ``roughness`` and ``metallic`` multiply
    them, by default with 1."""
    texture_scale_m: Annotated[float, Field(gt=0.0)] | None = None
    """Length of one repeat of the images, projected from three sides; by default the mesh's own
    texture coordinates place them."""
    role: Word | None = None
    """What it is on its object: paint, glass, tyre, ...; see ``core.asset_types``."""


class Point(Strict):
    """A keypoint; see ``gen_data.generator.core.asset_types``."""

    name: Word
    position_m: tuple[float, float, float]
    """In the frame of the finished asset."""
    radius_m: Annotated[float, Field(gt=0.0)] = 0.05


class SymmetryEntry(Strict):
    """A turn that leaves the object as it looks, as BOP's ``models_info.json`` lists them."""

    axis: Literal["x", "y", "z"] | tuple[float, float, float]
    """Of the finished asset's frame."""
    fold: Annotated[int, Field(ge=2, le=360)] | None = None
    """Number of equal turns in a circle: 4 = every 90 degrees; by default every angle."""
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """A point that the axis goes through."""

    @model_validator(mode="after")
    def _check_axis(self) -> SymmetryEntry:
        if not any(self.direction()):
            raise ValueError("expected an axis of some length")
        return self

    def direction(self) -> Vec3:
        """The axis as numbers, of any length."""
        named = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
        return named[self.axis] if isinstance(self.axis, str) else self.axis


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

    id: Id | None = None
    """By default the file's path without its suffix."""
    file: str
    """Mesh, URDF, OpenUSD or OpenDRIVE file, relative to the folder; with ``*``, ``?`` or ``**``,
    all files that match."""
    category: Category | None = None
    """What labels call it; by default the name of the file's folder."""
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
    unit: Literal["mm", "cm", "m", "in", "ft"] | None = None
    """Of the file's coordinates; instead of scale."""
    size_m: Length | tuple[Length, Length, Length] | None = None
    """Longest edge of the bounding box, or its edges along X, Y and Z; instead of scale. Three
    edges must agree with the file's proportions to within 5 %."""
    up: Literal["x", "y", "z"] | None = None
    """Axis of the file that points up; by default y for glTF, what a USD stage says, and z for
    all else."""
    front: Axis | None = None
    """Axis of the file that points to the front, which becomes +X; instead of yaw_deg."""
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

    symmetries: tuple[SymmetryEntry, ...] = ()

    @model_validator(mode="after")
    def _check_choices(self) -> MeshEntry:
        sizes = {"scale": self.scale != 1.0, "size_m": self.size_m is not None}
        given = [
            name for name, is_given in {**sizes, "unit": self.unit is not None}.items() if is_given
        ]
        if len(given) > 1:
            raise ValueError(f"give {' or '.join(given)}, not both")
        if self.front is not None and self.yaw_deg != 0.0:
            raise ValueError("give front or yaw_deg, not both")
        if self.front is not None and self.front[-1] == self.up_axis():
            raise ValueError(f"front is {self.front}, but {self.up_axis()} points up")
        if is_pattern(self.file) and (self.id is not None or self.count > 1):
            raise ValueError("a file pattern has neither id nor count: every file has its own id")
        return self

    def metres_per_unit(self) -> float:
        """Metres per unit of the file, where no size is given."""
        return METRES_PER_UNIT[self.unit] if self.unit else self.scale

    def up_axis(self) -> str:
        """Axis of the file that points up; USD stages are turned by their readers."""
        return self.up or ("y" if self.file.lower().endswith((".glb", ".gltf")) else "z")

    def files(self) -> tuple[str, ...]:
        """The files that it names."""
        images = [f.maps for f in (*self.materials.values(), *(r.finish for r in self.regions))]
        return _files(self.file, self.collision, *images)


class GripperEntry(Strict):
    """How a robot holds things; see ``gen_data.generator.core.asset_types.Gripper``."""

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

    id: Id | None = None
    file: str
    """URDF file, relative to the folder."""
    category: Category = "robot"
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

    def files(self) -> tuple[str, ...]:
        """The files that it names."""
        return _files(self.file, *(finish.maps for finish in self.materials.values()))


class TextureEntry(Origin):
    """A texture: an image, or the images of one surface."""

    id: Id | None = None
    file: str = ""
    maps: TextureMaps | None = None
    """Instead of file."""
    tags: tuple[Word, ...] = ()

    @model_validator(mode="after")
    def _check_images(self) -> TextureEntry:
        if bool(self.file) == (self.maps is not None):
            raise ValueError("expected either file or maps")
        if self.maps is not None and self.id is None:
            raise ValueError("maps need an id")
        return self

    def texture_name(self) -> str:
        """Name of its image or images; see ``gen_data.generator.assets.texture_maps``."""
        return self.maps.name() if self.maps else self.file

    def files(self) -> tuple[str, ...]:
        """The files that it names."""
        return _files(self.file, self.maps)


class ImageEntry(Origin):
    """An environment: a panorama, Radiance .hdr or OpenEXR, twice as wide as high."""

    id: Id | None = None
    file: str
    tags: tuple[Word, ...] = ()

    def files(self) -> tuple[str, ...]:
        """The files that it names."""
        return (self.file,)


class FolderIndex(Origin):
    """``assets.yaml``: what the files of a folder are."""

    assets: tuple[MeshEntry, ...] = ()
    robots: tuple[RobotEntry, ...] = ()
    textures: tuple[TextureEntry, ...] = ()
    environments: tuple[ImageEntry, ...] = ()


Entry = MeshEntry | RobotEntry | TextureEntry | ImageEntry
Kind = Literal["object", "robot", "texture", "environment"]


@dataclass(frozen=True)
class IndexedAsset:
    """An entry under its final id.

    Attributes:
        asset_id: Unique in the library.
        root: Folder that ``entry.file`` is relative to.
        origin: Licence, author and source, the document's where the entry gives none.
        common_tags: Tags of every asset of its folder.
    """

    asset_id: str
    kind: Kind
    root: Path
    entry: Entry
    origin: Origin
    common_tags: tuple[str, ...] = ()

    def tags(self) -> tuple[str, ...]:
        """What it is selected by: its own tags, its folder's, and its category as one word."""
        own = {*self.entry.tags, *self.common_tags, self.category().replace(" ", "_")} - {""}
        return tuple(sorted(own))

    def category(self) -> str:
        """What labels call it; empty for images."""
        if isinstance(self.entry, MeshEntry):
            return self.entry.category or category_of(self.root, self.entry.file)
        return self.entry.category if isinstance(self.entry, RobotEntry) else ""


def read_index(path: Path) -> FolderIndex:
    """The index in a YAML file. Raises ConfigError naming every fault with its place."""
    problems = Problems()
    index = validate(load_yaml(path), FolderIndex, problems)
    problems.raise_if_any()
    assert index is not None
    return index


def list_assets(
    index: FolderIndex, root: Path, prefix: str = "", common_tags: tuple[str, ...] = ()
) -> Iterator[IndexedAsset]:
    """Every asset of an index; series and patterns are written out."""
    files: tuple[str, ...] | None = None
    for kind, entries in _sections(index):
        for entry in entries:
            origin = Origin(
                licence=entry.licence or index.licence,
                author=entry.author or index.author,
                source=entry.source or index.source,
            )
            if is_pattern(entry.file) and files is None:
                files = files_below(root)
            for one in _expanded(entry, files or ()):
                name = one.id or id_of(one.file)
                yield IndexedAsset(f"{prefix}{name}", kind, root, one, origin, common_tags)


def user_folder(root: Path) -> Iterator[IndexedAsset]:
    """The assets of a user's folder, by its index or, without one, by the files in it.

    Raises:
        AssetError: if the folder does not exist or cannot be read.
        ConfigError: if its index is wrong, or names files that do not exist.
    """
    if not root.is_dir():
        raise AssetError(f"{root}: no such folder; create it or correct the list of asset folders")
    path = root / INDEX_NAME
    index = _user_index(root, path) if path.exists() else _index_files(root)
    yield from list_assets(index, root, "user/", (USER_TAG,))


def _user_index(root: Path, path: Path) -> FolderIndex:
    """The index of a user's folder, whose files exist."""
    problems, document = Problems(), load_yaml(path)
    index = validate(document, FolderIndex, problems)
    problems.raise_if_any()
    assert index is not None
    _check_files(index, root, document, problems)
    problems.raise_if_any()
    return index


def _check_files(index: FolderIndex, root: Path, document: Node, problems: Problems) -> None:
    """Note every file that is missing, and every pattern that matches none."""
    folder, below = Folder(root), None
    for section in ("assets", "robots", "textures", "environments"):
        entries: tuple[Entry, ...] = getattr(index, section)
        for number, entry in enumerate(entries):
            missing = [
                file
                for file in {f for one in _series(entry) for f in one.files()}
                if not is_pattern(file) and not folder.exists(file)
            ]
            if is_pattern(entry.file) and not matching(entry.file, below or files_below(root)):
                missing.append(entry.file)
            if not missing:
                continue
            below = below or files_below(root)
            name = min(missing)
            entry_node = document.get(section, number) or document
            position, field = find_text(entry_node, name) or (entry_node.position, "file")
            kind = "matches no file" if is_pattern(name) else "no such file"
            near = did_you_mean(name, below) or f"; the folder has {_count_by_suffix(below)}"
            problems.add(position, f"{section}[{number}].{field}", f"'{name}': {kind}{near}")


def _count_by_suffix(files: tuple[str, ...]) -> str:
    """``12 .obj, 3 .png``, the most frequent first."""
    counts = Counter(PurePosixPath(file).suffix.lower() or "without suffix" for file in files)
    return ", ".join(f"{count} {suffix}" for suffix, count in counts.most_common(6)) or "no file"


def _index_files(root: Path) -> FolderIndex:
    """An index of a folder's files; meshes that a URDF uses are not listed twice."""
    files, panoramas = [], []
    for name in files_below(root):
        suffix = PurePosixPath(name).suffix.lower()
        if suffix in {*MESH_SUFFIXES, ".urdf", ROAD_SUFFIX}:
            files.append(name)
        elif suffix in PANORAMA_SUFFIXES:
            panoramas.append(name)
    used = {f for name in files if name.lower().endswith(".urdf") for f in _meshes_of(root, name)}
    return FolderIndex(
        licence="unknown",
        author="unknown",
        source=str(root.resolve().name),
        assets=tuple(
            MeshEntry(id=id_of(name), file=name, category=category_of(root, name),
                      tags=(word_of(category_of(root, name)),))
            for name in files if name not in used
        ),
        environments=tuple(ImageEntry(id=id_of(name), file=name) for name in panoramas),
    )  # fmt: skip


def _meshes_of(root: Path, urdf: str) -> tuple[str, ...]:
    from gen_data.generator.assets.urdf import read_urdf

    try:
        return read_urdf(Folder(root), urdf).files()
    except AssetError:
        # Listed all the same: its import reports the fault.
        return ()


def _sections(index: FolderIndex) -> tuple[tuple[Kind, tuple[Entry, ...]], ...]:
    return (
        ("object", index.assets),
        ("robot", index.robots),
        ("texture", index.textures),
        ("environment", index.environments),
    )


def _files(*parts: str | TextureMaps | None) -> tuple[str, ...]:
    """Files and the images of maps, each once, sorted."""
    names: set[str] = set()
    for part in parts:
        names |= set(part.files()) if isinstance(part, TextureMaps) else {part or ""}
    return tuple(sorted(names - {""}))


def _expanded(entry: Entry, files: tuple[str, ...]) -> Iterator[Entry]:
    """One entry per file that it stands for."""
    if not is_pattern(entry.file):
        yield from _series(entry)
        return
    for file in matching(entry.file, files):
        yield entry.model_copy(update={"id": id_of(file), "file": file})


def _series(entry: Entry) -> Iterator[Entry]:
    if not isinstance(entry, MeshEntry) or entry.count == 1:
        yield entry
        return
    left_out = frozenset(entry.except_for)
    name = entry.id or id_of(entry.file)
    for k in (k for k in range(entry.count) if k not in left_out):
        number = f"{k:03d}"
        yield entry.model_copy(
            update={"id": name.replace("000", number), "file": entry.file.replace("000", number)}
        )
