"""First samples of shipped streets show the intended content."""

import pytest

import gen_data
from gen_data.assemble.config import load_config
from gen_data.core.streams import Streams


def test_four_samples_of_all_weathers_are_four_scenes_in_different_weather() -> None:
    """One view of each: ``--n 4`` is a first look."""
    config = load_config("street_all_weather")
    seed, views = config.general.seed, config.general.views_per_scene
    scenes = [config.shared(Streams(seed, n // views, index=n // views)) for n in range(4)]

    weathers = [dict(shared)["weather"] for shared in scenes]

    assert views == 1
    assert len(set(weathers)) == 4


@pytest.mark.slow
def test_the_receiver_of_carla_has_a_fix_in_the_first_scene() -> None:
    """CARLA's has one everywhere; the first street is in an old town."""
    assert all(gen_data.Dataset("carla_table.yaml")[0].measurements["gnss"]["quality"] == 1)
