"""Import of files into the normal form: objects, robot links and road networks.

Objects get their origin at the centre of their bounding box (furniture: of its bottom face), close
to the centre of mass, because physics uses the origin as such. Links keep the frame of the URDF.
Mesh and collision parts always share one frame.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import numpy as np

from gen_data.assets.asset_folder import Folder
from gen_data.assets.content import content
from gen_data.assets.convex_decomposition import convex_parts, single_hull
from gen_data.assets.family import Lazy, Solid
from gen_data.assets.folder_index import Finish, MeshEntry, Region, RobotEntry
from gen_data.assets.image_decoding import decode_image
from gen_data.assets.mesh_decimation import decimate
from gen_data.assets.normal_form import check_coordinates, normal_form
from gen_data.assets.readers import read_mesh, usd
from gen_data.assets.readers.mesh_source import MeshSource, srgb_to_linear
from gen_data.assets.robot_description import RobotDescription, Shape
from gen_data.assets.robot_formats import is_description, read_description
from gen_data.assets.robot_shapes import read_shape
from gen_data.assets.texture_maps import (
    TextureMaps,
    find_maps,
    texel_indices,
    trim_unreached_holes,
)
from gen_data.assets.triangle_soup import Float64, MaterialSlot, TriangleSoup, join_soups
from gen_data.assets.vertex_colors import IMAGE, resolve_colors
from gen_data.core.asset_types import ConvexParts, Keypoint, Material, MeshData, UInt8
from gen_data.core.errors import AssetError, did_you_mean, one_of
from gen_data.core.scene import Lane
from gen_data.core.se3 import SE3, Vec3
from gen_data.roads import opendrive, opendrive_lanes

VERSION = 15
"""Increased whenever the same files are imported as different geometry."""
ROADS_VERSION = 4
"""The same for road networks."""
SIZE_TOLERANCE = 0.05
"""Largest deviation of a mesh's edges from the stated ones, as a share of the longest edge."""
_DEFAULT_FRONT = {"x": "-z", "y": "x", "z": "x"}
_PROTRUSION = re.compile("mirror|antenna|aerial", re.IGNORECASE)
"""Names of parts that 3D boxes of vehicles leave out."""
_MAX_ALBEDO = 0.85
"""Upper bound on diffuse albedo, the albedo of fresh snow; files often use 1 for white."""


@dataclass(frozen=True)
class FileRemarks:
    """Contents of a file that were not used, or not used as the file states.

    Attributes:
        file: Path in the folder.
        unused: One phrase each: colours, texture sets, skins, animations, extensions, ...
    """

    file: str
    unused: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ImportedMesh:
    """An asset in the normal form.

    Attributes:
        mesh: None for a robot link without visual geometry.
        collision: None for a robot link without collision geometry.
        images: ``{name: uint8 [h, w, 3 or 4]}`` of embedded images; transparent ones have four
            channels. A material's texture ``<asset id>#<name>`` refers to one of these, to a file
            of the folder, or to several images (``gen_data.assets.texture_maps``).
        keypoints: Named points in the asset's frame.
        body_bounds_m: Bounds of the mesh without a vehicle's exterior mirrors; None if it has none.
        shift_m: Offset added to the coordinates of the file, scaled and turned upright, to reach
            the asset's origin.
        remarks: Contents of its files that it lacks, per file.
    """

    mesh: MeshData | None
    collision: ConvexParts | None
    images: Mapping[str, UInt8]
    keypoints: tuple[Keypoint, ...] = ()
    body_bounds_m: tuple[Vec3, Vec3] | None = None
    shift_m: Vec3 = (0.0, 0.0, 0.0)
    remarks: tuple[FileRemarks, ...] = ()

    @property
    def nbytes(self) -> int:
        """Total size of its arrays [bytes]."""
        held = sum(image.nbytes for image in self.images.values())
        if self.collision is not None:
            held += sum(part.nbytes for part in self.collision.parts_m)
        return held if self.mesh is None else held + self.mesh.nbytes


