"""Every task of the table is demonstrated, and physics confirms it."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from itertools import groupby
from pathlib import Path

import pytest
import trimesh

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory, open_pipeline
from gen_data.core.errors import ConfigError, SceneRejected
from gen_data.core.sample import Sample
from gen_data.core.scene import Episode, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.serialization import canonical_json
from gen_data.pipeline import Pipeline
from gen_data.randomizers.arm_task_table import tasks
from tests.tiers import cases, exhaustive

SMALL = ("sensors.color.size_px=[96,72]", "sensors.wrist.size_px=[96,72]")
THINGS = "randomizers.things"
THING = "things/0"
"""Name of the first body that an arm moves."""
OWN = """nudge:
  instruction: Nudge the {thing}.
  things: {thing: {assets: {red block: "box?color=red&size_m=0.06,0.06,0.06"}, mass_kg: 0.2}}
  program:
    - {verb: reach, phase: approach, at: thing, along: own, offset_m: [-0.08, 0, 0.06], opening: 0}
    - {verb: move, phase: lower, by_m: [[0, 0, -0.105]]}
    - {verb: move, phase: push, at: thing, along: own, by_m: [[0.1, 0, 0]], touches: [thing]}
  success:
    - {measure: tilt, body: thing, at_least: 0, at_most: 0.1}
"""
JOINTS = (("z", 0.0), ("y", 0.2), ("y", 0.4), ("z", 0.2), ("y", 0.2), ("z", 0.08))
"""Axis of every joint of ``my_arm``, and its height above the one before [m]."""


@contextmanager
def demonstrating(task: str, *changes: str, failures: str = "{}") -> Iterator[Pipeline]:
    """A pipeline of the configuration that has the arms for a task."""
    config = "arm_pair.yaml" if tasks()[task].arms else "arm_tasks.yaml"
    robot = "franka_panda_suction" if tasks()[task].hand == "suction" else "franka_panda"
    given = (
        f"shared.task={task}", f"shared.robot={robot}", f"{THINGS}.failures={failures}", *changes
    )  # fmt: skip
    with open_pipeline(load_config(config, overrides=(*SMALL, *given))) as pipeline:
        yield pipeline


def demonstrated(task: str, *changes: str, failures: str = "{}") -> Scene:
    with demonstrating(task, *changes, failures=failures) as pipeline:
        return pipeline.accepted_scene(0).scene


def user_config(
    folder: Path, task: str, robot: str = "franka_panda", things: str = "", more: str = ""
) -> str:
    """Path of a user's configuration of a task, with fields of its randomizer and of the whole."""
    config = folder / "config.yaml"
    config.write_text(
        f"extends: arm_tasks\n{more}shared: {{robot: {{choice: {{{robot}: 1}}}}, "
        f"task: {{choice: {{{task}: 1}}}}}}\n"
        f"randomizers:\n  - {{name: things{things}, failures: {{}}}}\n"
    )
    return str(config)


def first_scene(config: str) -> Scene:
    with open_pipeline(load_config(config, overrides=SMALL)) as pipeline:
        return pipeline.accepted_scene(0).scene


def episode_of(scene: Scene) -> Episode:
    episode = scene.articulations[0].episode
    assert episode is not None
    return episode


QUICK = ("open_drawer",)
SLOW = ("hold_and_open", "lift_tray", "pass_rod", "pivot", "stack", "stir")


@pytest.mark.parametrize(
    "task",
    [
        *cases((*QUICK, *SLOW), QUICK),
        *(pytest.param(t, marks=exhaustive) for t in sorted({*tasks()} - {*QUICK, *SLOW})),
    ],
)
def test_every_task_is_demonstrated_with_success(task: str) -> None:
    """It has the phases of the program; its instruction names objects, without braces."""
    arm = demonstrated(task).articulations[0]
    assert arm.episode is not None
    assert arm.assignment is not None
    assert (arm.assignment.name, arm.episode.succeeded, arm.episode.failure) == (task, True, "")
    assert "{" not in arm.assignment.instruction
    # Steps of both arms in the same phase are one span.
    program = [phase for phase, _ in groupby(step.phase for step in tasks()[task].program)]
    assert [span.label for span in arm.episode.phases] == [*program, "settle"]
    grasped = any(s.verb == "grasp" or s.carries for s in tasks()[task].program)
    assert bool(arm.episode.held) == grasped
    assert arm.episode.phases[-1].end_s <= 15.0, "the sequence of arm_tasks.yaml is shorter"


