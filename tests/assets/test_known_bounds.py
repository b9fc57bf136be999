"""Bounds in the package are equal to the bounds of the meshes, which are not made."""

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from gen_data.assets.known_bounds import BoundsTable, encode_rows, read_table
from gen_data.assets.library import open_library
from tests.libraries import library

MESH = [[-1.0, -2.0, 0.0], [1.0, 2.0, 1.5]]
BODY = [[-1.0, -1.75, 0.0], [1.0, 1.75, 1.5]]
CAR, MUG = "00000000000000ff" + 48 * "0", "fedcba9876543210" + 48 * "1"


def table_of(known: dict[str, list[list[list[float]]]]) -> BoundsTable:
    rows = encode_rows({key: np.array(corners) for key, corners in known.items()})
    return BoundsTable(rows["key"], rows["corners_m"])


def test_a_table_holds_mesh_and_body_by_the_first_64_bits_of_the_key() -> None:
    table = table_of({MUG: [MESH], CAR: [MESH, BODY]})

    assert table.keys.tolist() == [0xFF, 0xFF, 0xFEDCBA9876543210]
    found = {key: table.find(key) for key in (CAR, MUG, 64 * "7")}
    assert np.array_equal(found[CAR], [MESH, BODY])  # type: ignore[arg-type]
    assert np.array_equal(found[MUG], [MESH])  # type: ignore[arg-type]
    assert found[64 * "7"] is None


def test_bounds_that_float32_cannot_hold_are_left_out() -> None:
    table = table_of({CAR: [[[0.1, 0.0, 0.0], [1.0, 1.0, 1.0]]], MUG: [MESH]})

    assert table.find(CAR) is None
    assert table.find(MUG) is not None


def test_known_bounds_are_those_of_the_mesh_and_make_nothing(tmp_path: Path) -> None:
    """A car has a body without mirrors besides; a horizon is drawn by season."""
    for asset_id in ("mug?seed=3", "car?seed=2", "horizon/trees?season=winter&seed=1"):
        empty = open_library((), tmp_path / "asked")
        found = empty.bounds_m(asset_id), empty.body_bounds_m(asset_id)

        assert not (tmp_path / "asked").exists()
        made = library().measured_bounds_m(asset_id)
        assert found[0] == tuple(map(tuple, made[0].tolist()))
        assert found[1] == (tuple(map(tuple, made[1].tolist())) if len(made) > 1 else None)


@pytest.mark.slow
def test_all_objects_that_are_offered_have_known_bounds() -> None:
    """Else ``python -m tests.contracts.asset_bounds``; rows of raised versions are missing."""
    offered = [a for a in library().find(()) if "procedural" in a.tags and "?" in a.asset_id]
    table, missing = read_table(), defaultdict(list)
    for asset in offered:
        if table.find(library().bounds_key(asset.asset_id)) is None:
            missing[asset.asset_id.partition("?")[0]].append(asset.asset_id)

    assert dict(missing) == {}


@pytest.mark.slow
def test_known_bounds_are_those_of_a_mesh_of_each_family() -> None:
    variants = defaultdict(list)
    for asset in library().find(()):
        if "procedural" in asset.tags and "?" in asset.asset_id:
            variants[asset.asset_id.partition("?")[0]].append(asset.asset_id)
    table = read_table()
    wrong = []
    for asset_ids in variants.values():
        asset_id = asset_ids[len(asset_ids) // 2]
        known = table.find(library().bounds_key(asset_id))
        if known is None or not np.array_equal(known, library().measured_bounds_m(asset_id)):
            wrong.append(asset_id)

    assert wrong == []
