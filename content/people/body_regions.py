"""Zones of a template mesh: cuts along level lines, and their number of triangles.

A mesh here is rows of values, one per vertex, whose first three are the position: shapes and
weights are cut along with it. Coordinates are in the template frame [m] and refer to the base shape
of the people pack; they were read off its joints and outline. Both halves are cut alike, by
``|y|``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.config.data_files import load_table
from gen_data.content.people.body import Array, Indices

Level = Callable[[Array], Array]
"""Positions [n, 3] -> signed distance from a cut [n], positive on the side that gets the zone."""

_SNAP_M = 0.0007
"""Vertices nearer to a cut than this count as lying on it: no slivers."""
_CALM = 3.0
"""How boldly edges are collapsed, from 1 to 10: slower and smoother than the library's 7."""


@dataclass(frozen=True, eq=False, slots=True)
class MeshRows:
    """A mesh in zones.

    Attributes:
        values: float64 [n, k]; columns 0 to 2 are the position [m].
        faces: int64 [m, 3].
        zones: Zone of each face, str [m]; faces of zone "" are dropped.
    """

    values: Array
    faces: Indices
    zones: np.ndarray[tuple[int], np.dtype[np.str_]]


def make_rows(values: Array, faces: Indices, zone: str) -> MeshRows:
    """A mesh in one zone."""
    return MeshRows(values, faces, np.full(len(faces), zone, dtype="U16"))


def grid_faces(rows: int, columns: int) -> Indices:
    """Triangles of a grid of points, row by row; outside is where columns run to the right."""
    i = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def split_region(rows: MeshRows, zone: str, into: str, level: Level) -> MeshRows:
    """Split a zone along a level line; its positive side becomes the zone ``into``."""
    heights = level(rows.values[:, :3])
    heights = np.where(np.abs(heights) < _SNAP_M, 0.0, heights)
    corners = heights[rows.faces]
    mine = rows.zones == zone
    crossed = mine & (corners.min(axis=1) < 0.0) & (corners.max(axis=1) > 0.0)
    zones = rows.zones.copy()
    zones[mine & ~crossed & (corners.sum(axis=1) > 0.0)] = into
    values, made, made_zones = _split(rows.values, rows.faces[crossed], heights, (into, zone))
    return MeshRows(
        values,
        np.concatenate([rows.faces[~crossed], made]),
        np.concatenate([zones[~crossed], made_zones]),
    )


def simplify_region(rows: MeshRows, zone: str, max_faces: int) -> MeshRows:
    """The same mesh with about ``max_faces`` triangles in a zone; the zone's border is unchanged.

    Remaining vertices keep their positions, and with them their shapes and weights.
    """
    import fast_simplification

    mine = rows.zones == zone
    used, local = np.unique(rows.faces[mine], return_inverse=True)
    positions = rows.values[used, :3]
    points, faces = fast_simplification.simplify(
        positions,
        local.reshape(-1, 3).astype(np.int32),
        target_count=max_faces,
        agg=_CALM,
        preserve_border=True,
    )
    squared = ((points[:, None].astype(np.float64) - positions[None]) ** 2).sum(axis=2)
    collapsed = used[np.argmin(squared, axis=1)][faces]
    a, b, c = collapsed.T
    collapsed = collapsed[(a != b) & (b != c) & (a != c)]
    return MeshRows(
        rows.values,
        np.concatenate([rows.faces[~mine], collapsed]),
        np.concatenate([rows.zones[~mine], np.full(len(collapsed), zone, dtype="U16")]),
    )


def _split(
    values: Array, faces: Indices, heights: Array, names: tuple[str, str]
) -> tuple[Array, Indices, np.ndarray[tuple[int], np.dtype[np.str_]]]:
    """Triangles that a level line crosses, cut along it; and the vertices with those it adds."""
    added: list[Array] = []
    numbers: dict[tuple[int, int], int] = {}

    def between(a: int, b: int) -> int:
        a, b = min(a, b), max(a, b)
        if (a, b) not in numbers:
            numbers[a, b] = len(values) + len(added)
            t = heights[a] / (heights[a] - heights[b])
            added.append((1.0 - t) * values[a] + t * values[b])
        return numbers[a, b]

    made: list[tuple[int, int, int]] = []
    zones: list[str] = []
    for triangle in faces.tolist():
        for name, sign in zip(names, (1.0, -1.0), strict=True):
            outline: list[int] = []
            for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True):
                if sign * heights[a] >= 0.0:
                    outline.append(a)
                if heights[a] * heights[b] < 0.0:
                    outline.append(between(a, b))
            for i in range(1, len(outline) - 1):
                made.append((outline[0], outline[i], outline[i + 1]))
                zones.append(name)
    if not made:
        return values, np.zeros((0, 3), np.int64), np.zeros(0, "U16")
    return (
        np.concatenate([values, np.array(added)]) if added else values,
        np.array(made),
        np.array(zones, dtype="U16"),
    )


