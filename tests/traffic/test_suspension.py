"""Cars on their springs: angles by hand from accelerations."""

import math

import numpy as np
import pytest

from gen_data.traffic.simulation import make_upright_trajectories
from gen_data.traffic.suspension import sway


def test_cars_roll_outwards_in_bends() -> None:
    """10 m/s on R = 50 m to the left: 2 m/s^2, at 4 degrees per g of 9.81 m/s^2."""
    turn = 0.1 * 10.0 / 50.0 * np.arange(20)
    ahead = np.stack([np.cos(turn), np.sin(turn)], axis=1)[:, None]
    rise, roll = sway(np.full((20, 1), 10.0), np.zeros((20, 1)), ahead, 0.1)
    np.testing.assert_allclose(roll, math.radians(4.0) * 2.0 / 9.81, rtol=1e-3)
    assert not rise.any()
    (track,) = make_upright_trajectories(
        ["car"], np.cumsum(np.ones((20, 1, 3)), axis=0), ahead, rise, [(0.0, 0.0, 0.0)], roll
    )
    assert track is not None
    # To the right, its left side is up.
    assert track.knots[3].rotation()[2, 1] == pytest.approx(math.radians(4.0) * 2 / 9.81, rel=1e-3)


def test_fronts_of_cars_dip_while_they_brake() -> None:
    """3 m/s^2 at 1.5 degrees per g: over a wheelbase of 2.7 m the front sinks by 21.6 mm."""
    ahead = np.tile([1.0, 0.0], (20, 1, 1))
    rise, roll = sway(np.full((20, 1), 10.0), np.full((20, 1), -3.0), ahead, 0.1)
    np.testing.assert_allclose(rise, -2.7 * math.radians(1.5) * 3.0 / 9.81)
    assert not roll.any()


def test_bodies_do_not_jump_when_brakes_are_released() -> None:
    """A step of the acceleration takes five instants."""
    braking = np.where(np.arange(20) < 10, -3.0, 0.0)[:, None]
    rise, _ = sway(np.full((20, 1), 5.0), braking, np.tile([1.0, 0.0], (20, 1, 1)), 0.1)
    steps = np.diff(rise[:, 0])
    assert steps.max() == pytest.approx(-rise[0, 0] / 5.0)
