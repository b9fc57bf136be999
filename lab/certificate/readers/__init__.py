"""Readers of exported formats: one file and one line in this table each.

A reader opens an export with the package that the format's users have, never with gen-data's code,
and returns its contents. A format without a line here is not checked, which the certificate states.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Protocol

from gen_data.core.distribution import install_command
from gen_data.lab.certificate.labelled_images import Loaded
from gen_data.runner.stored import StoredSamples


class Load(Protocol):
    """Reads an export."""

    def __call__(self, root: Path, stored: StoredSamples) -> Loaded:
        """Read the export in the folder ``root``.

        Raises:
            ImportError: the package is not installed.
            Exception: any exception, if the package refuses the export.
        """
        ...


@dataclass(frozen=True)
class Reader:
    """A reader of one format.

    Attributes:
        package: The distribution that reads.
        place: ``module:function`` of a ``Load``.
        tolerance_px: Largest deviation of boxes that the format's numbers bring about.
        further: Distributions that ``package`` does not bring along.
    """

    package: str
    place: str
    tolerance_px: float = 0.0
    further: tuple[str, ...] = ()

    def load(self) -> Load:
        """The function."""
        module, _, name = self.place.partition(":")
        function: Load = getattr(import_module(module), name)
        return function

    def versions(self) -> Mapping[str, str]:
        """Installed releases of its packages, by name; only of installed ones."""
        found = {}
        for name in (self.package, *self.further):
            try:
                found[name] = version(name)
            except PackageNotFoundError:
                continue
        return found

    def missing(self) -> str:
        """Command that installs the missing packages; empty if none is missing."""
        absent = sorted({self.package, *self.further} - {*self.versions()})
        return f"install {' '.join(absent)}: {install_command('certify')}" if absent else ""


_HERE = "gen_data.lab.certificate.readers"

READERS: Mapping[str, Reader] = {
    "coco": Reader("pycocotools", f"{_HERE}.coco:load_coco"),
    "croissant": Reader("mlcroissant", f"{_HERE}.croissant:load_croissant"),
    "hdf5": Reader("h5py", f"{_HERE}.hdf5:load_hdf5"),
    "huggingface": Reader("datasets", f"{_HERE}.huggingface:load_huggingface"),
    "mcap": Reader("mcap", f"{_HERE}.mcap:load_mcap", further=("mcap-protobuf-support",)),
    "pointclouds": Reader("open3d", f"{_HERE}.pointclouds:load_pointclouds"),
    "tfrecord": Reader("tfrecord", f"{_HERE}.tfrecord:load_tfrecord", 0.01),
    "usd": Reader("usd-core", f"{_HERE}.usd:load_usd"),
    "voc": Reader("supervision", f"{_HERE}.detection_datasets:load_voc"),
    "webdataset": Reader("webdataset", f"{_HERE}.webdataset:load_webdataset"),
    "yolo": Reader("supervision", f"{_HERE}.detection_datasets:load_yolo", 0.01),
}
"""By the format's name."""
