"""Tasks of arms: the table, and draws from it."""

import json
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats

from gen_data.config.distributions import Constant
from gen_data.core.asset_types import RobotModel
from gen_data.core.errors import ConfigError
from gen_data.core.scene import HAND, Articulation, Episode, ObjectGroup, Scene, SupportSurface
from gen_data.core.se3 import SE3
from gen_data.core.streams import Streams
from gen_data.randomizers.arm_task import ArmTask, Failures
from gen_data.randomizers.arm_task_table import Step, Task, tasks
from tests.randomizers.doubles import FakeAssets, two_link_arm

ARM = Articulation("arm", "two_link", 1, SE3((-0.5, 0.0, 0.74)), two_link_arm().home)
TABLE = SupportSurface("table", "table", SE3((0.0, 0.0, 0.74)), (1.2, 0.8), 1.0)
GROUP = ObjectGroup("things", ("table",), (), 0, "scatter")
SCENE = Scene("test", surfaces=(TABLE,), groups=(GROUP,), articulations=(ARM,))
SUCK = Task.model_validate_json(
    """{"instruction": "Lift the {it}.", "hand": "suction",
 "things": {"it": {"assets": {"box": "box"}}},
 "program": [{"verb": "grasp", "at": "it", "phase": "pick"}],
 "success": [{"measure": "distance", "body": "it", "other": "hand", "at_most": 0.1}]}"""
)
MINIMAL = """{"instruction": "Move over the {it}.",
 "things": {"it": {"assets": {"cup": "cup?seed=0"}}},
 "program": [{"verb": "reach", "at": "%s", "phase": "reach"}],
 "success": [{"measure": "offset", "body": "hand", "other": "it", "at_most": 0.01}]}"""


def test_the_table_has_tasks_of_many_kinds() -> None:
    """Forty or more, three of them for two arms; every verb and measure is used by some."""
    table = tasks()
    assert len(table) >= 40
    assert {n for n, t in table.items() if t.arms} == {"pass_rod", "lift_tray", "hold_and_open"}
    assert {s.verb for t in table.values() for s in t.program} == {
        "reach", "move", "grasp", "place", "grip"}  # fmt: skip
    assert {c.measure for t in table.values() for c in t.success} == {
        "distance", "offset", "height", "gap", "tilt", "travel"}  # fmt: skip
    # The hand does not belong to the bodies of the scene.
    assert any(c.body == HAND for c in table["reach"].success)


@pytest.mark.parametrize("name", sorted(tasks()))
def test_instructions_name_things_of_the_task(name: str) -> None:
    """A sentence, in which all names in braces are known."""
    task = tasks()[name]
    text = task.instruction.format(**{thing: thing for thing in task.things})
    assert text[0].isupper()
    assert text.endswith(".")


def made(task: str, name: str = "things", **table: Task) -> ArmTask:
    return ArmTask(name=name, task=Constant(task), tasks=table)


BOXES = replace(SCENE, groups=(replace(GROUP, assets=("box", "bin")),))


@pytest.mark.parametrize(("make", "error", "message"), [
    (lambda: Task.model_validate_json(MINIMAL % "cup"), ValidationError, "is no object 'cup'"),
    (lambda: Task.model_validate_json((MINIMAL % "it").replace("{it}.", "{lid}.")),
     ValidationError, "there is no object 'lid'"),
    (lambda: Failures(slip=0.7, miss=0.4), ValidationError, "add up to more than 1"),
    (lambda: made("dance").possible_assets(FakeAssets()),
     ConfigError, r"randomizers\.things\.task: unknown task"),
    (lambda: made("reach", name="toys").check(SCENE, FakeAssets()),
     ConfigError, r"randomizers\.toys\.group: the template has no object group 'toys'"),
    (lambda: made("suck", suck=SUCK).check(BOXES, FakeAssets()),
     ConfigError, r"'suck' needs suction, but arm 'arm' .* has fingers; .*panda_suction"),
])  # fmt: skip
def test_a_task_that_cannot_be_is_refused_by_its_field(make: Any, error: Any, message: str) -> None:
    """Unknown things, shares, tasks and groups; suction with fingers, by a robot that can."""
    assert Task.model_validate_json(MINIMAL % "it")
    with pytest.raises(error, match=message):
        make()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"arms": ["left"], "program": [{"verb": "reach", "at": "it", "phase": "reach",
          "arms": ["right"]}]}, "there is no arm 'right'; expected one of .* left"),
        ({"arms": ["a", "b"], "program": [{"verb": "reach", "at": "it", "phase": "reach",
          "arms": ["a", "b"]}]}, "several arms can only 'move' together"),
        ({"recovers_from": ["slip"]}, "cannot fail by 'slip'; expected some of: late"),
    ],
)  # fmt: skip
def test_arms_and_causes_of_a_task_must_fit_it(change: dict[str, Any], message: str) -> None:
    plain = json.loads(MINIMAL % "it") | change
    with pytest.raises(ValidationError, match=message):
        Task.model_validate_json(json.dumps(plain))


