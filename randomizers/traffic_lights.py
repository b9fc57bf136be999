"""States of traffic lights."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from gen_data.config import distributions as dist
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, Scene
from gen_data.core.se3 import Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers.base import RandomizerBase, add_attributes, body_materials, set_emission

LIT: Mapping[str, tuple[str, ...]] = {
    "red": ("lens_red", "lens_stop"),
    "red_yellow": ("lens_red", "lens_yellow", "lens_stop"),
    "yellow": ("lens_yellow", "lens_stop"),
    "green": ("lens_green", "lens_walk"),
}
"""Roles that emit light in each state; pedestrians walk only while vehicles have green."""

COLORS: Mapping[str, Vec3] = {
    "lens_red": (4.35, 0.1, 0.03),
    "lens_stop": (4.35, 0.1, 0.03),
    "lens_yellow": (2.55, 0.64, 0.0),
    "lens_green": (0.12, 1.3, 0.62),
    "lens_walk": (0.12, 1.3, 0.62),
}
"""Linear RGB of luminance 1, in the chromaticity regions of EN 12368 as far as in sRGB's gamut."""


@dataclass(frozen=True, slots=True)
class Signal:
    """A traffic light: its body, its position, and the axis of the traffic it controls."""

    body: Body
    at_m: Vec3
    axis: tuple[float, float]


class TrafficLights(RandomizerBase):
    """Draws a state per junction; crossing directions never have green at the same time.

    Signals close to each other form a junction. All signals along the axis of its first signal
    show the drawn state; signals across it show red, or green while the first axis has red.
    Pedestrian signals follow the parallel traffic.

    Attributes:
        state: State of a junction's first axis: red, red_yellow, green or yellow.
        luminance_cd_m2: Luminance of a lit lens; 200 cd from a lens of 200 mm is 6400 cd/m^2.
        junction_m: Largest distance between neighbouring signals of one junction.
    """

    type: Literal["traffic_lights"] = "traffic_lights"
    state: Annotated[dist.Name, dist.OneOf(tuple(LIT))] = dist.Choice(
        {"red": 0.46, "green": 0.44, "yellow": 0.06, "red_yellow": 0.04}
    )
    luminance_cd_m2: dist.Positive = dist.Uniform(5000.0, 10000.0)
    junction_m: dist.Positive = dist.Constant(40.0)

    ROLES: ClassVar[frozenset[str]] = frozenset(COLORS)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with every signal set, and its state in the instances' attributes."""
        signals = [
            read_signal(body) for body in scene.bodies if has_lenses(body, assets, self.ROLES)
        ]
        bodies: list[Body] = []
        states: dict[int, tuple[tuple[str, str]]] = {}
        pedestrian = {i.instance_id for i in scene.instances if i.subcategory == "pedestrian"}
        for junction in group_junctions(signals, self.junction_m.draw(rng)):
            state, luminance = self.state.draw(rng), round(self.luminance_cd_m2.draw(rng), 2)
            for signal in junction:
                own = state if runs_along(junction[0], signal) else _crossing_state(state)
                bodies.append(show_state(signal.body, assets, own, luminance))
                number = signal.body.instance_id
                shown = own if number not in pedestrian else "walk" if own == "green" else "stop"
                states[number] = (("state", shown),)
        return add_attributes(scene, states).with_bodies(*bodies)


def _crossing_state(state: str) -> str:
    """State of the other axis. All red would be safe as well, but is rare."""
    return "green" if state == "red" else "red"


def group_junctions(signals: Sequence[Signal], radius_m: float) -> Iterator[list[Signal]]:
    """Group signals linked by distances below ``radius_m``, in order (single linkage)."""
    waiting = list(signals)
    while waiting:
        group, frontier = [waiting[0]], [waiting.pop(0)]
        while frontier:
            here = frontier.pop()
            near = [s for s in waiting if math.dist(s.at_m[:2], here.at_m[:2]) < radius_m]
            waiting = [s for s in waiting if s not in near]
            group += near
            frontier += near
        yield group


def runs_along(first: Signal, other: Signal) -> bool:
    """Whether two signals control traffic along the same axis, within 45 degrees."""
    (ax, ay), (bx, by) = first.axis, other.axis
    return abs(ax * bx + ay * by) >= abs(ax * by - ay * bx)


def read_signal(body: Body) -> Signal:
    """Read a signal from a body, whose front faces the traffic it controls."""
    x, y, _ = body.T_world_body.rotation()[:, 0].tolist()
    return Signal(body, body.T_world_body.translation_m, (x, y))


def has_lenses(body: Body, assets: AssetIndex, roles: frozenset[str]) -> bool:
    """Whether a body has a material slot of any of these roles."""
    return any(material.role in roles for material in body_materials(body, assets))


def show_state(body: Body, assets: AssetIndex, state: str, luminance_cd_m2: float) -> Body:
    """Return the body with the lenses of a state lit and all others dark."""
    emission: dict[str, Vec3] = {}
    for role, color in COLORS.items():
        level = luminance_cd_m2 if role in LIT[state] else 0.0
        r, g, b = (round(level * channel, 2) for channel in color)
        emission[role] = (r, g, b)
    return set_emission(body, assets, emission)
