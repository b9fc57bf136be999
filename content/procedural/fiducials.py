"""Fiducial markers and calibration boards of exact size: AprilTag, ArUco, ChArUco, chessboard, QR.

Every cell of a print is a face of the mesh, so edges stay sharp at any distance; an image would
blur them. A print lies flat on its plate: X points to its right, Y to its top, the origin is the
centre of the plate. Keypoints are the corners that OpenCV's detectors report, in their order.

Patterns come from OpenCV (``cv2.aruco``, ``cv2.QRCodeEncoder``), whose dictionaries include the
AprilTag families.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import collision_hulls
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_solid_in_place
from gen_data.core.asset_types import Keypoint, Material
from gen_data.core.variant_rng import variant_rng
from gen_data.core.writing import NO_LANGUAGE, Writing

DICTIONARIES = {
    "apriltag_36h11": "DICT_APRILTAG_36H11", "aruco_4x4_50": "DICT_4X4_50",
    "aruco_5x5_100": "DICT_5X5_100", "aruco_6x6_250": "DICT_6X6_250",
    "aruco_7x7_1000": "DICT_7X7_1000", "apriltag_25h9": "DICT_APRILTAG_25H9",
    "apriltag_16h5": "DICT_APRILTAG_16H5", "aruco_mip_36h12": "DICT_ARUCO_MIP_36H12",
    "aruco_original": "DICT_ARUCO_ORIGINAL",
}  # fmt: skip
"""OpenCV's name of each dictionary. Boards use the first five."""

PLATE_M = 0.003
"""Thickness of the plate under a print [m]."""
QUIET_MODULES = 4
"""White margin of a QR code, in modules (ISO/IEC 18004)."""
_PAPER = Material((0.82, 0.82, 0.81), 0.85, specular=0.3, printed=True, role="paper")
_INK = Material((0.035, 0.035, 0.037), 0.7, specular=0.3, printed=True, role="ink")
"""Matt paper and laser print: reflectances of 81 and 4 % (assumed, 10 %; no source)."""


@dataclass(frozen=True, eq=False)
class Print:
    """A flat pattern of rectangular cells.

    Attributes:
        x_m: Edges of the columns from left to right, float64 [columns + 1].
        y_m: Edges of the rows from the top down, float64 [rows + 1]; decreasing.
        dark: Whether a cell is inked, bool [rows, columns].
        corners: Names and places (x, y) [m] of the corners that detectors report.
        facts: Attributes in labels.
    """

    x_m: Array
    y_m: Array
    dark: NDArray[np.bool_]
    corners: tuple[tuple[str, tuple[float, float]], ...]
    facts: dict[str, str]

    def with_margin(self, width_m: float) -> "Print":
        """The print with a white margin on all sides."""
        x_m = np.array([self.x_m[0] - width_m, *self.x_m, self.x_m[-1] + width_m])
        y_m = np.array([self.y_m[0] + width_m, *self.y_m, self.y_m[-1] - width_m])
        return replace(self, x_m=x_m, y_m=y_m, dark=np.pad(self.dark, 1))


def marker(seed: int) -> Solid:
    """A square marker with a white margin; keypoints: corners of its black square, clockwise."""
    return _make_solid(_draw_marker(seed))


def marker_facts(seed: int) -> Facts:
    """Dictionary, number, and side of the black square."""
    return Facts(attributes=_draw_marker(seed).facts)


def calibration_board(seed: int) -> Solid:
    """A chessboard or ChArUco board; keypoints: its inner corners, row by row."""
    return _make_solid(_draw_board(seed))


def calibration_board_facts(seed: int) -> Facts:
    """Pattern, numbers of squares, sizes, and the dictionary of a ChArUco board."""
    facts = _draw_board(seed).facts
    return Facts(facts["pattern"], facts)


def qr_code(seed: int) -> Solid:
    """A QR code with its quiet zone; keypoints: its corners, clockwise."""
    return _make_solid(_draw_code(seed))


def qr_code_facts(seed: int) -> Facts:
    """Text, and side without the quiet zone."""
    return Facts(attributes=_draw_code(seed).facts)


def qr_code_writing(seed: int) -> tuple[Writing, ...]:
    """The code's text, and its corners without the quiet zone."""
    code = _draw_code(seed)
    quad = [(x, y, 0.5 * PLATE_M) for _, (x, y) in code.corners]
    # Columns of the quiet zone are one cell each at both sides.
    module = 1.0 / (len(code.x_m) - 3)
    return (Writing(code.facts["text"], NO_LANGUAGE, np.array([quad]), module, "code"),)


def _draw_marker(seed: int) -> Print:
    rng = variant_rng("marker", seed)
    name = rng.turn(tuple(DICTIONARIES), "dictionary")
    number = rng.whole(0, len(_dictionary(name).bytesList), "number")
    side_m, margin = rng.between(0.02, 0.6, "side_m"), rng.between(1.0, 2.0, "margin_cells")
    facts = {"dictionary": name, "number": str(number)}
    return _square(_marker_cells(name, number), side_m, margin, facts)


