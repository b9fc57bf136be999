"""Tasks of robot arms as data: objects, program and conditions of success of each.

The shipped ones are in ``arm_tasks.yaml``. Users' own are in a file next to their configuration,
whose content replaces its name there: plans are self-contained, and errors name the file,
line and column that they come from.
"""

import json
from collections.abc import Mapping
from functools import cache
from string import Formatter
from typing import Literal

from pydantic import Field, model_validator

from gen_data.config import base_model, data_files, paths, yaml_tree
from gen_data.core import scene, se3

Span = tuple[float, float]


class Thing(base_model.Strict):
    """An object of a task.

    Attributes:
        assets: Its name in instructions, and the id of its asset; an id without parameters is a
            family of variants. One of several is drawn.
        x_m, y_m: Bounds of its middle: ahead of the arm's base and to its left, for an arm whose
            workspace begins 0.3 m ahead of it; from ``near``, if given, along its axes.
        yaw_deg: Bounds of its rotation about Z.
        near: Name of another object that it is placed by, at ``z_m`` from that one's bottom.
        z_m: Height of its bottom above the table, or above the bottom of ``near``.
        mass_kg: 0 = fixed; None = the asset's own.
        joint: Joint of a part that moves, in the frame of the part.
        mistaken: Whether the arm may take it for another one; not if the hand cannot hold it.
    """

    assets: dict[str, str] = Field(min_length=1)
    x_m: Span = (0.35, 0.6)
    y_m: Span = (-0.25, 0.25)
    yaw_deg: Span = (-180.0, 180.0)
    near: str = ""
    z_m: float = 0.0
    mass_kg: float | None = None
    joint: "Joint | None" = None
    mistaken: bool = True


class Joint(base_model.Strict):
    """A joint of an object; see ``BodyJoint``.

    Attributes:
        kind: ``prismatic`` slides, ``revolute`` turns.
        axis: Direction of the motion, in the frame of the object.
        anchor_m: A point on the axis, in the frame of the object.
        limits: Smallest and largest position [m or degrees].
        friction: Force or torque that moves it at least [N or N m].
        stiffness: Stiffness of a spring that returns it to 0 [N/m or N m/rad].
    """

    kind: Literal["prismatic", "revolute"]
    axis: se3.Vec3
    anchor_m: se3.Vec3 = (0.0, 0.0, 0.0)
    limits: Span
    friction: float = 1.0
    stiffness: float = 0.0


class Step(base_model.Strict):
    """One step of a program: a verb and its objects.

    Attributes:
        verb: ``grasp`` lifts ``at``. ``place`` puts the held object down on top of ``at``.
            ``reach`` takes the hand, or with ``carries`` the held object, to a point above the top
            of ``at``, around all obstacles. ``move`` moves the hand along straight lines or an
            arc, and may touch and push. ``grip`` opens or closes the fingers, with ``at`` until
            they meet that object, which they do not hold.
        at: Name of an object.
        along: Object that the X axis of the step's frame points to, horizontally; ``own`` = the X
            axis of ``at``; empty = away from the arm. Z is up.
        carries: Whether ``reach`` takes the held object there. It keeps its rotation or turns by
            eighths; with ``yaws``, its X axis is the step's, or turned evenly. With ``grip``, the
            fingers hold ``at`` from then on.
        offset_m: Offset of the goal of ``reach``, in the step's frame.
        yaw_deg: Angle of the hand against that frame; at 0 the fingers open along its Y.
        yaws: Number of evenly spaced rotations to try; 0 = two of the hand.
        by_m: Displacements of ``move``, each from its beginning, in the step's frame.
        turn_deg: Turn during ``move``, about ``axis`` through ``pivot_m``, after displacements.
        axis: Axis of the turn, in the step's frame.
        pivot_m: Point of the axis, from the top of ``at``; None = the hand's goal of the latest
            ``reach``.
        opening: Opening of the gripper: 0 closed, 1 open.
        touches: Names of the objects that ``move`` may touch.
        pivots: Whether ``move`` leads the hand along the arc without turning it, with fingers so
            loose that the held object turns between them where it meets ``touches``.
        phase: Name of the step in labels.
        pace: Factor on the arm's speed.
        arms: Which of the task's arms do it; several ``move`` together. Empty = the first one.
    """

    verb: Literal["reach", "move", "grasp", "place", "grip"]
    at: str = ""
    along: str = ""
    offset_m: se3.Vec3 = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0
    yaws: int = Field(0, ge=0)
    by_m: tuple[se3.Vec3, ...] = ()
    turn_deg: float = 0.0
    axis: se3.Vec3 = (0.0, 0.0, 1.0)
    pivot_m: se3.Vec3 | None = None
    opening: float = Field(1.0, ge=0, le=1)
    carries: bool = False
    touches: tuple[str, ...] = ()
    pivots: bool = False
    phase: str = Field(min_length=1)
    pace: float = Field(1.0, gt=0, le=1)
    arms: tuple[str, ...] = ()


