"""Point tracks on disk, read and scored by the formulas of TAP-Vid and TAPVid-3D."""

import io
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.core.capture import Channel
from gen_data.core.sample import TRACK_STATES, EgoTruth, PointTracks, Sample, SensorTracks
from gen_data.exporters.tapvid import TapVid
from tests.exporters.datasets import made_of
from tests.exporters.drives import drive_info
from tests.survival import assert_survives

VISIBLE, GLASS, OCCLUDED, OUTSIDE, BEHIND = range(len(TRACK_STATES))
PLACES = np.array([[1, 1, 1], [-1, 1, 1], [1, -1, 1], [-1, -1, 1], [0, 0, 1]]) * 0.5
"""Of the points on each box, in shares of its size from the middle of its foot."""


def tracked(world: Any) -> tuple[Any, list[Sample]]:
    """The drive with five points on each box and one at the back of the cameras.

    By turns a point is visible, behind a pane or hidden; one of each box is never seen.
    """
    samples = []
    for sample in world.drive():
        things = sample.scene.instances
        sizes = [np.subtract(t.box_max_m, t.box_min_m) for t in things]
        on_things = [
            t.T_world_instance.apply(PLACES * size) for t, size in zip(things, sizes, strict=True)
        ]
        p_world = np.concatenate([*on_things, [[-500.0, 0.0, 1.0]]])
        ids = np.append(np.repeat([t.instance_id for t in things], len(PLACES)), 0)
        sensors = {
            name: seen_by(reading.camera, p_world, sample.step_index)
            for name, reading in sample.capture.readings.items()
        }
        tracks = PointTracks(ids.astype(np.uint16), p_world.astype(np.float32), sensors)
        samples.append(replace(sample, frame=EgoTruth("ego", tracks=tracks)))
    return drive_info(world), samples


def seen_by(camera: Any, p_world: NDArray[np.float64], step: int) -> SensorTracks:
    p_camera = camera.T_world_camera.inverse().apply(p_world)
    image_px = camera.intrinsics.project(p_camera)
    numbers = np.arange(len(p_world))
    state = np.choose((numbers + step) % 4, [VISIBLE, GLASS, OCCLUDED, VISIBLE])
    state[numbers % len(PLACES) == 2] = OCCLUDED
    state[((image_px < 0) | (image_px >= (160, 120))).any(axis=1)] = OUTSIDE
    state[np.isnan(image_px[:, 0])] = BEHIND
    return SensorTracks(
        p_camera.astype(np.float32),
        image_px.astype(np.float32),
        state.astype(np.uint8),
        np.where(state == OCCLUDED, 1, 0).astype(np.uint16),
    )


@pytest.fixture
def tracks(world: Any) -> list[Sample]:
    return tracked(world)[1]


folder = made_of(TapVid(), tracked)


def of(sample: Sample, camera: str) -> SensorTracks:
    assert sample.frame is not None
    assert sample.frame.tracks is not None
    return sample.frame.tracks.sensors[camera]


def problems(folder: Path, tracks: list[Sample]) -> list[str]:
    """Facts in the files that are not the samples'."""
    found = []
    for number, split in enumerate(("train", "val")):
        for camera in ("left", "right"):
            name = f"{number:06d}_{camera}"
            drive = tracks[4 * number : 4 * number + 4]
            seen = [of(sample, camera) for sample in drive]
            visible = np.stack([np.isin(t.state, (VISIBLE, GLASS)) for t in seen])
            kept = visible.any(axis=0)
            clips = pickle.loads((folder / f"tapvid/{split}/{name}.pkl").read_bytes())
            clip = clips[name]
            scene = np.load(folder / f"tapvid3d/{split}/{name}.npz")
            places = clip["points"] * [160, 120]
            expected = np.nan_to_num(np.stack([t.image_px for t in seen])[:, kept])
            poses = [sample.truth[camera].camera.T_world_camera.inverse() for sample in drive]
            k = drive[0].truth[camera].camera.intrinsics
            photographs = [s.capture.readings[camera].channels[Channel.RGB] for s in drive]
            jpegs = [
                cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
                for data in scene["images_jpeg_bytes"]
            ]
            checks = {
                "video": (clip["video"] == np.stack(photographs)).all(),
                "points": np.allclose(places.transpose(1, 0, 2), expected, atol=1e-4),
                "occluded": (clip["occluded"] == ~visible[:, kept].T).all(),
                "visibility": (scene["visibility"] == visible[:, kept]).all(),
                "places": (
                    scene["tracks_XYZ"] == np.stack([t.position_m for t in seen])[:, kept]
                ).all(),
                "calibration": np.allclose(
                    scene["fx_fy_cx_cy"], [k.fx_px, k.fy_px, k.cx_px, k.cy_px]
                ),
                "poses": np.allclose(scene["extrinsics_w2c"], [p.matrix() for p in poses]),
                "photographs": np.abs(np.stack(jpegs) - np.stack(photographs).astype(int)).mean()
                < 3.0,
            }
            found += [f"{name}: {fact}" for fact, holds in checks.items() if not holds]
    return found


def test_files_are_those_of_the_samples(folder: Path, tracks: list[Sample]) -> None:
    assert problems(folder, tracks) == []


def first_queries(clip: dict[str, Any]) -> tuple[Any, Any, Any]:
    """Frame of each query, places on 256 x 256 pixels and occlusion, as TAP-Vid's reader."""
    seen = ~clip["occluded"]
    assert seen.any(axis=1).all()
    return seen.argmax(axis=1), clip["points"] * 256.0, clip["occluded"]


