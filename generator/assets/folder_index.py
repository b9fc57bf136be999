"""``assets.yaml``: index of the assets in a folder, with the parameters of their import.

The same format describes a user's folder and the files of pybullet (``pybullet.yaml``). Without an
index, every mesh, URDF file and panorama of a folder is an asset, named by its path and categorised
by its folder.
"""

from __future__ import annotations

import glob
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, count
from pathlib import Path, PurePosixPath
from typing import Annotated, Literal, TypeVar

from pydantic import AfterValidator, Field, model_validator

from gen_data.assets import robot_formats
from gen_data.assets.asset_folder import (
    Folder,
    asset_id_from_path,
    category_from_path,
    is_pattern,
    list_files,
    match_files,
    sanitize_word,
)
from gen_data.assets.image_decoding import may_be_panorama
from gen_data.assets.readers import MESH_SUFFIXES
from gen_data.assets.texture_maps import TextureMaps as Maps
from gen_data.config.base_model import Strict
from gen_data.config.problems import Problems
from gen_data.config.validation import validate
from gen_data.config.yaml_tree import Node, find_text, load_yaml
from gen_data.core import asset_types, scene, se3
from gen_data.core.errors import AssetError, did_you_mean
from gen_data.core.path_names import CATEGORY_MAX, check_name

INDEX_NAME = "assets.yaml"
ROAD_SUFFIX = ".xodr"
"""Suffix of road networks: objects whose mesh is the road surface."""
PANORAMA_SUFFIXES = frozenset({".hdr", ".exr"})
USER_TAG = "user"
"""Tag of every asset of a user's folder."""
METRES_PER_UNIT = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254, "ft": 0.3048}

Length = Annotated[float, Field(gt=0.0)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Luminance = Annotated[float, Field(ge=0.0)]
Id = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-]*(/[A-Za-z0-9_][A-Za-z0-9_.\-]*)*$",
                          max_length=120)]  # fmt: skip
Category = Annotated[str, AfterValidator(partial(check_name, longest=CATEGORY_MAX))]
Axis = Literal["x", "-x", "y", "-y", "z", "-z"]
Word = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_\-]*$", max_length=60)]


class TextureMaps(Strict):
    """Image files of one surface, relative to the folder; all are resized to the largest.

    Attributes:
        color: sRGB.
        alpha: Grey; values below one half are holes.
        normal: Tangent space, +Y up (OpenGL); green is inverted of files that are for DirectX by
            their names (``rock_nor_dx_2k.png``, ``Rock_NormalDX.jpg``).
        orm: Occlusion in red, roughness in green, metallic in blue, as glTF packs them.
        roughness, metallic, occlusion: Grey images, instead of ``orm``; a roughness that is gloss
            by its name (``rock_gloss.png``) is inverted.
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
        """Name of the combined texture; see ``texture_maps``."""
        orm = self.orm
        roughness = self.roughness + ("!0-" if _GLOSS.search(self.roughness) else "")
        return Maps(
            albedo=self.color,
            alpha=self.alpha,
            normal=self.normal + ("!1-" if _DIRECTX.search(self.normal) else ""),
            occlusion=f"{orm}!0" if orm else self.occlusion,
            roughness=f"{orm}!1" if orm else roughness,
            metallic=f"{orm}!2" if orm else self.metallic,
            emission=self.emission,
        ).name()

    def remarks(self) -> dict[str, str]:
        """Images that are inverted because of their names, with the reason."""
        found = {}
        if _DIRECTX.search(self.normal):
            found[self.normal] = "for DirectX by its name; its green is inverted"
        if _GLOSS.search(self.roughness):
            found[self.roughness] = "gloss by its name; inverted to roughness"
        return found


_DIRECTX = re.compile(r"(?i)no?rm?(?:als?)?[-_. ]?(?:dx|directx)(?![a-z])[^/]*$")
"""Poly Haven's ``_nor_dx``, ambientCG's ``_NormalDX`` and their like."""
_GLOSS = re.compile(r"(?i)(?:^|/)(?![^/]*rough)[^/]*(?<![a-z])gloss(?:iness)?(?![a-z])[^/]*$")


class Finish(Strict):
    """Changes to a material; omitted fields keep the file's values."""

    base_color: tuple[Fraction, Fraction, Fraction] | None = None
    """Linear RGB."""
    roughness: Fraction | None = None
    metallic: Fraction | None = None
    specular: Fraction | None = None
    coat: Fraction | None = None
    """Weight of a clear coat."""
    coat_roughness: Fraction | None = None
    transmission: Fraction | None = None
    """Share of the light entering the surface that is transmitted."""
    ior: Annotated[float, Field(ge=1.0, le=4.0)] | None = None
    thin: bool | None = None
    """True: transmission as through a thin pane; false: through a refracting solid."""
    opacity: Fraction | None = None
    diffuse_transmission: tuple[Fraction, Fraction, Fraction] | None = None
    """Albedo of the light that a thin sheet, such as a leaf, scatters to its other side."""
    emission_cd_m2: tuple[Luminance, Luminance, Luminance] | None = None
    printed: bool | None = None
    """The image identifies the object; randomizers do not change it."""
    textured: Literal[False] | None = None
    """False: drop the file's image."""
    maps: TextureMaps | None = None
    """Images instead of the file's; ``base_color``, ``roughness`` and ``metallic`` multiply them
    (default 1)."""
    texture_scale_m: Annotated[float, Field(gt=0.0)] | None = None
    """Length of one repeat of the images in triplanar projection; by default the mesh's texture
    coordinates are used."""
    role: Word | None = None
    """Function on the object: paint, glass, tyre, ...; see ``core.asset_types``."""


