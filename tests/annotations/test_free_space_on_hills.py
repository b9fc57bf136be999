"""Free space at crests, in dips, on motorways and in car parks that slope or bend.

Each pixel's ray is cast by Embree against all meshes of the scene. It is free if the first face
that it meets is of the carriageway, or of a cover that lies on it, and within 60 m over the ground.
"""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import Channel
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.sample import Sample
from gen_data.core.scene import Body
from gen_data.core.se3 import SE3
from gen_data.pipeline import Pipeline
from tests.embree import RayCaster, placed
from tests.streets import thin_street

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FAR_M = 60.0
NEAR_EDGE_M = 0.15
"""Pixels this near to an edge of the carriageway are left out: labels have cells of 0.1 m."""
ON_IT_M = 0.01
"""Covers and paint are 2 to 5 mm thick; kerbs are higher."""
LINE_M = np.arange(2.0, 58.0, 0.5)
"""Distances of places ahead of a camera."""
SMALL = (
    "sensors.color.size_px=[160, 96]", "shared.weather=CloudyNoon",
    "annotations=[boxes3d, free_space, instance_masks, poses, visibility]",
)  # fmt: skip
STREET = (
    "shared.junction=none", "shared.landmark=none", "randomizers.parked.count=6",
    "randomizers.traffic.count=6", "randomizers.people.count=4", *SMALL,
    "randomizers.relief.grade={choice: [-0.12, 0.12]}",
    "randomizers.relief.side_slope={uniform: [-0.15, 0.15]}",
)  # fmt: skip
LOT = (
    *SMALL, "shared.fill=0.5", "randomizers.people.count=3",
    "randomizers.relief.grade={uniform: [-0.05, 0.05]}",
)  # fmt: skip
LOT_SCENERY = ("buildings", "lamps", "street_lights")
HIGHWAY = (
    "shared.course=left", "shared.radius=900", "shared.turn=20", "shared.land=woods",
    "shared.lanes=2", "shared.city=none", "randomizers.traffic.count=12", *SMALL,
    "randomizers.relief.grade={uniform: [-0.04, 0.04]}",
)  # fmt: skip


STREETS = thin_street("street.yaml", *STREET, "shared.course=straight")
SCENES = {
    "bends": thin_street("street.yaml", *STREET, "shared.course=s_left", "views_per_scene=2"),
    "lot": load_config(
        "parking.yaml", overrides=(*LOT, "shared.course=straight", "views_per_scene=2"),
        without=LOT_SCENERY,
    ),
    "bent lot": load_config(
        "parking.yaml",
        overrides=(*LOT, "shared.course=right", "shared.bend=0.02", "shared.aisles=2",
                   "views_per_scene=2"),
        without=LOT_SCENERY,
    ),
    "highway": load_config(
        "highway.yaml", overrides=(*HIGHWAY, "views_per_scene=2"), without=("trees", "signs")
    ),
}  # fmt: skip
CHANNELS = frozenset({Channel.RANGE, Channel.INSTANCE})


