"""Settling: lets bodies fall on their surfaces until they rest, or rejects the layout."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from gen_data.core.errors import Rejection
from gen_data.core.scene import Body, Scene, SupportSurface
from gen_data.core.se3 import SE3, Array
from gen_data.physics.collision_shapes import CollisionShape, box_shape
from gen_data.physics.physics_config import PhysicsConfig
from gen_data.physics.world import World

_CHECK_EVERY_S = 0.05
_LIFTS_MAX = 32
_LIFT_M = 0.01
_LOWERINGS_MAX = 16
_RELEASE_GAP_M = 0.002
_TOUCH_M = 0.001
_ATTEMPTS_MAX = 4
_LOST_M = 0.3
"""An object this far below its lowest surface is lost."""
_SINK_M = 0.02
"""Tolerance of a body's bottom below its surface: more than any contact error."""
_WALL_THICKNESS_M = 1.0
_WALL_BELOW_M = 0.5
_WALL_ABOVE_M = 5.0


class Settling:
    """Lets bodies fall in a world where everything else is static.

    Args:
        world: Contains all bodies.
        falling: The bodies that fall.
        surfaces: ``{body: surfaces it may rest on}``; a body without surfaces may rest anywhere.
        config: Times and thresholds.
    """

    def __init__(
        self,
        world: World,
        falling: Sequence[Body],
        surfaces: Mapping[str, tuple[SupportSurface, ...]],
        config: PhysicsConfig,
    ) -> None:
        self._world = world
        self._config = config
        self._surfaces = surfaces
        # Lowest first: each is lowered onto the ones below it; the sort is stable.
        self._falling = sorted(falling, key=lambda body: float(world.bounds_m(body.name)[0][2]))
        self._homes = {
            body.name: home_surface(surfaces[body.name], *world.bounds_m(body.name))
            for body in falling
        }

    def settle(self, fixed: Sequence[str], arms: Sequence[str]) -> Rejection | None:
        """Simulate until all bodies rest; None = success, else the reason.

        With guard walls, bodies that still fall off are dropped again a few times, each time
        nearer to the middle of their surface.
        """
        loose = self._falling
        for attempt in range(_ATTEMPTS_MAX if self._config.guard_walls else 1):
            for body in loose:
                self._restart(body, pull=1.0 - 0.5**attempt)
            self._lower(loose, fixed, arms)
            if not self._rest_guarded():
                return Rejection(
                    f"still moving after {self._config.settle_time_s_max} s",
                    f"a larger physics.settle_time_s_max, or {self._fewer()}",
                )
            loose = [body for body in self._falling if not self._is_supported(body)]
            if not loose:
                break
            if any(self._homes[body.name] is None for body in loose):
                return self._fell_off(loose)
        return self._fell_off(loose) if loose else self._check_overlaps()

    def _restart(self, body: Body, pull: float) -> None:
        """Put a body at its initial pose, moved by a share towards the middle of its surface."""
        home = self._homes[body.name]
        x, y, z = body.T_world_body.translation_m
        if home is not None:
            to_x, to_y, _ = home.T_world_surface.translation_m
            x, y = x + pull * (to_x - x), y + pull * (to_y - y)
        self._world.place(body.name, SE3((x, y, z), body.T_world_body.quaternion_wxyz))

    def _rest_guarded(self) -> bool:
        """Whether all bodies come to rest inside guard walls, and again after their removal."""
        guards = self._guards() if self._config.guard_walls else []
        rests = self._come_to_rest()
        leaning = any(
            (c.one in guards or c.other in guards) and c.gap_m < _TOUCH_M
            for c in (self._world.contacts() if guards else ())
        )
        for name in guards:
            self._world.remove(name)
        return self._come_to_rest() if rests and leaning else rests

    def _lower(self, loose: Sequence[Body], fixed: Sequence[str], arms: Sequence[str]) -> None:
        """Lower each body to just above the next obstacle: short falls scatter objects little."""
        names = [body.name for body in loose]
        movable = [*arms, *(b.name for b in self._falling if b.name not in names)]
        for name in names:
            home = self._homes[name]
            if home is not None:
                self._lift_clear(name, movable, home)
                self._sink(name, [*fixed, *movable], home)
            movable.append(name)

    def _lift_clear(self, name: str, others: Sequence[str], home: SupportSurface) -> None:
        """Raise a body that overlaps others until it is free or reaches the ceiling."""
        below = self._below(name, others)
        ceiling = home.T_world_surface.translation_m[2] + home.clearance_m
        for _ in range(_LIFTS_MAX):
            overlap = -min((self._world.gap_m(name, other, 0.0) for other in below), default=0.0)
            rise = max(overlap, _LIFT_M)
            if overlap < _TOUCH_M or self._world.bounds_m(name)[1][2] + rise > ceiling:
                return
            self._shift(name, rise)

    def _sink(self, name: str, others: Sequence[str], home: SupportSurface) -> None:
        """Lower a body by conservative advancement: a motion by the gap never tunnels."""
        below = self._below(name, others)
        for _ in range(_LOWERINGS_MAX):
            low, _high = self._world.bounds_m(name)
            height = float(low[2]) - home.T_world_surface.translation_m[2]
            gap = min((self._world.gap_m(name, o, max(height, 0.0)) for o in below), default=0.0)
            if gap <= _RELEASE_GAP_M:
                return
            self._shift(name, 0.5 * _RELEASE_GAP_M - gap)

    def _below(self, name: str, others: Sequence[str]) -> list[str]:
        """The others whose footprint overlaps the body's."""
        low, high = self._world.bounds_m(name)
        below = []
        for other in others:
            other_low, other_high = self._world.bounds_m(other)
            if (low[:2] <= other_high[:2]).all() and (other_low[:2] <= high[:2]).all():
                below.append(other)
        return below

    def _shift(self, name: str, rise_m: float) -> None:
        self._world.place(name, SE3((0.0, 0.0, rise_m)) @ self._world.pose(name))

    def _guards(self) -> list[str]:
        """Add walls around every surface that a body will land on; their names."""
        names = []
        homes = {home.name: home for home in self._homes.values() if home is not None}
        for home in homes.values():
            unrelated = [name for name, other in self._homes.items() if other is not home]
            for number, (shape, pose) in enumerate(guard_walls(home)):
                name = f"guard/{home.name}/{number}"
                self._world.add(name, shape, pose, friction=0.0, restitution=0.0)
                self._world.ignore(name, unrelated)
                names.append(name)
        return names

    def _come_to_rest(self) -> bool:
        """Simulate until all bodies rest or one is lost; False if time runs out first."""
        config = self._config
        steps = max(1, round(_CHECK_EVERY_S / config.time_step_s))
        elapsed_s, calm_s = 0.0, 0.0
        while elapsed_s < config.settle_time_s_max:
            self._world.step(steps)
            elapsed_s += steps * config.time_step_s
            calm_s = calm_s + steps * config.time_step_s if self._is_calm() else 0.0
            if calm_s >= config.rest_time_s - 1e-9 or any(map(self._is_lost, self._falling)):
                return True
        return not self._falling

    def _is_calm(self) -> bool:
        speeds = [self._world.speed(body.name) for body in self._falling]
        return all(
            speed < self._config.rest_speed_m_s and spin < self._config.rest_spin_rad_s
            for speed, spin in speeds
        )

    def _is_lost(self, body: Body) -> bool:
        heights = [s.T_world_surface.translation_m[2] for s in self._surfaces[body.name]]
        lowest = min(heights, default=float("-inf"))
        return self._world.pose(body.name).translation_m[2] < lowest - _LOST_M

    def _is_supported(self, body: Body) -> bool:
        surfaces = self._surfaces[body.name]
        return not surfaces or is_supported(surfaces, *self._world.bounds_m(body.name))

    def _check_overlaps(self) -> Rejection | None:
        worst = min(self._world.contacts(), key=lambda contact: contact.gap_m, default=None)
        if worst is None or worst.gap_m >= -self._config.penetration_m_max:
            return None
        remedy = f"{self._fewer()}, a larger surface, or a larger physics.penetration_m_max"
        detail = f"'{worst.one}' and '{worst.other}' overlap by {-1e3 * worst.gap_m:.1f} mm"
        return Rejection("objects interpenetrate", remedy, detail, -worst.gap_m)

    def _fell_off(self, loose: Sequence[Body]) -> Rejection:
        guard = "" if self._config.guard_walls else ", or physics.guard_walls: true"
        remedy = f"{self._fewer()}, or a larger surface{guard}"
        others = f" and {len(loose) - 1} more" if len(loose) > 1 else ""
        detail = f"'{loose[0].name}'{others} of {len(self._falling)} objects fell off"
        # Worse than any overlap, which is less than a metre.
        return Rejection("object fell off", remedy, detail, float(len(loose)))

    def _fewer(self) -> str:
        groups = ", ".join(sorted({f"'{body.group}'" for body in self._falling if body.group}))
        return f"fewer objects in {groups} (count)" if groups else "fewer dynamic bodies"


