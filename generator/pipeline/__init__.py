"""Pipeline.sample(index): a pure function of (configuration, index).

Physics, renderers, sensors, annotations and randomizers are used only through the Protocols in
``gen_data.core.interfaces``.
"""

from gen_data.pipeline.pipeline import Pipeline

__all__ = ["Pipeline"]