def import_object(folder: Folder, entry: MeshEntry, asset_id: str, piece: str = "") -> ImportedMesh:
    """Import an object from its mesh or URDF file. Raises AssetError if it is unusable.

    Args:
        folder: Folder of its files.
        entry: Index entry.
        asset_id: Id of the entry.
        piece: Name of a single mesh of a stage; empty = the whole file.
    """
    place = str(folder.root / entry.file)
    if piece:
        source = _read_piece(folder, entry, piece)
        looks, collides, images = [source.soup], list[TriangleSoup](), source.images
        remarks, up = _remarks_of(entry.file, source.remarks), ""
        entry = entry.model_copy(update={"origin": "center"})
    else:
        looks, collides, images, up, remarks = _read_geometry(folder, entry)
    # Readers of glTF, whose images are embedded, too, must ignore profiles.
    colors = _color_images(looks) if entry.file.lower().endswith(usd.ARCHIVE) else frozenset()
    decoded = _decode_all(images, place, colors)

    def image(name: str) -> UInt8:
        if name in decoded:
            return decoded[name]
        return decode_image(folder.read(name), str(folder.root / name), alpha=True)

    whole = trim_unreached_holes(join_soups(looks), image)
    colored = resolve_colors(whole, entry.max_faces)
    decoded |= {} if colored.image is None else {IMAGE: colored.image}
    owner = f"{asset_id}/{piece}" if piece and decoded else asset_id
    soup = _apply_finishes(colored.soup, entry.materials, place, owner)
    unmatched = _unmatched_materials(entry, soup, is_whole=not piece)
    soup, hidden = _drop_transparent(soup, place)
    remarks = (*remarks, *_remarks_of(entry.file, (*colored.remarks, *hidden, *unmatched)))
    matrix = upright_transform(entry, up)
    soup = soup.transformed(matrix)
    scale, shift = scale_and_shift(soup, entry, place)
    scaling = np.concatenate([scale * np.eye(3), shift[:, None]], axis=1)
    soup = _split_regions(soup.transformed(scaling), entry.regions, place, owner)
    # An image of colours has a cell per triangle: such a soup is decimated already.
    budget = max(entry.max_faces, 0 if colored.image is None else len(soup))
    mesh = normal_form(soup, place, max_faces=budget)
    if collides:
        solid = join_soups(collides).transformed(matrix).transformed(scaling)
        if entry.collision:
            _check_collision(solid, soup, f"{folder.root / entry.collision}", entry.file)
        check_coordinates(solid, place)
    else:
        # Decimated, to keep decomposition fast.
        solid = TriangleSoup.of(mesh.vertices_m.astype(np.float64)[mesh.faces])
        solid = decimate(solid, entry.max_faces) if len(solid) > entry.max_faces else solid
    collision = convex_parts(solid, place, entry.parts)
    keypoints = tuple(Keypoint(p.name, p.position_m, p.radius_m) for p in entry.keypoints)
    x, y, z = shift.tolist()
    return ImportedMesh(
        mesh,
        collision,
        decoded,
        keypoints,
        _bounds_without_mirrors(soup, mesh),
        (x + 0.0, y + 0.0, z + 0.0),
        remarks,
    )


def _check_collision(solid: TriangleSoup, seen: TriangleSoup, place: str, file: str) -> None:
    """Raise AssetError if collision geometry has another unit or other axes than its object.

    It may be larger by half the object's extent, and much smaller.
    """
    low, high, inner_low, inner_high = (
        getattr(soup.corners.reshape(-1, 3), end)(axis=0)
        for soup in (seen, solid)
        for end in ("min", "max")
    )
    extent = float((high - low).max())
    beyond = max((low - inner_low).max(), (inner_high - high).max()) > 0.5 * extent
    if beyond or float((inner_high - inner_low).max()) < 0.05 * extent:
        given, wanted = (
            " x ".join(f"{edge:.4g}" for edge in edges)
            for edges in (inner_high - inner_low, high - low)
        )
        raise AssetError(
            f"{place}: it is {given} m large or elsewhere than {file}, of {wanted} m, with the "
            "unit and axes of that file; export both alike"
        )


def _remarks_of(file: str, unused: tuple[str, ...]) -> tuple[FileRemarks, ...]:
    """The remarks on one file; empty if there are none."""
    return (FileRemarks(file, tuple(dict.fromkeys(unused))),) if unused else ()


