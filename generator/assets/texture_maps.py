"""Textures made of several images, and the image channels they use."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any
from urllib.parse import quote, unquote

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.triangle_soup import Float64, Int64, MaterialSlot, TriangleSoup, face_crosses
from gen_data.core.asset_types import TextureData, UInt8

_MARK = "maps;"
HOLES_MIN = 0.02
"""Smallest share of a slot's area in holes for which they are kept."""
# Barycentric weights of sample points well inside a triangle: its border may touch a seam.
_INSIDE = np.array(
    [[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 0.5], [2, 0.5, 2], [0.5, 2, 2]]
)
_WEIGHTS = _INSIDE / _INSIDE.sum(axis=1, keepdims=True)


@dataclass(frozen=True, slots=True)
class TextureMaps:
    """Image names of one material, as readers give them; empty = none.

    All but ``albedo``, ``normal`` and ``emission`` use one channel: ``wood.png!1`` is green. A
    channel is inverted by a minus behind its number, also in ``normal``: ``wood.png!1-``.

    Attributes:
        albedo, normal, emission: RGB images; albedo and emission in sRGB.
        alpha: Coverage.
        roughness, metallic, occlusion: Factors.
        cutoff: Coverage in [0, 1] below which there is a hole.
        normal_scale: Factor on the tilts of normals (their components along the surface).
        occlusion_strength: Share in [0, 1] of the occlusion that is applied.
    """

    albedo: str = ""
    alpha: str = ""
    normal: str = ""
    roughness: str = ""
    metallic: str = ""
    occlusion: str = ""
    emission: str = ""
    cutoff: float = 0.5
    normal_scale: float = 1.0
    occlusion_strength: float = 1.0

    def name(self) -> str:
        """Name that encodes all of them; the albedo's own name if it is the only image."""
        given = self._given()
        if not set(given) - {"albedo"}:
            return self.albedo
        parts = [f"{key}={quote(image, safe='/!.')}" for key, image in given.items()]
        parts += [
            f"{key}={getattr(self, key):g}"
            for key, default in _NUMBERS.items()
            if key == "cutoff" or getattr(self, key) != default
        ]
        return _MARK + ";".join(parts)

    def images(self) -> tuple[str, ...]:
        """Names of the images, each once, sorted."""
        return tuple(sorted({image.partition("!")[0] for image in self._given().values()}))

    def renamed(self, names: Mapping[str, str]) -> "TextureMaps":
        """The same maps, whose images have other names, ``{old: new}``."""
        changes: dict[str, Any] = {}
        for key, image in self._given().items():
            file, mark, channel = image.partition("!")
            changes[key] = names.get(file, file) + mark + channel
        return replace(self, **changes)

    def _given(self) -> dict[str, str]:
        images = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _NUMBERS}
        return {key: image for key, image in images.items() if image}


_NUMBERS = {f.name: f.default for f in fields(TextureMaps) if isinstance(f.default, float)}
"""Defaults of the numeric fields."""


def find_maps(name: str) -> TextureMaps | None:
    """Parse the maps encoded in a name; None if it names a single image."""
    if not name.startswith(_MARK):
        return None
    parts = dict(part.partition("=")[::2] for part in name.removeprefix(_MARK).split(";"))
    values: dict[str, Any] = {
        key: float(value) if key in _NUMBERS else unquote(value) for key, value in parts.items()
    }
    return TextureMaps(**values)


