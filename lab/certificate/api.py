"""Certification of a data set: the function behind ``gen-data certify``."""

import shutil
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.core.errors import ConfigError

if TYPE_CHECKING:
    from gen_data.lab.certificate.certificate import Certificate


def certify(
    folder: str | PathLike[str],
    *,
    samples: int = 20,
    rays: int = 500,
    scenes: int = 100,
    alpha: float = 1e-3,
    date: str = "",
    on_progress: Callable[[str], None] = lambda _: None,
) -> "Certificate":
    """Check all claims about a finished data set, and write its certificate next to the manifest.

    ``CERTIFICATE.json`` and ``CERTIFICATE.html`` are not part of the data set: its identity does
    not change. They are also written if claims fail.

    Args:
        folder: A finished data set.
        samples: Samples whose pixels and laser points are compared with an independent ray caster.
        rays: Pixels per image, and points per scan, of these samples.
        scenes: Scenes whose parameters are drawn again.
        alpha: Probability that a correct data set fails the claim on distributions, in (0, 0.1].
        date: Date of the certificate, such as ``2026-11-23``; empty = none, as no clock is asked.
        on_progress: Called with the name of each claim when its check begins.

    Returns:
        The certificate: ``holds`` is whether no claim failed, ``claims`` has the findings.

    Raises:
        ConfigError: a number is out of range.
        VerificationError: the folder has no finished data set.
        StorageError: a file cannot be read or written.
    """
    from threadpoolctl import threadpool_limits

    from gen_data.lab.certificate.certificate import examine
    from gen_data.lab.certificate.examined import Scope
    from gen_data.lab.certificate.page import format_page
    from gen_data.runner.durable_files import make_folder
    from gen_data.runner.layout import CERTIFICATE_NAMES
    from gen_data.runner.store import LocalStore

    for name, value in (("samples", samples), ("rays", rays), ("scenes", scenes)):
        if value < 0:
            raise ConfigError(f"{name}: {value} is negative; expected 0 or more")
    if not 0.0 < alpha <= 0.1:
        raise ConfigError(
            f"alpha: {alpha} is not a false-alarm rate; expected more than 0, up to 0.1"
        )
    path = Path(folder)
    # Poses of scenes that are drawn again must have the last bits of the stored ones.
    with threadpool_limits(limits=1):
        certificate = examine(path, Scope(samples, rays, scenes, alpha), date, on_progress)
    documents = (certificate.to_bytes(), format_page(certificate).encode())
    store = LocalStore(path)
    with store.errors():
        make_folder(store.scratch_root)
        scratch = store.scratch_dir()
        try:
            # A page without its figures is none; figures without their page are complete.
            for name, data in zip(CERTIFICATE_NAMES, documents, strict=True):
                store.replace_file(name, data, scratch)
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
    return certificate
