"""MCAP, read by the package mcap with Foxglove's messages."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from gen_data.generator.certificate.labelled_images import Loaded
from gen_data.generator.core.interfaces import DatasetInfo


def load_mcap(root: Path, info: DatasetInfo) -> Loaded:
    """Decode every message; sums of all chunks are checked. Counts images and scans."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    del info
    counts: Counter[str] = Counter()
    paths = sorted(root.glob("*/*.mcap"))
    for path in paths:
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            counts.update(schema.name for schema, _, _, _ in reader.iter_decoded_messages())
    kinds = {f"{name.rpartition('.')[2]} messages": k for name, k in sorted(counts.items())}
    return Loaded(None, {"files": len(paths), **kinds})
