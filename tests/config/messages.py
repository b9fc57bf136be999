"""Messages about documents as a user reads them: place, fact, source line and caret."""


def told(name: str, text: str, *faults: tuple[int, int, str]) -> str:
    """Messages about a text, by line, column and fact; tabs are shown as blanks."""
    lines = text.replace("\t", " ").split("\n")
    return "\n".join(
        f"{name}:{line}:{column}: {fact}\n"
        f"      {line} | {lines[line - 1]}\n"
        f"        | {' ' * (column - 1)}^"
        for line, column, fact in faults
    )
