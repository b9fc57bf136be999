"""Asset ids that ask for sizes and choices: ``desk?width_m=1.6``."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from gen_data.assets.family_parameters import merge_draws
from gen_data.assets.library import Library, open_library
from gen_data.cli.main import cli
from gen_data.core.errors import AssetError, UnknownAsset
from gen_data.core.variant_rng import Draw


def size_m(library: Library, asset_id: str) -> np.ndarray:
    low, high = library.bounds_m(asset_id)
    return np.subtract(high, low)


def test_assets_are_as_asked_for_else_as_their_seed_makes_them_or_files(library: Library) -> None:
    """The desk of seed 3 is 0.72 to 0.76 m high; only its width changes."""
    free, wide = size_m(library, "desk?seed=3"), size_m(library, "desk?seed=3&width_m=1.6")
    assert wide[1] == pytest.approx(1.6, abs=1e-6)
    assert free[1] != pytest.approx(1.6, abs=1e-3)
    np.testing.assert_array_equal(wide[[0, 2]], free[[0, 2]])
    # It is 0 by default; equal assets have equal content.
    assert library.get("desk?width_m=1.6").sha256 == library.get("desk?seed=0&width_m=1.60").sha256
    # The kind in the labels matches the mesh.
    assert dict(library.get("straw_bale?kind=wrapped&seed=0").attributes)["kind"] == "wrapped"
    # Both draw the width, so both ids may ask for it: the leaf is half as wide.
    leaves = [size_m(library, f"wardrobe/door?seed=1&width_m={w}")[1] for w in (0.8, 1.2)]
    assert leaves[1] - leaves[0] == pytest.approx(0.2, abs=1e-6)
    with pytest.raises(UnknownAsset):
        library.parameters("user/mug")


def test_a_seed_looks_the_same_after_another_size(library: Library, tmp_path: Path) -> None:
    """Nothing that was asked for remains in a cache."""
    before = library.mesh("bookcase?seed=1").vertices_m.copy()
    library.mesh("bookcase?height_m=1.5&seed=1")
    again = open_library(cache_dir=tmp_path / "other")
    np.testing.assert_array_equal(again.mesh("bookcase?seed=1").vertices_m, before)


@pytest.mark.parametrize(
    ("asset_id", "message"),
    [
        ("desk?width_m=9", "asset 'desk?width_m=9': width_m expects a number from 1.2 to 1.8"),
        ("desk?drawers=1", "asset 'desk?drawers=1': drawers is none of false, true"),
        ("desk?widht_m=1.6", "asset 'desk?widht_m=1.6': 'desk' has no parameter 'widht_m' "
         "(did you mean 'width_m'?); expected depth_m, drawers, height_m, seed, top_thickness_m, "
         "width_m"),
        ("floor?seed=1", "asset 'floor?seed=1': 'floor' has no parameter 'seed'; expected size_m"),
    ],
)  # fmt: skip
def test_wrong_values_are_refused_when_read(library: Library, asset_id: str, message: str) -> None:
    """Describing an asset finds them: configurations are refused before the first sample.

    A refused id is refused again.
    """
    for ask in (library.get, library.mesh, library.mesh):
        with pytest.raises(AssetError) as caught:
            ask(asset_id)
        assert str(caught.value) == message


def test_parameters_unite_the_variants_and_are_described_also_of_namesakes() -> None:
    """Smallest and largest end, all options, and whether every variant draws it."""
    width = [Draw((1.0, 2.0), True, 1.5), Draw((0.5, 1.5), True, 0.7)]
    legs = Draw(("oak", "elm"), False, "elm")
    merged = merge_draws([{"width_m": width[0], "legs": legs}, {"width_m": width[1]}])
    assert [(p.name, p.words(), p.is_common, p.values) for p in merged] == [
        ("width_m", "0.5 to 2", True, (1.5, 0.7)),
        ("legs", "elm, oak", False, ("elm",)),
    ]
    result = CliRunner().invoke(cli, ["describe", "desk"])
    assert result.exit_code == 0, result.output
    assert "asset_family desk\nA desk, some with drawers at one side." in result.output
    assert "\nwidth_m: 1.2 to 1.8\n" in result.output
    assert "\ndrawers: false, true\n" in result.output
    assert "\n  asset: desk?depth_m=" in result.output
    for name, start in (
        ("overpass", "element overpass"),
        ("asset_family/overpass", "asset_family overpass"),
    ):
        assert CliRunner().invoke(cli, ["describe", name]).output.startswith(start)
