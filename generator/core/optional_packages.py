"""Packages that only some features need: extras of the distribution."""

from importlib.util import find_spec

from gen_data.core.distribution import install_command

EXTRAS = {
    "OpenEXR": ("OpenEXR", "exr"),
    "cascadio": ("cascadio", "step"),
    "foxglove_schemas_protobuf": ("foxglove-schemas-protobuf", "formats"),
    "google_crc32c": ("google-crc32c", "formats"),
    "gymnasium": ("gymnasium", "env"),
    "h5py": ("h5py", "formats"),
    "mcap": ("mcap", "formats"),
    "mcap_protobuf": ("mcap-protobuf-support", "formats"),
    "nicegui": ("nicegui", "edit"),
    "pxr": ("usd-core", "usd"),
    "pyarrow": ("pyarrow", "formats"),
    "pybullet": ("pybullet", "bullet"),
    "rerun": ("rerun-sdk", "preview"),
    "shapely": ("shapely", "formats"),
    "xxhash": ("xxhash", "preview"),
}
"""Package and extra by the module that the package installs."""


def missing_packages(*modules: str) -> str:
    """Which packages of ``EXTRAS`` are not installed, and the remedy; empty if all are."""
    absent = [EXTRAS[module] for module in modules if find_spec(module) is None]
    if not absent:
        return ""
    noun = "package" if len(absent) == 1 else "packages"
    names = ", ".join(sorted(package for package, _ in absent))
    return f"needs the {noun} {names}: {install_command(*{extra for _, extra in absent})}"
