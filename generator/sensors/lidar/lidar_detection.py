"""From what rays hit to what a laser scanner reports.

The light that comes back is ``reflectance / range^2 * exp(-2 * optical depth)`` (the lidar equation
of an extended target; Wandinger, "Introduction to Lidar", 2005). A scanner's sensitivity sets the
unit: 1 is the light that answers half of the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.capture import LidarHits, SecondaryHits
from gen_data.generator.core.streams import Rng
from gen_data.generator.sensors.lidar.scan_pattern import LidarModel

Float32 = NDArray[np.float32]
UInt16 = NDArray[np.uint16]
UInt8 = NDArray[np.uint8]
LABELS = ("instance_id", "category_id", "surface")
FIELDS = ("range_m", "reflectance", *LABELS)
DETOURS_MAX = 2
"""Of one ray: through glass, and by a mirror."""
Kept = Literal["strongest", "last", "dual"]

STEEPNESS = 6.0
"""From 10 % to 90 % answers takes 2 dB of light: noise of the detector around its threshold."""

RETRO_MAX = 800.0
"""Reflectance of the brightest signs, white matte = 1, reported as 1 (ASTM D4956 type III)."""


@dataclass(frozen=True, eq=False, slots=True)
class Pulses:
    """What may come back of each pulse; arrays are [pulses, candidates].

    Attributes:
        range_m: inf where there is nothing.
        light: Received, in units of what answers half of the time; 0.
        reflectance: As a compensated device sees it, incidence and air included; 0.
        instance_id, category_id, surface: As of LidarHits; air has no ids.
    """

    range_m: Float32
    light: Float32
    reflectance: Float32
    instance_id: UInt16
    category_id: UInt16
    surface: UInt8


def make_pulses(echoes: LidarHits, model: LidarModel, keep: Kept = "dual") -> Pulses:
    """The peaks in the light that comes back to a scanner.

    One per beam of a single ray, unless glass or mirrors show it more and more than the strongest
    is kept; else as many as there are rays.
    """
    fields = {name: getattr(echoes, name) for name in FIELDS}
    rays = echoes.range_m.shape[1]
    if rays == 1:
        light = received_light(echoes.reflectance, echoes.range_m, model)
        pulses = Pulses(echoes.range_m, light, *(fields[name] for name in FIELDS[1:]))
    else:
        pulses = _merged(fields, rays, model)
    if echoes.detours is None:
        return pulses
    pulses = Pulses(*(getattr(pulses, name).copy() for name in Pulses.__slots__))
    if rays == 1 and keep != "strongest":
        none = {name: _nothing(name, fields[name], DETOURS_MAX) for name in FIELDS}
        dark: Float32 = np.zeros(none["range_m"].shape, np.float32)
        more = Pulses(none["range_m"], dark, *(none[name] for name in FIELDS[1:]))
        pulses = join_pulses(pulses, more)
    _put_detours(pulses, fields, echoes.detours, model)
    return pulses


def received_light(reflectance: Float32, range_m: Float32, model: LidarModel) -> Float32:
    """Light from a reflectance at a range through clear air; 0 where there is nothing."""
    reach = np.float32(model.seen.range_m)
    near = reach / np.maximum(range_m, np.float32(1e-3))
    light: Float32 = reflectance * (near * near) * np.float32(1.0 / model.seen.reflectance)
    return light


def join_pulses(pulses: Pulses, more: Pulses) -> Pulses:
    """Candidates of both, side by side."""
    return Pulses(
        *(
            np.concatenate([getattr(pulses, name), getattr(more, name)], axis=1)
            for name in Pulses.__slots__
        )
    )


def is_detected(pulses: Pulses, rng: Rng) -> NDArray[np.bool_]:
    """Which candidates the detector notices: of light L, ``L^k / (1 + L^k)``."""
    draw = rng.random(pulses.light.shape, dtype=np.float32)
    strong = np.minimum(pulses.light, np.float32(100.0)) ** np.float32(STEEPNESS)
    noticed: NDArray[np.bool_] = draw * (1.0 + strong) < strong
    return noticed


def select_returns(
    pulses: Pulses, noticed: NDArray[np.bool_], keep: Kept
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pulse and candidate of every return that is reported, nearest first within a pulse.

    ``dual`` reports the strongest and the last return; the second strongest where both are one.
    """
    light = np.where(noticed, pulses.light, np.float32(-1.0))
    if light.shape[1] == 1:
        (rows,) = np.nonzero(noticed[:, 0])
        return rows, np.zeros_like(rows)
    every = np.arange(len(light))
    far = np.where(noticed, pulses.range_m, np.float32(-1.0))
    strongest, last = light.argmax(axis=1), far.argmax(axis=1)
    chosen = np.zeros(light.shape, np.bool_)
    if keep != "last":
        chosen[every, strongest] = True
    if keep != "strongest":
        chosen[every, last] = True
    if keep == "dual":
        others = light.copy()
        others[every, strongest] = -1.0
        second = np.where(strongest == last, others.argmax(axis=1), last)
        chosen[every, second] = True
    ranges_m = np.where(chosen & noticed, pulses.range_m, np.float32(np.inf))
    order = np.argsort(ranges_m, axis=1, kind="stable")
    rows, ranks = np.nonzero(np.isfinite(np.take_along_axis(ranges_m, order, axis=1)))
    return rows, order[rows, ranks]


