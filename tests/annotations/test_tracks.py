"""Points followed over a sequence: their places by closed formulas, who sees them by other rays."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.annotations.tracks import Tracks
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.asset_types import Material, MeshData
from gen_data.core.capture import POINT, Capture, PointCloud, SensorReading
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetLibrary, ViewSequence
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.motion import StateChange
from gen_data.core.sample import TRACK_STATES, EgoTruth, PointTracks, SensorTracks
from gen_data.core.scene import Body, Camera, Lidar, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import SE3, Array, look_at
from gen_data.core.shutter import INSTANT, Shutter
from gen_data.core.streams import Streams
from gen_data.exporters.base import Rectify
from gen_data.pipeline.rectification import rectification, rectified_tracks
from gen_data.renderers.warp.renderer import WarpRenderer
from tests.embree import RayCaster, placed
from tests.libraries import library
from tests.renderers.fake_library import FakeLibrary, box_mesh
from tests.renderers.moving import FACING, LENS, MESHES, even_track, world
from tests.streets import thin_street

VISIBLE, GLASS, OCCLUDED, OUTSIDE, BEHIND = range(5)
STEP_S = 0.1
WALL = Body("wall", "wall", replace(FACING, translation_m=(0.0, 0.0, 6.0)))


def stretched(mesh: MeshData, factors: tuple[float, float, float]) -> MeshData:
    return replace(mesh, vertices_m=mesh.vertices_m * np.array(factors, np.float32))


PANE = Material((0.01, 0.01, 0.01), 0.05, role="glass")
AT_THE_BACK = replace(box_mesh(), vertices_m=box_mesh().vertices_m * np.float32(0.1) - [0, 0, 9])
SHAPES = FakeLibrary({
    **MESHES.meshes,
    # The body that carries the camera: rays begin within it.
    "speck": replace(AT_THE_BACK, vertices_m=AT_THE_BACK.vertices_m.astype(np.float32)),
    "tall": stretched(box_mesh(), (1.0, 1.5, 0.5)),
    "half": replace(box_mesh(), faces=box_mesh().faces[::-1].copy()),
    "pane": box_mesh((20.0, 20.0, 0.006), (PANE,)),
})  # fmt: skip


def sequence(
    scene: Scene, steps: int, seed: int = 1, assets: AssetLibrary = SHAPES
) -> ViewSequence:
    first = scene_at(scene, 0.0)
    return ViewSequence(
        lambda time_s: scene_at(first, time_s),
        tuple(k * STEP_S for k in range(steps)),
        assets,
        WarpRenderer(assets, "cpu"),
        Streams(seed, 0, view=0),
    )


def at_step(view: ViewSequence, step: int, points: int = 60) -> PointTracks:
    """Tracks of one step, from nothing but the view."""
    annotator = Tracks(points=points)
    scene = view.at(view.instants_s[step])
    readings = {c.name: SensorReading(c.name, c, {}, {}, scene.time_s) for c in scene.cameras}
    begun = annotator.begin(view)
    frame = annotator.annotate_step(view, begun, scene, Capture(readings), EgoTruth())
    assert frame.tracks is not None
    return frame.tracks


def followed(scene: Scene, steps: int = 3, points: int = 60) -> list[PointTracks]:
    view = sequence(scene, steps)
    return [at_step(view, step, points) for step in range(steps)]


def arrays(tracks: PointTracks) -> list[NDArray[np.generic]]:
    found: list[NDArray[np.generic]] = [tracks.instance_id, tracks.position_m]
    for seen in tracks.sensors.values():
        found += [seen.position_m, seen.image_px, seen.state, seen.hidden_by]
    return found


def camera(tracks: PointTracks) -> SensorTracks:
    return tracks.sensors["camera"]


def test_points_ride_on_rigid_bodies_and_the_rest_stays() -> None:
    """p(t) = c + v t + R(w t) (p(0) - c), in a camera that moves; the image is K p / z."""
    start, velocity, turn = SE3((0.0, 0.0, 3.0)), np.array([0.6, 0.2, -0.5]), 0.8
    box = Body("box", "box", start, instance_id=1)
    track = even_track("box", start, (0.6, 0.2, -0.5), turn)
    scene = world(box, WALL, tracks=(track,), camera_velocity_m_s=(-0.3, 0.0, 0.2))
    steps = followed(scene)
    rides = steps[0].instance_id == 1
    assert 20 <= rides.sum() <= 40
    first = steps[0].position_m.astype(float)
    for k, tracks in enumerate(steps):
        time_s = k * STEP_S
        c, s = np.cos(turn * time_s), np.sin(turn * time_s)
        R = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        centre = np.array(start.translation_m)
        expected = first.copy()
        expected[rides] = centre + velocity * time_s + (first[rides] - centre) @ R.T
        np.testing.assert_allclose(tracks.position_m, expected, atol=2e-5)
        seen = camera(tracks)
        eye = np.array([-0.3, 0.0, 0.2]) * time_s
        np.testing.assert_allclose(seen.position_m, expected - eye, atol=2e-5)
        image = (expected - eye) @ LENS.matrix().T
        np.testing.assert_allclose(seen.image_px, image[:, :2] / image[:, 2:], atol=2e-3)


def test_points_are_on_the_surfaces_in_view_evenly_among_the_objects() -> None:
    """A small box has as many as the wall that fills the image; each is in the plane of a face."""
    box = Body("box", "box", SE3((0.0, 0.0, 3.0)), instance_id=1)
    (tracks,) = followed(world(box, WALL), steps=1)
    p, of_box = tracks.position_m, tracks.instance_id == 1
    assert (of_box.sum(), (~of_box).sum()) == (30, 30)
    np.testing.assert_allclose(p[of_box][:, 2], 2.5, atol=1e-6)
    np.testing.assert_allclose(p[~of_box][:, 2], 6.0, atol=1e-6)
    assert set(camera(tracks).state) == {VISIBLE}


@pytest.mark.parametrize(
    ("mesh", "factors"), [("tall", (1.0, 1.5, 0.5)), ("half", (1.0, 1.0, 1.0))]
)
def test_points_on_a_mesh_that_deforms_keep_to_their_triangles(
    mesh: str, factors: tuple[float, float, float]
) -> None:
    """Stretched by the factors, and moved; on other triangles points stay where they were."""
    start = SE3((0.0, 0.0, 3.0))
    box = Body("box", "box", start, scale=0.8, instance_id=1)
    track = even_track("box", start, (0.5, 0.0, 0.0))
    changes = (StateChange(0.05, "box", mesh),)
    scene = world(box, tracks=(track,), changes=changes, time_s=0.0)
    first, second = followed(scene, steps=2)
    centre = np.array(start.translation_m)
    expected = centre + (first.position_m - centre) * factors + [0.05, 0.0, 0.0]
    assert np.abs(first.position_m - centre).max(axis=1) == pytest.approx(0.4, abs=1e-6)
    np.testing.assert_allclose(second.position_m, expected, atol=1e-5)


def slab_hit(eye: Array, ends: Array, low: Array, high: Array) -> NDArray[np.bool_]:
    """Whether the segments from an eye to points cross a box, by its slabs."""
    way = ends - eye
    times = np.stack([(low - eye) / way, (high - eye) / way])
    enter, leave = times.min(axis=0).max(axis=1), times.max(axis=0).min(axis=1)
    return np.asarray((enter < leave) & (leave > 0.0) & (enter < 0.999))


def test_a_box_before_the_wall_hides_points_and_is_named() -> None:
    """Also points on its own far sides, once it has turned; by the slabs of the box."""
    start = SE3((-1.2, 0.0, 3.0))
    box = Body("box", "box", start, instance_id=7)
    track = even_track("box", start, (6.0, 0.0, 0.0))
    steps = followed(world(box, WALL, tracks=(track,)), steps=5, points=300)
    counts = []
    for k, tracks in enumerate(steps):
        centre = np.array([-1.2 + 0.6 * k, 0.0, 3.0])
        on_wall = tracks.instance_id == 0
        ends = tracks.position_m[on_wall].astype(float)
        around = [slab_hit(np.zeros(3), ends, centre - h, centre + h) for h in (0.499, 0.501)]
        clear = around[0] == around[1]
        seen = camera(tracks)
        inside = seen.state[on_wall] <= OCCLUDED
        hidden = seen.state[on_wall] == OCCLUDED
        assert (hidden == around[0])[clear & inside].all()
        assert set(seen.hidden_by[on_wall][hidden]) <= {7}
        assert not seen.hidden_by[seen.state == VISIBLE].any()
        counts.append(int(hidden.sum()))
        own = (tracks.instance_id == 7) & (seen.state == OCCLUDED)
        assert set(seen.hidden_by[own]) <= {7}
    assert max(counts) > 10


def test_a_scanner_has_the_points_in_its_frame_and_sees_past_other_edges() -> None:
    """A metre to the left of the camera, turned by a right angle; hidden by the slabs of a box."""
    box = Body("box", "box", SE3((0.0, 0.0, 3.0)), instance_id=7)
    scene = world(box, WALL)
    half = np.sqrt(0.5)
    pose = SE3((-1.0, 0.0, 0.0), (half, 0.0, 0.0, half))
    view = sequence(scene, 1)
    annotator = Tracks(points=300)
    cloud = PointCloud("top", Lidar("top", "", T_world_lidar=pose), np.zeros(0, POINT))
    frame = annotator.annotate_step(
        view, annotator.begin(view), view.at(0.0), Capture({}, {"top": cloud}), EgoTruth()
    )
    assert frame.tracks is not None
    seen, p = frame.tracks.sensors["top"], frame.tracks.position_m.astype(float)
    x, y, z = p.T
    np.testing.assert_allclose(seen.position_m, np.stack([y, -(x + 1.0), z], axis=1), atol=1e-5)
    on_wall = frame.tracks.instance_id == 0
    low, high = np.array([-0.5, -0.5, 2.5]), np.array([0.5, 0.5, 3.5])
    eye = np.array(pose.translation_m)
    around = [slab_hit(eye, p[on_wall], low - e, high + e) for e in (-1e-3, 1e-3)]
    clear = around[0] == around[1]
    hidden = seen.state[on_wall] == OCCLUDED
    assert (hidden == around[0])[clear].all()
    assert 5 < hidden.sum() < on_wall.sum() - 5
    assert set(seen.hidden_by[on_wall][hidden]) == {7}
    assert set(seen.state) == {VISIBLE, OCCLUDED}
    assert np.isnan(seen.image_px).all()


def test_behind_a_pane_points_are_seen_through_it_and_none_is_on_it() -> None:
    """The pane slides in from above within a step; the box before it stays in the air."""
    start = SE3((0.0, -41.0, 4.0))
    pane = Body("pane", "pane", start, instance_id=5)
    box = Body("box", "box", SE3((0.0, 0.0, 2.0)), scale=0.4, instance_id=1)
    track = even_track("pane", start, (0.0, 410.0, 0.0))
    steps = followed(world(pane, box, WALL, tracks=(track,)), steps=2)
    before, behind = (camera(tracks) for tracks in steps)
    ids = steps[0].instance_id
    assert set(ids) == {0, 1}
    assert GLASS not in before.state
    assert set(behind.state[ids == 0]) <= {GLASS, OCCLUDED}
    assert set(behind.hidden_by[behind.state == GLASS]) == {5}
    assert set(behind.hidden_by[behind.state == OCCLUDED]) <= {1}
    assert set(behind.state[ids == 1]) == {VISIBLE}


def test_points_beside_the_image_are_outside_and_those_at_the_back_behind() -> None:
    """The camera turns by a quarter in a step: x / z of the points gives their position."""
    scene = world(WALL, camera_turn_rad_s=7.0)
    for tracks in followed(scene, steps=4):
        seen = camera(tracks)
        x, y, z = seen.position_m.T
        u, v = 80.0 * x / z + 48.0, 80.0 * y / z + 32.0
        inside = (z > 0) & (u >= 0) & (u < 96) & (v >= 0) & (v < 64)
        assert ((seen.state == BEHIND) == (z <= 0)).all()
        assert ((seen.state == OUTSIDE) == ((z > 0) & ~inside)).all()
        assert np.isnan(seen.image_px[z <= 0]).all()
        assert (seen.state[inside] == VISIBLE).all()


def test_a_wide_lens_sees_points_where_its_model_puts_them() -> None:
    """An equidistant fisheye: the distance from the centre is f times the angle."""
    lens = replace(LENS, lens=Lens("kannala_brandt", (0.0, 0.0, 0.0, 0.0), 1.5))
    (tracks,) = followed(world(WALL, lens=lens), steps=1)
    seen = camera(tracks)
    x, y, z = seen.position_m.astype(float).T
    angle, level = np.arctan2(np.hypot(x, y), z), np.hypot(x, y)
    expected = np.stack([x, y], axis=1) * (80.0 * angle / level)[:, None] + [48.0, 32.0]
    np.testing.assert_allclose(seen.image_px, expected, atol=1e-3)
    assert set(seen.state) == {VISIBLE}


def test_rectified_points_are_where_the_pinhole_has_them() -> None:
    """K p / z of the points in the camera's frame; points off the new image are outside."""
    lens = replace(LENS, lens=Lens("kannala_brandt", (0.0, 0.0, 0.0, 0.0), 1.5))
    (tracks,) = followed(world(WALL, lens=lens), steps=1)
    bent = rectification(lens, Rectify(hfov_deg=40.0))
    seen = rectified_tracks(camera(tracks), bent)
    image = seen.position_m @ bent.target.matrix().T
    expected = image[:, :2] / image[:, 2:]
    np.testing.assert_allclose(seen.image_px, expected, atol=2e-3)
    inside = ((expected >= 0.0) & (expected < (96, 64))).all(axis=1)
    assert 5 < inside.sum() < 55
    assert (seen.state == np.where(inside, VISIBLE, OUTSIDE)).all()


