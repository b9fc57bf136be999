"""State changes of bodies in traffic: vehicle lamps, signals and the gait of pedestrians."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.asset_ids import AssetId, parse_asset_id
from gen_data.core.asset_types import Material
from gen_data.core.interfaces import AssetIndex
from gen_data.core.motion import StateChange
from gen_data.core.scene import Body, Scene
from gen_data.core.se3 import Array, Vec3
from gen_data.randomizers.base import add_attributes, body_materials, scale_emission, set_emission
from gen_data.randomizers.pedestrian_poses import stride_phases
from gen_data.randomizers.traffic_lights import Signal, show_state
from gen_data.randomizers.vehicle_lights import AMBER, RED
from gen_data.traffic.pedestrians import stride_m
from gen_data.traffic.signal_cycles import Approach
from gen_data.traffic.simulation import STEP_S
from gen_data.traffic.vehicles import Entry

BRAKES_M_S2 = 0.7
"""Deceleration from which brake lights are on (UN R13-H, 5.2.22.4); also at a standstill."""
BRAKES_S = 0.3
"""Shortest time that brake lights stay on."""
SIGNALLED_M = 30.0
"""Distance before a turn at which the indicator starts."""
TURNS = 0.25
"""Sine of half the smallest angle of a turn, 29 degrees."""
BLINKS_PER_S = 1.5
"""UN R48, 6.5.9.1: 90 a minute, give or take 30."""
STANDS_M_S, WALKS_M_S = 0.05, 0.2
"""Speeds below which a pedestrian stands and above which one walks again (hysteresis)."""
DEFAULT_HEIGHT_M = 1.7

S = TypeVar("S")
Lamps = tuple[bool, str, bool]
"""Whether a vehicle brakes, its indicated turn, and whether that indicator is lit now."""


def lamp_states(
    station_m: Array,
    speed_m_s: Array,
    acceleration_m_s2: Array,
    front_m: float,
    entries: Sequence[Entry],
    blink: float,
) -> list[Lamps]:
    """Compute the states of a vehicle's lamps at every step.

    Args:
        station_m: Position of the rear axle along the route [t].
        speed_m_s: Speed [t].
        acceleration_m_s2: Acceleration [t].
        front_m: Distance from the rear axle to the front.
        entries: Junctions on the route.
        blink: Phase of the indicator at time 0, in [0, 1).
    """
    brakes = (acceleration_m_s2 < -BRAKES_M_S2) | (speed_m_s < STANDS_M_S)
    held = _hold(brakes, round(BRAKES_S / STEP_S))
    turns = ["none"] * len(station_m)
    for entry in entries:
        if abs(entry.turn) < TURNS:
            continue
        near = (station_m + front_m > entry.at_m - SIGNALLED_M) & (station_m < entry.leave_m)
        for k in np.flatnonzero(near).tolist():
            turns[k] = "left" if entry.turn > 0.0 else "right"
    half = 0.5 / BLINKS_PER_S
    return [
        (brake, turn, turn != "none" and int((k * STEP_S + 1e-9) / half + 2.0 * blink) % 2 == 0)
        for k, (brake, turn) in enumerate(zip(held.tolist(), turns, strict=True))
    ]


def lamp_changes(
    body: Body, assets: AssetIndex, states: Sequence[Lamps], brake_cd_m2: float, blink_cd_m2: float
) -> list[StateChange]:
    """State changes of a vehicle's lamps from time 0; empty if it has no such lamps."""
    roles = {material.role for material in body_materials(body, assets)}
    if not roles & {"brakelight", "indicator_left", "indicator_right"}:
        return []

    def change(time_s: float, state: Lamps) -> StateChange:
        brake, turn, lit = state
        dark: Vec3 = (0.0, 0.0, 0.0)
        glow = {"brakelight": scale_emission(RED, brake_cd_m2) if brake else dark}
        for side in ("left", "right"):
            on = lit and turn == side
            glow[f"indicator_{side}"] = scale_emission(AMBER, blink_cd_m2) if on else dark
        facts = (("brake_lights", "on" if brake else "off"), ("indicator", turn))
        return StateChange(time_s, body.name, "", set_emission(body, assets, glow).materials, facts)

    return _changes(states, change)


