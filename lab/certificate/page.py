"""A certificate as one HTML page without scripts, which requests nothing."""

from collections.abc import Iterator
from html import escape

from gen_data.lab.certificate.certificate import Certificate, CheckedClaim
from gen_data.lab.certificate.finding import Finding, Status
from gen_data.report.html_page import format_check, format_document, format_tiles

CLASSES = {Status.PASSED: "good", Status.FAILED: "bad", Status.NOT_CHECKED: "quiet"}
"""Classes of the style sheet."""

LIMITS = (
    "A certificate does not state that the data set is realistic, that a model trained on it works "
    "elsewhere, or that its configuration is the one you wanted. Meshes, poses and materials are "
    "taken as they are. Unchecked claims are unknown, and a claim about samples holds "
    "for the sampled share."
)


def format_page(certificate: Certificate) -> str:
    """Format the HTML document."""
    dataset = certificate.dataset
    verdict = "holds" if certificate.holds else "does not hold"
    tiles = (
        ("verdict", verdict, "good" if certificate.holds else "bad"),
        *((s.value, str(certificate.count(s)), CLASSES[s]) for s in Status),
        ("samples", str(dataset.samples), ""),
    )
    facts = {
        "data set": dataset.dataset_id,
        "manifest.json (SHA-256)": dataset.manifest_sha256,
        **({"date": certificate.date} if certificate.date else {}),
        "sampled": f"{certificate.scope.samples} samples with {certificate.scope.rays} rays each, "
        f"{certificate.scope.scenes} scenes drawn again",
        "versions": ", ".join(f"{k} {v}" for k, v in certificate.versions.items()),
    }
    body = "".join(
        (
            f"<main><h1>Certificate of {escape(dataset.name)}</h1>",
            format_tiles(tiles),
            '<div class="card">',
            *(f"<p>{escape(name)}: {escape(value)}</p>" for name, value in facts.items()),
            "</div>",
            *(part for claim in certificate.claims for part in _claim(claim)),
            f"<h2>Limits</h2><p>{escape(LIMITS)}</p>",
            "<p>gen-data verify --deep repeats every claim on your machine.</p></main>",
        )
    )
    return format_document(f"Certificate of {dataset.name}", body)


def _claim(claim: CheckedClaim) -> Iterator[str]:
    yield f"<h2>{escape(claim.name.capitalize())}</h2><p>{escape(claim.statement)}</p>"
    yield '<div class="card">'
    for finding in claim.findings:
        subject = finding.subject or "data set"
        yield format_check(subject, finding.status.value, CLASSES[finding.status])
        yield from (f"<p>{escape(text)}</p>" for text in _facts(finding))
    yield "</div>"


def _facts(finding: Finding) -> Iterator[str]:
    if finding.reason:
        yield finding.reason
    if finding.figures:
        yield "; ".join(f"{name}: {value}" for name, value in finding.figures.items())
    yield from finding.evidence
