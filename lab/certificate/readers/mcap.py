"""MCAP, read by the package mcap with Foxglove's messages."""

from collections import Counter
from pathlib import Path

from gen_data.core.reported import copies
from gen_data.lab.certificate.labelled_images import Loaded
from gen_data.runner.stored import StoredSamples


def load_mcap(root: Path, stored: StoredSamples) -> Loaded:
    """Decode every message, with the sums of all chunks; count messages of images and scans."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    counts: Counter[str] = Counter()
    paths = sorted(root.glob("*/*.mcap"))
    for path in paths:
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            counts.update(schema.name for schema, _, _, _ in reader.iter_decoded_messages())
    kinds = {f"{name.rpartition('.')[2]} messages": k for name, k in sorted(counts.items())}
    expected: Counter[str] = Counter()
    for index in stored.indices:
        capture = stored.labelled(index).capture
        expected["foxglove.CompressedImage"] += sum(
            copies(reading) * len(reading.channels) for reading in capture.readings.values()
        )
        expected["foxglove.PointCloud"] += sum(map(copies, capture.clouds.values()))
    faults = [
        f"there are {counts[name]} messages {name}, expected {number}"
        for name, number in sorted(expected.items())
        if counts[name] != number
    ]
    return Loaded(None, {"files": len(paths), **kinds}, faults)
