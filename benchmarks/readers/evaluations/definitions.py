"""Parts of programs that import more than their evaluation needs."""

import __future__

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def definitions(path: Path, names: str, **used: Any) -> Iterator[Any]:
    """Functions and classes of a file, in the order of ``names``, without its other statements.

    ``used`` are the names that they use from elsewhere: modules, constants. Decorators, which
    register classes or compile functions, are left out, and annotations are not evaluated.
    """
    wanted = names.split()
    body = [
        node
        for node in ast.parse(path.read_text("utf-8")).body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name in wanted
    ]
    for node in body:
        node.decorator_list = []
    flags = __future__.annotations.compiler_flag
    program = compile(ast.Module([*body], []), str(path), "exec", flags, dont_inherit=True)
    space = dict(used)
    exec(program, space)
    return (space[name] for name in wanted)


@dataclass(frozen=True, eq=False)
class Tensor:
    """The methods of PyTorch's tensors that evaluations call on their arrays."""

    array: NDArray[Any]
    __array_ufunc__ = None  # `matrix @ tensor` is left to `__rmatmul__`

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the axes."""
        return self.array.shape

    def __getitem__(self, key: Any) -> "Tensor":
        """A part."""
        return Tensor(self.array[key])

    def __rmatmul__(self, matrix: NDArray[Any]) -> "Tensor":
        """The product with a matrix to the left."""
        return Tensor(matrix @ self.array)

    def unsqueeze(self, axis: int) -> "Tensor":
        """The same with a further axis of length 1."""
        return Tensor(np.expand_dims(self.array, axis))

    def squeeze(self, axis: int) -> "Tensor":
        """The same without an axis of length 1."""
        return Tensor(self.array.squeeze(axis))

    def float(self) -> "Tensor":
        """The same in single precision."""
        return Tensor(self.array.astype(np.float32))

    def cpu(self) -> "Tensor":
        """Itself."""
        return self

    def numpy(self) -> NDArray[Any]:
        """Its array."""
        return self.array
