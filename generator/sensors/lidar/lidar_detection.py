"""Detection of laser returns: from hits of rays to reported points.

Received light is ``reflectance / (range^2 + near^2) * exp(-2 * optical depth)``: the lidar equation
of an extended target (Wandinger, "Introduction to Lidar", 2005), whose overlap function
``range^2 / (range^2 + near^2)`` describes a receiver focused at a distance: the blur of a near
target is larger than the detector, in proportion to 1 / range. A device with a second sensitivity,
far away, also loses light exponentially (``LidarModel.loss_per_m``). The scanner's sensitivity sets
the unit: light of 1 is detected half of the time.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from statistics import NormalDist
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core.capture import LidarHits, SecondaryHits
from gen_data.core.streams import Rng
from gen_data.sensors.lidar.scan_pattern import LidarModel

Float32 = NDArray[np.float32]
UInt16 = NDArray[np.uint16]
UInt8 = NDArray[np.uint8]
LABELS = ("instance_id", "category_id", "surface")
FIELDS = ("range_m", "reflectance", *LABELS)
DETOURS_MAX = 2
"""Secondary hits of one ray: through glass, and by a mirror."""
Kept = Literal["strongest", "last", "dual"]

STEEPNESS = 6.0
"""Exponent of the detection curve: 10 % to 90 % detections span about 3 dB of light."""

RETRO_MAX = 800.0
"""Reflectance of the brightest signs, white matte = 1, reported as 1 (ASTM D4956 type III)."""


@dataclass(frozen=True, eq=False, slots=True)
class Pulses:
    """Candidate returns of each pulse; arrays are [pulses, candidates].

    Attributes:
        range_m: inf = no return.
        light: Received light; 1 is detected half of the time; 0.
        reflectance: After range compensation, including incidence and attenuation; 0.
        instance_id, category_id, surface: As in LidarHits; air has no ids.
    """

    range_m: Float32
    light: Float32
    reflectance: Float32
    instance_id: UInt16
    category_id: UInt16
    surface: UInt8


def make_pulses(echoes: LidarHits, model: LidarModel, keep: Kept = "dual") -> Pulses:
    """Find the peaks in the received light of each pulse.

    One candidate per beam of a single ray, and more with glass or mirrors unless only the strongest
    return is kept; for beams of several rays, one per ray.
    """
    fields = {name: getattr(echoes, name) for name in FIELDS}
    rays = echoes.range_m.shape[1]
    if rays == 1:
        light = received_light(echoes.reflectance, echoes.range_m, model)
        pulses = Pulses(echoes.range_m, light, *(fields[name] for name in FIELDS[1:]))
    else:
        pulses = _merge_peaks(fields, rays, model)
    if echoes.detours is None:
        return pulses
    pulses = Pulses(*(getattr(pulses, name).copy() for name in Pulses.__slots__))
    if rays == 1 and keep != "strongest":
        none = {name: _empty_field(name, fields[name], DETOURS_MAX) for name in FIELDS}
        dark: Float32 = np.zeros(none["range_m"].shape, np.float32)
        more = Pulses(none["range_m"], dark, *(none[name] for name in FIELDS[1:]))
        pulses = join_pulses(pulses, more)
    _add_secondary_hits(pulses, fields, echoes.detours, model)
    return pulses


def received_light(reflectance: Float32, range_m: Float32, model: LidarModel) -> Float32:
    """Light received from a reflectance at a range through clear air; 0 without reflectance."""
    near2 = np.float32(model.near_m**2)
    unit = np.float32((model.seen.range_m**2 + model.near_m**2) / model.seen.reflectance)
    away = np.maximum(range_m, np.float32(1e-3))
    light = reflectance * (unit / (away * away + near2))
    if model.loss_per_m > 0.0:
        light *= np.exp(np.float32(-model.loss_per_m) * (away - np.float32(model.seen.range_m)))
    return np.asarray(light)


def join_pulses(pulses: Pulses, more: Pulses) -> Pulses:
    """Concatenate the candidates of both."""
    return Pulses(
        *(
            np.concatenate([getattr(pulses, name), getattr(more, name)], axis=1)
            for name in Pulses.__slots__
        )
    )


def replace_pulses(pulses: Pulses, which: NDArray[np.intp], finer: Pulses) -> Pulses:
    """The pulses with other candidates of those at the indices ``which`` [m]."""
    found = np.isfinite(finer.range_m)
    most = int(found.sum(axis=1).max(initial=0))
    columns = max(most, pulses.light.shape[1])
    first = np.argsort(~found, axis=1, kind="stable")[:, :columns]
    joined = {}
    for name in Pulses.__slots__:
        old, new = getattr(pulses, name), getattr(finer, name)
        wide = _empty_field(name, old, columns)
        wide[:, : old.shape[1]] = old
        wide[which] = _empty_field(name, new, columns)
        wide[which, : first.shape[1]] = np.take_along_axis(new, first, axis=1)
        joined[name] = wide
    return Pulses(**joined)


def is_detected(pulses: Pulses, rng: Rng) -> NDArray[np.bool_]:
    """Draw whether each candidate is detected: for light L with ``p = L^k / (1 + L^k)``."""
    draw = rng.random(pulses.light.shape, dtype=np.float32)
    # The bound avoids overflow of the power; there p is 1 to float precision.
    odds = np.minimum(pulses.light, np.float32(100.0)) ** np.float32(STEEPNESS)
    return np.asarray(draw * (1.0 + odds) < odds)


def select_returns(
    pulses: Pulses, detected: NDArray[np.bool_], keep: Kept
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pulse and candidate of every reported return, [n] each, nearest first within a pulse.

    ``dual`` reports the strongest and the last return, or the second strongest if these coincide.
    """
    light = np.where(detected, pulses.light, np.float32(-1.0))
    if light.shape[1] == 1:
        (rows,) = np.nonzero(detected[:, 0])
        return rows, np.zeros_like(rows)
    every = np.arange(len(light))
    far = np.where(detected, pulses.range_m, np.float32(-1.0))
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
    ranges_m = np.where(chosen & detected, pulses.range_m, np.float32(np.inf))
    order = np.argsort(ranges_m, axis=1, kind="stable")
    rows, ranks = np.nonzero(np.isfinite(np.take_along_axis(ranges_m, order, axis=1)))
    return rows, order[rows, ranks]


