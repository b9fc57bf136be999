"""Motion blur and rolling shutter, against the closed forms of uniform motion."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gen_data.core.capture import Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import PINHOLE, Lens
from gen_data.core.rolling_shutter_projection import project_rolling_shutter, world_points
from gen_data.core.scene import Body, Scene
from gen_data.core.se3 import SE3
from gen_data.core.shutter import INSTANT, Shutter
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.shutter_integration import integrate_light, split_slices
from gen_data.renderers.warp.visibility.frame_context import CameraState, render_view
from gen_data.renderers.warp.visibility.reprojection import make_bands, render_bands
from tests.renderers.moving import FACING, LENS, MESHES, even_track, world

LABELS = frozenset({
    Channel.INSTANCE, Channel.CATEGORY, Channel.Z_DEPTH, Channel.RANGE, Channel.NORMALS,
    Channel.OBJECT_COORDINATES,
})  # fmt: skip
ALL = LABELS | {Channel.RADIANCE, Channel.AMODAL}
# Its face is 2.5 m away and 80 / 2.5 = 32 px wide and high.
LAMP = Body("lamp", "lamp", SE3((0.0, 0.0, 3.0)), instance_id=1)
PX_PER_M = 80.0 / 2.5


@pytest.fixture(scope="module")
def renderer() -> WarpRenderer:
    return WarpRenderer(MESHES, "cpu")


def passing(speed_px_s: float, shutter: Shutter, time_s: float = 0.0) -> Scene:
    """A glowing box whose face crosses the image."""
    track = even_track("lamp", LAMP.T_world_body, (speed_px_s / PX_PER_M, 0.0, 0.0))
    return world(LAMP, tracks=(track,), shutter=shutter, time_s=time_s)


def shot(renderer: WarpRenderer, scene: Scene) -> SensorReading:
    return renderer.render(scene, scene.cameras[0], ALL)


def without_shutter(scene: Scene) -> Scene:
    return replace(scene, cameras=(replace(scene.cameras[0], shutter=INSTANT),))


def test_a_streak_is_as_long_as_the_way_and_holds_the_same_light(renderer: WarpRenderer) -> None:
    """The box moves 16 px while exposed: 32 px grow to 48, and no light is lost."""
    scene = passing(400.0, Shutter(exposure_s=0.04, samples=64))
    blurred = shot(renderer, scene).channels[Channel.RADIANCE][32, :, 1].astype(np.float64)
    sharp = shot(renderer, without_shutter(scene)).channels[Channel.RADIANCE]
    sharp = sharp[32, :, 1].astype(np.float64)

    assert np.count_nonzero(sharp > 1.0) == 32
    assert np.count_nonzero(blurred > 1.0) == pytest.approx(48, abs=1)
    assert blurred.sum() == pytest.approx(sharp.sum(), rel=5e-3)
    # A box that passes evenly leaves a ramp: half as bright at the middle of its edge.
    assert blurred[32] / sharp.max() == pytest.approx(0.5, abs=0.05)


def test_a_streak_along_columns_is_as_long_as_the_way(renderer: WarpRenderer) -> None:
    """Twenty rows up and down, although the middle of the exposure shows nothing there."""
    track = even_track("lamp", LAMP.T_world_body, (0.0, 1000.0 / PX_PER_M, 0.0))
    scene = world(LAMP, tracks=(track,), shutter=Shutter(exposure_s=0.04, samples=80), time_s=0.0)
    blurred = shot(renderer, scene).channels[Channel.RADIANCE][:, 48, 1].astype(np.float64)

    # From 16 to 48 at first: the streak leaves the image on both sides.
    assert (blurred[:60] > 1.0).all()
    assert blurred[32] / 100.0 == pytest.approx(32.0 / 40.0, abs=0.03)
    assert blurred[4] / 100.0 == pytest.approx(8.5 / 40.0, abs=0.03)


def test_labels_of_a_long_exposure_are_those_of_its_middle(renderer: WarpRenderer) -> None:
    """Every label image and silhouette shows an instant."""
    scene = passing(300.0, Shutter(exposure_s=0.05))
    long, instant = shot(renderer, scene), shot(renderer, without_shutter(scene))

    for channel in LABELS:
        assert np.array_equal(long.channels[channel], instant.channels[channel]), channel
    assert np.array_equal(long.silhouettes[1].mask, instant.silhouettes[1].mask)
    assert long.time_s == instant.time_s
    assert not np.array_equal(long.channels[Channel.RADIANCE], instant.channels[Channel.RADIANCE])


@pytest.mark.parametrize(
    "shutter", [Shutter(0.05), Shutter(0.0, 0.05), Shutter(0.02, -0.05, samples=3)]
)
def test_what_does_not_move_is_the_same_bytes_behind_any_shutter(
    renderer: WarpRenderer, shutter: Shutter
) -> None:
    """Nothing moves; or too little to be visible."""
    for scene in (world(LAMP, shutter=shutter), passing(0.5, shutter)):
        one, other = shot(renderer, scene), shot(renderer, without_shutter(scene))
        for channel, image in other.channels.items():
            assert np.array_equal(one.channels[channel], image), channel


@settings(deadline=None, max_examples=50)
@given(exposure_s=st.floats(1e-4, 0.1), readout_s=st.floats(-0.1, 0.1), samples=st.integers(1, 16))
def test_slices_of_time_hold_every_row_once_around_its_instant(
    exposure_s: float, readout_s: float, samples: int
) -> None:
    """Shares of a row sum to 1, and the mean of their instants is the row's within a slice."""
    lens = Intrinsics(8, 12, 10.0, 10.0, 4.0, 6.0)
    # Slices of a short exposure of many rows would be thousands.
    readout_s = max(min(readout_s, 10 * exposure_s), -10 * exposure_s)
    scene = world(lens=lens, shutter=Shutter(exposure_s, readout_s, samples))
    slices = split_slices(CameraState.of(scene, scene.cameras[0]), samples)
    shares, instants = np.zeros(12), np.zeros(12)
    for part in slices:
        rows = slice(part.band.first, part.band.end)
        shares[rows] += part.weights
        instants[rows] += part.weights * (part.band.state.scene.time_s - scene.time_s)

    np.testing.assert_allclose(shares, 1.0, atol=1e-5)
    delays = scene.cameras[0].shutter.row_delays_s(12)
    assert np.abs(instants - delays).max() <= 0.5 * exposure_s / samples + 1e-6