EAR_XZ_M = (0.045, 0.715)
EAR_RADIUS_M = 0.015
CHIN_Z_M = 0.62

_SHOULDER_M = np.array([0.015, 0.168, 0.525])
_ELBOW_M = np.array([0.013, 0.313, 0.349])
_WRIST_M = np.array([0.176, 0.431, 0.245])
_ARM_RADIUS_M = 0.075
_SHORT_SLEEVE_M = 0.14
"""From the shoulder along the upper arm to the hem of a short sleeve."""


@dataclass(frozen=True, slots=True)
class Cut:
    """One step: the part of a zone where the level is positive becomes another zone."""

    zone: str
    into: str
    level: Level


def _above(z_m: float) -> Level:
    return lambda p: np.asarray(p[:, 2] - z_m)


def _below(z_m: float, slope: float = 0.0) -> Level:
    """Depth under a plane that passes (x = 0, z) and rises towards the front."""
    return lambda p: np.asarray(z_m + slope * p[:, 0] - p[:, 2])


def _arm_beyond(distance_m: float) -> Level:
    """Positive on the arms beyond a distance from the shoulder."""

    def level(p: Array) -> Array:
        p = _one_side(p)
        along = _along(p, _SHOULDER_M, _ELBOW_M) - distance_m
        upper = _to_segment(p, _SHOULDER_M, _ELBOW_M)
        lower = _to_segment(p, _ELBOW_M, _WRIST_M)
        return np.minimum(along, _ARM_RADIUS_M - np.minimum(upper, lower))

    return level


def _beyond_wrist(shift_m: float) -> Level:
    def level(p: Array) -> Array:
        p = _one_side(p)
        return np.minimum(_along(p, _WRIST_M, 2 * _WRIST_M - _ELBOW_M) - shift_m, p[:, 1] - 0.3)

    return level


def _mouth_inside(p: Array) -> Array:
    """Positive behind the lips and within the cheeks."""
    p = _one_side(p)
    sides = np.minimum(0.034 - p[:, 1], np.minimum(p[:, 2] - 0.636, 0.7 - p[:, 2]))
    front = 0.149 - 40.0 * p[:, 1] ** 2 - p[:, 0]
    return np.minimum(np.minimum(sides, front), p[:, 0] - 0.05)


def _above_hairline(p: Array) -> Array:
    x = (-0.05, 0.0, 0.026, 0.034, 0.076, 0.086, 0.11, 0.15, 0.17)
    z = (0.642, 0.655, 0.69, 0.742, 0.745, 0.768, 0.792, 0.801, 0.805)
    return np.asarray(p[:, 2] - np.interp(p[:, 0], x, z))


def _neck_hole(p: Array) -> Array:
    """Positive within the neckline of a garment."""
    return np.minimum(0.074 - np.hypot(p[:, 0] - 0.012, p[:, 1]), p[:, 2] - 0.545 + 0.5 * p[:, 0])


def _inside_lapel(sign: float) -> Level:
    """Positive on the chest to one side of a lapel of an open jacket."""

    def level(p: Array) -> Array:
        half = np.interp(p[:, 2], (0.13, 0.3, 0.52), (0.016, 0.024, 0.062))
        return np.minimum(half + sign * p[:, 1], p[:, 0] - 0.03)

    return level


def _shoulders(p: Array) -> Array:
    """Positive on the skin outside of every neckline."""
    return np.minimum(np.hypot(p[:, 0] - 0.012, p[:, 1]) - 0.098, 0.6 - p[:, 2])


@dataclass(frozen=True, slots=True)
class _Feature:
    """An ellipsoid on either side of the head that gets its own number of triangles."""

    middle_m: tuple[float, float, float]
    radii_m: tuple[float, float, float]

    def holds(self, p: Array) -> NDArray[np.bool_]:
        """Whether positions [n, 3] lie inside."""
        away = (_one_side(p) - self.middle_m) / self.radii_m
        return np.asarray((away * away).sum(axis=1) < 1.0)


_EYEBALL = _Feature((0.1245, 0.0308, 0.7284), (0.0132, 0.0132, 0.0132))
# The first that holds a triangle gets it. Numbers of triangles are in ``zone_triangles.yaml``.
_FEATURES = {
    "lids": _Feature((0.125, 0.0315, 0.7285), (0.04, 0.027, 0.0185)),
    "mouth": _Feature((0.15, 0.0, 0.661), (0.035, 0.034, 0.018)),
    "nose": _Feature((0.155, 0.0, 0.7), (0.03, 0.026, 0.026)),
    "ears": _Feature((0.04, 0.088, 0.718), (0.045, 0.022, 0.05)),
    "mask": _Feature((0.12, 0.0, 0.71), (0.085, 0.09, 0.1)),
}


