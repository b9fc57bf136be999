"""Kinds and contents of household objects."""

import numpy as np
import pytest

from gen_data.content.procedural import FAMILIES, TEXTURES, fruit
from gen_data.content.procedural.bottles import choose_bottle
from gen_data.content.procedural.vessel_contents import CONTENTS, DRINKS, FOODS
from gen_data.content.procedural.vessels import STYLES, choose
from gen_data.core.errors import AssetError

# Categories of COCO that lie on tables, and the families that have them.
OF_COCO = {
    "bottle": ["bottle"], "wine glass": ["wine_glass"], "cup": ["mug", "cup", "tumbler"],
    "fork": ["fork"], "knife": ["knife"], "spoon": ["spoon"], "bowl": ["bowl"],
    "banana": ["banana"], "apple": ["apple"], "orange": ["orange"], "book": ["book"],
    "cell phone": ["cell_phone"], "remote": ["remote"], "mouse": ["mouse"],
    "keyboard": ["keyboard"], "scissors": ["scissors"], "vase": ["vase"],
    "sandwich": ["sandwich"], "broccoli": ["broccoli"], "carrot": ["carrot"], "pizza": ["pizza"],
    "donut": ["donut"], "cake": ["cake"],
}  # fmt: skip
GROUPS = ["bowl", "cup", "mug", "tumbler", "vase", "wine_glass"]


@pytest.mark.parametrize("families", OF_COCO.values(), ids=list(OF_COCO))
def test_every_category_has_forty_shapes(families: list[str]) -> None:
    """Each of its families offers as many."""
    assert all(FAMILIES[name].variants >= 40 for name in families)


@pytest.mark.parametrize("group", GROUPS)
def test_kinds_take_turns_and_contents_are_known_and_vary(group: str) -> None:
    """Every name is a row of a table; some variants are empty, some are not."""
    kinds = [name for name in STYLES if name.startswith(f"{group}/")]
    assert len(kinds) >= 7
    assert [choose(group, seed).kind for seed in range(len(kinds))] == kinds
    assert FAMILIES[group].variants >= 4 * len(kinds)
    drawn = [choose(group, seed).content for seed in range(FAMILIES[group].variants)]
    assert {name for name in drawn if name} <= DRINKS.keys() | FOODS.keys()
    assert drawn.count("") >= 5
    assert len(set(drawn)) >= 2


def first(group: str, contents: set[str]) -> int:
    """The first variant, uncovered, with one of some contents."""
    choices = ((seed, choose(group, seed)) for seed in range(FAMILIES[group].variants))
    return next(k for k, c in choices if c.content in contents and not c.lid and not c.straw)


@pytest.mark.parametrize("group", ["mug", "tumbler", "wine_glass"])
def test_a_drink_stays_inside_its_vessel(group: str) -> None:
    """Below the rim, and no wider than the wall at its height."""
    seed = first(group, {"coffee", "water", "beer", "red_wine"})
    mesh = FAMILIES[group].build(seed=seed).mesh
    drink = [k for k, material in enumerate(mesh.materials) if material.role == CONTENTS]
    poured = mesh.vertices_m[np.unique(mesh.faces[np.isin(mesh.face_slots, drink)])]
    wall = mesh.vertices_m[np.unique(mesh.faces[mesh.face_slots == 0])]
    rim = wall[wall[:, 2] > wall[:, 2].max() - 1e-3]
    axis = 0.5 * (rim.min(axis=0) + rim.max(axis=0))[:2]
    assert len(poured)
    assert poured[:, 2].max() < wall[:, 2].max()
    wide = np.hypot(*(wall[:, :2] - axis).T).max()
    assert np.hypot(*(poured[:, :2] - axis).T).max() < wide


def test_labels_name_the_kind_and_contents_and_bananas_count_as_stated() -> None:
    """The facts of a variant match its mesh. By the role of the slots."""
    seed = first("bowl", set(FOODS))
    facts = FAMILIES["bowl"].facts
    assert facts is not None
    said, choice = facts(seed=seed), choose("bowl", seed)
    assert f"bowl/{said.subcategory}" == choice.kind
    assert said.attributes == {"contents": choice.content}
    for seed in (0, 8, 13):
        roles = [m.role for m in FAMILIES["bottle"].build(seed=seed).mesh.materials]
        assert roles.count(CONTENTS) == bool(choose_bottle(seed).drink)
    # Peels of two slots; every banana has the same number of triangles.
    one, hand = (FAMILIES["banana"].build(seed=k).mesh for k in (0, 4))
    peels = int((hand.face_slots < 2).sum())
    assert fruit.banana_count(4) > 1
    assert peels == pytest.approx(fruit.banana_count(4) * len(one.faces), rel=0.02)


@pytest.mark.parametrize(
    "family", ["ceramic_decor", "drink_surface", "fruit_skin", "fruit_cut", "phone_screen"]
)
def test_unknown_kinds_of_prints_are_refused(family: str) -> None:
    with pytest.raises(AssetError, match=f"{family}: kind=tartan is unknown; expected one of"):
        TEXTURES[family].build(0, kind="tartan")
