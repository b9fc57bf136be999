"""Certificates of finished data sets: made, stored next to the manifest, and made again."""

import hashlib
import json
import platform
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from gen_data.core import errors, serialization
from gen_data.core.version import __version__
from gen_data.lab.certificate.claims import CLAIMS, FILES, Claim
from gen_data.lab.certificate.examined import Examined, Scope
from gen_data.lab.certificate.finding import Finding, Status, not_checked
from gen_data.lab.certificate.readers import READERS
from gen_data.runner import layout, plan, verify
from gen_data.runner.stored import StoredSamples

FORMAT_VERSION = 1
"""Of the layout of ``CERTIFICATE.json``."""

TOOLS = ("numpy", "opencv-python-headless", "open3d", "pycocotools", "scipy")
"""Packages that claims use, besides the readers of formats."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Identity:
    """The certified data set.

    Attributes:
        name: Name of the configuration.
        dataset_id: Digest of all files, as in the manifest.
        manifest_sha256: Digest of the manifest.
        samples: Number of samples.
    """

    name: str
    dataset_id: str
    manifest_sha256: str
    samples: int


@dataclass(frozen=True)
class CheckedClaim:
    """A claim with its findings."""

    name: str
    statement: str
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class Certificate:
    """Claims about one data set, with the findings of their checks.

    Equal data sets, scopes and versions give equal certificates.

    Attributes:
        dataset: The data set.
        scope: How much of it was sampled.
        versions: Releases of gen-data, Python and the packages that checked.
        claims: All claims.
        date: As the caller gave it, such as ``2026-11-23``; empty = none. Clocks are not asked.
    """

    dataset: Identity
    scope: Scope
    versions: Mapping[str, str]
    claims: tuple[CheckedClaim, ...]
    date: str = ""
    format_version: int = FORMAT_VERSION

    def findings(self, status: Status | None = None) -> Iterator[tuple[CheckedClaim, Finding]]:
        """Findings with their claims, of all statuses or of one."""
        for claim in self.claims:
            for finding in claim.findings:
                if status in (None, finding.status):
                    yield claim, finding

    @property
    def holds(self) -> bool:
        """Whether something was checked and nothing failed."""
        return not any(self.findings(Status.FAILED)) and any(self.findings(Status.PASSED))

    def count(self, status: Status) -> int:
        """Number of findings with a status."""
        return sum(1 for _ in self.findings(status))

    def to_bytes(self) -> bytes:
        """Contents of ``CERTIFICATE.json``."""
        plain = {"holds": self.holds, **asdict(self)}
        return (json.dumps(plain, ensure_ascii=False, indent=1, allow_nan=False) + "\n").encode()


def examine(
    folder: Path, scope: Scope, date: str = "", progress: Progress = lambda _: None
) -> Certificate:
    """Check all claims about a finished data set.

    Args:
        folder: Folder of the data set.
        scope: How much is sampled.
        date: Date of the certificate; empty = none.
        progress: Called with the name of each claim when its check begins.

    Raises:
        VerificationError: the folder has no finished data set.
        StorageError: its manifest or plan is damaged, or the file system refused to read or write.
    """
    verify.scan_finished(folder)
    examined = Examined(StoredSamples(folder), scope)
    claims: list[CheckedClaim] = []
    damaged = ""
    for claim in CLAIMS:
        progress(claim.name)
        findings = (not_checked("", damaged),) if damaged else _check(claim, examined)
        claims.append(CheckedClaim(claim.name, claim.statement, tuple(findings)))
        if claim is FILES and findings[0].status is Status.FAILED:
            damaged = "the files differ from the manifest"
    return Certificate(identify(examined.stored), scope, _versions(), tuple(claims), date)


def identify(stored: StoredSamples) -> Identity:
    """The identity of a data set."""
    manifest = (stored.folder / layout.MANIFEST_NAME).read_bytes()
    digest = hashlib.sha256(manifest).hexdigest()
    return Identity(stored.plan.name, stored.dataset_id, digest, stored.n)


def load_certificate(folder: Path) -> Certificate | None:
    """Read the certificate of a data set; None if there is none.

    Raises:
        VerificationError: it is damaged, or belongs to another data set.
        StorageError: the manifest is damaged.
    """
    path = folder / layout.CERTIFICATE_NAME
    try:
        plain = json.loads(path.read_bytes())
        holds = plain.pop("holds")
        certificate = serialization.from_plain(Certificate, plain)
        if certificate.format_version != FORMAT_VERSION or certificate.holds != holds:
            raise ValueError("its parts contradict each other")
    except FileNotFoundError:
        return None
    except plan.DAMAGE as error:
        raise errors.VerificationError(
            f"{path}: is not a certificate of this version of gen-data ({error}); {_REMEDY}"
        ) from None
    identity = identify(StoredSamples(folder))
    if certificate.dataset != identity:
        raise errors.VerificationError(
            f"{path}: certifies the data set {certificate.dataset.dataset_id[:16]}; expected "
            f"{identity.dataset_id[:16]}, which {layout.MANIFEST_NAME} names; {_REMEDY}"
        )
    return certificate


_REMEDY = "make it again with gen-data certify, or remove it"


def compare(stored: Certificate, again: Certificate) -> tuple[list[str], list[str]]:
    """Contradictions and notes: a stored certificate against one that was made again.

    A failure now is a contradiction, and so are figures that differ although the same versions
    checked the same files. A check that is not possible now is a note.
    """
    was = {(claim.name, f.subject): f for claim, f in stored.findings()}
    now = {(claim.name, f.subject): f for claim, f in again.findings()}
    contradictions, notes = [], []
    for key in dict.fromkeys((*was, *now)):
        name = ": ".join(filter(None, key))
        before, after = was.get(key), now.get(key)
        if before is None or after is None:
            contradictions.append(f"{name}: is in one of the two certificates only")
        elif after.status is Status.FAILED:
            contradictions.append(f"{name}: {_describe(after)}")
        elif before.status is Status.FAILED:
            contradictions.append(f"{name}: passes now, and failed before")
        elif after.status is Status.NOT_CHECKED and before.status is Status.PASSED:
            notes.append(f"{name}: not checked again: {after.reason}")
        elif (
            stored.versions == again.versions
            and before.status is after.status
            and dict(before.figures) != dict(after.figures)
        ):
            contradictions.append(
                f"{name}: figures were {dict(before.figures)}, now {dict(after.figures)}"
            )
    return contradictions, notes


def describe_failures(certificate: Certificate) -> list[str]:
    """One line per failed finding."""
    return [
        f"{': '.join(filter(None, (claim.name, finding.subject)))}: {_describe(finding)}"
        for claim, finding in certificate.findings(Status.FAILED)
    ]


def _describe(finding: Finding) -> str:
    count = int(finding.figures.get("contradictions", len(finding.evidence)))
    more = f" (and {count - 1} more)" if count > 1 else ""
    return f"{finding.evidence[0] if finding.evidence else 'failed'}{more}"


def _check(claim: Claim, examined: Examined) -> tuple[Finding, ...]:
    """Findings of a claim; damage that prevents a check fails it.

    Raises:
        StorageError: the file system refused to read or write, which proves nothing.
    """
    try:
        return tuple(claim.check(examined))
    except (errors.GenDataError, OSError, ValueError, KeyError, TypeError, IndexError) as error:
        if errors.is_refused(error):
            fact = f"claim '{claim.name}' was not checked: {error}"
            raise errors.StorageError(f"{examined.stored.folder}: {fact}") from error
        if isinstance(error, errors.ConfigError | errors.AssetError):
            return (not_checked("", f"not possible on this machine: {error}"),)
        text = f"the data set cannot be read: {type(error).__name__}: {error}"
        return (Finding("", Status.FAILED, evidence=(text,)),)


def _versions() -> dict[str, str]:
    packages = {*TOOLS, *(name for reader in READERS.values() for name in reader.versions())}
    found = {"gen-data": __version__, "python": platform.python_version()}
    for name in sorted(packages):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