def _draw_code(seed: int) -> Print:
    import cv2

    rng = variant_rng("qr_code", seed)
    text = f"GD-{rng.whole(0, 1_000_000, 'number'):06d}"
    dark = cv2.QRCodeEncoder.create().encode(text) == 0
    rows, columns = (np.flatnonzero(dark.any(axis=k)) for k in (1, 0))
    cells = dark[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return _square(cells, rng.between(0.02, 0.3, "side_m"), QUIET_MODULES, {"text": text})


def _square(
    cells: NDArray[np.bool_], side_m: float, margin_cells: float, facts: dict[str, str]
) -> Print:
    """A print of equal square cells; its corners are corners of cells, without the margin."""
    edges = (np.arange(len(cells) + 1) / len(cells) - 0.5) * side_m
    a = 0.5 * side_m
    names = ("top_left", "top_right", "bottom_right", "bottom_left")
    corners = tuple(zip(names, ((-a, a), (a, a), (a, -a), (-a, -a)), strict=True))
    bare = Print(edges, -edges, cells, corners, {**facts, "side_m": f"{side_m:.6g}"})
    return bare.with_margin(margin_cells * side_m / len(cells))


def _draw_board(seed: int) -> Print:
    rng = variant_rng("calibration_board", seed)
    pattern = rng.turn(("charuco", "chessboard"), "pattern")
    columns, rows = rng.whole(5, 13, "columns"), rng.whole(4, 10, "rows")
    square_m, share = rng.between(0.01, 0.12, "square_m"), rng.between(0.6, 0.8, "marker_share")
    margin_m = square_m * rng.between(0.3, 1.0, "margin_squares")
    enough = [
        n for n in [*DICTIONARIES][:5] if len(_dictionary(n).bytesList) >= columns * rows // 2
    ]
    name = rng.choose(enough, "dictionary")
    facts = {"pattern": pattern, "columns": str(columns), "rows": str(rows)}
    facts["square_m"] = f"{square_m:.6g}"
    # Lines within a square, in units of its side: its edges, and edges of its marker's cells.
    lines, cells = np.zeros(1), 0
    if pattern == "charuco":
        facts |= {"dictionary": name, "marker_m": f"{share * square_m:.6g}"}
        cells = _dictionary(name).markerSize + 2
        lines = np.append(lines, 0.5 + share * (np.arange(cells + 1) / cells - 0.5))
    across, down = (np.append((np.arange(n)[:, None] + lines).ravel(), n) for n in (columns, rows))
    # The square at the top left is black, as in OpenCV since 4.6.
    dark = (down[:-1, None].astype(int) + across[:-1].astype(int)) % 2 == 0
    if cells:
        white = np.argwhere(np.indices((rows, columns)).sum(axis=0) % 2 == 1)
        for number, (row, column) in enumerate(len(lines) * white + 1):
            dark[row : row + cells, column : column + cells] = _marker_cells(name, number)
    left, top = -0.5 * columns * square_m, 0.5 * rows * square_m
    inner = [(r, c) for r in range(1, rows) for c in range(1, columns)]
    corners = tuple(
        (f"corner_{k}", (left + c * square_m, top - r * square_m)) for k, (r, c) in enumerate(inner)
    )
    bare = Print(left + square_m * across, top - square_m * down, dark, corners, facts)
    return bare.with_margin(margin_m)


def _dictionary(name: str) -> Any:
    import cv2

    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARIES[name]))


def _marker_cells(name: str, number: int) -> NDArray[np.bool_]:
    """Whether cells of a marker are black, with its black border."""
    import cv2

    dictionary = _dictionary(name)
    image = cv2.aruco.generateImageMarker(dictionary, number, dictionary.markerSize + 2)
    black: NDArray[np.bool_] = image == 0
    return black


def _make_solid(flat: Print) -> Solid:
    """The print on its plate. Slots: paper, ink."""
    high, low = 0.5 * PLATE_M, -0.5 * PLATE_M
    across, down = np.meshgrid(flat.x_m, flat.y_m)
    top = np.stack([across, down, np.full_like(across, high)], axis=-1)
    # Columns of corners: top left, bottom left, bottom right, top right of each cell.
    around = [top[:-1, :-1], top[1:, :-1], top[1:, 1:], top[:-1, 1:]]
    slots = np.repeat(flat.dark.ravel().astype(np.int64), 2)
    patches = [replace(_quads(*(c.reshape(-1, 3) for c in around)), slots=slots)]
    # The rim has all vertices of the print's border: the mesh must have no gaps.
    rim = np.concatenate([top[:-1, 0], top[-1, :-1], top[:0:-1, -1], top[0, :0:-1]])
    after, down_m = np.roll(rim, -1, axis=0), np.array([0.0, 0.0, low - high])
    patches.append(_quads(rim, rim + down_m, after + down_m, after))
    centre = np.broadcast_to(np.array([0.0, 0.0, low]), rim.shape)
    below = np.stack([after + down_m, rim + down_m, centre], axis=1)
    patches.append(_flat_patch(below))
    x, y = float(flat.x_m[-1]), float(flat.y_m[0])
    hull = collision_hulls.box((-x, -y, low), (x, y, high))
    solid = make_solid_in_place([join_patches(patches)], (_PAPER, _INK), [hull])
    return replace(solid, keypoints=tuple(_keypoints(flat, high)))


def _keypoints(flat: Print, z_m: float) -> Iterator[Keypoint]:
    for name, (x, y) in flat.corners:
        yield Keypoint(name, (round(x, 6), round(y, 6), z_m), 0.5 * PLATE_M)


def _quads(a: Array, b: Array, c: Array, d: Array) -> Patch:
    """Two triangles per quadrilateral; corners [n, 3] counter-clockwise from outside."""
    return _flat_patch(np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3, 3))


def _flat_patch(corners_m: Array) -> Patch:
    return Patch(corners_m, np.zeros((*corners_m.shape[:2], 2)), np.zeros(len(corners_m), np.int64))
