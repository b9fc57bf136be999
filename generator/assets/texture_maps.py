"""Textures that are made of several images: which image, and which of its channels, says what."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from urllib.parse import quote, unquote

import numpy as np

from gen_data.generator.core.asset_types import TextureData, UInt8

_MARK = "maps;"


@dataclass(frozen=True, slots=True)
class TextureMaps:
    """The images of one material, by the names that readers give them; empty = there is none.

    All but ``albedo``, ``normal`` and ``emission`` take one channel: ``wood.png!1`` is its green.

    Attributes:
        albedo, normal, emission: Colours; the first and last in sRGB.
        alpha: Coverage.
        roughness, metallic, occlusion: Factors.
        cutoff: Coverage in [0, 1] from which on there is no hole.
    """

    albedo: str = ""
    alpha: str = ""
    normal: str = ""
    roughness: str = ""
    metallic: str = ""
    occlusion: str = ""
    emission: str = ""
    cutoff: float = 0.5

    def name(self) -> str:
        """One name for all of them: that of the albedo if there is nothing else."""
        images = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "cutoff"}
        given = {key: image for key, image in images.items() if image}
        if not set(given) - {"albedo"}:
            return self.albedo
        parts = [f"{key}={quote(image, safe='/!.')}" for key, image in given.items()]
        return _MARK + ";".join([*parts, f"cutoff={self.cutoff:g}"])

    def images(self) -> tuple[str, ...]:
        """Names of the images, each once, sorted."""
        values = [getattr(self, f.name) for f in fields(self) if f.name != "cutoff"]
        return tuple(sorted({value.partition("!")[0] for value in values if value}))


def find_maps(name: str) -> TextureMaps | None:
    """The maps that a name stands for; None if it is that of a single image."""
    if not name.startswith(_MARK):
        return None
    parts = dict(part.partition("=")[::2] for part in name.removeprefix(_MARK).split(";"))
    cutoff = float(parts.pop("cutoff"))
    return TextureMaps(**{key: unquote(value) for key, value in parts.items()}, cutoff=cutoff)


def compose_texture(maps: TextureMaps, image: Callable[[str], UInt8]) -> TextureData:
    """The texture of several images, all at the size of the largest.

    Args:
        maps: Which ones.
        image: Pixels of an image, uint8 [height, width, 3], or 4 where it has transparency.
    """
    pixels = {name: image(name) for name in maps.images()}
    height, width = max((p.shape[:2] for p in pixels.values()), key=lambda s: s[0] * s[1])

    def color(name: str) -> UInt8 | None:
        return _resized(pixels[name][..., :3], width, height) if name else None

    def channel(name: str) -> UInt8 | None:
        if not name:
            return None
        file, _, number = name.partition("!")
        whole = pixels[file]
        at = int(number or 0)
        full = np.full(whole.shape[:2], 255, np.uint8)
        return _resized(whole[..., at] if at < whole.shape[2] else full, width, height)

    alpha = channel(maps.alpha)
    if alpha is not None:
        shifted = alpha.astype(np.int64) + 128 - int(np.ceil(maps.cutoff * 255.0))
        alpha = np.clip(shifted, 0, 255).astype(np.uint8)
    albedo = color(maps.albedo)
    return TextureData(
        albedo=np.full((height, width, 3), 255, np.uint8) if albedo is None else albedo,
        roughness=channel(maps.roughness),
        normal=color(maps.normal),
        metallic=channel(maps.metallic),
        occlusion=channel(maps.occlusion),
        emission=color(maps.emission),
        alpha=alpha,
    )


def _resized(image: UInt8, width: int, height: int) -> UInt8:
    import cv2

    if image.shape[:2] == (height, width):
        return np.ascontiguousarray(image)
    resized: UInt8 = cv2.resize(np.ascontiguousarray(image), (width, height))
    return resized