@pytest.mark.parametrize("readout_s", [0.04, -0.04])
def test_a_rolling_shutter_shows_points_at_the_instants_of_their_rows(readout_s: float) -> None:
    """A wall 6 m away that moves at 3 m/s, 40 px/s; in space, where it is at the instant."""
    start = WALL.T_world_body
    track = even_track("wall", start, (3.0, 0.0, 0.0))
    scene = world(WALL, tracks=(track,), shutter=Shutter(0.0, readout_s))
    flat = world(WALL, tracks=(track,), shutter=INSTANT)
    for rolled, still in zip(followed(scene), followed(flat), strict=True):
        one, other = camera(rolled), camera(still)
        np.testing.assert_allclose(one.position_m, other.position_m, atol=1e-6)
        v = other.image_px[:, 1]
        inside = (v >= 0.0) & (v < 64.0)
        delay_s = readout_s * (v / 64.0 - 0.5)
        expected = other.image_px[:, 0] + 3.0 / 6.0 * 80.0 * delay_s
        np.testing.assert_allclose(one.image_px[inside, 0], expected[inside], atol=2e-3)
        shown = (one.image_px[:, 0] >= 0.0) & (one.image_px[:, 0] < 96.0) & inside
        assert (one.state[shown] == VISIBLE).all()