class Point(Strict):
    """A keypoint; see ``gen_data.core.asset_types``."""

    name: Word
    position_m: tuple[float, float, float]
    """In the frame of the finished asset."""
    radius_m: Annotated[float, Field(gt=0.0)] = 0.05


class SymmetryEntry(Strict):
    """Rotational symmetry of an object, as in BOP's ``models_info.json``."""

    axis: Literal["x", "y", "z"] | tuple[float, float, float]
    """In the frame of the finished asset."""
    fold: Annotated[int, Field(ge=2, le=360)] | None = None
    """Order of the symmetry: 4 = every 90 degrees; by default every angle."""
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """A point on the axis."""

    @model_validator(mode="after")
    def _check_axis(self) -> SymmetryEntry:
        if not any(self.direction()):
            raise ValueError("expected an axis with non-zero length")
        return self

    def direction(self) -> se3.Vec3:
        """Axis vector, not normalised."""
        named = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
        return named[self.axis] if isinstance(self.axis, str) else self.axis


class Region(Strict):
    """Triangles of a material that get their own finish, such as a lamp in a textured body."""

    material: str
    """``fnmatch`` pattern of the material's name in the file."""
    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    """Box that contains the triangles' centres, in the frame of the finished asset."""
    finish: Finish


class Origin(Strict):
    """Licence, author and source; entries inherit missing values from their document."""

    licence: str = ""
    author: str = ""
    source: str = ""


