"""Decoding of image files; size limits are checked before decoding."""

import contextlib
import io
import math
import re
import tempfile
import warnings
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.assets import color_profiles
from gen_data.core import asset_types, colorimetry, optional_packages
from gen_data.core.errors import AssetError

DECODER_VERSION = 3
"""Increased whenever the same file is decoded to other pixels."""
PHOTO_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff")
"""Suffixes of photographs, in lower case; cameras and telephones also write upper case."""
_REMEDIES = {
    "save them as JPEG or PNG": (".heic", ".heif", ".hif", ".avif", ".jxl", ".jp2", ".gif"),
    "develop them to JPEG or TIFF": (
        ".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf", ".rw2", ".pef", ".srw", ".raw",
    ),
    "save their frames as PNG": (".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm", ".mts", ".3gp"),
}  # fmt: skip
UNREAD: Mapping[str, str] = {
    suffix: f"{suffix[1:].upper()} files are not read: {remedy}"
    for remedy, suffixes in _REMEDIES.items()
    for suffix in suffixes
}
"""Remedy for pictures and films of users by suffix, in lower case."""
MAX_SIDE_PX = 16_384
MAX_PIXELS = 64_000_000
_EXR_MAGIC = b"\x76\x2f\x31\x01"
# Largest negative value, as a share of the brightest texel: resampling filters ring.
_MAX_RINGING = 1e-4
_FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "WEBP", "TGA")
_WITH_ALPHA = ("RGBA", "LA", "PA")


def why_unread(path: PurePath) -> str:
    """Why a picture or film is not read, with the remedy; empty for other files."""
    return UNREAD.get(path.suffix.lower(), "")


def decode_image(
    data: bytes, place: str, *, alpha: bool = False, color: bool = False
) -> asset_types.UInt8:
    """Decode an image to uint8 [height, width, 3], upright by its EXIF orientation.

    Sixteen bits per channel become eight; floating-point values count to 1.

    Args:
        data: An encoded PNG, JPEG, BMP, TIFF, WebP or TGA.
        place: Name of the image in error messages.
        alpha: Keep transparency as a fourth channel, if any pixel is transparent.
        color: Convert colours to sRGB by an embedded profile. Else values stay as stored: they are
            data, or of glTF, whose readers must ignore profiles (glTF 2.0, "Images").

    Raises:
        AssetError: if it is unreadable, or larger than 16,384 pixels a side or 64 megapixels.
    """
    from PIL import Image, ImageOps

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(data), formats=_FORMATS) as image:
                _check_size(image.width, image.height, place)
                if image.getexif().get(_ORIENTATION, 1) != 1:
                    ImageOps.exif_transpose(image, in_place=True)
                if image.mode in _DEEP:
                    return _to_eight_bits(np.asarray(image), image.mode)
                converted = color_profiles.to_srgb(image) if color else image.convert("RGB")
                rgb = np.array(converted, dtype=np.uint8)
                if alpha and (image.mode in _WITH_ALPHA or "transparency" in image.info):
                    coverage = np.asarray(image.convert("RGBA"))[..., 3:]
                    return rgb if coverage.min() == 255 else np.concatenate([rgb, coverage], axis=2)
                return rgb
    except Image.DecompressionBombError:
        raise AssetError(
            f"{place}: more than {MAX_PIXELS // 1_000_000} megapixels; scale it down"
        ) from None
    except AssetError:
        raise
    except Exception as error:
        deep = _decode_deep(data)
        if deep is not None:
            return deep
        raise AssetError(
            f"{place}: unreadable image ({type(error).__name__}); save it again as PNG or JPEG"
        ) from None


def image_remarks(data: bytes) -> tuple[str, ...]:
    """Unused contents of an encoded image, one phrase each; empty if it is unreadable."""
    from PIL import Image

    with warnings.catch_warnings(), contextlib.suppress(Exception):
        warnings.simplefilter("ignore")
        with Image.open(io.BytesIO(data), formats=_FORMATS) as image:
            return color_profiles.color_remarks(image)
    return ()


_ORIENTATION = 0x0112
"""EXIF tag."""
_DEEP = ("I;16", "I;16L", "I;16B", "I;16N", "I", "F")
"""Modes of single channels with more than eight bits, which a conversion to RGB would clip."""