@pytest.mark.parametrize("readout_s", [0.0, 0.03])
def test_rows_in_which_nothing_moves_are_rendered_once(readout_s: float) -> None:
    """In the slice nearest to their instant; blurred rows in every slice of their exposure."""
    scene = world(shutter=Shutter(0.01, readout_s, samples=4))
    state = CameraState.of(scene, scene.cameras[0])
    blurred = np.arange(LENS.height_px) >= 40
    slices = split_slices(state, 4, blurred)
    shares, times = np.zeros(LENS.height_px), np.zeros(LENS.height_px, int)
    delays = scene.cameras[0].shutter.row_delays_s(LENS.height_px)
    for part in slices:
        rows = slice(part.band.first, part.band.end)
        shares[rows] += part.weights
        times[rows] += part.weights > 0.0
        offset_s = part.band.state.scene.time_s - scene.time_s
        once = np.flatnonzero(part.weights == 1.0) + part.band.first
        assert (np.abs(offset_s - delays[once]) <= 0.5 * 0.0025 + 1e-9).all()

    np.testing.assert_allclose(shares, 1.0, atol=1e-6)
    assert (times[:40] == 1).all()
    assert (times[40:] >= 4).all()
    assert sum(part.band.first < 40 for part in slices) < len(slices)


@pytest.mark.parametrize("readout_s", [0.06, -0.06])
@pytest.mark.parametrize("exposure_s", [0.0, 0.004])
def test_an_edge_that_passes_leans_by_its_speed_times_the_time_between_rows(
    renderer: WarpRenderer, readout_s: float, exposure_s: float
) -> None:
    """In masks and in radiance alike, row by row, in both directions of readout."""
    scene = passing(250.0, Shutter(exposure_s, readout_s, samples=16))
    seen = shot(renderer, scene)
    delays = scene.cameras[0].shutter.row_delays_s(LENS.height_px)
    bright = seen.channels[Channel.RADIANCE][..., 1] > 50.0
    rows = np.flatnonzero((seen.channels[Channel.INSTANCE] == 1).any(axis=1))

    assert len(rows) == 32
    for row in rows:
        expected = 32.0 + 250.0 * delays[row]
        mask = np.flatnonzero(seen.channels[Channel.INSTANCE][row] == 1)
        assert mask[0] == pytest.approx(expected, abs=0.5 + 0.13)
        assert mask[-1] + 1 == pytest.approx(expected + 32.0, abs=0.5 + 0.13)
        lit = np.flatnonzero(bright[row])
        assert (lit[0], lit[-1]) == (pytest.approx(mask[0], abs=1), pytest.approx(mask[-1], abs=1))


