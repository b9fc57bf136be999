"""Samples of a finished data set at a URL; shards are copied to a cache when they are read."""

import hashlib
import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from gen_data.core import errors, urls
from gen_data.runner import object_store, seal, shard_record, stored
from gen_data.runner.layout import MANIFEST_NAME, PLAN_NAME, SHARDS_NAME


def open_stored(place: str | os.PathLike[str]) -> stored.StoredSamples:
    """Open a finished data set in a folder or at a URL."""
    return StoredObjects(os.fspath(place)) if urls.is_url(place) else stored.StoredSamples(place)


def url_cache_dir() -> Path:
    """Folder of the files of data sets that were opened at a URL."""
    import platformdirs

    return Path(platformdirs.user_cache_path("gen-data")) / "data-sets"


class StoredObjects(stored.StoredSamples):
    """Samples of a data set at a URL.

    The cache has one folder per data set, named by its id, which many processes may fill.

    Raises:
        StorageError: the URL holds no finished data set, or cannot be read.
    """

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        self._objects = object_store.ObjectFolder(self.url)
        documents = self._objects.read([PLAN_NAME, MANIFEST_NAME])
        manifest = seal.parse_object(documents.get(MANIFEST_NAME, b"")) or {}
        if PLAN_NAME not in documents or "dataset_id" not in manifest:
            raise errors.StorageError(
                f"{self.url}: no finished data set: {PLAN_NAME} or {MANIFEST_NAME} is missing; "
                "run the command that began it again"
            )
        self._record_digests: Sequence[str] = manifest.get("shards", [])
        cache = url_cache_dir()
        folder = cache / stored.parse_dataset_id(manifest, self.url)
        try:
            (folder / SHARDS_NAME).mkdir(parents=True, exist_ok=True)
            for name, data in documents.items():
                unfinished = Path(mkdtemp(dir=cache)) / name
                unfinished.write_bytes(data)
                unfinished.replace(folder / name)
                unfinished.parent.rmdir()
        except OSError as error:
            raise errors.StorageError(
                f"{error.filename or cache}: {error.strerror}; shards of {self.url} are copied "
                "there. Point XDG_CACHE_HOME to a folder with room"
            ) from error
        super().__init__(folder)

    def shard_dir(self, shard: int) -> Path:
        """Folder of the files of a shard, copied there at the first call."""
        folder = super().shard_dir(shard)
        if not folder.is_dir():
            self._fetch(shard, folder)
        return folder

    def _fetch(self, shard: int, folder: Path) -> None:
        name = f"{SHARDS_NAME}/{shard:06d}.json"
        data = self._objects.read([name]).get(name, b"")
        record = shard_record.parse_unchecked_record(data)
        expected = self._record_digests[shard : shard + 1]
        if record is None or [hashlib.sha256(data).hexdigest()] != list(expected):
            raise errors.StorageError(
                f"{self.url}/{name}: missing, or its sha256 is not the one in the manifest; check "
                f"the data set with:\n    gen-data verify {self.url}"
            )
        unfinished = Path(mkdtemp(dir=self.folder))
        try:
            object_store.fetch_shard(self._objects, record, unfinished / "shard")
            (unfinished / "shard").rename(folder)
        except OSError:
            # Another process may have been faster.
            if not folder.is_dir():
                raise
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)

    def __getstate__(self) -> dict[str, Any]:
        """Pickle only the URL."""
        return {"folder": self.url}
