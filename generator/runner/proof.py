"""Proof that a data set is the one of a recipe: shard by shard, and whole before it is sealed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gen_data.core.errors import DeterminismError, GenDataError, VerificationError
from gen_data.runner.labels import LABELS_NAME
from gen_data.runner.layout import SHARDS_NAME
from gen_data.runner.seal import Entry, dataset_id, sums_text


@dataclass(frozen=True)
class Proof:
    """Digests of a data set that is made again.

    Attributes:
        dataset_id: Digest of the whole.
        shards: SHA-256 of the records of all shards; empty = not known.
        labels: SHA-256 of the labels of all shards; empty = not known.
        files: ``{path: sha256}`` of some files outside of shards.
        semantic: Labels must be equal, and nothing else.
    """

    dataset_id: str
    shards: Sequence[str]
    labels: Sequence[str]
    files: Mapping[str, str]
    semantic: bool = False

    def objection(self, shard: int, record: str, labels: str) -> GenDataError | None:
        """Why a shard with a record and labels of these digests is another one; None if equal."""
        place = f"{SHARDS_NAME}/{shard:06d}"
        other_labels = bool(self.labels) and self.labels[shard] != labels
        if self.semantic:
            return VerificationError(_other_labels(place)) if other_labels else None
        if not self.shards or self.shards[shard] == record:
            return None
        fact = (
            _other_labels(place)
            if other_labels
            else (
                f"{place}: differs from the recipe in an image, a scan, a scene or an export; its "
                f"{LABELS_NAME} is equal"
            )
        )
        return DeterminismError(
            f"{fact}.\n  Versions, assets and configuration are equal: this machine computes "
            "otherwise, or a digest of the recipe was changed.\n"
            "  --against FOLDER, with the author's files, names sample and field; --semantic "
            "compares labels only. Pull into another folder then"
        )

    def expect(self, entries: Sequence[Entry]) -> None:
        """Compare with all files of a data set, sorted by path, whose shards have no objection.

        Raises:
            DeterminismError: they are others; the message names the first file, where it is known.
        """
        now = dataset_id(sums_text(entries))
        if now == self.dataset_id:
            return
        digests = {entry.path: entry.sha256 for entry in entries}
        paths = [path for path, was in self.files.items() if digests.get(path) != was]
        fact = (
            f"{paths[0]}: differs from the recipe"
            if paths
            else ("an exported file differs, or dataset_id of the recipe was changed")
        )
        raise DeterminismError(
            f"{fact}; all shards are equal, the id is {now}, expected {self.dataset_id}; nothing "
            "was sealed"
        )


def _other_labels(place: str) -> str:
    return f"{place}/{LABELS_NAME}: differs from the recipe"
