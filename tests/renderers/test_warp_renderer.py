"""The renderer as a pure function: reproducible bytes, bounded memory, devices."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import psutil
import pytest

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.scene import Body, Camera, Light, Scene
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.scene.device_assets import is_convex_solid
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import (
    FakeLibrary,
    box_mesh,
    camera_at,
    plane_mesh,
    room_mesh,
    sphere_mesh,
)

EVERYTHING = frozenset(Channel)


def library() -> FakeLibrary:
    meshes = {f"box{k}": box_mesh((0.1 + 0.01 * k, 0.2, 0.1)) for k in range(12)}
    return FakeLibrary({**meshes, "room": room_mesh(), "ball": sphere_mesh(0.1, 16)})


def scene_of(seed: int) -> Scene:
    rng = np.random.default_rng(seed)
    bodies = [Body("room", "room")]
    for k in range(8):
        x, y = (float(v) for v in rng.uniform(-0.5, 0.5, 2))
        asset = "ball" if k == 0 else f"box{int(rng.integers(12))}"
        bodies.append(
            Body(f"b{k}", asset, SE3.about_z(float(rng.uniform(0, 6)), (x, y, 0.1)), instance_id=k)
        )
    lamp = Light("l", "sphere", (0.5, 0.5, 2.0), intensity_cd=300.0, radius_m=0.1)
    return Scene("t", tuple(bodies), lights=(lamp,))


def camera(size_px: tuple[int, int] = (96, 72)) -> Camera:
    return camera_at((1.2, -0.8, 1.0), (0.0, 0.0, 0.1), size_px)


@pytest.mark.slow
def test_memory_stays_flat_over_many_scenes() -> None:
    """After a warm-up, sixty scenes add less than 8 MB."""
    renderer = WarpRenderer(library(), "cpu")
    process = psutil.Process()
    for seed in range(30):
        renderer.render(scene_of(seed), camera(), EVERYTHING)
    before = process.memory_info().rss
    for seed in range(30, 90):
        renderer.render(scene_of(seed), camera(), EVERYTHING)

    assert process.memory_info().rss - before < 8 << 20


@pytest.mark.parametrize(
    ("mesh", "convex"),
    [(box_mesh(), True), (sphere_mesh(0.3, 12), True), (plane_mesh(), True), (room_mesh(), False)],
)
def test_a_solid_is_convex_if_no_vertex_lies_outside_a_face(mesh: object, convex: bool) -> None:
    """A room seen from inside is a cavity, not a solid."""
    assert is_convex_solid(mesh.vertices_m, mesh.faces) is convex


def test_a_device_that_is_not_there_is_an_error_that_names_the_remedy() -> None:
    """The error lists the existing devices and the alternatives."""
    with pytest.raises(ConfigError, match=r"'cuda:7' does not exist .* Choose 'auto' or 'cpu'"):
        WarpRenderer(library(), "cuda:7")


def test_settings_refuse_what_they_do_not_know() -> None:
    """Strictly: no unknown field, no negative radius."""
    for wrong in ({"antialias": 3}, {"ambient_occlusion_radius_m": -1.0}, {"glow": True}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            RenderSettings.model_validate(wrong)


@pytest.mark.slow
def test_rendering_prints_nothing() -> None:
    """Neither Warp's banner nor its warning about a missing driver reaches the terminal."""
    code = (
        "from tests.renderers.test_warp_renderer import *\n"
        "WarpRenderer(library(), 'cpu').render(scene_of(0), camera((16, 12)), EVERYTHING)\n"
    )

    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )

    assert (run.stdout, run.stderr) == ("", "")


def test_instances_up_to_the_largest_id_and_scenes_with_hundreds_of_bodies_are_rendered() -> None:
    """More bodies than a tile's list of occluders holds, and the last 16-bit id."""
    bodies = tuple(
        Body(
            f"b{k}", "ball", SE3((0.05 * (k % 10), 0.05 * (k // 10 % 10), 0.05 * (k // 100))), 0.3,
            instance_id=65535 - k,
        )
        for k in range(300)
    )  # fmt: skip
    scene = replace(scene_of(0), bodies=bodies)

    channels = WarpRenderer(library(), "cpu").render(scene, camera(), EVERYTHING).channels

    seen = np.unique(channels[Channel.INSTANCE])
    assert seen.max() > 65200
    assert channels[Channel.RADIANCE].any()
