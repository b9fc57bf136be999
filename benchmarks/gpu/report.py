"""The table of docs/performance.md from the figures, and the goals that were missed."""

from collections.abc import Mapping
from typing import Any

GOALS = (
    ("labelled samples/s to disk, tabletop", 500.0, "disk"),
    ("labelled samples/s in memory, tabletop", 2000.0, "memory"),
    ("rays/s of one launch", 1e9, "rays"),
)
"""On one card of the class of an H100 with 16 cores."""


def format_report(figures: Mapping[str, Any], failures: Mapping[str, str]) -> str:
    """Markdown of all measurements, then the goals, then missing parts."""
    parts = [
        _card(figures.get("card") or {}), _correctness(figures.get("correct") or {}),
        _rates(figures.get("rates") or {}),
        _sweeps(figures.get("sweeps") or {}, figures.get("paths") or {}),
        _kernels(figures.get("kernels") or {}), _goals(figures),
    ]  # fmt: skip
    if failures:
        parts.append("\n".join(["Missing:", *(f"- {n}: {why}" for n, why in failures.items())]))
    return "\n\n".join(part for part in parts if part)


def _card(card: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in card.items())


def _correctness(correct: Mapping[str, Any]) -> str:
    if not correct:
        return ""
    wrong = {name: c for name, c in correct.items() if c["findings"] or not c["repeats"]}
    lines = [f"Equal to the CPU: {len(correct) - len(wrong)} of {len(correct)} configurations."]
    for name, facts in wrong.items():
        lines += [f"- {name}: {f['what']}: {f['fact']}" for f in facts["findings"]]
        if not facts["repeats"]:
            lines.append(f"- {name}: a second drawing on the device has other bytes")
    return "\n".join(lines)


def _rates(rates: Mapping[str, Any]) -> str:
    counts = sorted({int(n) for r in rates.values() for n in r["memory"]})
    if not counts:
        return ""
    rows = ["| labelled samples/s | " + " | ".join(f"{n} workers" for n in counts) + " |"]
    rows.append("|---" * (len(counts) + 1) + "|")
    for name, rate in rates.items():
        for place, words in (("memory", "in memory"), ("disk", "to disk")):
            cells = [
                f"{rate[place][str(n)]:.1f} ({100 * rate['busy'].get(f'{place} {n}', 0.0):.0f} %)"
                if str(n) in rate[place] else "-"
                for n in counts
            ]  # fmt: skip
            rows.append(f"| {name}, {words} | " + " | ".join(cells) + " |")
    rows.append("")
    rows.append("In brackets: share of time in which the device had work.")
    for name, rate in rates.items():
        if rate["ready"]:
            mb = rate["device_mb"] / rate["ready"]
            stages = ", ".join(f"{stage} {ms:.1f}" for stage, ms in rate["stages"].items())
            rows.append(
                f"{name}: {rate['scenes']} scenes in turn, assets cached; {mb:.0f} MB of the device"
                f" per worker; CPU ms per sample: {stages}"
            )
        rows += [f"{name}, left out: {what}" for what in rate["left_out"]]
    return "\n".join(rows)


def _sweeps(sweeps: Mapping[str, Any], paths: Mapping[str, Any]) -> str:
    rows = [
        f"{name}: {s['rays'] / 1e6:.2f} million rays in {s['ms']:.2f} ms"
        f" = {s['rays'] / s['ms'] / 1e3:.1f} million rays/s to the host; "
        + ", ".join(f"{kernel} {ms:.2f} ms" for kernel, ms in s["kernels"][:6])
        for name, s in sweeps.items()
    ]
    rows += [
        f"path-traced tier on {device}: {p['paths_per_s'] / 1e6:.2f} million paths/s"
        for device, p in paths.items()
    ]
    return "\n".join(rows)


def _kernels(kernels: Mapping[str, Any]) -> str:
    lines = []
    for name, k in kernels.items():
        lines.append(
            f"{name}: wall-clock ms of single samples {k['wall_ms']}; device"
            f" {k['device_ms']:.2f} of {k['timed_wall_ms']:.2f} ms, {k['device_mb']:.0f} MB"
        )
        lines += [f"    {ms:8.3f} ms {calls:6.1f}x {what}" for what, calls, ms in k["table"][:30]]
    return "\n".join(lines)


def reached(figures: Mapping[str, Any]) -> dict[str, float]:
    """Best figures for each goal."""
    best: dict[str, float] = {}
    tabletop = (figures.get("rates") or {}).get("tabletop") or {}
    for place in ("disk", "memory"):
        if tabletop.get(place):
            best[place] = max(tabletop[place].values())
    sweeps = (figures.get("sweeps") or {}).values()
    if sweeps:
        best["rays"] = max(1e3 * s["rays"] / s["ms"] for s in sweeps)
    return best


def _goals(figures: Mapping[str, Any]) -> str:
    best = reached(figures)
    rows = ["| goal | measured | of the goal |", "|---|---|---|"]
    for name, goal, key in GOALS:
        if key in best:
            rows.append(f"| {goal:.3g} {name} | {best[key]:.4g} | {100 * best[key] / goal:.0f} % |")
        else:
            rows.append(f"| {goal:.3g} {name} | not measured | - |")
    return "\n".join(rows)
