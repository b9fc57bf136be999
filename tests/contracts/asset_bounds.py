"""The table of bounds in the package, and the command that renews it.

``python -m tests.contracts.asset_bounds``

It keeps the rows of families that have the same version, and makes the objects of all others:
variants offered for selection, and variants that shipped configurations can use. The people pack
must be installed. A missing row costs time on machines with empty caches, and nothing else.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.known_bounds import Corners, encode_rows, read_table, table_path
from gen_data.assets.library import Library, open_library
from gen_data.runner.identity import possible_assets
from tests.repository import ROOT


def known_objects(library: Library, configs: Iterable[Path]) -> list[str]:
    """Sorted ids of the procedural objects with rows: they have variants."""
    assets = {*library.find(())}
    for config in configs:
        assets.update(possible_assets(PipelineFactory(load_config(str(config), seed=1), n=1)))
    return sorted(
        asset.asset_id
        for asset in assets
        if asset.kind == "object" and "procedural" in asset.tags and "seed=" in asset.asset_id
    )


def main() -> int:
    library, table = open_library(()), read_table()
    if "person" not in {a.asset_id.partition("?")[0] for a in library.find(["person"])}:
        print("the people pack is missing: gen-data assets install people", file=sys.stderr)
        return 2
    known: dict[str, Corners] = {}
    with TemporaryDirectory() as folder:
        maker = open_library((), Path(folder))
        for asset_id in known_objects(library, sorted((ROOT / "configs").glob("*.yaml"))):
            key = library.bounds_key(asset_id)
            corners_m = table.find(key)
            known[key] = maker.measured_bounds_m(asset_id) if corners_m is None else corners_m
    np.save(table_path(), encode_rows(known), allow_pickle=False)
    return 0


if __name__ == "__main__":
    sys.exit(main())
