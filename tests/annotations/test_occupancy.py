"""Voxels of solids, and the ones that cameras and scanners observe."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from gen_data.annotations import voxel_samples
from gen_data.annotations.annotate import annotate_ego
from gen_data.annotations.occupancy import VoxelOccupancy
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.asset_types import Asset
from gen_data.core.capture import Capture, Channel
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.sample import Occupancy, Sample
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import SE3, Array
from tests.embree import RayCaster, placed
from tests.libraries import library
from tests.renderers.fake_library import FakeLibrary, box_mesh, sphere_mesh
from tests.street_ground import Street
from tests.streets import thin_street

FREE, SURFACE, INTERIOR = range(3)


class Shapes(FakeLibrary):
    """Meshes as assets without tags."""

    def get(self, asset_id: str) -> Asset:
        return Asset(asset_id, "object", asset_id, (), "", "", "", "")


def filled(scene: Scene, assets: AssetLibrary, **fields: object) -> Occupancy:
    annotator = VoxelOccupancy.model_validate({"frame": "world", **fields})
    frame = annotate_ego({"": scene}, [annotator], assets, Capture({}))
    assert frame is not None
    assert frame.occupancy is not None
    return frame.occupancy


def centers(grid: Occupancy) -> Array:
    return grid.centers_m(np.indices(grid.state.shape).transpose(1, 2, 3, 0))


def test_a_ball_is_a_shell_around_an_interior() -> None:
    """Voxels that the sphere passes by half a diagonal or more are free or interior."""
    ball = Body("ball", "ball", SE3((0.13, -0.21, 0.07)), scale=2.0, instance_id=7)
    grid = filled(
        Scene("shapes", bodies=(ball,)), Shapes({"ball": sphere_mesh(0.5, rings=48)}),
        size_m=(3, 3, 3), voxel_m=0.1, from_m=(-1.5, -1.5, -1.5),
    )  # fmt: skip
    away = np.linalg.norm(centers(grid) - ball.T_world_body.translation_m, axis=-1)
    half = 0.5 * math.sqrt(3.0) * grid.voxel_m

    assert set(grid.state[away > 1.0 + half]) == {FREE}
    # Facets are up to 5 mm inside the sphere.
    assert set(grid.state[away < 0.995 - half]) == {INTERIOR}
    # The sphere cuts a disc whose radius is .36 voxels or more out of these.
    assert set(grid.state[np.abs(away - 1.0) < 0.1 * grid.voxel_m]) == {SURFACE}
    assert ((grid.instance_id == 7) == (grid.state > 0)).all()


@pytest.mark.parametrize("turned", [False, True])
def test_a_turned_box_has_its_volume(turned: bool) -> None:
    """Interior voxels and half of the surface ones: 2 x 1 x 0.6 m^3 within 4 %."""
    pose = SE3.about_z(0.4 if turned else 0.0, (0.03, 0.02, 0.01))
    scene = Scene("shapes", bodies=(Body("box", "box", pose, instance_id=1),))
    box = Shapes({"box": box_mesh((2.0, 1.0, 0.6))})
    grid = filled(scene, box, size_m=(8, 8, 8), voxel_m=0.05, from_m=(-4, -4, -4))

    voxels = (grid.state == INTERIOR).sum() + 0.5 * (grid.state == SURFACE).sum()
    assert voxels * grid.voxel_m**3 == pytest.approx(1.2, rel=0.04)


def test_the_inside_of_a_house_without_joints_is_interior_and_an_open_box_is_not() -> None:
    shell = np.zeros((7, 7, 6), np.bool_)
    shell[1:6, 1:6, :5] = True
    shell[2:5, 2:5, :4] = False

    assert voxel_samples.enclosed_cells(shell, closed_below=True).sum() == 36
    assert not voxel_samples.enclosed_cells(shell).any()


def test_small_objects_win_over_large_ones_and_over_the_background() -> None:
    """A cube of .2 m in a box, in an unlabelled floor."""
    parts = {"floor": (4.0, 4.0, 0.3), "box": (1.0, 1.0, 1.0), "cube": (0.2, 0.2, 0.2)}
    bodies = tuple(Body(name, name, instance_id=k) for k, name in enumerate(parts))
    named = tuple(
        Instance(
            k, name, name, k, name,
            box_min_m=tuple(-0.5 * side for side in parts[name]),
            box_max_m=tuple(0.5 * side for side in parts[name]),
        )
        for k, name in enumerate(parts) if k
    )  # fmt: skip
    shapes = Shapes({name: box_mesh(size) for name, size in parts.items()})
    scene = Scene("shapes", bodies=bodies, instances=named)
    grid = filled(scene, shapes, size_m=(2, 2, 2), voxel_m=0.2, from_m=(-1, -1, -1))

    at = np.abs(centers(grid)).max(axis=-1)
    assert set(grid.instance_id[at < 0.15]) == {2}
    off_floor = np.abs(centers(grid)[..., 2]) > 0.25
    assert set(grid.instance_id[(at < 0.45) & off_floor]) == {1}
    floor = (at > 0.55) & (np.abs(centers(grid)[..., 2]) < 0.15)
    assert set(grid.instance_id[floor]) == {0}
    assert (grid.state[floor] > 0).all()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"size_m": (500, 500, 50), "voxel_m": 0.05}, r"100,000,000,000 voxels need 1200\.0 GB"),
        ({"size_m": (80, 80, 6.5)}, r"6\.5 m is not a multiple of voxel_m, 0\.4 m"),
        ({"size_m": (0.1, 80, 6.4)}, "less than a voxel along an axis"),
    ],
)
def test_impossible_grids_are_refused_before_a_run(fields: dict[str, object], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        VoxelOccupancy.model_validate(fields)


def test_an_unknown_frame_is_named_with_the_known_ones() -> None:
    scene = Scene("shapes", bodies=())
    with pytest.raises(ConfigError, match=r"frame: there is no scanner 'roof'; expected one of"):
        annotate_ego({"": scene}, [VoxelOccupancy(frame="roof")], Shapes({}), Capture({}))


@dataclass(frozen=True, eq=False)
class World:
    """A street with its occupancy and the rays of another maker."""

    sample: Sample
    assets: AssetLibrary
    grid: Occupancy
    caster: RayCaster
    ids: NDArray[np.int64]


@cache
def world() -> World:
    config = thin_street(
        "kitti_rig", "exporters=[]", "annotations=[]",
        "sensors.image_02.size_px=[310, 94]", "sensors.image_03.size_px=[310, 94]",
    )  # fmt: skip
    with open_pipeline(config, frozenset({Channel.RANGE})) as pipeline:
        sample, assets = pipeline.sample(1), pipeline.assets
    annotator = VoxelOccupancy(size_m=(100.0, 30.0, 6.4), voxel_m=0.2)
    scenes = {"": sample.scene, **sample.instants}
    frame = annotate_ego(scenes, [annotator], assets, sample.capture)
    assert frame is not None
    assert frame.occupancy is not None
    own = sample.scene.body("ego").instance_id
    bodies = [b for b in sample.scene.bodies if b.instance_id != own]
    caster = RayCaster(*(placed(b, assets) for b in bodies))
    return World(sample, assets, frame.occupancy, caster, np.array([b.instance_id for b in bodies]))


def numbers(grid: Occupancy, p_world: Array) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Voxels of points, and whether they are in the grid by a millimetre at least."""
    place = (grid.T_world_frame.inverse().apply(p_world) - grid.low_m) / grid.voxel_m
    return np.floor(place).astype(np.intp), ((place > 0) & (place < grid.state.shape)).all(axis=-1)


