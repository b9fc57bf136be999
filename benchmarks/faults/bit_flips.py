"""Single flipped bits of a finished data set: each is found, named and repaired."""

import random
import shutil
from pathlib import Path

from benchmarks.faults import recorded_run, results
from gen_data.core.errors import GenDataError
from gen_data.runner.verify import find_deviations


def bit_flips(scale: results.Scale, folder: Path) -> results.Result:
    """Flip a random bit of a random file, verify with all digests, and repair."""
    result = results.Result()
    rng = random.Random(scale.seed)
    digest = recorded_run.reference_digest(folder)
    out = folder / "out"
    recorded_run.record().make(out)
    files = sorted(p for p in out.rglob("*") if p.is_file() and "run" not in p.parts)
    files = [path for path in files if path.stat().st_size]
    for _ in result.until_end(scale, range(scale.pick(1_000, 20))):
        path = rng.choice(files)
        data = bytearray(path.read_bytes())
        bit = rng.randrange(8 * len(data))
        data[bit // 8] ^= 1 << bit % 8
        # In place: the other links to the file are damaged, too.
        with path.open("r+b") as file:
            file.write(data)
        result.add(*_judge(out, path.relative_to(out).as_posix(), bit, digest))
        shutil.rmtree(out / "run/quarantine", ignore_errors=True)
    result.notes.append(f"in {len(files)} files of all kinds")
    return result


def _judge(out: Path, path: str, bit: int, digest: str) -> tuple[bool, str]:
    """Whether a damaged file is named and restored, and a description of any other fault."""
    found = find_deviations(out, full=True)
    named = any(finding.path in (path, "SHA256SUMS", "manifest.json") for finding in found)
    try:
        recorded_run.record().make(out, repair=True)
    except GenDataError as error:
        return False, f"{path}, bit {bit}: {error}"
    problem = "" if named else "not found"
    if recorded_run.tree_digest(out) != digest:
        problem += " not repaired"
    return not problem, f"{path}, bit {bit}: {problem}"