@pytest.mark.slow
def test_a_rod_passes_from_one_hand_to_the_other() -> None:
    """Both hold it for a moment, each has it alone before or after; it never falls in between.

    The rod of 3 cm is at least 15 cm above the plate while both touch it.
    """
    scene = demonstrated("pass_rod")
    episode = episode_of(scene)
    (first, other) = episode.held
    assert first.label == other.label == THING
    assert first.start_s < other.start_s < first.end_s < other.end_s
    track = scene.track(THING)
    assert track is not None
    heights = [track.pose(t).translation_m[2] for t in (other.start_s, first.end_s)]
    assert min(heights) > 0.74 + 0.15
    assert heights[0] == pytest.approx(heights[1], abs=1e-3)


@pytest.mark.slow
def test_a_tray_stays_level_between_two_hands_and_in_both() -> None:
    """Hands move as one: the distance between them and each one's pose on the tray never change."""
    scene = demonstrated("lift_tray")
    episode = episode_of(scene)
    lift = next(span for span in episode.phases if span.label == "lift")
    relative = []
    for share in (0.05, 0.3, 0.6, 1.0):
        at = scene_at(scene, lift.start_s + share * (lift.end_s - lift.start_s))
        tray = at.body(THING).T_world_body
        hands = [at.body(f"{arm}/panda_hand").T_world_body for arm in ("arm", "right")]
        relative.append([v for h in hands for v in (tray.inverse() @ h).translation_m])
        up = tray.rotation()[:, 2]
        assert up[2] == pytest.approx(1.0, abs=1e-4)
    for other in relative[1:]:
        assert other == pytest.approx(relative[0], abs=1.5e-3)


def test_a_task_of_two_arms_is_refused_with_one() -> None:
    """By its name, the number of arms and the configuration that has them."""
    config = load_config("arm_tasks.yaml", overrides=("shared.task=pass_rod",))
    with pytest.raises(
        ConfigError, match=r"'pass_rod' needs 2 arms, but the scene has 1; expected .* arm_pair"
    ):
        PipelineFactory(config, 1).check()


@pytest.mark.slow
@pytest.mark.parametrize("failure", ["slip", "miss", "collision"])
def test_failures_are_drawn_by_their_share(failure: str) -> None:
    """A share of 1 fails always; the label names the cause."""
    episode = episode_of(demonstrated("stack", failures=f"{{{failure}: 1}}"))
    assert (episode.succeeded, episode.failure) == (False, failure)


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["kuka_iiwa_gripper", "xarm6_gripper"])
def test_arms_with_made_fingers_put_things_down_where_they_should(robot: str) -> None:
    """``robot_tools`` makes the fingers; physics confirms the place."""
    episode = episode_of(demonstrated("pick_and_place", f"shared.robot={robot}"))
    assert episode.succeeded
    assert any(f"tool_left_finger + {THING}" in span.label for span in episode.contacts)


@pytest.mark.slow
def test_a_thing_that_pivots_is_pressed_by_the_mat_and_turns_in_the_hand() -> None:
    """Held while it turns by 55 degrees; the mat pushes with the pads' torque over the lever arm.

    At the beginning the edge is 0.035 sin 35 deg - 0.0175 cos 35 deg = 5.7 mm from the axis, so
    that 0.05 N m take 8.7 N; the lever only grows from there.
    """
    episode = episode_of(demonstrated("pivot"))
    pivot = next(span for span in episode.phases if span.label == "pivot")
    (held,) = episode.held
    assert held.start_s < pivot.start_s
    assert held.end_s >= pivot.end_s
    (pressed,) = [
        span
        for span in episode.contacts
        if span.label == f"{THING} + things/1"
        and span.start_s < pivot.end_s < span.end_s + 1.0
        and span.start_s <= pivot.start_s + 0.1
    ]
    forces = [pressed.at(pivot.start_s + 0.1 + 0.05 * k)[0] for k in range(10)]
    assert all(2.0 < force_n < 12.0 for force_n in forces)


