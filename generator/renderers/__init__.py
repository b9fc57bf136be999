"""Renderers: a Scene and a Camera in, a Reading out."""

from __future__ import annotations

from generator.core.plugins import PluginTable

TABLE = PluginTable("renderer", {"warp": "generator.renderers.warp:WarpRenderer"})
