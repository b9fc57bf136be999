"""Physics: objects settle and arms accomplish their goals; a pure function of the Scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gen_data.generator.core.interfaces import AssetLibrary
from gen_data.generator.physics.physics_config import PhysicsConfig

if TYPE_CHECKING:
    from gen_data.generator.physics.engine import BulletEngine

__all__ = ["PhysicsConfig", "open_engine"]


def open_engine(assets: AssetLibrary, config: PhysicsConfig) -> BulletEngine:
    """Open the physics engine, to be used as a context manager."""
    from gen_data.generator.physics.engine import BulletEngine

    return BulletEngine(assets, config)
