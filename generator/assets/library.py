"""Asset library: every mesh, texture, environment and robot by id, in the normal form."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from gen_data.assets import (
    asset_arrays,
    families,
    family_parameters,
    file_library,
    known_bounds,
    paths,
    procedural_library,
)
from gen_data.assets.asset_cache import Arrays, DiskCache, Store, content_key
from gen_data.assets.asset_ids import AssetId, parse_asset_id
from gen_data.assets.importer import FileRemarks, ImportedMesh
from gen_data.core import asset_types, colorimetry, plates, scene, se3, serialization
from gen_data.core.bounded_cache import CountCache, ObjectCache
from gen_data.core.errors import AssetError, UnknownAsset, did_you_mean
from gen_data.core.writing import Writing

VEHICLES = frozenset(
    {"bus", "car", "caravan", "minibus", "motorcycle", "suv", "trailer", "tram", "truck", "van"}
)
"""Categories whose parts named like mirrors or antennas are outside 3D boxes."""
_ENTRIES = 8192
_SUMMARIES = 4096
"""Kept in memory: about 1 and 5 kB each."""
_BOUNDS, _STRIDE_BOUNDS, _WRITING = "bounds 1", "stride bounds 1", "writing 2"
"""Names of stored bounds and lines of text; they change with their definitions."""
_checked: ObjectCache[None] = ObjectCache(4096)
"""Materials whose numbers are finite: many meshes have the same ones."""
_WRITES = "writing"
"""Fact of families with text: true for textures, a function of an object's arguments."""


def open_library(
    user_roots: Sequence[Path] = (),
    cache_dir: Path | None = None,
    packs: Path | None = None,
    provide: Callable[[Path], object] | None = None,
) -> "Library":
    """Open a library of procedural assets, pybullet's, installed packs', and the user's own.

    Files are read on first use.

    Args:
        user_roots: Folders with or without an ``assets.yaml``; their ids start with ``user/``.
        cache_dir: Folder of cached normal forms; by default the user's cache folder.
        packs: Folder of installed packs; by default the user's.
        provide: Called with that folder when files of pybullet are wanted and not here; it may
            install their pack. ``packs.provision.open_assets`` passes such a function.
    """
    roots = tuple(Path(root) for root in user_roots)
    return Library(roots, cache_dir or default_cache_dir(), packs or paths.packs_dir(), provide)


Bounds = tuple[se3.Vec3, se3.Vec3]


@dataclass(frozen=True, slots=True)
class _MeshSummary:
    """Small properties of an asset with a mesh, kept in memory."""

    bounds_m: Bounds
    body_bounds_m: Bounds | None
    materials: tuple[asset_types.Material, ...]
    keypoints: tuple[asset_types.Keypoint, ...]


