"""Images through lenses with distortion: positions against OpenCV, ranges against Embree."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
import warp as wp

from gen_data.core.capture import Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Body, Camera, Instance, Light, Scene, Weather
from gen_data.core.se3 import SE3, look_at
from gen_data.renderers.warp.atmosphere.precipitation import make_streaks, rain
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.kernels.distortion import project_to_pixel
from gen_data.renderers.warp.scene.kernels.records import View
from gen_data.renderers.warp.scene.scene_packing import pack_view
from gen_data.renderers.warp.visibility.amodal import bounding_cone
from tests import opencv
from tests.embree import RayCaster, placed
from tests.renderers.embree import near_edges
from tests.renderers.fake_library import DARK, FakeLibrary, box_mesh, room_mesh, sphere_mesh

BARREL = Lens(
    "brown_conrady", (-0.3691481, 0.1968681, 1.353473e-3, 5.677587e-4, -0.06770705, 0.0, 0.0, 0.0)
)
FISHEYE = Lens("kannala_brandt", (0.0034824, 0.00071503, -0.0020532, 0.00020294))
MESHES = {"room": room_mesh((8.0, 8.0, 4.0)), "box": box_mesh(), "ball": sphere_mesh(0.5, rings=96)}
LIBRARY = FakeLibrary(MESHES)
LABELS = frozenset(
    {Channel.Z_DEPTH, Channel.RANGE, Channel.INSTANCE, Channel.OBJECT_COORDINATES, Channel.AMODAL}
)
CAMERAS = {
    "barrel": Intrinsics(160, 120, 130.0, 131.0, 82.0, 58.0, BARREL),
    "fisheye": Intrinsics(160, 160, 45.0, 45.5, 78.0, 81.0, FISHEYE),
}


def ahead(intrinsics: Intrinsics) -> Camera:
    return Camera("camera", SE3(), intrinsics)


def scene_of(*bodies: Body) -> Scene:
    ids = sorted({body.instance_id for body in bodies} - {0})
    half = (0.5, 0.5, 0.5)
    instances = tuple(
        Instance(
            i, f"i{i}", "thing", 1, "box",
            T_world_instance=next(b.T_world_body for b in bodies if b.instance_id == i),
            box_min_m=(-0.5, -0.5, -0.5), box_max_m=half,
        )
        for i in ids
    )  # fmt: skip
    return Scene("test", bodies, instances, environment=DARK)


def rendered(scene: Scene, camera: Camera, channels: frozenset[Channel] = LABELS) -> SensorReading:
    return WarpRenderer(LIBRARY, "cpu").render(scene, camera, channels)


def pixel_centres(k: Intrinsics) -> np.ndarray:
    u, v = np.meshgrid(np.arange(k.width_px) + 0.5, np.arange(k.height_px) + 0.5)
    return np.stack([u, v], axis=-1).reshape(-1, 2)


def opencv_rays(k: Intrinsics) -> np.ndarray:
    """Unit directions through pixel centres, [h, w, 3]: OpenCV's inverse, made exact by its images.

    Its fisheye gives points of the plane before it: beyond a right angle they are mirrored.
    """
    places, coefficients = pixel_centres(k)[:, None], np.array(k.lens.coefficients)
    if k.lens.model == "kannala_brandt":
        plane = cv2.fisheye.undistortPoints(places, k.matrix(), coefficients)[:, 0]
    else:
        plane = cv2.undistortPoints(places, k.matrix(), coefficients)[:, 0]
        for _ in range(300):
            points = np.column_stack([plane, np.ones(len(plane))])
            plane -= (opencv.places(k, points) - places[:, 0]) / (k.fx_px, k.fy_px)
    rays = np.column_stack([plane, np.ones(len(plane))])
    rays /= np.sqrt((rays * rays).sum(axis=1))[:, None]
    return rays.reshape(k.height_px, k.width_px, 3)


def turned(seed: int) -> tuple[float, float, float, float]:
    w, x, y, z = np.random.default_rng(seed).normal(size=4)
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / norm, x / norm, y / norm, z / norm)


def test_a_lens_without_coefficients_is_a_pinhole() -> None:
    """The same labels except for rounding at edges, and the same colours."""
    pinhole = Intrinsics(160, 120, 130.0, 130.0, 80.0, 60.0)
    bodies = [Body("room", "room", SE3((0.0, 0.0, 2.0)))]
    bodies += [
        Body(f"b{k}", ("box", "ball")[k % 2], SE3((k - 1.5, 0.3 * k, 3.0), turned(k)), 0.6, k + 1)
        for k in range(4)
    ]
    lamp = Light("lamp", "sphere", (0.0, -1.0, 1.0), intensity_cd=500.0)
    scene = replace(scene_of(*bodies), lights=(lamp,))
    channels = LABELS | {Channel.RADIANCE}

    plain = rendered(scene, ahead(pinhole), channels)
    bent = rendered(
        scene, ahead(replace(pinhole, lens=Lens("brown_conrady", (0.0,) * 8))), channels
    )

    for channel in (Channel.Z_DEPTH, Channel.RANGE):
        apart = np.abs(plain.channels[channel] - bent.channels[channel])
        assert (apart < 1e-4).mean() > 0.999
    same = plain.channels[Channel.INSTANCE] == bent.channels[Channel.INSTANCE]
    assert same.mean() > 0.999
    colors = [r.channels[Channel.RADIANCE] for r in (plain, bent)]
    assert np.abs(colors[0] - colors[1]).max(axis=-1)[same].mean() < 2e-3 * colors[0].mean()
    for instance_id, silhouette in plain.silhouettes.items():
        area, other = silhouette.mask.sum(), bent.silhouettes[instance_id].mask.sum()
        assert abs(int(area) - int(other)) <= 0.01 * area


def test_a_pinhole_has_no_table_of_directions() -> None:
    """No memory is spent on lenses without distortion."""
    cache = DeviceCache(LIBRARY, open_device("cpu"))

    view = pack_view(ahead(Intrinsics(8, 6, 5.0, 5.0, 4.0, 3.0)), cache)

    assert view.lens == 0
    assert not view.directions


@pytest.mark.slow
@pytest.mark.parametrize("name", CAMERAS)
def test_ranges_are_embrees_along_opencvs_directions(name: str) -> None:
    """Boxes and balls before and next to the camera: 0.1 mm and equal ids on 99.9 % of pixels."""
    spots = np.random.default_rng(8).uniform((-2.0, -2.0, 0.8), (2.0, 2.0, 3.0), (24, 3))
    bodies = [Body("room", "room", SE3((0.0, 0.0, -0.5)))]
    bodies += [
        Body(f"b{k}", ("box", "ball")[k % 2], SE3(tuple(spot), turned(k)), 0.5, k + 1)
        for k, spot in enumerate(spots.tolist())
    ]
    k = CAMERAS[name]
    rays = opencv_rays(k)
    trusted = np.abs(opencv.places(k, rays) - pixel_centres(k)).max(axis=1) < 1e-3
    trusted = trusted.reshape(k.height_px, k.width_px)
    library = FakeLibrary(MESHES)
    hits = RayCaster(*(placed(body, library) for body in bodies)).cast((0.0, 0.0, 0.0), rays)
    expected_m, numbers = hits.distance, hits.mesh

    channels = rendered(scene_of(*bodies), ahead(k)).channels

    # Bodies were added in order: the room is number 0, and so is its instance id.
    assert trusted.mean() > 0.5
    close = np.abs(channels[Channel.RANGE] - expected_m) < 1e-4
    ids = channels[Channel.INSTANCE]
    assert close[trusted].mean() >= 0.999
    assert (ids == numbers)[trusted].mean() >= 0.999
    inside = ~near_edges(numbers.astype(np.uint16), expected_m) & trusted
    assert np.array_equal(ids[inside], numbers[inside])
    np.testing.assert_allclose(
        channels[Channel.Z_DEPTH][inside], (expected_m * rays[..., 2])[inside], atol=2e-4
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", CAMERAS)
def test_a_ball_covers_the_pixels_whose_rays_meet_it(name: str) -> None:
    """In closed form: rays within asin(r / d) of the centre's direction agree except at the rim."""
    k = CAMERAS[name]
    centre = np.array([0.5, -0.3, 1.6])
    ball = Body("ball", "ball", SE3(tuple(centre)), instance_id=1)

    mask = rendered(scene_of(ball), ahead(k)).channels[Channel.INSTANCE] == 1

    distance_m = float(np.linalg.norm(centre))
    away = np.arccos(np.clip(opencv_rays(k) @ (centre / distance_m), -1.0, 1.0))
    expected = (away <= math.asin(0.5 / distance_m)).astype(np.uint8)
    core, cover = (f(expected, np.ones((3, 3))) > 0 for f in (cv2.erode, cv2.dilate))
    assert expected.sum() > 500
    assert (mask <= cover).all()
    assert (core <= mask).all()


