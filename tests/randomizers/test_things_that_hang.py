"""Fruit in the leaves of a bough."""

import numpy as np
import pytest

from gen_data.core.errors import LayoutRejected
from gen_data.core.scene import ObjectGroup, SupportSurface
from gen_data.core.se3 import SE3
from gen_data.randomizers.placement import Floor, Item, lay_out
from tests.randomizers.doubles import rng_of

HOOKS = tuple((0.15 * k, 0.0, 0.5) for k in range(5))
GROUP = ObjectGroup("fruit", ("bough",), ("apple",), 3, "hang")


def floor() -> Floor:
    """The surface of a bough 1 m above the ground."""
    surface = SupportSurface("bough", "bough", SE3((0.0, 0.0, 1.0)), (1.1, 0.8), 0.8)
    return Floor(surface, hooks=HOOKS)


@pytest.mark.parametrize("number", range(4))
def test_objects_hang_below_different_hooks_by_their_upper_ends(number: int) -> None:
    """The middle of the upper side is at a hook; a stalk leans by no more than 26 degrees."""
    items = [Item((0.04, 0.04, 0.05))] * 4
    poses = lay_out(GROUP, items, [floor()], rng_of("hang", number), [True] * 4)
    tops = np.array([(pose @ SE3((0.0, 0.0, 0.05))).translation_m for pose in poses])
    away = np.linalg.norm(
        tops[:, None] - (np.array(HOOKS) + np.array([0.0, 0.0, 1.0]))[None], axis=2
    )
    assert away.min(axis=1).max() < 1e-9
    assert len(set(away.argmin(axis=1).tolist())) == 4
    for pose in poses:
        up = pose.rotate(np.array([0.0, 0.0, 1.0]))
        assert up[2] > np.cos(np.radians(26.0))


def test_more_objects_than_hooks_are_refused() -> None:
    """Five hooks, six objects."""
    with pytest.raises(LayoutRejected):
        lay_out(GROUP, [Item((0.04, 0.04, 0.05))] * 6, [floor()], rng_of("hang", 0), [True] * 6)