def signal_changes(
    signal: Signal, approach: Approach, assets: AssetIndex, lens_cd_m2: float, until_s: float
) -> list[StateChange]:
    """State changes of a traffic light from time 0."""
    made = []
    for time_s in (0.0, *approach.cycle.switches_s(approach.axis, until_s)):
        state = approach.state(time_s)
        lit: tuple[Material, ...] = show_state(signal.body, assets, state, lens_cd_m2).materials
        facts = (("state", state),)
        made.append(StateChange(time_s, signal.body.name, "", lit, facts))
    return made


def gait_changes(
    body: Body, assets: AssetIndex, walked_m: Array, pace_m_s: Array, start: float
) -> list[StateChange]:
    """State changes of a pedestrian who walks and stands; empty for assets without poses.

    Args:
        body: Body of the pedestrian.
        assets: Library of its asset.
        walked_m: Distance walked since time 0 [t].
        pace_m_s: Walking speed [t].
        start: Phase of the stride at time 0, in [0, 1).
    """
    known = dict(assets.get(body.asset).attributes)
    if "pose" not in known:
        return []
    asset = parse_asset_id(body.asset)
    stride = body.scale * stride_m(float(known.get("height_m", DEFAULT_HEIGHT_M)))
    count = stride_phases()
    phases = np.floor((start + walked_m / stride) * count).astype(np.int64) % count
    standing = np.zeros(len(phases), bool)
    still = False
    for k, pace in enumerate(pace_m_s.tolist()):
        still = pace < (WALKS_M_S if still else STANDS_M_S)
        standing[k] = still
    states = np.where(standing, -1, phases).tolist()
    rest = "stand_umbrella" if known["pose"] == "walk_umbrella" else "stand"
    at_rest = str(AssetId(asset.name, {**asset.parameters, "pose": rest}))
    walking = [
        str(AssetId(asset.name, {**asset.parameters, "phase": k / count})) for k in range(count)
    ]
    facts = {
        of: tuple(p for p in assets.get(of).attributes if p[0] in ("behaviour", "pose"))
        for of in (at_rest, walking[0])
    }

    def change(time_s: float, state: int) -> StateChange:
        if state < 0:
            return StateChange(time_s, body.name, at_rest, (), facts[at_rest])
        return StateChange(time_s, body.name, walking[state], (), facts[walking[0]])

    return _changes(states, change)


def apply_first_changes(scene: Scene, changes: Iterable[StateChange]) -> Scene:
    """Return the scene with its state changes at time 0 applied."""
    first = {change.body: change for change in changes if change.time_s == 0.0}
    bodies = tuple(
        replace(
            body, asset=change.asset or body.asset, materials=change.materials or body.materials
        )
        if (change := first.get(body.name)) is not None
        else body
        for body in scene.bodies
    )
    by_id = {body.instance_id: first[body.name] for body in bodies if body.name in first}
    instances = tuple(
        replace(i, asset=by_id[i.instance_id].asset or i.asset) if i.instance_id in by_id else i
        for i in scene.instances
    )
    changed = replace(scene, bodies=bodies, instances=instances)
    return add_attributes(changed, {number: c.attributes for number, c in by_id.items()})


def _hold(on: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
    """Extend every True over at least this many steps."""
    held: NDArray[np.bool_] = on.copy()
    for k in range(1, steps):
        held[k:] |= on[:-k]
    return held


def _changes(states: Sequence[S], change: Callable[[float, S], StateChange]) -> list[StateChange]:
    """Make a change at time 0 and wherever a state differs from the previous one."""
    return [
        change(round(k * STEP_S, 6), state)
        for k, state in enumerate(states)
        if k == 0 or state != states[k - 1]
    ]
