"""Control clips: signals against the readings they come from, and the layouts of their readers."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.exporters.control_clips import ControlClips, inverse_depth
from tests.exporters.datasets import made_of
from tests.exporters.label_readers import json_lines

FIXED = ControlClips(near_m=5.0, far_m=60.0)


def image(path: Path) -> Any:
    pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert pixels is not None, f"{path} is missing"
    return pixels if pixels.ndim == 2 else pixels[..., ::-1]


def problems(root: Path, samples: list[Any], camera: str = "color") -> Iterator[str]:
    splits = sorted(root.iterdir())
    listed = [(split, row) for split in splits for row in json_lines(split / "metadata.jsonl")]
    by_sample = {}
    for split, row in listed:
        clip = json.loads((split / row["clip"] / "clip.json").read_text())
        by_sample[clip["samples"][row["frame"]]] = (split, row, clip)
    if sorted(by_sample) != [s.index for s in samples]:
        yield "other samples"
        return
    for sample in samples:
        split, row, clip = by_sample[sample.index]
        for text in wrong_frame(split, row, clip, sample.capture.readings[camera].channels):
            yield f"sample {sample.index}: {text}"
        if split.name != sample.split:
            yield f"sample {sample.index}: split"


def wrong_frame(split: Path, row: Any, clip: Any, channels: Any) -> Iterator[str]:
    rgb = image(split / row["image_file_name"])
    if not np.array_equal(rgb, channels[Channel.RGB]):
        yield "image"
    near, far = (clip["depth"][key][row["frame"]] for key in ("near_m", "far_m"))
    grey = image(split / row["depth_file_name"]).astype(float)
    # Depth that a grey value stands for; within half a step of it.
    inverse = grey / 255.0 * (1.0 / near - 1.0 / far) + 1.0 / far
    truth = np.clip(1.0 / channels[Channel.Z_DEPTH].astype(float), 1.0 / far, 1.0 / near)
    if (np.abs(inverse - truth) > 0.51 / 255.0 * (1.0 / near - 1.0 / far) + 1e-4).any():
        yield "depth"
    colors = image(split / row["segmentation_file_name"]).reshape(-1, 3)
    ids = channels[Channel.INSTANCE].reshape(-1)
    pairs = {(int(i), *map(int, c)) for i, c in zip(ids, colors, strict=True)}
    if len(pairs) != len(np.unique(ids)) or len({p[1:] for p in pairs}) != len(pairs):
        yield "segmentation"
    if colors[ids == 0].any():
        yield "background is not black"
    grey_rgb = cv2.cvtColor(np.ascontiguousarray(rgb), cv2.COLOR_RGB2GRAY)
    low, high = clip["edges"]["canny_low"], clip["edges"]["canny_high"]
    if not np.array_equal(image(split / row["edges_file_name"]), cv2.Canny(grey_rgb, low, high)):
        yield "edges"


dataset = made_of(ControlClips())


def test_signals_follow_from_the_images(dataset: Path, world: Any) -> None:
    """Depth within half a grey value, one colour per instance, edges of the written image."""
    assert list(problems(dataset, world.samples)) == []


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_hugging_face_reads_images_and_text(
    dataset: Path, world: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Columns of train_controlnet.py: image, conditioning images by name, text."""
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    from datasets import load_dataset

    train = load_dataset(str(dataset), split="train", cache_dir=str(tmp_path))
    rows = json_lines(dataset / "train/metadata.jsonl")
    samples = [sample for sample in world.samples if sample.split == "train"]
    assert len(train) == len(samples)
    for row, listed, sample in zip(train, rows, samples, strict=True):
        rgb = sample.capture.readings["color"].channels[Channel.RGB]
        np.testing.assert_array_equal(np.asarray(row["image"]), rgb)
        for kind in ("depth", "segmentation", "edges"):
            expected = image(dataset / "train" / listed[f"{kind}_file_name"])
            np.testing.assert_array_equal(np.asarray(row[kind]), expected)
        assert row["text"] == listed["text"]


