"""Claim: samples that are generated again are the stored ones.

It binds photographs, which no independent program could make, to the plan: an exchanged or edited
picture is not the one of its scene.
"""

from collections.abc import Iterator

from gen_data.core.errors import GenDataError, is_refused
from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Contradictions, Finding, not_checked
from gen_data.lab.certificate.ray_casting import share_limit
from gen_data.runner.numerics_guard import is_admitted
from gen_data.runner.regeneration import compare_regenerated
from gen_data.runner.store import LocalStore


def check_again(examined: Examined) -> Iterator[Finding]:
    """Generate random samples again, and compare their decoded files with the stored ones."""
    indices = examined.chosen_indices()
    if examined.changes or not indices:
        yield not_checked("", examined.changes or "no sample was generated again")
        return
    store, contradictions = LocalStore(examined.stored.folder), Contradictions()
    try:
        for difference in compare_regenerated(
            store, examined.stored.plan, examined.regeneration, indices, semantic=True
        ):
            contradictions.add(str(difference))
        if contradictions.count and not is_admitted(store, examined.regeneration.make_pipeline):
            reason = "this machine computes differently from the one that made the data set"
            yield not_checked("", f"{reason}: see gen-data doctor")
            return
    except GenDataError as error:
        if is_refused(error):
            raise
        yield not_checked("", f"samples cannot be generated on this machine: {error}")
        return
    figures = {
        "samples": len(indices),
        "differing share, at most (99 %)": share_limit(contradictions.count, len(indices)),
    }
    yield contradictions.judge("", figures)
