"""Occupancy on contact sheets and in Rerun."""

import numpy as np

from gen_data.core.asset_types import SURFACES
from gen_data.core.capture import Capture
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import EgoTruth, Occupancy, Sample
from gen_data.core.scene import Instance, Scene
from gen_data.core.se3 import SE3
from gen_data.exporters.label_colors import SURFACE_COLORS, id_color
from gen_data.preview.contact_sheet import make_tiles
from tests.preview.recorded import recorded

CAR = Instance(5, "car/5", "car", 2, "car")


def sample(observed: bool = True) -> Sample:
    """Grass of 20 x 10 voxels, 1 m each, ahead of the ego; on it a car of 4 x 2 x 1 voxels."""
    state, ids = np.zeros((20, 10, 4), np.uint8), np.zeros((20, 10, 4), np.uint16)
    state[:, :, 0], state[8:12, 4:6, 1] = 1, 1
    ids[8:12, 4:6, 1] = CAR.instance_id
    surface = np.where(ids + state == 1, SURFACES.index("grass"), 0).astype(np.uint8)
    seen = {"top": np.full(state.shape, observed)}
    grid = Occupancy(SE3((3.0, 0.0, 0.0)), (0.0, -5.0, 0.0), 1.0, state, ids, surface, seen)
    frame = EgoTruth("ego", occupancy=grid)
    scene = Scene("s", instances=(CAR,))
    return Sample(0, 0, 0, "train", scene, Capture({}), {}, frame=frame)


def test_voxels_are_drawn_in_the_colour_of_their_class_and_darker_where_nobody_sees_them() -> None:
    """The tops of car and grass have the palette's colours, and an area as 8 is to 192."""
    (tile,) = make_tiles([sample()], {}, labels=True)
    assert tile.caption == "occupancy"
    pixels = tile.image.reshape(-1, 3)
    car = (pixels == id_color(CAR.category_id)).all(axis=1).sum()
    grass = (pixels == SURFACE_COLORS["grass"]).all(axis=1).sum()
    # The car hides one row of grass behind it.
    assert 190.0 / 8.0 - 2.0 < grass / car < 192.0 / 8.0
    (dark,) = make_tiles([sample(observed=False)], {}, labels=True)
    assert not (dark.image.reshape(-1, 3) == SURFACE_COLORS["grass"]).all(axis=1).any()
    assert (dark.image.any(axis=-1) == tile.image.any(axis=-1)).mean() > 0.99


def test_rerun_has_a_box_for_each_voxel_with_a_surface_in_the_frame_of_the_grid() -> None:
    stream = recorded(sample(), info=DatasetInfo("t", 1, 1, 1, ("person", "car"), ()))
    (pose,) = stream.at("world/occupancy")
    (boxes,) = stream.at("world/occupancy/voxels")
    assert pose.translation.as_arrow_array().to_pylist() == [[3.0, 0.0, 0.0]]
    centers = np.array(boxes.centers.as_arrow_array().to_pylist())
    assert len(centers) == 20 * 10 + 4 * 2
    assert centers.min(axis=0).tolist() == [0.5, -4.5, 0.5]
    assert centers.max(axis=0).tolist() == [19.5, 4.5, 1.5]
