"""Assets from files: from pybullet, installed packs and the user's folders."""

import importlib.util
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.assets import asset_arrays, content_hashes, image_decoding, importer, parsing
from gen_data.assets.asset_cache import FORMAT, Arrays, DiskCache, Store, content_key
from gen_data.assets.asset_folder import Folder
from gen_data.assets.content import content
from gen_data.assets.folder_index import (
    INDEX_NAME,
    ROAD_SUFFIX,
    Entry,
    IndexedAsset,
    MeshEntry,
    Origin,
    PlateEntry,
    RobotEntry,
    TextureEntry,
    entry_maps,
    list_assets,
    read_index,
    user_folder,
)
from gen_data.assets.installed_packs import RECORD_NAME, pack_assets
from gen_data.assets.robot_description import DescriptionParts, RobotDescription
from gen_data.assets.robot_formats import is_description, is_foreign
from gen_data.assets.robot_models import describe_robot, robot_model
from gen_data.assets.robot_tools import VERSION as TOOLS_VERSION
from gen_data.assets.sandbox import run_sandboxed
from gen_data.assets.texture_maps import compose_texture, find_maps
from gen_data.assets.usd_stages import is_stage
from gen_data.core import plates, scene
from gen_data.core.asset_types import (
    Asset,
    AssetFacts,
    Float32,
    RobotModel,
    Symmetry,
    TextureData,
    UInt8,
)
from gen_data.core.errors import AssetError

PYBULLET = "pybullet"
"""Name of the pack with those files of pybullet that its index describes."""
_PYBULLET = Path(__file__).with_name("pybullet.yaml")
_RENDERED = Path(str(content().__file__)).parent / "plates"
PLATES_VERSION = 3
"""Changes with the measurements in photographs."""