@pytest.mark.slow
def test_what_rays_of_another_maker_hit_is_surface() -> None:
    """Rays from above and from the side, at random; hits within 2 mm of a voxel's faces left out.

    A sample misses a surface only if less than a disc of .36 voxels of it is in the voxel: corners
    and thin parts, on few rays.
    """
    made = world()
    rng = np.random.default_rng(3)
    start = made.grid.T_world_frame.apply(rng.uniform((-30, -12, 5), (30, 12, 5.4), (20_000, 3)))
    way = rng.normal(size=start.shape)
    way[:, 2] = -np.abs(way[:, 2])
    hits = made.caster.cast(start, way)
    met = np.isfinite(hits.distance)
    points = start[met] + hits.distance[met, None] * way[met]
    place = (made.grid.T_world_frame.inverse().apply(points) - made.grid.low_m) / made.grid.voxel_m
    clear = (np.abs(place - np.round(place)) > 0.01).all(axis=-1)
    voxels, inside = numbers(made.grid, points)
    chosen = clear & inside
    at = tuple(voxels[chosen].T)

    assert chosen.sum() > 5_000
    assert (made.grid.state[at] == SURFACE).mean() > 0.99
    ids = made.ids[hits.mesh[met][chosen]]
    hit = made.grid.state[at] == SURFACE
    # Of several objects in a voxel, the smallest one has it.
    assert (made.grid.instance_id[at] == ids)[hit].mean() > 0.96


