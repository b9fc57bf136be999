"""Budgets of transfers between host and device, counted as on a GPU; none is needed."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
import warp as wp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.bench_device_traffic import Frame, count_frames, counted_traffic, format_callers
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Camera
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.readback import Readback
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.kernels import records
from gen_data.renderers.warp.scene.scene_packing import pack_view
from gen_data.renderers.warp.scene.struct_dtypes import take_rows
from gen_data.renderers.warp.visibility.amodal import clipped_box_px
from gen_data.renderers.warp.visibility.gbuffer import CORNERS
from gen_data.renderers.warp.visibility.kernels.amodal import pack_bits
from gen_data.renderers.warp.visibility.kernels.rasterizer import Z_NEAR_M
from tests.renderers.fake_library import FakeLibrary
from tests.tiers import cases

DOWN = 64_000
"""Bytes of a frame that may leave the device beyond the channels that were asked for."""
UP_VIEW = 256_000
"""Bytes that a further view of a scene may bring."""
UP_STEP = 640_000
"""Bytes that the next step may bring: poses, and records of people whose shape has changed."""
WAITS_CAMERA, WAITS_SCAN = 8, 2

CPU = open_device("cpu")


@cache
def frames_of(config: str, samples: int, *overrides: str) -> list[Frame]:
    """Frames of the first samples, counted once for all tests."""
    return count_frames(config, samples, *overrides)


def tabletop() -> list[Frame]:
    return frames_of("tabletop.yaml", 2, "views_per_scene=2")


def street() -> list[Frame]:
    return frames_of("street.yaml", 2, "views_per_scene=2")


def rig() -> list[Frame]:
    """Two steps of a sequence, each of two cameras, a scanner and an antenna."""
    return frames_of("kitti_rig.yaml", 2)


def plates() -> list[Frame]:
    return frames_of("photo_plates.yaml", 2)


CASES = pytest.mark.parametrize("frames", cases((tabletop, street, rig), {tabletop}))
Frames = Callable[[], list[Frame]]


@pytest.mark.parametrize("frames", cases((tabletop, plates, street, rig), {tabletop}))
def test_little_but_what_was_asked_for_leaves_the_device(frames: Frames) -> None:
    """In first and further views, of cameras and scanners."""
    for frame in frames():
        assert frame.down < DOWN, f"{frame.name}\n{format_callers(frame.traffic)}"


@CASES
def test_further_views_bring_their_poses_only(frames: Frames) -> None:
    """Assets are there, and rays that stay the same too."""
    first, *others = frames()
    assert first.assets > 1_000_000
    for frame in others:
        is_view = frame.name.startswith(("tabletop 1", "street 1")) or "image_03" in frame.name
        is_step = frame.name.startswith("kitti_rig 1")
        if is_view or is_step:
            most = UP_VIEW if is_view else UP_STEP
            assert frame.up < most, f"{frame.name}\n{format_callers(frame.traffic)}"


@CASES
def test_the_host_seldom_waits(frames: Frames) -> None:
    """In an image for open sky, lamps, pixels to shade, edges and results; in a scan twice."""
    # Labels that were drawn for another sensor are there: no wait at all.
    assert frames()[0].waits >= 1
    for frame in frames():
        camera = frame.name.endswith(("color", "image_02", "image_03"))
        most = WAITS_CAMERA if camera else WAITS_SCAN
        assert frame.waits <= most, f"{frame.name}\n{format_callers(frame.traffic)}"


def test_transfers_are_counted_in_bytes_and_reads() -> None:
    """1,000 floats and a grid of every tenth of them; nothing for memory that stays there."""
    with counted_traffic() as traffic:
        values = wp.array(np.zeros(1000, np.float32), dtype=float, device="cpu")
        values.reshape((10, 100))[:, ::10].numpy()
        wp.zeros(5000, dtype=float, device="cpu")
        wp.copy(wp.empty_like(values), values)
        values.assign(np.ones(1000, np.float32))

    assert traffic.up.total() == 2 * 4000
    assert traffic.down.total() == 400
    assert traffic.waits.total() == 1
    assert set(traffic.up) == {"elsewhere"}


def test_results_are_read_as_they_were_written() -> None:
    """Five elements of each type, written through the parts of one memory."""
    rng = np.random.default_rng(3)
    written = [
        rng.integers(0, 65536, 5).astype(np.uint16), rng.standard_normal((5, 3)).astype(np.float32),
        rng.integers(-9, 9, (5, 2)).astype(np.int32), rng.standard_normal(5).astype(np.float32),
    ]  # fmt: skip
    together = Readback.allocate(5, (wp.uint16, wp.vec3, wp.vec2i, float), CPU)
    for part, values in zip(together.parts, written, strict=True):
        part.assign(values)
    with counted_traffic() as traffic:
        read = together.numpy()

    assert traffic.waits.total() == 1
    for values, expected in zip(read, written, strict=True):
        assert values.dtype == expected.dtype
        np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize("rows", [[], [0], [1, 3], [0, 1, 2, 3]])
def test_rows_are_taken_as_by_numpy(rows: list[int]) -> None:
    """Of four rows of five; nothing crosses."""
    values = np.arange(20, dtype=np.float32).reshape(4, 5)
    held = wp.array(values, dtype=float, device="cpu")
    with counted_traffic() as traffic:
        taken = take_rows(held, np.array(rows, np.int64))

    assert not traffic.up
    assert not traffic.down
    assert taken.shape == (len(rows), 5)
    np.testing.assert_array_equal(taken.numpy().reshape(-1, 5), values[rows])


@settings(deadline=None, derandomize=True)
@given(st.lists(st.booleans(), min_size=8, max_size=800))
def test_bits_are_packed_as_by_numpy(pixels: list[bool]) -> None:
    """Whole words of eight pixels."""
    mask = np.array(pixels[: len(pixels) // 8 * 8], np.uint8)
    words = wp.array(mask.view(np.uint64), dtype=wp.uint64, device="cpu")
    bits = wp.empty(len(words), dtype=wp.uint8, device="cpu")
    wp.launch(pack_bits, len(words), [words], [bits], device="cpu")

    np.testing.assert_array_equal(bits.numpy(), np.packbits(mask, bitorder="little"))


def test_values_cross_again_only_if_they_change() -> None:
    """With separate memory, a device keeps the last two values of each name."""
    cache_ = DeviceCache(FakeLibrary({}), CPU)
    cache_.shares_memory = False
    one, two = np.arange(6, dtype=np.float32), np.ones(6, np.float32)
    with counted_traffic() as traffic:
        first = cache_.latest("numbers", one, float)
        again = cache_.latest("numbers", one.copy(), float)
        other = cache_.latest("numbers", two, float)
        back = cache_.latest("numbers", one, float)

    assert again is first
    assert back is first
    assert other is not first
    assert traffic.up.total() == 2 * one.nbytes


LENS = Intrinsics(64, 48, 50.0, 50.0, 32.0, 24.0)


@cache
def view_of_lens() -> records.View:
    """A camera at the origin that looks along z."""
    return pack_view(Camera("c", SE3((0.0, 0.0, 0.0)), LENS), DeviceCache(FakeLibrary({}), CPU))


lengths = st.floats(0.05, 8.0)
places = st.floats(-6.0, 6.0)


@settings(deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.tuples(places, places, st.floats(-6.0, -0.01)),
    st.tuples(lengths, lengths, st.floats(0.1, 8.0)),
)
def test_what_lies_before_the_camera_is_in_the_box_of_its_pixels(
    low: tuple[float, float, float], size: tuple[float, float, float]
) -> None:
    """Of a grid of points in a box, those before the plane of clipping project into it."""
    box = clipped_box_px((np.array(low) + CORNERS * np.array(size)).T, view_of_lens())
    shares = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 9)] * 3), axis=-1).reshape(-1, 3)
    points = np.array(low) + shares * np.array(size)
    image = LENS.project(points[points[:, 2] >= Z_NEAR_M])

    assert (image >= (box.x_min, box.y_min)).all()
    assert (image <= (box.x_max, box.y_max)).all()