class MeshEntry(Origin):
    """An object."""

    id: Id | None = None
    """By default the file's path without its suffix."""
    file: str
    """Mesh, URDF, OpenUSD or OpenDRIVE file, relative to the folder; ``*``, ``?`` and ``**``
    select all matching files."""
    category: Category | None = None
    """Category in labels; by default the name of the file's folder."""
    subcategory: str = ""
    """A finer name than the category."""
    attributes: dict[Word, Word] = Field(default_factory=dict)
    """Additional attributes in labels."""
    tags: tuple[Word, ...] = ()
    count: Annotated[int, Field(ge=1, le=100_000)] = 1
    """More than 1: a series; ``000`` in ``id`` and ``file`` is replaced by the number, from 0."""
    except_for: tuple[Annotated[int, Field(ge=0)], ...] = ()
    """Numbers missing from the series."""
    scale: Annotated[float, Field(gt=0.0)] = 1.0
    """Metres per unit of the file."""
    unit: Literal["mm", "cm", "m", "in", "ft"] | None = None
    """Unit of the file's coordinates; instead of scale."""
    size_m: Length | tuple[Length, Length, Length] | None = None
    """Longest edge of the bounding box, or its edges along X, Y and Z; instead of scale. Three
    edges must agree with the file's proportions to within 5 %."""
    up: Literal["x", "y", "z"] | None = None
    """Axis of the file that points up; by default y for glTF, the stage's own for USD, z for
    other formats."""
    front: Axis | None = None
    """Axis of the file that points forward and becomes +X; instead of yaw_deg."""
    yaw_deg: float = 0.0
    """Rotation about the vertical that turns the front to +X."""
    origin: Literal["center", "floor", "file"] = "center"
    """Origin of the asset: centre of the bounding box, of its bottom face (furniture), or the
    file's own, to which poses of CAD models and of real data sets refer."""
    mass_kg: Annotated[float, Field(ge=0.0)] = 0.0
    stackable: bool = False
    collision: str = ""
    """Mesh file with the collision geometry; by default the URDF's, else the mesh itself."""
    parts: Annotated[int, Field(ge=1, le=24)] = 8
    """Largest number of convex parts of a concave mesh without a collision file."""
    max_faces: Annotated[int, Field(ge=100)] = 20_000
    materials: dict[str, Finish] = Field(default_factory=dict)
    """Finishes by material name or pattern (``*`` = all others). Exact names take precedence over
    patterns, longer patterns over shorter ones."""
    regions: tuple[Region, ...] = ()
    """Applied in order, after ``materials``."""
    keypoints: tuple[Point, ...] = ()

    symmetries: tuple[SymmetryEntry, ...] = ()

    @model_validator(mode="after")
    def _check_choices(self) -> MeshEntry:
        scaled = {"scale": self.scale != 1.0, "size_m": self.size_m, "unit": self.unit}
        given = [name for name, value in scaled.items() if value]
        if len(given) > 1:
            raise ValueError(f"give {' or '.join(given)}, not both")
        if self.front is not None and self.yaw_deg != 0.0:
            raise ValueError("give front or yaw_deg, not both")
        if self.front is not None and self.front[-1] == self.up_axis():
            raise ValueError(f"front is {self.front}, but {self.up_axis()} points up")
        if is_pattern(self.file) and (self.id is not None or self.count > 1):
            raise ValueError("a file pattern takes neither id nor count: every file has its own id")
        return self

    @property
    def is_one_of_several(self) -> bool:
        """Whether it is of a series or a file pattern, whose ids follow from the files."""
        return self.count > 1 or self.id == asset_id_from_path(self.file)

    def metres_per_unit(self) -> float:
        """Metres per unit of the file, if no size is given."""
        return METRES_PER_UNIT[self.unit] if self.unit else self.scale

    def up_axis(self) -> str:
        """Axis of the file that points up; the reader of USD stages already turns them to Z up."""
        return self.up or ("y" if self.file.lower().endswith((".glb", ".gltf")) else "z")

    def files(self) -> tuple[str, ...]:
        """The files that it names."""
        images = [f.maps for f in (*self.materials.values(), *(r.finish for r in self.regions))]
        return _unique_files(self.file, self.collision, *images)


class GripperEntry(Strict):
    """Gripper of a robot; see ``gen_data.core.asset_types.Gripper``."""

    link: str
    grasp_offset_m: float
    """Distance from the link's origin to the point between the finger tips, along the link's Z;
    9 mm behind their ends, as programs of tasks assume."""
    finger_joints: tuple[str, ...]
    """Joints that close the gripper; joints that mimic them may be omitted."""
    stroke_m: Annotated[float, Field(gt=0.0)]
    open_at: Literal["lower", "upper"] = "upper"
    """Limit of the finger joints at which the gripper is open (Robotiq: lower)."""


