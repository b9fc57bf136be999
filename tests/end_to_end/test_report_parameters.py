"""The report of a generated data set: parameters that are drawn again."""

import math
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from gen_data.report.drawn_parameters import DrawnParameters, draw_parameters
from gen_data.runner.stored import StoredSamples


@pytest.fixture(scope="module")
def drawn(dataset: Path) -> DrawnParameters:
    with threadpool_limits(limits=1):
        return draw_parameters(StoredSamples(dataset), 3)


@pytest.mark.slow
def test_scenes_that_are_drawn_again_are_the_stored_ones(drawn: DrawnParameters) -> None:
    assert (drawn.scenes, drawn.different) == (3, 0)


@pytest.mark.slow
def test_drawn_values_are_those_of_the_stored_scenes(drawn: DrawnParameters, dataset: Path) -> None:
    """Fields of view follow from stored focal lengths, and robots from stored shared values."""
    values = {p.name: p.values for p in drawn.parameters}
    scenes = [StoredSamples(dataset).kept_scene(index).scene for index in range(15)]

    lenses = [scene.cameras[0].intrinsics for scene in scenes]
    hfov_deg = [math.degrees(2 * math.atan(lens.width_px / 2 / lens.fx_px)) for lens in lenses]
    assert np.abs(np.array(values["lens.hfov_deg"]) - hfov_deg).max() < 1e-4
    lights = [sum(light.kind == "sphere" for light in scene.lights) for scene in scenes]
    assert values["lamps.count"] == lights
    assert values["shared.robot"] == [dict(scenes[k].shared)["robot"] for k in (0, 5, 10)]


@pytest.mark.slow
def test_declared_values_are_drawn_from_the_declared_distribution(drawn: DrawnParameters) -> None:
    (distance,) = (p for p in drawn.parameters if p.name == "orbit.distance_m")

    assert list(distance.declared) == ["{uniform: [0.9, 1.5]}"]
    assert distance.limits == (0.9, 1.5)
    assert np.mean(distance.expected) == pytest.approx(1.2, abs=0.005)