def report_intensity(reflectance: Float32, model: LidarModel) -> Float32:
    """What the device says of a reflectance, [0, 1].

    Up to white it is in proportion; retro-reflectors share what is left by the logarithm.
    """
    white = np.float32(model.white_intensity)
    above = np.log(np.maximum(reflectance, np.float32(1.0))) / np.float32(np.log(RETRO_MAX))
    told = white * np.minimum(reflectance, np.float32(1.0)) + (1 - white) * np.minimum(
        above, np.float32(1.0)
    )
    return np.asarray(told, dtype=np.float32)


def _nothing(name: str, like: NDArray[Any], candidates: int) -> NDArray[Any]:
    """What a field of echoes says of nothing, for as many pulses."""
    return np.full((len(like), candidates), np.inf if name == "range_m" else 0, like.dtype)


def _put_detours(
    pulses: Pulses, fields: Mapping[str, NDArray[Any]], detours: SecondaryHits, model: LidarModel
) -> None:
    """Merge what rays met besides into the peaks of their beams, in place; the strongest stay."""
    rays = fields["range_m"].shape[1]
    rivals = np.arange(len(detours.ray))
    if pulses.light.shape[1] == 1:
        rivals = _rivals(pulses, detours, model)
    order = rivals[np.argsort(detours.ray[rivals], kind="stable")]
    ray = detours.ray[order]
    # A ray's second detour, if it has two, goes into a slot of its own.
    again = (np.diff(ray, prepend=-1) == 0).astype(np.int64)
    rows, place = np.unique(ray // rays, return_inverse=True)
    slot = rays * (1 + again) + ray % rays
    wide = {}
    for name in FIELDS:
        nothing = np.inf if name == "range_m" else 0
        further = np.full((len(rows), DETOURS_MAX * rays), nothing, fields[name].dtype)
        wide[name] = np.concatenate([fields[name][rows], further], axis=1)
        wide[name][place, slot] = getattr(detours, name)[order]
    peaks = _merged(wide, rays, model)
    best = np.argsort(-peaks.light, axis=1, kind="stable")[:, : pulses.light.shape[1]]
    for name in Pulses.__slots__:
        getattr(pulses, name)[rows] = np.take_along_axis(getattr(peaks, name), best, axis=1)


def _rivals(pulses: Pulses, detours: SecondaryHits, model: LidarModel) -> NDArray[np.intp]:
    """Detours of the single rays whose strongest peak may change: most are far fainter than it."""
    ray = detours.ray
    light = received_light(detours.reflectance, detours.range_m, model)
    # Two that run into one have at most twice the light of one; a hair for what is rounded.
    strong = (DETOURS_MAX * 1.001) * light >= pulses.light[ray, 0]
    near = detours.range_m - pulses.range_m[ray, 0] <= 1.001 * model.pulse_m
    changed: NDArray[np.bool_] = np.zeros(len(pulses.light), np.bool_)
    changed[ray[strong | near]] = True
    return np.flatnonzero(changed[ray])


def _merged(fields: Mapping[str, NDArray[Any]], rays: int, model: LidarModel) -> Pulses:
    """Ends of one beam's rays that are close to each other are one peak; [pulses, ends].

    A peak has the range and the labels of the ray in it that sends the most light.

    Args:
        fields: Of echoes, [pulses, ends].
        rays: Rays per beam, each with an equal share of its light.
        model: Of the scanner.
    """
    order = np.argsort(fields["range_m"], axis=1, kind="stable")
    sorted_ = {name: np.take_along_axis(fields[name], order, axis=1) for name in FIELDS}
    range_m = sorted_["range_m"]
    share = np.float32(1.0 / rays)
    light = received_light(sorted_["reflectance"], range_m, model) * share
    finite = np.isfinite(range_m)
    gaps = np.diff(np.where(finite, range_m, np.float32(1e9)), axis=1, prepend=range_m[:, :1])
    peak = np.cumsum(gaps > model.pulse_m, axis=1)
    every = np.arange(len(range_m))
    merged = Pulses(
        np.full_like(range_m, np.inf),
        np.zeros_like(light),
        np.zeros_like(light),
        *(np.zeros_like(sorted_[name]) for name in LABELS),
    )
    for k in range(range_m.shape[1]):
        inside = np.where((peak == k) & finite, light, np.float32(-1.0))
        best = inside.argmax(axis=1)
        there = inside[every, best] >= 0.0
        merged.light[:, k] = np.where(inside > 0.0, inside, 0.0).sum(axis=1)
        kept = np.where(inside >= 0.0, sorted_["reflectance"], 0.0)
        merged.reflectance[:, k] = kept.sum(axis=1) * share
        merged.range_m[there, k] = range_m[every, best][there]
        for name in LABELS:
            getattr(merged, name)[there, k] = sorted_[name][every, best][there]
    return merged


def is_beyond_reach(pulses: Pulses, model: LidarModel) -> Pulses:
    """The pulses with no light from outside the range that the device reports."""
    low, high = (np.float32(limit) for limit in model.range_m)
    inside = (pulses.range_m >= low) & (pulses.range_m <= high)
    return replace(pulses, light=np.where(inside, pulses.light, np.float32(0.0)))