def compose_texture(maps: TextureMaps, image: Callable[[str], UInt8]) -> TextureData:
    """Compose a texture of several images, all resized to the largest.

    Args:
        maps: Names of the images.
        image: Returns the pixels of an image, uint8 [height, width, 3], or 4 channels if it is
            transparent.
    """
    pixels = {name: image(name) for name in maps.images()}
    height, width = max((p.shape[:2] for p in pixels.values()), key=lambda s: s[0] * s[1])

    def color(name: str) -> UInt8 | None:
        if not name:
            return None
        file, _, inverted = name.partition("!")
        rgb = pixels[file][..., :3]
        if inverted:
            rgb = np.where(np.arange(3) == int(inverted[0]), 255 - rgb, rgb)
        return _resize(rgb, width, height)

    def channel(name: str) -> UInt8 | None:
        if not name:
            return None
        file, _, number = name.partition("!")
        whole = pixels[file]
        at = int(number.rstrip("-") or 0)
        values = whole[..., at] if at < whole.shape[2] else np.full(whole.shape[:2], 255, np.uint8)
        return _resize(255 - values if number.endswith("-") else values, width, height)

    alpha = channel(maps.alpha)
    if alpha is not None:
        shifted = alpha.astype(np.int64) + 128 - int(np.ceil(maps.cutoff * 255.0))
        alpha = np.clip(shifted, 0, 255).astype(np.uint8)
    normal, occlusion = color(maps.normal), channel(maps.occlusion)
    if normal is not None and maps.normal_scale != 1.0:
        normal = _scale_tilts(normal, maps.normal_scale)
    if occlusion is not None and maps.occlusion_strength != 1.0:
        levels = 255.0 - maps.occlusion_strength * (255.0 - np.arange(256.0))
        occlusion = np.rint(levels).astype(np.uint8)[occlusion]
    albedo = color(maps.albedo)
    return TextureData(
        albedo=np.full((height, width, 3), 255, np.uint8) if albedo is None else albedo,
        roughness=channel(maps.roughness),
        normal=normal,
        metallic=channel(maps.metallic),
        occlusion=occlusion,
        emission=color(maps.emission),
        alpha=alpha,
    )


def _scale_tilts(normals: UInt8, scale: float) -> UInt8:
    """Normals [height, width, 3] whose components along the surface are multiplied, normalised."""
    scaled = np.empty_like(normals)
    # By rows: a whole image of floating-point values could take gigabytes.
    for row, out in zip(normals, scaled, strict=True):
        vectors = (row / 127.5 - 1.0) * (scale, scale, 1.0)
        lengths = np.sqrt((vectors * vectors).sum(axis=1, keepdims=True))
        out[:] = np.rint((vectors / np.maximum(lengths, 1e-6) + 1.0) * 127.5)
    return scaled


def texel_indices(uvs: Float64, shape: tuple[int, ...]) -> tuple[Int64, Int64]:
    """Rows and columns of the texels at UVs [..., 2] of a repeated image [height, width]."""
    height, width = shape[:2]
    columns = np.floor(uvs[..., 0] * width).astype(np.int64) % width
    rows = np.floor((1.0 - uvs[..., 1]) * height).astype(np.int64) % height
    return rows, columns


def _resize(image: UInt8, width: int, height: int) -> UInt8:
    import cv2

    if image.shape[:2] == (height, width):
        return np.ascontiguousarray(image)
    resized: UInt8 = cv2.resize(np.ascontiguousarray(image), (width, height))
    return resized


def trim_unreached_holes(soup: TriangleSoup, image: Callable[[str], UInt8]) -> TriangleSoup:
    """Drop coverage maps whose holes the mesh reaches at seams only.

    Texture atlases are transparent around their charts. Faces touch those areas at seams only,
    where holes would be pinholes; without them the mesh stays solid and renders faster.

    Args:
        soup: Its slots name images as readers do.
        image: Returns the pixels of an image, uint8 [height, width, 3 or 4].
    """
    slots = [_trim_slot(soup, k, slot, image) for k, slot in enumerate(soup.slots)]
    return replace(soup, slots=tuple(slots))


def _trim_slot(
    soup: TriangleSoup, number: int, slot: MaterialSlot, image: Callable[[str], UInt8]
) -> MaterialSlot:
    maps = find_maps(slot.material.texture)
    if maps is None or not maps.alpha:
        return slot
    name, _, channel = maps.alpha.partition("!")
    pixels, at = image(name), int(channel or 0)
    faces = soup.face_slots == number
    if soup.uvs is not None and at < pixels.shape[2] and faces.any():
        holes = pixels[..., at] < maps.cutoff * 255.0
        if _hole_share(soup.corners[faces], soup.uvs[faces], holes) >= HOLES_MIN:
            return slot
    solid = replace(maps, alpha="", cutoff=0.5)
    return replace(slot, material=replace(slot.material, texture=solid.name()))


def _hole_share(corners: Float64, uvs: Float64, holes: NDArray[np.bool_]) -> float:
    """Share of the area of triangles [m, 3, 3] that lies in holes of an image."""
    samples = np.einsum("sc,mcd->msd", _WEIGHTS, uvs, optimize=False)
    rows, columns = texel_indices(samples, holes.shape)
    sides = face_crosses(corners)
    areas = np.sqrt((sides * sides).sum(axis=1))
    face_shares = holes[rows, columns].mean(axis=1)
    return float((face_shares * areas).sum() / max(float(areas.sum()), 1e-30))
