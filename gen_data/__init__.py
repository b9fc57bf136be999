"""gen-data: synthetic perception data sets from declarative scenes.

    >>> import gen_data
    >>> data = gen_data.Dataset("tabletop.yaml", seed=7)
    >>> data[17].cameras["color"].rgb
    >>> gen_data.generate("tabletop.yaml", n=1000, out="out/tabletop")
    >>> gen_data.open("out/tabletop")[17].boxes2d
    >>> gen_data.export("out/tabletop", ["coco", "kitti"], "out/tabletop-formats")

Only the names in ``__all__`` are public; everything else may change between releases.
"""

import os
from importlib import import_module

_folder = __path__[0]
if not os.path.isdir(f"{_folder}/core"):  # noqa: PTH112  pathlib takes longer than this module
    # A checkout without symbolic links: the packages are in the folders next to this one.
    _root = os.path.dirname(_folder)  # noqa: PTH120
    __path__ += [f"{_root}/generator", _root]

from gen_data.core.version import __version__  # noqa: E402

# ``typing`` would delay the moment from which the command line handles Ctrl-C.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from gen_data.api.dataset import Dataset, SampleSequence, StoredDataset
    from gen_data.api.export import export
    from gen_data.api.generate import generate
    from gen_data.api.loader import Loader
    from gen_data.api.open_dataset import open_dataset as open  # noqa: A004
    from gen_data.api.prepare import prepare_assets
    from gen_data.api.recipes import pull, recipe
    from gen_data.api.rerender import rerender
    from gen_data.api.sample import Box2d, Box3d, CameraReading, Sample
    from gen_data.api.write_sample import write_sample
    from gen_data.core.errors import (
        AssetError,
        CertificationError,
        ConfigError,
        ConfigWarning,
        DeterminismError,
        GenDataError,
        Interrupted,
        NoLabels,
        SampleError,
        SampleIndexError,
        SceneRejected,
        StorageError,
        UnknownNameError,
        VerificationError,
    )
    from gen_data.core.scene import Scene
    from gen_data.lab.certificate.api import certify
    from gen_data.lab.environment.env import Env, make_vec
    from gen_data.lab.matching.api import match

_HOMES = {
    "Box2d": "gen_data.api.sample",
    "Box3d": "gen_data.api.sample",
    "CameraReading": "gen_data.api.sample",
    "Dataset": "gen_data.api.dataset",
    "Env": "gen_data.lab.environment.env",
    "Loader": "gen_data.api.loader",
    "Sample": "gen_data.api.sample",
    "SampleSequence": "gen_data.api.dataset",
    "Scene": "gen_data.core.scene",
    "StoredDataset": "gen_data.api.dataset",
    "certify": "gen_data.lab.certificate.api",
    "export": "gen_data.api.export",
    "generate": "gen_data.api.generate",
    "write_sample": "gen_data.api.write_sample",
    "make_vec": "gen_data.lab.environment.env",
    "match": "gen_data.lab.matching.api",
    "pull": "gen_data.api.recipes",
    "prepare_assets": "gen_data.api.prepare",
    "recipe": "gen_data.api.recipes",
    "rerender": "gen_data.api.rerender",
    "AssetError": "gen_data.core.errors",
    "CertificationError": "gen_data.core.errors",
    "ConfigError": "gen_data.core.errors",
    "ConfigWarning": "gen_data.core.errors",
    "DeterminismError": "gen_data.core.errors",
    "GenDataError": "gen_data.core.errors",
    "NoLabels": "gen_data.core.errors",
    "Interrupted": "gen_data.core.errors",
    "SampleError": "gen_data.core.errors",
    "SampleIndexError": "gen_data.core.errors",
    "SceneRejected": "gen_data.core.errors",
    "StorageError": "gen_data.core.errors",
    "UnknownNameError": "gen_data.core.errors",
    "VerificationError": "gen_data.core.errors",
}
"""Module of each public name; modules are imported on first use."""

__all__ = [
    "AssetError",
    "Box2d",
    "Box3d",
    "CameraReading",
    "CertificationError",
    "ConfigError",
    "ConfigWarning",
    "Dataset",
    "DeterminismError",
    "Env",
    "GenDataError",
    "Interrupted",
    "Loader",
    "NoLabels",
    "Sample",
    "SampleError",
    "SampleIndexError",
    "SampleSequence",
    "Scene",
    "SceneRejected",
    "StorageError",
    "StoredDataset",
    "UnknownNameError",
    "VerificationError",
    "__version__",
    "certify",
    "export",
    "generate",
    "make_vec",
    "match",
    "open",
    "prepare_assets",
    "pull",
    "recipe",
    "rerender",
    "write_sample",
]


def __getattr__(name: str) -> "Any":
    """Import a public name."""
    if name in ("targets", "torch"):
        return import_module(f"gen_data.{name}")
    if name == "open":
        return import_module("gen_data.api.open_dataset").open_dataset
    if name not in _HOMES:
        raise AttributeError(f"module 'gen_data' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