class FileLibrary:
    """Part of the library that is read from folders.

    Ids come from the indices; ``<robot>/<link>`` is a robot's link, ``<stage>/<piece>`` a
    stage's mesh, and ``<asset>#<image>`` an image that an asset's materials refer to.
    """

    def __init__(
        self,
        packs: Path,
        user_roots: Sequence[Path],
        disk: DiskCache,
        store: Store,
        provide: Callable[[Path], object] | None = None,
    ) -> None:
        self._packs = packs
        self._user_roots = tuple(user_roots)
        self._store, self._disk = store, disk
        self._provide = provide
        self._digests = content_hashes.ContentHashes(disk)
        self._listed: dict[str, IndexedAsset] | None = None
        self._robots: dict[str, RobotDescription] = {}
        self._stages: dict[str, scene.StageModel] = {}
        self._hashed: dict[str, dict[str, str]] = {}
        self._keys: dict[str, str] = {}

    def names(self) -> Iterator[str]:
        """Yield every asset id."""
        yield from self._entries()

    def user_counts(self) -> Counter[str]:
        """Number of assets in the user's folders, by kind."""
        return Counter(one.kind for one in self._entries().values() if one.root in self._user_roots)

    def is_missing(self, asset_id: str) -> bool:
        """Whether the files of a known asset are neither installed with pybullet nor as a pack."""
        return _pybullet_data(self._packs) is None and any(
            _is_of(asset_id, one) for one in _list_pybullet(Path())
        )

    def __contains__(self, asset_id: str) -> bool:
        """Whether the id names an asset, a robot's link or a stage's piece."""
        self._provide_pybullet(lambda one: _is_of(asset_id, one))
        return asset_id in self._entries() or self._part(asset_id) is not None

    def find(self, tags: frozenset[str], kind: str) -> Iterator[Asset]:
        """Yield all assets of a kind that have every tag."""

        def fits(one: IndexedAsset) -> bool:
            return one.kind == kind and tags.issubset(one.tags())

        self._provide_pybullet(fits)
        for one in filter(fits, self._entries().values()):
            yield self._asset(one)
        self._digests.save()

    def get(self, asset_id: str) -> Asset:
        """Description of an asset; robot links and stage pieces count as objects."""
        part = self._part(asset_id)
        asset = self._asset(part[0] if part else self._entries()[asset_id])
        if part:
            asset = replace(asset, asset_id=asset_id, kind="object")
        self._digests.save()
        return asset

    def imported(self, asset_id: str) -> importer.ImportedMesh:
        """Geometry of an object, a robot's link or a stage's piece."""
        part = self._part(asset_id)
        one = part[0] if part else self._entries()[asset_id]
        entry, name = one.entry, part[1] if part else ""

        def compute() -> Arrays:
            if isinstance(entry, RobotEntry):
                return self._parse(one, parsing.parse_link, entry, one.asset_id, name)
            if _is_road_network(entry):
                return self._parse(one, parsing.parse_road_network, entry.file)
            if isinstance(entry, MeshEntry):
                return self._parse(one, parsing.parse_object, entry, one.asset_id, name)
            raise AssetError(f"asset '{asset_id}': is of kind {one.kind}, not an object")

        if isinstance(entry, RobotEntry) and not part:
            links = ", ".join(f"{asset_id}/{n}" for n in list(self._robot(one).links)[:2])
            raise AssetError(f"asset '{asset_id}': is a robot; its meshes are {links}, ...")
        return self._store.get(self._mesh_key(one, name), compute, asset_arrays.unpack_imported)

    def _mesh_key(self, one: IndexedAsset, part: str) -> str:
        return content_key({"asset": self._key(one), "link": part})

    def remarks(self, asset_id: str, *, read: bool) -> tuple[importer.FileRemarks, ...] | None:
        """Unused contents of an asset's files.

        Args:
            asset_id: An asset, also of another kind than an object.
            read: Whether to import an asset whose geometry is not stored.

        Returns:
            The remarks with whole paths; None if it is not stored and shall not be read.

        Raises:
            AssetError: if it cannot be imported.
        """
        part = self._part(asset_id)
        one = part[0] if part else self._entries()[asset_id]
        names = [part[1] if part else ""]
        if one.kind == "robot" and not part:
            names = list(self._robot(one).links)
        of_part = self._remarks_of if one.kind in ("object", "robot") else self._image_remarks
        found = [of_part(one, name, read) for name in names]
        known = [remarks for remarks in found if remarks is not None]
        if len(known) < len(found):
            return None
        described = () if part else self._described_remarks(one)
        own = [importer.FileRemarks(one.entry.file, described)] if described else []
        own += [
            importer.FileRemarks(file, (text,))
            for maps in entry_maps(one.entry)
            for file, text in maps.remarks().items()
        ]
        return tuple(
            replace(remarks, file=str(one.root / remarks.file))
            for remarks in dict.fromkeys((*own, *chain(*known)))
        )

    def _image_remarks(
        self, one: IndexedAsset, _: str, read: bool
    ) -> tuple[importer.FileRemarks, ...] | None:
        """Remarks on the images of a texture, a sky or a photograph; see ``remarks``."""
        entry, decoder = one.entry, image_decoding.DECODER_VERSION
        key = content_key({"asset": self._key(one), "part": "remarks", "decoder": decoder})
        if not read and self._disk.find(key) is None:
            return None
        images = _images_of(entry.texture_name() if isinstance(entry, TextureEntry) else entry.file)
        return self._store.get(
            key,
            lambda: self._parse(one, parsing.parse_image_remarks, images),
            lambda arrays: parsing.unpack_value(tuple[importer.FileRemarks, ...], arrays),
        )

    def _remarks_of(
        self, one: IndexedAsset, part: str, read: bool
    ) -> tuple[importer.FileRemarks, ...] | None:
        """Remarks on an object, one link or one piece; see ``remarks``."""
        stored = self._disk.find(self._mesh_key(one, part))
        if stored is not None:
            return asset_arrays.unpack_imported(stored).remarks
        name = f"{one.asset_id}/{part}" if part else one.asset_id
        return self.imported(name).remarks if read else None

    def is_user(self, asset_id: str) -> bool:
        """Whether an asset, link or piece comes from one of the user's folders."""
        part = self._part(asset_id)
        one = part[0] if part else self._entries().get(asset_id)
        return one is not None and one.root in self._user_roots

    def lanes(self, asset_id: str) -> tuple[scene.Lane, ...]:
        """Lanes of a road network; empty for anything else."""
        content = self._road_network(asset_id)
        return content.lanes if content else ()

    def _road_network(self, asset_id: str) -> importer.RoadNetworkContent | None:
        """Content of a road network; None for anything else."""
        one = self._entries().get(asset_id)
        if one is None or not _is_road_network(one.entry):
            return None
        return self._store.get(
            content_key({"asset": self._key(one), "part": "lanes"}),
            lambda: self._parse(one, parsing.parse_lanes, one.entry.file),
            lambda arrays: parsing.unpack_value(importer.RoadNetworkContent, arrays),
        )

    def _described_remarks(self, one: IndexedAsset) -> tuple[str, ...]:
        """Unused contents of a description of links and joints, or of a map; else empty."""
        network = self._road_network(one.asset_id)
        if network is not None:
            return (describe_unused(network.unused),) if network.unused else ()
        if not isinstance(one.entry, RobotEntry):
            if not is_description(one.entry.file):
                return ()
            one = replace(one, entry=RobotEntry(file=one.entry.file))
        return self._robot(one).remarks

    def robot(self, asset_id: str) -> RobotModel:
        """Kinematics of a robot."""
        one = self._entries()[asset_id]
        if not isinstance(one.entry, RobotEntry):
            raise AssetError(f"asset '{asset_id}': is of kind {one.kind}, not a robot")
        return robot_model(asset_id, self._robot(one), one.entry, str(one.root / one.entry.file))

    def stage(self, asset_id: str) -> scene.StageModel:
        """Pieces, lights and cameras of a stage."""
        one = self._entries()[asset_id]
        entry = one.entry
        if not isinstance(entry, MeshEntry) or not is_stage(entry):
            raise AssetError(f"asset '{asset_id}': not a stage; give a .usd, .usda, .usdc or .usdz")
        if asset_id not in self._stages:
            self._stages[asset_id] = self._store.get(
                content_key({"asset": self._key(one), "part": "stage"}),
                lambda: self._parse(one, parsing.parse_stage, entry, asset_id),
                lambda arrays: parsing.unpack_value(scene.StageModel, arrays),
            )
        return self._stages[asset_id]

    def plate(self, asset_id: str) -> plates.Plate:
        """Camera, ground and light of a photograph. Raises AssetError if it is none."""
        one = self._entries()[asset_id]
        entry = one.entry
        if not isinstance(entry, PlateEntry):
            raise AssetError(f"asset '{asset_id}': is of kind {one.kind}, not a plate")
        plate: plates.Plate = self._store.get(
            content_key({"asset": self._key(one), "part": "plate", "version": PLATES_VERSION}),
            lambda: self._parse(one, parsing.parse_plate, entry),
            lambda arrays: parsing.unpack_value(plates.Plate, arrays),
        )
        return plate

    def texture(self, texture_id: str) -> TextureData:
        """Images of a texture entry, of a plate, or of a mesh's material (``<asset>#<image>``)."""
        owner, _, name = texture_id.partition("#")
        part = self._part(owner)
        one = part[0] if part else self._entries()[owner]
        folder = Folder(one.root)
        if not name and isinstance(one.entry, PlateEntry):
            name = one.entry.file
        elif not name:
            if not isinstance(one.entry, TextureEntry):
                raise AssetError(f"asset '{owner}': is of kind {one.kind}, not a texture")
            name = one.entry.texture_name()
        maps, images = find_maps(name), _images_of(name)
        if maps is not None:
            return compose_texture(
                maps, lambda image: self._image(owner, one, folder, image, images[image])
            )
        pixels = self._image(owner, one, folder, name, images[name])
        return TextureData(np.ascontiguousarray(pixels[..., :3]))

    def _image(
        self, owner: str, one: IndexedAsset, folder: Folder, name: str, channels: str
    ) -> UInt8:
        """Pixels of an image, embedded in a mesh file or next to it."""
        has_mesh = one.kind == "object" or owner != one.asset_id
        if has_mesh and name in (images := self.imported(owner).images):
            return images[name]
        if has_mesh and one.entry.file.endswith(".gltf") and name not in one.entry.files():
            channels = "stored"
        pixels: UInt8 = self._decode_cached(folder, name, channels)
        return pixels

    def environment(self, asset_id: str) -> Float32:
        """Pixels of a panorama."""
        one = self._entries()[asset_id]
        if one.kind == "plate":
            return self._surroundings(one)
        if one.kind != "environment":
            raise AssetError(f"asset '{asset_id}': is of kind {one.kind}, not an environment")
        radiance: Float32 = self._decode_cached(Folder(one.root), one.entry.file, "radiance")
        return radiance

    def _surroundings(self, one: IndexedAsset) -> Float32:
        """The light around a photograph's scene, of mean luminance 1."""
        plate = self.plate(one.asset_id)
        radiance: Float32 = self._store.get(
            content_key({"asset": self._key(one), "part": "around", "version": PLATES_VERSION}),
            lambda: self._parse(one, parsing.parse_surroundings, one.entry.file, plate),
            lambda arrays: next(iter(arrays.values())),
        )
        return radiance

    def _decode_cached(self, folder: Folder, name: str, channels: str) -> Any:
        """Decode an image file, or take it from the store by the hash of its bytes."""
        if not folder.exists(name):
            raise AssetError(
                f"{folder.root / name}: no such image; add it or correct the reference to it"
            )
        digests = self._digests.of(folder, name)
        key: dict[str, object] = {
            "format": FORMAT,
            "decoder": image_decoding.DECODER_VERSION,
            "image": digests[name],
            "channels": channels,
        }
        return self._store.get(
            content_key(key),
            lambda: run_sandboxed(parsing.parse_image, folder.root, digests, name, channels),
            lambda arrays: next(iter(arrays.values())),
        )

    def _parse(self, one: IndexedAsset, parse: Callable[..., Arrays], *arguments: object) -> Arrays:
        """Call a function of ``parsing`` for the files of an asset."""
        return run_sandboxed(parse, one.root, self._files(one), *arguments)

    def _provide_pybullet(self, is_wanted: Callable[[IndexedAsset], bool]) -> None:
        """Provide the files of pybullet if they are not here and one of its assets is wanted."""
        if self._provide is None:
            return
        if _pybullet_data(self._packs) is not None:
            self._provide = None
        elif any(map(is_wanted, _list_pybullet(Path()))):
            self._provide(self._packs)
            self._provide = self._listed = None

    def _entries(self) -> dict[str, IndexedAsset]:
        if self._listed is None:
            self._listed = {}
            for one in _list_everything(self._packs, self._user_roots):
                if one.asset_id in self._listed:
                    other = self._listed[one.asset_id]
                    raise AssetError(
                        f"asset '{one.asset_id}': defined by {other.place()} and by {one.place()}; "
                        "rename one of them, or give it another id in an assets.yaml"
                    )
                self._listed[one.asset_id] = one
        return self._listed

    def _part(self, asset_id: str) -> tuple[IndexedAsset, str] | None:
        """Split ``<robot>/<link>`` and ``<stage>/<piece>``; None for other ids."""
        whole, slash, part = asset_id.rpartition("/")
        one = self._entries().get(whole) if slash else None
        if one is None or asset_id in self._entries():
            return None
        if one.kind == "robot":
            return (one, part) if part in self._robot(one).links else None
        if not is_stage(one.entry):
            return None
        return (one, part) if part in {p.name for p in self.stage(whole).pieces} else None

    def _robot(self, one: IndexedAsset) -> RobotDescription:
        if one.asset_id not in self._robots:
            entry = one.entry
            assert isinstance(entry, RobotEntry)
            if any(
                is_foreign(file) for file in (entry.file, entry.tool.file if entry.tool else "")
            ):
                parts: DescriptionParts = self._store.get(
                    content_key({"asset": self._key(one), "part": "robot"}),
                    lambda: self._parse(one, parsing.parse_robot, entry),
                    lambda arrays: parsing.unpack_value(DescriptionParts, arrays),
                )
                self._robots[one.asset_id] = parts.whole()
            else:
                self._robots[one.asset_id] = describe_robot(Folder(one.root), entry)
        return self._robots[one.asset_id]

    def _asset(self, one: IndexedAsset) -> Asset:
        entry = one.entry
        # Robots and images have the default values of a mesh entry's own fields.
        mesh = entry if isinstance(entry, MeshEntry) else MeshEntry(file="-")
        return Asset(
            asset_id=one.asset_id,
            kind=one.kind,
            category=one.category(),
            tags=one.tags(),
            licence=one.origin.licence,
            author=one.origin.author,
            source=one.origin.source,
            sha256=self._key(one),
            mass_kg=mesh.mass_kg,
            stackable=mesh.stackable,
            facts=partial(_read_facts, mesh),
        )

    def _key(self, one: IndexedAsset) -> str:
        """Hash of the files and of all parameters of their import."""
        if one.asset_id not in self._keys:
            origin = set(Origin.model_fields)
            content = {
                "format": FORMAT,
                "version": importer.VERSION,
                "id": one.asset_id,
                "entry": one.entry.model_dump(exclude=origin, exclude_defaults=True),
                "files": self._files(one),
            }
            if isinstance(one.entry, RobotEntry) and one.entry.tool is not None:
                content["tools"] = TOOLS_VERSION
            if _is_road_network(one.entry):
                content["roads"] = importer.ROADS_VERSION
            self._keys[one.asset_id] = content_key(content)
        return self._keys[one.asset_id]

    def _files(self, one: IndexedAsset) -> dict[str, str]:
        """Digests of an asset's files at its first use."""
        if one.asset_id not in self._hashed:
            folder = Folder(one.root)
            self._hashed[one.asset_id] = {
                name: digest
                for file in one.entry.files()
                for name, digest in self._digests.of(folder, file).items()
            }
        return self._hashed[one.asset_id]


