"""Cameras that look through photographs, which refuse other sensors."""

import json
from typing import Any

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import nominal_scene
from gen_data.core.errors import ConfigError
from gen_data.core.plates import EV100, fitted_intrinsics, has_plate
from gen_data.core.scene import Scene
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.plate import PlateElement
from gen_data.sensors.camera.plate_camera import PlateCamera
from tests.randomizers.doubles import PLATE, FakeAssets


def made(**fields: Any) -> PlateCamera:
    plain = {"type": "plate_camera", "size_px": [320, 200], **fields}
    return PlateCamera.model_validate_json(json.dumps(plain))


def on_a_plate() -> Scene:
    return build_scene("test", (PlateElement(name="plate"),), FakeAssets())


def test_it_looks_as_the_photograph_and_mounting_twice_changes_nothing() -> None:
    """Pose, lens and exposure, at its own size; no lamps but its sun."""
    camera = made().mount(on_a_plate()).camera("color")
    assert camera.T_world_camera == PLATE.T_world_camera
    assert camera.intrinsics == fitted_intrinsics(PLATE.intrinsics, 320, 200)
    assert camera.ev100 == EV100
    assert (made().image_pipeline.preset, made().image_pipeline.tone) == ("photograph", "srgb")

    once = made().mount(on_a_plate())
    assert made().mount(once) == once

    scene = on_a_plate()
    assert has_plate(scene)
    assert scene.lights == ()


def test_it_needs_a_plate_with_its_name() -> None:
    """Otherwise there is nothing to look through."""
    with pytest.raises(ConfigError, match="sensor 'front': there is no photograph"):
        made(name="front").mount(on_a_plate())
    with pytest.raises(ConfigError, match="sensor 'color': there is no photograph"):
        made().mount(Scene("empty"))


@pytest.mark.parametrize(
    "sensor", ["{type: rgb_camera, name: other}", "{type: lidar, name: roof, model: VLP-16}"]
)
def test_other_sensors_are_refused(sensor: str) -> None:
    color = "{type: plate_camera, name: color}"
    text = f"sensors=[{color}, {sensor}]"
    config = load_config("photo_plates", overrides=[text, "exporters=[]"])
    with pytest.raises(ConfigError, match="no geometry but its ground; expected a plate_camera"):
        nominal_scene(config, config.probes[0], FakeVehicles())


class FakeVehicles(FakeAssets):
    """Fake assets whose vehicles are found by every tag."""

    def find(self, tags: Any, kind: str = "object") -> Any:
        return (self.get("wagon"),) if kind == "object" else super().find(tags, kind)