def candidate_surfaces(scene: Scene, body: Body) -> tuple[SupportSurface, ...]:
    """Surfaces that a body may rest on: its group's, or all if it has none."""
    for group in scene.groups:
        if group.name == body.group:
            return tuple(s for s in scene.surfaces if s.name in group.surfaces)
    return scene.surfaces


def home_surface(
    surfaces: Iterable[SupportSurface], low_m: Array, high_m: Array
) -> SupportSurface | None:
    """The nearest surface below a body with these bounds; None if there is none."""
    below = [s for s in surfaces if _holds(s, low_m, high_m, slack_m=0.0)]
    return max(below, key=lambda s: s.T_world_surface.translation_m[2], default=None)


def is_supported(surfaces: Iterable[SupportSurface], low_m: Array, high_m: Array) -> bool:
    """Whether a body with these bounds is above a surface extended by the body's size."""
    size_m = float((high_m - low_m).max())
    return any(_holds(s, low_m, high_m, slack_m=size_m) for s in surfaces)


def is_within(surfaces: Iterable[SupportSurface], low_m: Array, high_m: Array) -> bool:
    """Whether the whole footprint of a body with these bounds is above one surface."""
    corners = [
        np.array([x, y, low_m[2]]) for x in (low_m[0], high_m[0]) for y in (low_m[1], high_m[1])
    ]
    return any(all(_holds(s, at, at, slack_m=0.0) for at in corners) for s in surfaces)


