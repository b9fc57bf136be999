"""Tasks of robot arms: their objects, program and conditions of success, from a table."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal, get_args

from pydantic import Field, model_validator
from pydantic.config import JsonDict

from gen_data.config import distributions as dist
from gen_data.config.base_model import Strict
from gen_data.core import asset_types, errors, interfaces, kinematics, streams
from gen_data.core.members import Member, add_members, remove_members
from gen_data.core.scene import (
    HAND,
    ArmGoal,
    Articulation,
    Assignment,
    BodyJoint,
    Condition,
    FailureKind,
    ObjectGroup,
    Scene,
)
from gen_data.core.se3 import IDENTITY, SE3, Vec3
from gen_data.randomizers import arm_configuration, placement
from gen_data.randomizers.arm_task_table import Step, Success, Task, Thing, tasks
from gen_data.randomizers.base import RandomizerBase, check_known

SEEDS = 16
"""Variants to draw from where the table names a family."""
_TRIES = 200
_APART_M = 0.03
"""Least gap between drawn objects."""
_YAWS = 8
"""Rotations of a held object to try at its destination."""
_LIFT_M = 0.0005
# A file name is replaced by the file's content before validation: see ``load_tasks``.
_OR_A_FILE: JsonDict = {"type": ["object", "string"]}
_FREEDOM = {
    4: "a hand that looks down and turn it about the vertical",
    6: "a hand and tilt it in any direction",
}
_EXAMPLES = {"fingers": "franka_panda", "suction": "franka_panda_suction"}


class Failures(Strict):
    """Shares of demonstrations that fail on purpose, by kind.

    Attributes:
        slip: The object slips out of the fingers on its way.
        miss: The fingers close above the object.
        collision: The hand knocks the object away before it reaches for it.
        late: The arm waits until the time limit has passed.
        wrong_object: The arm takes another object for the one it should grasp.
    """

    slip: float = Field(0.0, ge=0, le=1)
    miss: float = Field(0.0, ge=0, le=1)
    collision: float = Field(0.0, ge=0, le=1)
    late: float = Field(0.0, ge=0, le=1)
    wrong_object: float = Field(0.0, ge=0, le=1)

    @property
    def shares(self) -> dict[FailureKind, float]:
        """Shares above 0 by kind, in the order in which they are drawn."""
        kinds = get_args(FailureKind)[1:]
        return {kind: share for kind in kinds if (share := getattr(self, kind)) > 0.0}

    @model_validator(mode="after")
    def _is_a_share(self) -> "Failures":
        if sum(self.shares.values()) > 1.0:
            raise ValueError("the shares of failures add up to more than 1")
        return self


class ArmTask(RandomizerBase):
    """Draws the objects of a task and gives an arm its program; physics demonstrates and judges it.

    They become the members of an object group.

    Attributes:
        group: Name of the template's object group; empty = the randomizer's own name.
        task: Name of a task.
        tasks: Name of a YAML file of tasks next to the configuration, in addition to
            ``arm_tasks.yaml``; tasks of the same name replace those.
        arm: Name of the arm; empty = the first one. Tasks of several arms take the scene's other
            arms, in their order.
        failures: Shares of demonstrations that fail on purpose, of tasks that can fail so. With
            ``twins`` of the configuration, where one of two demonstrations always fails, their
            proportions; without any, all causes of a task are equally frequent.
        time_limit_s: Time within which a task must be done; null = there is no limit, and nothing
            is late.
        speed: Fraction of the joints' speed and acceleration limits to use.
    """

    type: Literal["arm_task"] = "arm_task"
    stage: Literal["scene"] = "scene"
    task: dist.Name = dist.Choice({"pick_and_place": 1.0})
    tasks: dict[str, Task] = Field(default_factory=dict, json_schema_extra=_OR_A_FILE)
    group: str = ""
    arm: str = ""
    failures: Failures = Failures()
    time_limit_s: float | None = Field(None, gt=0, le=600)
    speed: Annotated[dist.Scalar, dist.Bounds(0.01, 1.0)] = dist.Uniform(0.4, 0.7)

    def possible_assets(self, assets: interfaces.AssetIndex) -> tuple[str, ...]:
        """Ids of the assets of all tasks that it can draw."""
        del assets
        table = self._table()
        found = {
            asset
            for name in self._possible_tasks()
            for thing in table[name].things.values()
            for chosen in thing.assets.values()
            for asset in _variants(chosen)
        }
        return tuple(sorted(found))

    def check(self, scene: Scene, assets: interfaces.AssetIndex) -> None:
        """Check the names of tasks, of the group and of the arm, and that it has a gripper."""
        group = self._find_group(scene)
        known = {assets.get(asset).category for asset in group.assets}
        for asset in self.possible_assets(assets):
            if assets.get(asset).category not in known:
                raise errors.ConfigError(
                    f"randomizers.{self.name}.task: the object group '{group.name}' lacks "
                    f"'{asset.partition('?')[0]}'; expected it among its assets (ids)"
                )
        arms = self._find_arms(scene)
        if self.failures.late and self.time_limit_s is None:
            raise errors.ConfigError(
                f"randomizers.{self.name}.failures: late needs a time limit; expected "
                "time_limit_s besides it [s]"
            )
        for name in self._possible_tasks():
            task = self._table()[name]
            if scene.twins and not self._causes(task):
                asked = " and ".join(self.failures.shares) or "without a time_limit_s"
                raise errors.ConfigError(
                    f"randomizers.{self.name}.failures: twins of '{name}' cannot fail by {asked}; "
                    f"expected one of {', '.join(task.twin_causes)}, or another task"
                )
            if len(arms) < len(task.arms):
                raise errors.ConfigError(
                    f"randomizers.{self.name}.task: '{name}' needs {len(task.arms)} arms, but the "
                    f"scene has {len(arms)}; expected further elements of type robot, as in "
                    "arm_pair.yaml, or another task"
                )
            for arm in arms[: max(1, len(task.arms))]:
                self._check_arm(name, task, arm, assets)

    def _check_arm(
        self, name: str, task: Task, arm: Articulation, assets: interfaces.AssetIndex
    ) -> None:
        robot = assets.robot(arm.asset)
        gripper, joints = robot.gripper, len(kinematics.arm_joints(robot))
        if gripper is None:
            raise errors.ConfigError(
                f"randomizers.{self.name}: arm '{arm.name}' ({arm.asset}) has no gripper; expected "
                "a robot with one, such as franka_panda, robots/ur5e or robots/sawyer"
            )
        hand = "fingers" if gripper.cup is None else "suction"
        if task.hand not in (hand, None):
            raise errors.ConfigError(
                f"randomizers.{self.name}.task: '{name}' needs {task.hand}, but arm "
                f"'{arm.name}' ({arm.asset}) has {hand}; expected another robot, such as "
                f"{_EXAMPLES[str(task.hand)]}"
            )
        if joints < task.joints_min:
            raise errors.ConfigError(
                f"randomizers.{self.name}.task: '{name}' needs {task.joints_min} joints to "
                f"place {_FREEDOM[task.joints_min]}, but arm '{arm.name}' ({arm.asset}) has "
                f"{joints}; expected another robot, or another task"
            )

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with the objects of a task, and an arm that has to perform it."""
        name = self.task.draw(rng)
        table = self._table()
        check_known(name, tuple(table), f"randomizers.{self.name}.task: unknown task")
        task = table[name]
        arm, *others = self._find_arms(scene)[: max(1, len(task.arms))]
        speed, failure = round(self.speed.draw(rng), 4), self._draw_failure(task, scene.twins, rng)
        group = self._find_group(scene)
        placed = self._place_things(task, (arm, *others), assets, rng)
        scene = remove_members(scene, group.name)
        members = [thing.member for thing in placed.values()]
        scene = add_members(scene, group, members, assets)
        bodies = {thing: f"{group.name}/{k}" for k, thing in enumerate(placed)}
        words = {thing: found.words for thing, found in placed.items()}
        assignment = Assignment(
            name,
            task.instruction.format(**words),
            tuple(_condition(condition, bodies) for condition in task.success),
            failure,
            tuple(_joints(task, bodies)),
            deadline_s=self.time_limit_s,
            mistaken=bodies[task.mistaken] if failure == "wrong_object" else "",
        )
        goals = tuple(
            replace(goal, speed=round(speed * step.pace, 4))
            for step, goal in zip(
                task.program, _goals(task, placed, bodies, (arm, *others)), strict=True
            )
        )
        changed = replace(arm, task=goals, assignment=assignment)
        return replace(
            scene, articulations=tuple(changed if a is arm else a for a in scene.articulations)
        )

    def _possible_tasks(self) -> tuple[str, ...]:
        names = tuple(str(name) for name in self.task.outcomes())
        for name in names:
            check_known(name, tuple(self._table()), f"randomizers.{self.name}.task: unknown task")
        return names

    def _table(self) -> dict[str, Task]:
        return {**tasks(), **self.tasks}

    def _find_group(self, scene: Scene) -> ObjectGroup:
        name, known = self.group or self.name, {group.name: group for group in scene.groups}
        fault = f"randomizers.{self.name}.group: the template has no object group"
        check_known(name, tuple(known), fault)
        return known[name]

    def _find_arms(self, scene: Scene) -> tuple[Articulation, ...]:
        """The arm that has the task, then all others."""
        found = [arm for arm in scene.articulations if self.arm in ("", arm.name)][:1]
        if found:
            return (*found, *(arm for arm in scene.articulations if arm not in found))
        known = ", ".join(arm.name for arm in scene.articulations) or "none: add a robot"
        raise errors.ConfigError(f"randomizers.{self.name}.arm: there is no arm; expected {known}")

    def _causes(self, task: Task) -> dict[FailureKind, float]:
        """Weights of the causes by which the failing twin of a task fails."""
        shares = self.failures.shares or dict.fromkeys(get_args(FailureKind)[1:], 1.0)
        limited = self.time_limit_s is not None
        return {
            k: w for k, w in shares.items() if k in task.twin_causes and (limited or k != "late")
        }

    def _draw_failure(self, task: Task, twins: bool, rng: streams.Rng) -> FailureKind:
        """Draw a kind of failure once per scene: all attempts at a layout are to fail alike.

        Else a kind that physics refuses more often than others would be rarer than its share.
        """
        stream = replace(rng.streams, attempt=0).rng(f"{rng.name}/failure")
        draw = float(stream.uniform())
        if twins:
            causes = self._causes(task)
            return [*causes][streams.pick_by_weight([*causes.values()], draw)]
        for kind, share in self.failures.shares.items():
            draw -= share
            if draw < 0.0:
                return kind if kind in task.causes else ""
        return ""

    def _place_things(
        self,
        task: Task,
        arms: Sequence[Articulation],
        assets: interfaces.AssetIndex,
        rng: streams.Rng,
    ) -> "dict[str, _Placed]":
        """Draw asset and pose of every object, apart from the ones before it."""
        T_world_task = _task_frame(arms, assets)
        placed: dict[str, _Placed] = {}
        for name, thing in task.things.items():
            words = sorted(thing.assets)
            chosen = words[int(rng.integers(len(words)))]
            variants = _variants(thing.assets[chosen])
            asset = variants[int(rng.integers(len(variants)))]
            for _ in range(_TRIES):
                found = _draw_place(thing, chosen, asset, T_world_task, placed, assets, rng)
                if thing.near or all(found.is_apart(other) for other in placed.values()):
                    placed[name] = found
                    break
            else:
                raise self.reject(f"no free place for the {chosen}", "another draw, a larger table")
        return placed