def test_depth_of_what_approaches_is_that_of_each_row(renderer: WarpRenderer) -> None:
    """A wall at 6 m that approaches at 10 m/s, read out within 80 ms."""
    wall = Body("wall", "wall", replace(FACING, translation_m=(0.0, 0.0, 6.0)))
    track = even_track("wall", wall.T_world_body, (0.0, 0.0, -10.0))
    shutter = Shutter(0.0, 0.08)
    scene = world(wall, tracks=(track,), shutter=shutter, time_s=0.0)
    # A corner moves by 57.7 px / 6 m * 10 m/s, hence a band lasts about 2.6 ms.
    z_m = shot(renderer, scene).channels[Channel.Z_DEPTH]

    expected = 6.0 - 10.0 * shutter.row_delays_s(LENS.height_px)
    assert np.ptp(expected) > 0.7
    np.testing.assert_allclose(z_m, np.broadcast_to(expected[:, None], z_m.shape), atol=0.02)


def test_silhouettes_roll_with_their_rows(renderer: WarpRenderer) -> None:
    """An unoccluded box: its silhouette equals its visible pixels and extends beyond the image."""
    seen = shot(renderer, passing(400.0, Shutter(0.0, 0.06)))
    mask = seen.channels[Channel.INSTANCE] == 1
    outline = seen.silhouettes[1]
    canvas = np.zeros_like(mask)
    rows = slice(outline.y_px, outline.y_px + outline.mask.shape[0])
    canvas[rows, outline.x_px : outline.x_px + outline.mask.shape[1]] = outline.mask

    assert not (mask & ~canvas).any()
    # A dozen instants for 24 px of lean: a row's edges are within a pixel.
    assert np.count_nonzero(canvas != mask) <= 2 * 32
    beside = shot(renderer, passing(400.0, Shutter(0.0, 0.06), time_s=0.1))
    assert beside.silhouettes[1].mask.sum() > (beside.channels[Channel.INSTANCE] == 1).sum() + 200


@pytest.mark.slow
@pytest.mark.parametrize(
    "lens", [PINHOLE, Lens("kannala_brandt", (-0.02, 0.01, -0.004, 0.0005), 1.4)]
)
def test_bands_of_a_still_world_make_the_whole_image(renderer: WarpRenderer, lens: Lens) -> None:
    """Bit-identical labels; radiance differs by at most the last bit of its sums."""
    wall = Body("wall", "wall", replace(FACING, translation_m=(0.0, 0.0, 6.0)))
    scene = world(
        wall, replace(LAMP, scale=0.7), shutter=Shutter(0.0, 0.05), time_s=0.0,
        lens=replace(LENS, lens=lens),
    )  # fmt: skip
    near = render_view(CameraState.of(scene, scene.cameras[0]), renderer._context)
    whole_bands = make_bands(near.state, [0])
    rows = make_bands(near.state, list(range(0, LENS.height_px, 5)))

    whole = render_bands(whole_bands, LABELS, near, integrate_light)
    banded = render_bands(rows, LABELS, near, integrate_light)
    for channel in LABELS:
        assert np.array_equal(whole.images[channel], banded.images[channel]), channel
    assert np.array_equal(whole.gbuffer.hits, banded.gbuffer.hits)
    assert whole.radiance is not None
    assert banded.radiance is not None
    np.testing.assert_allclose(whole.radiance.numpy(), banded.radiance.numpy(), rtol=1e-5)