class ToolEntry(Strict):
    """A gripper on the flange of an arm: made by code (see ``robot_tools``), or from a file."""

    kind: Literal["fingers", "suction", "file"]
    file: str = ""
    """Description of the gripper, of kind ``file``; ``gripper`` states how it holds."""
    flange: str
    """Link whose Z points out of the arm."""
    offset_m: float = 0.0
    """From the flange link's origin to the face that the tool is screwed to, along Z."""
    yaw_deg: float = 0.0
    """Of the tool about Z; at 0 its fingers open along the flange's Y."""
    instead_of: str = ""
    """Link that is left out, with all below it; empty = none."""

    @model_validator(mode="after")
    def _has_a_file(self) -> ToolEntry:
        if (self.kind == "file") != bool(self.file):
            raise ValueError("expected file with kind: file, and with no other kind")
        return self


class RobotEntry(Origin):
    """A robot."""

    id: Id | None = None
    file: str
    """URDF, MJCF or SDF file, relative to the folder."""
    category: Category = "robot"
    tags: tuple[Word, ...] = ()
    home: dict[str, float] = Field(default_factory=dict)
    """Position [rad or m] per joint; by default 0, or mid-range if 0 is outside the limits."""
    gripper: GripperEntry | None = None
    tool: ToolEntry | None = None
    """Instead of a gripper in its description."""
    workspace_from_m: Annotated[float, Field(ge=0.0)] = asset_types.WORKSPACE_FROM_M
    """Horizontal distance from the base to where its workspace on a table begins: the objects of
    tasks lie so much nearer or farther."""
    touching: tuple[tuple[str, str], ...] = ()
    """Link pairs in permanent contact, besides neighbours."""
    palette: bool = False
    """The meshes' images are colour palettes: each material takes the median colour it uses."""
    max_faces: Annotated[int, Field(ge=100)] = 2_000
    """Per link."""
    materials: dict[str, Finish] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _has_one_hand(self) -> RobotEntry:
        made = self.tool is not None and self.tool.kind != "file"
        if self.gripper is not None and made:
            raise ValueError("expected either gripper or a tool made by code")
        return self

    def files(self) -> tuple[str, ...]:
        """The files that it names."""
        tool = self.tool.file if self.tool else ""
        return _unique_files(self.file, tool, *(f.maps for f in self.materials.values()))


class TextureEntry(Origin):
    """A texture: one image, or several images of one surface."""

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
        """Name of its image or images; see ``gen_data.assets.texture_maps``."""
        return self.maps.name() if self.maps else self.file

    def files(self) -> tuple[str, ...]:
        """The files that it names."""
        return _unique_files(self.file, self.maps)


class ImageEntry(Origin):
    """An environment: a panorama, Radiance .hdr or OpenEXR, twice as wide as high."""

    id: Id | None = None
    file: str
    tags: tuple[Word, ...] = ()

    def files(self) -> tuple[str, ...]:
        """The files that it names."""
        return (self.file,)


PointPx = tuple[float, float]


class LevelHorizon(Strict):
    """A horizon by its height in the middle of the photograph."""

    height_px: float
    """Row of the horizon in the middle column, from the top."""
    roll_deg: float = Field(0.0, gt=-45, lt=45)
    """Slope of the horizon; positive falls to the right."""


class PlateSunEntry(Strict):
    """The sun of a photograph, of which shadows show the direction."""

    azimuth_deg: float
    """From the viewing direction, positive to the left; 180 = behind the camera."""
    elevation_deg: Annotated[float, Field(ge=2.0, le=90.0)]
    share: Annotated[float, Field(ge=0.0, le=1.0)] = 0.8
    """Share of the light on level ground; the default is for a clear sky (assumed, within 0.1)."""


class PlateLane(Strict):
    """A lane on the ground of a photograph."""

    kind: scene.LaneKind = "driving"
    center_px: Annotated[tuple[PointPx, ...], Field(min_length=2)]
    """Points of its centre line, in the direction of travel."""
    width_m: Length = 3.0