@pytest.mark.parametrize("name", CAMERAS)
def test_the_mask_of_a_box_ends_where_opencv_puts_its_edges(name: str) -> None:
    """The tight box of the mask, against densely sampled edges: within a pixel on every side."""
    k = CAMERAS[name]
    body = Body("box", "box", SE3((-0.4, 0.2, 2.0), turned(3)), 0.8, instance_id=1)
    t = np.linspace(-0.4, 0.4, 200)
    ends = [(a, b) for a in (-0.4, 0.4) for b in (-0.4, 0.4)]
    lines = [
        np.insert(np.broadcast_to(np.array(pair), (200, 2)), axis, t, axis=1)
        for axis in range(3)
        for pair in ends
    ]
    places = opencv.places(k, body.T_world_body.apply(np.concatenate(lines)))

    rows, columns = np.nonzero(rendered(scene_of(body), ahead(k)).channels[Channel.INSTANCE])

    found = [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
    expected = [*places.min(axis=0), *places.max(axis=0)]
    assert min(expected) > 0.0
    np.testing.assert_allclose(found, expected, atol=1.0)


@pytest.mark.parametrize("name", CAMERAS)
def test_object_coordinates_are_seen_where_opencv_projects_them(name: str) -> None:
    """At the pixel's centre, to a twentieth of a pixel."""
    k = CAMERAS[name]
    pose = SE3((0.2, 0.1, 1.5), turned(5))
    body = Body("box", "box", pose, instance_id=1)

    channels = rendered(scene_of(body), ahead(k)).channels

    seen = channels[Channel.INSTANCE].ravel() == 1
    coordinates = channels[Channel.OBJECT_COORDINATES].reshape(-1, 3)[seen].astype(np.float64)
    places = opencv.places(k, pose.apply(coordinates - 0.5))
    assert seen.sum() > 1000
    np.testing.assert_allclose(places, pixel_centres(k)[seen], atol=0.05)


def test_silhouettes_go_on_as_on_a_larger_sensor() -> None:
    """One image of three by three: the same outline, except for half a pixel outside the image."""
    gentle = Lens("brown_conrady", (-0.28340811, 0.07395907, 1.9359e-4, 1.76e-5, *[0.0] * 4))
    k = replace(CAMERAS["barrel"], lens=gentle)
    w, h = k.width_px, k.height_px
    larger = replace(k, width_px=3 * w, height_px=3 * h, cx_px=k.cx_px + w, cy_px=k.cy_px + h)
    body = Body("box", "box", SE3((-1.5, 0.2, 2.2), turned(2)), instance_id=1)

    silhouette = rendered(scene_of(body), ahead(k)).silhouettes[1]
    whole = rendered(scene_of(body), ahead(larger)).channels[Channel.INSTANCE] == 1

    rows, columns = silhouette.mask.shape
    canvas = np.zeros((3 * h, 3 * w), bool)
    top, left = silhouette.y_px + h, silhouette.x_px + w
    canvas[top : top + rows, left : left + columns] = silhouette.mask
    assert silhouette.x_px < 0
    assert np.array_equal(canvas[h : 2 * h, w : 2 * w], whole[h : 2 * h, w : 2 * w])
    assert (canvas != whole).sum() <= 0.01 * whole.sum()


def test_what_hides_does_not_change_a_silhouette() -> None:
    """An occluded ball has the outline that it has alone."""
    camera = ahead(CAMERAS["fisheye"])
    far = Body("far", "ball", SE3((0.4, 0.2, 3.0)), instance_id=2)
    near = Body("near", "box", SE3((0.2, 0.1, 1.2)), instance_id=1)

    alone = rendered(scene_of(far), camera)
    hidden = rendered(scene_of(near, far), camera)

    assert not (hidden.channels[Channel.INSTANCE] == 2).any()
    silhouette = hidden.silhouettes[2]
    assert np.array_equal(silhouette.mask, alone.silhouettes[2].mask)
    assert silhouette.mask.sum() == (alone.channels[Channel.INSTANCE] == 2).sum()


def test_a_cone_around_a_box_holds_all_of_it() -> None:
    """Points of boxes near and far, thin and thick; the whole sphere from inside."""
    rng = np.random.default_rng(6)
    halves = []
    for _ in range(300):
        low = rng.normal(size=3) * 2.0
        ends = np.stack([low, low + rng.uniform(0.05, 4.0, 3)])
        axis, half_rad = bounding_cone(ends)
        points = ends[0] + rng.random((500, 3)) * (ends[1] - ends[0])
        cosines = points @ axis / np.linalg.norm(points, axis=1)
        assert half_rad == math.pi or (np.arccos(np.clip(cosines, -1, 1)) <= half_rad + 1e-6).all()
        halves.append(half_rad)
    assert 0.2 < np.mean(np.array(halves) < 1.0) < 0.95


def test_a_panorama_sees_all_around() -> None:
    """A room from inside: every pixel hits a surface, and the rear appears at both ends."""
    k = Intrinsics.from_hfov(128, 64, 2.0 * math.pi, Lens("equirectangular"))
    room = Body("room", "room", SE3((0.0, 0.0, -2.0)))
    ball = Body("ball", "ball", SE3((0.0, 0.0, -1.5)), instance_id=1)

    reading = rendered(scene_of(room, ball), ahead(k))

    ids, ranges_m = reading.channels[Channel.INSTANCE], reading.channels[Channel.RANGE]
    assert np.isfinite(ranges_m).all()
    assert ids[32, 0] == ids[32, 127] == 1
    assert ids[32, 64] == 0
    assert ranges_m[32, 0] == pytest.approx(1.0, abs=0.01)
    # Depth along the axis is for what lies ahead.
    assert np.isinf(reading.channels[Channel.Z_DEPTH][:, :32]).all()
    assert np.isfinite(reading.channels[Channel.Z_DEPTH][:, 33:95]).all()
    # All there is of it is in the image.
    assert reading.silhouettes[1].mask.sum() == (ids == 1).sum()


def test_panoramas_have_no_seam() -> None:
    """Columns at both ends are as alike as neighbours elsewhere."""
    k = Intrinsics.from_hfov(256, 128, 2.0 * math.pi, Lens("equirectangular"))
    lamp = Light("lamp", "sphere", (0.5, 0.3, 1.0), intensity_cd=300.0)
    scene = replace(scene_of(Body("room", "room", SE3((0.0, 0.0, -2.0)))), lights=(lamp,))
    camera = Camera("camera", look_at((0.3, 0.2, 0.0), (3.0, 1.0, 0.2)), k)

    reading = rendered(scene, camera, frozenset({Channel.RADIANCE}))

    image = reading.channels[Channel.RADIANCE].astype(float)

    steps = np.abs(image - np.roll(image, 1, axis=1)).mean(axis=(0, 2))
    assert image.mean() > 5.0
    assert steps[0] < 2.0 * np.median(steps[1:]) + 0.01 * image.mean()


def test_a_frame_does_not_depend_on_the_lenses_before_it() -> None:
    """The first and the third of three are the same, byte by byte."""
    renderer = WarpRenderer(LIBRARY, "cpu")
    box = Body("box", "box", SE3((0.3, 0.2, 2.0), turned(1)), instance_id=1)
    lamp = Light("lamp", "sphere", (0.0, 0.0, 0.0), intensity_cd=300.0)
    scene = replace(scene_of(Body("room", "room", SE3((0.0, 0.0, -2.0))), box), lights=(lamp,))
    names = ("barrel", "fisheye", "barrel")

    first, _, third = (
        renderer.render(scene, ahead(CAMERAS[name]), LABELS | {Channel.RADIANCE}) for name in names
    )

    for channel, image in first.channels.items():
        assert np.array_equal(image, third.channels[channel])
    assert np.array_equal(first.silhouettes[1].mask, third.silhouettes[1].mask)


def test_dark_corners_see_nothing() -> None:
    """Outside a fisheye's field: black, no depth, no ids, no environment."""
    k = Intrinsics(96, 96, 40.0, 40.0, 48.0, 48.0, replace(FISHEYE, half_field_rad=1.0))
    room = Body("room", "room", SE3((0.0, 0.0, -2.0)), instance_id=1)
    lamp = Light("lamp", "sphere", (0.0, 0.0, 1.0), intensity_cd=300.0)
    scene = replace(scene_of(room), lights=(lamp,))

    reading = WarpRenderer(LIBRARY, "cpu").render(scene, ahead(k), LABELS | {Channel.RADIANCE})

    dark = np.isnan(k.pixel_rays()[..., 0])
    assert 0.2 < dark.mean() < 0.6
    assert not reading.channels[Channel.RADIANCE][dark].any()
    assert np.isinf(reading.channels[Channel.RANGE][dark]).all()
    assert not reading.channels[Channel.INSTANCE][dark].any()
    assert (reading.channels[Channel.INSTANCE][~dark] == 1).all()
    assert (reading.channels[Channel.RADIANCE][~dark] > 0).all()


def test_edges_are_smooth() -> None:
    """Pixels on the rim of a bright ball take colours between it and the dark."""
    ball = Body("ball", "ball", SE3((0.3, 0.2, 2.0)), instance_id=1)
    lamp = Light("lamp", "sphere", (0.0, 0.0, -2.0), intensity_cd=3000.0)
    scene = replace(scene_of(ball), lights=(lamp,))
    grey = rendered(scene, ahead(CAMERAS["barrel"]), LABELS | {Channel.RADIANCE})

    level = grey.channels[Channel.RADIANCE][..., 0].astype(float)
    mask = (grey.channels[Channel.INSTANCE] == 1).astype(np.uint8)
    rim = (cv2.dilate(mask, np.ones((3, 3))) > 0) & (cv2.erode(mask, np.ones((3, 3))) == 0)
    inner = np.median(level[cv2.erode(mask, np.ones((5, 5))) > 0])
    between = (level[rim] > 0.15 * inner) & (level[rim] < 0.75 * inner)
    assert inner > 10.0
    assert between.mean() > 0.25


def test_rain_before_a_lens_is_as_dense_as_before_a_pinhole() -> None:
    """Without coefficients, in the volume that both fill: equal numbers, lengths and opacities."""
    pinhole = Intrinsics(96, 64, 80.0, 80.0, 48.0, 32.0)
    found = []
    for lens in (Lens(), Lens("brown_conrady", (0.0,) * 8)):
        camera = ahead(replace(pinhole, lens=lens))
        views = [make_streaks(rain(2.0), camera, Weather(seed=k), 0.01, "rain") for k in range(9)]
        all_ = np.concatenate(views)
        away_m = np.linalg.norm(all_["p_m"], axis=1)
        found.append(all_[(away_m < 6.0) & (all_["p_m"][:, 2] > 0.5)])

    plain, bent = found
    assert len(plain) > 2000
    assert abs(len(plain) - len(bent)) < 5.0 * math.sqrt(len(plain) + len(bent))
    lengths = [np.linalg.norm(s["end_px"] - s["start_px"], axis=1).mean() for s in found]
    assert lengths[1] == pytest.approx(lengths[0], rel=0.1)
    for field in ("radius_px", "opacity"):
        assert bent[field].mean() == pytest.approx(plain[field].mean(), rel=0.1)


def test_rain_falls_all_around_a_panorama() -> None:
    """Streaks in every quarter of the image, none across the seam."""
    k = Intrinsics.from_hfov(256, 128, 2.0 * math.pi, Lens("equirectangular"))

    streaks = make_streaks(rain(20.0), ahead(k), Weather(seed=3), 0.01, "rain")

    quarters = np.bincount((streaks["start_px"][:, 0] // 64).astype(int).clip(0, 3), minlength=4)
    assert quarters.min() > 0.8 * quarters.mean()
    assert np.abs(streaks["end_px"] - streaks["start_px"]).max() < 128.0


@wp.kernel
def look_up(view: View, points: wp.array(dtype=wp.vec3), pixels: wp.array(dtype=int)):  # noqa: ANN201
    """Pixel indices that the kernels assign to points."""
    i = wp.tid()
    j, _depth = project_to_pixel(view, points[i])
    pixels[i] = j


@pytest.mark.parametrize(
    "k", [*CAMERAS.values(), Intrinsics.from_hfov(64, 32, 6.2831853, Lens("equirectangular"))]
)
def test_reflections_look_points_up_where_they_are_seen(k: Intrinsics) -> None:
    """The kernels' projection equals that by Intrinsics; none outside the image or the field."""
    cache = DeviceCache(LIBRARY, open_device("cpu"))
    points = np.random.default_rng(2).normal(size=(4000, 3))
    places = k.project(points)
    inside = ((places >= 0.0) & (places < (k.width_px, k.height_px))).all(axis=1)
    expected = np.full(4000, -1)
    column, row = np.floor(places[inside]).astype(int).T
    expected[inside] = row * k.width_px + column
    near = inside & (np.abs(places - np.round(places)).min(axis=1) < 1e-2)

    pixels = wp.zeros(4000, dtype=int, device="cpu")
    inputs = [pack_view(ahead(k), cache), wp.array(points, dtype=wp.vec3, device="cpu")]
    wp.launch(look_up, 4000, inputs, [pixels], device="cpu")

    found = pixels.numpy()
    assert inside.sum() > 100
    assert (found == expected)[inside & ~near].all()
    assert (found[~inside] != -1).sum() <= 0.01 * (~inside).sum()
