"""From bodies in the air to bodies at rest, or to the reason why not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from generator.core.errors import Rejection
from generator.core.scene import Body, Surface
from generator.core.se3 import SE3
from generator.physics.bullet import World
from generator.physics.config import PhysicsConfig
from generator.physics.support import guard_walls, home_surface, is_supported

_CHECK_EVERY_S = 0.05
_LIFTS_MAX = 32
_LIFT_M = 0.01
_LOWERINGS_MAX = 16
_RELEASE_GAP_M = 0.002
_TOUCH_M = 0.001
_FALLEN_M = 0.5
"""This far below its lowest surface an object is not waited for any longer."""


class Drop:
    """Bodies that fall in a world where everything else stands still.

    Args:
        world: With all bodies in it.
        falling: The bodies that fall.
        surfaces: ``{body: surfaces that it may end on}``; where there are none, anywhere is fine.
        config: Times and thresholds.
    """

    def __init__(
        self,
        world: World,
        falling: Sequence[Body],
        surfaces: Mapping[str, tuple[Surface, ...]],
        config: PhysicsConfig,
    ) -> None:
        self._world = world
        self._config = config
        self._surfaces = surfaces
        # Lowest first, so that each is lowered onto what lies below it; ties stay in order.
        self._falling = sorted(falling, key=lambda body: float(world.bounds_m(body.name)[0][2]))
        self._time_left_s = config.settle_time_s_max

    def settle(self, fixed: Sequence[str], arms: Sequence[str]) -> Rejection | None:
        """Let everything fall and come to rest; None when all is well."""
        self._lower(fixed, arms)
        guards = self._guards() if self._config.guard_walls else []
        rejection = self._come_to_rest()
        if rejection is None and guards:
            leaning = any(
                (one in guards or other in guards) and gap_m < _TOUCH_M
                for one, other, gap_m in self._world.contacts()
            )
            for name in guards:
                self._world.remove(name)
            rejection = self._come_to_rest() if leaning else None
        return rejection or self._judged()

    def _lower(self, fixed: Sequence[str], arms: Sequence[str]) -> None:
        """Bring each body to just above what is below it: a short fall stays where it lands."""
        movable = list(arms)
        for body in self._falling:
            home = home_surface(self._surfaces[body.name], *self._world.bounds_m(body.name))
            if home is not None:
                self._lift_clear(body.name, movable, home)
                self._sink(body.name, [*fixed, *movable], home)
            movable.append(body.name)

    def _lift_clear(self, name: str, others: Sequence[str], home: Surface) -> None:
        """Raise a body that starts inside others until it is free, as far as there is room."""
        below = self._below(name, others)
        ceiling = home.T_world_surface.translation_m[2] + home.clearance_m
        for _ in range(_LIFTS_MAX):
            overlap = -min((self._world.gap_m(name, other, 0.0) for other in below), default=0.0)
            rise = max(overlap, _LIFT_M)
            if overlap < _TOUCH_M or self._world.bounds_m(name)[1][2] + rise > ceiling:
                return
            self._shift(name, rise)

    def _sink(self, name: str, others: Sequence[str], home: Surface) -> None:
        """Conservative advancement: moving by the gap can never pass through anything."""
        below = self._below(name, others)
        for _ in range(_LOWERINGS_MAX):
            low, _high = self._world.bounds_m(name)
            height = float(low[2]) - home.T_world_surface.translation_m[2]
            gap = min((self._world.gap_m(name, o, max(height, 0.0)) for o in below), default=0.0)
            if gap <= _RELEASE_GAP_M:
                return
            self._shift(name, 0.5 * _RELEASE_GAP_M - gap)

    def _below(self, name: str, others: Sequence[str]) -> list[str]:
        """Those of the others that a vertical motion of the body may meet."""
        low, high = self._world.bounds_m(name)
        met = []
        for other in others:
            other_low, other_high = self._world.bounds_m(other)
            if (low[:2] <= other_high[:2]).all() and (other_low[:2] <= high[:2]).all():
                met.append(other)
        return met

    def _shift(self, name: str, rise_m: float) -> None:
        self._world.place(name, SE3((0.0, 0.0, rise_m)) @ self._world.pose(name))

    def _guards(self) -> list[str]:
        """Put walls around every surface that something will land on."""
        at_home: dict[str, list[str]] = {}
        surfaces: dict[str, Surface] = {}
        for body in self._falling:
            home = home_surface(self._surfaces[body.name], *self._world.bounds_m(body.name))
            if home is not None:
                surfaces[home.name] = home
                at_home.setdefault(home.name, []).append(body.name)
        names = []
        for home in surfaces.values():
            strangers = [b.name for b in self._falling if b.name not in at_home[home.name]]
            for number, (shape, pose) in enumerate(guard_walls(home)):
                name = f"guard/{home.name}/{number}"
                self._world.add(name, shape, pose, friction=0.0, restitution=0.0)
                self._world.ignore(name, strangers)
                names.append(name)
        return names

    def _come_to_rest(self) -> Rejection | None:
        """Let time pass until nothing moves, something fell off, or the time is up."""
        config = self._config
        steps = max(1, round(_CHECK_EVERY_S / config.time_step_s))
        calm_s = 0.0
        while self._falling and self._time_left_s > 0.0:
            self._world.step(steps)
            self._time_left_s -= steps * config.time_step_s
            if any(self._fell(body) for body in self._falling):
                return self._fell_off()
            calm_s = calm_s + steps * config.time_step_s if self._is_calm() else 0.0
            if calm_s >= config.rest_time_s - 1e-9:
                return None
        return self._still_moving() if self._falling else None

    def _is_calm(self) -> bool:
        speeds = [self._world.speed(body.name) for body in self._falling]
        return all(
            speed < self._config.rest_speed_m_s and spin < self._config.rest_spin_rad_s
            for speed, spin in speeds
        )

    def _fell(self, body: Body) -> bool:
        heights = [s.T_world_surface.translation_m[2] for s in self._surfaces[body.name]]
        lowest = min(heights, default=float("-inf"))
        return self._world.pose(body.name).translation_m[2] < lowest - _FALLEN_M

    def _judged(self) -> Rejection | None:
        for body in self._falling:
            surfaces = self._surfaces[body.name]
            if surfaces and not is_supported(surfaces, *self._world.bounds_m(body.name)):
                return self._fell_off()
        deepest = min((gap_m for _, _, gap_m in self._world.contacts()), default=0.0)
        return self._overlapping() if deepest < -self._config.penetration_m_max else None

    def _fell_off(self) -> Rejection:
        guard = "" if self._config.guard_walls else ", or physics.guard_walls: true"
        return Rejection("object fell off", f"{self._fewer()}, or a larger surface{guard}")

    def _still_moving(self) -> Rejection:
        return Rejection(
            f"still moving after {self._config.settle_time_s_max} s",
            f"a larger physics.settle_time_s_max, or {self._fewer()}",
        )

    def _overlapping(self) -> Rejection:
        return Rejection(
            "objects interpenetrate",
            f"{self._fewer()}, a larger surface, or a larger physics.penetration_m_max",
        )

    def _fewer(self) -> str:
        groups = ", ".join(sorted({f"'{body.group}'" for body in self._falling if body.group}))
        return f"fewer objects in {groups} (count)" if groups else "fewer dynamic bodies"
