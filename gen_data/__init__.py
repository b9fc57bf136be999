"""gen-data: synthetic perception data sets from declarative scenes.

    >>> import gen_data
    >>> data = gen_data.Dataset("tabletop.yaml", seed=7)
    >>> data[17].cameras["color"].rgb
    >>> gen_data.generate("tabletop.yaml", n=1000, out="out/tabletop")
    >>> gen_data.open("out/tabletop")[17].boxes2d

Every name in ``__all__`` is public; all else may move between releases.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from generator import __version__

if TYPE_CHECKING:
    from generator.api.dataset import Dataset, StoredDataset
    from generator.api.dataset import open_dataset as open  # noqa: A004
    from generator.api.generate import generate
    from generator.api.sample import Box2d, Box3d, CameraReading, Sample
    from generator.core.errors import (
        AssetError,
        ConfigError,
        DeterminismError,
        GenDataError,
        Interrupted,
        SampleError,
        SampleIndexError,
        SceneRejected,
        StorageError,
        UnknownNameError,
        VerificationError,
    )
    from generator.core.scene import Scene

_HOMES = {
    "Box2d": "generator.api.sample",
    "Box3d": "generator.api.sample",
    "CameraReading": "generator.api.sample",
    "Dataset": "generator.api.dataset",
    "Sample": "generator.api.sample",
    "Scene": "generator.core.scene",
    "StoredDataset": "generator.api.dataset",
    "generate": "generator.api.generate",
    "AssetError": "generator.core.errors",
    "ConfigError": "generator.core.errors",
    "DeterminismError": "generator.core.errors",
    "GenDataError": "generator.core.errors",
    "Interrupted": "generator.core.errors",
    "SampleError": "generator.core.errors",
    "SampleIndexError": "generator.core.errors",
    "SceneRejected": "generator.core.errors",
    "StorageError": "generator.core.errors",
    "UnknownNameError": "generator.core.errors",
    "VerificationError": "generator.core.errors",
}
"""Where each public name lives; a module is imported when its first name is used."""

__all__ = [
    "AssetError",
    "Box2d",
    "Box3d",
    "CameraReading",
    "ConfigError",
    "Dataset",
    "DeterminismError",
    "GenDataError",
    "Interrupted",
    "Sample",
    "SampleError",
    "SampleIndexError",
    "Scene",
    "SceneRejected",
    "StorageError",
    "StoredDataset",
    "UnknownNameError",
    "VerificationError",
    "__version__",
    "generate",
    "open",
]


def __getattr__(name: str) -> Any:
    """A public name, from the module where it lives."""
    if name == "open":
        return import_module("generator.api.dataset").open_dataset
    if name not in _HOMES:
        raise AttributeError(f"module 'gen_data' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