def _drop_transparent(soup: TriangleSoup, place: str) -> tuple[TriangleSoup, tuple[str, ...]]:
    """Leave out triangles that nobody sees, such as shadow planes, and remark on them.

    Raises:
        AssetError: if no triangle is left.
    """
    unseen = np.array(
        [s.material.opacity == 0.0 and s.material.transmission == 0.0 for s in soup.slots]
    )[soup.face_slots]
    if not unseen.any():
        return soup, ()
    if unseen.all():
        raise AssetError(f"{place}: all its materials are fully transparent; give one an opacity")
    names = sorted({soup.slots[k].name or "unnamed" for k in np.unique(soup.face_slots[unseen])})
    remark = f"{int(unseen.sum())} fully transparent triangles are left out ({', '.join(names)})"
    return soup.select(~unseen), (remark,)


def _bounds_without_mirrors(soup: TriangleSoup, mesh: MeshData) -> tuple[Vec3, Vec3] | None:
    """Bounds of all groups except those named like mirrors or antennas, inside the mesh's bounds.

    None if no group, or every one, has such a name.
    """
    named = [k for k, name in enumerate(soup.group_names) if _PROTRUSION.search(name)]
    kept = ~np.isin(soup.face_groups, named)
    if kept.all() or not kept.any():
        return None
    points = soup.corners[kept].reshape(-1, 3)
    # Decimation may have moved vertices of the mesh inwards.
    low_m, high_m = (np.clip(edge, *mesh.bounds_m()) for edge in (points.min(0), points.max(0)))
    (x0, y0, z0), (x1, y1, z1) = low_m.tolist(), high_m.tolist()
    return (x0, y0, z0), (x1, y1, z1)


def import_link(
    folder: Folder, entry: RobotEntry, robot_id: str, robot: RobotDescription, link_name: str
) -> ImportedMesh:
    """Import one link of a robot, in the link's frame. Raises AssetError if it is unusable."""
    link = robot.links[link_name]
    place = f"{folder.root / entry.file}: link '{link_name}'"
    mesh = collision = None
    images: dict[str, UInt8] = {}
    remarks: tuple[FileRemarks, ...] = ()
    if link.visuals:
        sources = [read_shape(folder, shape, SE3()) for shape in link.visuals]
        soup = join_soups([source.soup for source in sources])
        for source in sources:
            images |= _decode_all(source.images, place)
        if entry.palette:
            soup = _palette_colors(folder, soup)
        colored = resolve_colors(soup, entry.max_faces)
        images |= {} if colored.image is None else {IMAGE: colored.image}
        unmatched = _unmatched_materials(entry, soup, is_whole=False)
        unused = [text for source in sources for text in source.remarks]
        remarks = _remarks_of(entry.file, (*unused, *colored.remarks, *unmatched))
        # Images inside mesh files belong to the link, all others to the robot.
        owner = f"{robot_id}/{link_name}" if images else robot_id
        soup = _apply_finishes(colored.soup, entry.materials, place, owner)
        budget = max(entry.max_faces, 0 if colored.image is None else len(soup))
        mesh = normal_form(soup, place, max_faces=budget)
    if link.collisions:
        solids = [read_shape(folder, s, SE3(), materials=False).soup for s in link.collisions]
        check_coordinates(join_soups(solids), place)
        # One hull per element and group, as simulators treat the collision meshes of a URDF.
        hulls = [
            (convex_parts(s, place, 1) if np.ptp(s.face_groups) else single_hull(s, place))
            for s in solids
        ]
        collision = ConvexParts(tuple(part for hull in hulls for part in hull.parts_m))
    return ImportedMesh(mesh, collision, images, remarks=remarks)