def _to_eight_bits(values: NDArray[Any], mode: str = "") -> asset_types.UInt8:
    """Eight bits of single-channel or colour images with more, as three channels."""
    if values.dtype.kind == "f":
        scaled = np.where(np.isfinite(values), values, 0.0) * 255.0
    else:
        # Images of mode I hold 8, 16 or 32 bits.
        top = int(values.max(initial=0))
        deep = mode != "I" or top > 255
        scaled = values / (257.0 if top < 1 << 16 else float(1 << 24)) if deep else values * 1.0
    level = np.rint(np.clip(scaled, 0.0, 255.0)).astype(np.uint8)
    return np.repeat(level[..., None], 3, axis=2) if level.ndim == 2 else level


def _decode_deep(data: bytes) -> asset_types.UInt8 | None:
    """Decode a TIFF of colours with 16 bits or floating point, which Pillow cannot; else None."""
    import cv2

    if data[:4] not in (b"II*\0", b"MM\0*"):
        return None
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        return None
    if image is None or image.ndim != 3 or image.shape[2] not in (3, 4):
        return None
    if max(image.shape[:2]) > MAX_SIDE_PX or image.shape[0] * image.shape[1] > MAX_PIXELS:
        return None
    if image.dtype.kind != "f" and image.dtype != np.uint16:
        return None
    return np.ascontiguousarray(_to_eight_bits(image[..., 2::-1]))


def decode_radiance(data: bytes, place: str) -> asset_types.Float32:
    """Decode an equirectangular panorama, float32 [height, width, 3], to mean luminance 1.

    Args:
        data: A Radiance .hdr or an OpenEXR file, twice as wide as high.
        place: Name of the file in error messages.

    Raises:
        AssetError: if it is unreadable, too large, of another shape, black, negative or not finite.
    """
    read = read_exr if data[:4] == _EXR_MAGIC else _read_radiance
    rgb = read(data, place).astype(np.float64)
    height, width = rgb.shape[:2]
    if width != 2 * height:
        raise AssetError(f"{place}: {width} x {height} px; a panorama is twice as wide as high")
    _check_texels(rgb, place)
    # Resampling filters ring slightly below zero; _check_texels refuses larger negative values.
    rgb = np.maximum(rgb, 0.0)
    radiance: asset_types.Float32 = (rgb / _mean_luminance(rgb)).astype(np.float32)
    if not np.isfinite(radiance).all():
        raise AssetError(f"{place}: a single texel dominates; export it again")
    return radiance


def read_exr(data: bytes, place: str) -> asset_types.Float32:
    """Decode an OpenEXR image to RGB, float32 [height, width, 3].

    Raises:
        AssetError: if it is unreadable, too large, or lacks a colour, or the library is missing.
    """
    missing = optional_packages.missing_packages("OpenEXR")
    if missing:
        raise AssetError(f"{place}: {missing}")
    import OpenEXR

    with tempfile.NamedTemporaryFile(suffix=".exr") as file:
        file.write(data)
        file.flush()
        try:
            window = OpenEXR.File(file.name, header_only=True).header()["dataWindow"]
            (x0, y0), (x1, y1) = (corner.tolist() for corner in window)
            _check_size(x1 - x0 + 1, y1 - y0 + 1, place)
            channels = OpenEXR.File(file.name, separate_channels=True).channels()
        except (RuntimeError, ValueError, OSError, KeyError) as error:
            reason = str(error).replace(file.name, "it").strip() or type(error).__name__
            raise AssetError(f"{place}: unreadable OpenEXR image ({reason})") from None
    names = _color_channels(tuple(channels))
    if not names:
        raise AssetError(
            f"{place}: has no channels R, G, B, but {', '.join(sorted(channels))[:80]}"
        )
    return np.stack([channels[name].pixels for name in names], axis=-1).astype(np.float32)