def test_a_sequence_is_one_clip(world: Any, samples: Any, tmp_path: Path) -> None:
    """With videos of the same frames and bytes in every run, and parameters that name them."""
    exporter = FIXED.model_copy(update={"video": True, "camera": "left", "edges_weight": 1.0})
    info = world.info(8, ("left", "right"), steps_per_scene=4)
    root, again = (world.export(exporter, info, samples, tmp_path / name) for name in "ab")
    videos = sorted(p.relative_to(root) for p in root.rglob("*.mp4"))
    assert len(videos) == 8
    assert all((root / p).read_bytes() == (again / p).read_bytes() for p in videos)
    assert list(problems(root, samples, "left")) == []
    clip = root / "val/000001"
    facts = json.loads((clip / "clip.json").read_text())
    assert (facts["rate_hz"], facts["samples"]) == (10.0, [4, 5, 6, 7])
    assert facts["depth"]["near_m"] == [5.0] * 4
    parameters = json.loads((clip / "cosmos_transfer.json").read_text())
    assert parameters["prompt"] == (clip / "caption.txt").read_text().strip()
    weights = {k: parameters[k]["control_weight"] for k in ("depth", "seg", "edge")}
    assert weights == {"depth": 0.5, "seg": 0.5, "edge": 1.0}
    names = {"rgb": parameters["video_path"], "depth": parameters["depth"]["control_path"],
             "segmentation": parameters["seg"]["control_path"],
             "edges": parameters["edge"]["control_path"]}  # fmt: skip
    for kind, name in names.items():
        video = cv2.VideoCapture(str(clip / name))
        assert video.get(cv2.CAP_PROP_FPS) == 10.0
        for k in range(4):
            read, pixels = video.read()
            expected = cv2.imread(str(clip / kind / f"{k:06d}.png"))
            assert read and pixels.shape == expected.shape
            assert np.abs(pixels.astype(int) - expected).mean() < 8
        assert not video.read()[0]


@pytest.mark.parametrize(
    ("depth", "given", "pixels", "span"),
    [([1.0, 2.0, 4.0, np.inf, 0.5, 9.0], (1.0, 4.0), [255, 85, 0, 0, 255, 0], (1.0, 4.0)),
     ([2.0, 4.0, np.inf], None, [255, 0, 0], (2.0, 4.0)),
     ([3.0, 3.0], None, [255, 255], (3.0, 3.0)), ([np.inf, np.inf], None, [0, 0], (0.0, 0.0))],
    ids=["given", "its own", "a wall parallel to the image", "an empty sky"],
)  # fmt: skip
def test_greys_are_linear_in_one_over_depth(depth: Any, given: Any, pixels: Any, span: Any) -> None:
    """White at the near end, black at the far end and where there is nothing."""
    found, used = inverse_depth(np.array([depth], np.float32), given)
    assert (found.tolist(), used) == ([pixels], span)


@pytest.mark.parametrize(
    ("place", "nearest_m", "farthest_m"),
    [("table", 0.6, 2.5), ("room", 0.7, 8.0), ("street", 4.0, 90.0)],
)
def test_the_suggested_range_of_a_sequence_uses_most_greys(
    world: Any, place: str, nearest_m: float, farthest_m: float
) -> None:
    """Of usual depths in each kind of scene: at least 160 of 255 levels."""
    with pytest.raises(ConfigError) as caught:
        ControlClips().check(world.info(8, steps_per_scene=4))
    (found,) = re.findall(rf"near_m: ([0-9.]+), far_m: ([0-9]+) \([^)]*{place}", str(caught.value))
    near_m, far_m = map(float, found)
    (dark, light), _ = inverse_depth(np.array([farthest_m, nearest_m], np.float32), (near_m, far_m))
    assert int(light) - int(dark) >= 160


def test_categories_have_a_colour_each(world: Any, tmp_path: Path) -> None:
    exporter = ControlClips(segmentation="category")
    root = world.export(exporter, world.info(1), world.samples[:1], tmp_path)
    colors = image(root / "train/000000/segmentation/000000.png")
    ids = world.samples[0].capture.readings["color"].channels[Channel.CATEGORY]
    assert len(np.unique(colors.reshape(-1, 3), axis=0)) == len(np.unique(ids))
