"""Every task of the table is demonstrated, and physics confirms it."""

from __future__ import annotations

import pytest

from gen_data.generator.assemble.config import load_config
from gen_data.generator.assemble.pipeline_factory import open_pipeline
from gen_data.generator.core.sample import Sample
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.serialization import canonical_json
from gen_data.randomizers.arm_task_table import tasks

pytest.importorskip("pybullet_data")

SMALL = ("sensors.color.size_px=[96,72]", "sensors.wrist.size_px=[96,72]")
NONE_FAIL = ("randomizers.things.failures={}", "shared.robot=franka_panda")


def demonstrated(task: str, scene_index: int = 0, failures: str = "{}") -> Scene:
    """A scene of one task, at time 0."""
    changes = (f"shared.task={task}", f"randomizers.things.failures={failures}", NONE_FAIL[1])
    with open_pipeline(load_config("arm_tasks.yaml", overrides=(*SMALL, *changes))) as pipeline:
        return pipeline.accepted_scene(scene_index).scene


@pytest.mark.parametrize("task", sorted(tasks()))
def test_every_task_is_demonstrated_with_success(task: str) -> None:
    """Its phases are those of the program; things are named in the instruction, not braced."""
    scene = demonstrated(task)
    (arm,) = scene.articulations
    assert arm.episode is not None
    assert arm.assignment is not None
    assert (arm.assignment.name, arm.episode.succeeded, arm.episode.failure) == (task, True, "")
    assert "{" not in arm.assignment.instruction
    program = [step.phase for step in tasks()[task].program]
    assert [span.label for span in arm.episode.phases] == [*program, "settle"]
    grasped = any(step.verb == "grasp" for step in tasks()[task].program)
    assert bool(arm.episode.held) == grasped
    assert arm.episode.phases[-1].end_s <= 15.0, "the sequence of arm_tasks.yaml is shorter"


@pytest.mark.parametrize("failure", ["slip", "miss", "collision"])
def test_failures_are_drawn_by_their_share(failure: str) -> None:
    """A share of 1 fails always; the label says how."""
    episode = demonstrated("stack", failures=f"{{{failure}: 1}}").articulations[0].episode
    assert episode is not None
    assert (episode.succeeded, episode.failure) == (False, failure)


def test_a_demonstration_alone_equals_the_one_after_others() -> None:
    """Physics remembers nothing: scene 2 drawn first, and after scenes 0 and 1."""
    config = load_config("arm_tasks.yaml", overrides=(*SMALL, "shared.robot=franka_panda"))
    with open_pipeline(config) as pipeline:
        alone = pipeline.accepted_scene(2).scene
    with open_pipeline(config) as pipeline:
        later = [pipeline.accepted_scene(k).scene for k in range(3)][-1]
    assert canonical_json(alone) == canonical_json(later)


def test_things_are_where_physics_left_them_at_every_step() -> None:
    """The upper block of a stack is on the table at first and on the lower one at last."""
    changes = ("shared.task=stack", *NONE_FAIL)
    with open_pipeline(load_config("arm_tasks.yaml", overrides=(*SMALL, *changes))) as pipeline:
        first, last = pipeline.sample(0), pipeline.sample(59)
    assert _height(first, "things/0") == pytest.approx(_height(first, "things/1"), abs=2e-3)
    assert _height(last, "things/0") - _height(last, "things/1") == pytest.approx(0.055, abs=3e-3)


def _height(sample: Sample, body: str) -> float:
    return sample.scene.body(body).T_world_body.translation_m[2]