class Library:
    """Implementation of ``AssetLibrary``; one per process.

    Entries, bounds, materials and keypoints are used hundreds of times per scene and stay in
    memory, as many as scenes are drawn from; ids with free parameters are without number. An asset
    whose files change while a process runs keeps the content read first.
    """

    def __init__(
        self,
        user_roots: tuple[Path, ...],
        cache_dir: Path,
        packs: Path,
        provide: Callable[[Path], object] | None = None,
    ) -> None:
        disk = DiskCache(cache_dir)
        store = Store(disk)
        self._disk = disk
        self._generated = procedural_library.ProceduralLibrary(store)
        self._files = file_library.FileLibrary(packs, user_roots, disk, store, provide)
        self._entries: CountCache[asset_types.Asset] = CountCache(_ENTRIES)
        self._found: dict[tuple[frozenset[str], str], tuple[asset_types.Asset, ...]] = {}
        self._variants: dict[str, tuple[asset_types.Asset, ...]] = {}
        self._summaries: CountCache[_MeshSummary] = CountCache(_SUMMARIES)
        self._boxes: CountCache[tuple[Bounds, ...]] = CountCache(_SUMMARIES)
        self._mean_colors: CountCache[se3.Vec3] = CountCache(_SUMMARIES)
        self._writing: CountCache[tuple[Writing, ...]] = CountCache(_SUMMARIES)

    def get(self, asset_id: str) -> asset_types.Asset:
        """Description of an asset.

        Raises:
            UnknownAsset: there is none.
            AssetError: its family does not take a parameter of the id, or not this value.
        """

        def read() -> asset_types.Asset:
            if not self._is_generated(asset_id):
                return self._files.get(asset_id)
            try:
                return self._generated.get(parse_asset_id(asset_id))
            except AssetError as error:
                raise AssetError(str(error), asset_id) from error

        return self._entries.get(asset_id, read)

    def find(self, tags: Iterable[str], kind: str = "object") -> tuple[asset_types.Asset, ...]:
        """All assets of a kind that have every tag, sorted by id; may be empty."""
        key = (frozenset(tags), kind)
        if key not in self._found:
            found = [
                self._hold(asset)
                for part in (self._generated, self._files)
                for asset in part.find(*key)
            ]
            self._found[key] = tuple(sorted(found, key=lambda asset: asset.asset_id))
        return self._found[key]

    def variants(self, family: str) -> tuple[asset_types.Asset, ...]:
        """All objects of a family that ``find`` offers, sorted by id; empty if there is none.

        Only they are described: descriptions of all objects take a second.
        """
        if "?" in family:
            return ()
        if family not in self._variants:
            if family in self._generated:
                found = [*map(self._hold, self._generated.variants(family, "object"))]
            else:
                files = self._files.find(frozenset(), "object")
                found = [a for a in files if a.asset_id.partition("?")[0] == family]
            self._variants[family] = tuple(sorted(found, key=lambda asset: asset.asset_id))
        return self._variants[family]

    def _hold(self, asset: asset_types.Asset) -> asset_types.Asset:
        """Keep a description: the next look-up by its id reads nothing."""
        return self._entries.get(asset.asset_id, lambda: asset)

    def parameters(
        self, family: str, variants: int = 24
    ) -> tuple[family_parameters.FamilyParameter, ...]:
        """Named draws of a procedural family in its first variants, which it makes.

        Raises:
            UnknownAsset: if there is no such family.
        """
        if not self._is_generated(family):
            raise UnknownAsset(f"asset '{family}': is a file, which has no parameters")
        return self._generated.parameters(family, variants)

    def materials(self, asset_id: str) -> tuple[asset_types.Material, ...]:
        """The asset's own materials, one per mesh slot."""
        return self._summarize(asset_id).materials

    def bounds_m(self, asset_id: str) -> Bounds:
        """Smallest and largest coordinates of the asset's mesh in its own frame [m]."""
        return self._bounds(asset_id)[0]

    def body_bounds_m(self, asset_id: str) -> Bounds | None:
        """The same without a vehicle's exterior mirrors; None if it has none.

        Vehicles have the tag ``vehicle`` or a category of ``VEHICLES``.
        """
        asset = self.get(asset_id)
        if "vehicle" not in asset.tags and asset.category not in VEHICLES:
            return None
        _, *body = self._bounds(asset_id)
        return body[0] if body else None

    def stride_bounds_m(self, asset_id: str) -> Bounds:
        """Bounds over a whole stride of a person who walks; bounds of the mesh for all others.

        Over its quarters: legs and arms reach at most 5 cm farther between them.
        """
        pose = dict(self.get(asset_id).attributes).get("pose", "")
        if not pose or pose not in families.declared(asset_id, "moving_poses", ()):
            return self.bounds_m(asset_id)

        def measure() -> Arrays:
            person = parse_asset_id(asset_id)
            corners = [
                self.bounds_m(str(AssetId(person.name, {**person.parameters, "phase": k / 4})))
                for k in range(4)
            ]
            return {"corners_m": np.stack([np.min(corners, axis=0)[0], np.max(corners, axis=0)[1]])}

        # Stored with the person: meshes of other phases are not, since a walk has many.
        low, high = self.derived(asset_id, _STRIDE_BOUNDS, measure)["corners_m"].tolist()
        return _vec3(low), _vec3(high)

    def vertices_m(self, asset_id: str) -> asset_types.Float32:
        """Vertices of the asset's mesh in its own frame [m], float32 [n, 3].

        Raises:
            AssetError: if a link has no visual geometry.
        """
        return self.mesh(asset_id).vertices_m

    def keypoints(self, asset_id: str) -> tuple[asset_types.Keypoint, ...]:
        """Named points of the asset, in its own frame; empty if it has none."""
        if asset_id not in self._summaries:
            imported = self._imported(asset_id)
            if imported.mesh is None:
                return imported.keypoints
        return self._summarize(asset_id).keypoints

    def lanes(self, asset_id: str) -> tuple[scene.Lane, ...]:
        """Lanes of a road network (``.xodr``), in its own frame; empty for other assets."""
        return () if self._is_generated(asset_id) else self._files.lanes(asset_id)

    def remarks(self, asset_id: str, *, read: bool = True) -> tuple[FileRemarks, ...] | None:
        """Unused contents of an asset's files; see ``FileLibrary.remarks``.

        Empty for generated assets.
        """
        return () if self._is_generated(asset_id) else self._files.remarks(asset_id, read=read)

    def file_shift_m(self, asset_id: str) -> se3.Vec3 | None:
        """Offset added to the coordinates of a user's file, scaled and upright, on import [m].

        None for assets that are not of a user's folder.
        """
        if self._is_generated(asset_id) or not self._files.is_user(asset_id):
            return None
        return self._imported(asset_id).shift_m

    def robot(self, asset_id: str) -> asset_types.RobotModel:
        """Kinematics of a robot. Raises AssetError if the asset is not a robot."""
        if self._is_generated(asset_id):
            raise AssetError(f"asset '{asset_id}': is not a robot")
        return self._files.robot(asset_id)

    def stage(self, asset_id: str) -> scene.StageModel:
        """Content of an OpenUSD stage. Raises AssetError if the asset is not a stage."""
        if self._is_generated(asset_id):
            raise AssetError(f"asset '{asset_id}': is not a stage")
        return self._files.stage(asset_id)

    def plate(self, asset_id: str) -> plates.Plate:
        """Camera, ground and light of a photograph. Raises AssetError if the asset is none."""
        if self._is_generated(asset_id):
            raise AssetError(f"asset '{asset_id}': is not a plate")
        return self._files.plate(asset_id)

    def mesh(self, asset_id: str) -> asset_types.MeshData:
        """Visual geometry of an object or a robot link: ``franka_panda/panda_link3``.

        Raises:
            AssetError: if a link has none.
        """
        mesh = self._imported(asset_id).mesh
        if mesh is None:
            raise AssetError(f"asset '{asset_id}': is a link without visual geometry")
        return mesh

    def convex_parts(self, asset_id: str) -> asset_types.ConvexParts:
        """Collision geometry, in the frame of the mesh. Raises AssetError if a link has none."""
        collision = self._imported(asset_id).collision
        if collision is None:
            raise AssetError(f"asset '{asset_id}': is a link without collision geometry")
        return collision

    def texture(self, texture_id: str) -> asset_types.TextureData:
        """Images of a texture."""
        if self._is_generated(texture_id.partition("#")[0]):
            return self._generated.texture(parse_asset_id(texture_id))
        return self._files.texture(texture_id)

    def writing(self, asset_id: str) -> tuple[Writing, ...]:
        """Lines of text on a texture or an object's mesh; see ``WrittenAssets``."""
        if not families.declared(asset_id, _WRITES, default=False):
            return ()

        def read() -> tuple[Writing, ...]:
            compute = partial(self._generated.writing, parse_asset_id(asset_id))
            return asset_arrays.unpack_writing(self.derived(asset_id, _WRITING, compute))

        return self._writing.get(asset_id, read)

    def mean_color(self, texture_id: str) -> se3.Vec3:
        """Mean reflectance of a texture, linear RGB."""

        def read() -> se3.Vec3:
            # Every eighth texel in both directions: a mean needs no more.
            albedo = self.texture(texture_id).albedo[::8, ::8].reshape(-1, 3)
            r, g, b = (
                colorimetry.srgb_decode(albedo.astype(np.float64) / 255.0).mean(axis=0).tolist()
            )
            return (round(r, 4), round(g, 4), round(b, 4))

        return self._mean_colors.get(texture_id, read)

    def environment(self, environment_id: str) -> asset_types.Float32:
        """Equirectangular relative radiance; see ``AssetLibrary.environment``."""
        if self._is_generated(environment_id):
            radiance = self._generated.environment(parse_asset_id(environment_id))
        else:
            radiance = self._files.environment(environment_id)
        if not np.isfinite(radiance).all():
            raise AssetError(f"asset '{environment_id}': its radiance is NaN or infinite somewhere")
        return radiance

    def derived(self, asset_id: str, name: str, compute: Callable[[], Arrays]) -> Arrays:
        """Arrays computed from an asset alone; see ``DerivedArrays``.

        Arrays of assets that are not stored on disk are not stored: their number is unlimited.
        """
        if not self.is_stored(asset_id):
            return compute()
        return self._disk.arrays(self._derived_key(asset_id, name), compute)

    def is_stored(self, asset_id: str) -> bool:
        """Whether arrays of that asset are stored on disk."""
        owner = asset_id.partition("#")[0]
        return not self._is_generated(owner) or self._generated.is_stored(parse_asset_id(owner))

    def _derived_key(self, asset_id: str, name: str) -> str:
        owner = asset_id.partition("#")[0]
        return content_key({"asset": self.get(owner).sha256, "id": asset_id, "derived": name})

    def _bounds(self, asset_id: str) -> tuple[Bounds, ...]:
        """Bounds of the mesh and, if there are any, of the body.

        Known or stored next to the mesh: half of the objects that a scene tries to place find no
        place, and their meshes need not be made or read.
        """

        def read() -> tuple[Bounds, ...]:
            corners_m = None
            if asset_id in self._summaries:
                corners_m = self.measured_bounds_m(asset_id)
            elif self._is_generated(asset_id):
                corners_m = known_bounds.read_table().find(self.bounds_key(asset_id))
            if corners_m is None:
                stored = self.derived(
                    asset_id, _BOUNDS, lambda: {"corners_m": self.measured_bounds_m(asset_id)}
                )
                corners_m = stored["corners_m"]
            return tuple((_vec3(low), _vec3(high)) for low, high in corners_m.tolist())

        return self._boxes.get(asset_id, read)

    def measured_bounds_m(self, asset_id: str) -> known_bounds.Corners:
        """Bounds of the mesh, which is made or read, and of the body, if it has one."""
        summary = self._summarize(asset_id)
        body = () if summary.body_bounds_m is None else (summary.body_bounds_m,)
        return np.array((summary.bounds_m, *body), np.float64)

    def bounds_key(self, asset_id: str) -> str:
        """Content key of an asset's stored bounds."""
        return self._derived_key(asset_id, _BOUNDS)

    def _summarize(self, asset_id: str) -> _MeshSummary:
        """Bounds, materials and keypoints. Raises AssetError if there is no mesh."""

        def read() -> _MeshSummary:
            mesh, imported = self.mesh(asset_id), self._imported(asset_id)
            check_finite(asset_id, mesh)
            return _MeshSummary(
                mesh.bounds_m(), imported.body_bounds_m, mesh.materials, imported.keypoints
            )

        return self._summaries.get(asset_id, read)

    def _imported(self, asset_id: str) -> ImportedMesh:
        if self._is_generated(asset_id):
            return self._generated.imported(parse_asset_id(asset_id))
        return self._files.imported(asset_id)

    def _is_generated(self, asset_id: str) -> bool:
        """Whether an asset is procedural. Raises UnknownAsset if there is no such asset."""
        name = asset_id.partition("?")[0]
        if name in self._generated:
            return True
        if asset_id in self._files:
            return False
        raise UnknownAsset(f"asset '{asset_id[:120]}': {self._nearest(asset_id[:120])}", asset_id)

    def _nearest(self, asset_id: str) -> str:
        """Suggestions for an unknown id: its pack, similar ids, or the user's folders' contents."""
        if self._files.is_missing(asset_id):
            return "comes with pybullet, which is not here; run: gen-data assets install pybullet"
        known = [*self._generated.names(), *self._files.names()]
        ours = [name for name in known if name.startswith("user/")]
        near = did_you_mean(f"user/{asset_id.removeprefix('user/')}", ours) or did_you_mean(
            asset_id, known
        )
        counts = self._files.user_counts()
        if near or not (counts or asset_id.startswith("user/")):
            return f"unknown{near}"
        held = ", ".join(f"{count} {kind}s" for kind, count in sorted(counts.items())) or "nothing"
        some = f": {', '.join(ours[:3])}{', ...' if len(ours) > 3 else ''}" if ours else ""
        return f"unknown; your asset folders hold {held}{some}"


