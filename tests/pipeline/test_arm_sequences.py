"""Samples of a sequence in which an arm carries something."""

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import Channel
from gen_data.core.sample import Sample
from gen_data.core.serialization import canonical_json

SMALL = (
    "sensors.color.size_px=[96,72]", "sensors.wrist.size_px=[96,72]", "steps_per_scene=10",
    "step_s=0.7",
)  # fmt: skip


@pytest.fixture(scope="module")
def sequence() -> list[Sample]:
    with open_pipeline(load_config("tabletop_sequence.yaml", overrides=SMALL)) as pipeline:
        return [pipeline.sample(index) for index in range(10)]


@pytest.mark.slow
def test_a_sample_alone_equals_the_one_in_its_sequence(sequence: list[Sample]) -> None:
    """Scene, image and labels of the seventh instant."""
    with open_pipeline(load_config("tabletop_sequence.yaml", overrides=SMALL)) as pipeline:
        alone = pipeline.sample(7)

    assert canonical_json(alone.scene) == canonical_json(sequence[7].scene)
    assert _boxes(alone) == _boxes(sequence[7])
    images = [s.capture.readings["color"].channels[Channel.RGB] for s in (alone, sequence[7])]
    assert images[0].tobytes() == images[1].tobytes()


@pytest.mark.slow
def test_the_robots_box_follows_its_arm_and_what_is_carried_follows_the_hand(
    sequence: list[Sample],
) -> None:
    """The robot's box changes while its base stands; one object ends elsewhere, all others stay."""
    boxes = {s.scene.instance(_robot(s)).box_max_m for s in sequence}
    bases = {s.scene.instance(_robot(s)).T_world_instance for s in sequence}
    first, last = sequence[0].scene, sequence[-1].scene
    moved = [
        body.name
        for body, then in zip(first.bodies, last.bodies, strict=True)
        if body.group and body.T_world_body != then.T_world_body
    ]

    assert len(boxes) > 5
    assert len(bases) == 1
    assert len(moved) == 1
    assert moved[0] in sequence[0].scene.articulations[0].task[0].objects


def _boxes(sample: Sample) -> list[object]:
    return [
        (sensor, seen.instance.instance_id, seen.box, seen.amodal_box, seen.box3d_camera)
        for sensor, truth in sorted(sample.truth.items())
        for seen in truth.objects
    ]


def _robot(sample: Sample) -> int:
    return sample.scene.articulations[0].instance_id