class Success(base_model.Strict):
    """A condition of success; see ``Condition``.

    Attributes:
        measure: ``distance`` between the middles of two boxes, its horizontal part ``offset``,
            ``height`` of the body above the other, ``gap`` between surfaces [m]; ``tilt`` of the
            body from its first rotation [rad]; ``travel`` of its joint [m or rad].
        body: Name of the object that is measured; ``hand`` = the grasp frame's origin.
        other: Name of the object that it is measured from.
        ever: Whether one instant is enough; else it must hold at the end.
        at_least, at_most: Bounds, inclusive; null = unbounded.
    """

    measure: scene.Measure
    body: str
    other: str = ""
    ever: bool = False
    at_least: float | None = None
    at_most: float | None = None


class Task(base_model.Strict):
    """An entry of the table.

    Attributes:
        instruction: Sentence with names of objects in braces.
        things: Objects by name, in the order in which they are placed.
        program: Steps in order.
        success: Conditions, all of which must hold.
        hand: Required kind of hand; None = either will do.
        arms: Names of its arms in the program, in the order in which the scene has them; empty =
            one arm. Places of objects are then ahead of the middle between their bases.
        recovers_from: Failures after which it can still be done; null = all that it can have.
    """

    instruction: str
    things: dict[str, Thing]
    program: tuple[Step, ...] = Field(min_length=1)
    success: tuple[Success, ...] = Field(min_length=1)
    hand: Literal["fingers", "suction"] | None = "fingers"
    arms: tuple[str, ...] = ()
    recovers_from: tuple[scene.FailureKind, ...] | None = None

    @property
    def joints_min(self) -> int:
        """Fewest joints of an arm that can do it: one per degree of freedom of the hand.

        A hand that looks down has three of place and one of rotation; one that tilts has six.
        """
        tilts = any(step.turn_deg and step.axis[:2] != (0.0, 0.0) for step in self.program)
        return 6 if tilts else 4

    @property
    def mistaken(self) -> str:
        """Object that may be taken for the first one that is grasped; empty = none."""
        wanted = next((step.at for step in self.program if step.verb == "grasp"), "")
        for name, one in self.things.items():
            loose = one.mistaken and one.mass_kg != 0.0 and one.joint is None
            if wanted and name != wanted and loose:
                return name
        return ""

    @property
    def causes(self) -> tuple[scene.FailureKind, ...]:
        """Causes by which it can fail on purpose."""
        grasps = any(step.verb == "grasp" for step in self.program)
        wrong: tuple[scene.FailureKind, ...] = ("wrong_object",) if self.mistaken else ()
        return (*(("slip", "miss", "collision") if grasps else ()), "late", *wrong)

    @property
    def twin_causes(self) -> tuple[scene.FailureKind, ...]:
        """Causes by which one of its twins can fail and from which the other recovers."""
        wanted = self.causes if self.recovers_from is None else self.recovers_from
        return tuple(cause for cause in self.causes if cause in wanted)

    @model_validator(mode="after")
    def _names_its_things(self) -> "Task":
        used = [step.at for step in self.program] + [t.near for t in self.things.values()]
        used += [name for step in self.program for name in (*step.touches, step.along)]
        used += [name for c in self.success for name in (c.body, c.other)]
        used += [name or "" for _, name, _, _ in Formatter().parse(self.instruction)]
        unknown = sorted({*used} - {*self.things, "", "own", scene.HAND})
        if unknown:
            raise ValueError(f"there is no object '{unknown[0]}'")
        strangers = {name for step in self.program for name in step.arms} - {*self.arms}
        if strangers:
            raise ValueError(
                f"there is no arm '{min(strangers)}'; expected one of the task's arms: "
                f"{', '.join(self.arms) or 'none'}"
            )
        odd = {*(self.recovers_from or ())} - {*self.causes}
        if odd:
            raise ValueError(
                f"it cannot fail by '{min(odd)}'; expected some of: {', '.join(self.causes)}"
            )
        if any(len(step.arms) > 1 and step.verb != "move" for step in self.program):
            raise ValueError("several arms can only 'move' together")
        return self


@cache
def tasks() -> Mapping[str, Task]:
    """The shipped tasks, by name."""
    plain = data_files.load_data(__package__, "arm_tasks")
    # Strict models take lists for tuples from JSON only.
    return {name: Task.model_validate_json(json.dumps(entry)) for name, entry in plain.items()}


def load_tasks(randomizer: yaml_tree.Node) -> yaml_tree.Node:
    """Replace the name of a file of tasks, in the document of a randomizer, by its content.

    Raises:
        ConfigError: there is no such file, or it is not YAML.
    """
    kind, own = randomizer.get("type"), randomizer.get("tasks")
    if kind is None or kind.content != "arm_task" or own is None:
        return randomizer
    if not isinstance(own.content, str):
        return randomizer
    path = paths.find_path(own.text, own.position, "tasks", "file of tasks")
    content = {**randomizer.entries, "tasks": yaml_tree.load_yaml(path)}
    return yaml_tree.Node(randomizer.position, content, randomizer.key_positions)