@dataclass(frozen=True, slots=True)
class _Placed:
    """An object in the scene; ``half_m`` are half extents along its own axes."""

    words: str
    member: Member
    half_m: Vec3
    middle_m: Vec3
    yaw_rad: float

    @property
    def top_m(self) -> Vec3:
        x, y, z = self.middle_m
        return (x, y, z + self.half_m[2])

    def is_apart(self, other: "_Placed") -> bool:
        one, two = math.hypot(*self.half_m[:2]), math.hypot(*other.half_m[:2])
        return math.dist(self.middle_m[:2], other.middle_m[:2]) > one + two + _APART_M


def _task_frame(arms: Sequence[Articulation], assets: interfaces.AssetIndex) -> SE3:
    """Frame of the places of objects: the arm's base, or midway between the bases of several.

    It is shifted ahead by as much as the workspace of the arm begins farther away than a Panda's.
    """
    first = arms[0].T_world_base
    if len(arms) > 1:
        bases = zip(*(arm.T_world_base.translation_m for arm in arms), strict=True)
        x, y, z = (sum(values) / len(arms) for values in bases)
        first = SE3((x, y, z), first.quaternion_wxyz)
    ahead_m = max(assets.robot(arm.asset).workspace_from_m for arm in arms)
    return first @ SE3((ahead_m - asset_types.WORKSPACE_FROM_M, 0.0, 0.0))


