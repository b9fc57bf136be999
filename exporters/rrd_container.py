"""Rerun's recordings with the same bytes for the same data.

A recording consists of a header, messages, and a footer that lists all chunks. Three parts depend
on the clock or the process: ids of chunks and rows, the id of the first message, and the order of
columns in the footer's schema. Ids of chunks and rows are set before writing; the rest is replaced
in the written file, and the footer's checksum computed again.

Sources: ``re_log_encoding`` and ``rerun/log_msg/v1alpha1`` of rerun-sdk 0.41; Google, "Protocol
Buffers: Encoding".
"""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from gen_data.core.errors import StorageError

APPLICATION = "gen-data"
TUID_HIGH = 1
"""First half of all ids, in recordings of the SDK the time."""

_MAGIC, _FOOTER_MAGIC = b"RRF2", b"RRF2FOOT"
_MESSAGE = struct.Struct("<QQ")
"""Kind and length of a message."""
_TAIL = struct.Struct("<QQI8sI")
"""Place, length and checksum of the footer, its magic, and the number of footers."""
_CHECKSUM_SEED = 7850921
_FIRST_ID = 28
"""Place of the first message's id: after the header of 12 bytes and the message's."""
_ID_TAGS = {0: b"\x0a\x12\x09", 11: b"\x11"}
"""Tags of its field, of 18 bytes, and of its halves."""


def write_recording(path: Path, chunks: Sequence[Any], recording_id: str) -> None:
    """Write chunks of ``rerun.chunk`` to a ``.rrd`` file, in their order.

    Raises:
        StorageError: the installed rerun-sdk writes another container.
    """
    import rerun.chunk

    named = [part for k, chunk in enumerate(chunks) for part in _with_ids(chunk, k)]
    store = rerun.chunk.ChunkStore.from_chunks(named)
    store.write_rrd(str(path), application_id=APPLICATION, recording_id=recording_id)
    with path.open("r+b") as file:
        _set_first_id(file, path)
        _sort_footer(file, path)


def _with_ids(chunk: Any, number: int) -> Any:
    """The chunk with an id and ids of rows that depend on its number only."""
    import pyarrow as pa
    import rerun.chunk

    batch = chunk.to_record_batch()
    metadata = {**batch.schema.metadata, b"rerun:id": f"chunk_{_tuid(number).hex()}".encode()}
    place = batch.schema.get_field_index("rerun.controls.RowId")
    ids = [_tuid(number << 32 | row) for row in range(batch.num_rows)]
    arrays = [pa.array(ids, pa.binary(16)) if k == place else a for k, a in enumerate(batch)]
    schema = batch.schema.with_metadata(metadata)
    return rerun.chunk.Chunk.from_record_batch(pa.RecordBatch.from_arrays(arrays, schema=schema))


def _tuid(number: int) -> bytes:
    return struct.pack(">QQ", TUID_HIGH, number)


def _set_first_id(file: BinaryIO, path: Path) -> None:
    """Replace the id of the first message, which the SDK takes from the clock."""
    head = file.read(_FIRST_ID + 20)
    id_ = head[_FIRST_ID:]
    if head[:4] != _MAGIC or any(id_[k : k + len(t)] != t for k, t in _ID_TAGS.items()):
        raise _unknown(path)
    file.seek(_FIRST_ID)
    file.write(_ID_TAGS[0] + struct.pack("<Q", TUID_HIGH) + _ID_TAGS[11] + struct.pack("<Q", 0))


def _sort_footer(file: BinaryIO, path: Path) -> None:
    """Put the columns of the footer's schema in the order of their names."""
    from xxhash import xxh32_intdigest

    file.seek(-_TAIL.size, 2)
    place, size, checksum, magic, count = _TAIL.unpack(file.read())
    if magic != _FOOTER_MAGIC or count != 1:
        raise _unknown(path)
    file.seek(place)
    footer = file.read(size)
    if xxh32_intdigest(footer, _CHECKSUM_SEED) != checksum:
        raise _unknown(path)
    # Footer: manifests as field 1; manifest: its schema as field 2; schema: Arrow IPC as field 1.
    sorted_ = _replace(footer, (1, 2, 1), _sorted_schema)
    file.seek(place - _MESSAGE.size)
    file.truncate()
    file.write(_MESSAGE.pack(0, len(sorted_)) + sorted_)
    checksum = xxh32_intdigest(sorted_, _CHECKSUM_SEED)
    file.write(_TAIL.pack(place, len(sorted_), checksum, _FOOTER_MAGIC, count))


def _sorted_schema(data: bytes) -> bytes:
    """An Arrow schema with fields and metadata in the order of their names."""
    import pyarrow as pa

    schema = pa.ipc.read_schema(pa.BufferReader(data))
    fields = [f.with_metadata(dict(sorted((f.metadata or {}).items()))) for f in schema]
    fields.sort(key=lambda field: str(field.name))
    metadata = dict(sorted((schema.metadata or {}).items()))
    return bytes(pa.schema(fields, metadata or None).serialize())


def _replace(message: bytes, path: Sequence[int], change: Any) -> bytes:
    """A protobuf message with every field at a path of field numbers changed."""
    if not path:
        return bytes(change(message))
    parts = []
    for number, tag, value in _fields(message):
        if number == path[0]:
            new = _replace(value, path[1:], change)
            parts.append(tag + _varint(len(new)) + new)
        else:
            parts.append(tag + (_varint(len(value)) if tag[-1] & 7 == 2 else b"") + value)
    return b"".join(parts)


def _fields(message: bytes) -> Iterator[tuple[int, bytes, bytes]]:
    """Number, tag and value of each field of a protobuf message."""
    place = 0
    while place < len(message):
        start = place
        key, place = _read_varint(message, place)
        tag, kind = message[start:place], key & 7
        if kind == 2:
            size, place = _read_varint(message, place)
        elif kind == 0:
            size = _read_varint(message, place)[1] - place
        else:
            size = {1: 8, 5: 4}[kind]
        yield key >> 3, tag, message[place : place + size]
        place += size


def _read_varint(data: bytes, place: int) -> tuple[int, int]:
    """An integer of 7 bits per byte, the lowest first, and the place behind it."""
    value = shift = 0
    while True:
        byte = data[place]
        value |= (byte & 0x7F) << shift
        place, shift = place + 1, shift + 7
        if byte < 0x80:
            return value, place


def _varint(value: int) -> bytes:
    parts = bytearray()
    while value >= 0x80:
        parts.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*parts, value])


def _unknown(path: Path) -> StorageError:
    from importlib.metadata import version

    return StorageError(
        f"{path}: rerun-sdk {version('rerun-sdk')} writes recordings of an unknown structure; "
        "expected the structure of rerun-sdk 0.41"
    )