def test_tasks_of_a_users_file_are_demonstrated(tmp_path: Path) -> None:
    """``tasks`` names a file next to the configuration; faults have its line and column."""
    table = tmp_path / "mine.yaml"
    table.write_text(OWN)
    config = user_config(tmp_path, "nudge", things=", tasks: mine.yaml")
    (arm,) = first_scene(config).articulations
    assert arm.assignment is not None
    assert arm.assignment.instruction == "Nudge the red block."
    table.write_text(OWN.replace("at_least", "at_leest"))
    with pytest.raises(
        ConfigError, match=r"(?s)mine.yaml:9:36: .*tasks.nudge.success\[0\].at_leest"
    ):
        load_config(config)
    table.unlink()
    with pytest.raises(ConfigError, match=r"config.yaml:4:27: tasks: there is no file of tasks"):
        load_config(config)


@pytest.mark.slow
@pytest.mark.parametrize(("mass_kg", "holds"), [(4.0, True), (4.5, False)])
def test_a_cup_lifts_what_its_force_bears(tmp_path: Path, mass_kg: float, holds: bool) -> None:
    """42.4 N: 4 kg weigh 39.2 N, 4.5 kg 44.1 N."""
    (tmp_path / "mine.yaml").write_text(
        f"""suck:
  instruction: Lift the {{it}}.
  hand: suction
  things: {{it: {{assets: {{red box: "box?color=red&size_m=0.1,0.1,0.05"}}, mass_kg: {mass_kg}}}}}
  program: [{{verb: grasp, phase: pick, at: it}}]
  success: [{{measure: tilt, body: it, at_most: 0.1}}]
"""
    )
    config = user_config(
        tmp_path, "suck", "franka_panda_suction", ", tasks: mine.yaml, speed: 0.1",
        "physics: {layout_attempts_max: 1}\n",
    )  # fmt: skip
    with nullcontext() if holds else pytest.raises(SceneRejected, match="bear the load"):
        assert [span.label for span in episode_of(first_scene(config)).held] == [THING]


def my_arm() -> str:
    """A URDF of boxes: six joints and a flange, but no hand."""
    axes = {"y": "0 1 0", "z": "0 0 1"}
    links, joints = ['<link name="link0"/>'], []
    for k, (axis, rise_m) in enumerate(JOINTS):
        next_m = JOINTS[k + 1][1] if k + 1 < len(JOINTS) else 0.04
        box = (
            f'<origin xyz="0 0 {0.5 * next_m}"/>'
            f'<geometry><box size="0.05 0.05 {max(0.03, next_m - 0.06)}"/></geometry>'
        )
        links.append(
            f'<link name="link{k + 1}"><visual>{box}</visual><collision>{box}</collision></link>'
        )
        joints.append(
            f'<joint name="joint{k + 1}" type="revolute"><parent link="link{k}"/>'
            f'<child link="link{k + 1}"/><origin xyz="0 0 {rise_m}"/>'
            f'<axis xyz="{axes[axis]}"/><limit lower="-2.9" upper="2.9" velocity="2"/></joint>'
        )
    return f'<robot name="my_arm">{"".join(links + joints)}</robot>'


OWN_ARM = {"robot": "user/my_arm", "more": "assets: {folders: [arms]}\n"}


@pytest.mark.slow
def test_an_arm_of_a_user_stacks_with_fingers_made_for_it(tmp_path: Path) -> None:
    """From a URDF of six joints; physics confirms the stack."""
    (tmp_path / "arms").mkdir()
    (tmp_path / "arms/my_arm.urdf").write_text(my_arm())
    (tmp_path / "arms/assets.yaml").write_text(
        "robots:\n  - id: my_arm\n    file: my_arm.urdf\n"
        "    home: {joint2: 0.3, joint3: 1.2, joint5: 1.6}\n"
        "    tool: {kind: fingers, flange: link6, offset_m: 0.04}\n"
    )
    (arm,) = first_scene(user_config(tmp_path, "stack", **OWN_ARM)).articulations
    assert arm.asset == "user/my_arm"
    assert len(arm.joint_positions) == len(JOINTS) + 2
    assert arm.episode is not None
    assert arm.episode.succeeded