def _read_geometry(
    folder: Folder, entry: MeshEntry
) -> tuple[
    list[TriangleSoup], list[TriangleSoup], Mapping[str, bytes], str, tuple[FileRemarks, ...]
]:
    """Geometry of an entry.

    Returns:
        Visual soups, collision soups (empty = the visual ones), embedded images, the axis that the
        file states as up (empty = none), and remarks.
    """
    up = ""
    images: Mapping[str, bytes] = {}
    collides: list[TriangleSoup] = []
    if is_description(entry.file):
        thing = read_description(folder, entry.file)
        poses = thing.poses_at_rest()
        visuals = [(s, poses[n]) for n, link in thing.links.items() for s in link.visuals]
        solids = [(s, poses[n]) for n, link in thing.links.items() for s in link.collisions]
        if not visuals:
            raise AssetError(f"{folder.root / entry.file}: no visual geometry; give it a <visual>")
        sources = [read_shape(folder, shape, pose) for shape, pose in visuals]
        looks = [source.soup for source in sources]
        images = {name: data for s in sources for name, data in s.images.items()}
        if [_geometry_key(s) for s in solids] != [_geometry_key(v) for v in visuals]:
            collides = [read_shape(folder, s, pose, materials=False).soup for s, pose in solids]
    else:
        sources = [read_mesh(folder, entry.file)]
        looks, images, up = [sources[0].soup], sources[0].images, sources[0].up
    remarks = _remarks_of(entry.file, tuple(text for s in sources for text in s.remarks))
    if entry.collision:
        collides = [read_mesh(folder, entry.collision, materials=False).soup]
    return looks, collides, images, up, remarks


def _read_piece(folder: Folder, entry: MeshEntry, name: str) -> MeshSource:
    """Read one mesh of a stage. Raises AssetError if there is none of that name."""
    with usd.open_stage(folder, entry.file) as stage:
        pieces = tuple(piece for piece in stage.pieces() if piece.name == name)
        if not pieces:
            raise AssetError(f"{folder.root / entry.file}: has no mesh '{name}'; correct the id")
        return stage.source(pieces)


def _decode_all(
    images: Mapping[str, bytes], place: str, colors: Set[str] = frozenset()
) -> dict[str, UInt8]:
    """Decode images; colours become sRGB."""
    return {
        name: decode_image(data, f"{place}#{name}", alpha=True, color=name in colors)
        for name, data in images.items()
    }


def _color_images(soups: Iterable[TriangleSoup]) -> frozenset[str]:
    """Names of the images that are colours."""
    names = {slot.material.texture for soup in soups for slot in soup.slots} - {""}
    maps = [find_maps(name) or TextureMaps(albedo=name) for name in names]
    return frozenset(image for one in maps for image in (one.albedo, one.emission))


def _geometry_key(placed: tuple[Shape, SE3]) -> tuple[object, ...]:
    shape, pose = placed
    return (shape.kind, shape.file, shape.size, shape.T_link_shape, pose)


def _apply_finishes(
    soup: TriangleSoup, finishes: Mapping[str, Finish], place: str, owner: str
) -> TriangleSoup:
    """Apply finishes, prefix textures with their owner, and limit untextured albedo."""
    slots = []
    for slot in soup.slots:
        finish = _find_finish(slot.name, finishes)
        if slot.missing and not slot.from_file and finish is None:
            raise AssetError(
                f"{place}: material '{slot.name}' {slot.missing}; add it, or give 'materials' in "
                "the asset index"
            )
        material = slot.material
        if material.texture:
            material = replace(material, texture=f"{owner}#{material.texture}")
        else:
            material = _limit_white(material)
        if finish is not None:
            material = _apply_finish(material, finish, owner)
            _check_placeable(material, finish, soup, f"{place}: material '{slot.name}'")
        slots.append(replace(slot, material=material))
    return replace(soup, slots=tuple(slots))


def _unmatched_materials(
    entry: MeshEntry | RobotEntry, soup: TriangleSoup, *, is_whole: bool
) -> Iterator[str]:
    """Remarks on finishes of an entry whose materials the file lacks.

    An entry for several files, links or pieces may name materials of another one: there, a remark
    needs a similar material without a finish.
    """
    names = sorted({slot.name for slot in soup.slots} - {""})
    fields = {f"materials.{name}": name for name in entry.materials if name != "*"}
    if isinstance(entry, MeshEntry):
        regions = enumerate(entry.regions)
        fields |= {f"regions[{k}].material": region.material for k, region in regions}
        is_whole = is_whole and not entry.is_one_of_several
    free = [name for name in names if not any(fnmatchcase(name, p) for p in fields.values())]
    for field, pattern in fields.items():
        is_matched = any(fnmatchcase(name, pattern) or name == pattern for name in names)
        if not is_matched and (is_whole or did_you_mean(pattern, free)):
            known = one_of(pattern, names) if names else "its materials have no names"
            yield f"{field} of the index: the file has no material '{pattern}'; {known}"


