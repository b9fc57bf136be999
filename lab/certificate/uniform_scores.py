"""Drawn values as uniform numbers: the probability integral transform.

If a value follows its distribution F, F(value) is uniform in [0, 1] (Rosenblatt, "Remarks on a
multivariate transformation", Annals of Mathematical Statistics 23, 1952). Values of any number of
distributions can then be judged together, as for a parameter that depends on shared values. A
discrete value is spread evenly over the step of F at it, by a separate random number (Smith,
"Diagnostic checks of non-standard time series models", Journal of Forecasting 4, 1985). A vector
has one score per degree of freedom.

Formulas are taken from the cumulative distributions, not from the code that draws: nothing here
calls
``draw``.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from gen_data.config import distributions
from gen_data.core.streams import Rng

ROUNDING = 1e-9
"""Drawn values are rounded to twelve significant digits and may leave [0, 1] by less than this."""

Scores = tuple[float, ...]


def uniform_scores(
    distribution: distributions.Distribution[Any], value: Any, rng: Rng
) -> Scores | None:
    """Scores of one drawn value, each uniform in [0, 1] if it follows the distribution.

    Args:
        distribution: As declared.
        value: Drawn from it.
        rng: Spreads discrete values.

    Returns:
        None for a value that the distribution cannot give; empty for distributions without
        randomness, such as sequences, and for third-party distributions.
    """
    transform = _TRANSFORMS.get(type(distribution))
    if transform is None:
        return ()
    scores = transform(distribution, value, rng)
    if not all(-ROUNDING <= score <= 1.0 + ROUNDING for score in scores):
        return None
    return tuple(min(max(score, 0.0), 1.0) for score in scores)


def _interval(low: float, high: float, value: float) -> float:
    """Position in an interval that is not empty."""
    return (value - low) / (high - low)


def _fixed(expected: float, value: float) -> Scores:
    """No score, as there is no randomness; an impossible one for another value."""
    return () if math.isclose(value, expected, rel_tol=1e-9, abs_tol=1e-12) else (math.nan,)


def _uniform(d: distributions.Uniform, value: float, rng: Rng) -> Scores:
    del rng
    return (_interval(d.low, d.high, value),) if d.high > d.low else _fixed(d.low, value)


def _log_uniform(d: distributions.LogUniform, value: float, rng: Rng) -> Scores:
    del rng
    if d.low == d.high:
        return _fixed(d.low, value)
    return (_interval(math.log(d.low), math.log(d.high), math.log(value)),)


def _normal(d: distributions.Normal, value: float, rng: Rng) -> Scores:
    from scipy import stats

    del rng
    low, high = d.support()
    if d.stddev == 0.0 or low == high:
        return _fixed(min(max(d.center, low), high), value)
    if not low <= value <= high:
        return (math.nan,)
    a, b = (low - d.center) / d.stddev, (high - d.center) / d.stddev
    return (float(stats.truncnorm.cdf((value - d.center) / d.stddev, a, b)),)


def _uniform_integer(d: distributions.UniformInteger, value: int, rng: Rng) -> Scores:
    if value != int(value):
        return (math.nan,)
    if d.low == d.high:
        return _fixed(d.low, value)
    if not d.low <= value <= d.high:
        return (math.nan,)
    return ((value - d.low + rng.random()) / (d.high - d.low + 1),)


def _mixture(d: distributions.Mixture[Any], value: float, rng: Rng) -> Scores:
    """The weighted mean of the parts' scores, whose steps are spread by one number.

    Empty if a part is of another kind than below, such as a choice.
    """
    spread = rng.random()
    same: Any = SimpleNamespace(random=lambda: spread)
    score, is_possible = 0.0, False
    for part, weight in zip(d.parts, d.weights, strict=True):
        if not isinstance(
            part,
            (
                distributions.Constant,
                distributions.LogUniform,
                distributions.Normal,
                distributions.Uniform,
                distributions.UniformInteger,
            ),
        ):
            return ()
        low, high = part.support()
        if weight > 0.0 and low <= value <= high:
            is_possible = True
            score += weight * (uniform_scores(part, value, same) or (spread,))[0]
        elif value > high:
            score += weight
    return (score / sum(d.weights),) if is_possible else (math.nan,)


def _choice(d: distributions.Choice[Any], value: Any, rng: Rng) -> Scores:
    weights: dict[Any, float] = {}
    for possible, weight in zip(d.values, d.weights, strict=True):
        weights[possible] = weights.get(possible, 0.0) + weight
    return _of_weights(weights, value, rng)


def _probability(d: distributions.Probability, value: bool, rng: Rng) -> Scores:
    return _of_weights({False: 1.0 - d.p, True: d.p}, value, rng)


def _of_weights(weights: Mapping[Any, float], value: Any, rng: Rng) -> Scores:
    if not weights.get(value, 0.0) > 0.0:
        return (math.nan,)
    if sum(weight > 0.0 for weight in weights.values()) == 1:
        return ()
    ordered = list(weights)
    below = sum(weights[other] for other in ordered[: ordered.index(value)])
    return ((below + weights[value] * rng.random()) / sum(weights.values()),)


def _turn(sine: float, cosine: float) -> float:
    """An angle as a share of a whole turn, [0, 1)."""
    return math.atan2(sine, cosine) / (2.0 * math.pi) % 1.0


def _so3(d: distributions.So3, value: Sequence[float], rng: Rng) -> Scores:
    """Hopf coordinates: a uniform point of the sphere in four dimensions has uniform ones."""
    del d, rng
    w, x, y, z = value
    return (w * w + z * z, _turn(z, w), _turn(x, y))


def _about_z(d: distributions.AboutZ, value: Sequence[float], rng: Rng) -> Scores:
    del rng
    w, x, y, z = value
    low, high = (math.radians(angle) for angle in d.yaw_deg)
    if abs(x) + abs(y) > ROUNDING:
        return (math.nan,)
    if not 0.0 < high - low <= 2.0 * math.pi + ROUNDING:
        return ()
    beyond = (2.0 * math.atan2(z, w) - low) % (2.0 * math.pi)
    # Rounding may put the lower end a little below itself, a whole turn away.
    share = beyond / (high - low)
    return (0.0 if 2.0 * math.pi - beyond < ROUNDING else share,)


def _sphere(d: distributions.Sphere, value: Sequence[float], rng: Rng) -> Scores:
    del d, rng
    return _around_z(value, -1.0, 1.0)


def _cap(d: distributions.Cap, value: Sequence[float], rng: Rng) -> Scores:
    del rng
    axis = np.array(d.axis)
    # Any vector across the axis: azimuths are uniform from wherever they are counted.
    across = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
    across /= np.linalg.norm(across)
    frame = np.stack([across, np.cross(axis, across), axis])
    return _around_z(frame @ np.array(value), math.cos(math.radians(d.half_angle_deg)), 1.0)


def _shell(d: distributions.Shell, value: Sequence[float], rng: Rng) -> Scores:
    del rng
    away = np.array(value) - np.array(d.center_m)
    radius_m = float(np.linalg.norm(away))
    inner, outer = d.radius_m
    if radius_m == 0.0:
        return ()
    scores = (_interval(inner**3, outer**3, radius_m**3),) if outer > inner else ()
    low, high = (math.sin(math.radians(angle)) for angle in d.elevation_deg)
    return (*scores, *_around_z(away / radius_m, low, high))


def _around_z(direction: Sequence[float], low: float, high: float) -> Scores:
    """Height, uniform by Archimedes' theorem, and azimuth of a unit vector."""
    x, y, z = (float(v) for v in direction)
    heights = (_interval(low, high, z),) if high > low else ()
    return (*heights, _turn(y, x))


def _box(d: distributions.Box, value: Sequence[float], rng: Rng) -> Scores:
    del rng
    sides = zip(d.low_m, d.high_m, value, strict=True)
    return tuple(_interval(low, high, v) for low, high, v in sides if high > low)


_TRANSFORMS: Mapping[type[Any], Callable[[Any, Any, Rng], Scores]] = {
    distributions.AboutZ: _about_z,
    distributions.Box: _box,
    distributions.Cap: _cap,
    distributions.Choice: _choice,
    distributions.LogUniform: _log_uniform,
    distributions.Mixture: _mixture,
    distributions.Normal: _normal,
    distributions.Probability: _probability,
    distributions.Shell: _shell,
    distributions.So3: _so3,
    distributions.Sphere: _sphere,
    distributions.Uniform: _uniform,
    distributions.UniformInteger: _uniform_integer,
}