@pytest.mark.slow
def test_every_surface_voxel_has_a_surface() -> None:
    """25 lines through each of 1,000 voxels along each axis; few corners are between the lines."""
    made = world()
    voxels = np.argwhere(made.grid.state == SURFACE)
    voxels = np.random.default_rng(5).permutation(voxels)[:1_000]
    u, v = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(0.02, 0.98, 5)]))
    found = np.zeros(len(voxels), np.bool_)
    for axis in range(3):
        offset = np.insert(np.stack([u, v], axis=1), axis, 0.0, axis=1)
        start = (voxels[:, None] + offset) * made.grid.voxel_m + made.grid.low_m
        way = made.grid.T_world_frame.rotate(np.eye(3)[axis] * made.grid.voxel_m)
        found |= made.caster.is_blocked(made.grid.T_world_frame.apply(start), way, 0.0, 1.0).any(1)

    assert len(voxels) == 1_000
    assert found.mean() > 0.97


@pytest.mark.slow
def test_walls_and_a_roof_hide_the_inside_of_a_house_from_all_sides() -> None:
    """Rays from all interior voxels to five sides hit the house; voxels above it are free."""
    house = Body("house", "building/house?seed=23", instance_id=1)
    grid = filled(Scene("house", bodies=(house,)), library(), size_m=(20, 20, 14), voxel_m=0.4)
    caster = RayCaster(placed(house, library()))
    inside = centers(grid)[grid.state == INTERIOR]
    ways = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)], float)

    assert caster.is_blocked(inside[:, None], ways, 0.0, 30.0).all(axis=1).mean() > 0.995
    # It is 10 m x 11 m, with eaves at 6 m.
    assert len(inside) * 0.4**3 > 9.0 * 9.0 * 5.5


@pytest.mark.slow
@pytest.mark.parametrize("camera", ["image_02", "image_03"])
def test_a_camera_observes_the_free_voxels_that_nothing_hides(camera: str) -> None:
    """Rays from the camera to the centres of voxels, except voxels at an edge."""
    made = world()
    reading = made.sample.capture.readings[camera]
    grid, pose = made.grid, reading.camera.T_world_camera
    voxels = np.argwhere(grid.state == FREE)
    voxels = np.random.default_rng(7).permutation(voxels)[:6_000]
    p_world = grid.T_world_frame.apply(grid.centers_m(voxels))
    p_camera = pose.inverse().apply(p_world)
    pixel = reading.camera.intrinsics.project(p_camera)
    size = (reading.camera.intrinsics.width_px, reading.camera.intrinsics.height_px)
    inside = ((pixel > 1) & (pixel < np.array(size) - 1)).all(axis=1)
    eye = np.asarray(pose.translation_m)
    # A pixel is .0055 wide at a depth of 1.
    shifts = 0.004 * np.array([(0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)])
    ways = p_world - eye + pose.rotate(shifts)[:, None] * p_camera[:, 2:]
    hidden = made.caster.is_blocked(eye, ways, 1e-3, 1.0)
    sure = inside & (hidden.all(axis=0) | ~hidden.any(axis=0))
    observed = grid.observed[camera][tuple(voxels.T)]

    assert sure.sum() > 300
    assert (observed[sure] != hidden[0, sure]).mean() > 0.995
    outside = ~((pixel > -1) & (pixel < np.array(size) + 1)).all(axis=1)
    assert not observed[outside].any()


