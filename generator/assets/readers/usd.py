"""OpenUSD: text and binary layers, and usdz archives.

Supported are meshes, primitive shapes, subsets, UsdPreviewSurface with images, display colours,
transforms, instances, unit and up axis. Nothing outside the asset folder is opened: references of
layers are checked beforehand.
"""

import io
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

import numpy as np

from gen_data.assets import image_decoding, texture_maps
from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers.mesh_source import EVEN, MeshSource
from gen_data.assets.triangle_soup import Float64, MaterialSlot, TriangleSoup, join_soups
from gen_data.core import asset_types, colorimetry, errors, temporary_folders
from gen_data.usd.material_reader import BoundMaterial
from gen_data.usd.stage_reader import SUFFIXES, OpenStage, StagePart, layer_references

ARCHIVE = ".usdz"


def read_usd(folder: Folder, relative: str, materials: bool) -> MeshSource:
    """Read all visible meshes of a stage, in metres, Z up.

    Raises:
        AssetError: if it is malformed or holds no mesh, has a missing reference or one outside the
            folder, or an unsupported material.
    """
    with open_stage(folder, relative) as stage:
        return stage.source(stage.pieces(), materials=materials)


@dataclass(frozen=True)
class StageFile:
    """An open stage in a folder.

    Attributes:
        folder: Folder of its files: the user's, or an unpacked archive.
        packed: Whether it comes from an archive.
    """

    stage: OpenStage
    folder: Folder
    packed: bool

    def pieces(self) -> tuple[StagePart, ...]:
        """Visible meshes."""
        return self.stage.pieces()

    def source(self, pieces: tuple[StagePart, ...], *, materials: bool = True) -> MeshSource:
        """Read some of its meshes, each as a group."""
        images: dict[str, bytes] = {}
        soups, remarks = [], [*self.stage.remarks.values()]
        for piece in pieces:
            mesh = self.stage.mesh(piece)
            remarks += mesh.remarks
            slots = tuple(
                self._make_slot(k, images) if materials else MaterialSlot() for k in mesh.materials
            )
            zeros = np.zeros(len(mesh.corners), dtype=np.int64)
            soup = TriangleSoup(
                corners=mesh.corners,
                uvs=mesh.uvs,
                normals=mesh.normals,
                face_slots=mesh.face_slots,
                face_groups=zeros,
                slots=slots,
                group_names=(piece.name,),
                colors=mesh.colors if materials else None,
            )
            soups.append(soup.transformed(piece.T_stage_prim[:3]))
        return MeshSource(join_soups(soups), images, tuple(dict.fromkeys(remarks)))

    def _make_slot(self, bound: BoundMaterial, images: dict[str, bytes]) -> MaterialSlot:
        roughness, rough_map = self._factor_or_channel(bound, "roughness", images)
        metallic, metal_map = self._factor_or_channel(bound, "metallic", images)
        material = self._apply_opacity_image(bound)
        whole = self._transferred
        maps = texture_maps.TextureMaps(
            albedo=whole(bound, "diffuseColor", self._relative_name(bound.texture), images),
            alpha=whole(bound, "opacity", self._channel_name(bound.alpha_image), images),
            normal=whole(bound, "normal", self._relative_name(bound.normal_image), images),
            roughness=rough_map,
            metallic=metal_map,
            occlusion=whole(bound, "occlusion", self._channel_name(bound.occlusion_image), images),
            emission=whole(
                bound, "emissiveColor", self._relative_name(bound.emission_image), images
            ),
            cutoff=bound.cutoff,
        )
        material = replace(material, roughness=roughness, metallic=metallic, texture=maps.name())
        if self.packed:
            names = (name for name in maps.images() if name not in images)
            images |= {name: self.folder.read(name) for name in names}
        return MaterialSlot(bound.name, material, from_file=True)

    def _factor_or_channel(
        self, bound: BoundMaterial, key: str, images: dict[str, bytes]
    ) -> tuple[float, str]:
        """Factor and channel; a uniform channel is multiplied into the factor."""
        value, image = getattr(bound.material, key), getattr(bound, f"{key}_image")
        if not image[0]:
            return value, ""
        channel = self._values(bound, key, image)
        if float(channel.std()) < EVEN / 255.0:
            return round(value * float(channel.mean()), 4), ""
        return value, self._transferred(bound, key, self._channel_name(image), images)

    def _apply_opacity_image(self, bound: BoundMaterial) -> asset_types.Material:
        if not bound.opacity_image[0]:
            return bound.material
        kept = float(self._values(bound, "opacity", bound.opacity_image).mean())
        opacity = round(bound.material.opacity * kept, 4)
        return replace(bound.material, opacity=opacity, transmission=0.0)

    def _values(self, bound: BoundMaterial, key: str, image: tuple[str, int]) -> Float64:
        """Values in [0, 1] of one channel of an image."""
        texels = self._pixels(image) / 255.0
        transfer = bound.transfers.get(key)
        if transfer is None:
            return texels
        scale, bias = transfer.scale[image[1]], transfer.bias[image[1]]
        linear = colorimetry.srgb_decode(texels) if transfer.space == "sRGB" else texels
        return np.clip(linear * scale + bias, 0.0, 1.0)

    def _transferred(
        self, bound: BoundMaterial, key: str, name: str, images: dict[str, bytes]
    ) -> str:
        """Name of an image, or of one made of it by its transfer, which is added to ``images``."""
        transfer = bound.transfers.get(key)
        if transfer is None or not name:
            return name
        file, _, channel = name.partition("!")
        path = str(self.folder.root.resolve() / file)
        if channel:
            values = self._values(bound, key, (path, int(channel)))[..., None].repeat(3, axis=2)
        else:
            texels = np.stack([self._pixels((path, k)) for k in range(3)], axis=-1) / 255.0
            is_color = key != "normal"
            is_linear = file.lower().endswith(".exr")
            auto = is_color and transfer.space == "auto" and not is_linear
            stored = transfer.space == "sRGB" or auto
            linear = colorimetry.srgb_decode(texels) if stored else texels
            values = linear * np.array(transfer.scale[:3]) + np.array(transfer.bias[:3])
            values = np.clip(values if is_color else 0.5 * (values + 1.0), 0.0, 1.0)
            values = colorimetry.srgb_encode(values) if is_color else values
        numbers = ",".join(f"{value:g}" for value in (*transfer.scale, *transfer.bias))
        made = f"{file}#{key}{channel},{numbers},{transfer.space}"
        images[made] = _encode_png(np.rint(values * 255.0).astype(np.uint8))
        return f"{made}!0" if channel else made

    def _pixels(self, image: tuple[str, int]) -> asset_types.UInt8:
        """One channel of an image; white if the image lacks it."""
        path, channel = image
        data = self.folder.read(self._relative_name(path))
        pixels = image_decoding.decode_image(data, f"{self.stage.place}: {path}", alpha=True)
        whole = channel < pixels.shape[2]
        return pixels[..., channel] if whole else np.full(pixels.shape[:2], 255, np.uint8)

    def _channel_name(self, image: tuple[str, int]) -> str:
        return f"{self._relative_name(image[0])}!{image[1]}" if image[0] else ""

    def _relative_name(self, path: str) -> str:
        """Path of an image relative to the folder; empty for none.

        Raises:
            AssetError: if it is outside the folder.
        """
        if not path:
            return ""
        root = self.folder.root.resolve()
        resolved = Path(path).resolve()
        if not resolved.is_relative_to(root):
            raise errors.AssetError(
                f"{self.stage.place}: refers to the image '{path[:80]}' outside its folder; put it "
                "next to the layer"
            )
        return resolved.relative_to(root).as_posix()