class Sight:
    """First surfaces on rays of Embree through the pixels of a sample's camera meet.

    Attributes:
        scene: Scene of the sample.
        met: Whether a ray meets a surface, [h, w].
        points_m: Points on first surfaces, in the world, [h, w, 3]; the eye where nothing is met.
        away_m: Their distance over the ground [h, w].
        unlabelled: Whether a first surface is of no instance [h, w].
        steady: Whether four rays 0.02 px off the centre meet the same body [h, w].
        eye_m: Place of the camera.
    """

    def __init__(self, sample: Sample, assets: AssetLibrary) -> None:
        self.scene = sample.scene
        bodies = sample.scene.bodies
        camera = sample.capture.readings["color"].camera
        self.T_world_camera = camera.T_world_camera
        self.eye_m = np.array(camera.T_world_camera.translation_m)
        here = camera.T_world_camera.inverse()
        # Single precision is finest around the eye.
        placed_here = [placed(body, assets) for body in bodies]
        self._caster = RayCaster(*((here.apply(v), faces) for v, faces in placed_here))
        rays = camera.intrinsics.pixel_rays()
        hits = self._caster.cast((0.0, 0.0, 0.0), rays)
        self.met = hits.mesh >= 0
        range_m = np.where(self.met, hits.distance, 0.0).astype(np.float64)
        self.points_m = camera.T_world_camera.apply(rays * range_m[..., None])
        self.away_m = np.hypot(*np.moveaxis(self.points_m - self.eye_m, -1, 0)[:2])
        paved = [_paved_faces(body, assets) for body in bodies]
        own = np.array([body.instance_id for body in bodies])
        self.unlabelled = self.met & (own[hits.mesh] == 0)
        level = rays / rays[..., 2:]
        px = 0.02 / camera.intrinsics.fx_px
        moved = [
            self._caster.cast((0.0, 0.0, 0.0), level + np.array((x, y, 0.0))).mesh
            for x, y in ((px, px), (px, -px), (-px, px), (-px, -px))
        ]
        self.steady = np.all([mesh == hits.mesh for mesh in moved], axis=0)
        self._ground = RayCaster(*(
            (v, faces[kept])
            for (v, faces), kept in zip((placed(b, assets) for b in bodies), paved, strict=True)
            if kept.any()
        ))  # fmt: skip

    def ground_m(self, places_m: Array) -> Array:
        """Height of the carriageway at places [..., 3]; -inf where there is none."""
        above = np.array(places_m)
        above[..., 2] = self.eye_m[2] + 80.0
        height: Array = above[..., 2] - self._ground.cast(above, (0.0, 0.0, -1.0)).distance
        return height

    def free(self) -> Mask:
        """Pixels that show the carriageway, or anything flat that lies on it, within 60 m."""
        height_m = np.abs(self.points_m[..., 2] - self.ground_m(self.points_m))
        free: Mask = self.unlabelled & (height_m < ON_IT_M) & (self.away_m < FAR_M)
        return free

    def clear_of_edges(self) -> Mask:
        """Pixels whose points are nowhere near an edge of the carriageway, nor 60 m away."""
        steps = (-NEAR_EDGE_M, 0.0, NEAR_EDGE_M)
        around = np.array(
            [
                np.isfinite(self.ground_m(self.points_m + np.array((x, y, 0.0))))
                for x in steps
                for y in steps
            ]
        )
        alike = around.all(axis=0) | ~around.any(axis=0)
        clear: Mask = self.steady & alike & (np.abs(self.away_m - FAR_M) > 0.1)
        return clear

    def hidden_by_ground(self, places_m: Array) -> Mask:
        """Whether the carriageway itself is between the eye and places [n, 3]."""
        return self._ground.is_blocked(self.eye_m, places_m - self.eye_m, 0.0, 0.98)

    def ahead_m(self) -> Array:
        """Places [n, 3] on the carriageway straight ahead of the camera; shorter where it ends."""
        places = _ahead(self.T_world_camera)
        places[:, 2] = self.ground_m(places)
        return places[np.isfinite(places[:, 2])]


def _paved_faces(body: Body, assets: AssetLibrary) -> Mask:
    """Faces of a body's mesh that are asphalt or paint on it, if nothing but ground."""
    mesh = assets.mesh(body.asset)
    materials = body.materials or assets.materials(body.asset)
    slots = [k for k, material in enumerate(materials) if material.role in ("asphalt", "marking")]
    return np.isin(mesh.face_slots, slots if body.instance_id == 0 else [])


def _ahead(T_world_camera: SE3) -> Array:
    """Places [n, 3] straight ahead of a camera over the ground, at its height."""
    x, y, _ = T_world_camera.rotate(np.array([0.0, 0.0, 1.0]))
    steps = LINE_M[:, None] * np.array([x, y, 0.0]) / np.hypot(x, y)
    places: Array = np.array(T_world_camera.translation_m) + steps
    return places


