"""Native functions of kernels: their C++ is in header files next to the kernels.

A header is the body of one function, named like it, or a part that bodies include. Its parameters
are the Python function's.
"""

import re
from pathlib import Path

LANES = 8
"""Lanes of a vector on the CPU: arrays that vectors are read from or written to are that much
longer than their contents."""
ROOT = Path(__file__).parent
"""Folder that ``#include`` starts from."""
_INCLUDE = re.compile(r'^#include "(.+)"$', re.MULTILINE)


def native(path: str, **constants: float) -> str:
    """Text of a header, with the headers that it includes, and constants in front of it."""
    text = _INCLUDE.sub(lambda found: native(found[1]), (ROOT / path).read_text(encoding="utf-8"))
    given = (f"constexpr float {name} = {float(value)}f;" for name, value in constants.items())
    return "\n".join(("", *given, text))
