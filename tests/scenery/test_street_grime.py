"""Grime of street furniture: where it lies, by height above the ground."""

import numpy as np
import pytest

from gen_data.assets.family import Worn
from gen_data.content.scenery import FAMILIES, TEXTURES
from tests.every_value import for_every
from tests.solids import new_and_worn

GRIMY = sorted(name for name, family in FAMILIES.items() if isinstance(family.build, Worn))
VARIANTS = [(name, seed) for name in GRIMY for seed in range(FAMILIES[name].variants)]


def test_boxes_and_posts_of_streets_are_grimy() -> None:
    assert {"bollard", "cabinet", "hydrant", "litter_bin", "post_box"} <= set(GRIMY)


@pytest.mark.slow
@for_every(VARIANTS)
def test_grime_changes_neither_shape_nor_print(variant: tuple[str, int]) -> None:
    """Other slots keep their materials."""
    new, used = new_and_worn(*variant)

    for before, after in zip(new.materials, used.materials, strict=True):
        assert before.base_color == after.base_color
        assert before == after or "street_grime" in after.texture


@pytest.mark.parametrize("name", ["cabinet", "bollard", "post_box"])
def test_the_foot_is_darkest_and_edges_above_streak(name: str) -> None:
    """Mean brightness of the texture by height, looked up through the mesh."""
    seed = next(
        s
        for s in range(FAMILIES[name].variants)
        if any("street_grime" in m.texture for m in FAMILIES[name].build(seed=s).mesh.materials)
    )
    mesh = FAMILIES[name].build(seed=seed).mesh
    slot = next(k for k, m in enumerate(mesh.materials) if "street_grime" in m.texture)
    used = np.unique(mesh.faces[mesh.face_slots == slot])
    image = TEXTURES["street_grime"].build(TEXTURES["street_grime"].variants - 1).albedo
    rows = np.clip(((1.0 - mesh.uvs[used, 1]) * len(image)).astype(int), 0, len(image) - 1)
    heights = mesh.vertices_m[used, 2]
    tone = image.astype(np.float64).mean(axis=2)

    assert (np.diff(rows[np.argsort(heights)]) <= 0).all()
    assert tone[-14:].mean() < 0.9 * tone[50:90].mean()
    assert tone[10:30].std(axis=1).mean() > 1.5 * tone[60:90].std(axis=1).mean()


def test_grime_grows_with_age() -> None:
    """Each step is darker than the one two before."""
    means = [TEXTURES["street_grime"].build(step).albedo.mean() for step in range(8)]

    assert all(later < earlier for earlier, later in zip(means, means[2:], strict=False))
