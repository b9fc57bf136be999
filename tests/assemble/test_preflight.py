"""Everything that would stop a run is found before it, and all of it at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from click.testing import CliRunner

import gen_data
from gen_data.generator.api.config import load_config
from gen_data.generator.assemble.pipeline_factory import PipelineFactory
from gen_data.generator.cli.main import cli
from gen_data.generator.core.errors import ConfigError

CAMERA = {"type": "rgb_camera", "size_px": [64, 48], "hfov_deg": 60}
BENT = {**CAMERA, "lens": {"model": "kannala_brandt", "k1": 0.01}}


def cart(*sensors: dict[str, Any], **sections: Any) -> dict[str, Any]:
    """A room with sensors on a carrier."""
    on_rig = [{"rig": "cart", "offset_m": [1.0, 0, 0.9], **sensor} for sensor in sensors]
    elements = [
        {"type": "room", "name": "room", "size_m": [5, 4, 2.8]},
        {"type": "carrier", "name": "cart"},
    ]
    return {"elements": elements, "sensors": on_rig, **sections}


def table(*sensors: dict[str, Any], **sections: Any) -> dict[str, Any]:
    """A tabletop with sensors."""
    left_out = {"sensors": "all", "exporters": "all"}
    return {"extends": "tabletop.yaml", "without": left_out, "sensors": [*sensors], **sections}


def check(config: Any) -> None:
    """Check a configuration as ``generate`` and ``plan`` do."""
    PipelineFactory(load_config(config), 2).check()


def refusal(config: dict[str, Any]) -> str:
    """The message with which a configuration is refused."""
    with pytest.raises(ConfigError) as caught:
        check(config)
    return str(caught.value)


def test_every_exporter_and_every_camera_that_does_not_fit_is_named() -> None:
    """Two formats of pinholes, two bent cameras, in one message."""
    message = refusal(
        cart(
            {**BENT, "name": "front"},
            {**BENT, "name": "side", "yaw_deg": 90},
            {**CAMERA, "name": "rear", "yaw_deg": 180},
            exporters=[
                {"type": "solo"},
                {"type": "kitti", "camera": "front"},
                {"type": "coco"},
            ],
        )
    )

    lens = "has a lens of the model 'kannala_brandt'"
    assert f"exporter 'solo': camera 'front' {lens}, camera 'side' {lens}, but" in message
    assert f"exporter 'kitti': camera 'front' {lens}, but" in message
    assert "exporter 'coco'" not in message
    assert "'rear'" not in message


def test_every_sensor_that_does_not_fit_is_named() -> None:
    """Two cameras on rigs that do not exist: both, and what exists."""
    message = refusal(
        cart({**CAMERA, "name": "a", "rig": "kart"}, {**CAMERA, "name": "b", "rig": "ego"})
    )

    assert [f"sensors[{k}]" in message for k in range(3)] == [True, True, False]


PAIR = ("rgb", "disparity")


def test_cameras_without_a_rig_are_no_stereo_pair() -> None:
    """``camera_pose`` gives each a pose of its own; the position is that of ``stereo_with``."""
    message = refusal(
        table(
            {**CAMERA, "name": "left", "channels": [*PAIR], "stereo_with": "right"},
            {**CAMERA, "name": "right"},
        )
    )

    assert "sensors[0].stereo_with: 'left' and 'right' are no rectified pair: " in message
    assert "mount them on one rig" in message


@pytest.mark.parametrize(
    ("right", "fault"),
    [
        ({"offset_m": [1.0, -0.1, 0.9], "yaw_deg": 2}, "they do not look the same way"),
        ({"offset_m": [1.0, 0.1, 0.9]}, "not straight to its right"),
        ({"offset_m": [1.0, -0.1, 0.9], "hfov_deg": 61}, "they are not the same pinhole"),
    ],
)
def test_pairs_on_a_rig_are_compared(right: dict[str, Any], fault: str) -> None:
    """Turned, on the wrong side, with another lens: each is refused before the first sample."""
    left = {**CAMERA, "name": "left", "channels": [*PAIR], "stereo_with": "right"}
    message = refusal(cart(left, {**CAMERA, "name": "right", **right}))

    assert "'left' and 'right' are no rectified pair: " in message
    assert fault in message


def test_a_pair_whose_mounting_varies_is_refused() -> None:
    """``rig_calibration`` moves each camera alone."""
    left = {**CAMERA, "name": "left", "channels": [*PAIR], "stereo_with": "right"}
    right = {**CAMERA, "name": "right", "offset_m": [1.0, -0.1, 0.9]}
    varied = [{"type": "rig_calibration", "name": "mounts"}]

    assert "no rectified pair" in refusal(cart(left, right, randomizers=varied))
    check(cart(left, right))


@pytest.mark.slow
def test_shipped_pairs_pass() -> None:
    """Of a street and of a wrist."""
    for name in ("kitti_stereo.yaml", "depth_cameras.yaml"):
        check(name)


def test_plan_and_generate_refuse_all_faults_with_the_same_message(tmp_path: Path) -> None:
    """A stereo pair and an exporter together; no folder is made."""
    config = table(
        {**BENT, "name": "left", "channels": ["rgb"]},
        {**CAMERA, "name": "middle", "channels": [*PAIR], "stereo_with": "right"},
        {**CAMERA, "name": "right"},
        exporters=[{"type": "bop", "camera": "left"}],
        splits={"train": 1},
    )
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(config))
    planned = CliRunner().invoke(cli, ["plan", str(file), "--n", "2"])
    with pytest.raises(ConfigError) as generated:
        gen_data.generate(file, 2, out=tmp_path / "out", workers=0)

    assert "no rectified pair" in str(generated.value)
    assert "exporter 'bop': camera 'left' has a lens" in str(generated.value)
    assert str(planned.exception) == str(generated.value)
    assert not (tmp_path / "out").exists()
