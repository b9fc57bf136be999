"""Names and texts of users in Markdown, as plain text."""

import html


def plain(text: object) -> str:
    """Text of one line without HTML or ends of a table's cell."""
    return html.escape(" ".join(str(text).split()), quote=False).replace("|", r"\|")
