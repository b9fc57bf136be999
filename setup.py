"""Map the repository's folders to packages below ``gen_data``; all else is in pyproject.toml.

``gen_data/`` links to the same folders, but checkouts without symbolic links exist.
"""

from setuptools import find_namespace_packages, setup

FOLDERS = ("configs", "exporters", "generator", "randomizers", "scene_templates")

inner = [f"{top}.{name}" for top in FOLDERS for name in find_namespace_packages(top)]
setup(
    packages=["gen_data", *(f"gen_data.{name}" for name in (*FOLDERS, *inner))],
    package_dir={f"gen_data.{name}": name for name in FOLDERS},
)
