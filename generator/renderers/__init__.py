"""Renderers: a Scene and a Camera in, a Reading out."""

from __future__ import annotations

from generator.core.interfaces import RendererSettings
from generator.core.plugins import PluginTable

TABLE = PluginTable[RendererSettings](
    "renderer",
    {"warp": "generator.renderers.plugin:WarpPlugin"},
    (RendererSettings,),
    tag="renderer",
)
