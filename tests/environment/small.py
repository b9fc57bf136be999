"""A small configuration with a task, and environments over it."""

from functools import cache
from typing import Any

import numpy as np

from gen_data.core.scene import Articulation
from gen_data.lab.environment.env import Env
from gen_data.physics.manipulation.arm_simulation import ArmSimulation
from tests.wheels import INSTALLED

CONFIG: dict[str, Any] = {
    "template": "arm_task",
    "seed": 3,
    "shared": {"robot": "franka_panda", "task": "reach"},
    "randomizers": [{"type": "arm_task", "name": "things", "task": "$shared.task"}],
    "sensors": [
        {"type": "rgb_camera", "name": "color", "size_px": [32, 24], "hfov_deg": 60,
         "channels": ["rgb"]},
    ],
}  # fmt: skip
NOMINAL = {"mass_factor": 1, "friction_factor": 1, "joint_damping_per_s": 40,
           "motor_gain_per_s2": 400, "latency_steps": 0}  # fmt: skip
"""Dynamics without variation: critically damped motors."""


OPENED: list[Env] = []
"""Environments of the running test, which are closed after it: each holds a renderer's memory."""


def small(engine: str = INSTALLED[0], task: str = "reach", **options: Any) -> Env:
    shared = {**CONFIG["shared"], "task": task}
    env = Env({**CONFIG, "shared": shared, "physics": {"engine": engine}}, **options)
    OPENED.append(env)
    return env


@cache
def nominal(engine: str, control: str, task: str = "reach") -> Env:
    """An environment without variation of its dynamics, which tests share."""
    env = small(engine, task, settings={"control": control, "dynamics": NOMINAL})
    OPENED.remove(env)
    return env


def arm_of(env: Env) -> Articulation:
    """The arm of the running episode at time 0."""
    assert env.rollout is not None
    return env.rollout.arm


def simulation_of(env: Env) -> ArmSimulation:
    assert env.rollout is not None
    return env.rollout.simulation


def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return one.keys() == other.keys() and all(
        np.asarray(one[k]).tobytes() == np.asarray(other[k]).tobytes() for k in one
    )