def test_every_step_finds_the_same_points_by_itself_and_another_seed_others() -> None:
    box = Body("box", "box", SE3((0.0, 0.0, 3.0)), instance_id=1)
    scene = world(box, WALL, tracks=(even_track("box", box.T_world_body, (0.5, 0.1, 0.0)),))
    alone = at_step(sequence(scene, 3), 2)
    after = followed(scene)[2]
    assert all(map(np.array_equal, arrays(alone), arrays(after)))
    other = at_step(sequence(scene, 3, seed=2), 2)
    assert not np.array_equal(alone.position_m, other.position_m)


def test_a_scene_without_a_camera_is_refused() -> None:
    view = sequence(replace(world(WALL), cameras=()), 1)
    with pytest.raises(ConfigError, match="points are chosen in images, but there is no camera"):
        Tracks().begin(view)


def test_where_nothing_is_in_view_there_are_no_points() -> None:
    (tracks,) = followed(replace(world(), bodies=world().bodies[-1:]), steps=1)
    assert tracks.position_m.shape == (0, 3)
    assert camera(tracks).image_px.shape == (0, 2)


def test_the_states_have_the_names_that_these_tests_count_on() -> None:
    assert TRACK_STATES == ("visible", "glass", "occluded", "outside", "behind")


def judge(scene: Scene, assets: AssetLibrary, tracks: PointTracks, name: str) -> tuple[int, int]:
    """Points that Embree's rays judge, and how many of them are told otherwise.

    Points whose rays pass a silhouette within a milliradian, panes or cut-out leaves are left
    out.
    """
    seen, pose = tracks.sensors[name], scene.camera(name).T_world_camera
    caster = RayCaster(*(placed(b, assets) for b in scene.bodies))
    ids = np.array([b.instance_id for b in scene.bodies])
    rows = np.flatnonzero(np.isin(seen.state, (VISIBLE, OCCLUDED)))
    eye = np.array(pose.translation_m)
    way = pose.rotate(seen.position_m[rows].astype(float))
    length = np.linalg.norm(way, axis=1)
    side = np.cross(way, [0.0, 0.0, 1.0])
    side *= (1e-3 * length / np.linalg.norm(side, axis=1))[:, None]
    up = np.cross(side, way) / length[:, None]
    hits, *others = (caster.cast(eye, w) for w in (way, way + side, way - side, way + up, way - up))
    clear = np.all([other.mesh == hits.mesh for other in others], axis=0)
    clear &= ~np.array(["trees" in b.asset for b in scene.bodies])[hits.mesh]
    hidden = hits.distance < 1.0 - 1e-3 / length
    told = seen.state[rows] == OCCLUDED
    named = np.where(told, ids[hits.mesh] == seen.hidden_by[rows], True)
    return int(clear.sum()), int(((told != hidden) | ~named)[clear].sum())