def test_causes_follow_from_the_program() -> None:
    """Without a grasp a task can only be late; another object must be loose to be mistaken."""
    assert tasks()["press_button"].causes == ("late",)
    assert tasks()["lift"].causes == ("slip", "miss", "collision", "late")
    assert tasks()["stack"].causes == ("slip", "miss", "collision", "late", "wrong_object")
    assert (tasks()["stack"].mistaken, tasks()["lift"].mistaken) == ("lower", "")


FREE = Task.model_validate_json(
    """{"instruction": "Lift the {it}.", "hand": null,
 "things": {"it": {"assets": {"box": "box"}, "yaw_deg": [0, 0]}},
 "program": [{"verb": "grasp", "at": "it", "phase": "pick"}],
 "success": [{"measure": "distance", "body": "it", "other": "hand", "at_most": 0.1}]}"""
)
TURN = Step(verb="move", phase="tilt", turn_deg=30, axis=(1, 0, 0))
TILT = FREE.model_copy(update={"program": (*FREE.program, TURN)})


def drawn(
    task: ArmTask, scene: int = 0, attempt: int = 0, assets: FakeAssets | None = None
) -> Scene:
    rng = Streams(seed=7, scene=scene, attempt=attempt, index=scene).rng("things")
    return task(SCENE, assets or FakeAssets(), rng)


def failure_of(task: ArmTask, scene: int, attempt: int = 0) -> str:
    (arm,) = drawn(task, scene, attempt).articulations
    assert arm.assignment is not None
    return arm.assignment.failure


@pytest.mark.slow
def test_failures_follow_their_shares() -> None:
    """Chi-square over 4,000 scenes; its false-alarm rate is 1e-4 over seeds, and the seed fixed."""
    shares = {"slip": 0.1, "miss": 0.05, "collision": 0.2, "": 0.65}
    failures = Failures(slip=0.1, miss=0.05, collision=0.2)
    task = made("free", free=FREE).model_copy(update={"failures": failures})
    counts = Counter(failure_of(task, scene) for scene in range(4000))
    assert set(counts) == set(shares)
    expected = [4000 * share for share in shares.values()]
    assert stats.chisquare([counts[kind] for kind in shares], expected).pvalue > 1e-4


def test_all_attempts_at_a_scene_ask_for_the_same_failure() -> None:
    """Otherwise tasks that physics often refuses would be rarer than their share; places differ."""
    failures = Failures(slip=0.3, miss=0.3, collision=0.3)
    task = ArmTask(name="things", task=Constant("free"), tasks={"free": FREE}, failures=failures)
    for scene in range(40):
        assert len({failure_of(task, scene, attempt) for attempt in range(5)}) == 1
    poses = {drawn(task, 0, attempt).bodies[0].T_world_body for attempt in range(5)}
    assert len(poses) == 5


def test_tasks_without_a_grasp_never_fail_on_purpose() -> None:
    """There is nothing to slip, to miss or to knock away."""
    reach = FREE.model_copy(update={"program": (Step(verb="reach", at="it", phase="reach"),)})
    task = ArmTask(
        name="things", task=Constant("r"), tasks={"r": reach}, failures=Failures(slip=1.0)
    )
    assert {failure_of(task, scene) for scene in range(50)} == {""}


def test_a_success_cannot_be_labelled_as_a_failure() -> None:
    """Nor the reverse: a failure may have a reason."""
    with pytest.raises(ValueError, match="succeeded has no failure, but 'slip'"):
        Episode(True, "slip")
    assert Episode(False, "slip").failure == "slip"


@pytest.mark.parametrize(
    ("task", "needed"), [(FREE, "4 joints to place a hand that looks down"), (TILT, "6 joints")]
)
def test_an_arm_with_too_few_joints_is_refused(task: Task, needed: str) -> None:
    """Place and rotation about the vertical are four degrees of freedom, any pose six."""
    scene = replace(SCENE, groups=(replace(GROUP, assets=("box",)),))
    message = rf"'free' needs {needed} .* \(two_link\) has 2; expected"
    with pytest.raises(ConfigError, match=message):
        made("free", free=task).check(scene, FakeAssets())


@pytest.mark.parametrize("begins_m", [0.1, 0.45])
def test_things_lie_where_the_workspace_of_the_arm_begins(begins_m: float) -> None:
    """As much nearer or farther as with an arm whose workspace begins at 0.3 m."""

    class Reaching(FakeAssets):
        def robot(self, asset_id: str) -> RobotModel:
            return replace(super().robot(asset_id), workspace_from_m=begins_m)

    task = ArmTask(name="things", task=Constant("free"), tasks={"free": FREE})
    usual, moved = (drawn(task, assets=assets).bodies[0] for assets in (None, Reaching()))
    step = np.subtract(moved.T_world_body.translation_m, usual.T_world_body.translation_m)
    assert step == pytest.approx([begins_m - 0.3, 0.0, 0.0], abs=1e-6)
