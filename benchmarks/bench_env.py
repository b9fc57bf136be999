"""Time of ``Env.step``: ``python -m benchmarks.bench_env [--steps 200] [--engine NAME]``.

Random actions in `arm_tasks.yaml` with a Panda; observations are photographs and depth of 320 x 240
pixels with everything else. Prints the mean and the 95th percentile of a step, in CPU and wall
milliseconds, once caches are warm, the shares of physics and of the camera, and the time of a
reset.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from benchmarks.runs import machine
from gen_data.lab.environment.env import Env

WARM_STEPS = 20
EPISODES = 4


def measure(call: Callable[[], object]) -> tuple[float, float]:
    """CPU and wall milliseconds of a call."""
    cpu_s, wall_s = time.process_time(), time.perf_counter()
    call()
    return 1e3 * (time.process_time() - cpu_s), 1e3 * (time.perf_counter() - wall_s)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--engine", default="pybullet")
    options = parser.parse_args()
    changes = ["shared.robot=franka_panda", f"physics.engine={options.engine}"]
    env = Env("arm_tasks.yaml", overrides=changes)
    env.action_space.seed(0)
    resets, steps, physics = [], [], []
    env.reset(seed=0)
    for _ in range(WARM_STEPS):
        env.step(env.action_space.sample())
    for episode in range(EPISODES):
        resets.append(measure(lambda: env.reset(seed=1 + episode)))  # noqa: B023
        rollout = env.rollout
        assert rollout is not None
        for _ in range(options.steps // EPISODES):
            action = env.action_space.sample()
            steps.append(measure(lambda: env.step(action)))  # noqa: B023
        for _ in range(10):
            physics.append(measure(lambda: rollout.step(env.action_space.sample())))  # noqa: B023
    print(f"{machine()}; {options.engine}; {len(steps)} steps of {env.settings.step_s:g} s")
    for name, values in {"step": steps, "of it physics": physics, "reset": resets}.items():
        cpu_ms, wall_ms = np.array(values).T
        print(
            f"{name:<14} {cpu_ms.mean():7.1f} CPU ms (95 %: {np.percentile(cpu_ms, 95):.1f}),"
            f" {wall_ms.mean():7.1f} ms"
        )


if __name__ == "__main__":
    main()
