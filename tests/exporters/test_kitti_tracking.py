"""KITTI tracking: labels, sequences and calibration."""

from typing import Any

import pytest

from gen_data.exporters.kitti_tracking import KittiTracking, truncation_level
from tests.exporters.drives import FRAMES, calibration, stems


def test_tracking_labels_last_and_fall_into_their_boxes_by_the_calibration(exported: Any) -> None:
    """Frames from 0, ids of the instances, whole numbers for truncation."""
    folder = exported(KittiTracking(low_px=4)) / "training"
    rows = [line.split(" ") for line in (folder / "label_02/0001.txt").read_text().splitlines()]
    assert {len(row) for row in rows} == {17}
    assert [row[0] for row in rows if row[1] == "1"] == ["0", "1", "2", "3"]
    assert {(row[1], row[2]) for row in rows} == {
        ("1", "Car"), ("2", "Pedestrian"), ("4", "Misc")
    }  # fmt: skip
    assert {row[3] for row in rows} <= {"0", "1", "2"}
    assert {tuple(map(float, row[10:13])) for row in rows if row[1] == "1"} == {(1.5, 1.8, 4.0)}
    # The centre of every 3D box falls into its 2D box, by P2; line names are KITTI's.
    calib = calibration(folder / "calib/0000.txt")
    assert list(calib) == ["P0", "P1", "P2", "P3", "R_rect", "Tr_velo_cam", "Tr_imu_velo"]
    assert calib["Tr_imu_velo"].reshape(3, 4)[:, 3] == pytest.approx([0.0, 0.0, -1.73])
    rows = [line.split(" ") for line in (folder / "label_02/0000.txt").read_text().splitlines()]
    assert len(rows) == 12
    for row in rows:
        left, top, right, bottom, height, _, _, x, y, z = map(float, row[6:16])
        u, v, w = calib["P2"].reshape(3, 4) @ [x, y - 0.5 * height, z, 1.0]
        assert left <= u / w <= right
        assert top <= v / w <= bottom


def test_tracking_lists_sequences_by_split(exported: Any) -> None:
    """TrackEval's lists; images and scans from 0, six digits."""
    folder = exported(KittiTracking(right_camera="right")) / "training"
    lists = {k: (folder / f"evaluate_tracking.seqmap.{k}").read_text() for k in ("train", "val")}
    assert lists == {"train": "0000 empty 000000 000004\n", "val": "0001 empty 000000 000004\n"}
    both = (folder / "evaluate_tracking.seqmap.training").read_text()
    assert both == lists["train"] + lists["val"]
    for kind in ("image_02", "image_03", "velodyne"):
        assert stems(folder / kind / "0001") == FRAMES
    assert len((folder / "oxts/0001.txt").read_text().splitlines()) == 4


@pytest.mark.parametrize(("share", "level"), [(0.0, 0), (0.15, 0), (0.2, 1), (0.5, 1), (0.6, 2)])
def test_truncation_has_three_levels(share: float, level: int) -> None:
    """KITTI's easy and hard limits are 15 and 50 per cent."""
    assert truncation_level(share) == level
