"""Places of writing on meshes: from shares of a texture's image to triangles.

A texture may be on a mesh several times, and a line may be cut by an edge of the surface. The line
is followed from character to character: each one is on the triangle that contains its middle in the
image and is nearest to where the one before points.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import MeshData
from gen_data.core.se3 import Array
from gen_data.core.writing import Kind, Writing

Rows = NDArray[np.intp]
_INSIDE = 1e-6
"""Tolerance of barycentric weights."""
_STRAY = 0.5
"""Largest distance from where the character before points, over the distance to it."""
_SQUEEZED = 1.5
"""Proportions of letters that differ by more are due to rims."""
_CELLS = 2_000_000
"""Points times triangles that are compared at once."""


@dataclass(frozen=True, eq=False, slots=True)
class SurfaceQuads:
    """Quads with their corners on triangles of a mesh.

    Attributes:
        face: Index of the triangle of each corner, [n, 4].
        weights: Barycentric weights of the corners, [n, 4, 3]; outside of [0, 1] for a corner
            beyond the edge of the surface.
        corners_m: Corners in the frame of the mesh [m], [n, 4, 3].
    """

    face: Rows
    weights: Array
    corners_m: Array

    def take(self, rows: slice) -> "SurfaceQuads":
        """Some of the quads."""
        return SurfaceQuads(self.face[rows], self.weights[rows], self.corners_m[rows])


@dataclass(frozen=True, eq=False, slots=True)
class SurfaceWord:
    """A word of a line on a surface.

    Attributes:
        text: Its characters; empty for strokes that only look like writing.
        quads: First the word's, then its characters'.
        mirrored: Whether it is mirrored for those who look at the outside of the surface, bool [n]
            by quad.
    """

    text: str
    quads: SurfaceQuads
    mirrored: NDArray[np.bool_]


@dataclass(frozen=True, eq=False, slots=True)
class SurfaceText:
    """A line of text on a mesh.

    Attributes:
        text: Characters and spaces that are on the mesh.
        language: As in ``Writing``.
        stroke: As in ``Writing``.
        kind: As in ``Writing``.
        complete: Whether all characters of the line are on the mesh.
        quad: Quad of the line.
        words: Its words, in reading order.
    """

    text: str
    language: str
    stroke: float
    kind: Kind
    complete: bool
    quad: SurfaceQuads
    words: tuple[SurfaceWord, ...]


def place_writing(mesh: MeshData, slot: int, lines: Sequence[Writing]) -> tuple[SurfaceText, ...]:
    """Find the places of a texture's lines on the faces of a slot, which have the mesh's UVs.

    Rims that show the whole texture squeezed, such as edges of a printed plate, are left out.
    """
    chart = _Chart.of_slot(mesh, slot)
    if chart is None:
        return ()
    found: list[SurfaceText] = []
    for line in lines:
        places: list[SurfaceText] = []
        # Rows of images count down, v counts up.
        uv = np.stack([line.quads[..., 0], 1.0 - line.quads[..., 1]], axis=-1)
        for shift in chart.shifts():
            for strand in _strands(chart, uv + shift):
                locate = _on_chart(chart, uv + shift, strand.triangles)
                places.append(_lay_out(line, sorted(strand.triangles), locate))
        found += _not_squeezed(places)
    return tuple(found)


def _not_squeezed(places: Sequence[SurfaceText]) -> list[SurfaceText]:
    """Places of a line with about the proportions of the letters on the largest one."""
    if len(places) < 2:
        return list(places)
    sizes = []
    for place in places:
        letters = np.concatenate([word.quads.corners_m[1:] for word in place.words])
        sizes.append([np.linalg.norm(letters[:, k] - letters[:, 0], axis=1).mean() for k in (1, 3)])
    wide, high = np.array(sizes).T + 1e-9
    aspects = wide / high
    usual = aspects[int((wide * high).argmax())]
    kept = (aspects * _SQUEEZED >= usual) & (aspects <= _SQUEEZED * usual)
    return [place for place, keep in zip(places, kept.tolist(), strict=True) if keep]


def place_on_mesh(line: Writing) -> SurfaceText:
    """A line whose quads are in the frame of a rigid mesh."""
    return _lay_out(line, range(len(line.quads)), _in_frame(line.quads))


def _in_frame(quads: Array) -> "_Locate":
    """Quads in the frame of a mesh, which are on no triangle."""

    def locate(rows: Sequence[Sequence[int]]) -> tuple[SurfaceQuads, NDArray[np.bool_]]:
        corners_m = np.stack([_around(quads[list(row)]) for row in rows])
        n = len(corners_m)
        found = SurfaceQuads(np.zeros((n, 4), np.intp), np.zeros((n, 4, 3)), corners_m)
        return found, np.zeros(n, np.bool_)

    return locate


@dataclass(frozen=True, eq=False, slots=True)
class _Chart:
    """Triangles of a slot in the plane of the image.

    Attributes:
        face: Indices in the mesh, [m].
        origin, inverse: ``inverse @ (uv - origin)`` are the weights of the second and third corner,
            [m, 2] and [m, 2, 2].
        corners_m: Corners in the mesh's frame, [m, 3, 3].
        uv: Corners in the image, [m, 3, 2].
        mirrored: Whether the image is mirrored on the outside, bool [m].
    """

    face: Rows
    origin: Array
    inverse: Array
    corners_m: Array
    uv: Array
    mirrored: NDArray[np.bool_]

    @classmethod
    def of_slot(cls, mesh: MeshData, slot: int) -> "_Chart | None":
        face = np.flatnonzero(mesh.face_slots == slot)
        uv = mesh.uvs[mesh.faces[face]].astype(np.float64)
        edges = (uv[:, 1:] - uv[:, :1]).transpose(0, 2, 1)
        area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
        flat = np.abs(area) > 1e-12
        if not flat.any():
            return None
        face, uv, edges, area = face[flat], uv[flat], edges[flat], area[flat]
        corners_m = mesh.vertices_m[mesh.faces[face]].astype(np.float64)
        return cls(face, uv[:, 0], np.linalg.inv(edges), corners_m, uv, area < 0.0)

    def shifts(self) -> Iterator[Array]:
        """Repetitions of the image on the surface, as whole shares of its size."""
        low = np.floor(self.uv.min(axis=(0, 1)) + _INSIDE).astype(int)
        high = np.ceil(self.uv.max(axis=(0, 1)) - _INSIDE).astype(int)
        for i, j in product(range(low[0], high[0]), range(low[1], high[1])):
            yield np.array((i, j), np.float64)

    def weights(self, uv: Array, triangle: Rows) -> Array:
        """Weights [n, 3] of places [n, 2] on one triangle each."""
        two = np.einsum(
            "nij,nj->ni", self.inverse[triangle], uv - self.origin[triangle], optimize=False
        )
        return np.asarray(np.column_stack([1.0 - two.sum(axis=1), two]))

    def positions_m(self, uv: Array, triangle: Rows) -> Array:
        """Points [n, 3] of places [n, 2] on the planes of triangles."""
        weights = self.weights(uv, triangle)
        return np.asarray(
            np.einsum("nk,nki->ni", weights, self.corners_m[triangle], optimize=False)
        )

    def hits(self, uv: Array) -> tuple[Rows, Rows]:
        """Rows of places [n, 2] and the triangles that contain them, all pairs by place."""
        places, triangles = [], []
        step = max(1, _CELLS // len(self.face))
        low, high = self.uv.min(axis=1), self.uv.max(axis=1)
        for start in range(0, len(uv), step):
            part = uv[start : start + step, None]
            near = ((part >= low - _INSIDE) & (part <= high + _INSIDE)).all(axis=2)
            row, triangle = np.nonzero(near)
            inside = (self.weights(part[row, 0], triangle) >= -_INSIDE).all(axis=1)
            places.append(row[inside] + start)
            triangles.append(triangle[inside])
        return np.concatenate(places), np.concatenate(triangles)

    def nearest(self, uv: Array, guess: Rows) -> Rows:
        """Triangles [n] that contain places [n, 2], nearest to the plane of a guess for each.

        The guess itself where none is near it.
        """
        expected_m = self.positions_m(uv, guess)
        place, triangle = self.hits(uv)
        away_m = np.linalg.norm(self.positions_m(uv[place], triangle) - expected_m[place], axis=1)
        centre_m = self.corners_m[guess].mean(axis=1)
        reach_m = _STRAY * np.linalg.norm(expected_m - centre_m, axis=1)
        found, best_m = guess.copy(), reach_m + 1e-6
        for p, t, d in zip(place.tolist(), triangle.tolist(), away_m.tolist(), strict=True):
            if d < best_m[p]:
                found[p], best_m[p] = t, d
        return np.asarray(found)


@dataclass(slots=True)
class _Strand:
    """A line as one place on the mesh has it: the triangle of each of its characters there."""

    triangles: dict[int, int] = field(default_factory=dict)


def _strands(chart: _Chart, uv: Array) -> list[_Strand]:
    """Follow characters [n, 4, 2] over the mesh; one strand per place that has the line."""
    middle = uv.mean(axis=1)
    place, triangle = chart.hits(middle)
    points_m = chart.positions_m(middle[place], triangle)
    strands: list[_Strand] = []
    for k in range(len(uv)):
        own = _distinct(np.flatnonzero(place == k), points_m)
        free = set(own)
        pairs = []
        for number, strand in enumerate(strands):
            last = max(strand.triangles)
            on = np.array([strand.triangles[last]])
            before_m, after_m = (chart.positions_m(middle[[i]], on)[0] for i in (last, k))
            reach_m = _STRAY * float(np.linalg.norm(after_m - before_m))
            for row in own:
                away_m = float(np.linalg.norm(points_m[row] - after_m))
                if away_m <= reach_m:
                    pairs.append((away_m, number, row))
        taken: set[int] = set()
        for _, number, row in sorted(pairs):
            if row in free and number not in taken:
                strands[number].triangles[k] = int(triangle[row])
                free.discard(row)
                taken.add(number)
        strands += [_Strand({k: int(triangle[row])}) for row in sorted(free)]
    return strands


def _distinct(rows: Rows, points_m: Array) -> list[int]:
    """Rows of different points: a point on an edge is on two triangles."""
    kept: list[int] = []
    for row in rows.tolist():
        if all(np.abs(points_m[row] - points_m[k]).max() > 1e-5 for k in kept):
            kept.append(row)
    return kept


_Locate = Callable[[Sequence[Sequence[int]]], tuple[SurfaceQuads, NDArray[np.bool_]]]
"""Finds the quads around some groups of characters, and whether they are mirrored."""


def _on_chart(chart: _Chart, uv: Array, triangles: Mapping[int, int]) -> _Locate:
    """Characters [n, 4, 2] whose triangles are known."""

    def locate(rows: Sequence[Sequence[int]]) -> tuple[SurfaceQuads, NDArray[np.bool_]]:
        corners = np.stack([_around(uv[list(row)]) for row in rows]).reshape(-1, 2)
        ends = np.array([[triangles[row[0]], triangles[row[-1]]] for row in rows])
        triangle = chart.nearest(corners, ends[:, [0, 1, 1, 0]].reshape(-1))
        found = SurfaceQuads(
            chart.face[triangle].reshape(-1, 4),
            chart.weights(corners, triangle).reshape(-1, 4, 3),
            chart.positions_m(corners, triangle).reshape(-1, 4, 3),
        )
        return found, chart.mirrored[ends[:, 0]]

    return locate


def _lay_out(line: Writing, numbers: Sequence[int], locate: _Locate) -> SurfaceText:
    """A line with some of its characters, by their numbers, on a surface."""
    letters = [k for k, letter in enumerate(line.text) if not letter.isspace()]
    groups: list[list[int]] = []
    for k in numbers:
        if line.kind == "print":
            between = line.text[letters[groups[-1][-1]] : letters[k]] if groups else " "
            if any(c.isspace() for c in between):
                groups.append([])
        elif not groups:
            groups.append([])
        groups[-1].append(k)
    rows = [numbers, *(part for group in groups for part in (group, *([k] for k in group)))]
    quads, mirrored = locate(rows)
    words, start = [], 1
    for group in groups:
        end = start + 1 + len(group)
        text = line.text
        if line.kind == "print":
            text = "".join(line.text[letters[k]] for k in group)
        words.append(SurfaceWord(text, quads.take(slice(start, end)), mirrored[start:end]))
        start = end
    whole = line.kind != "print" or len(numbers) == len(letters)
    text = line.text if whole else " ".join(word.text for word in words)
    quad = quads.take(slice(0, 1))
    return SurfaceText(text, line.language, line.stroke, line.kind, whole, quad, tuple(words))


def _around(quads: Array) -> Array:
    """The smallest parallelogram around quads [n, 4, k] of the same directions, [4, k]."""
    if len(quads) == 1:
        return np.asarray(quads[0])
    right, down = quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0]
    area = np.linalg.norm(right, axis=1) * np.linalg.norm(down, axis=1)
    largest = int(area.argmax())
    axes = np.stack([right[largest], down[largest]])
    shares = (quads.reshape(-1, quads.shape[2]) - quads[0, 0]) @ np.linalg.pinv(axes)
    (x0, y0), (x1, y1) = shares.min(axis=0), shares.max(axis=0)
    corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    return np.asarray(corners @ axes + quads[0, 0])
