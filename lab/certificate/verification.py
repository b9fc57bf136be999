"""The check of a data set's certificate by ``gen-data verify``."""

from pathlib import Path

from gen_data.core.errors import VerificationError
from gen_data.runner.layout import CERTIFICATE_NAME


def check_certificate(folder: Path, deep: bool) -> tuple[list[str], list[str]]:
    """Compare a certificate with the manifest, and with ``deep`` with one that is made now.

    Returns:
        Contradictions; and notes on the comparison. Both are empty without a certificate.
    """
    if not (folder / CERTIFICATE_NAME).is_file():
        return [], []
    from threadpoolctl import threadpool_limits

    from gen_data.lab.certificate.certificate import compare, examine, load_certificate

    try:
        certificate = load_certificate(folder)
    except VerificationError as error:
        _, _, fact = str(error).partition(f"{CERTIFICATE_NAME}: ")
        return [fact], []
    if certificate is None or not deep:
        return [], []
    with threadpool_limits(limits=1):
        contradictions, unsure = compare(certificate, examine(folder, certificate.scope))
    return list(contradictions), [
        "the certificate's claims hold again" * (not contradictions),
        *unsure,
    ]
