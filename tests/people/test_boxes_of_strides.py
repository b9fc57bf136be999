"""3D boxes of people as annotators of tracks draw them: with room for a whole stride."""

import numpy as np
import pytest

from gen_data.core.scene import Body, Box3dExtent, Instance, Scene
from gen_data.core.se3 import SE3
from gen_data.pipeline.finalize_scene import finalize_scene
from tests.libraries import library


def person(pose: str, phase: float, box3d: Box3dExtent, seed: int = 3) -> Instance:
    asset = f"simple_person?phase={phase}&pose={pose}&seed={seed}"
    body = Body("person", asset, SE3(), instance_id=1)
    known = Instance(1, "person", "person", 0, asset)
    scene = Scene("test", bodies=(body,), instances=(known,), box3d=box3d)
    return finalize_scene(scene, library(), {"person": 1}).instances[0]


@pytest.mark.parametrize("pose", ["walk", "run"])
def test_a_person_has_one_box_all_along_a_stride_and_never_leaves_it(pose: str) -> None:
    """KITTI's and nuScenes' tracks have one size each; tight boxes change with every step."""
    wide = [person(pose, k / 16, "annotated").box3d for k in range(16)]
    tight = [person(pose, k / 16, "body") for k in range(16)]

    assert len({box.size_m for box in wide}) == 1
    assert len({one.box3d.size_m[0] for one in tight}) >= 8
    (length_m, width_m, _), (x, y, _) = wide[0].size_m, wide[0].T_frame_box.translation_m
    for one in tight:
        assert one.box_min_m[0] >= x - 0.5 * length_m
        assert one.box_max_m[0] <= x + 0.5 * length_m
        assert one.box_min_m[1] >= y - 0.5 * width_m
        assert one.box_max_m[1] <= y + 0.5 * width_m


def test_boxes_of_walking_people_are_as_large_as_those_of_annotators() -> None:
    """Mean sizes of KITTI's pedestrians (Frustum PointNets, CVPR 2018): .844 x .661 m.

    Of eight people, four of whom barely move their feet: within a tenth.
    """
    poses = ("walk", "walk_fast", "stroll", "stand") * 2
    sizes_m = [person(pose, 0.3, "annotated", seed).box3d.size_m for seed, pose in enumerate(poses)]

    np.testing.assert_allclose(np.mean(sizes_m, axis=0)[:2], (0.844, 0.661), rtol=0.1)


def test_people_who_stand_get_the_margin_alone() -> None:
    """5 cm on each side and above."""
    tight, wide = (person("stand", 0.0, extent).box3d.size_m for extent in ("body", "annotated"))

    assert np.subtract(wide, tight) == pytest.approx((0.1, 0.1, 0.05), abs=1e-6)


def test_the_part_of_an_annotated_box_that_geometry_fills_is_the_tight_box() -> None:
    tight, wide = (person("walk", 0.3, extent) for extent in ("body", "annotated"))

    assert wide.tight_box3d == tight.box3d == tight.tight_box3d
    assert wide.tight_box3d != wide.box3d
