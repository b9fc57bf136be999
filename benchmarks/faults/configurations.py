"""Damaged configurations: each is read, or refused with file, line and column, and no traceback."""

import copy
import os
import random
import re
import resource
import signal
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import yaml

from benchmarks.faults.children import spread
from benchmarks.faults.results import Result, Scale
from gen_data import configs
from gen_data.assemble.config import load_config
from gen_data.core.errors import ConfigError, GenDataError

SHIPPED = sorted(Path(configs.__path__[0]).glob("*.yaml"))
SHORT = [p for p in SHIPPED if re.match("tabletop|bin_|shelf|wrist|depth", p.stem)]
BASES = SHIPPED + 5 * SHORT
"""Configurations of streets are read in 0.2 to 0.5 s each, the others in 0.01 to 0.1 s."""
PLACE = re.compile(r"^\S[^\n]*?:\d+:\d+: \S")
SECONDS_MAX = 5.0
MEGABYTES_MAX = 1_000
VALUES: tuple[Any, ...] = (
    None,
    True,
    False,
    0,
    1,
    -1,
    -7,
    2**31,
    2**63,
    -(10**40),
    0.5,
    -0.0,
    1e-300,
    1e308,
    "",
    " ",
    "x",
    "ä😀",
    "no",
    "1:30",
    "010",
    "nan",
    "-.inf",
    "~",
    "../../etc/passwd",
    "/dev/zero",
    "http://127.0.0.1:9/",
    "$shared.nothing",
    "$",
    "a" * 5000,
    "\n",
    "{",
    "%",
    [],
    {},
    [[]],
    [None],
    [1, 2, 3, 4, 5],
    ["a", "a"],
    {"uniform": [0, 1]},
    {"uniform": [1, 0]},
    {"uniform": "x"},
    {"normal": {"mean": 0, "std": -1}},
    {"choice": {}},
    {"choice": {"a": -1}},
    {"choice": []},
    {"uniform_integer": [0.5, 2]},
    {"log_uniform": [0, 1]},
    {"switch": "nothing", "1": 2},
    {"type": "nothing"},
    {"type": "camera_pose"},
    {"": ""},
    {"a": {"b": {"c": {"d": {}}}}},
)
"""Replacements: other types, ends of ranges, distributions that are none, strange texts."""


def structured(scale: Scale, folder: Path) -> Result:
    """Shipped configurations with one to four values, keys or entries exchanged or removed."""
    return _try_all(scale, folder, _mutate_tree)


def mutated_bytes(scale: Scale, folder: Path) -> Result:
    """Shipped configurations with one to eight bytes, lines or parts changed."""
    return _try_all(scale, folder, _mutate_bytes)


def _try_all(scale: Scale, folder: Path, mutate: Callable[[random.Random], bytes]) -> Result:
    result = Result()
    count = scale.pick(10_000, 150)
    ends: Counter[str] = Counter()
    slowest_s, largest_mb = 0.0, 0
    seeds = range(scale.seed, scale.seed + count)
    outcomes = spread(partial(_try, folder, mutate), seeds)
    for seed in result.until_end(scale, seeds):
        end, problem, seconds, megabytes = next(outcomes)
        ends[end] += 1
        slowest_s, largest_mb = max(slowest_s, seconds), max(largest_mb, megabytes)
        result.add(not problem, f"seed {seed}: {problem}")
    result.add(largest_mb < MEGABYTES_MAX, f"{largest_mb} MB of memory")
    result.notes += [f"{number} {end}" for end, number in sorted(ends.items())]
    result.notes.append(f"slowest {slowest_s:.1f} s of CPU, most memory {largest_mb} MB")
    return result


def _try(
    folder: Path, mutate: Callable[[random.Random], bytes], seed: int
) -> tuple[str, str, float, int]:
    """Outcome of reading a mutant, its fault if any, CPU seconds, and memory used [MB]."""
    # In the folder of the shipped files, paths in them would have another meaning.
    path = folder / f"mutant-{os.getpid()}.yaml"
    path.write_bytes(mutate(random.Random(seed)))
    inherited_mb = _first_peak_mb(os.getpid())
    started_s = time.process_time()
    end, problem = _read(path)
    seconds = time.process_time() - started_s
    if seconds > SECONDS_MAX:
        problem = problem or f"took {seconds:.1f} s"
    return end, problem, seconds, _peak_mb() - inherited_mb


def _peak_mb() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10