def scores(
    query: Any, truth: tuple[Any, Any], guess: tuple[Any, Any], unit: Any = 1.0
) -> tuple[float, float, float]:
    """Average Jaccard, share within thresholds and occlusion accuracy after the query frame.

    The definitions of Doersch et al. 2022, section 3.3: thresholds of 1, 2, 4, 8 and 16 units.
    """
    (places, hidden), (guessed, thought_hidden) = truth, guess
    judged = np.arange(hidden.shape[1]) > query[:, None]
    jaccards, shares = [], []
    for limit in (1, 2, 4, 8, 16):
        near = np.linalg.norm(guessed - places, axis=-1) < limit * unit
        right = near & ~hidden & ~thought_hidden & judged
        false = ~thought_hidden & (hidden | ~near) & judged
        wanted = (~hidden & judged).sum()
        jaccards.append(right.sum() / (wanted + false.sum()))
        shares.append((near & ~hidden & judged).sum() / wanted)
    accuracy = (hidden == thought_hidden)[judged].mean()
    return float(np.mean(jaccards)), float(np.mean(shares)), float(accuracy)


def test_truth_as_prediction_scores_1_in_tapvid(folder: Path) -> None:
    clips = pickle.loads((folder / "tapvid/train/000000_left.pkl").read_bytes())
    query, places, hidden = first_queries(clips["000000_left"])
    truth = (places, hidden)
    assert scores(query, truth, truth) == (1.0, 1.0, 1.0)
    jaccard, share, accuracy = scores(query, truth, (places + np.array([3.0, 0.0]), hidden))
    assert share == pytest.approx(0.6)
    assert jaccard < 0.65
    assert accuracy == 1.0


def test_truth_as_prediction_scores_1_in_tapvid_3d_and_queries_are_its_first_images(
    folder: Path,
) -> None:
    """A unit of the threshold is z / f; queries are K p / z of the frame that they name."""
    scene = np.load(folder / "tapvid3d/val/000001_right.npz")
    places, hidden = scene["tracks_XYZ"].transpose(1, 0, 2), ~scene["visibility"].T
    fx, fy, cx, cy = scene["fx_fy_cx_cy"]
    frame = scene["queries_xyt"][:, 2].astype(int)
    unit = np.abs(places[..., 2]) / np.sqrt(fx * fy)
    assert scores(frame, (places, hidden), (places, hidden), unit) == (1.0, 1.0, 1.0)
    assert (frame == (~hidden).argmax(axis=1)).all()
    x, y, z = places[np.arange(len(frame)), frame].T
    expected = np.stack([fx * x / z + cx, fy * y / z + cy], axis=1)
    np.testing.assert_allclose(scene["queries_xyt"][:, :2], expected, atol=1e-3)


def test_what_stands_still_stands_still_in_the_world(folder: Path, tracks: list[Sample]) -> None:
    """The crate does, in a camera that drives; its ways leave through ``extrinsics_w2c``."""
    scene = np.load(folder / "tapvid3d/train/000000_left.npz")
    poses = np.linalg.inv(scene["extrinsics_w2c"])
    p = np.einsum("tij,tnj->tni", poses[:, :3, :3], scene["tracks_XYZ"]) + poses[:, None, :3, 3]
    assert tracks[0].frame is not None
    assert tracks[0].frame.tracks is not None
    still = np.ptp(p, axis=0).max(axis=1) < 1e-3
    seen = np.stack([np.isin(of(s, "left").state, (VISIBLE, GLASS)) for s in tracks[:4]])
    ids = tracks[0].frame.tracks.instance_id[seen.any(axis=0)]
    assert set(ids[still]) == {4}
    assert np.ptp(scene["tracks_XYZ"], axis=0).max(axis=1).min() > 0.3


def test_points_behind_panes_can_count_as_hidden(
    world: Any, tracks: list[Sample], tmp_path: Path
) -> None:
    exporter = TapVid(layouts=("tapvid",), through_glass=False)
    folder = world.export(exporter, drive_info(world), tracks, tmp_path)
    clip = pickle.loads((folder / "tapvid/train/000000_left.pkl").read_bytes())["000000_left"]
    visible = np.stack([of(sample, "left").visible for sample in tracks[:4]])
    assert (clip["occluded"] == ~visible[:, visible.any(axis=0)].T).all()
    assert not (folder / "tapvid3d").exists()


def test_a_missing_frame_ends_a_video(world: Any, tracks: list[Sample], tmp_path: Path) -> None:
    kept = [*tracks[:1], *tracks[2:4]]
    folder = world.export(TapVid(layouts=("tapvid",)), drive_info(world), kept, tmp_path)
    videos = {}
    for path in sorted((folder / "tapvid/train").glob("*_left*.pkl")):
        videos |= pickle.loads(path.read_bytes())
    assert {name: len(clip["video"]) for name, clip in videos.items()} == {
        "000000_left": 1,
        "000000_left_part1": 2,
    }


def test_pickles_name_nothing_but_the_public_constructor_of_arrays(folder: Path) -> None:
    """Private names of NumPy change from release to release."""
    names = set()

    class Names(pickle.Unpickler):
        def find_class(self, module: str, name: str) -> Any:
            names.add((module, name))
            return super().find_class(module, name)

    Names(io.BytesIO((folder / "tapvid/train/000000_left.pkl").read_bytes())).load()
    assert names == {("numpy", "ndarray")}


def test_annotations_survive_their_line_of_labels(tracks: list[Sample]) -> None:
    assert_survives(tracks[0].frame)
