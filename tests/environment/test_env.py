"""The environment keeps Gymnasium's contract over the scenes of a configuration."""

import re
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import gen_data
from gen_data.api.config import read_model
from gen_data.config.yaml_tree import parse_yaml
from gen_data.core.distribution import install_command
from gen_data.core.errors import AssetError, ConfigError, SceneRejected
from gen_data.lab.environment.env import ENV_ID, Env, make_vec
from gen_data.lab.environment.settings import EnvSettings
from tests.environment.small import CONFIG, arm_of, nominal, same, simulation_of, small
from tests.wheels import INSTALLED


@pytest.fixture(params=INSTALLED)
def engine(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.mark.slow
@pytest.mark.parametrize("control", ["joint", "ik", "cartesian_delta"])
def test_gymnasium_s_checker_finds_nothing(engine: str, control: str) -> None:
    """Its warnings, too, are errors here; it also makes the environment by its name."""
    config = {**CONFIG, "physics": {"engine": engine}}
    env = gymnasium.make(ENV_ID, config=config, settings={"control": control})
    check_env(env.unwrapped)
    env.close()


@pytest.mark.slow
def test_gymnasium_s_checker_finds_nothing_in_the_defaults() -> None:
    """Without its tries of all rendering modes, each of which makes an environment."""
    env = gymnasium.make(ENV_ID, config=CONFIG).unwrapped
    check_env(env, skip_render_check=True)
    env.close()


@pytest.mark.slow
def test_equal_seeds_give_equal_bytes_and_resets_without_one_continue() -> None:
    """Two environments, one of which has had another episode; different seeds differ."""
    one, other = small(), small()
    other.reset(seed=5)
    other.step(np.ones(7, np.float32))
    action = np.array([0.3, -0.5, -1.0, 0.0, 0.0, 0.2, -1.0], np.float32)
    first, second = one.reset(seed=1), other.reset(seed=1)
    assert same(first[0], second[0])
    assert first[1] == second[1]
    for _ in range(4):
        mine, yours = one.step(action), other.step(action)
        assert same(mine[0], yours[0])
        assert mine[1:] == yours[1:]
    assert not same(one.reset(seed=4)[0], first[0])
    # The same sequence of scenes after the same seed, all of them different.
    env = nominal(INSTALLED[0], "joint")
    env.reset(seed=1)
    following = [env.reset()[1]["scene_index"] for _ in range(2)]
    env.reset(seed=1)
    assert [env.reset()[1]["scene_index"] for _ in range(2)] == following
    assert following[0] != following[1]
    # The first photograph is that of the data set's sample, byte for byte.
    observation, info = small(settings={"steps_max": 3}).reset(seed=2)
    sample = gen_data.Dataset(CONFIG)[2]
    assert info["scene_index"] == 2
    assert observation["rgb"].tobytes() == sample.cameras["color"].rgb.tobytes()


@pytest.mark.slow
def test_a_scripted_pick_succeeds(engine: str) -> None:
    """From observations alone: above the object, down, close, up; the reward comes at the end."""
    env = nominal(engine, "ik", "lift")
    observation, info = env.reset(seed=1)
    assert info["task"] == "lift"
    x, y, z = (float(v) for v in observation["object_position"])
    turn = (0.0, 0.0, _yaw(env))
    way = [((x, y, z + 0.15), 1.0, 25), ((x, y, z), 1.0, 20), ((x, y, z), 0.0, 12)]
    way += [((x, y, z + 0.3), 0.0, 30)]
    rewards, held = [], []
    for place, opening, steps in way:
        for _ in range(steps):
            action = env.control.encode(place, opening, turn)  # type: ignore[attr-defined]
            observation, reward, terminated, _, info = env.step(action)
            rewards.append(reward)
            held.append(info["held"])
            assert observation["holding"] == bool(info["held"])
            if terminated:
                break
    assert info["success"]
    assert rewards[-1] == 1.0
    assert sum(rewards) == 1.0
    assert held[:45] == [""] * 45
    assert held[-1] == "things/0"


def _yaw(env: Env) -> float:
    """Of the object, by which the hand is turned."""
    assert env.rollout is not None
    w, _, _, z = env.rollout.scene.body("things/0").T_world_body.quaternion_wxyz
    return 2.0 * float(np.arctan2(z, w))


@pytest.mark.slow
def test_obstacles_stop_the_arm(engine: str) -> None:
    """Told to go down for a second, no finger enters the table by more than 2 mm and a step."""
    env = nominal(engine, "cartesian_delta")
    env.reset(seed=1)
    down = env.control.encode((0.02, 0.0, -0.03), 0.0)  # type: ignore[attr-defined]
    infos = [env.step(down)[-1] for _ in range(24)]
    arm = simulation_of(env)
    table_m = arm_of(env).T_world_base.translation_m[2]
    lowest_m = min(arm.measures.middle_m(f, np.zeros(3))[2] for f in _fingers(env))
    assert infos[-1]["blocked"]
    assert not infos[0]["blocked"]
    assert lowest_m > table_m
    assert arm.proximity_m(0.2) == pytest.approx(0.0, abs=1e-6)


def _fingers(env: Env) -> tuple[str, str]:
    return ("arm/panda_leftfinger", "arm/panda_rightfinger")


@pytest.mark.slow
def test_what_cannot_be_reached_changes_nothing() -> None:
    """The far corner of the workspace: the targets stay, and ``info`` says so."""
    env = small(settings={"control": "ik", "workspace_m": [[0.3, -3.0, 0.1], [0.6, 3.0, 0.5]]})
    env.reset(seed=1)
    info = env.step(np.array([1, 1, 1, 0, 0, 0, 1], np.float32))[-1]
    assert not info["feasible"]
    assert np.abs(simulation_of(env).speeds).max() == 0.0


@pytest.mark.slow
def test_proximity_is_the_height_of_the_fingers_over_the_table(engine: str) -> None:
    """Of a hand that points down beside all things, the lowest corner of the fingers' boxes."""
    env = nominal(engine, "ik")
    env.reset(seed=1)
    for _ in range(40):
        action = env.control.encode((0.3, 0.4, 0.1), 1.0)  # type: ignore[attr-defined]
        observation, *_ = env.step(action)
    assert env.rollout is not None
    world = simulation_of(env)._world
    lowest_m = min(float(world.bounds_m(finger)[0][2]) for finger in _fingers(env))
    above_m = lowest_m - arm_of(env).T_world_base.translation_m[2]
    assert 0.02 < above_m < 0.12
    assert float(observation["proximity"][0]) == pytest.approx(above_m, abs=1e-3)


def test_episodes_are_truncated_after_their_steps_and_rendering_shows_the_latest() -> None:
    """Not terminated, as nothing was lifted; the photograph is a copy."""
    env = small(settings={"steps_max": 2}, render_mode="rgb_array")
    observation, _ = env.reset(seed=1)
    picture = env.render()
    assert picture is not None
    assert picture.tobytes() == observation["rgb"].tobytes()
    assert env.metadata["render_fps"] == 20
    ends = [env.step(np.zeros(7, np.float32))[2:4] for _ in range(2)]
    assert ends == [(False, False), (False, True)]


@pytest.mark.slow
def test_vectors_and_processes_equal_single_environments() -> None:
    """Environment ``k`` of a vector has the seed ``s + k``, and the same bytes."""
    vector = gymnasium.vector.SyncVectorEnv([partial(small)] * 2)
    together, _ = vector.reset(seed=1)
    actions = np.full((2, 7), 0.4, np.float32)
    together_later = vector.step(actions)[0]
    processes = make_vec(CONFIG, 2, settings={"steps_max": 50})
    try:
        apart, _ = processes.reset(seed=1)
    finally:
        processes.close()
    single = small()
    for k in range(2):
        first = single.reset(seed=1 + k)[0]
        assert same({n: v[k] for n, v in together.items()}, first)
        assert same({n: v[k] for n, v in apart.items()}, first)
        later = single.step(actions[k])[0]
        assert same({n: v[k] for n, v in together_later.items()}, later)


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"settings": {"control": "jont"}}, r"<settings>:1:10: control: unknown value 'jont'"),
    ({"settings": {"camera": "colour"}}, r"<settings>:1:9: camera: there is no camera 'colour'"),
    ({"settings": {"arm": "left"}}, r"<settings>:1:6: arm: there is no arm 'left'; expected arm"),
    ({"settings": {"dynamics": {"mass_factor": -1}}}, r"2:16: dynamics.mass_factor: -1 is not > 0"),
    ({"settings": {"control": "ik", "workspace_m": [[3, 3, 0], [4, 4, 1]]}},
     r"workspace_m: its nearest point is 4.24 m from the base"),
    ({"settings": {"workspace_m": [[0, 1, 0], [1, 0, 1]]}}, r"workspace_m: expected the low"),
    ({"settings": "missing.yaml"}, r"missing.yaml"),
    ({"render_mode": "human"}, r"render_mode: 'human' is unknown; expected 'rgb_array'"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "message"), WRONG)
