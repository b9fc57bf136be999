"""Native code of kernels: each header is C++ that another compiler than Warp's accepts."""

import importlib
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_type_hints

import pytest
import warp as wp

from gen_data.renderers.warp.native_code import ROOT, native
from tests.tiers import sampled

HEADERS = sorted(str(path.relative_to(ROOT)) for path in ROOT.glob("*/kernels/*.h"))
SCALARS = {bool: "bool", float: "float", int: "int", wp.bool: "bool"}
# The text for CUDA, with one lane, which is ISO C++; Warp's own compiler takes that for the CPU.
PRELUDE = """
#include "builtin.h"
#define AS_ON_GPU
#define __ffs __builtin_ffs
using namespace wp;
"""


def functions() -> Iterator[wp.Function]:
    for path in sorted(ROOT.glob("*/kernels/[!_]*.py")):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        module = importlib.import_module(f"gen_data.renderers.warp.{name}")
        for member in vars(module).values():
            if isinstance(member, wp.Function) and member.native_snippet:
                yield member


FUNCTIONS = {function.key: function for function in functions()}
# Never compiled for CUDA, and in vector types that only Clang has: Warp's compiler checks it.
ON_CPU_ONLY = "grow"


def spelled(kind: Any, structs: dict[str, str]) -> str:
    """A type in C++; definitions of the structures in it are added to ``structs``."""
    if hasattr(kind, "ndim"):
        return f"array_t<{spelled(kind.dtype, structs)}>"
    if hasattr(kind, "vars"):
        if kind.key not in structs:
            lines = [f"{spelled(v.type, structs)} {name};" for name, v in kind.vars.items()]
            structs[kind.key] = f"struct {kind.key} {{ {' '.join(lines)} }};\n"
        return str(kind.key)
    if hasattr(kind, "_shape_"):
        form = "vec_t" if len(kind._shape_) == 1 else "mat_t"
        return f"{form}<{', '.join(map(str, kind._shape_))}, {spelled(kind._wp_scalar_type_, {})}>"
    return SCALARS.get(kind) or str(kind.__name__)


def test_every_header_is_the_body_of_a_function_or_part_of_one() -> None:
    """No text is left that nothing compiles."""
    bodies = "".join(function.native_snippet for function in FUNCTIONS.values())
    assert not [header for header in HEADERS if native(header).strip() not in bodies]


@pytest.mark.skipif(not shutil.which("g++"), reason="needs a C++ compiler, g++")
@pytest.mark.parametrize("name", sampled(sorted(FUNCTIONS.keys() - {ON_CPU_ONLY}), 9))
def test_a_native_function_compiles_alone(name: str) -> None:
    """With g++, from its declaration in Python and its header."""
    function = FUNCTIONS[name]
    structs: dict[str, str] = {}
    kinds = get_type_hints(function.func)
    result = spelled(kinds.pop("return"), structs) if "return" in kinds else "void"
    arguments = ", ".join(f"{spelled(kind, structs)} {key}" for key, kind in kinds.items())
    text = f"{PRELUDE}{''.join(structs.values())}{result} {name}({arguments}) {{\n"
    text += f"{function.native_snippet}\n}}\n"
    compiler = ("g++", "-std=c++17", "-fsyntax-only", "-x", "c++", "-")
    done = subprocess.run(
        [*compiler, "-I", str(Path(wp.__file__).parent / "native")],
        input=text,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
