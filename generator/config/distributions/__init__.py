"""A number is a constant; a one-key mapping is a distribution.

``roughness: 0.5`` or ``roughness: {uniform: [0.1, 0.9]}``. In Python the same types are frozen
values: ``Uniform(0.1, 0.9).draw(rng)``. Models declare fields as ``Scalar``, ``Count``, ``Name``,
``Flag``, ``Chance``, ``Rotation``, ``Direction`` or ``Position``.
"""

from __future__ import annotations

from gen_data.generator.config.distributions.base import (
    DISTRIBUTIONS,
    Distribution,
    Malformed,
    Numeric,
)
from gen_data.generator.config.distributions.discrete import Choice, Constant, Probability, Sequence
from gen_data.generator.config.distributions.fields import (
    Bounds,
    Chance,
    Count,
    Direction,
    Flag,
    Name,
    NonNegative,
    Position,
    Positive,
    Rotation,
    Scalar,
    UnitInterval,
    with_bounds,
)
from gen_data.generator.config.distributions.numeric import (
    LogUniform,
    Normal,
    Uniform,
    UniformInteger,
)
from gen_data.generator.config.distributions.space import (
    AboutZ,
    Box,
    Cap,
    EulerDeg,
    QuaternionWxyz,
    Shell,
    So3,
    Sphere,
)

__all__ = [
    "DISTRIBUTIONS",
    "AboutZ",
    "Bounds",
    "Box",
    "Cap",
    "Chance",
    "Choice",
    "Constant",
    "Count",
    "Direction",
    "Distribution",
    "EulerDeg",
    "Flag",
    "LogUniform",
    "Malformed",
    "Name",
    "NonNegative",
    "Normal",
    "Numeric",
    "Position",
    "Positive",
    "Probability",
    "QuaternionWxyz",
    "Rotation",
    "Scalar",
    "Sequence",
    "Shell",
    "So3",
    "Sphere",
    "Uniform",
    "UniformInteger",
    "UnitInterval",
    "with_bounds",
]