class PlateEntry(Origin):
    """A photograph as backdrop; see ``core.plates``. Pixels are counted from the top left."""

    id: Id | None = None
    file: str
    camera_height_m: Length
    """Height of the camera above the ground."""
    ground: Annotated[tuple[PointPx, ...], Field(min_length=3)]
    """Corners of the ground on which objects may stand [px]."""
    hfov_deg: Annotated[float, Field(ge=5.0, le=150.0)] | None = None
    """Horizontal field of view; by default from the photograph's EXIF data, else estimated."""
    horizon: LevelHorizon | tuple[PointPx, PointPx] | None = None
    """Two points of the horizon [px], or its height; by default estimated from straight edges."""
    mask: str = ""
    """Image of the foreground, of the photograph's size: white hides inserted objects."""
    lanes: tuple[PlateLane, ...] = ()
    sun: PlateSunEntry | None = None
    """By default the light comes from the sky alone."""
    ground_albedo: Annotated[float, Field(gt=0.0, le=1.0)] = 0.15
    """Reflectance of the ground, which sets the brightness of inserted objects against it. Asphalt:
    0.04 when new, 0.12 after five years, at most 0.16 (LBNL Heat Island Group, "Pavement albedo");
    other ground 0.2 to 0.4, snow 0.8 (assumed, within a factor of 1.5)."""
    ground_roughness: Fraction = 0.9
    """Less for ground that mirrors the objects on it."""
    tags: tuple[Word, ...] = ()

    def files(self) -> tuple[str, ...]:
        """The files that it names."""
        return _unique_files(self.file, self.mask)


class FolderIndex(Origin):
    """Content of ``assets.yaml``."""

    assets: tuple[MeshEntry, ...] = ()
    robots: tuple[RobotEntry, ...] = ()
    textures: tuple[TextureEntry, ...] = ()
    environments: tuple[ImageEntry, ...] = ()
    plates: tuple[PlateEntry, ...] = ()


_FILE_NAME = re.compile(rb"""\bfile\s*=\s*["']([^"'<>]{1,500})["']""")
Model = TypeVar("Model", bound=Strict)
Entry = MeshEntry | RobotEntry | TextureEntry | ImageEntry | PlateEntry
Kind = Literal["object", "robot", "texture", "environment", "plate"]
_SECTIONS: dict[Kind, str] = {
    "object": "assets", "robot": "robots", "texture": "textures", "environment": "environments",
    "plate": "plates",
}  # fmt: skip


@dataclass(frozen=True)
class IndexedAsset:
    """An entry under its final id.

    Attributes:
        asset_id: Unique in the library.
        root: Folder that ``entry.file`` is relative to.
        origin: Licence, author and source, inherited from the document where missing.
        common_tags: Tags of every asset of its folder.
    """

    asset_id: str
    kind: Kind
    root: Path
    entry: Entry
    origin: Origin
    common_tags: tuple[str, ...] = ()

    def place(self) -> str:
        """Path of its file."""
        return str(self.root / self.entry.file)

    def tags(self) -> tuple[str, ...]:
        """Its own tags, its folder's, and its category as one word."""
        own = {*self.entry.tags, *self.common_tags, self.category().replace(" ", "_")} - {""}
        return tuple(sorted(own))

    def category(self) -> str:
        """Category in labels; empty for images."""
        if isinstance(self.entry, MeshEntry):
            return self.entry.category or category_from_path(self.root, self.entry.file)
        return self.entry.category if isinstance(self.entry, RobotEntry) else ""


def read_index(path: Path) -> FolderIndex:
    """Read an index. Raises ConfigError listing every fault with its place."""
    return read_document(path, FolderIndex)[0]


def read_document(path: Path, model: type[Model]) -> tuple[Model, Node]:
    """Read and validate a YAML file. Raises ConfigError listing every fault with its place."""
    problems, document = Problems(), load_yaml(path)
    value = validate(document, model, problems)
    problems.raise_if_any()
    assert value is not None
    return value, document


