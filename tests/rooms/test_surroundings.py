"""Surroundings outside rooms, blinds at their windows and water from their taps."""

import math

import numpy as np
import pytest

from gen_data.config import distributions as dist
from gen_data.core.scene import Body, Scene
from gen_data.core.streams import Streams
from gen_data.randomizers.furnish import Furnish
from gen_data.randomizers.object_states import ObjectStates
from gen_data.randomizers.room_lighting import RoomLighting
from gen_data.rooms.outlook import outlook_assets
from tests.rooms.test_layouts import family, floors, furnished, heights_m, library, outline

ON, OFF = dist.Constant(True), dist.Constant(False)


def outside(scene: Scene) -> list[Body]:
    return [b for b in scene.bodies if b.name.startswith("room/outside")]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["apartment", "kitchen", "warehouse"])
def test_surroundings_stand_on_one_ground_outside_all_rooms(kind: str) -> None:
    """Everything is at the ground's height, a metre away from every floor, and has no label."""
    for seed in range(4):
        scene = furnished(kind, seed)
        ground, *things = outside(scene)
        level = heights_m(ground)[1]

        assert len(things) >= 10
        assert level <= -0.29
        for body in things:
            assert body.instance_id == 0
            assert body.asset in outlook_assets()
            assert body.T_world_body.translation_m[2] == pytest.approx(level, abs=1e-5)
            x, y = outline(body).T
            for x0, x1, y0, y1 in floors(scene):
                apart = max(x0 - x.max(), x.min() - x1, y0 - y.max(), y.min() - y1)
                assert apart > 1.0, (seed, body.asset)


@pytest.mark.slow
def test_assets_of_surroundings_are_announced() -> None:
    """Plans list them, so that their content is in the data set's identity."""
    possible = set(Furnish(name="f").possible_assets(library()))

    assert set(outlook_assets()) <= possible


@pytest.mark.slow
def test_blinds_hang_within_the_frames_of_their_windows() -> None:
    """Below the upper edge, above the sill, in the reveal."""
    found = 0
    for seed in range(6):
        scene = furnished("bedroom", seed)
        for blind in (b for b in scene.bodies if family(b) == "blind"):
            window = scene.body(blind.name.replace("blind_", "window_"))
            (low, high), (bottom, top) = heights_m(window), heights_m(blind)
            found += 1

            assert low < bottom < top <= high + 1e-4
            local = window.T_world_body.inverse() @ blind.T_world_body
            assert abs(local.translation_m[1]) < 1e-4
            assert math.hypot(*local.translation_m[:2]) < 0.1
    assert found > 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "piece"), [("kitchen", "kitchen_sink"), ("bathroom", "wash_basin")]
)
def test_running_taps_are_stated_and_seen(kind: str, piece: str) -> None:
    """Water falls from above the basin to its bottom; without it the label is off."""
    scene = furnished(kind, 1)
    runs, off = (
        ObjectStates(name="s", runs=flag)(scene, library(), Streams(5, 1).rng("s"))
        for flag in (ON, OFF)
    )
    sink = next(b for b in scene.bodies if family(b) == piece)
    water = [
        b for b in runs.bodies if family(b) == "tap_stream" and b.instance_id == sink.instance_id
    ]

    assert len(water) == 1
    assert dict(runs.instance(sink.instance_id).attributes)["state"] == "on"
    assert dict(off.instance(sink.instance_id).attributes)["state"] == "off"
    assert not any(family(b) == "tap_stream" for b in off.bodies)
    bottom, mouth = heights_m(water[0])
    # Spouts bend down by up to 8 cm.
    assert heights_m(sink)[1] - 0.08 < mouth < heights_m(sink)[1]
    assert 0.7 < bottom < 0.9


@pytest.mark.slow
def test_vessels_say_whether_they_are_full() -> None:
    """Their assets name their contents."""
    stated = [
        (dict(i.attributes)["full"], bool(dict(library().get(i.asset).attributes).get("contents")))
        for seed in range(6)
        for i in furnished("kitchen", seed).instances
        if "full" in dict(i.attributes)
    ]

    assert {full for full, _ in stated} == {"0", "1"}
    assert all((full == "1") == contents for full, contents in stated)


@pytest.mark.slow
def test_doors_that_lead_nowhere_stay_closed() -> None:
    """Of an apartment, one door is its entrance; all others may open."""
    scene = ObjectStates(name="s", is_open=ON)(
        furnished("apartment", 1), library(), Streams(5, 1).rng("s")
    )
    doors = [dict(i.attributes) for i in scene.instances if i.category == "door"]
    entrances = [d for d in doors if "leads_out" in d]

    assert [d["open"] for d in entrances] == ["0"]
    assert max(float(d["open"]) for d in doors) > 0.0


@pytest.mark.slow
def test_light_inside_is_that_of_volumes_and_outside_that_of_the_sky() -> None:
    """One volume per room and window, and by day a sky that is as bright as was drawn."""
    scene = furnished("apartment", 1)
    lit = RoomLighting(name="l", night=OFF, daylight_cd_m2=dist.Constant(900.0))(
        scene, library(), Streams(5, 1).rng("l")
    )
    sky = lit.environment

    assert sky.luminance_cd_m2 == 900.0
    assert sky.visible
    windows = sum(family(b) == "window" for b in scene.bodies)
    assert len(floors(scene)) == 4
    assert len(sky.volumes) == len(floors(scene)) + windows
    for volume in sky.volumes:
        assert np.prod(volume.counts) * 18 == len(volume.light_cd_m2)
        assert min(volume.light_cd_m2) >= 0.0
        assert max(volume.light_cd_m2) > 0.0
