"""Bodies that tests of people are run on."""

import os
from pathlib import Path

import pytest

from gen_data.content.people.analytic_body import simple_body
from gen_data.content.people.body import BodyTemplate, load
from gen_data.content.people.person_mesh import pack_file

VARIABLE = "GEN_DATA_TEST_ASSETS"
"""Names a folder with the people pack, installed for these tests alone:
``GEN_DATA_ASSETS=FOLDER gen-data assets install people``."""
PACK_FILE = Path(os.environ.get(VARIABLE, "missing"), "packs", "people", pack_file().name)

NEEDS_PACK = pytest.mark.skipif(
    not PACK_FILE.is_file(), reason=f"{VARIABLE} names no folder with the people pack"
)
KINDS = [pytest.param("simple", id="simple"), pytest.param("pack", id="pack", marks=NEEDS_PACK)]


def body_of(kind: str) -> BodyTemplate:
    return simple_body() if kind == "simple" else load(PACK_FILE)