def list_assets(
    index: FolderIndex, root: Path, prefix: str = "", common_tags: tuple[str, ...] = ()
) -> Iterator[IndexedAsset]:
    """Yield every asset of an index, with series and patterns expanded."""
    files: tuple[str, ...] | None = None
    for kind, section in _SECTIONS.items():
        for entry in getattr(index, section):
            origin = Origin(
                licence=entry.licence or index.licence,
                author=entry.author or index.author,
                source=entry.source or index.source,
            )
            if is_pattern(entry.file) and files is None:
                files = list_files(root)
            for one in _expand(entry, files or ()):
                name = one.id or asset_id_from_path(one.file)
                yield IndexedAsset(f"{prefix}{name}", kind, root, one, origin, common_tags)


def user_folder(root: Path) -> Iterator[IndexedAsset]:
    """Yield the assets of a user's folder, from its index or, without one, from its files.

    Raises:
        AssetError: if the folder does not exist or cannot be read.
        ConfigError: if its index is wrong, or names files that do not exist.
    """
    if not root.is_dir():
        raise AssetError(f"{root}: no such folder; create it or correct the list of asset folders")
    path = root / INDEX_NAME
    index = _user_index(root, path) if path.exists() else _index_files(root)
    yield from _tell_apart(list_assets(index, root, _USER, (USER_TAG,)))


_USER = "user/"


def _tell_apart(listed: Iterable[IndexedAsset]) -> Iterator[IndexedAsset]:
    """Yield assets; files whose paths differ in their suffixes only keep it in their ids."""
    assets = list(listed)
    counts = Counter(one.asset_id for one in assets)
    taken = {name for name, number in counts.items() if number == 1}
    for one in assets:
        derived = f"{_USER}{asset_id_from_path(one.entry.file)}"
        if counts[one.asset_id] > 1 and one.asset_id == derived:
            suffix = sanitize_word(PurePosixPath(one.entry.file).suffix.lstrip("."))
            whole = f"{derived}.{suffix}"
            candidates = chain([whole], (f"{whole}_{k}" for k in count(2)))
            chosen = next(name for name in candidates if name not in taken)
            taken.add(chosen)
            one = replace(one, asset_id=chosen)  # noqa: PLW2901
        yield one


def _user_index(root: Path, path: Path) -> FolderIndex:
    """Read the index of a user's folder and check that its files exist."""
    index, document = read_document(path, FolderIndex)
    problems = Problems()
    _check_files(index, root, document, problems)
    problems.raise_if_any()
    return index


def _check_files(index: FolderIndex, root: Path, document: Node, problems: Problems) -> None:
    folder, below = Folder(root), None
    for section in _SECTIONS.values():
        for number, entry in enumerate(getattr(index, section)):
            missing = [
                file
                for file in {f for one in _expand_series(entry) for f in one.files()}
                if not is_pattern(file) and not folder.exists(file)
            ]
            if is_pattern(entry.file) and not match_files(entry.file, below or list_files(root)):
                missing.append(entry.file)
            if not missing:
                continue
            below = below or list_files(root)
            name = min(missing)
            entry_node = document.get(section, number) or document
            position, field = find_text(entry_node, name) or (entry_node.position, "file")
            kind = "matches no file" if is_pattern(name) else "no such file"
            near = did_you_mean(name, below) or f"; the folder has {_count_by_suffix(below)}"
            if not (root / name).resolve().is_relative_to(root.resolve()):
                kind, near = "is outside of the folder", f"; expected a file in {root}"
            problems.add(position, f"{section}[{number}].{field}", f"'{name}': {kind}{near}")


def _count_by_suffix(files: tuple[str, ...]) -> str:
    """Number of files by suffix, most frequent first: ``12 .obj, 3 .png``."""
    counts = Counter(PurePosixPath(file).suffix.lower() or "without suffix" for file in files)
    return ", ".join(f"{count} {suffix}" for suffix, count in counts.most_common(6)) or "no file"


