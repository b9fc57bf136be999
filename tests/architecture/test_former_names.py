"""Programs that import modules by their former names still run."""

import subprocess
import sys

PROGRAM = """\
import warnings
warnings.simplefilter("ignore")
from gen_data.generator.core.errors import AssetError
from gen_data.generator.assets.library import open_library
import gen_data.generator.study.experiment as study
from gen_data.generator.assets.procedural.family import Family
from gen_data.generator.assets.procedural.variant_rng import variant_rng
from gen_data.generator.assets.skies.daylight import __name__ as daylight
from gen_data.generator.packs.mjcf import __name__ as mjcf
from gen_data.generator.assets.people.person import __name__ as person
import gen_data.core.errors, gen_data.lab.study.experiment, gen_data.assets.family
assert AssetError is gen_data.AssetError
assert gen_data.core.errors.__spec__.name == "gen_data.core.errors"
assert study is gen_data.lab.study.experiment
assert Family is gen_data.assets.family.Family
assert variant_rng.__module__ == "gen_data.core.variant_rng"
assert daylight == "gen_data.sky.daylight"
assert mjcf == "gen_data.content.packs.mjcf"
assert person == "gen_data.content.people.person"
"""


def test_former_names_are_the_same_modules() -> None:
    subprocess.run([sys.executable, "-c", PROGRAM], check=True)
