"""Renderers: from a Scene and a Camera to a SensorReading."""

from gen_data.core.interfaces import RendererSettings
from gen_data.core.plugins import PluginTable

TABLE = PluginTable[RendererSettings](
    "renderer",
    {"warp": "gen_data.renderers.warp.plugin:WarpPlugin"},
    (RendererSettings,),
    tag="renderer",
)