def test_points_are_projected_where_their_rows_show_them(renderer: WarpRenderer) -> None:
    """Corners of the box's face, also with a moving camera: at the corners of the mask."""
    shutter = Shutter(0.0, 0.06)
    track = even_track("lamp", LAMP.T_world_body, (6.0, 1.0, 0.0))
    scene = world(
        LAMP, tracks=(track,), shutter=shutter, time_s=0.0, camera_velocity_m_s=(-3.0, 0.0, 0.0)
    )
    mask = shot(renderer, scene).channels[Channel.INSTANCE] == 1
    corners = np.array([[x, y, -0.5] for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
    _, image_px = project_rolling_shutter(scene, scene.cameras[0], corners, scene.instances[0])

    rows = np.flatnonzero(mask.any(axis=1))
    top, bottom = np.flatnonzero(mask[rows[0]]), np.flatnonzero(mask[rows[-1]])
    measured = [
        [top[0], rows[0]], [top[-1] + 1, rows[0]],
        [bottom[0], rows[-1] + 1], [bottom[-1] + 1, rows[-1] + 1],
    ]  # fmt: skip
    assert abs(image_px[0, 0] - image_px[2, 0]) > 5.0
    np.testing.assert_allclose(image_px, measured, atol=0.9)


def test_a_point_that_sinks_is_met_by_the_row_that_reads_it() -> None:
    """The solution of v = v0 + c (v / h - 1/2) readout, to a thousandth of a pixel."""
    track = even_track("lamp", SE3((0.0, -0.3, 3.0)), (0.0, 2.0, 0.0))
    scene = world(LAMP, tracks=(track,), shutter=Shutter(0.0, 0.08), time_s=0.0)
    _, image_px = project_rolling_shutter(
        scene, scene.cameras[0], np.zeros((1, 3)), scene.instances[0]
    )

    still, speed = 32.0 - 80.0 * 0.3 / 3.0, 80.0 * 2.0 / 3.0
    expected = (still - 0.5 * speed * 0.08) / (1.0 - speed * 0.08 / LENS.height_px)
    assert image_px[0, 1] == pytest.approx(expected, abs=1e-3)


def test_a_camera_without_rolling_rows_projects_as_ever() -> None:
    scene = world(LAMP, shutter=Shutter(exposure_s=0.05), camera_velocity_m_s=(1.0, 0.0, 0.0))
    p_camera, image_px = project_rolling_shutter(
        scene, scene.cameras[0], np.array([[0.0, 0.0, 3.0]])
    )

    expected = scene.cameras[0].T_world_camera.inverse().apply(np.array([[0.0, 0.0, 3.0]]))
    np.testing.assert_allclose(p_camera, expected, atol=1e-6)
    np.testing.assert_allclose(image_px, LENS.project(expected), atol=1e-4)


def test_points_of_pixels_are_placed_by_their_rows(renderer: WarpRenderer) -> None:
    """A static wall and a camera that approaches and turns: all points lie on the wall."""
    wall = Body("wall", "wall", replace(FACING, translation_m=(0.0, 0.0, 6.0)))
    scene = world(
        wall, shutter=Shutter(0.0, 0.08), time_s=0.0,
        camera_velocity_m_s=(1.0, 0.0, 12.0), camera_turn_rad_s=0.5,
    )  # fmt: skip
    seen = shot(renderer, scene)
    rows, columns = (index.ravel() for index in np.indices(seen.channels[Channel.RANGE].shape))
    rays = LENS.pixel_rays()[rows, columns]
    p_camera = rays * seen.channels[Channel.RANGE][rows, columns, None].astype(np.float64)

    p_world = world_points(scene, scene.cameras[0], p_camera, rows)
    as_if_at_once = scene.cameras[0].T_world_camera.apply(p_camera)
    assert np.abs(as_if_at_once[:, 2] - 6.0).max() > 0.3
    assert np.abs(p_world[:, 2] - 6.0).max() < 0.02
