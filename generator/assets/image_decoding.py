"""Decoding of image files; size limits are checked before decoding."""

import contextlib
import io
import math
import re
import struct
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.assets import color_profiles
from gen_data.core import asset_types, colorimetry, optional_packages
from gen_data.core.errors import AssetError

DECODER_VERSION = 4
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
# OpenEXR files have rounded values.
_SAME_CHROMATICITY = 2e-3
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
        data: An encoded PNG, JPEG, BMP, TIFF, WebP or TGA, or OpenEXR, whose colours are linear.
        place: Name of the image in error messages.
        alpha: Keep transparency as a fourth channel, if any pixel is transparent.
        color: Convert colours to sRGB by an embedded profile. Else values stay as stored: they are
            data, or of glTF, whose readers must ignore profiles (glTF 2.0, "Images").

    Raises:
        AssetError: if it is unreadable, or larger than 16,384 pixels a side or 64 megapixels.
    """
    from PIL import Image, ImageOps

    if data[:4] == _EXR_MAGIC:
        linear = read_exr(data, place, color=color)
        if not color and linear.min() < -_MAX_RINGING * max(float(linear.max()), 1.0):
            raise AssetError(
                f"{place}: has values below 0; save it as PNG, with 0 to 1 as 0 to 255"
            )
        clipped = np.clip(linear, 0.0, 1.0)
        return _to_eight_bits(colorimetry.srgb_encode(clipped) if color else clipped)
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


def image_remarks(data: bytes, *, color: bool = True) -> tuple[str, ...]:
    """Unused contents of an image, read as in ``decode_image``; empty if it is unreadable."""
    from PIL import Image

    with warnings.catch_warnings(), contextlib.suppress(Exception):
        warnings.simplefilter("ignore")
        if data[:4] == _EXR_MAGIC:
            return _exr_remarks(data)
        with Image.open(io.BytesIO(data), formats=_FORMATS) as image:
            found = color_profiles.color_remarks(image) if color else ()
            # Further images of MPO files are depth, gain or previews of telephones.
            count = 1 if image.format == "MPO" else getattr(image, "n_frames", 1)
            return found if count == 1 else (*found, f"of {count} pictures, the first is used")
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


def read_exr(data: bytes, place: str, *, color: bool = True) -> asset_types.Float32:
    """Decode an OpenEXR image to RGB, float32 [height, width, 3].

    The first part with colours is read, in its display window; a data window that is twice as wide
    as high is a whole panorama, as in OpenEXR's environment maps.

    Args:
        data: The file.
        place: Its name in error messages.
        color: Convert stated primaries to Rec. 709; colours outside of it are clipped.

    Raises:
        AssetError: if it is unreadable, too large, or lacks a colour, or the library is missing.
    """
    import OpenEXR

    with _exr_file(data, place) as name:
        headers = _exr_headers(name)
        for header in headers:
            _check_size(*_window(header, "dataWindow")[2:], place)
            _check_size(*_window(header, "displayWindow")[2:], place)
        number, names = _color_part(headers)
        if not names:
            held = sorted(channel.name for header in headers for channel in header["channels"])
            raise AssetError(f"{place}: has no channels R, G, B, but {', '.join(held)[:80]}")
        parts = OpenEXR.File(name, separate_channels=True).parts
        if number >= len(parts):
            raise ValueError("incomplete")
        channels = parts[number].channels
        rgb = np.stack([channels[one].pixels for one in names], axis=-1).astype(np.float32)
        if color and "chromaticities" in headers[number]:
            rgb = _to_rec709(rgb, headers[number]["chromaticities"])
    return _in_display_window(rgb, headers[number])


def may_be_panorama(path: Path) -> bool:
    """Whether an OpenEXR file has a window twice as wide as high, by its first header.

    Files that are damaged or cannot be opened may be: their use reports the fault.
    """
    try:
        with path.open("rb") as file:
            head = file.read(_MAX_EXR_HEADER)
    except OSError:
        return True
    corners = [struct.unpack("<4i", found) for found in _EXR_WINDOW.findall(head)]
    wide = [x1 - x0 + 1 == 2 * (y1 - y0 + 1) for x0, y0, x1, y1 in corners]
    return any(wide) or not wide


_MAX_EXR_HEADER = 1 << 16
_EXR_WINDOW = re.compile(rb"(?s)(?:data|display)Window\0box2i\0\x10\0\0\0(.{16})")


@contextlib.contextmanager
def _exr_file(data: bytes, place: str) -> Iterator[str]:
    """A name of the file for OpenEXR, whose errors become AssetErrors."""
    missing = optional_packages.missing_packages("OpenEXR")
    if missing:
        raise AssetError(f"{place}: {missing}")
    with tempfile.NamedTemporaryFile(suffix=".exr") as file:
        file.write(data)
        file.flush()
        try:
            yield file.name
        except (RuntimeError, ValueError, OSError, KeyError) as error:
            reason = str(error).replace(file.name, "it").strip() or type(error).__name__
            raise AssetError(f"{place}: unreadable OpenEXR image ({reason})") from None


def _exr_headers(name: str) -> list[dict[str, Any]]:
    import OpenEXR

    return [part.header for part in OpenEXR.File(name, header_only=True).parts]


def _window(header: Mapping[str, Any], name: str) -> tuple[int, int, int, int]:
    """Left, top, width and height of a window [px]."""
    (x0, y0), (x1, y1) = (corner.tolist() for corner in header[name])
    return x0, y0, x1 - x0 + 1, y1 - y0 + 1


def _in_display_window(rgb: asset_types.Float32, header: Mapping[str, Any]) -> asset_types.Float32:
    """The pixels of the data window, cut to the display window, and black elsewhere."""
    x, y, width, height = _window(header, "dataWindow")
    left, top, whole_width, whole_height = _window(header, "displayWindow")
    if width == 2 * height or (x, y, width, height) == (left, top, whole_width, whole_height):
        return rgb
    rows, columns = np.arange(whole_height) + top - y, np.arange(whole_width) + left - x
    in_rows, in_columns = (rows >= 0) & (rows < height), (columns >= 0) & (columns < width)
    whole = np.zeros((whole_height, whole_width, 3), np.float32)
    whole[np.ix_(in_rows, in_columns)] = rgb[np.ix_(rows[in_rows], columns[in_columns])]
    return whole


def _to_rec709(rgb: asset_types.Float32, chromaticities: Sequence[float]) -> asset_types.Float32:
    """Colours of other primaries; grey stays grey."""
    if np.allclose(chromaticities, colorimetry.REC709_CHROMATICITIES, atol=_SAME_CHROMATICITY):
        return rgb
    matrix = colorimetry.rec709_from_primaries(chromaticities).astype(np.float32)
    converted = np.einsum("ij,yxj->yxi", matrix, rgb, optimize=False)
    # Colours outside of Rec. 709 have negative values here; stored ones stay for later checks.
    clipped: asset_types.Float32 = np.maximum(converted, np.minimum(rgb, 0.0))
    return clipped


def _color_part(headers: Sequence[Mapping[str, Any]]) -> tuple[int, tuple[str, ...]]:
    """Number of the first part with colours, and their names; empty = there is none."""
    found = [_color_channels(tuple(c.name for c in header["channels"])) for header in headers]
    return next(((k, names) for k, names in enumerate(found) if names), (0, ()))


def _exr_remarks(data: bytes) -> tuple[str, ...]:
    with _exr_file(data, "") as name:
        headers = _exr_headers(name)
    number, names = _color_part(headers)
    header = headers[number]
    # Coverage is 1 in panoramas.
    unused = {c.name for c in header["channels"]} - {*names, "A"}
    found = [f"channels that are not used: {', '.join(sorted(unused))}"] if unused else []
    others = [one["name"] for one in headers if one is not header]
    found += [f"parts that are not read: {', '.join(others)}"] if others else []
    if _window(header, "dataWindow") != _window(header, "displayWindow"):
        *_, width, height = _window(header, "dataWindow")
        whole = "read as the whole" if width == 2 * height else "the rest is black"
        found.append(f"its data window is not its display window; {whole}")
    return tuple(found)


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
