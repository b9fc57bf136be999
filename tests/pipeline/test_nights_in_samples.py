"""Pictures of shipped scenes by night: cameras that see something."""

from pathlib import Path

import numpy as np
import pytest

import gen_data
from gen_data.assemble.config import load_config
from gen_data.sensors.camera.rgb_camera import RgbCamera

CONFIGS = Path(__file__).parents[2] / "configs"
DARK = ("ClearNight", "WetNight", "ClearDusk")
CASES = [
    (path.name, weather)
    for path in sorted(CONFIGS.glob("*.yaml"))
    for weather in DARK
    if weather in path.read_text()
]


def test_night_is_among_the_weathers_of_shipped_scenes() -> None:
    """Each case is a file that names it."""
    names = {name for name, _ in CASES}
    assert {"street.yaml", "highway.yaml", "parking.yaml", "pedestrians.yaml"} <= names


@pytest.mark.slow
@pytest.mark.parametrize(("name", "weather"), CASES)
def test_cameras_see_scenes_by_night(name: str, weather: str) -> None:
    """A tenth of the pixels are above grey level 25, which annotators call dark; not all are white.

    KITTI's camera, with 2 ms at most, saw nothing on motorways.
    """
    camera = next(s.name for s in load_config(name).sensors if isinstance(s, RgbCamera))
    overrides = [f"shared.weather={weather}", "views_per_scene=1", "exporters=[]",
                 f"sensors.{camera}.channels=[rgb]"]  # fmt: skip
    shares = []
    samples = gen_data.Dataset(name, n=3, overrides=overrides)
    for rgb in (sample.cameras[camera].rgb for sample in samples):
        shares.append([np.mean(rgb.mean(axis=2) > 25), np.mean(rgb.min(axis=2) > 250)])
    lit, white = np.median(shares, axis=0)
    assert lit > 0.1
    assert white < 0.2
