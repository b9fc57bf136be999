"""The report and the certificate draw the scenes of a data set again, from its plan alone."""

from pathlib import Path

import pytest

import gen_data
from gen_data.report.drawn_parameters import replay_scenes
from gen_data.runner.stored import StoredSamples

CASES = {
    "hills": ("street.yaml", (
        "shared.district=residential", "randomizers.relief.grade=0.08",
        "randomizers.people.count=2", "randomizers.parked.count=2", "randomizers.traffic.count=2",
    )),
    "hands of bananas": ("tabletop.yaml", (
        "randomizers.clutter.count=3", "elements.clutter.assets={ids: ['banana?seed=4']}",
    )),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_scenes_drawn_again_are_the_stored_ones(name: str, tmp_path: Path) -> None:
    """Also where pieces are separated after physics, or a view is lifted onto its relief."""
    config, overrides = CASES[name]
    small = (
        "sensors.color.size_px=[64, 48]",
        "views_per_scene=2",
        "exporters=[]",
        "annotations=[]",
        *overrides,
    )
    gen_data.generate(config, 2, out=tmp_path / "set", workers=0, overrides=small)
    replay = replay_scenes(StoredSamples(tmp_path / "set"), 1)
    assert (replay.scenes, replay.differences) == (1, [])
