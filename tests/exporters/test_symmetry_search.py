"""Symmetries found on surfaces and colours, judged by BOP's error of symmetric poses."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.assets.library import Library
from gen_data.core.asset_types import AssetFacts
from gen_data.core.se3 import IDENTITY, SE3
from gen_data.exporters.rigid_models import Model, Piece, build_model
from gen_data.exporters.symmetry_search import Samples, find_symmetries, sample_triangles

CUBE = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def corners(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangles of a deformed cube [12, 3, 3]."""
    quads = [points[list(face)] for face in FACES]
    return np.array([q[list(k)] for q in quads for k in ((0, 1, 2), (0, 2, 3))])


def folds(points: NDArray[np.float64], painted: int | None = None) -> dict[Any, int]:
    """Folds by axis of a deformed cube, one face of which may have another colour."""
    found = []
    for count, shift in ((20_000, 0.5), (3000, 0.25)):
        chosen, weights = sample_triangles(corners(points), count, shift)
        colors = np.full((count, 3), 90.0)
        if painted is not None:
            colors[chosen // 2 == painted] = 200.0
        places = np.einsum("nk,nkc->nc", weights, corners(points)[chosen])
        found.append(Samples(places, colors))
    symmetries = find_symmetries(*found)
    return {tuple(np.round(s.axis, 2).tolist()): s.fold for s in symmetries}


def symmetric_error(model: Model, turn: NDArray[np.float64]) -> float:
    """MSSD of a pose that is turned, as a share of the diameter.

    The least, over all symmetries S, of the largest distance between a turned vertex and S of it:
    Hodan et al., "BOP Challenge 2020", equation 2, written from the formula.
    """
    info = model.info
    points = np.stack([model.vertices[axis] for axis in "xyz"], axis=1).astype(np.float64)
    group = [np.eye(4), *(np.reshape(m, (4, 4)) for m in info.get("symmetries_discrete", ()))]
    for row in info.get("symmetries_continuous", ()):
        whole = [about(row["axis"], row["offset"], k * math.pi / 180) for k in range(360)]
        group = [a @ b for a in group for b in whole]
    moved = points @ turn[:3, :3].T + turn[:3, 3]
    errors = [np.linalg.norm(moved - (points @ s[:3, :3].T + s[:3, 3]), axis=1) for s in group]
    return float(min(e.max() for e in errors)) / float(info["diameter"])


def about(axis: Any, offset: Any, angle_rad: float) -> NDArray[np.float64]:
    """A turn about an axis through a point."""
    half = 0.5 * angle_rad
    turn = SE3((0, 0, 0), (math.cos(half), *(math.sin(half) * np.asarray(axis)))).matrix()
    turn[:3, 3] = np.asarray(offset) - turn[:3, :3] @ np.asarray(offset)
    return turn


def model_of(library: Library, asset: str) -> Model:
    return build_model((Piece(asset, 1.0, IDENTITY),), library)


@pytest.mark.parametrize(
    ("asset", "turn_deg"),
    [("pybullet/lego", 180), ("cake?seed=21", 180), ("cake?seed=21", 90), ("hot_dog?seed=2", 180),
     ("orange?seed=20", 40), ("gear?seed=5", 360 / 14)],
)  # fmt: skip
def test_a_turn_that_nobody_sees_is_no_error(library: Library, asset: str, turn_deg: float) -> None:
    """Without the symmetry the error is most of the diameter; tessellation may move a vertex."""
    model = model_of(library, asset)
    turn = about((0, 0, 1), (0, 0, 0), math.radians(turn_deg))
    assert symmetric_error(model, turn) < 0.05
    bare = replace(model, info={"diameter": model.info["diameter"]})
    assert symmetric_error(bare, turn) > 0.1


@pytest.mark.parametrize("asset", ["mug?seed=3", "banana?seed=1", "hammer?seed=2"])
def test_objects_that_look_different_after_any_turn_have_none(library: Library, asset: str) -> None:
    """A handle, a bend and a claw."""
    info = model_of(library, asset).info
    assert not {"symmetries_discrete", "symmetries_continuous"} & set(info)


@pytest.mark.slow
def test_what_assets_state_is_found_without_them(library: Library) -> None:
    """The groups of a nut, a flange, an elbow and a screwdriver with a flat tip, by their order."""
    for asset in ("nut?seed=2", "flange?seed=1", "pipe_elbow?seed=2", "screwdriver?seed=3"):
        stated = model_of(library, asset).info["symmetries_discrete"]

        class Silent:
            mesh, texture = library.mesh, library.texture

            @staticmethod
            def get(asset_id: str) -> Any:
                return replace(library.get(asset_id), facts=AssetFacts)

        found = build_model((Piece(asset, 1.0, IDENTITY),), Silent()).info  # type: ignore[arg-type]
        assert len(found["symmetries_discrete"]) == len(stated), asset


@pytest.mark.parametrize(
    ("size", "expected"), [((1, 1, 1), {4}), ((1, 1, 2), {2, 4}), ((1, 2, 3), {2})]
)
def test_boxes_have_the_turns_of_their_sides(size: Any, expected: set[int]) -> None:
    """A cube quarter turns about every axis, a column about one, a brick none."""
    found = folds(CUBE * size)
    assert {found[axis] for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))} == expected


def test_symmetries_depend_on_colours_and_not_on_the_frame_and_nothing_has_none() -> None:
    """Colours count: only the quarter turns about the painted side's axis look the same."""
    assert folds(CUBE, painted=1) == {(1.0, 0.0, 0.0): 4}
    # Its axes are found where the frame's own are none of them.
    pose = SE3((0.3, -0.2, 0.5), (0.8, 0.36, 0.48, 0.0))
    found = folds(CUBE * (1, 1, 3) @ pose.rotation().T + np.array(pose.translation_m))
    (axis,) = (np.array(a) for a, fold in found.items() if fold == 4)
    assert abs(axis @ pose.rotation()[:, 2]) == pytest.approx(1.0, abs=0.02)
    assert folds(CUBE * 0.0) == {}
