"""Map the repository's folders to packages below ``gen_data``; all else is in pyproject.toml.

``gen_data/`` links to the same folders, but checkouts without symbolic links exist.
"""

from pathlib import Path

from setuptools import find_namespace_packages, setup

CORE = Path("generator")
TOPS = ("configs", "content", "exporters", "lab", "randomizers", "scene_templates")

folders = {path.name: path.as_posix() for path in sorted(CORE.iterdir()) if path.is_dir()}
folders.pop("__pycache__", None)
folders |= {name: name for name in TOPS}
inner = [
    f"{top}.{name}" for top, folder in folders.items() for name in find_namespace_packages(folder)
]
setup(
    packages=["gen_data", *(f"gen_data.{name}" for name in (*folders, *inner))],
    package_dir={f"gen_data.{name}": folder for name, folder in folders.items()},
)
