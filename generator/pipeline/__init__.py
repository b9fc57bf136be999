"""Pipeline.sample(index): a pure function of (configuration, index).

It sees physics, renderers, sensors, annotations and randomizers only through the Protocols of
``gen_data.generator.core.interfaces``.
"""

from gen_data.generator.pipeline.pipeline import Pipeline

__all__ = ["Pipeline"]
