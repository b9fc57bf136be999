"""Straps of bags."""

from types import SimpleNamespace

import numpy as np

from gen_data.content.people.carried_things import _strap
from gen_data.core.asset_types import Material


def test_a_strap_lies_on_the_clothes_and_never_below_them() -> None:
    """Around a trunk of 0.14 m radius with a fold of 1 cm across: the band's face stays outside."""
    turn, z = np.meshgrid(np.linspace(-np.pi, np.pi, 90), np.linspace(0.0, 0.7, 80))
    radius = 0.14 + 0.01 * (np.abs(z - 0.4) < 0.03)
    out = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=2).reshape(-1, 3)
    skin = out * radius.reshape(-1, 1) + np.stack([0.0 * z, 0.0 * z, z], axis=2).reshape(-1, 3)
    carrier = SimpleNamespace(
        surface=(skin, skin, out),
        scale=1.0,
        person=SimpleNamespace(outfit=SimpleNamespace(bag_material=Material())),
    )
    course = [(0.1, 0.1, 0.58), (0.13, 0.06, 0.43), (0.13, 0.06, 0.28), (0.1, 0.1, 0.18)]

    strap = _strap(carrier, course, 0.05)  # type: ignore[arg-type]

    face = strap.vertices_m.reshape(-1, 4, 3)[:, 1:3]
    assert (np.hypot(face[..., 0], face[..., 1]) > 0.14).all()
    at_fold = np.abs(face[..., 2] - 0.4) < 0.02
    assert at_fold.any()
    assert (np.hypot(face[..., 0], face[..., 1])[at_fold] > 0.15).all()
