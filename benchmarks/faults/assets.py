"""Hostile files: meshes, robots, images, panoramas, archives, roads and stages."""

import resource
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

from benchmarks.faults.results import Result, Scale

ROOT = Path(__file__).parents[2]


def hostile_assets(scale: Scale, folder: Path) -> Result:
    """All tests marked with ``hostile``: each file is refused in one line, within 10 s and 1 GB."""
    result = Result()
    if not scale.is_full:
        result.skip("all", "the tests of every day read these files")
        return result
    report = folder / "report.xml"
    files = sorted(
        str(path)
        for path in ROOT.glob("tests/*/test_*.py")
        if "@pytest.mark.hostile" in path.read_text("utf-8")
    )
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-m", "hostile", f"--junitxml={report}", *files],
        cwd=ROOT, capture_output=True, check=False,
    )  # fmt: skip
    slowest_s = 0.0
    for case in ET.parse(report).iter("testcase"):
        bad = case.find("failure") if case.find("failure") is not None else case.find("error")
        if case.find("skipped") is not None:
            result.skip(case.get("name", ""), "skipped by its test")
            continue
        slowest_s = max(slowest_s, float(case.get("time", 0.0)))
        text = "" if bad is None else bad.get("message", "")[:300]
        result.add(bad is None, f"{case.get('name')}: {text}")
    peak_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss >> 10
    result.notes.append(f"slowest {slowest_s:.1f} s, largest process {peak_mb} MB")
    return result
