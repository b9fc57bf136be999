"""One episode: an arm that is controlled in a drawn scene."""

from collections import deque
from dataclasses import replace

import numpy as np

from gen_data.core import scene_time, se3
from gen_data.core.scene import Articulation, Scene
from gen_data.lab.environment.control import Action, Command, Control
from gen_data.lab.environment.settings import DrawnDynamics, EnvSettings
from gen_data.physics.engine import Engine


class Rollout:
    """The state of an episode.

    Args:
        engine: Simulates it, and nothing else meanwhile.
        drawn: The scene at time 0, with its dynamics.
        arm: Name of the arm.
        control: Meaning of actions.
        settings: Times.
        time_step_s: Simulated time per step of the engine.

    Attributes:
        scene: The scene now, with sensors in their places.
        simulation: Arm and bodies.
        steps: Number of actions so far.
        is_feasible: Whether the arm can reach the target of the latest action.
    """

    def __init__(
        self,
        engine: Engine,
        drawn: DrawnDynamics,
        arm: str,
        control: Control,
        settings: EnvSettings,
        time_step_s: float,
    ) -> None:
        self._control, self._step_s = control, settings.step_s
        self._substeps = max(1, round(settings.step_s / time_step_s))
        self.simulation = engine.simulate(drawn.scene, arm, drawn.servo)
        simulated = self.simulation.poses().keys()
        arms = tuple(replace(a, joint_track=None) for a in drawn.scene.articulations)
        tracks = tuple(t for t in drawn.scene.tracks if t.body not in simulated)
        self._start = replace(drawn.scene, articulations=arms, tracks=tracks)
        self._arm = next(a for a in arms if a.name == arm)
        task = self._arm.assignment
        self._conditions = task.success if task else ()
        self._has_held = [False] * len(self._conditions)
        hold = Command(tuple(self.simulation.positions.tolist()), self.simulation.opening)
        self._commanded = hold
        self._pending = deque([hold] * drawn.latency_steps)
        self.steps, self.is_feasible = 0, True
        self.scene = self._observed()
        self.succeeded = self._judge()

    @property
    def arm(self) -> Articulation:
        """The arm at time 0."""
        return self._arm

    def step(self, action: Action) -> None:
        """Take an action, and simulate until the next one."""
        command = self._control.command(action, self._commanded)
        self.is_feasible = command is not None
        self._commanded = command or self._commanded
        self._pending.append(self._commanded)
        due = self._pending.popleft()
        self.steps += 1
        self.simulation.place(
            {t.body: t.pose(self._time_s) for t in self._start.tracks if self._collides(t.body)}
        )
        self.simulation.advance(due.positions, due.opening, self._substeps)
        if self.simulation.is_blocked:
            # Else later motions would first have to undo the prevented one.
            here = tuple(self.simulation.positions.tolist())
            self._commanded = replace(self._commanded, positions=here)
        self.scene = self._observed()
        self.succeeded = self._judge()

    def target_m(self, which: str) -> se3.Vec3:
        """Middle of a body of the first condition of success, in the frame of the arm's base [m].

        ``which`` is ``body`` or ``other``; the latter is the former where there is none. Zeros
        without a task.
        """
        if not self._conditions:
            return (0.0, 0.0, 0.0)
        first = self._conditions[0]
        name = (first.other if which == "other" else "") or first.body
        middle_m = self.simulation.measures.middle_m(name, self._hand_m())
        x, y, z = self._arm.T_world_base.inverse().apply(middle_m)
        return (float(x), float(y), float(z))

    @property
    def _time_s(self) -> float:
        return round(self.steps * self._step_s, 9)

    def _collides(self, name: str) -> bool:
        return self._start.body(name).collides

    def _hand_m(self) -> np.ndarray:
        return np.array(self.simulation.T_world_grasp.translation_m)

    def _judge(self) -> bool:
        """Whether all conditions hold now, or have held where that is enough."""
        hand_m, measures = self._hand_m(), self.simulation.measures
        holds = [c.holds(measures.value(c, hand_m)) for c in self._conditions]
        self._has_held = [a or b for a, b in zip(self._has_held, holds, strict=True)]
        ever = zip(self._conditions, holds, self._has_held, strict=True)
        return bool(holds) and all(past if c.ever else now for c, now, past in ever)

    def _observed(self) -> Scene:
        """The scene now; objects that have not moved are identical, and not packed again."""
        poses = self.simulation.poses()
        scene = scene_time.scene_at(self._start, self._time_s)
        moved = [
            replace(body, T_world_body=poses[body.name])
            for body in scene.bodies
            if body.name in poses and poses[body.name] != body.T_world_body
        ]
        arms = tuple(
            replace(a, joint_positions=self.simulation.joint_positions)
            if a.name == self._arm.name
            else a
            for a in scene.articulations
        )
        return scene_time.place_sensors(replace(scene.with_bodies(*moved), articulations=arms))
