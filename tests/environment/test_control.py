"""Actions move the arm as told, through the drawn dynamics."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.lab.environment.env import Env
from gen_data.physics.manipulation.arm_simulation import Servo
from gen_data.physics.mujoco_world import MujocoWorld
from tests.environment.small import NOMINAL, nominal, simulation_of, small
from tests.physics.panda import urdf_path
from tests.wheels import INSTALLED

Array = NDArray[np.float64]
HAND_LINK, ARM_JOINTS = b"panda_hand", 7
GRASP_M = 0.1034
"""From the hand's frame to the grasp frame (Franka Emika, "Franka Hand product manual")."""


@contextmanager
def bullet_arm() -> Iterator[tuple[int, int, int]]:
    """Pybullet's own Panda: client, robot, number of the hand's link."""
    pybullet = pytest.importorskip("pybullet")
    client = pybullet.connect(pybullet.DIRECT)
    robot = pybullet.loadURDF(str(urdf_path()), useFixedBase=True, physicsClientId=client)
    count = pybullet.getNumJoints(robot, physicsClientId=client)
    names = [pybullet.getJointInfo(robot, k, physicsClientId=client)[12] for k in range(count)]
    yield client, robot, names.index(HAND_LINK)
    pybullet.disconnect(client)


def hand_poses(*positions: Array) -> list[tuple[Array, Array]]:
    """Positions [m] and rotation matrices of the grasp frame, by pybullet's forward kinematics."""
    found = []
    pybullet = pytest.importorskip("pybullet")
    with bullet_arm() as (client, robot, link):
        for at in positions:
            for k in range(ARM_JOINTS):
                pybullet.resetJointState(robot, k, at[k], physicsClientId=client)
            state = pybullet.getLinkState(
                robot, link, computeForwardKinematics=True, physicsClientId=client
            )
            turn = np.array(pybullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
            found.append((np.array(state[4]) + GRASP_M * turn[:, 2], turn))
    return found


def settled(env: Env, action: NDArray[np.float32], steps: int = 20) -> Array:
    """Joint positions once an action has taken effect, and nothing else is asked for."""
    env.step(action)
    nothing = np.zeros_like(action)
    nothing[-1] = action[-1]
    for _ in range(steps):
        env.step(nothing)
    return simulation_of(env).positions.copy()


@pytest.mark.slow
@pytest.mark.parametrize("engine", INSTALLED)
def test_a_delta_moves_the_hand_as_told(engine: str) -> None:
    """By (20, -10, 15) mm and 5 degrees about Z of the base, to 0.2 mm and 0.1 degrees."""
    env = nominal(engine, "cartesian_delta")
    env.reset(seed=1)
    start = simulation_of(env).positions.copy()
    turn = math.radians(5.0)
    action = env.control.encode((0.02, -0.01, 0.015), 1.0, (0.0, 0.0, turn))  # type: ignore[attr-defined]
    end = settled(env, action)
    (before_m, R_before), (after_m, R_after) = hand_poses(start, end)
    assert after_m - before_m == pytest.approx([0.02, -0.01, 0.015], abs=2e-4)
    cosine, sine = math.cos(turn), math.sin(turn)
    told = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    angle = math.acos(min(1.0, 0.5 * (np.trace(told.T @ R_after @ R_before.T) - 1.0)))
    assert math.degrees(angle) < 0.1


@pytest.mark.slow
def test_poses_are_reached_in_the_frame_of_the_base() -> None:
    """A hand that points down at a given place, turned by 30 degrees about Z."""
    env = nominal(INSTALLED[0], "ik")
    env.reset(seed=1)
    turn = math.radians(30.0)
    action = env.control.encode((0.45, 0.1, 0.3), 1.0, (0.0, 0.0, turn))  # type: ignore[attr-defined]
    for _ in range(60):
        observation, *_ = env.step(action)
    ((place_m, R_base_hand),) = hand_poses(simulation_of(env).positions)
    assert place_m == pytest.approx([0.45, 0.1, 0.3], abs=3e-4)
    assert R_base_hand[:, 2] == pytest.approx([0.0, 0.0, -1.0], abs=2e-3)
    assert R_base_hand[:, 0] == pytest.approx([math.cos(turn), math.sin(turn), 0.0], abs=2e-3)
    assert observation["hand_position"] == pytest.approx(place_m, abs=1e-4)


@pytest.mark.slow
def test_joint_actions_are_positions_within_the_limits_of_the_urdf() -> None:
    """-1 and 1 are the limits, 0 the middle of each joint."""
    env = nominal(INSTALLED[0], "joint")
    env.reset(seed=1)
    pybullet = pytest.importorskip("pybullet")
    with bullet_arm() as (client, robot, _):
        infos = [pybullet.getJointInfo(robot, k, physicsClientId=client) for k in range(7)]
    low, high = np.array([info[8:10] for info in infos]).T
    assert env.observation_space["joint_positions"].low == pytest.approx(low, abs=1e-5)
    assert env.observation_space["joint_positions"].high == pytest.approx(high, abs=1e-5)
    target = simulation_of(env).positions.copy()
    target[0] += 0.3
    for _ in range(30):
        env.step(env.control.encode(target.tolist(), 1.0))  # type: ignore[attr-defined]
    assert simulation_of(env).positions == pytest.approx(target, abs=1e-4)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.5])
