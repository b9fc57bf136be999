"""``gen-data certify``: check all claims about a data set, and write its certificate."""

import os
from datetime import datetime, timezone
from pathlib import Path

import click

from gen_data.core.errors import CertificationError, ConfigError


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--samples",
    type=int,
    default=20,
    show_default=True,
    help="Samples that are compared with an independent ray caster.",
)
@click.option(
    "--rays",
    type=int,
    default=500,
    show_default=True,
    help="Pixels of each of their images, and points of each scan.",
)
@click.option(
    "--scenes",
    type=int,
    default=100,
    show_default=True,
    help="Scenes whose parameters are drawn again.",
)
@click.option(
    "--alpha",
    type=float,
    default=1e-3,
    show_default=True,
    help="Probability that the distributions of a correct data set fail.",
)
def certify(folder: Path, samples: int, rays: int, scenes: int, alpha: float) -> None:
    """Check a data set by independent means, and write CERTIFICATE.json and a page next to it.

    Claims that could not be checked on this machine are listed with the package to install.
    verify --deep repeats the checks. Exit code 8 if a claim fails. A certificate has the date of
    SOURCE_DATE_EPOCH, if that is set.
    """
    from rich.console import Console

    from gen_data.lab.certificate.api import certify as make_certificate
    from gen_data.lab.certificate.certificate import describe_failures
    from gen_data.lab.certificate.finding import Status
    from gen_data.runner.layout import CERTIFICATE_NAMES

    with Console(stderr=True).status("") as status:
        certificate = make_certificate(
            folder,
            samples=samples,
            rays=rays,
            scenes=scenes,
            alpha=alpha,
            date=_date(os.environ.get("SOURCE_DATE_EPOCH", "")),
            on_progress=lambda claim: status.update(f"{folder}: {claim}"),
        )
    for claim, finding in certificate.findings():
        subject = f" {finding.subject}" if finding.subject else ""
        reason = f": {finding.reason}" if finding.reason else ""
        click.echo(f"{finding.status.value:<11} {claim.name}{subject}{reason}")
    click.echo(f"wrote {' and '.join(str(folder / name) for name in CERTIFICATE_NAMES)}")
    failures = describe_failures(certificate)
    if failures:
        listed = "\n".join(f"  {line}" for line in failures)
        raise CertificationError(f"{folder}: {len(failures)} claim(s) failed:\n{listed}")
    if not certificate.count(Status.PASSED):
        raise CertificationError(f"{folder}: nothing could be checked")


def _date(epoch_s: str) -> str:
    """The day, UTC, that so many seconds since 1970 make; empty for none."""
    if not epoch_s:
        return ""
    try:
        return datetime.fromtimestamp(int(epoch_s), timezone.utc).date().isoformat()
    except (ValueError, OverflowError, OSError):
        raise ConfigError(
            f"SOURCE_DATE_EPOCH: {epoch_s!r} is not a number of seconds since 1970"
        ) from None
