"""Sensors may depend on shared values, except in properties common to all samples."""

import math
from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.errors import ConfigError

HEAD = """\
seed: 3
shared:
  lens: {sequence: [wide, narrow]}
  height_px: {choice: [48, 64]}
elements:
  - {type: room, name: room, size_m: [4, 4, 3]}
  - {type: surface, name: table, asset: table, top_size_m: [1, 1], height_m: 0.7}
"""
WIDE_OR_NARROW = "{switch: lens, wide: 90, narrow: 40}"


def written(folder: Path, sensor: str) -> str:
    path = folder / "mine.yaml"
    path.write_text(f"{HEAD}sensors:\n  - {sensor}\n")
    return str(path)


def test_a_sensor_has_the_parameters_of_its_scene(tmp_path: Path) -> None:
    """A pinhole's focal length is half the width over the tangent of half its field of view."""
    camera = f"{{type: rgb_camera, name: eye, size_px: [64, 48], hfov_deg: {WIDE_OR_NARROW}}}"
    spec = load_config(written(tmp_path, camera))

    with open_pipeline(spec) as pipeline:
        focal_px = [pipeline.sample(k).scene.cameras[0].intrinsics.fx_px for k in range(2)]

    assert focal_px == pytest.approx(
        [32 / math.tan(math.radians(45)), 32 / math.tan(math.radians(20))]
    )


def test_a_sensor_captures_with_the_parameters_of_its_scene(tmp_path: Path) -> None:
    """Image processing after rendering varies with the scene, too."""
    camera = (
        "{type: rgb_camera, name: eye, size_px: [64, 48], time_offset_s: 0, "
        "exposure: {switch: lens, wide: {time_s: 0.004}, narrow: {time_s: 0.001}}}"
    )
    spec = load_config(written(tmp_path, camera))

    with open_pipeline(spec) as pipeline:
        sensors = [pipeline.accepted_scene(k).sensors[0] for k in range(2)]

    assert [sensor.exposure.time_s for sensor in sensors] == [0.004, 0.001]


@pytest.mark.parametrize(("sensor", "field", "column"), [
    ("{type: rgb_camera, name: $shared.lens}", "sensors[0].name", 30),
    ("{type: rgb_camera, name: a, size_px: [64, $shared.height_px]}", "sensors[0].size_px", 42),
    ("{type: rgb_camera, name: a, lens: {switch: lens, wide: {model: pinhole}}}",
     "sensors[0].lens.model", 39),
    ("{switch: lens, wide: {type: rgb_camera, name: a}}", "sensors[0]", 5),
])  # fmt: skip
def test_what_all_samples_have_in_common_cannot_depend_on_a_shared_value(
    tmp_path: Path, sensor: str, field: str, column: int
) -> None:
    """The place of the value, the field, and why."""
    source = written(tmp_path, sensor)

    with pytest.raises(ConfigError) as caught:
        load_config(source)

    assert str(caught.value).startswith(
        f"{source}:9:{column}: {field}: is the same in all scenes of a data set; "
        "expected a value that does not depend on shared ones"
    )