def _find_finish(name: str, finishes: Mapping[str, Finish]) -> Finish | None:
    """Finish for a material's name, else for the longest matching pattern; None without one."""
    if name in finishes:
        return finishes[name]
    fitting = [pattern for pattern in finishes if fnmatchcase(name, pattern)]
    return finishes[max(fitting, key=len)] if fitting else None


def _check_placeable(material: Material, finish: Finish, soup: TriangleSoup, place: str) -> None:
    """Raise AssetError if a finish's images have no texture coordinates or scale."""
    if finish.maps is not None and soup.uvs is None and not material.texture_scale_m:
        raise AssetError(
            f"{place} has maps, but the file has no texture coordinates; give texture_scale_m"
        )


def _split_regions(
    soup: TriangleSoup, regions: Sequence[Region], place: str, owner: str
) -> TriangleSoup:
    """Give the triangles of each region a separate slot."""
    for region in regions:
        centers = soup.corners.mean(axis=1)
        inside = ((centers >= region.low_m) & (centers <= region.high_m)).all(axis=1)
        for k, slot in enumerate(soup.slots):
            chosen = inside & (soup.face_slots == k)
            if fnmatchcase(slot.name, region.material) and chosen.any():
                material = _apply_finish(slot.material, region.finish, owner)
                _check_placeable(material, region.finish, soup, f"{place}: region of '{slot.name}'")
                soup = replace(
                    soup,
                    face_slots=np.where(chosen, len(soup.slots), soup.face_slots),
                    slots=(*soup.slots, MaterialSlot("", material, from_file=True)),
                )
    return soup


def _apply_finish(material: Material, finish: Finish, owner: str) -> Material:
    """Override a material with the fields that a finish gives.

    A finish with a colour makes the surface opaque, unless it states otherwise.
    """
    changes = {k: v for k, v in finish.model_dump(exclude={"maps"}).items() if v is not None}
    maps = finish.maps
    if maps is not None:
        changes["texture"] = f"{owner}#{maps.name()}"
        changes.setdefault("texture_scale_m", 0.0)
        if maps.color:
            changes.setdefault("base_color", (1.0, 1.0, 1.0))
        for factor, image in (("roughness", maps.roughness), ("metallic", maps.metallic)):
            if maps.orm or image:
                changes.setdefault(factor, 1.0)
    if "base_color" in changes:
        clear = {"transmission": 0.0, "diffuse_transmission": (0.0, 0.0, 0.0)}
        changes = {"opacity": 1.0, **clear, **changes}
    if changes.pop("textured", None) is False:
        changes["texture"] = ""
    return replace(material, **changes)


def _limit_white(material: Material) -> Material:
    if material.metallic > 0.5 or material.transmission > 0.5:
        return material
    red, green, blue = (min(c, _MAX_ALBEDO) for c in material.base_color)
    return replace(material, base_color=(red, green, blue))


def _palette_colors(folder: Folder, soup: TriangleSoup) -> TriangleSoup:
    """Replace palette images by a colour per slot: the median over its corners' texels.

    The file's own colour wins per channel where it is darker, because exporters write it next to
    the image.
    """
    slots = []
    for k, slot in enumerate(soup.slots):
        chosen = soup.face_slots == k
        if slot.material.texture and soup.uvs is not None and chosen.any():
            image = decode_image(folder.read(slot.material.texture), slot.material.texture)
            rows, columns = texel_indices(soup.uvs[chosen].reshape(-1, 2), image.shape)
            median = np.median(image[rows, columns], axis=0) / 255.0
            own = slot.declared_color
            color = srgb_to_linear((float(median[0]), float(median[1]), float(median[2])))
            red, green, blue = (min(a, b) for a, b in zip(color, own, strict=True))
            material = replace(slot.material, texture="", base_color=(red, green, blue))
            slot = replace(slot, material=material)  # noqa: PLW2901
        slots.append(slot)
    return replace(soup, slots=tuple(slots), uvs=None)