def test_wrong_settings_are_refused_with_their_place(options: dict[str, Any], message: str) -> None:
    """Before any engine starts."""
    with pytest.raises(ConfigError, match=message):
        Env(CONFIG, **options)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("config", "overrides", "error", "fact"),
    [
        ("closeup.yaml", [], ConfigError, "elements: there is no robot; expected one with"),
        ("tabletop.yaml", [], ConfigError,
         r"elements: the robot differs from scene to scene \(fr"),
        ("tabletop.yaml", ["shared.robot=kuka_iiwa"], ConfigError,
         "elements: robot 'kuka_iiwa' has no gripper"),
        # Only robots of packs that are not installed have a replacement.
        *(("arm_tasks.yaml", [f"shared.robot={name}"], AssetError,
           rf"shared\.robot: asset '{name}': unknown") for name in ("nope", "frank_panda")),
    ],
)  # fmt: skip
def test_configurations_without_one_robot_with_a_gripper_are_refused(
    config: str, overrides: list[str], error: type[Exception], fact: str
) -> None:
    with pytest.raises(error, match=fact):
        Env(config, overrides=overrides)


def test_a_task_without_solution_is_refused_with_reasons() -> None:
    """The base of the arm is moved so that the things lie beside the table."""
    changes = ["elements.arm.at_m=[0.5, 0]", "physics.layout_attempts_max=2"]
    with pytest.raises(SceneRejected, match=r"(?s)scene 0: no valid layout in 2 attempts.*Try: 1"):
        Env(CONFIG, overrides=changes).reset(seed=0)


