"""NaN and infinity, planted in every stage: an error that names the place, never an image."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.library import check_finite, open_library
from gen_data.core.asset_types import Material
from gen_data.core.capture import Channel, LidarHits, SensorReading
from gen_data.core.errors import AssetError, SampleError
from gen_data.core.interfaces import AssetLibrary, Renderer, Stage
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Camera, Lidar, Scene, Weather
from gen_data.core.se3 import IDENTITY, SE3
from gen_data.core.streams import Rng, Streams
from gen_data.pipeline.checked_renderer import CheckedRenderer
from gen_data.pipeline.pipeline import Pipeline
from gen_data.runner.regeneration import write_alone
from gen_data.sensors.camera.image_pipeline import ImagePipeline, develop, take_shot
from gen_data.sensors.camera.image_sensor import ImageSensor

SMALL = ("sensors.color.size_px=[32, 24]", "sensors.color.ev100=9")
NAN, INF = math.nan, math.inf


@dataclass(frozen=True)
class Plant:
    change: Callable[[Scene], Scene]
    name: str = "plant"
    stage: Stage = Stage.VIEW

    def __call__(self, scene: Scene, assets: AssetLibrary, rng: Rng) -> Scene:
        del assets, rng
        return self.change(scene)


@pytest.fixture(scope="module")
def pipeline() -> Iterator[Pipeline]:
    """A table at a few pixels, with a fixed exposure: metering would fail on its own."""
    with PipelineFactory(load_config("tabletop.yaml", overrides=SMALL), n=2)() as opened:
        yield opened


def planted(pipeline: Pipeline, change: Callable[[Scene], Scene]) -> Pipeline:
    """The same pipeline with a fault in every view."""

    def open_scene(streams: Streams) -> tuple[Scene, Sequence[Any], Sequence[Any]]:
        scene, randomizers, sensors = pipeline.config.open_scene(streams)
        return scene, (*randomizers, Plant(change)), sensors

    changed = Pipeline(
        replace(pipeline.config, open_scene=open_scene),
        pipeline.assets,
        lambda: pipeline._physics,  # type: ignore[arg-type,return-value]
        lambda: pipeline.renderer,
    )
    changed._physics = pipeline._physics
    return changed


def dim_light(value: float) -> Callable[[Scene], Scene]:
    def change(scene: Scene) -> Scene:
        light = replace(scene.lights[0], illuminance_lux=value, intensity_cd=value)
        return replace(scene, lights=(light, *scene.lights[1:]))

    return change


def rough_body(value: float) -> Callable[[Scene], Scene]:
    def change(scene: Scene) -> Scene:
        bodies = tuple(
            replace(
                body, materials=(Material(roughness=value),) * max(1, len(body.materials or ()))
            )
            for body in scene.bodies
        )
        return replace(scene, bodies=bodies)

    return change


def moved_camera(value: float) -> Callable[[Scene], Scene]:
    def change(scene: Scene) -> Scene:
        camera = scene.cameras[0]
        pose = SE3.about_z(0.0, (value, 0.0, 1.0))
        return replace(scene, cameras=(replace(camera, T_world_camera=pose),))

    return change


@pytest.mark.parametrize("value", [NAN, INF])
@pytest.mark.parametrize(("plant", "field"), [
    (dim_light, r"lights\[0\]\."),
    (rough_body, r"bodies\[\d+\]\.materials\[0\]\.roughness"),
    (moved_camera, r"cameras(\[0\]\.T_world_camera| 'color': its pose is not rigid)"),
])  # fmt: skip
def test_a_scene_with_nan_or_infinity_is_an_error_with_its_field(
    pipeline: Pipeline,
    plant: Callable[[float], Callable[[Scene], Scene]],
    field: str,
    value: float,
    tmp_path: Path,
) -> None:
    """Light, material and pose; whether or not a kernel's clamp hides it from the image."""
    with pytest.raises(SampleError, match=field):
        write_alone(planted(pipeline, plant(value)), 0, tmp_path)