def _index_files(root: Path) -> FolderIndex:
    suffixes = {name: PurePosixPath(name).suffix.lower() for name in list_files(root)}
    meshes = {*MESH_SUFFIXES, *robot_formats.LISTED_SUFFIXES, ROAD_SUFFIX}
    files = [
        name
        for name, suffix in suffixes.items()
        if suffix in meshes and (suffix != robot_formats.MJCF_SUFFIX or _is_mjcf(root, name))
    ]
    panoramas = [
        name
        for name, suffix in suffixes.items()
        if suffix in PANORAMA_SUFFIXES
        # Next to meshes, other OpenEXR files are images of their materials.
        and (suffix != ".exr" or not files or may_be_panorama(root / name))
    ]
    used = {
        f
        for name in files
        if robot_formats.is_description(name)
        for f in _described_files(root, name)
    }
    return FolderIndex(
        licence="unknown",
        author="unknown",
        source=str(root.resolve().name),
        assets=tuple(
            MeshEntry(
                file=glob.escape(name),
                category=(category := _category(root, name)),
                tags=(sanitize_word(category),),
            )
            for name in files
            if name not in used
        ),
        environments=tuple(ImageEntry(file=glob.escape(name)) for name in panoramas),
    )


def _category(root: Path, name: str) -> str:
    """Category of a file by its folder, as labels and names of files may hold it."""
    category = category_from_path(root, name)[:CATEGORY_MAX]
    try:
        return check_name(category)
    except ValueError:
        return sanitize_word(category)


def _is_mjcf(root: Path, file: str) -> bool:
    data = Folder(root).read(file)
    return b"<mujoco" in data and b"<worldbody" in data


def _described_files(root: Path, description: str) -> tuple[str, ...]:
    """Files that belong to a description, and are not assets themselves."""
    try:
        if robot_formats.is_foreign(description):
            # Its own reader starts a process: the names of its files are enough here.
            names = set(_FILE_NAME.findall(Folder(root).read(description)))
            parts = {PurePosixPath(name.decode("utf-8", "replace")).name for name in names}
            return tuple(file for file in list_files(root) if PurePosixPath(file).name in parts)
        return robot_formats.read_description(Folder(root), description).files()
    except AssetError:
        # It is listed nevertheless; its import reports the fault.
        return ()


def entry_maps(entry: Entry) -> tuple[TextureMaps, ...]:
    """All maps of an entry."""
    if isinstance(entry, TextureEntry):
        found = [entry.maps]
    elif isinstance(entry, MeshEntry | RobotEntry):
        regions = entry.regions if isinstance(entry, MeshEntry) else ()
        finishes = (*entry.materials.values(), *(region.finish for region in regions))
        found = [finish.maps for finish in finishes]
    else:
        found = []
    return tuple(maps for maps in found if maps is not None)


def _unique_files(*parts: str | TextureMaps | None) -> tuple[str, ...]:
    names: set[str] = set()
    for part in parts:
        names |= set(part.files()) if isinstance(part, TextureMaps) else {part or ""}
    return tuple(sorted(names - {""}))


def _expand(entry: Entry, files: tuple[str, ...]) -> Iterator[Entry]:
    if is_pattern(entry.file):
        for file in match_files(entry.file, files):
            yield entry.model_copy(update={"id": asset_id_from_path(file), "file": file})
    else:
        yield from _expand_series(entry)


def _expand_series(entry: Entry) -> Iterator[Entry]:
    if not isinstance(entry, MeshEntry) or entry.count == 1:
        yield entry
        return
    left_out = frozenset(entry.except_for)
    name = entry.id or asset_id_from_path(entry.file)
    for k in (k for k in range(entry.count) if k not in left_out):
        number = f"{k:03d}"
        yield entry.model_copy(
            update={"id": name.replace("000", number), "file": entry.file.replace("000", number)}
        )
