"""Cloth over shop windows and stalls."""

import numpy as np

from gen_data.content.procedural.patches import join_patches
from gen_data.content.scenery.awnings import awning_cloth, hanging_cloth


def test_an_awning_sags_between_its_bars_and_has_two_sides() -> None:
    """The bars hold the cloth; half way it hangs below them; every sheet has another side."""
    cloth = join_patches(awning_cloth((1.0, 2.0), (0.0, 2.4), [0.0, 0.5, 1.0], [3, 4], 0.2))
    x, _, z = cloth.corners_m.reshape(-1, 3).T
    roof = z > 1.99
    straight = 2.4 - 0.4 * x

    assert np.allclose(z[roof & (x > 0.999)].max(), 2.0)
    assert np.allclose(z[roof & (x < 0.001)].max(), 2.4)
    assert (z[roof] < straight[roof] + 1e-6).all()
    assert z[roof & (abs(x - 1.0 / 3.0) < 0.01)].max() < 2.4 - 0.4 / 3.0 - 0.02
    assert np.isclose(z.min(), 1.8)
    edges = cloth.corners_m[:, 1:] - cloth.corners_m[:, :1]
    doubled_areas = np.cross(edges[:, 0], edges[:, 1])
    assert np.allclose(doubled_areas.sum(axis=0), 0.0, atol=1e-9)


def test_folds_of_a_hanging_deepen_downwards() -> None:
    """The upper edge is straight, the lower one waves about it."""
    cloth = join_patches(hanging_cloth(0.5, (-1.0, 1.0), (0.1, 0.8), 2))
    x, _, z = cloth.corners_m.reshape(-1, 3).T
    reach = [np.ptp(x[np.abs(z - level) < 1e-9]) for level in (0.8, 0.625, 0.1)]

    assert reach[0] < 0.005 < reach[1] < reach[2]
    assert 0.02 < reach[2] < 0.08
