"""Stored digests of procedural assets by family, and the command that renews them.

``python -m tests.contracts.asset_digests``

Caches and identities of data sets name an asset by its family's version. A family that makes other
bytes under the same version is read from old caches, and samples differ from machine to machine.
"""

import json
import os
import tempfile
from collections import Counter
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

import numpy as np
import PIL

from gen_data.assets.asset_arrays import pack_imported, pack_texture
from gen_data.assets.asset_cache import Arrays, DiskCache, Store
from gen_data.assets.asset_ids import AssetId, parse_asset_id
from gen_data.assets.procedural_library import ProceduralLibrary
from gen_data.pipeline.numerics import host_digests

FILE = Path(__file__).with_name("asset_digests.json")


def read_stored() -> tuple[dict[str, str], dict[str, dict[str, str]]]:
    """Digests of the machine's computations, and by family ``{content key: digest of bytes}``."""
    stored = json.loads(FILE.read_text("utf-8"))
    return stored["numerics"], stored["families"]


def numerics() -> dict[str, str]:
    """Inputs of the bytes of assets besides the code: the machine, and two libraries' releases."""
    image = np.sin(np.arange(512 * 512, dtype=np.int64) ** 2 % 7919).astype(np.float32)
    return {
        **host_digests(),
        # NumPy 2.2, for Python 3.10, adds long rows of float32 in another order.
        "reductions": f"{image.std()!r} {image.mean()!r}",
        "text": PIL.__version__.split(".")[0],
    }


def digests_of(library: ProceduralLibrary) -> Mapping[str, dict[str, str]]:
    """``{content key: digest of bytes}`` by family: of four objects, or of one image.

    A content key changes with the family's version.
    """
    counts = Counter(name.split("?")[0] for name in library.names() if "?" in name)
    found: dict[str, dict[str, str]] = {}
    for name, count in sorted(counts.items()):
        chosen = 1 if name.startswith(("texture/", "environment/")) else min(count, 4)
        for seed in (k * count // chosen for k in range(chosen)):
            asset = library.get(parse_asset_id(f"{name}?seed={seed}"))
            digest = _digest(_arrays(library, parse_asset_id(asset.asset_id), asset.kind))
            found.setdefault(name, {})[asset.sha256[:16]] = digest
    return found


def open_procedural(folder: Path) -> ProceduralLibrary:
    return ProceduralLibrary(Store(DiskCache(folder)))


def _arrays(library: ProceduralLibrary, asset_id: AssetId, kind: str) -> Arrays:
    if kind == "object":
        return pack_imported(library.imported(asset_id))
    if kind == "texture":
        return pack_texture(library.texture(asset_id))
    return {"radiance": library.environment(asset_id)}


def _digest(arrays: Arrays) -> str:
    digest = sha256()
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype} {array.shape} ".encode() + array.tobytes())
    return digest.hexdigest()[:16]


def main() -> None:
    # As tests do: no pack that is installed here.
    os.environ["GEN_DATA_ASSETS"] = tempfile.mkdtemp(prefix="gen-data-no-packs-")
    with tempfile.TemporaryDirectory() as folder:
        families = digests_of(open_procedural(Path(folder)))
    stored = {"numerics": numerics(), "families": families}
    FILE.write_text(json.dumps(stored, indent=1, sort_keys=True) + "\n", "utf-8")


if __name__ == "__main__":
    main()