HAND = """<robot name="hand"><link name="palm"><visual>{palm}</visual>
<collision>{palm}</collision></link>{fingers}</robot>"""
FINGER = """<link name="{name}"><visual>{mesh}</visual><collision>{mesh}</collision></link>
<joint name="open_{name}" type="prismatic"><origin xyz="0 0 0.06"/><parent link="palm"/>
<child link="{name}"/><axis xyz="0 {side} 0"/>
<limit lower="0" upper="0.04" effort="40" velocity="0.1"/>{mimic}</joint>"""


def own_hand() -> str:
    """A palm and two fingers of one STL file in millimetres; the right one mirrors the left."""
    mesh = '<geometry><mesh filename="finger.stl" scale="0.001 {}0.001 0.001"/></geometry>'
    right = FINGER.format(
        name="right", side=-1, mesh=mesh.format("-"), mimic='<mimic joint="open_left"/>'
    )
    left = FINGER.format(name="left", side=1, mesh=mesh.format(""), mimic="")
    palm = '<origin xyz="0 0 0.03"/><geometry><box size="0.07 0.12 0.06"/></geometry>'
    return HAND.format(palm=palm, fingers=left + right)


@pytest.mark.slow
def test_a_published_panda_lifts_with_a_hand_of_its_own_files(tmp_path: Path) -> None:
    """Its description as pybullet ships it, without its hand; physics confirms the lift."""
    pybullet_data = pytest.importorskip("pybullet_data")
    arms = tmp_path / "arms"
    shutil.copytree(Path(pybullet_data.getDataPath()) / "franka_panda", arms / "franka_panda")
    (arms / "hand.urdf").write_text(own_hand())
    trimesh.creation.box(bounds=[(-10, 0, 0), (10, 12, 80)]).export(arms / "finger.stl")
    (arms / "assets.yaml").write_text(
        "robots:\n  - id: my_arm\n    file: franka_panda/panda.urdf\n"
        "    home: {panda_joint2: -0.5, panda_joint4: -2.2, panda_joint6: 1.7}\n"
        "    tool: {kind: file, file: hand.urdf, flange: panda_link8, instead_of: panda_hand}\n"
        "    gripper: {link: palm, grasp_offset_m: 0.131, finger_joints: [open_left], "
        "stroke_m: 0.08}\n"
    )
    episode = episode_of(first_scene(user_config(tmp_path, "lift", **OWN_ARM)))
    assert episode.succeeded
    assert [span.label for span in episode.held] == [THING]


@pytest.mark.slow
def test_a_demonstration_alone_equals_the_one_after_others() -> None:
    """Physics remembers nothing: scene 2 drawn first, and after scenes 0 and 1."""
    config = load_config("arm_tasks.yaml", overrides=(*SMALL, "shared.robot=franka_panda"))
    with open_pipeline(config) as pipeline:
        alone = pipeline.accepted_scene(2).scene
    with open_pipeline(config) as pipeline:
        later = [pipeline.accepted_scene(k).scene for k in range(3)][-1]
    assert canonical_json(alone) == canonical_json(later)


@pytest.mark.slow
def test_things_are_where_physics_left_them_at_every_step() -> None:
    """The upper block of a stack is on the table at first and on the lower one at last."""
    with demonstrating("stack") as pipeline:
        first, last = pipeline.sample(0), pipeline.sample(59)
    assert _height(first, THING) == pytest.approx(_height(first, "things/1"), abs=2e-3)
    assert _height(last, THING) - _height(last, "things/1") == pytest.approx(0.055, abs=3e-3)


def _height(sample: Sample, body: str) -> float:
    return sample.scene.body(body).T_world_body.translation_m[2]