def upright_transform(entry: MeshEntry, stated_up: str = "") -> Float64:
    """Affine map [3, 4] that turns the file's up axis to Z and its front to +X.

    ``stated_up`` is the axis that the file itself states, which ``up`` of the entry overrides.

    Raises:
        AssetError: if the entry's front is the axis that the file states as up.
    """
    axis = entry.up or stated_up or entry.up_axis()
    if entry.front is not None and entry.front[-1] == axis:
        raise AssetError(
            f"{entry.file}: front is {entry.front}, but {axis} of the file points up; correct "
            "front, or give up"
        )
    up = _axis_vector(axis)
    front = _axis_vector(entry.front or _DEFAULT_FRONT[axis])
    axes = np.stack([front, np.cross(up, front), up]) + 0.0
    yaw = math.radians(entry.yaw_deg)
    c, s = round(math.cos(yaw), 12), round(math.sin(yaw), 12)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.concatenate([np.einsum("ij,jk->ik", turn, axes, optimize=False), np.zeros((3, 1))], 1)


def _axis_vector(name: str) -> Float64:
    """Unit vector of an axis: ``x`` or ``-x``."""
    vector: Float64 = np.eye(3)["xyz".index(name[-1])]
    return -vector if name.startswith("-") else vector


def scale_and_shift(soup: TriangleSoup, entry: MeshEntry, place: str) -> tuple[float, Float64]:
    """Metres per unit, and the translation [3] of the scaled soup to the entry's origin.

    Raises:
        AssetError: if it is not finite, or its extents do not fit the entry's size.
    """
    if not np.isfinite(soup.corners).all():
        raise AssetError(f"{place}: holds vertices that are not finite; export it again")
    points = soup.corners.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    scale = entry.metres_per_unit()
    if entry.size_m is not None:
        scale = _scale_to_size(high - low, entry.size_m, place)
    anchor = 0.5 * (low + high)
    if entry.origin == "file":
        anchor = np.zeros(3)
    elif entry.origin == "floor":
        anchor[2] = low[2]
    return scale, -scale * anchor


def _scale_to_size(extents: Float64, size_m: float | Vec3, place: str) -> float:
    """Metres per unit for which the bounding box has the given longest edge or three edges."""
    extent = float(extents.max())
    if not extent > 0.0:
        raise AssetError(f"{place}: has no extent; export it again")
    if not isinstance(size_m, tuple):
        return size_m / extent
    scale = max(size_m) / extent
    edges = " x ".join(f"{edge:.4g}" for edge in scale * extents)
    for edge, wanted in zip(scale * extents, size_m, strict=True):
        if abs(edge - wanted) > SIZE_TOLERANCE * max(size_m):
            raise AssetError(
                f"{place}: scaled to that length, its edges are {edges} m, not "
                f"{' x '.join(f'{edge:g}' for edge in size_m)} m; correct size_m, up or front"
            )
    return scale


def import_road_network(folder: Folder, relative: str) -> ImportedMesh:
    """Import the road surface of an OpenDRIVE file. Raises AssetError if it is unusable."""
    build: Callable[[opendrive.Network], Solid] = Lazy(content().ROAD_NETWORK)
    solid = build(_read_network(folder, relative))
    return ImportedMesh(solid.mesh, solid.collision, {}, solid.keypoints)


@dataclass(frozen=True, slots=True)
class RoadNetworkContent:
    """Content of an OpenDRIVE file besides its surface.

    Attributes:
        lanes: All lanes, in the frame of the surface.
        unused: Names of elements without effect, and their number.
    """

    lanes: tuple[Lane, ...]
    unused: tuple[tuple[str, int], ...]


def road_network_content(folder: Folder, relative: str) -> RoadNetworkContent:
    """Read the lanes of an OpenDRIVE file, in the frame of its surface.

    Raises:
        AssetError: if it is malformed, or linked lanes do not meet.
    """
    network = _read_network(folder, relative)
    return RoadNetworkContent(opendrive_lanes.network_lanes(network), tuple(network.unused.items()))


def _read_network(folder: Folder, relative: str) -> opendrive.Network:
    return opendrive.read_opendrive(folder.read(relative), str(folder.root / relative))