def _draw_place(
    thing: Thing,
    words: str,
    asset: str,
    T_world_task: SE3,
    placed: Mapping[str, _Placed],
    assets: interfaces.AssetIndex,
    rng: streams.Rng,
) -> _Placed:
    x, y = float(rng.uniform(*thing.x_m)), float(rng.uniform(*thing.y_m))
    yaw_rad = math.radians(float(rng.uniform(*thing.yaw_deg)))
    if thing.near:
        near = placed[thing.near]
        foot = near.middle_m[2] - near.half_m[2]
        base = SE3.about_z(near.yaw_rad, (near.middle_m[0], near.middle_m[1], foot))
        yaw_rad += near.yaw_rad
    else:
        base = T_world_task
    low, high = assets.bounds_m(asset)
    half = placement.half_extents_m(low, high, 1.0)
    fixed = thing.mass_kg == 0.0 or thing.joint is not None
    lift = 0.0 if fixed else _LIFT_M
    stand = (base @ SE3((x, y, thing.z_m + lift))).translation_m
    center = tuple(0.5 * (a + b) for a, b in zip(low, high, strict=True))
    turned = SE3.about_z(yaw_rad, stand) @ SE3((-center[0], -center[1], -low[2]))
    mass_kg = assets.get(asset).mass_kg if thing.mass_kg is None else thing.mass_kg
    member = Member(
        asset, turned.rounded(), motion="static" if fixed else "dynamic", mass_kg=mass_kg
    )
    return _Placed(words, member, half, (stand[0], stand[1], stand[2] + half[2]), yaw_rad)