def _color_channels(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of red, green and blue, also in a layer or in lower case, or of grey; empty = none.

    Of several layers, one without a name or the combined one is taken, else the first.
    """
    layers: dict[str, dict[str, str]] = {}
    for name in names:
        layer, _, channel = name.rpartition(".")
        layers.setdefault(layer, {})[channel.upper()] = name
    whole = [layer for layer, found in layers.items() if {"R", "G", "B"} <= found.keys()]
    grey = [layer for layer, found in layers.items() if "Y" in found]
    for candidates, channels in ((whole, "RGB"), (grey, "YYY")):
        preferred = [
            layer
            for layer in candidates
            if not layer or layer.lower().endswith(("combined", "rgb", "rgba", "beauty"))
        ]
        if candidates:
            chosen = layers[(preferred or candidates)[0]]
            return tuple(chosen[channel] for channel in channels)
    return ()


def _read_radiance(data: bytes, place: str) -> asset_types.Float32:
    """Decode a Radiance image to RGB, float32 [height, width, 3]."""
    import cv2

    header, pixels = _split_radiance(data, place)
    (first, rows), (second, columns) = header
    # Scan lines in the usual order, top to bottom and left to right, are all that OpenCV reads.
    width, height = (columns, rows) if first[1] == "Y" else (rows, columns)
    _check_size(width, height, place)
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {rows} +X {columns}\n".encode()
    try:
        bgr = cv2.imdecode(np.frombuffer(head + pixels, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        bgr = None
    if bgr is None or bgr.ndim != 3 or bgr.shape[2] != 3 or bgr.dtype != np.float32:
        raise AssetError(f"{place}: unreadable panorama; save it again as Radiance .hdr")
    if first[1] == "X":
        bgr = bgr.swapaxes(0, 1)
    bgr = bgr[::-1] if "+Y" in (first, second) else bgr
    bgr = bgr[:, ::-1] if "-X" in (first, second) else bgr
    # OpenCV decodes to BGR. The centre column is the front, +X, as everywhere in this project.
    return np.ascontiguousarray(bgr[..., ::-1])


def _check_texels(rgb: NDArray[np.float64], place: str) -> None:
    finite = np.isfinite(rgb)
    brightest = float(np.where(finite, rgb, 0.0).max())
    impossible = ~finite | (rgb < -_MAX_RINGING * brightest)
    if impossible.any():
        row, column, channel = (int(v) for v in np.argwhere(impossible)[0])
        raise AssetError(
            f"{place}: row {row}, column {column} is {rgb[row, column, channel]:g}; light is "
            "finite and not negative, save it again from its source"
        )
    if brightest <= 0.0:
        raise AssetError(f"{place}: black; save it again from its source")


def _split_radiance(
    data: bytes, place: str
) -> tuple[tuple[tuple[str, int], tuple[str, int]], bytes]:
    """Both axes of a Radiance image, slowest first, as (sign and axis, pixels); and its scan lines.

    Raises:
        AssetError: if it is not a Radiance image, or has other colours than RGB.
    """
    found = _RESOLUTION.search(data[:_MAX_HEADER_BYTES])
    if data[:2] != b"#?" or found is None:
        raise AssetError(
            f"{place}: neither Radiance nor OpenEXR; save the panorama as .hdr or .exr"
        )
    if b"xyze" in data[: found.start()]:
        raise AssetError(f"{place}: holds CIE XYZ; save it again with FORMAT=32-bit_rle_rgbe")
    (first, rows), (second, columns) = ((found[k].decode(), int(found[k + 1])) for k in (1, 3))
    if first[1] == second[1]:
        raise AssetError(f"{place}: names the axis {first[1]} twice; save it again")
    return ((first, rows), (second, columns)), data[found.end() :]


_RESOLUTION = re.compile(rb"\n([-+][XY]) +(\d{1,6}) +([-+][XY]) +(\d{1,6})\r?\n")
_MAX_HEADER_BYTES = 4096


def _mean_luminance(rgb: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    """Mean luminance (Rec. 709) of an equirectangular image over the sphere."""
    height = rgb.shape[0]
    edges = np.array([math.cos(math.pi * k / height) for k in range(height + 1)])
    rows = colorimetry.luminance(rgb).mean(axis=1)
    # By Archimedes, a band of the sphere has an area in proportion to its height, cos - cos.
    return float((rows * 0.5 * (edges[:-1] - edges[1:])).sum())


def _check_size(width: int, height: int, place: str) -> None:
    if max(width, height) > MAX_SIDE_PX or width * height > MAX_PIXELS or min(width, height) < 1:
        raise AssetError(
            f"{place}: {width} x {height} px; at most {MAX_SIDE_PX} a side and "
            f"{MAX_PIXELS // 1_000_000} megapixels are read, scale it down"
        )