def _vec3(values: Sequence[float]) -> se3.Vec3:
    x, y, z = values
    return (x, y, z)


def default_cache_dir() -> Path:
    """Cache folder of this program for the current user."""
    from platformdirs import user_cache_path

    return user_cache_path("gen-data")


def check_finite(asset_id: str, mesh: asset_types.MeshData) -> None:
    """Check that geometry and materials of a mesh are finite: no renderer or engine shows NaN.

    Raises:
        AssetError: a number is NaN or infinite.
    """
    for name in ("vertices_m", "normals", "uvs"):
        values = getattr(mesh, name)
        # A sum is faster, and not finite if any number is not.
        with np.errstate(over="ignore", invalid="ignore"):
            is_finite = bool(np.isfinite(values.sum()))
        if not is_finite and not np.isfinite(values).all():
            number = int(np.argwhere(~np.isfinite(values))[0, 0])
            raise AssetError(f"asset '{asset_id}': {name}[{number}] is NaN or infinite")
    try:
        # Much faster than looking for a place, and refuses the same numbers.
        _checked.get(mesh.materials, lambda: _require_finite(mesh.materials))
    except ValueError:
        plain = serialization.to_plain(mesh.materials)
        field = serialization.find_not_finite(plain, "materials")
        raise AssetError(f"asset '{asset_id}': {field} is NaN or infinite") from None


def _require_finite(materials: tuple[asset_types.Material, ...]) -> None:
    """Raise ValueError if a number is NaN or infinite."""
    serialization.canonical_json(materials)