@cache
def _first_peak_mb(process: int) -> int:
    """Peak memory at the first call in this process: the memory inherited from its parent."""
    del process
    return _peak_mb()


def _read(path: Path) -> tuple[str, str]:
    signal.signal(signal.SIGALRM, _raise_timeout)
    signal.alarm(60)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            load_config(str(path))
    except ConfigError as error:
        lines = [line for line in str(error).splitlines() if not line.startswith(" ")]
        wrong = [line for line in lines if not PLACE.match(line)]
        return "refused", f"no file:line:column in {wrong[0]!r}" if wrong else ""
    except GenDataError as error:
        place = "" if PLACE.match(str(error)) else f"no file:line:column in {str(error)!r}"
        return f"refused ({type(error).__name__})", place
    except BaseException:
        return "traceback", traceback.format_exc()[-700:]
    finally:
        signal.alarm(0)
    return "accepted", ""


def _raise_timeout(number: int, frame: object) -> None:
    raise TimeoutError("not read within 60 s")


def _mutate_tree(rng: random.Random) -> bytes:
    tree = yaml.load(rng.choice(BASES).read_text("utf-8"), yaml.CSafeLoader)
    for _ in range(rng.randint(1, 4)):
        _change(tree, rng)
    text: str = yaml.safe_dump(tree, allow_unicode=True, sort_keys=False)
    return text.encode("utf-8", "surrogatepass")


def _change(tree: Any, rng: random.Random) -> None:
    node = tree
    while True:
        keys = list(node) if isinstance(node, dict) else list(range(len(node)))
        if not keys:
            return
        key = rng.choice(keys)
        if isinstance(node[key], (dict, list)) and node[key] and rng.random() < 0.8:
            node = node[key]
            continue
        break
    kind = rng.randrange(6)
    if kind == 0:
        del node[key]
    elif kind == 1 and isinstance(node, dict):
        node[_misspell(str(key), rng)] = node.pop(key)
    elif kind == 2 and isinstance(node, list):
        node.append(node[key])
    elif kind == 3:
        node[key] = _other_value_of(tree, rng)
    else:
        node[key] = rng.choice(VALUES)


def _misspell(text: str, rng: random.Random) -> str:
    letters = list(text) or [""]
    place = rng.randrange(len(letters))
    letters[place] = rng.choice(["", "x", letters[place] * 2, "$", " ", "é"])
    return "".join(letters)


def _other_value_of(tree: Any, rng: random.Random) -> Any:
    """A copy of a value from elsewhere, as after a wrong indentation."""
    node = tree
    while isinstance(node, (dict, list)) and node and rng.random() < 0.7:
        node = node[rng.choice(list(node) if isinstance(node, dict) else range(len(node)))]
    return copy.deepcopy(node)


def _mutate_bytes(rng: random.Random) -> bytes:
    data = bytearray(rng.choice(BASES).read_bytes())
    for _ in range(rng.randint(1, 8)):
        place = rng.randrange(len(data) + 1)
        end = min(len(data), place + rng.choice([0, 1, 1, 2, 8, 60]))
        kind = rng.randrange(6)
        if kind == 0:
            del data[place:end]
        elif kind == 1:
            data[place:end] = rng.choice(TOKENS)
        elif kind == 2:
            data[place:place] = data[rng.randrange(len(data) + 1) :][: rng.choice([5, 80, 800])]
        elif kind == 3 and place < len(data):
            data[place] ^= 1 << rng.randrange(8)
        elif kind == 4:
            data[place:place] = rng.randbytes(rng.choice([1, 2, 8]))
        else:
            lines = bytes(data).splitlines(keepends=True)
            first, second = rng.randrange(len(lines)), rng.randrange(len(lines))
            lines[first], lines[second] = lines[second], lines[first]
            data = bytearray(b"".join(lines))
        if not data:
            break
    return bytes(data)


TOKENS = (
    b"{", b"}", b"[", b"]", b":", b": ", b"- ", b"\n", b"\n  ", b"\t", b"&a ", b"*a", b"!!", b"!x ",
    b"---\n", b"%YAML 9.9\n", b"...\n", b"<<: ", b"? ", b"| ", b"> ", b"'", b'"', b"#", b",", b"\\",
    b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\x85", b"\xe2\x80\xa8", b"1e999",
    b".nan", b"-.inf", b"0x_", b"1_000", b"9" * 400, b"null", b"~",
    b"[" * 40, b"{a: " * 40, b"&a [*a]",
    b"\r",
)  # fmt: skip
"""Syntax of YAML in wrong places."""