def _variants(asset: str) -> tuple[str, ...]:
    if "?" in asset or "/" in asset:
        return (asset,)
    return tuple(f"{asset}?seed={k}" for k in range(SEEDS))


def _condition(condition: Success, bodies: Mapping[str, str]) -> Condition:
    names = {**bodies, HAND: HAND, "": ""}
    given = condition.model_dump()
    return Condition(**{**given, "body": names[condition.body], "other": names[condition.other]})


def _joints(task: Task, bodies: Mapping[str, str]) -> Iterator[BodyJoint]:
    for name, thing in task.things.items():
        if thing.joint is not None:
            given = thing.joint.model_dump(exclude={"limits"})
            low, high = thing.joint.limits
            yield BodyJoint(body=bodies[name], lower=low, upper=high, **given)


def _goals(
    task: Task,
    placed: Mapping[str, _Placed],
    bodies: Mapping[str, str],
    arms: Sequence[Articulation],
) -> Iterator[ArmGoal]:
    """Goals of a program, in the world."""
    roles = dict(zip(task.arms, arms, strict=True)) if task.arms else {}
    for step, goal in zip(
        task.program, _own_goals(task, placed, bodies, arms[0], roles), strict=True
    ):
        yield replace(goal, arms=tuple(roles[name].name for name in step.arms))