def mark_features(rows: MeshRows) -> MeshRows:
    """The mesh with the features of its face as separate zones, for ``simplify_region``.

    Its edges are not cut: zones of features are merged again. Faces hidden by an eyeball are
    dropped.
    """
    zones = rows.zones.copy()
    face = np.flatnonzero(zones == "face")
    middles = rows.values[rows.faces[face], :3].mean(axis=1)
    for name, feature in reversed(_FEATURES.items()):
        zones[face[feature.holds(middles)]] = name
    zones[face[_EYEBALL.holds(middles)]] = ""
    return MeshRows(rows.values, rows.faces, zones)


def merge_features(rows: MeshRows) -> MeshRows:
    """The mesh with its features in the zone ``face`` again."""
    zones = np.where(np.isin(rows.zones, list(_FEATURES)), "face", rows.zones)
    return MeshRows(rows.values, rows.faces, zones)


def _one_side(p: Array) -> Array:
    return np.stack([p[:, 0], np.abs(p[:, 1]), p[:, 2]], axis=1)


def _along(p: Array, a: Array, b: Array) -> Array:
    axis = (b - a) / np.sqrt(((b - a) ** 2).sum())
    return np.asarray(((p - a) * axis).sum(axis=1))


def _to_segment(p: Array, a: Array, b: Array) -> Array:
    t = ((p - a) * (b - a)).sum(axis=1) / ((b - a) ** 2).sum()
    nearest = a + np.clip(t, 0.0, 1.0)[:, None] * (b - a)
    return np.asarray(np.sqrt(((p - nearest) ** 2).sum(axis=1)))


HAIRLINE = Cut("face", "scalp", _above_hairline)
SHOULDERS = Cut("face", "", _shoulders)
WAIST = Cut("hips", "torso", _above(0.13))
# One lapel after the other: a level that bends within a triangle would be cut raggedly.
FRONT = (
    Cut("torso", "lapel", _inside_lapel(1.0)),
    Cut("lapel", "front", _inside_lapel(-1.0)),
    Cut("lapel", "torso", lambda p: np.ones(len(p))),
)
THIGH = Cut("legs", "upper_legs", _above(-0.385))
KNEE = Cut("thighs", "shins", _below(-0.31))
CUFF = Cut("shins", "ankles", _below(-0.7))
SOLE = Cut("shoes", "soles", _below(-0.794))

BODY: Sequence[Cut] = (
    Cut("face", "hands", _beyond_wrist(-0.02)),
    Cut("face", "arms", _arm_beyond(_SHORT_SLEEVE_M - 0.04)),
    Cut("face", "legs", _below(-0.15)),
    Cut("legs", "", _below(-0.75)),
    THIGH,
    Cut("face", "", _below(0.535, -0.3)),
    SHOULDERS,
    Cut("face", "", _mouth_inside),
    HAIRLINE,
)
"""Brows and lips are painted on the face (``face_textures``)."""
EYES: Sequence[Cut] = (Cut("eyes", "irises", lambda p: np.asarray(p[:, 0] - 0.1375)),)
TIGHTS: Sequence[Cut] = (
    Cut("hips", "sleeves", _arm_beyond(_SHORT_SLEEVE_M)),
    WAIST,
    Cut("torso", "", _neck_hole),
    *FRONT,
    Cut("hips", "thighs", _below(-0.01)),
    KNEE,
    CUFF,
    Cut("ankles", "shoes", _below(-0.752, 0.25)),
    SOLE,
)
SKIRT: Sequence[Cut] = (
    Cut("skirt_top", "skirt_middle", _below(-0.24)),
    Cut("skirt_middle", "skirt_end", _below(-0.45)),
    Cut("skirt_end", "", _below(-0.62)),
)
HAIR: Sequence[Cut] = (Cut("hair", "hair_end", _below(0.57)),)

OUTLINES = load_table(__package__, "outlines", tuple[tuple[float, ...], ...])
ZONE_TRIANGLES = load_table(__package__, "zone_triangles", int)
CURTAIN_X_M = 0.03
CURTAIN_REACH_RAD = 1.75
"""From the back of the head to the hair's front edge, behind the ears."""
CURTAIN_COLUMNS = 15


def curtain_points() -> Array:
    """Points of long hair [m], float64 [rows * CURTAIN_COLUMNS, 3]: arcs around the head."""
    turn = np.linspace(-1.0, 1.0, CURTAIN_COLUMNS) * CURTAIN_REACH_RAD
    z, length, width = (column[:, None] for column in np.array(OUTLINES["curtain"]).T)
    x = CURTAIN_X_M - length * np.cos(turn)
    return np.stack(np.broadcast_arrays(x, width * np.sin(turn), z), axis=2).reshape(-1, 3)


def apply_cuts(rows: MeshRows, cuts: Sequence[Cut]) -> MeshRows:
    """A mesh after several cuts, made one after the other."""
    for cut in cuts:
        rows = split_region(rows, cut.zone, cut.into, cut.level)
    return rows
