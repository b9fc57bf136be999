"""Tables on narrow screens."""

import re

CELL = re.compile(r"<td[^>]*>.*?</td>", re.DOTALL)
CODE = re.compile(r"(?<=<code>)[^<]*")
JOINT = re.compile(r"(?<=[_/.,:=])(?=\S)")


def with_breaks(html: str) -> str:
    """The page with places in the code of its cells at which a line may break: between words."""
    return CELL.sub(lambda cell: CODE.sub(lambda code: JOINT.sub("<wbr>", code[0]), cell[0]), html)
