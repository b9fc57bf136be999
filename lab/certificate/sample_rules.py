"""Claim: every sample obeys the rules that samples are checked by before they are written."""

from collections.abc import Iterator

from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Contradictions, Finding
from gen_data.runner.deep_verify import find_invalid_samples


def check_sample_rules(examined: Examined) -> Iterator[Finding]:
    """Decode every sample and check its labels."""
    contradictions = Contradictions()
    for fault in find_invalid_samples(examined.stored.folder):
        contradictions.add(str(fault))
    yield contradictions.judge("", {"samples": examined.stored.n})
