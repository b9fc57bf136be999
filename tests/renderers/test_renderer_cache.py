"""Caches of the renderer change no pixel and no point."""

import ctypes
import weakref
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
import warp as wp

from gen_data.core import bounded_cache, se3, shutter
from gen_data.core.asset_types import Material, TextureData
from gen_data.core.capture import Channel
from gen_data.core.scene import Body, Light, Scene, Weather
from gen_data.renderers.warp import device, settings
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.scene import device_cache, environment_maps
from gen_data.renderers.warp.scene.device_assets import DeviceMesh
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.scene_packing import pack_world
from tests.renderers.fake_library import FakeLibrary, box_mesh, camera_at, plane_mesh
from tests.renderers.moving import even_track

CHECKER = TextureData(np.full((4, 4, 3), 128, np.uint8))
LIBRARY = FakeLibrary(
    {"box": box_mesh(), "floor": plane_mesh(20.0)}, {"brick": CHECKER, "ash": CHECKER}
)
SCENE = Scene(
    "cubes",
    (Body("floor", "floor"), Body("box", "box", se3.SE3((0.0, 0.0, 0.5)), instance_id=1)),
    lights=(Light("lamp", "sphere", (1.0, 2.0, 3.0), intensity_cd=900.0),),
    weather=Weather(wetness=0.8, puddles=0.3, seed=4),
)
EYES = tuple(
    camera_at(eye_m, (0.0, 0.0, 0.5), size_px=(96, 64))
    for eye_m in ((3.0, 0.5, 2.0), (-1.0, 3.0, 1.5))
)
CHANNELS = frozenset({Channel.RADIANCE, Channel.Z_DEPTH, Channel.INSTANCE})


def test_values_are_kept_by_identity_and_the_oldest_go() -> None:
    """An equal but different object is another key; a value requested again is the same."""
    cache: bounded_cache.ObjectCache[int] = bounded_cache.ObjectCache(2)
    first, second, third = [1], [1], [1]
    made: list[int] = []

    def make() -> int:
        made.append(len(made))
        return made[-1]

    assert [cache.get(key, make) for key in (first, first, second)] == [0, 0, 1]
    assert cache.get(first, make) == 0
    assert cache.get(third, make) == 2, "the third value displaces the second"
    assert [cache.get(key, make) for key in (first, second)] == [0, 3]


def test_cameras_of_one_scene_see_what_they_see_of_a_fresh_one() -> None:
    """Weather, lamps and poses of one view do not persist in the next."""
    shared = WarpRenderer(LIBRARY, "cpu")

    for eye in (*EYES, EYES[0]):
        alone = WarpRenderer(LIBRARY, "cpu").render(replace(SCENE), eye, CHANNELS)
        seen = shared.render(SCENE, eye, CHANNELS)
        for channel in CHANNELS:
            np.testing.assert_array_equal(seen.channels[channel], alone.channels[channel])


def test_another_scene_is_packed_anew() -> None:
    """One body moved and one repainted, in an otherwise equal scene."""
    renderer = WarpRenderer(LIBRARY, "cpu")
    red = (Material((0.8, 0.1, 0.1)),)
    before = renderer.render(SCENE, EYES[0], CHANNELS).channels
    floor, box = SCENE.bodies
    moved = replace(SCENE, bodies=(floor, replace(box, T_world_body=se3.SE3((0.0, 1.0, 0.5)))))
    painted = replace(SCENE, bodies=(floor, replace(box, materials=red)))

    after = renderer.render(moved, EYES[0], CHANNELS).channels
    colored = renderer.render(painted, EYES[0], CHANNELS).channels

    assert (before[Channel.Z_DEPTH] != after[Channel.Z_DEPTH]).any()
    np.testing.assert_array_equal(before[Channel.Z_DEPTH], colored[Channel.Z_DEPTH])
    on_box = before[Channel.INSTANCE] == 1
    changed = before[Channel.RADIANCE] != colored[Channel.RADIANCE]
    assert changed[on_box].any(axis=1).mean() > 0.9


def test_textures_of_several_bodies_find_their_places() -> None:
    """Materials with and without textures, in any order of bodies."""
    cache = DeviceCache(LIBRARY, device.open_device("cpu"))
    plain, brick, wood = (Material(texture=name) for name in ("", "brick", "ash"))
    looks = ((plain,), (brick,), (wood,), (plain,), (brick,))
    bodies = tuple(Body(f"{k}", "box", materials=look) for k, look in enumerate(looks))

    record = pack_world(Scene("t", bodies), EYES[0], cache).record

    assert record.surfaces.numpy()["texture"].tolist() == [-1, 1, 0, -1, 1]
    assert len(record.textures.numpy()) == 2


