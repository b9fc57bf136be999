"""Stored digests of the stages of first samples, and the command that renews them.

``python -m tests.contracts.stage_digests [NAME ...]``

They name the first stage that an accidental change of bytes altered (see
``gen_data.runner.diff``). A deliberate change renews them in its own commit.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gen_data.runner.diff import SampleFiles

FILE = Path(__file__).with_name("stage_digests.json")
STAGES = ("scene", "geometry", "render", "labels")
"""Bytes of encoded files also depend on releases of zlib."""

SCENE_NUMERICS = ("draws", "arrays", "physics")
"""Kinds of computation that a scene depends on; images depend on all."""


def read_stored() -> dict[str, Any]:
    stored: dict[str, Any] = json.loads(FILE.read_text("utf-8"))
    return stored


def digests_of(dataset: Path) -> dict[str, str]:
    digests = SampleFiles(dataset / "shards/000000", 0).digests()
    return {stage: digests[stage] for stage in STAGES}


def numerics_of(dataset: Path) -> Mapping[str, str]:
    """The class of the machine that made a data set: digests of small computations."""
    line = (dataset / "run/numerics.json").read_text("utf-8").splitlines()[0]
    digests: Mapping[str, str] = json.loads(line)["digests"]
    return digests


def find_change(name: str, dataset: Path) -> str:
    """The first stage of sample 0 whose digest is not the stored one; empty if there is none.

    A stage is compared if this machine computes as the one that stored the digests, as far as the
    stage depends on that. Configurations without stored digests are not compared.
    """
    stored = read_stored()
    known, numerics = stored["samples"].get(name), numerics_of(dataset)
    if known is None:
        return ""
    found = digests_of(dataset)
    for stage in STAGES:
        kinds = SCENE_NUMERICS if stage == "scene" else stored["numerics"]
        same = all(numerics.get(kind) == stored["numerics"].get(kind) for kind in kinds)
        if same and known[stage] != found[stage]:
            return stage
    return ""


def main() -> None:
    """Renew the digests of the named configurations, or of all that have some."""
    from tests.contracts.test_every_config import CONFIGS, generate_reduced

    # As tests do: no pack that is installed here.
    os.environ["GEN_DATA_ASSETS"] = tempfile.mkdtemp(prefix="gen-data-no-packs-")
    stored = read_stored() if FILE.exists() else {"numerics": {}, "samples": {}}
    for name in sys.argv[1:] or list(stored["samples"]) or CONFIGS:
        with tempfile.TemporaryDirectory() as folder:
            done = generate_reduced(name, Path(folder))
            if done.returncode != 0:
                raise subprocess.CalledProcessError(done.returncode, name, stderr=done.stderr)
            out = Path(folder) / "out"
            stored["numerics"] = dict(numerics_of(out))
            stored["samples"][name] = digests_of(out)
        print(name, flush=True)
        FILE.write_text(json.dumps(stored, indent=1, sort_keys=True) + "\n", "utf-8")


if __name__ == "__main__":
    main()
