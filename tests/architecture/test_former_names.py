"""Programs that import modules by their former names still run."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """\
import warnings
warnings.simplefilter("ignore")
from gen_data.generator.core.errors import AssetError
from gen_data.generator.assets.library import open_library
import gen_data.generator.study.experiment as study
import gen_data.core.errors, gen_data.lab.study.experiment
assert AssetError is gen_data.AssetError
assert gen_data.core.errors.__spec__.name == "gen_data.core.errors"
assert study is gen_data.lab.study.experiment
"""


def test_former_names_are_the_same_modules() -> None:
    """Classes are identical, so that errors are caught by either name."""
    subprocess.run([sys.executable, "-c", PROGRAM], check=True)