class StoringLibrary(FakeLibrary):
    """Stores derived arrays, read-only; refuses to compute them again."""

    def __init__(self) -> None:
        super().__init__({"box": box_mesh(), "floor": plane_mesh(20.0)}, {"brick": CHECKER})
        self.stored: dict[tuple[str, str], dict[str, np.ndarray]] = {}

    def derived(
        self, asset_id: str, name: str, compute: Callable[[], dict[str, np.ndarray]]
    ) -> dict[str, np.ndarray]:
        if (asset_id, name) not in self.stored:
            arrays = compute()
            for array in arrays.values():
                array.flags.writeable = False
            self.stored[asset_id, name] = arrays
        return self.stored[asset_id, name]

    def is_stored(self, asset_id: str) -> bool:
        return not asset_id.startswith("road")


def test_meshes_of_one_scene_do_not_drive_out_those_that_scenes_share(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Caches hold at least one mesh, however little memory they have."""
    monkeypatch.setattr(device_cache, "_OWN_MESH_BYTES", 1)
    library = StoringLibrary()
    library.meshes |= {"road 1": plane_mesh(9.0), "road 2": plane_mesh(8.0)}
    cache = DeviceCache(library, device.open_device("cpu"))
    shared, road = cache.mesh("box"), cache.mesh("road 1")

    cache.mesh("road 2")

    assert cache.mesh("box") is shared
    assert cache.mesh("road 1") is road
    cache.mesh("floor")
    assert cache.mesh("box") is not shared


def test_meshes_of_one_scene_are_freed_with_it() -> None:
    """The cache keeps the latest scene, however often its bodies move: two views share a road."""
    library = StoringLibrary()
    library.meshes |= {"road 1": plane_mesh(9.0), "road 2": plane_mesh(8.0)}
    cache = DeviceCache(library, device.open_device("cpu"))

    def pack(asset: str, x_m: float) -> weakref.ref[DeviceMesh]:
        body = Body("road", asset, se3.SE3((x_m, 0.0, 0.0)))
        pack_world(Scene("test", (body,)), EYES[0], cache)
        return weakref.ref(cache.mesh(asset))

    first = pack("road 1", 0.0)
    assert pack("road 1", 1.0)() is first() is not None
    pack("road 2", 0.0)
    assert first() is None


def test_an_environment_refers_to_its_image() -> None:
    """On the CPU: a worker has each sky once, and of stored panoramas none."""
    image = np.full((16, 32, 3), 1.0, np.float32)
    light = environment_maps.upload_environment(image, device.open_device("cpu"))
    assert light.image.ptr == image.__array_interface__["data"][0]


def test_stored_hierarchies_and_mip_levels_give_the_same_image() -> None:
    """Computed, stored, or loaded by another renderer."""
    floor, box = SCENE.bodies
    scene = replace(SCENE, bodies=(floor, replace(box, materials=(Material(texture="brick"),))))
    library = StoringLibrary()
    expected = WarpRenderer(LIBRARY, "cpu").render(scene, EYES[0], CHANNELS)
    for _ in range(2):
        seen = WarpRenderer(library, "cpu").render(scene, EYES[0], CHANNELS)
        for channel in CHANNELS:
            np.testing.assert_array_equal(seen.channels[channel], expected.channels[channel])
    assert {asset for asset, _ in library.stored} == {"box", "floor", "brick"}


def filling(allocate: Callable[..., wp.array], byte: int) -> Callable[..., wp.array]:
    """An allocator of memory of the CPU, filled with a byte."""

    def filled(*arguments: Any, **options: Any) -> wp.array:
        array = allocate(*arguments, **options)
        if array.size:
            ctypes.memset(array.ptr, byte, array.size * wp.types.type_size_in_bytes(array.dtype))
        return array

    return filled


@pytest.mark.slow
@pytest.mark.parametrize("visibility", ["raster", "rays"])
def test_images_depend_on_no_memory_of_earlier_frames(
    visibility: Literal["raster", "rays"], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Reused and fresh memory is filled with other bytes before each use.

    A box with a clear coat that moves before a rolling shutter, on wet ground.
    """
    coated = (Material((0.8, 0.1, 0.1), coat=1.0),)
    floor, box = SCENE.bodies
    scene = replace(
        SCENE,
        bodies=(floor, replace(box, materials=coated)),
        tracks=(even_track("box", box.T_world_body, (1.0, 0.5, 0.2), 1.0),),
    )
    camera = replace(EYES[0], shutter=shutter.Shutter(0.08, 0.2, 4))
    channels = CHANNELS | {Channel.NORMALS, Channel.RANGE, Channel.CATEGORY}
    renderer = WarpRenderer(LIBRARY, "cpu", settings.RenderSettings(visibility=visibility))
    drawn = []

    for byte in (0x3F, 0x00, 0xC1):
        with monkeypatch.context() as patched:
            patched.setattr(DeviceCache, "scratch", filling(DeviceCache.scratch, byte))
            patched.setattr(wp, "empty", filling(wp.empty, byte))
            drawn.append(renderer.render(replace(scene), camera, channels).channels)

    for other in drawn[1:]:
        for channel, image in drawn[0].items():
            assert image.tobytes() == other[channel].tobytes(), channel