@pytest.mark.slow
def test_a_scanner_observes_the_voxels_between_itself_and_its_points() -> None:
    """Points along the lines to 500 returns; elsewhere it observes nothing."""
    made = world()
    cloud = made.sample.capture.clouds["velodyne"]
    seen = made.grid.observed["velodyne"]
    rng = np.random.default_rng(11)
    T_world_lidar = cloud.lidar.T_world_lidar
    end = T_world_lidar.apply(rng.permutation(cloud.points["position_m"])[:500].astype(np.float64))
    # The scanner moves by decimetres within its sweep: only the far half of a line is sure.
    share = rng.uniform(0.8, 1.0, (500, 40, 1))
    start = np.asarray(T_world_lidar.translation_m)
    voxels, inside = numbers(made.grid, (start + share * (end[:, None] - start)).reshape(-1, 3))

    assert inside.sum() > 10_000
    assert seen[tuple(voxels[inside].T)].mean() > 0.97
    assert (
        not seen[made.grid.state == INTERIOR].any()
        or seen[made.grid.state == INTERIOR].mean() < 0.01
    )


@pytest.mark.slow
def test_moving_objects_have_their_velocity_and_leave_no_trail() -> None:
    """Voxels of a car at two instants, a step apart, are as many; their middle moves as stated."""
    made = world()
    scene = made.sample.scene
    moving = [
        instance
        for instance in scene.instances
        if math.hypot(*instance.twist.velocity_m_s) > 1.0
        and (made.grid.instance_id == instance.instance_id).sum() > 50
    ]
    velocities = made.grid.velocities_m_s(scene.instances)
    assert moving
    for instance in moving:
        own = made.grid.instance_id == instance.instance_id
        p_world = made.grid.T_world_frame.apply(centers(made.grid)[own])
        size = np.ptp(instance.T_world_instance.inverse().apply(p_world), axis=0)
        assert (
            size < np.array(instance.box3d.size_m) + 2.0 * made.grid.voxel_m * math.sqrt(3)
        ).all()
        mean = made.grid.T_world_frame.rotate(velocities[own].mean(axis=0).astype(np.float64))
        assert mean == pytest.approx(np.array(instance.twist.velocity_m_s), abs=0.3)
    still = {0, *(i.instance_id for i in scene.instances if i.twist == type(i.twist)())}
    assert not velocities[np.isin(made.grid.instance_id, sorted(still))].any()


@pytest.mark.slow
def test_the_land_below_the_street_is_interior_and_the_air_above_is_not() -> None:
    """Voxels half a metre below and above the carriageway, by rays onto it."""
    made = world()
    ground = Street(made.sample.scene, made.assets)
    rig = made.grid.T_world_frame
    places = rig.apply(np.random.default_rng(13).uniform((-25, -12, 0), (25, 12, 0), (400, 3)))
    places[:, 2] = ground.ground_m(places)
    states = {}
    for height_m in (-0.5, 0.0, 0.5):
        voxels, inside = numbers(made.grid, places + np.array([0.0, 0.0, height_m]))
        free = made.grid.instance_id[tuple(voxels[inside].T)] == 0
        states[height_m] = made.grid.state[tuple(voxels[inside].T)][free]
    assert len(states[-0.5]) > 200
    assert (states[-0.5] == INTERIOR).mean() > 0.99
    assert (states[0.0] == SURFACE).mean() > 0.99
    assert (states[0.5] == FREE).mean() > 0.99


@pytest.mark.slow
def test_the_ego_vehicle_is_in_no_grid_of_its_own() -> None:
    made = world()
    rig = made.grid.T_world_frame
    inside = np.array([[x, y, z] for x in (0.5, 1.5) for y in (-0.4, 0.4) for z in (0.6, 1.0)])
    voxels, _ = numbers(made.grid, rig.apply(inside))
    assert set(made.grid.state[tuple(voxels.T)]) == {FREE}
    assert made.caster.is_blocked(rig.apply(inside), np.array([0.0, 0.0, -1.0]), 0.0, 3.0).all()
