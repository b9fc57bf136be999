"""Fields and power lines: places, sizes and heights; roads stay free."""

from itertools import pairwise

import numpy as np
import pytest

from gen_data.content.roads import FAMILIES
from gen_data.content.scenery.farmland_things import power_pylon
from gen_data.core.errors import AssetError, ConfigError
from gen_data.core.scene import Scene
from gen_data.roads.fields_shape import FieldsShape
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.element import Element
from gen_data.scene_templates.fields import Fields
from gen_data.scene_templates.power_line import PowerLine
from gen_data.scene_templates.road import Road
from tests.libraries import library

ROAD = Road(name="main", length_m=150.0, kerb_m=0.0, sidewalk_m=(0.0, 0.0), verge_m=(1.5, 1.5))
BENT = ROAD.model_copy(update={"curvature_per_m": 0.005})


def built(*elements: Element) -> Scene:
    return build_scene("test", elements, library())


def vertices_m(scene: Scene, prefix: str) -> np.ndarray:
    """Vertices in the world of all bodies whose names begin with a prefix, [n, 3]."""
    bodies = [body for body in scene.bodies if body.name.startswith(prefix)]
    assert bodies
    return np.concatenate(
        [b.T_world_body.apply(library().mesh(b.asset).vertices_m.astype(float)) for b in bodies]
    )


@pytest.mark.parametrize("road", [ROAD, BENT], ids=["straight", "bent"])
def test_fields_lie_beside_the_road(road: Road) -> None:
    """Nothing of them, bales included, is nearer to the middle than the road's edge."""
    scene = built(road, Fields(name="land", road="main", crops=("maize", "stubble"), bales=1.0))
    points = vertices_m(scene, "land/")
    middle = road.shape().line().points(np.linspace(0.0, 150.0, 400), np.zeros(400))
    away = np.sqrt(((points[:, None, :2] - middle[None]) ** 2).sum(axis=2)).min(axis=1)

    assert away.min() >= 3.5 + 1.5 - 0.05
    assert scene.instances == ()
    assert any("bale" in body.name for body in scene.bodies)


@pytest.mark.parametrize(
    ("crop", "low", "high"),
    [("maize", 2.0, 3.0), ("wheat", 0.7, 1.0), ("rape", 1.2, 1.7), ("furrows", 0.0, 0.05)],
)
def test_crops_stand_as_high_as_real_ones(crop: str, low: float, high: float) -> None:
    """Usual heights in flower or when ripe; ploughed land is level."""
    family = FAMILIES["fields"]
    for seed in range(3):
        mesh = family.build(**{**family.parameters, "crops": crop, "seed": seed}).mesh
        assert low <= mesh.bounds_m()[1][2] <= high
        assert len(mesh.faces) <= 3000


def test_neighbouring_parcels_differ_and_fill_the_road() -> None:
    """From end to end, with gaps of at most a farm track."""
    for seed in range(6):
        parcels = FieldsShape(length_m=300.0, crops="maize_wheat_meadow", seed=seed).parcels()
        assert parcels[0].start_m == 0.0
        assert parcels[-1].end_m == 300.0
        for one, other in pairwise(parcels):
            assert one.crop != other.crop
            assert 0.0 <= other.start_m - one.end_m <= 3.0


def test_fields_that_would_meet_inside_a_bend_are_refused() -> None:
    """With the radius of the bend; unknown crops by name."""
    tight = ROAD.model_copy(update={"curvature_per_m": 0.02, "length_m": 60.0})
    with pytest.raises(ConfigError, match=r"land.depth_m: fields of 75 m .* radius is 50 m"):
        built(tight, Fields(name="land", road="main"))
    with pytest.raises(AssetError, match="barley"):
        FAMILIES["fields"].build(crops="barley")


def test_pylons_keep_clear_of_lanes_and_their_conductors_join() -> None:
    """A line across a road has no pylon on it; ends at mid-span are equal and high above it."""
    scene = built(ROAD, PowerLine(name="line", at_m=(75.0, 0.0), yaw_deg=90.0, count=3))
    feet = [b.T_world_body.translation_m for b in scene.bodies if b.name.startswith("line")]
    assert len(feet) == 3
    assert min(abs(y) for _, y, _ in feet) >= 3.5 + 20.0

    points = power_pylon(0, 280.0).mesh.vertices_m
    ends = [points[np.abs(points[:, 0] - x) < 1e-3][:, 1:] for x in (-140.0, 140.0)]
    assert len(ends[0]) == len(ends[1]) > 12
    assert np.allclose(*(np.sort(end.round(3), axis=0) for end in ends))
    # Lorries of 4 m and a discharge distance of 3 m have room below.
    assert points[np.abs(points[:, 0]) > 30.0][:, 2].min() > 7.0
    with pytest.raises(AssetError, match="span_m"):
        power_pylon(0, 500.0)