def _images_of(name: str) -> dict[str, str]:
    """How to decode each image of a texture: see ``channels`` of ``parsing.parse_image``."""
    maps = find_maps(name)
    if maps is None:
        return {name: "rgb"}
    colors = (maps.albedo, maps.emission)
    return {image: "rgba" if image in colors else "stored" for image in maps.images()}


def describe_unused(unused: tuple[tuple[str, int], ...]) -> str:
    """Elements of a road network without effect, in words."""
    return "not used: " + ", ".join(f"{count} {name}" for name, count in unused)


def _read_facts(mesh: MeshEntry) -> AssetFacts:
    attributes = tuple(sorted(mesh.attributes.items()))
    return AssetFacts(mesh.subcategory, attributes, _convert_symmetries(mesh))


def _convert_symmetries(entry: MeshEntry) -> tuple[Symmetry, ...]:
    found = []
    for symmetry in entry.symmetries:
        x, y, z = symmetry.direction()
        length = math.sqrt(x * x + y * y + z * z)
        axis = (x / length, y / length, z / length)
        found.append(Symmetry(axis, symmetry.fold or 0, symmetry.offset_m))
    return tuple(found)


def _is_road_network(entry: Entry) -> bool:
    return isinstance(entry, MeshEntry) and entry.file.lower().endswith(ROAD_SUFFIX)