def report_intensity(reflectance: Float32, model: LidarModel) -> Float32:
    """Intensity in [0, 1] that the device reports for a reflectance.

    Proportional up to white, then logarithmic for retro-reflectors.
    """
    white = np.float32(model.white_intensity)
    above = np.log(np.maximum(reflectance, np.float32(1.0))) / np.float32(np.log(RETRO_MAX))
    intensity = white * np.minimum(reflectance, np.float32(1.0)) + (1 - white) * np.minimum(
        above, np.float32(1.0)
    )
    return np.asarray(intensity, dtype=np.float32)


def measure_intensity(
    reflectance: Float32, range_m: Float32, ring: UInt16, model: LidarModel, rng: Rng
) -> Float32:
    """Intensity in [0, 1] that the device measures for returns [n], with its errors."""
    response = model.response
    if response is None:
        return report_intensity(reflectance, model)
    c = reflectance
    if response.range_exponent > 0.0:
        away = range_m * np.float32(1.0 / model.near_m)
        c = c * (1.0 + away * away) ** np.float32(-response.range_exponent)
    white = np.float32(model.white_intensity)
    half, dark = np.float32(response.half), np.float32(response.dark)
    matte = np.minimum(c, np.float32(1.0))
    above = np.log(np.maximum(c, np.float32(1.0))) / np.float32(np.log(RETRO_MAX))
    signal = (white + dark) * (1.0 + half) * matte / (matte + half)
    signal += (1.0 - white) * np.minimum(above, np.float32(1.0))
    signal *= laser_gains(int(ring.max(initial=0)) + 1, response.laser_spread)[ring]
    noise = rng.standard_normal(len(c), dtype=np.float32)
    intensity = np.clip(signal - dark + np.float32(response.noise) * noise, 0.0, 1.0)
    if response.step > 0.0:
        intensity = np.floor(intensity / np.float32(response.step)) * np.float32(response.step)
    return np.asarray(intensity, dtype=np.float32)


