"""The shipped dash camera: rolling rows, blur, flow and labels in the samples of a sequence."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import Sample
from gen_data.core.scene_time import scene_at
from gen_data.core.shutter import INSTANT
from gen_data.core.streams import Streams
from gen_data.pipeline import Pipeline
from gen_data.sensors.camera.image_pipeline import ImagePipeline, capture_photograph

SIZE_PX = (240, 136)


@pytest.fixture(scope="module")
def pipeline() -> Iterator[Pipeline]:
    overrides = [
        "sensors.dash.size_px=[240, 136]",
        "shared.district=arterial",
        "shared.weather=CloudyNoon",
        "randomizers.people.count=4",
    ]
    with open_pipeline(load_config("street_motion", overrides=overrides)) as opened:
        yield opened


@pytest.fixture(scope="module")
def sample(pipeline: Pipeline) -> Sample:
    return pipeline.sample(6)


@pytest.fixture(scope="module")
def following(pipeline: Pipeline, sample: Sample) -> Sample:
    return pipeline.sample(sample.index + 1)


def reading(sample: Sample) -> SensorReading:
    return sample.capture.readings["dash"]


@pytest.mark.slow
def test_every_label_of_a_rolling_image_agrees_with_it(sample: Sample) -> None:
    """Boxes and masks fit the id image, and every share is one."""
    truth, ids = sample.truth["dash"], reading(sample).channels[Channel.INSTANCE]

    assert truth.objects
    for thing in truth.objects:
        assert thing.visible_px == np.count_nonzero(ids == thing.instance.instance_id)
        assert thing.visible_fraction is not None
        assert 0.0 < thing.visible_fraction <= 1.0


@pytest.mark.slow
def test_the_camera_of_the_truth_tells_when_its_rows_were_exposed(sample: Sample) -> None:
    """The same shutter in the scene, in the reading and before annotators."""
    shutter = sample.scene.camera("dash").shutter

    assert (shutter.exposure_s, shutter.readout_s) == (0.008, 0.025)
    assert sample.truth["dash"].camera.shutter == reading(sample).camera.shutter == shutter


@pytest.mark.slow
def test_a_drive_bends_the_image_and_blurs_it(pipeline: Pipeline, sample: Sample) -> None:
    """Against a camera at the same place that sees one instant: other pixels, softer ones."""
    rolled = reading(sample)
    scene = scene_at(sample.scene, rolled.time_s)
    camera = replace(scene.camera("dash"), shutter=INSTANT)
    channels = frozenset({Channel.RGB, Channel.INSTANCE})
    stream = Streams(seed=0, scene=0).rng("dash")
    renderer = pipeline.renderer
    instant = capture_photograph(scene, renderer, camera, channels, ImagePipeline(), stream)

    def detail(image: np.ndarray) -> float:
        road = image[100:, :, 1].astype(float)
        return float(np.abs(np.diff(road, axis=0)).mean())

    others = rolled.channels[Channel.INSTANCE] != instant.channels[Channel.INSTANCE]
    middle = SIZE_PX[1] // 2
    assert others.sum() > 100
    assert others[middle - 1 : middle + 1].sum() <= 4
    assert detail(rolled.channels[Channel.RGB]) < 0.95 * detail(instant.channels[Channel.RGB])


@pytest.mark.slow
def test_flow_of_the_street_is_that_of_the_next_image(sample: Sample, following: Sample) -> None:
    """Where the point is not hidden, the next image shows the same object at its end."""
    now, then = reading(sample), reading(following)
    v, u = np.mgrid[: SIZE_PX[1], : SIZE_PX[0]] + 0.5
    flow = now.channels[Channel.FLOW_FORWARD]
    image = now.channels[Channel.INSTANCE]
    # Points at edges may fall into the pixel beside, which shows what is behind.
    edge = np.zeros(image.shape, bool)
    for axis in (0, 1):
        for step in (-1, 1):
            edge |= np.roll(image, step, axis) != image
    seen = (now.channels[Channel.FLOW_OCCLUDED_FORWARD] == 0) & ~edge
    column = np.where(seen, u + flow[..., 0], 0).astype(int)
    row = np.where(seen, v + flow[..., 1], 0).astype(int)
    ids = image[seen]
    found = then.channels[Channel.INSTANCE][row, column][seen]

    assert seen.mean() > 0.5
    # The rest are leaves and poles, narrower than the pixels of so small an image.
    assert (ids == found).mean() > 0.98


@pytest.mark.slow
def test_the_first_image_of_a_drive_is_exposed_while_things_move(pipeline: Pipeline) -> None:
    """It is read late enough, and has nothing to look back on yet."""
    first = reading(pipeline.sample(0))

    assert first.time_s - 0.5 * first.camera.shutter.open_s > 0.0
    assert np.isnan(first.channels[Channel.FLOW_BACKWARD]).all()
    assert np.isfinite(first.channels[Channel.FLOW_FORWARD]).mean() > 0.9