def _is_of(asset_id: str, one: IndexedAsset) -> bool:
    """Whether an id names an asset, or a part or an image of it."""
    name = asset_id.partition("#")[0]
    return name == one.asset_id or name.startswith(f"{one.asset_id}/")


def _list_everything(packs: Path, user_roots: Sequence[Path]) -> Iterator[IndexedAsset]:
    data = _pybullet_data(packs)
    if data is not None:
        yield from _list_pybullet(data)
    yield from _list_rendered()
    yield from pack_assets(packs)
    for root in user_roots:
        yield from user_folder(root)


@lru_cache(maxsize=1)
def _list_rendered() -> tuple[IndexedAsset, ...]:
    return tuple(list_assets(read_index(_RENDERED / INDEX_NAME), _RENDERED, "plate/"))


@lru_cache(maxsize=2)
def _list_pybullet(data: Path) -> tuple[IndexedAsset, ...]:
    """Assets whose files pybullet installs, or its pack."""
    return tuple(list_assets(read_index(_PYBULLET), data))


def _pybullet_data(packs: Path) -> Path | None:
    """Folder of pybullet's data: its pack, or the package, which is not imported; else None."""
    pack = packs / PYBULLET
    if (pack / RECORD_NAME).is_file():
        return pack
    spec = importlib.util.find_spec("pybullet_data")
    return Path(spec.origin).parent if spec is not None and spec.origin is not None else None
