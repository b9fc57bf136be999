"""Digests of code, for stored results that depend on it."""

from functools import lru_cache
from hashlib import sha256
from pathlib import Path


@lru_cache(maxsize=16)
def code_digest(files: tuple[str, ...], *versions: str) -> str:
    """Digest of source files and versions of libraries, 16 hexadecimal digits."""
    digest = sha256(" ".join(versions).encode())
    for file in files:
        digest.update(Path(file).read_bytes())
    return digest.hexdigest()[:16]
