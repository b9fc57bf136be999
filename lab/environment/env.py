"""The Gymnasium environment, over the scenes, randomizers and renderer of a configuration."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.api.config import ConfigLike, load_config, read_document, read_model
from gen_data.api.dataset import GeneratedSamples
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core import capture, interfaces, optional_packages, streams
from gen_data.core.errors import ConfigError
from gen_data.lab.environment import choices, control
from gen_data.lab.environment.observations import CHANNELS, Observation, observation_space, observe
from gen_data.lab.environment.rollout import Rollout
from gen_data.lab.environment.settings import DrawnDynamics, EnvSettings
from gen_data.physics import open_engine
from gen_data.physics.engine import Engine

try:
    import gymnasium
except ModuleNotFoundError as error:
    raise ConfigError(
        f"gen_data.Env {optional_packages.missing_packages('gymnasium') or error}"
    ) from error

ENV_ID = "gen_data/Arm-v0"
"""Name for ``gymnasium.make``, registered when this module is imported."""
_SCENES = 2**31
"""Scenes that are drawn from without a seed."""
_WITHOUT_LABELS = ("annotations=[]", "exporters=[]")


class Env(gymnasium.Env[Observation, control.Action]):
    """A robot arm in the scenes of a configuration.

    ``reset(seed=i)`` begins in scene ``i`` of the configuration's data set; without a seed, in a
    scene that the generator of the latest seed draws. An episode depends on the configuration, the
    settings, its scene and the actions only. The reward is 1, and the episode terminates, when all
    conditions of success of the arm's task hold; without a task it is always 0.

    Args:
        config: A YAML file, a shipped name such as ``arm_tasks.yaml``, or a dictionary.
        settings: Settings of the environment (``EnvSettings``): a YAML file, or a dictionary.
        seed: Replaces the configuration's seed.
        overrides: ``KEY=VALUE`` texts, as for ``gen-data --set``.
        without: Names of randomizers to leave out.
        render_mode: ``rgb_array`` for ``render``; None = it is not called.

    Attributes:
        settings: The settings.
        control: Meaning of actions; ``encode`` makes actions from metres and radians.
        rollout: State of the episode; None before the first ``reset``.

    Raises:
        ConfigError: configuration or settings are wrong, or there is no arm with a gripper.

    Example:
        >>> env = gen_data.Env("arm_tasks.yaml", overrides=["shared.robot=franka_panda"])
        >>> observation, info = env.reset(seed=7)
        >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012

    def __init__(
        self,
        config: ConfigLike,
        *,
        settings: ConfigLike | None = None,
        seed: int | None = None,
        overrides: Sequence[str] = (),
        without: Sequence[str] = (),
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ConfigError(f"render_mode: '{render_mode}' is unknown; expected 'rgb_array'")
        loaded = load_config(
            config, seed=seed, overrides=(*overrides, *_WITHOUT_LABELS), without=without
        )
        document = read_document({} if settings is None else settings, "settings")
        self.settings = read_model(document, EnvSettings)
        self.metadata = {**self.metadata, "render_fps": round(1.0 / self.settings.step_s)}
        self.render_mode = render_mode
        self._samples = GeneratedSamples(PipelineFactory(loaded, n=1, extra_channels=CHANNELS))
        factory = self._samples.make_pipeline
        arm = choices.choose_arm(factory, self.settings.arm, document)
        robot = factory.library.robot(arm.asset)
        self._arm = arm.name
        self._camera, image = choices.choose_camera(factory, self.settings.camera, document)
        self.control = control.make_control(robot, self.settings, document)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (self.control.size,), np.float32)
        self._space = observation_space(robot, image, self.settings)
        self.observation_space = self._space
        self._physics = loaded.general.physics
        self._engine: Engine | None = None
        self._resources = ExitStack()
        self.rollout: Rollout | None = None
        self._drawn: DrawnDynamics | None = None
        self._sensor: interfaces.Sensor | None = None
        self._streams = streams.Streams(0, 0)
        self._photo: NDArray[np.uint8] | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Number of the scene, and beginning of the ones that follow; None = the next one,
                which without any seed before differs from run to run, as usual in Gymnasium.
            options: None are known.

        Raises:
            SceneRejected: no layout of the scene has a solution, such as a goal out of reach; the
                message names the change to make.
        """
        if options:
            raise ConfigError(f"options: unknown option '{min(options)}'; none are expected")
        super().reset(seed=seed)
        scene = int(self.np_random.integers(_SCENES)) if seed is None else seed
        with self._samples.pipeline() as pipeline:
            accepted = pipeline.accepted_scene(scene)
            view = pipeline.drawn_view(accepted, 0)
            engine = self._open_engine()
            self._streams = replace(view.streams, step=0)
            self._sensor = next(s for s in accepted.sensors if s.name == self._camera)
            drawn = self.settings.dynamics.draw(engine.weigh(view.scene), self._streams)
            self._drawn = drawn
            self.rollout = Rollout(
                engine, drawn, self._arm, self.control, self.settings, self._physics.time_step_s
            )
            observation = self._observe(pipeline.renderer)
        task = self.rollout.arm.assignment
        return observation, {
            **self._info(),
            "scene_index": scene,
            "task": task.name if task else "",
            "instruction": task.instruction if task else "",
            "motor_gain_per_s2": drawn.servo.gain_per_s2,
            "joint_damping_per_s": drawn.servo.damping_per_s,
            "latency_steps": drawn.latency_steps,
        }

    def step(self, action: control.Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Act, and observe ``settings.step_s`` later.

        ``info`` has ``success``, ``held`` (name of the body in the hand), ``feasible`` (whether the
        arm can reach the target of the action) and ``blocked`` (whether an obstacle stopped it).

        Raises:
            ConfigError: the action does not fit the action space.
            gymnasium.error.ResetNeeded: there is no episode.
        """
        rollout = self._running()
        action = np.asarray(action, dtype=np.float32)
        if action.shape != self.action_space.shape or not np.isfinite(action).all():
            raise ConfigError(
                f"action: got shape {action.shape} with {action.tolist()}; expected "
                f"{self.control.size} numbers in [-1, 1]"
            )
        with self._samples.pipeline() as pipeline:
            rollout.step(np.clip(action, -1.0, 1.0))
            observation = self._observe(pipeline.renderer)
        truncated = rollout.steps >= self.settings.steps_max
        reward = float(rollout.succeeded)
        return observation, reward, rollout.succeeded, truncated, self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """The latest photograph, uint8 [h, w, 3]; None without ``render_mode``."""
        self._running()
        return None if self.render_mode is None else self._photo

    def close(self) -> None:
        """Release the engines."""
        self.rollout, self._engine = None, None
        self._resources.close()
        self._samples.close()

    def _running(self) -> Rollout:
        if self.rollout is None:
            raise gymnasium.error.ResetNeeded("there is no episode yet; call reset() first")
        return self.rollout

    def _open_engine(self) -> Engine:
        if self._engine is None:
            library = self._samples.make_pipeline.library
            self._engine = self._resources.enter_context(open_engine(library, self._physics))
        return self._engine

    def _observe(self, renderer: interfaces.Renderer) -> Observation:
        assert self.rollout is not None
        assert self._sensor is not None
        rng = replace(self._streams, step=self.rollout.steps).rng(f"sensor/{self._camera}")
        reading = self._sensor.capture(self.rollout.scene, renderer, CHANNELS, rng)
        assert isinstance(reading, capture.SensorReading)
        observation = observe(self.rollout, reading, self._space, self.settings)
        self._photo = observation["rgb"].copy()
        return observation

    def _info(self) -> dict[str, Any]:
        rollout = self._running()
        return {
            "success": rollout.succeeded,
            "held": rollout.simulation.held,
            "feasible": rollout.is_feasible,
            "blocked": rollout.simulation.is_blocked,
        }


def make_vec(config: ConfigLike, n: int, **options: Any) -> gymnasium.vector.AsyncVectorEnv:
    """``n`` environments, each in a separate process.

    Args:
        config: As for ``Env``.
        n: Number of environments, at least 1; ``reset(seed=s)`` gives them the seeds from ``s`` on.
        options: Further arguments of ``Env``.

    Raises:
        ConfigError: as for ``Env``, or ``n`` is less than 1.
    """
    if n < 1:
        raise ConfigError(f"n: {n} environments; expected at least 1")
    # Spawned processes inherit no threads and no engine of this one.
    return gymnasium.vector.AsyncVectorEnv([partial(Env, config, **options)] * n, context="spawn")


gymnasium.register(id=ENV_ID, entry_point=f"{__name__}:{Env.__name__}")