def _free_label(sample: Sample, shape: tuple[int, ...]) -> Mask:
    free = sample.truth["color"].free_space
    assert free is not None
    mask = np.zeros(shape, np.bool_)
    height, width = free.pixels.shape
    mask[free.y_px : free.y_px + height, free.x_px : free.x_px + width] = free.pixels
    return mask


def _check(sample: Sample, sight: Sight) -> Mask:
    """The label, which rays confirm at all pixels; at edges of the carriageway at nearly all."""
    free, label = sight.free(), _free_label(sample, sight.met.shape)
    clear = sight.clear_of_edges()
    assert free.sum() > 1500
    assert clear[free].mean() > 0.93
    np.testing.assert_array_equal(label[clear], free[clear])
    assert (label != free).mean() < 0.005
    return label


def _first_view(pipeline: Pipeline, views: int, wanted: Callable[[Array], bool]) -> int:
    """Index of the first view along the main road that is wanted by heights [n] of ground ahead.

    They are relative to the camera's height. The road leads along the X axis from -150 to 0 m.
    """
    for number in range(60):
        scene = pipeline.accepted_scene(number)
        for view in range(views):
            drawn = pipeline.drawn_view(scene, view).scene
            assert drawn.relief is not None
            places = _ahead(drawn.cameras[0].T_world_camera)
            inside = (np.abs(places[:, 1]) < 3.0).all() and (
                np.abs(places[:, 0] + 75.0) < 74.0
            ).all()
            if inside and wanted(drawn.relief.height(places) - places[:, 2]):
                return number * views + view
    raise AssertionError("no such view")


def _checked_view(wanted: Callable[[Array], bool]) -> tuple[Mask, Sight]:
    """Label of free space, and sight, of the first view on the street that is wanted."""
    with open_pipeline(STREETS, CHANNELS) as pipeline:
        sample = pipeline.sample(_first_view(pipeline, 5, wanted))
        sight = Sight(sample, pipeline.assets)
    return _check(sample, sight), sight


def _hides_itself(height_m: Array) -> bool:
    slope = height_m / LINE_M
    return bool((slope < np.maximum.accumulate(slope) - 1e-6).mean() > 0.3)


def _sags(height_m: Array) -> bool:
    return _sag_m(LINE_M, height_m) > 0.7


def _sag_m(away_m: Array, height_m: Array) -> float:
    """Height of a parabola's ends above its middle."""
    bend = float(np.polyfit(away_m, height_m, 2)[0])
    return 0.25 * bend * float(np.ptp(away_m)) ** 2


@pytest.mark.slow
def test_free_space_before_a_crest_ends_at_it() -> None:
    """Behind the crest the carriageway goes on, hidden by itself: no label there."""
    label, sight = _checked_view(_hides_itself)
    hidden = sight.hidden_by_ground(sight.ahead_m() + np.array((0.0, 0.0, 0.02)))
    assert hidden.sum() > 20
    assert sight.away_m[label].max() < 45.0


@pytest.mark.slow
def test_free_space_in_a_dip_climbs_its_far_side() -> None:
    """Its points 10 to 60 m ahead sag between their ends, by half a metre and more."""
    label, sight = _checked_view(_sags)
    free = label & sight.clear_of_edges()
    assert sight.away_m[free].max() > 50.0
    assert _sag_m(sight.away_m[free], sight.points_m[free][:, 2]) > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("where", list(SCENES))
def test_free_space_is_the_carriageway_that_rays_meet(where: str) -> None:
    """Four views of two scenes, on slopes and cross slopes."""
    with open_pipeline(SCENES[where], CHANNELS) as pipeline:
        for index in range(4):
            sample = pipeline.sample(index)
            assert sample.scene.relief is not None
            _check(sample, Sight(sample, pipeline.assets))
