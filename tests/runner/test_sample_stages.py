"""The first stage that differs is named, and decoded contents are told apart from bytes."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.runner.diff import compare
from gen_data.runner.regeneration import write_alone
from gen_data.runner.run import Settings
from gen_data.runner.sample_stages import STAGES, SampleFiles, compare_samples
from tests.runner.doubles import HEIGHT_PX, WIDTH_PX, FakePipeline, Trouble, fake_sample, make

INDEX = 3


def make_sample() -> Sample:
    sample = fake_sample(INDEX)
    reading = sample.capture.readings["color"]
    depth_m = np.full((HEIGHT_PX, WIDTH_PX), 1.5, np.float32)
    images = {**reading.channels, Channel.Z_DEPTH: depth_m}
    readings = {"color": replace(reading, channels=images)}
    return replace(sample, capture=replace(sample.capture, readings=readings))


class OneSample:
    exporters = FakePipeline(1, Trouble()).exporters

    def __init__(self, sample: Sample) -> None:
        self._sample = sample

    @property
    def info(self) -> DatasetInfo:
        info = FakePipeline(10, Trouble()).info
        color = replace(info.sensors[0], channels=(Channel.RGB, Channel.Z_DEPTH))
        return replace(info, sensors=(color,))

    def sample(self, index: int) -> Sample:
        assert index == INDEX
        return self._sample


def write(sample: Sample, folder: Path) -> SampleFiles:
    folder.mkdir()
    return write_alone(OneSample(sample), INDEX, folder)


def brighter_sun(sample: Sample) -> Sample:
    sun = replace(sample.scene.lights[0], illuminance_lux=1.0)
    return replace(sample, scene=replace(sample.scene, lights=(sun,)))


def nearer_pixel(sample: Sample) -> Sample:
    sample.capture.readings["color"].channels[Channel.Z_DEPTH][2, 3] = 1.4
    return sample


def redder_pixel(sample: Sample) -> Sample:
    sample.capture.readings["color"].channels[Channel.RGB][2, 3, 0] ^= 1
    return sample


def occluded_object(sample: Sample) -> Sample:
    image = sample.truth["color"]
    return replace(
        sample, truth={"color": replace(image, objects=(replace(image.objects[0], occlusion=0.5),))}
    )


@pytest.mark.parametrize(
    ("change", "stage", "text"),
    [(brighter_sun, "scene", r"scene\.lights\[0\]\.illuminance_lux: was [\d.]+, now 1\.0"),
     (nearer_pixel, "geometry", r"color/depth/000000003\.png: 1 of 48 pixels differ, by 1000"),
     (redder_pixel, "render", r"color/rgb/000000003\.png: 1 of 48 pixels differ, by 1 at most"),
     (occluded_object, "labels", r"truth\.color\.objects\[0\]\.occlusion")],
)  # fmt: skip
def test_the_first_differing_stage_is_named(
    tmp_path: Path, change: Callable[[Sample], Sample], stage: str, text: str
) -> None:
    """With the field or file, in both the comparison and the digests."""
    one = write(make_sample(), tmp_path / "one")
    other = write(change(make_sample()), tmp_path / "other")
    found = compare_samples(one, other)
    assert found is not None
    assert (found.index, found.stage) == (INDEX, stage)
    assert re.search(text, found.text), found.text
    digests = one.digests(), other.digests()
    assert next(s for s in STAGES if digests[0][s] != digests[1][s]) == stage


def test_other_bytes_for_the_same_pixels_are_a_matter_of_the_encoder(tmp_path: Path) -> None:
    """They are equal in a semantic comparison."""
    one = write(make_sample(), tmp_path / "one")
    other = write(make_sample(), tmp_path / "other")
    assert compare_samples(one, other) is None
    path = tmp_path / "other/color/rgb/000000003.png"
    cv2.imwrite(str(path), cv2.imread(str(path)), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    found = compare_samples(one, other)
    assert found is not None
    assert found.stage == "encode"
    assert compare_samples(one, other, semantic=True) is None


def test_data_sets_are_compared_by_plan_sample_and_export(tmp_path: Path) -> None:
    """The difference of the plans comes first, then the first sample's."""
    make(tmp_path / "one", settings=Settings())
    make(tmp_path / "two", shard_size=3, settings=Settings())
    assert compare(tmp_path / "one", tmp_path / "one").equal
    result = compare(tmp_path / "one", tmp_path / "two", semantic=True)
    assert result.equal
    assert result.plan == ("shard_size: was 4, now 3",)
    path = tmp_path / "two/shards/000002/labels.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    lines[1]["truth"]["color"]["objects"][0]["visible_px"] += 1
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    result = compare(tmp_path / "one", tmp_path / "two")
    assert result.sample is not None
    assert (result.sample.index, result.sample.stage) == (7, "labels")
    assert "visible_px" in result.sample.text
