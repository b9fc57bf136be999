"""Tasks of arms: the table, and what is drawn from it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pydantic import ValidationError

from gen_data.generator.config.distributions import Constant
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.scene import HAND, Articulation, ObjectGroup, Scene, SupportSurface
from gen_data.generator.core.se3 import SE3
from gen_data.randomizers.arm_task import ArmTask, Failures
from gen_data.randomizers.arm_task_table import Task, tasks
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
    """Twenty or more; every verb and every measure is used by some."""
    table = tasks()
    assert len(table) >= 20
    assert {s.verb for t in table.values() for s in t.program} == {
        "reach", "move", "grasp", "place", "grip"}  # fmt: skip
    assert {c.measure for t in table.values() for c in t.success} == {
        "offset", "height", "gap", "tilt", "travel"}  # fmt: skip


@pytest.mark.parametrize("name", sorted(tasks()))
def test_instructions_name_things_of_the_task(name: str) -> None:
    """A sentence, in which all names in braces are known."""
    task = tasks()[name]
    text = task.instruction.format(**{thing: thing for thing in task.things})
    assert text[0].isupper()
    assert text.endswith(".")


def test_a_task_that_refers_to_an_unknown_thing_is_refused() -> None:
    """By the thing's name."""
    assert Task.model_validate_json(MINIMAL % "it")
    with pytest.raises(ValidationError, match="there is no thing 'cup'"):
        Task.model_validate_json(MINIMAL % "cup")
    with pytest.raises(ValidationError, match="there is no thing 'lid'"):
        Task.model_validate_json((MINIMAL % "it").replace("{it}.", "{lid}."))


def test_more_failures_than_demonstrations_are_refused() -> None:
    """0.7 + 0.4 > 1."""
    with pytest.raises(ValidationError, match="add up to more than 1"):
        Failures(slip=0.7, miss=0.4)


def test_an_unknown_task_is_refused_by_its_field() -> None:
    """Before any scene is drawn."""
    with pytest.raises(ConfigError, match=r"randomizers\.things\.task: unknown task"):
        ArmTask(name="things", task=Constant("dance")).possible_assets(FakeAssets())


def test_a_template_without_the_group_is_refused() -> None:
    """The group has the randomizer's name."""
    with pytest.raises(
        ConfigError, match=r"randomizers\.toys\.group: the template has no object group 'toys'"
    ):
        ArmTask(name="toys", task=Constant("reach")).check(SCENE, FakeAssets())


def test_a_task_for_suction_is_refused_with_fingers() -> None:
    """By the name of the task, with a robot that would do."""
    group = replace(GROUP, assets=("box", "bin"))
    scene = replace(SCENE, groups=(group,))
    task = ArmTask(name="things", task=Constant("suck"), tasks={"suck": SUCK})
    with pytest.raises(
        ConfigError, match=r"'suck' needs suction, but arm 'arm' .* has fingers; .*panda_suction"
    ):
        task.check(scene, FakeAssets())


def test_hands_are_named_in_conditions() -> None:
    """``hand`` is no body of the scene."""
    assert any(c.body == HAND for c in tasks()["reach"].success)
