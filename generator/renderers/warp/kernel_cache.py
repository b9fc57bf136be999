"""Warp's cache of compiled kernels, checked: Warp runs whatever machine code it finds there.

A file of the digests of all compiled modules lies beside them. A module that differs from its
digest, or that is cut off, is removed, and so compiled again by its next user.

A distribution may bring compiled modules (``kernel_bundle.py``). They go into the cache under
the names that Warp gave them, which contain the hash of everything they were compiled from, and
Warp finds or ignores them as it does its own.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import struct
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

OURS = "wp_gen_data."
SUMS_NAME = "gen-data-sums.json"
SOURCES = frozenset({".cpp", ".cu"})
_SOURCE_PATTERNS = tuple(f"*{suffix}" for suffix in sorted(SOURCES))
UNFINISHED = re.compile(r"_p\d+_t\d+$")
"""Warp compiles in folders with the numbers of process and thread, and renames them."""
ELF = b"\x7fELF"


def remove_damaged_modules(folder: Path) -> tuple[str, ...]:
    """Remove damaged modules of a cache; record those that are new.

    One process at a time may call it.

    Returns:
        Names of the modules that were removed, sorted.
    """
    known = _read_sums(folder)
    found: dict[str, str] = {}
    damaged: set[Path] = set()
    for path in _compiled_files(folder):
        name = path.relative_to(folder).as_posix()
        data = path.read_bytes()
        found[name] = sha256(data).hexdigest()
        if found[name] != known.get(name, found[name]) or _is_cut_off(path, data):
            damaged.add(path.parent)
    for module in damaged:
        shutil.rmtree(module, ignore_errors=True)
    kept = {name: digest for name, digest in found.items() if (folder / name).parent not in damaged}
    if kept != known:
        _write_sums(folder, kept)
    return tuple(sorted(module.name for module in damaged))


def copy_modules(source: Path, target: Path) -> None:
    """Copy the compiled modules of one folder into another that lacks them, without sources.

    Each appears there whole. One process at a time may call it.
    """
    for module in sorted(source.glob(f"{OURS}*")):
        copy = target / module.name
        if copy.exists() or UNFINISHED.search(module.name):
            continue
        unfinished = target / f"{module.name}_p{os.getpid()}_t0"
        shutil.copytree(module, unfinished, ignore=shutil.ignore_patterns(*_SOURCE_PATTERNS))
        try:
            unfinished.rename(copy)
        except OSError:  # A process without the lock has just compiled it.
            shutil.rmtree(unfinished)
            if not copy.exists():
                raise


def _compiled_files(folder: Path) -> Iterator[Path]:
    for module in sorted(folder.glob(f"{OURS}*")):
        if module.is_dir() and not UNFINISHED.search(module.name):
            yield from (path for path in sorted(module.iterdir()) if path.suffix not in SOURCES)


def _is_cut_off(path: Path, data: bytes) -> bool:
    """Whether a file lacks its end: of object files, where ELF keeps the table of sections."""
    if path.suffix != ".o":
        return not data
    if len(data) < 64 or not data.startswith(ELF):
        return True
    (sections_at,) = struct.unpack_from("<Q", data, 0x28)
    size, count = struct.unpack_from("<HH", data, 0x3A)
    return bool(sections_at + size * count > len(data))


def _read_sums(folder: Path) -> dict[str, str]:
    try:
        sums = json.loads((folder / SUMS_NAME).read_bytes())
    except (OSError, ValueError):
        return {}
    return sums if isinstance(sums, dict) else {}


def _write_sums(folder: Path, sums: dict[str, str]) -> None:
    unfinished = folder / f"{SUMS_NAME}.{os.getpid()}"
    unfinished.write_text(json.dumps(sums, indent=0), encoding="utf-8")
    unfinished.replace(folder / SUMS_NAME)
