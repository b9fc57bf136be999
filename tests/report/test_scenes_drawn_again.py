"""The report and the certificate draw the scenes of a data set again, from its plan alone."""

from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import gen_data
from gen_data.config.distributions import Uniform
from gen_data.report import drawn_parameters
from gen_data.report.drawn_parameters import Parameter, replay_scenes
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


def replay_of(**values: list[float]) -> SimpleNamespace:
    """A replay of parameters that are uniform in 2 to 4, with the values of accepted attempts."""
    uniform, text = Uniform(2.0, 4.0), "{uniform: [2, 4]}"
    parameters = {
        name: Parameter(name, drawn, Counter({text: len(drawn)} if drawn else {}), firsts=[
            (uniform, 3.0)
        ])
        for name, drawn in values.items()
    }  # fmt: skip
    distributions = {(name, text): uniform for name in values}
    return SimpleNamespace(
        parameters=parameters, distributions=distributions, scenes=1, differences=[], rejections={}
    )


def test_a_parameter_drawn_in_rejected_attempts_only_is_no_row_of_the_report(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    replay = replay_of(tilt=[], distance=[2.5, 3.5])
    monkeypatch.setattr(drawn_parameters, "replay_scenes", lambda *_: replay)
    monkeypatch.setattr(StoredSamples, "__init__", lambda *_: None)
    (kept,) = drawn_parameters.draw_parameters(StoredSamples(Path()), 1).parameters
    assert (kept.name, kept.values, kept.limits) == ("distance", [2.5, 3.5], (2.0, 4.0))


@pytest.mark.parametrize(("n", "wanted"), [(5, 2_000), (100, 10_000), (1_000, 50_000)])
def test_a_declared_distribution_has_draws_in_proportion_to_the_drawn_values(
    n: int, wanted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hundred for each value, at least 2000 and at most 50,000, over the whole support."""
    replay = replay_of(distance=[3.0] * n)
    monkeypatch.setattr(drawn_parameters, "replay_scenes", lambda *_: replay)
    monkeypatch.setattr(StoredSamples, "__init__", lambda *_: None)
    (kept,) = drawn_parameters.draw_parameters(StoredSamples(Path()), 1).parameters
    assert len(kept.expected) == wanted
    shares = np.histogram(kept.expected, 4, (2.0, 4.0))[0] / wanted
    # Five standard deviations of a share of a quarter.
    assert np.abs(shares - 0.25).max() < 5 * (0.25 * 0.75 / wanted) ** 0.5
