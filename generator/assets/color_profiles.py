"""Colours of pictures by their embedded profiles (ICC), as sRGB.

Relative colorimetric with black point compensation: white and black of the source become white and
black, colours within sRGB keep their CIELAB values, and others are clipped. Profiles of cameras
and telephones (Adobe RGB, Display P3) are matrices, for which all intents are the same.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from PIL import Image, ImageCms

_SPACES = {"L": "GRAY", "RGB": "RGB ", "CMYK": "CMYK"}
"""Colour spaces of profiles, by the mode of an image."""
_SAME = 2
"""Largest change of a level, of 255, for which a profile counts as sRGB and pixels are kept."""
_EXIF_IFD, _COLOR_SPACE, _SRGB = 0x8769, 0xA001, 1


def to_srgb(image: Image.Image) -> Image.Image:
    """The image in mode RGB without transparency; as stored if it has no usable profile."""
    mode = _base_mode(image)
    transform, _ = _find_transform(image.info.get("icc_profile"), mode)
    stored = image if image.mode == mode else image.convert(mode)
    return stored.convert("RGB") if transform is None else transform.apply(stored)


def color_remarks(image: Image.Image) -> tuple[str, ...]:
    """Stated colours of an opened image that are not used, one phrase each."""
    profile = image.info.get("icc_profile")
    _, fault = _find_transform(profile, _base_mode(image))
    if not profile and image.mode == "CMYK":
        fault = "CMYK without a colour profile; its inks count as ideal"
    elif not profile and _exif_color_space(image) != _SRGB:
        fault = "EXIF states other colours than sRGB, without a profile; they count as sRGB"
    return (fault,) if fault else ()


def _exif_color_space(image: Image.Image) -> int:
    # Without this test, Pillow decodes a whole PNG to look for EXIF data behind its pixels.
    exif = image.getexif().get_ifd(_EXIF_IFD) if "exif" in image.info else {}
    return int(exif.get(_COLOR_SPACE, _SRGB))


def _base_mode(image: Image.Image) -> str:
    """Mode with the image's colours alone: a key of ``_SPACES``."""
    return {"1": "L", "L": "L", "LA": "L", "CMYK": "CMYK"}.get(image.mode, "RGB")


def _find_transform(
    profile: bytes | None, mode: str
) -> tuple[ImageCms.ImageCmsTransform | None, str]:
    """Transform to sRGB, None if colours stay as they are; and the fault of a profile."""
    from PIL import ImageCms

    if not profile:
        return None, ""
    try:
        source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        if source.profile.xcolor_space != _SPACES[mode]:
            return None, f"its colour profile is of {source.profile.xcolor_space}; not applied"
        transform = ImageCms.buildTransform(
            source, ImageCms.createProfile("sRGB"), mode, "RGB",
            ImageCms.Intent.RELATIVE_COLORIMETRIC, ImageCms.Flags.BLACKPOINTCOMPENSATION,
        )  # fmt: skip
    except (OSError, ImageCms.PyCMSError):
        return None, "its colour profile is damaged; its values count as sRGB"
    return (None if _keeps_colors(transform, mode) else transform), ""


def _keeps_colors(transform: ImageCms.ImageCmsTransform, mode: str) -> bool:
    """Whether the colours of a coarse lattice stay."""
    from PIL import Image

    if mode == "CMYK":
        return False
    steps = np.arange(0, 256, 17, dtype=np.uint8)
    lattice = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(64, 64, 3)
    stored = Image.fromarray(lattice).convert(mode)
    changes = np.asarray(transform.apply(stored), np.int16) - np.asarray(stored.convert("RGB"))
    return bool(np.abs(changes).max() <= _SAME)