@lru_cache(maxsize=8)
def laser_gains(rings: int, spread: float) -> Float32:
    """Gains of a device's lasers, [rings]: the same for each, normal with mean 1."""
    # Quantiles in golden-ratio order: neighbours differ, and any number of lasers fills the range.
    shares = [(0.5 + k * (math.sqrt(5.0) - 1.0) / 2.0) % 1.0 for k in range(rings)]
    normal = NormalDist(1.0, spread) if spread > 0.0 else None
    gains = [normal.inv_cdf(share) if normal else 1.0 for share in shares]
    return np.array(gains, np.float32)


def _empty_field(name: str, like: NDArray[Any], candidates: int) -> NDArray[Any]:
    """A field of candidates without a return, [pulses, candidates]."""
    return np.full((len(like), candidates), np.inf if name == "range_m" else 0, like.dtype)


def _add_secondary_hits(
    pulses: Pulses, fields: Mapping[str, NDArray[Any]], detours: SecondaryHits, model: LidarModel
) -> None:
    """Merge secondary hits into the peaks of their beams, in place; the strongest peaks remain."""
    rays = fields["range_m"].shape[1]
    rivals = np.arange(len(detours.ray))
    if pulses.light.shape[1] == 1:
        rivals = _relevant_hits(pulses, detours, model)
    order = rivals[np.argsort(detours.ray[rivals], kind="stable")]
    ray = detours.ray[order]
    # The second hit of a ray, if it has two, goes into a separate slot.
    again = (np.diff(ray, prepend=-1) == 0).astype(np.int64)
    rows, place = np.unique(ray // rays, return_inverse=True)
    slot = rays * (1 + again) + ray % rays
    wide = {}
    for name in FIELDS:
        first = fields[name][rows]
        wide[name] = np.concatenate([first, _empty_field(name, first, DETOURS_MAX * rays)], axis=1)
        wide[name][place, slot] = getattr(detours, name)[order]
    peaks = _merge_peaks(wide, rays, model)
    best = np.argsort(-peaks.light, axis=1, kind="stable")[:, : pulses.light.shape[1]]
    for name in Pulses.__slots__:
        getattr(pulses, name)[rows] = np.take_along_axis(getattr(peaks, name), best, axis=1)


def _relevant_hits(pulses: Pulses, detours: SecondaryHits, model: LidarModel) -> NDArray[np.intp]:
    """Indices of secondary hits that may change the strongest peak of their ray; most are faint."""
    ray = detours.ray
    light = received_light(detours.reflectance, detours.range_m, model)
    # Two merged hits have at most twice the light of one; 1.001 allows for rounding.
    strong = (DETOURS_MAX * 1.001) * light >= pulses.light[ray, 0]
    near = detours.range_m - pulses.range_m[ray, 0] <= 1.001 * model.pulse_m
    changed: NDArray[np.bool_] = np.zeros(len(pulses.light), np.bool_)
    changed[ray[strong | near]] = True
    return np.flatnonzero(changed[ray])


def _merge_peaks(fields: Mapping[str, NDArray[Any]], rays: int, model: LidarModel) -> Pulses:
    """Merge hits of a beam's rays that are closer than a pulse into peaks, [pulses, hits].

    A peak has the range and the labels of its brightest hit; each ray has an equal share of the
    beam's light. ``fields`` are of hits, [pulses, hits].
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


def clip_range(pulses: Pulses, model: LidarModel) -> Pulses:
    """Remove the light of candidates outside the range that the device reports."""
    low, high = (np.float32(limit) for limit in model.range_m)
    inside = (pulses.range_m >= low) & (pulses.range_m <= high)
    return replace(pulses, light=np.where(inside, pulses.light, np.float32(0.0)))