@pytest.mark.slow
def test_without_gymnasium_the_extra_is_named() -> None:
    """By the error of a first use; importing gen_data needs no Gymnasium."""
    program = (
        "import sys; sys.modules['gymnasium'] = None; import gen_data\n"
        "try: gen_data.Env\n"
        "except gen_data.ConfigError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    expected = f"gen_data.Env needs the package gymnasium: {install_command('env')}"
    assert done.stdout.decode().strip() == expected


def test_the_documented_settings_are_valid() -> None:
    """The block of docs/environment.md, read as a file would be."""
    page = (Path(__file__).parents[2] / "docs/environment.md").read_text("utf-8")
    (block,) = re.findall(r"^```\n(control:.*?)^```$", page, re.MULTILINE | re.DOTALL)
    settings = read_model(parse_yaml(block, "env.yaml"), EnvSettings)
    assert (settings.control, settings.steps_max) == ("ik", 200)
    assert settings.dynamics.mass_factor.support() == (0.5, 2.0)


def test_wrong_calls_are_refused() -> None:
    """Acting before a reset, numbers that are no action, unknown options, no environments."""
    env = small()
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(7, np.float32))
    with pytest.raises(ConfigError, match="options: unknown option 'speed'"):
        env.reset(seed=1, options={"speed": 2})
    env.reset(seed=1)
    with pytest.raises(ConfigError, match=r"action: got shape \(3,\).*expected 7 numbers"):
        env.step(np.zeros(3, np.float32))
    with pytest.raises(ConfigError, match="expected 7 numbers"):
        env.step(np.full(7, np.nan, np.float32))
    with pytest.raises(ConfigError, match="n: 0 environments; expected at least 1"):
        make_vec(CONFIG, 0)