@dataclass(frozen=True)
class Broken:
    renderer: Any
    channel: Channel = Channel.RADIANCE
    value: float = NAN

    def render(self, *arguments: Any) -> SensorReading:
        reading: SensorReading = self.renderer.render(*arguments)
        image = reading.channels[self.channel].copy()
        image[3, 5] = self.value
        return replace(reading, channels={**reading.channels, self.channel: image})

    def scan(self, scene: Scene, lidar: Lidar, beams: Any) -> LidarHits:
        del scene, lidar, beams
        near = np.ones((2, 1), np.float32)
        ids = np.zeros((2, 1), np.uint16)
        ranges_m = near.copy()
        ranges_m[1] = self.value
        return LidarHits(ranges_m, near, near, ids, ids, np.zeros((2, 1), np.uint8))


@pytest.mark.parametrize(
    ("channel", "value"), [(Channel.RADIANCE, NAN), (Channel.RADIANCE, INF), (Channel.Z_DEPTH, NAN)]
)
def test_a_wrong_pixel_of_a_renderer_is_found_before_it_is_developed(
    pipeline: Pipeline, channel: Channel, value: float
) -> None:
    """The error names sensor, channel, number and place."""
    broken = CheckedRenderer(Broken(pipeline.renderer, channel, value))
    scene = pipeline.sample(0).scene
    found = rf"color\.{channel.value}: \d values are NaN or infinite, the first at \[3, 5"
    with pytest.raises(SampleError, match=found):
        broken.render(scene, scene.cameras[0], frozenset({Channel.RADIANCE, Channel.Z_DEPTH}))


def test_a_ray_without_a_hit_is_no_fault(pipeline: Pipeline) -> None:
    """Infinity means nothing there; NaN means nothing at all."""
    lidar = Lidar("top", "", IDENTITY, IDENTITY)
    scene = pipeline.sample(0).scene
    inner: Renderer = Broken(None, value=INF)
    assert np.isinf(CheckedRenderer(inner).scan(scene, lidar, None).range_m[1, 0])  # type: ignore[arg-type]
    with pytest.raises(SampleError, match=r"top\.range_m: 1 values are NaN or infinite"):
        CheckedRenderer(Broken(None)).scan(scene, lidar, None)  # type: ignore[arg-type]


class Undefined:
    def draw(self, rng: Rng) -> float:
        del rng
        return NAN


NOISE = ImageSensor().model_copy(update={"read_noise_e": Undefined()})


@pytest.mark.parametrize(("field", "value", "fault"), [
    *((name, Undefined(), rf"image_pipeline\.{name}: drew nan")
      for name in ("saturation", "vignetting", "blur_px", "glare")),
    # It is drawn within the sensor; its image is checked before the tone curve.
    ("image_sensor", NOISE, r"color\.image_pipeline: a stage makes NaN"),
])  # fmt: skip
def test_a_setting_of_a_camera_that_is_nan_makes_no_photograph(
    field: str, value: object, fault: str
) -> None:
    """The tone curve would make black of it, or a comparison leave the stage out."""
    rng = Streams(1, 0).rng("camera")
    camera = Camera("color", IDENTITY, Intrinsics.from_hfov(16, 12, hfov_rad=1.0), ev100=9.0)
    pipeline = ImagePipeline().model_copy(update={field: value})
    radiance = np.full((12, 16, 3), 100.0, np.float32)

    with pytest.raises(SampleError, match=fault):
        develop(take_shot(radiance, None, camera, Weather(), pipeline, rng))


def test_a_mesh_with_nan_is_an_error_with_its_vertex_or_the_field_of_its_material() -> None:
    """Physics would hang, a hierarchy of boxes lose its triangles; slots are in no scene's file."""
    mesh = open_library().mesh("mug?seed=0")
    for name in ("vertices_m", "normals", "uvs"):
        values = getattr(mesh, name).copy()
        values[7, 1] = NAN
        with pytest.raises(AssetError, match=rf"asset 'mine': {name}\[7\] is NaN or infinite"):
            check_finite("mine", replace(mesh, **{name: values}))
    with pytest.raises(AssetError, match=r"asset 'mine': materials\[0\]\.roughness is NaN"):
        check_finite("mine", replace(mesh, materials=(Material(roughness=NAN),)))


def test_an_environment_with_nan_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Such as an .exr file or a plug-in's sky."""
    library = open_library()
    spoilt = np.full((4, 8, 3), INF, np.float32)
    monkeypatch.setattr(library, "_is_generated", lambda _: True)
    monkeypatch.setattr(library._generated, "environment", lambda _: spoilt)

    with pytest.raises(AssetError, match="asset 'sky': its radiance is NaN or infinite"):
        library.environment("sky")
