"""Template body: mesh, shapes and bones.

Template frame: metres, Z up, front +X, left +Y; the origin lies in the pelvis. The body stands
upright with its arms held away from it. All that moves with the body is a *point* in one list:
bone heads first, then landmarks, then the vertices of skin, clothes and hair.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core.errors import AssetError

FORMAT = 1
"""Raised whenever an older ``body.npz`` can no longer be read."""
FILE = "body.npz"
DELTA_M = 5e-5
"""Step of the stored shape differences [m]."""
BONES_PER_POINT = 4

LANDMARKS = ("nose", "left_eye", "right_eye", "left_ear", "right_ear", "crown", "sole")
"""Points that no bone marks: of the face, the top of the head, the underside of a foot."""

ZONES = (
    "face", "scalp", "brows", "lips", "eyes", "irises", "arms", "hands", "legs", "upper_legs",
    "torso", "front", "sleeves", "hips", "thighs", "shins", "ankles", "shoes", "soles",
    "skirt_top", "skirt_middle", "skirt_end", "hair", "hair_end",
)  # fmt: skip
"""Parts of the template that are shown or left out as a whole."""

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False, slots=True)
class BodyTemplate:
    """A template body. All arrays are read-only.

    Attributes:
        bones: Names, each after its parent.
        parents: Index of each bone's parent, -1 for the root, int64 [bones].
        points_m: Bone heads, landmarks, vertices in the template frame, float64 [points, 3].
        targets: Names of the shapes, words joined by hyphens (``male-old-maxweight``).
        deltas: Displacement of the points by each shape, in units of ``DELTA_M``, int16 [targets,
            points, 3].
        weight_bones: Bones that move each point, int64 [points, 4].
        weights: Their shares, which sum to 1, float64 [points, 4].
        faces: ``{zone: int64 [n, 3]}``, indices into the points.
    """

    bones: tuple[str, ...]
    parents: Indices
    points_m: Array
    targets: tuple[str, ...]
    deltas: NDArray[np.int16]
    weight_bones: Indices
    weights: Array
    faces: Mapping[str, Indices]

    def shaped(self, figure: Mapping[str, float]) -> Array:
        """Points of the template in the shape of a figure [m], float64 [points, 3].

        Args:
            figure: Strength in [0, 1] of each word that names of shapes are made of. A shape's
                strength is the product over its words; words that are missing count as 0.
        """
        points: Array = self.points_m.copy()
        for name, delta in zip(self.targets, self.deltas, strict=True):
            strength = 1.0
            for word in name.split("-"):
                strength *= figure.get(word, 0.0)
            if strength:
                points += delta * (strength * DELTA_M)
        return points

    def landmark(self, name: str) -> int:
        """Index of a landmark among the points."""
        return len(self.bones) + LANDMARKS.index(name)

    def bone(self, name: str) -> int:
        """Index of a bone, which is also the index of its head among the points."""
        return self.bones.index(name)


def load(path: Path) -> BodyTemplate:
    """The body stored in a file by ``save``.

    Raises:
        AssetError: if the file is absent, damaged or of another format.
    """
    remedy = "install it again: gen-data assets install people"
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays: dict[str, NDArray[Any]] = {name: archive[name] for name in archive.files}
        found = int(arrays["format"])
        if found != FORMAT:
            raise AssetError(f"{path}: is of format {found}, not {FORMAT}; {remedy}")
        return _body(arrays)
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise AssetError(f"{path}: the people pack cannot be read ({error}); {remedy}") from error


def save(body: BodyTemplate, path: Path) -> None:
    """Store a body; the same body gives the same bytes."""
    sizes = [len(body.faces.get(zone, ())) for zone in ZONES]
    faces = [body.faces[zone] for zone in ZONES if zone in body.faces]
    arrays = {
        "format": np.array(FORMAT),
        "bones": np.array(body.bones),
        "parents": body.parents.astype(np.int16),
        "points_m": body.points_m.astype(np.float32),
        "targets": np.array(body.targets),
        "deltas": body.deltas,
        "weight_bones": body.weight_bones.astype(np.uint8),
        "weights": body.weights.astype(np.float32),
        "zone_sizes": np.array(sizes),
        "faces": np.concatenate(faces).astype(np.int32),
    }
    np.savez_compressed(path, allow_pickle=False, **arrays)


def encode_deltas(deltas_m: Array) -> NDArray[np.int16]:
    """Shape differences [m] in units of ``DELTA_M``."""
    return np.rint(deltas_m / DELTA_M).astype(np.int16)


def strongest_weights(weights: Array) -> tuple[Indices, Array]:
    """Bones and shares, shape [points, 4] each, from a full table [points, bones]."""
    order = np.argsort(-weights, axis=1, kind="stable")[:, :BONES_PER_POINT]
    shares = np.take_along_axis(weights, order, axis=1)
    return order, shares / np.maximum(shares.sum(axis=1, keepdims=True), 1e-9)


def _body(arrays: Mapping[str, NDArray[Any]]) -> BodyTemplate:
    weights = arrays["weights"].astype(np.float64)
    ends = np.cumsum(arrays["zone_sizes"])[:-1]
    faces = dict(zip(ZONES, np.split(arrays["faces"].astype(np.int64), ends), strict=True))
    body = BodyTemplate(
        bones=tuple(str(name) for name in arrays["bones"]),
        parents=arrays["parents"].astype(np.int64),
        points_m=arrays["points_m"].astype(np.float64),
        targets=tuple(str(name) for name in arrays["targets"]),
        deltas=arrays["deltas"],
        weight_bones=arrays["weight_bones"].astype(np.int64),
        weights=weights / weights.sum(axis=1, keepdims=True),
        faces={zone: part for zone, part in faces.items() if len(part)},
    )
    if not len(body.points_m) == len(body.weights) == body.deltas.shape[1]:
        raise ValueError("its arrays do not belong together")
    return body
