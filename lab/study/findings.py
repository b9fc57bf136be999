"""Findings of a study: average precision and missed objects, as data and tables."""

from collections.abc import Mapping, Sequence
from typing import Any

from gen_data.lab.study import evaluation, failures
from gen_data.lab.study.comparison import Interval, adjust, interval, score

ALPHA = 0.05
"""False alarm rate of all verdicts of a study together."""

CLASS = "class"
BY_GROUP, BY_CLASS = "objects found, by group", "objects found, by class"
"""Titles of tables."""
ORDER = (
    *("dark", "middle", "bright"),
    *("visible", "partly occluded", "largely occluded"),
    *("small", "medium", "large"),
)
"""Groups from little to much."""

Table = dict[str, Any]
"""``title``, ``header``, ``rows`` of texts, ``note``."""


def describe(runs: Mapping[str, Sequence[evaluation.Evaluation]]) -> dict[str, Any]:
    """Compare variants.

    Args:
        runs: Evaluations by name of the variant, one per seed, on the same pictures; the first
            variant is the baseline.

    Returns:
        ``pictures``, ``objects``, ``seeds``, ``variants`` by name (AP, AP50 and the difference of
        AP to the baseline, with intervals, adjusted p and verdict), and ``groups``.
    """
    names = list(runs)
    scores = {name: score(runs[name]) for name in names}
    ap = {name: first for name, (first, _) in scores.items()}
    differences = {name: interval(ap[name] - ap[names[0]]) for name in names[1:]}
    adjusted = dict(zip(differences, adjust([d.p for d in differences.values()]), strict=True))
    first = runs[names[0]][0]
    return {
        "pictures": len(first.pictures),
        "objects": sum(not t.is_ignored for p in first.pictures for t in p.objects),
        "seeds": len(runs[names[0]]),
        "variants": {
            name: {
                "ap": _plain(interval(ap[name])),
                "ap50": _plain(interval(scores[name][1])),
                "ap_by_seed": ap[name].measured.tolist(),
            }
            | (
                {
                    "difference": _plain(differences[name]),
                    "p_adjusted": adjusted[name],
                    "verdict": _verdict(differences[name], adjusted[name]),
                }
                if name in differences
                else {}
            )
            for name in names
        },
        "groups": {
            name: [
                {"kind": kind, "group": group, "found": share.found, "objects": share.count}
                for (kind, group), share in failures.count_groups(runs[name]).items()
            ]
            for name in names
        },
    }


def tabulate(findings: Mapping[str, Any]) -> list[Table]:
    """Tables of findings: variants, and shares of objects found by group."""
    rows = []
    for name, facts in findings["variants"].items():
        difference = facts.get("difference")
        rows.append(
            [
                name,
                _with_interval(facts["ap"]),
                _with_interval(facts["ap50"]),
                _with_interval(difference, "+") if difference else "",
                _format_p(facts["p_adjusted"]) if difference else "",
                facts.get("verdict", ""),
            ]
        )
    seeds = findings["seeds"]
    note = (
        f"{findings['pictures']} pictures, {findings['objects']} objects, {seeds} "
        f"{'seed: how much results vary between seeds is unknown' if seeds == 1 else 'seeds'}; "
        "95 % intervals; p adjusted by Holm"
    )
    header = ["variant", "AP", "AP50", "AP - baseline", "p", "verdict"]
    tables: list[Table] = [{"title": "variants", "header": header, "rows": rows, "note": note}]
    return [*tables, *_tabulate_groups(findings["groups"], seeds)]


def _tabulate_groups(groups: Mapping[str, Any], seeds: int) -> list[Table]:
    """Shares of objects found by group, and by class: there may be a hundred of them."""
    names = list(groups)
    shares = {name: {(g["kind"], g["group"]): g for g in groups[name]} for name in names}
    every = sorted({key for row in shares.values() for key in row}, key=_rank)
    note = "IoU of 0.5 at least, at the score with the best F1 of each run"
    return [
        {
            "title": title,
            "header": [title.rpartition(" ")[2], "objects", *names],
            "rows": [
                [
                    group if kind == CLASS else f"{kind}: {group}",
                    # Steps of a ladder see different objects.
                    str(shares[names[0]].get((kind, group), {"objects": 0})["objects"] // seeds),
                    *(_percent(shares[name].get((kind, group))) for name in names),
                ]
                for kind, group in every
                if (kind == CLASS) == (title == BY_CLASS)
            ],
            "note": note,
        }
        for title in (BY_GROUP, BY_CLASS)
    ]


def _rank(key: tuple[str, str]) -> tuple[str, int, str]:
    """Order of a group by its kind, and from little to much within it."""
    kind, group = key
    return kind, ORDER.index(group) if group in ORDER else 0, group


def _plain(value: Interval) -> dict[str, float]:
    return {"mean": value.mean, "low": value.low, "high": value.high, "p": value.p}


def _verdict(difference: Interval, p: float) -> str:
    if p >= ALPHA:
        return "no difference found"
    return "better" if difference.mean > 0 else "worse"


def _format_p(p: float) -> str:
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def _with_interval(value: Mapping[str, float], sign: str = "") -> str:
    mean, low, high = (f"{value[key]:{sign}.3f}" for key in ("mean", "low", "high"))
    return f"{mean} ({low} to {high})"


def _percent(group: Mapping[str, Any] | None) -> str:
    return "" if group is None else f"{100.0 * group['found'] / group['objects']:.0f} %"
