"""Converter of the hdri pack: OpenEXR panoramas inside JavaScript to Radiance files.

Radiance (Ward, "Real pixels", Graphics Gems II, 1991) keeps the full range at 1 % precision, and is
the usual format of user panoramas.
"""

import base64
import binascii
import re
from pathlib import Path

import numpy as np

from gen_data.assets.folder_index import FolderIndex, ImageEntry
from gen_data.assets.image_decoding import read_exr
from gen_data.assets.installed_packs import TAG, write_index
from gen_data.config.data_files import load_data
from gen_data.core import asset_types, errors

_DATA_URL = re.compile(rb"base64,([A-Za-z0-9+/=]+)")
_SUFFIX = ".exr.js"

TAGS: dict[str, list[str]] = load_data(__package__, "panoramas")


def convert(source: Path, target: Path) -> None:
    """Write every panorama as Radiance .hdr, and their index.

    Raises:
        AssetError: if a panorama is missing or unreadable.
    """
    found = {path.name.removesuffix(_SUFFIX): path for path in source.rglob(f"*{_SUFFIX}")}
    entries = []
    for name, tags in TAGS.items():
        if name not in found:
            raise errors.AssetError(f"{source}: holds no panorama '{name}'")
        place = str(found[name])
        (target / f"{name}.hdr").write_bytes(
            encode_radiance(read_exr(exr_bytes(found[name].read_bytes(), place), place))
        )
        entries.append(ImageEntry(id=name, file=f"{name}.hdr", tags=tuple(sorted((*tags, TAG)))))
    index = FolderIndex(
        licence="CC0-1.0",
        author="Poly Haven",
        source="npm @pmndrs/assets 1.7.0",
        environments=tuple(entries),
    )
    write_index(target, index)


def exr_bytes(script: bytes, place: str) -> bytes:
    """Decode the data URL in a JavaScript module. Raises AssetError if it has none."""
    match = _DATA_URL.search(script)
    try:
        if match:
            return base64.b64decode(match[1], validate=True)
    except binascii.Error:
        pass  # the same as none
    raise errors.AssetError(f"{place}: holds no base64 data URL")


def encode_radiance(rgb: asset_types.Float32) -> bytes:
    """Encode RGB [height, width, 3] as an uncompressed Radiance .hdr file.

    Source: Ward's ``color.c``: the largest component gives the shared exponent, with bias 128.
    """
    height, width = rgb.shape[:2]
    rgb = np.maximum(rgb.astype(np.float64), 0.0)
    brightest = rgb.max(axis=2)
    mantissa, exponent = np.frexp(brightest)
    visible = brightest > 1e-32
    scale = np.where(visible, mantissa * 256.0 / np.where(visible, brightest, 1.0), 0.0)
    pixels = np.zeros((height, width, 4), dtype=np.uint8)
    pixels[..., :3] = np.minimum(np.rint(rgb * scale[..., None]), 255.0).astype(np.uint8)
    pixels[..., 3] = np.where(visible, exponent + 128, 0).astype(np.uint8)
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    return header.encode() + pixels.tobytes()
