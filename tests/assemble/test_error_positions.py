"""Errors that plug-ins find themselves have the position of their entry."""

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core.errors import ConfigError

LONG = "a" * 65


@pytest.mark.parametrize(("override", "message"), [
    (f"sensors.color.name={LONG}", "--set:1:20: sensors[0].name: 'aaa"),
    (f"randomizers.clutter.name={LONG}", "--set:1:26: randomizers[0].name: 'aaa"),
    ("randomizers.distractors.name=a b", "--set:1:30: randomizers[1].name: 'a b' does not"),
    (f"elements.clutter.name={LONG}", "--set:1:23: elements[3].name: 'aaa"),
    ("exporters=[{type: coco}, {type: coco}]",
     "--set:1:33: exporters[1].type: the exporter 'coco' is listed twice; expected it once"),
    ("sensors=[rgb_camera]", "--set:1:10: sensors[0].type: expected a mapping with 'type', which "
     "names one sensor of: "),
    ("randomizers.clutter.count=1000000000", "--set:1:27: randomizers[0].count: 1000000000"),
])  # fmt: skip
def test_names_counts_and_repetitions_are_refused_when_read(override: str, message: str) -> None:
    """Names of any length were accepted, and the disk refused them after the start."""
    with pytest.raises(ConfigError) as caught:
        load_config("tabletop.yaml", overrides=[override])

    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(("override", "place", "key"), [
    ("randomizers=[{type: prop, name: tag}]", "--set:1:21: randomizers[0].type: ", "elements"),
    ("elements=[{type: weather, name: sky}]", "--set:1:18: elements[0].type: ", "randomizers"),
    ("annotations=[coco]", "--set:1:14: annotations[0]: ", "exporters"),
    ("exporters=[{type: tracks}]", "--set:1:19: exporters[0].type: ", "annotations"),
])  # fmt: skip
def test_a_plugin_in_the_wrong_list_is_told_its_list(override: str, place: str, key: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_config("tabletop.yaml", overrides=[override])

    first = str(caught.value).splitlines()[0]
    assert first.startswith(f"{place}unknown "), first
    assert first.endswith(f" is one of the '{key}'"), first


def test_a_device_that_the_machine_lacks_is_refused_with_its_place() -> None:
    """No machine has a hundred GPUs; those that exist are named."""
    config = load_config("tabletop.yaml", overrides=["render.device=cuda:99"])
    with pytest.raises(ConfigError) as caught, PipelineFactory(config, n=1)():
        pass

    assert str(caught.value).startswith(
        "--set:1:15: render.device: 'cuda:99' does not exist on this machine; it has cpu"
    )


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            "exporters=[{type: kitti}]",
            "--set:1:12: exporters[0]: exporter 'kitti': frame names have six digits, but there "
            "are 1000001 samples; expected at most 1000000",
        ),
        (
            "elements.clutter.on=floor",
            "--set:1:21: elements[3].on: there is no surface 'floor'; expected one of table",
        ),
    ],
)
def test_errors_across_plugins_are_found_before_engines_start(override: str, message: str) -> None:
    """They came from the first worker, without a position."""
    factory = PipelineFactory(load_config("tabletop.yaml", overrides=[override]), 1_000_001)

    with pytest.raises(ConfigError) as caught:
        factory.check()

    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(("override", "message"), [
    ("randomizers.pose.mode={choice: {hod: 1}}",
     "--set:1:23: randomizers[3].mode: there is no 'hod'; expected one of joints,"),
    ("randomizers.lamps.kind={choice: [sphere, sqare]}", "--set:1:24: randomizers[9].kind:"),
])  # fmt: skip
def test_names_that_may_be_drawn_are_checked_when_read(override: str, message: str) -> None:
    """The sample that drew the name ended the run."""
    with pytest.raises(ConfigError) as caught:
        load_config("tabletop.yaml", overrides=[override])

    assert str(caught.value).startswith(message)


def test_errors_that_only_a_drawn_scene_shows_have_their_place() -> None:
    """A drawn lamp is a sun, which has no flux."""
    lamps = "{type: lighting, name: lamps, kind: sun, luminous_flux_lm: 800}"
    choice = [f"randomizers.lamps={lamps}", "randomizers.clutter.count=0"]
    choice.append("randomizers.distractors.count=0")
    with (
        PipelineFactory(load_config("tabletop.yaml", overrides=choice), 1)() as pipeline,
        pytest.raises(ConfigError) as caught,
    ):
        pipeline.sample(0)

    message = "--set:1:78: randomizers[9].luminous_flux_lm: a sun has no flux; give an"
    assert str(caught.value).startswith(message), caught.value
