"""Ambient light in the niches of windows."""

import numpy as np
import pytest

from gen_data.core.scene import VOLUME_REACH_M, IrradianceVolume
from gen_data.core.se3 import Vec3
from gen_data.rooms.interreflection import AXES, Hole, LitRoom
from gen_data.rooms.window_niches import find_niches

ROOM_CD_M2, OUTSIDE_CD_M2 = 40.0, 900.0
GREY: tuple[Vec3, ...] = ((0.5, 0.5, 0.5),) * 6
DIM = IrradianceVolume((0.0, 0.0, 0.0), (4.0, 3.0, 2.5), (1, 1, 1), (ROOM_CD_M2,) * 18)


def room(*holes: Hole) -> LitRoom:
    return LitRoom((0.0, 0.0, 0.0), (4.0, 3.0, 2.5), GREY, holes)


@pytest.mark.parametrize("side", [0, 1, 2, 3])
def test_what_faces_outdoors_has_its_light_and_what_faces_the_room_none_of_it(side: int) -> None:
    """Surfaces across the wall receive some of both."""
    axis = side // 2
    low, high = [1.0, 1.0, 0.9], [2.0, 2.0, 2.1]
    low[axis] = high[axis] = (4.0, 3.0)[axis] if side % 2 == 0 else 0.0
    hole = Hole(side, (low[0], low[1], low[2]), (high[0], high[1], high[2]))

    (niche,) = find_niches([room(hole)], [DIM], (OUTSIDE_CD_M2,) * 3)
    light = dict(enumerate(np.array(niche.light_cd_m2).reshape(6, 3)[:, 1].tolist()))
    aside = [v for k, v in light.items() if abs(AXES[k] @ AXES[side]) < 0.5]

    assert (light[side], light[side ^ 1]) == (OUTSIDE_CD_M2, ROOM_CD_M2)
    assert all(2.0 * ROOM_CD_M2 < v < 0.5 * OUTSIDE_CD_M2 for v in aside)


def test_a_niche_reaches_as_far_as_its_hole_and_its_sill() -> None:
    """Walls next to the window, and the floor before it, keep the light of the room."""
    hole = Hole(0, (4.0, 1.0, 0.9), (4.0, 2.2, 2.1))

    (niche,) = find_niches([room(hole)], [DIM], (OUTSIDE_CD_M2,) * 3)
    low = np.array(niche.low_m) - VOLUME_REACH_M
    high = np.array(niche.high_m) + VOLUME_REACH_M

    assert low[1:] == pytest.approx([1.0, 0.9], abs=0.01)
    assert high[1:] == pytest.approx([2.2, 2.1], abs=0.01)
    assert low[0] == pytest.approx(3.94, abs=0.002)
    assert high[0] > 4.1


def test_doors_between_rooms_have_no_niches() -> None:
    """Both of their sides are inside."""
    door = Hole(0, (4.0, 1.0, 0.0), (4.0, 1.9, 2.0), 1.0, (1, 0))

    assert find_niches([room(door)], [DIM], (OUTSIDE_CD_M2,) * 3) == ()