@pytest.mark.slow
def test_rays_of_another_maker_see_the_same_points_of_people_who_walk() -> None:
    """A person walks past another one; the meshes are as posed at each step."""
    assets = library()
    walker = "simple_person?phase={}&pose=walk&seed=3"
    start = SE3((3.0, -0.6, 0.9))
    bodies = (
        Body("walker", walker.format(0.0), start, instance_id=1),
        Body("waiting", "simple_person?phase=0.5&pose=walk&seed=4", SE3((4.2, 0.0, 0.9)),
             instance_id=2),
    )  # fmt: skip
    lens = Intrinsics(160, 160, 130.0, 130.0, 80.0, 80.0)
    scene = Scene(
        "people", bodies, cameras=(Camera("camera", look_at((0, 0, 1.3), (4, 0, 1)), lens),),
        tracks=(even_track("walker", start, (0.0, 1.3, 0.0)),),
        changes=tuple(StateChange(k * STEP_S, "walker", walker.format(k / 16)) for k in range(6)),
    )  # fmt: skip
    view = sequence(scene, 6, assets=assets)
    judged = wrong = 0
    for step in (5, 0, 3):
        tracks = at_step(view, step, points=400)
        counts = judge(view.at(view.instants_s[step]), assets, tracks, "camera")
        judged, wrong = judged + counts[0], wrong + counts[1]
        states = set(camera(tracks).state[tracks.instance_id == 1])
        assert states == {VISIBLE, OCCLUDED}
    assert judged > 200
    assert wrong == 0


@pytest.mark.slow
def test_rays_of_another_maker_see_the_same_points_of_a_street() -> None:
    config = thin_street(
        "street_sequence", "exporters=[]", "annotations=[{type: tracks, points: 400}]",
        "sensors.color.size_px=[310, 94]", "steps_per_scene=10",
    )  # fmt: skip
    judged = wrong = 0
    with open_pipeline(config) as pipeline:
        for index in (9, 0):
            sample = pipeline.sample(index)
            assert sample.frame is not None
            assert sample.frame.tracks is not None
            scene = sample.scene_of("color")
            counts = judge(scene, pipeline.assets, sample.frame.tracks, "color")
            judged, wrong = judged + counts[0], wrong + counts[1]
    assert judged > 200
    assert wrong == 0
