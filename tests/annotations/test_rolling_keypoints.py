"""Keypoints behind a rolling shutter, against a point that moves evenly."""

from dataclasses import replace

import numpy as np
import pytest

from gen_data.annotations.keypoints import Keypoints
from gen_data.annotations.lanes import Lanes
from gen_data.core.asset_types import Keypoint
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.motion import Trajectory
from gen_data.core.sample import ImageTruth, KeypointTruth, ObjectTruth
from gen_data.core.scene import Body, Camera, Instance, Lane, Rig, Scene
from gen_data.core.se3 import SE3, look_at
from gen_data.core.shutter import INSTANT, Shutter

LENS = Intrinsics(100, 80, 100.0, 100.0, 50.0, 40.0)
SPEED_M_S = 5.0


def seen(v_px: float, shutter: Shutter) -> KeypointTruth:
    """A point 2 m away that moves to the right at 250 px/s and is at u = 50 px now."""
    camera = Camera("c", SE3(), LENS, shutter=shutter)
    tip = Keypoint("tip", (0.0, (v_px - 40.0) * 0.02, 0.0))
    thing = Instance(1, "t", "t", 1, "t", T_world_instance=SE3((0.0, 0.0, 2.0)), keypoints=(tip,))
    track = Trajectory(
        "t", 1.0, (SE3((-5.0, 0.0, 2.0)), SE3((0.0, 0.0, 2.0)), SE3((5.0, 0.0, 2.0))), -1.0
    )
    scene = Scene(
        "t", bodies=(Body("t", "t", SE3((0.0, 0.0, 2.0)), instance_id=1),), instances=(thing,),
        cameras=(camera,), tracks=(track,),
    )  # fmt: skip
    shape = (80, 100)
    channels = {
        Channel.INSTANCE: np.ones(shape, np.uint16),
        Channel.RANGE: (2.0 / LENS.pixel_rays()[..., 2]).astype(np.float32),
        Channel.NORMALS: np.broadcast_to(np.float32([0, 0, -1]), (*shape, 3)),
    }
    truth = ObjectTruth(thing, visible_px=8000, box=None)
    (point,) = (
        Keypoints().annotate(scene, SensorReading("c", camera, channels), truth).keypoints or ()
    )
    return point


@pytest.mark.parametrize("v_px", [5.0, 40.0, 70.0])
@pytest.mark.parametrize("readout_s", [0.04, -0.04])
def test_a_keypoint_is_where_its_row_shows_it(v_px: float, readout_s: float) -> None:
    """At 50 px plus 250 px/s times its row's delay; in space, where it is at the instant."""
    point = seen(v_px, Shutter(0.0, readout_s))

    expected = 50.0 + 250.0 * readout_s * (v_px / 80.0 - 0.5)
    assert point.image_px == pytest.approx((expected, v_px), abs=1e-6)
    assert point.position_m == pytest.approx((0.0, (v_px - 40.0) * 0.02, 2.0))
    assert point.visibility == 2


def test_exposure_alone_moves_no_keypoint() -> None:
    """Labels refer to its middle."""
    assert seen(10.0, Shutter(exposure_s=0.1)) == seen(10.0, INSTANT)


def test_borders_of_lanes_bend_with_the_rows() -> None:
    """A camera that drives sideways over a straight lane: its border leans as rows are read."""
    pose = look_at((0.0, 0.0, 1.5), (10.0, 0.0, 0.0))
    lane = Lane("a", "driving", ((1.0, 0.0, 0.0), (60.0, 0.0, 0.0)), 3.0)
    knots = tuple(SE3((0.0, y, 0.0)) for y in (-SPEED_M_S, 0.0, SPEED_M_S))
    camera = Camera("c", pose, LENS, rig="eye", T_rig_camera=pose)
    scene = Scene(
        "t", bodies=(Body("car", "car"),), rigs=(Rig("eye", "car"),), lanes=(lane,),
        tracks=(Trajectory("car", 1.0, knots, -1.0),),
    )  # fmt: skip
    far = {Channel.RANGE: np.full((80, 100), 1e3, np.float32)}

    def border(shutter: Shutter) -> dict[int, float]:
        at = replace(camera, shutter=shutter)
        truth = Lanes(step_px=1.0).annotate_image(
            scene,
            None,
            SensorReading("c", at, far),
            ImageTruth(at, ()),  # type: ignore[arg-type]
        )
        assert truth.borders
        return {round(v): u for u, v in truth.borders[0].points_px}

    straight, rolled = border(INSTANT), border(Shutter(0.0, 0.05))
    rows = sorted(straight.keys() & rolled.keys())
    assert len(rows) > 20
    for v in rows:
        # The depth of the ground at that row, by similar triangles along the axis of the camera.
        down = np.array([(0.0, (v - 40.0) / 100.0, 1.0)])
        depth_m = -1.5 / pose.rotate(down)[0, 2]
        expected = 100.0 / depth_m * SPEED_M_S * 0.05 * (v / 80.0 - 0.5)
        assert rolled[v] - straight[v] == pytest.approx(expected, abs=0.8)