def _encode_png(pixels: asset_types.UInt8) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


@contextmanager
def open_stage(folder: Folder, relative: str) -> Iterator[StageFile]:
    """Open a stage for the duration of the block.

    Raises:
        AssetError: if it cannot be read, or refers to layers that are missing or outside.
    """
    place = str(folder.root / relative)
    if PurePosixPath(relative).suffix.lower() != ARCHIVE:
        _check_layers(folder, relative)
        yield StageFile(_open_composed(folder, relative, place), folder, packed=False)
        return
    with temporary_folders.temporary_folder("usdz") as unpacked:
        inside = Folder(unpacked)
        first = _unpack(folder.read(relative), inside, place)
        _check_layers(inside, first)
        yield StageFile(_open_composed(inside, first, place), inside, packed=True)


def _open_composed(folder: Folder, relative: str, place: str) -> OpenStage:
    stage = OpenStage(folder.path(relative), place)
    root = folder.root.resolve()
    if not all(Path(layer).resolve().is_relative_to(root) for layer in stage.layers()):
        raise errors.AssetError(f"{place}: uses layers outside its folder; put them next to it")
    return stage


def _check_layers(folder: Folder, relative: str) -> None:
    """Raise AssetError for layers that are missing or outside, before USD opens any of them."""
    pending, seen = [relative], set()
    while pending:
        name = pending.pop()
        if name in seen:
            continue
        seen.add(name)
        folder.read(name)
        for reference in layer_references(folder.path(name)):
            # ``room.usdz[lamp.usda]`` refers to a layer inside an archive.
            file = reference.partition("[")[0]
            if PurePosixPath(file).suffix.lower() in (*SUFFIXES, ARCHIVE):
                pending.append(folder.refer(name, file))


def _unpack(data: bytes, target: Folder, place: str) -> str:
    """Unpack an archive to a folder; return the name of its first file, the root layer.

    The files must be stored uncompressed ("usdz File Format Specification"), so the unpacked size
    cannot exceed the archive's.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            for entry in entries:
                if entry.compress_type != zipfile.ZIP_STORED or entry.file_size > len(data):
                    raise errors.AssetError(
                        f"{place}: its files are compressed; pack it again with usdzip"
                    )
                path = target.path(entry.filename)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(archive.read(entry))
    except (zipfile.BadZipFile, OSError, NotImplementedError):
        raise errors.AssetError(f"{place}: unreadable usdz archive; export it again") from None
    if not entries:
        raise errors.AssetError(f"{place}: an empty usdz archive; export it again")
    return entries[0].filename