def test_motors_follow_the_step_response_of_a_damped_oscillator(ratio: float) -> None:
    """Against the solution of ``x'' = w^2 (1 - x) - 2 ratio w x'``, to first order of the step."""
    w, step_s = 20.0, 1e-4
    servo = Servo(w * w, 2.0 * ratio * w)
    positions, speeds, target = np.zeros(1), np.zeros(1), np.ones(1)
    for k in range(1, 4001):
        speeds = servo.next_speeds(positions, speeds, target, step_s)
        positions = positions + step_s * speeds
        if k % 1000 == 0:
            root = np.sqrt(complex(ratio * ratio - 1.0)) * w + 1e-9
            t, decay = k * step_s, np.exp(-ratio * w * k * step_s)
            wave = np.cosh(root * t) + ratio * w / root * np.sinh(root * t)
            assert positions[0] == pytest.approx(1.0 - (decay * wave).real, abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("latency", [1, 3])
def test_latency_delays_by_exactly_its_steps(latency: int) -> None:
    """The joints do the same, exactly so many steps later, and nothing before."""
    actions = [np.full(7, v, np.float32) for v in (0.5, -0.3, 0.2, 0.1, -0.4)]

    def joints(steps: int) -> list[bytes]:
        dynamics = {**NOMINAL, "latency_steps": steps}
        env = small(settings={"dynamics": dynamics})
        _, info = env.reset(seed=1)
        assert info["latency_steps"] == steps
        found = [simulation_of(env).positions.tobytes()]
        for action in actions:
            env.step(action)
            found.append(simulation_of(env).positions.tobytes())
        return found

    at_once, later = joints(0), joints(latency)
    assert later[: latency + 1] == [at_once[0]] * (latency + 1)
    assert later[latency:] == at_once[: len(at_once) - latency]
    assert len(set(at_once)) == len(at_once)


@pytest.mark.slow
@pytest.mark.parametrize("engine", INSTALLED)
def test_drawn_dynamics_reach_the_engine(engine: str) -> None:
    """Masses and friction read from the engine are the nominal ones times factors in the range."""
    dynamics = {"mass_factor": {"uniform": [1.5, 1.6]}, "friction_factor": {"uniform": [0.5, 0.6]},
                "motor_gain_per_s2": {"uniform": [300, 310]},
                "joint_damping_per_s": {"uniform": [30, 31]},
                "latency_steps": {"uniform_integer": [2, 3]}}  # fmt: skip
    plain, varied = nominal(engine, "joint"), small(engine, settings={"dynamics": dynamics})
    drawn = []
    for seed in (1, 4):
        plain.reset(seed=seed)
        _, info = varied.reset(seed=seed)
        (mass_kg, friction), (mass, rough) = (_read(env, "things/0") for env in (plain, varied))
        assert 1.5 <= mass / mass_kg <= 1.6
        assert 0.5 <= rough / friction <= 0.6
        assert 300 <= info["motor_gain_per_s2"] <= 310
        assert 30 <= info["joint_damping_per_s"] <= 31
        assert info["latency_steps"] in (2, 3)
        servo = simulation_of(varied)._servo
        assert servo == Servo(info["motor_gain_per_s2"], info["joint_damping_per_s"])
        drawn.append((mass / mass_kg, rough / friction, info["motor_gain_per_s2"]))
    assert all(a != b for a, b in zip(*drawn, strict=True))


def _read(env: Env, name: str) -> tuple[float, float]:
    """Mass [kg] and coefficient of friction of a body, from the engine itself."""
    env.step(np.zeros(env.action_space.shape, np.float32))
    world = simulation_of(env)._world
    if not isinstance(world, MujocoWorld):
        pybullet = pytest.importorskip("pybullet")
        found = pybullet.getDynamicsInfo(world._solids[name].number, -1, **world._here)
        return float(found[0]), float(found[1])
    compiled = world._compile()
    number = next(k for k, known in compiled.names.items() if known == name)
    model: mujoco.MjModel = compiled.model
    geom = int(model.body_geomadr[number])
    # MuJoCo takes the larger coefficient of two: the world stores squares.
    return float(model.body_mass[number]), math.sqrt(float(model.geom_friction[geom, 0]))
