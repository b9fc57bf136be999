"""Numerics class of a machine: digests of small computations of every kind that bytes depend on.

Two machines with equal digests generate equal bytes as far as 64 x 64 pixels can show it; another
processor, driver or device (CPU or GPU) whose rounding reaches a data file shows up here first.
"""

import hashlib
from collections.abc import Mapping

import numpy as np

from gen_data.core import intrinsics, serialization, streams
from gen_data.core.capture import Channel
from gen_data.core.interfaces import PhysicsEngine, Renderer
from gen_data.core.scene import Body, Camera, Instance, Light, Scene
from gen_data.core.se3 import SE3, look_at

SIZE_PX = 64
CHANNELS = frozenset({Channel.RADIANCE, Channel.Z_DEPTH, Channel.NORMALS, Channel.INSTANCE})
ASSETS = ("mug?seed=0", "book?seed=0")
"""Procedural objects, which every installation has."""


def numerics_digests(renderer: Renderer, physics: PhysicsEngine | None) -> Mapping[str, str]:
    """SHA-256 by kind of computation: ``draws``, ``arrays``, ``physics``, ``render``.

    Without an engine there is no ``physics``.
    """
    scene = _canary_scene()
    digests = host_digests()
    if physics is not None:
        settled = physics.settle(scene)
        poses = [body.T_world_body.rounded() for body in settled.scene.bodies]
        digests["physics"] = _digest(serialization.canonical_json(poses).encode())
    reading = renderer.render(scene, scene.cameras[0], CHANNELS)
    images = (reading.channels[channel] for channel in sorted(CHANNELS, key=str))
    digests["render"] = _digest(*(np.ascontiguousarray(image).tobytes() for image in images))
    return digests


def host_digests() -> dict[str, str]:
    """SHA-256 of the kinds of computation that need no engine: ``draws`` and ``arrays``."""
    return {"draws": _digest(_draws()), "arrays": _digest(_arrays())}


def _canary_scene() -> Scene:
    bodies = tuple(
        Body(
            f"canary/{k}",
            asset,
            SE3.about_z(0.7 * k, (0.02 * k, 0.0, 0.1 + 0.2 * k)),
            instance_id=k + 1,
            motion="static" if k == 0 else "dynamic",
            mass_kg=0.3,
        )
        for k, asset in enumerate(ASSETS)
    )
    things = tuple(Instance(b.instance_id, b.name, "canary", 1, b.asset) for b in bodies)
    eye = look_at((0.5, 0.3, 0.4), (0.0, 0.0, 0.2))
    camera = Camera("canary", eye, intrinsics.Intrinsics.from_hfov(SIZE_PX, SIZE_PX, hfov_rad=1.0))
    sun = Light("sun", "sun", direction=(0.0, -0.6, -0.8), illuminance_lux=500.0)
    return Scene("canary", bodies=bodies, instances=things, lights=(sun,), cameras=(camera,))


def _draws() -> bytes:
    rng = streams.Streams(7, 0).rng("canary")
    drawn = [rng.uniform(size=64), rng.normal(size=64), rng.exponential(size=64)]
    return b"".join(a.tobytes() for a in drawn) + rng.permutation(64).tobytes()


def _arrays() -> bytes:
    """Functions of data files: transcendental ones are rounded like the values that use them."""
    x = np.linspace(0.01, 3.0, 257)
    smooth = [np.sin(x), np.cos(x), np.exp(-x), np.log(x), np.arctan2(x, 2.0), np.power(x, 2.2)]
    rounded = np.rint(np.stack(smooth) * 1e6).astype(np.int64)
    order = np.argsort(np.rint(x * 10.0), kind="stable")
    sums = np.einsum("ij,kj->ik", np.stack(smooth), np.stack(smooth), optimize=False)
    exact = [np.sqrt(x), np.hypot(x, 1.0), np.add.accumulate(x)]
    parts = [rounded, order, np.rint(sums * 1e6).astype(np.int64), *exact]
    return b"".join(part.tobytes() for part in parts)


def _digest(*parts: bytes) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()