def _own_goals(
    task: Task,
    placed: Mapping[str, _Placed],
    bodies: Mapping[str, str],
    leader: Articulation,
    roles: Mapping[str, Articulation],
) -> Iterator[ArmGoal]:
    latest_m: Vec3 = (0.0, 0.0, 0.0)
    held_yaw_rad = 0.0
    for step in task.program:
        arm = roles[step.arms[0]] if step.arms else leader
        touches = tuple(bodies[name] for name in step.touches)
        if step.verb == "grasp":
            held_yaw_rad = placed[step.at].yaw_rad
            yield ArmGoal("grasp", objects=(bodies[step.at],), phase=step.phase)
            continue
        if step.verb == "grip":
            between = (bodies[step.at],) if step.at else ()
            if step.carries:
                held_yaw_rad = placed[step.at].yaw_rad
            yield ArmGoal(
                "grip",
                gripper_opening=step.opening,
                objects=between,
                carries=step.carries,
                phase=step.phase,
            )
            continue
        frame = _frame(step, placed, arm)
        if step.verb == "move":
            waypoints = tuple(_motions(step, frame, latest_m))
            yield ArmGoal(
                "move", waypoints=waypoints, touches=touches, pivots=step.pivots, phase=step.phase
            )
            continue
        latest_m = (frame @ SE3(step.offset_m)).translation_m
        carried = step.carries or step.verb == "place"
        first, count = math.radians(step.yaw_deg) + _yaw_of(frame), step.yaws or 2
        if carried:
            first = first - held_yaw_rad if step.yaws else 0.0
            count = step.yaws or _YAWS
        turns = [first + 2.0 * math.pi * k / count for k in range(count)]
        if carried:
            poses = tuple(SE3.about_z(turn, latest_m).rounded() for turn in turns)
        else:
            poses = tuple(arm_configuration.hand_pose(latest_m, turn) for turn in turns)
        yield ArmGoal(
            "place" if step.verb == "place" else "reach",
            pose_candidates=poses,
            gripper_opening=step.opening,
            carries=step.carries,
            phase=step.phase,
        )


def _frame(step: Step, placed: Mapping[str, _Placed], arm: Articulation) -> SE3:
    """Frame of a step at the top of its object."""
    if not step.at:
        return IDENTITY
    thing = placed[step.at]
    if step.along == "own":
        return SE3.about_z(thing.yaw_rad, thing.top_m)
    start, end = arm.T_world_base.translation_m, thing.middle_m
    if step.along:
        start, end = thing.middle_m, placed[step.along].middle_m
    return SE3.about_z(math.atan2(end[1] - start[1], end[0] - start[0]), thing.top_m)


def _motions(step: Step, frame: SE3, latest_m: Vec3) -> Iterator[SE3]:
    """Waypoints of a move, as motions in the world."""
    turn = SE3(quaternion_wxyz=frame.quaternion_wxyz)
    moved = IDENTITY
    for by_m in step.by_m:
        moved = SE3((turn @ SE3(by_m)).translation_m)
        yield moved.rounded()
    if step.turn_deg:
        pivot_m = latest_m if step.pivot_m is None else (frame @ SE3(step.pivot_m)).translation_m
        pivot = SE3(pivot_m, frame.quaternion_wxyz)
        count = max(1, math.ceil(abs(step.turn_deg) / 5.0))
        for k in range(1, count + 1):
            half = 0.5 * math.radians(step.turn_deg) * k / count
            x, y, z = (math.sin(half) * a for a in step.axis)
            turned = pivot @ SE3(quaternion_wxyz=(math.cos(half), x, y, z)) @ pivot.inverse()
            yield (turned @ moved).rounded()


def _yaw_of(frame: SE3) -> float:
    w, _, _, z = frame.quaternion_wxyz
    return 2.0 * math.atan2(z, w)
