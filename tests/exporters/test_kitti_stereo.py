"""KITTI's stereo benchmark, read as its devkit reads it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import Modality, SensorInfo
from gen_data.core.se3 import SE3
from gen_data.exporters.cityscapes import Cityscapes
from gen_data.exporters.kitti_stereo import KittiStereo
from gen_data.sensors.camera.rgb_camera import RgbCamera
from tests.exporters.datasets import in_scene, made_of, pairs, with_sensor
from tests.exporters.drives import calibration

BASELINE_M = 0.54


def read_disparity(path: Path) -> np.ndarray:
    """As ``io_disp.h`` of the devkit: value / 256, -1 where the value is 0."""
    raw = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert raw.dtype == np.uint16
    return np.where(raw == 0, -1.0, raw / 256.0)


def read_flow(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """As ``io_flow.h`` of the devkit: (value - 2^15) / 64, and whether it is valid."""
    raw = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., ::-1]
    assert raw.dtype == np.uint16
    return (raw[..., :2].astype(float) - 2.0**15) / 64.0, raw[..., 2] > 0


tree = made_of(KittiStereo(), pairs)


def test_disparities_are_those_of_depth(tree: Path, world: Any) -> None:
    """Focal length times baseline over depth, to half of 1/256 px."""
    _, samples = world.pairs()
    for sample in (sample for sample in samples if sample.step_index < 3):
        left = sample.capture.readings["left"]
        exact = left.camera.intrinsics.fx_px * BASELINE_M / left.channels[Channel.Z_DEPTH]
        read = read_disparity(tree / f"training/disp_occ_0/{sample.index:06d}_10.png")
        there = exact > 0.0
        assert (read[~there] == -1.0).all()
        assert np.abs(read[there] - exact[there]).max() <= 0.5 / 256.0 + 1e-6
        visible = read_disparity(tree / f"training/disp_noc_0/{sample.index:06d}_10.png")
        assert (visible[:, 1::2] == -1.0).all()
        assert np.array_equal(visible[:, ::2], read[:, ::2])


def test_flow_is_there_for_every_frame_that_has_a_next_one(tree: Path) -> None:
    """To 1/128 px; nowhere in the ten rows that have none, nor, in noc, in hidden ones."""
    v, u = np.mgrid[:120, :160]
    names = {f"{k:06d}_10.png" for k in (0, 1, 2, 4, 5, 6)}
    for folder, told in (("flow_occ", v >= 10), ("flow_noc", (v >= 10) & (v % 3 != 0))):
        paths = list((tree / "training" / folder).iterdir())
        assert {p.name for p in paths} == names
        flow, valid = read_flow(paths[0])
        assert np.array_equal(valid, told)
        exact = np.stack([0.25 * u - 10.0, 0.125 * v], axis=-1)
        assert np.abs(flow[told] - exact[told]).max() <= 1.0 / 128.0


def test_points_are_in_the_right_image_at_x_minus_disparity(tree: Path, world: Any) -> None:
    """Reprojected by the calibration files alone, as users of the format do."""
    _, samples = world.pairs()
    right = samples[0].scene.camera("right")
    T_right_left = right.T_world_camera.inverse() @ samples[0].scene.camera("left").T_world_camera
    found = calibration(tree / "training/calib_cam_to_cam/000000.txt")
    P2, P3 = (found[f"P_rect_{k}"].reshape(3, 4) for k in ("02", "03"))
    focal_baseline = P2[0, 3] - P3[0, 3]
    disparity = read_disparity(tree / "training/disp_occ_0/000000_10.png")
    rows, columns = np.nonzero(disparity > 2.0)
    z = focal_baseline / disparity[rows, columns]
    x = (columns - P2[0, 2]) / P2[0, 0] * z
    y = (rows - P2[1, 2]) / P2[1, 1] * z
    # Our own pixel coordinates have centres at i + 0.5.
    seen = right.intrinsics.project(T_right_left.apply(np.stack([x, y, z], -1))) - 0.5
    assert focal_baseline == pytest.approx(P2[0, 0] * BASELINE_M)
    assert len(rows) > 1000
    assert np.abs(seen[:, 0] - (columns - disparity[rows, columns])).max() < 1e-6
    assert np.abs(seen[:, 1] - rows).max() < 1e-6


def test_every_frame_has_both_images_and_those_of_the_next_step_and_a_split(tree: Path) -> None:
    """RAFT and torchvision pair the k-th of ``*_10.png`` with the k-th of ``*_11.png``.

    The last step of a sequence has no next one; _11 of one frame is _10 of the next.
    """
    frames = (0, 1, 2, 4, 5, 6)
    for folder in ("image_2", "image_3"):
        names = {p.name for p in (tree / "training" / folder).iterdir()}
        assert names == {f"{k:06d}_{step}.png" for k in frames for step in (10, 11)}
        first, second = (
            (tree / "training" / folder / name).read_bytes()
            for name in ("000000_11.png", "000001_10.png")
        )
        assert first == second
    # The first sequence is for training, the second for validation.
    listed = {k: (tree / f"ImageSets/{k}.txt").read_text().split() for k in ("train", "val")}
    assert listed == {
        "train": [f"{k:06d}" for k in range(3)],
        "val": [f"{k:06d}" for k in range(4, 7)],
    }


def test_without_flow_the_last_step_is_a_frame_too(world: Any, tmp_path: Path) -> None:
    """A pair of images and its disparities are complete without a next step."""
    info, samples = world.pairs()
    kept = tuple(c for c in info.sensor("left").channels if not c.value.startswith("flow"))
    info = with_sensor(info, "left", channels=kept)
    root = world.export(KittiStereo(), info, samples, tmp_path)
    for folder in ("image_2", "disp_occ_0"):
        assert len(list((root / "training" / folder).glob("*_10.png"))) == 8


def test_data_sets_without_a_rectified_pair_are_refused(world: Any, tmp_path: Path) -> None:
    """No partner, two partners, a fisheye. One a hand higher than the other: rows do not match."""
    info, _ = world.pairs()
    with pytest.raises(ConfigError, match=r"right: '' is not another camera .*one of: none"):
        KittiStereo().check(replace(info, sensors=(info.sensor("left"),)))
    rear = SensorInfo("rear", Modality.CAMERA, channels=(Channel.RGB,))
    three = replace(info, sensors=(*info.sensors, rear))
    with pytest.raises(ConfigError, match="expected one of: rear, right"):
        KittiStereo().check(three)
    KittiStereo(right="right").check(three)
    bent = replace(info.sensor("right"), lens="brown_conrady")
    with pytest.raises(ConfigError, match="'right' has a lens of the model"):
        KittiStereo().check(replace(info, sensors=(info.sensor("left"), bent)))
    info, samples = world.pairs()
    scene = samples[0].scene
    low = scene.camera("right")
    up = SE3((0.0, -0.1, 0.0))
    high = replace(low, T_world_camera=low.T_world_camera @ up, T_rig_camera=low.T_rig_camera @ up)
    cameras = tuple(high if c.name == "right" else c for c in scene.cameras)
    wrong = in_scene(samples[0], cameras=cameras)
    with pytest.raises(ConfigError, match=r"'left' and 'right' are not a rectified pair: .*below"):
        world.export(KittiStereo(), info, [wrong], tmp_path)


@pytest.mark.parametrize(("right", "fits"), [("", True), ("right", True), ("far", False)])
def test_the_right_camera_is_that_of_the_disparities(right: str, fits: bool, world: Any) -> None:
    """Depth from disparity is focal length times the pair's baseline, whatever else is parallel."""
    info, _ = world.pairs()
    (left,) = (s for s in info.sensors if s.name == "left")
    others = [s for s in info.sensors if s.name != "left"]
    (partner,) = (s for s in others if s.name == "right")
    left = replace(left, stereo_with="right", channels=(*left.channels, Channel.INSTANCE))
    sensors = (left, *others, replace(partner, name="far"))
    info = replace(info, sensors=sensors)
    exporters = [KittiStereo(left="left", right=right)]
    exporters += [Cityscapes(camera="left", right=right)] if right else []
    for exporter in exporters:
        if fits:
            exporter.check(info)
        else:
            with pytest.raises(ConfigError, match=r"are to the camera 'right'.*not to 'far'"):
                exporter.check(info)


def test_a_camera_states_the_partner_of_its_disparities() -> None:
    fields: dict[str, Any] = {"name": "left", "stereo_with": "right"}
    assert RgbCamera(**fields, channels=("rgb", "disparity")).describe().stereo_with == "right"
    assert RgbCamera(**fields, channels=("rgb",)).describe().stereo_with == ""
