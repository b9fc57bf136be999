"""Vectors of the map around the ego, on a straight road whose numbers are known."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.errors import ConfigError
from gen_data.core.scene import Body, Rig
from gen_data.core.se3 import SE3
from gen_data.exporters.map_vectors import MapVectors, world_lines
from tests.exporters.datasets import made_of
from tests.exporters.label_readers import json_lines
from tests.exporters.test_nuscenes_expansions import streets, town
from tests.libraries import library

EGO = SE3.about_z(np.pi, (32.0, 5.25, 0.0))
"""On the outer oncoming lane of the road along X, 60 m long and 14 m wide; it drives to -X."""


def vectors(exporter: MapVectors, pose: SE3 = EGO) -> dict[str, list[Any]]:
    lines = world_lines(streets(), library())
    return {k: [np.array(line) for line in v] for k, v in exporter.vectors(lines, pose).items()}


def test_lines_are_where_the_road_is_in_the_frame_of_the_ego() -> None:
    """Dividers 3.5 m apart, boundaries 14 m apart with the road to their right."""
    found = vectors(MapVectors(patch_m=(50.0, 30.0)))
    dividers = {round(float(line[:, 1].mean()), 3): line for line in found["divider"]}
    assert sorted(dividers) == [1.75, 5.25, 8.75]
    for y_m, line in dividers.items():
        np.testing.assert_allclose(line[:, 1], y_m, atol=1e-4)
        assert sorted(line[[0, -1], 0]) == [-25.0, 25.0]
    boundaries = {round(float(line[:, 1].mean()), 3): line for line in found["boundary"]}
    assert sorted(boundaries) == [-1.75, 12.25]
    # The exterior runs clockwise: the left boundary leads ahead, the right one back.
    assert boundaries[12.25][0, 0] < boundaries[12.25][-1, 0]
    assert boundaries[-1.75][0, 0] > boundaries[-1.75][-1, 0]
    assert all(np.ptp(line[:, 0]) == pytest.approx(49.6) for line in found["boundary"])
    ways = sorted(
        (round(float(k[:, 1].mean()), 2), bool(k[-1, 0] > 0)) for k in found["centerline"]
    )
    assert ways == [(0.0, True), (3.5, True), (7.0, False), (10.5, False)]
    assert found["ped_crossing"] == []


def test_crosswalks_are_closed_outlines_of_their_size() -> None:
    """In the middle of the junction: three of 3 m times 14 m, and no divider."""
    found = vectors(MapVectors(patch_m=(40.0, 40.0)), SE3((80.0, 0.0, 0.0)))
    areas = []
    for line in found["ped_crossing"]:
        assert (line[0] == line[-1]).all()
        x, y = line.T
        areas.append(0.5 * abs(float(x[:-1] @ y[1:] - y[:-1] @ x[1:])))
    assert areas == pytest.approx([3.0 * 14.0] * 3, abs=1e-2)


def test_the_lidars_axes_are_a_quarter_turn() -> None:
    ego, lidar = (vectors(MapVectors.model_validate({"axes": axes})) for axes in ("ego", "lidar"))
    for name, lines in ego.items():
        for one, other in zip(lines, lidar[name], strict=True):
            np.testing.assert_array_equal(other, np.stack([-one[:, 1], one[:, 0]], axis=1))


def chamfer_m(one: Any, other: Any) -> float:
    """Mean distance of points to the nearest point, both ways, as MapTR's evaluation has it."""
    away = np.linalg.norm(one[:, None] - other[None], axis=2)
    return 0.5 * float(away.min(axis=1).mean() + away.min(axis=0).mean())


def evenly(line: Any, count: int = 100) -> Any:
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    even = np.linspace(0.0, at[-1], count)
    return np.stack([np.interp(even, at, line[:, k]) for k in range(2)], axis=1)


dataset = made_of(MapVectors(), town, library)


def test_the_road_as_prediction_scores_perfectly_and_elsewhere_worse(dataset: Path) -> None:
    """Chamfer distances of 0 to lines of the ground truth; a shift by 2 m exceeds 1.5 m."""
    truth = json.loads((dataset / "train_map_anns.json").read_text())["GTs"]
    assert [row["sample_token"] for row in truth] == [f"{k:09d}" for k in range(4)]
    lines = [v for v in truth[0]["vectors"] if v["cls_name"] == "divider"]
    assert {v["type"] for v in lines} == {0} and all(v["pts_num"] == len(v["pts"]) for v in lines)
    x = np.linspace(0.0, 30.0, 31)
    for y in (-3.5, 0.0, 3.5):
        road = evenly(np.column_stack([x, np.full_like(x, y)]))
        found = [chamfer_m(evenly(np.array(v["pts"])), road) for v in lines]
        assert min(found) < 1e-3
        moved = [chamfer_m(evenly(np.array(v["pts"])) + np.array((0.0, 2.0)), road) for v in lines]
        assert min(moved) >= 1.5 - 1e-3


def check_files(folder: Path) -> None:
    """Centre lines of the four lanes before the ego at the start of the road."""
    row = json_lines(folder / "train.jsonl")[0]
    lines = [np.array(line) for line in row["annotation"]["centerline"]]
    found = sorted(round(float(line[:, 1].mean()), 3) for line in lines)
    assert found == [-5.25, -1.75, 1.75, 5.25]
    assert {round(float(line[:, 0].min()), 4) for line in lines} == {0.0}


def test_lines_name_their_samples(dataset: Path) -> None:
    check_files(dataset)
    rows = json_lines(dataset / "val.jsonl")
    assert [(row["index"], row["scene"], row["step"]) for row in rows] == [
        (4 + k, 1, k) for k in range(4)
    ]
    np.testing.assert_allclose(rows[0]["T_world_ego"], np.eye(4), atol=1e-9)


def test_scenes_without_a_rig_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"there is no rig ''; expected one of: none"):
        MapVectors().check_scene(streets())
    with_ego = replace(streets(), rigs=(Rig("ego", "ego"),), bodies=(Body("ego", "car"),))
    MapVectors().check_scene(with_ego)
    with pytest.raises(ConfigError, match=r"there is no rig 'eog'; expected one of: ego"):
        MapVectors(rig="eog").check_scene(with_ego)
