"""Decoding of image files; size limits are checked before decoding."""

from __future__ import annotations

import io
import math
import tempfile
import warnings

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Float32, UInt8
from gen_data.generator.core.colorimetry import luminance
from gen_data.generator.core.errors import AssetError
from gen_data.generator.core.optional_packages import missing_packages

MAX_SIDE_PX = 16_384
MAX_PIXELS = 64_000_000
_EXR_MAGIC = b"\x76\x2f\x31\x01"
# Largest negative value, as a share of the brightest texel: resampling filters ring.
_MAX_RINGING = 1e-4
_FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "WEBP", "TGA")
_WITH_ALPHA = ("RGBA", "LA", "PA")


def decode_image(data: bytes, place: str, *, alpha: bool = False) -> UInt8:
    """Decode an image to sRGB, uint8 [height, width, 3].

    Args:
        data: An encoded PNG, JPEG, BMP, TIFF, WebP or TGA.
        place: Name of the image in error messages.
        alpha: Keep transparency as a fourth channel, if any pixel is transparent.

    Raises:
        AssetError: if it is unreadable, or larger than 16,384 pixels a side or 64 megapixels.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(data), formats=_FORMATS) as image:
                _check_size(image.width, image.height, place)
                if alpha and (image.mode in _WITH_ALPHA or "transparency" in image.info):
                    pixels = np.array(image.convert("RGBA"), dtype=np.uint8)
                    return pixels if pixels[..., 3].min() < 255 else pixels[..., :3].copy()
                return np.array(image.convert("RGB"), dtype=np.uint8)
    except Image.DecompressionBombError:
        raise AssetError(
            f"{place}: more than {MAX_PIXELS // 1_000_000} megapixels; scale it down"
        ) from None
    except AssetError:
        raise
    except Exception as error:
        raise AssetError(
            f"{place}: unreadable image ({type(error).__name__}); save it again as PNG or JPEG"
        ) from None


def decode_radiance(data: bytes, place: str) -> Float32:
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
    radiance: Float32 = (rgb / _mean_luminance(rgb)).astype(np.float32)
    if not np.isfinite(radiance).all():
        raise AssetError(f"{place}: a single texel dominates; export it again")
    return radiance


def read_exr(data: bytes, place: str) -> Float32:
    """Decode an OpenEXR image to RGB, float32 [height, width, 3].

    Raises:
        AssetError: if it is unreadable, too large, or lacks a colour, or the library is missing.
    """
    missing = missing_packages("OpenEXR")
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
            channels = OpenEXR.File(file.name).channels()
        except (RuntimeError, ValueError, OSError, KeyError) as error:
            reason = str(error).replace(file.name, "it").strip() or type(error).__name__
            raise AssetError(f"{place}: unreadable OpenEXR image ({reason})") from None
    for name in ("RGB", "RGBA"):
        if name in channels:
            return np.ascontiguousarray(channels[name].pixels[..., :3], dtype=np.float32)
    if not {"R", "G", "B"} <= set(channels):
        raise AssetError(f"{place}: has no channels R, G, B")
    return np.stack([channels[name].pixels for name in "RGB"], axis=-1).astype(np.float32)


def _read_radiance(data: bytes, place: str) -> Float32:
    """Decode a Radiance image to RGB, float32 [height, width, 3]."""
    import cv2

    width, height = _radiance_size(data, place)
    _check_size(width, height, place)
    try:
        bgr = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        bgr = None
    if bgr is None or bgr.ndim != 3 or bgr.shape[2] != 3 or bgr.dtype != np.float32:
        raise AssetError(f"{place}: unreadable panorama; save it again as Radiance .hdr")
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


def _radiance_size(data: bytes, place: str) -> tuple[int, int]:
    """Width and height stated in a Radiance header."""
    lines = data[:4096].split(b"\n")
    for line in lines if data[:2] == b"#?" else ():
        words = line.split()
        if len(words) == 4 and words[0] == b"-Y" and words[2] == b"+X":
            if words[1].isdigit() and words[3].isdigit():
                return int(words[3]), int(words[1])
            break
    raise AssetError(f"{place}: neither Radiance nor OpenEXR; save the panorama as .hdr or .exr")


def _mean_luminance(rgb: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    """Mean luminance (Rec. 709) of an equirectangular image over the sphere."""
    height = rgb.shape[0]
    edges = np.array([math.cos(math.pi * k / height) for k in range(height + 1)])
    rows = luminance(rgb).mean(axis=1)
    # By Archimedes, a band of the sphere has an area in proportion to its height, cos - cos.
    return float((rows * 0.5 * (edges[:-1] - edges[1:])).sum())


def _check_size(width: int, height: int, place: str) -> None:
    if max(width, height) > MAX_SIDE_PX or width * height > MAX_PIXELS or min(width, height) < 1:
        raise AssetError(
            f"{place}: {width} x {height} px; at most {MAX_SIDE_PX} a side and "
            f"{MAX_PIXELS // 1_000_000} megapixels are read, scale it down"
        )
