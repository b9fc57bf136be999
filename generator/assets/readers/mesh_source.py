"""Result type of mesh readers, and conversions that formats share."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import PurePosixPath

from gen_data.assets.asset_folder import Folder
from gen_data.assets.robot_files import resolve_uri
from gen_data.assets.triangle_soup import TriangleSoup
from gen_data.core import colorimetry, errors, se3
from gen_data.core.asset_types import Material

MAX_FACES = 5_000_000
WHITE = Material(base_color=(1.0, 1.0, 1.0))
"""Material of geometry that has colours per vertex only."""
EVEN = 3.0
"""Image channels with a smaller standard deviation [1/255] count as uniform."""


@dataclass(frozen=True, eq=False)
class MeshSource:
    """Content of a mesh file.

    Attributes:
        soup: Its triangles. ``Material.texture`` is an image's path relative to the folder, or a
            key of ``images``.
        images: ``{key: encoded image}`` of images inside the file itself.
        remarks: Contents of the file that the soup lacks, one phrase each.
        up: Axis that the file states as up, ``x``, ``y`` or ``z``; empty = it states none.
    """

    soup: TriangleSoup
    images: Mapping[str, bytes] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    up: str = ""


def check_face_count(count: int, place: str) -> None:
    """Raise AssetError if a file has more than ``MAX_FACES`` triangles."""
    if count > MAX_FACES:
        raise errors.AssetError(f"{place}: {count} triangles, at most {MAX_FACES}; decimate it")


def locate_file(folder: Folder, base: str, reference: str, remarks: list[str] | None = None) -> str:
    """Path of a file that ``base`` refers to, as it is written where it exists.

    ``model://`` and ``package://`` are looked up as in descriptions of robots (``robot_files``).
    Else a file of that name next to ``base``, or of that name in other case, is taken: files are
    moved from computers with other paths, and some systems do not tell cases apart.

    Raises:
        AssetError: if it is a URL, absolute or outside, and no such file is next to ``base``.
    """
    name = PurePosixPath(reference.replace("\\", "/")).name
    path, refusal = "", None
    try:
        path = resolve_uri(folder, base, reference)
    except errors.AssetError as error:
        refusal = error
    if not path or not folder.exists(path):
        beside = next((p for p in _candidates(folder, base, path, name) if folder.exists(p)), "")
        if beside and remarks is not None:
            remarks.append(f"'{reference[:120]}' is not there; {beside} is used instead")
        path = beside or path
    if not path and refusal is not None:
        raise refusal
    return path


def _candidates(folder: Folder, base: str, path: str, name: str) -> Iterator[str]:
    """Paths to try for a missing file: in other case, then next to the file that refers to it."""
    beside = str(PurePosixPath(base).parent / name) if name else ""
    for wanted in dict.fromkeys((path, beside)):
        if not wanted:
            continue
        yield wanted
        parent = PurePosixPath(wanted).parent
        try:
            entries = sorted(path.name for path in folder.path(str(parent)).iterdir())
        except (OSError, errors.AssetError):
            continue
        key = PurePosixPath(wanted).name.casefold()
        yield from (str(parent / entry) for entry in entries if entry.casefold() == key)


def fraction(value: object, name: str) -> float:
    """Parse a number in [0, 1]. Raises ValueError with its name if it is out of range."""
    number = _parse_number(value, name)
    # Exporters round: tolerate values slightly outside.
    if not -1e-4 <= number <= 1.0 + 1e-4:
        raise ValueError(f"{name} is {number:g}, not in [0, 1]")
    return min(max(number, 0.0), 1.0)


def clamp_min(low: float, value: object, name: str) -> float:
    """Parse a finite number of at least ``low``. Raises ValueError with its name otherwise."""
    number = _parse_number(value, name)
    if not low - 1e-6 <= number < math.inf:
        raise ValueError(f"{name} is {number:g}, not a number of at least {low:g}")
    return max(number, low)


def _parse_number(value: object, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError(f"{name} is not a number")
    return float(value)


def srgb_to_linear(color: se3.Vec3) -> se3.Vec3:
    """Convert sRGB in [0, 1] to linear RGB (IEC 61966-2-1)."""
    red, green, blue = (_linear(min(max(c, 0.0), 1.0)) for c in color)
    return (red, green, blue)


def shininess_to_roughness(exponent: float) -> float:
    """Perceptual roughness of a Blinn-Phong exponent.

    Source: Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007:
    alpha = sqrt(2 / (n + 2)); perceptual roughness is the root of alpha (Burley 2012).
    """
    return round(math.pow(2.0 / (max(exponent, 0.0) + 2.0), 0.25), 4)


def _linear(c: float) -> float:
    # Rounded, because pow() may differ in the last bit between C libraries.
    return round(colorimetry.srgb_decode(float(c)), 6)