def guard_walls(surface: SupportSurface) -> list[tuple[CollisionShape, SE3]]:
    """Shapes and poses of four walls around an open surface; [] for a walled one."""
    if surface.walled:
        return []
    half_x, half_y = (0.5 * size for size in surface.size_m)
    thick = _WALL_THICKNESS_M
    along_x = _box(half_x + thick, 0.5 * thick)
    along_y = _box(0.5 * thick, half_y + thick)
    sides = [
        (along_x, 0.0, half_y + 0.5 * thick),
        (along_x, 0.0, -half_y - 0.5 * thick),
        (along_y, half_x + 0.5 * thick, 0.0),
        (along_y, -half_x - 0.5 * thick, 0.0),
    ]
    return [(shape, surface.T_world_surface @ SE3((x, y, 0.0))) for shape, x, y in sides]


def _box(half_x: float, half_y: float) -> CollisionShape:
    return box_shape((-half_x, -half_y, -_WALL_BELOW_M), (half_x, half_y, _WALL_ABOVE_M))


def _holds(surface: SupportSurface, low_m: Array, high_m: Array, slack_m: float) -> bool:
    """Whether the centre of bounds is within the rectangle and their bottom not below it."""
    center = 0.5 * (low_m + high_m)
    x, y, _ = surface.T_world_surface.inverse().apply(center)
    under = np.array([center[0], center[1], low_m[2]])
    height = float(surface.T_world_surface.inverse().apply(under)[2])
    return (
        abs(float(x)) <= 0.5 * surface.size_m[0] + slack_m
        and abs(float(y)) <= 0.5 * surface.size_m[1] + slack_m
        and height >= -_SINK_M
    )
