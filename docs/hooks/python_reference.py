"""Reference page of the Python API, as directives of mkdocstrings, which reads sources only."""

import gen_data

MODULES = {
    "gen_data.targets": "Arrays for training from one sample; without PyTorch.",
    "gen_data.torch": "The only module that imports PyTorch.",
}


def python_page() -> str:
    """The page of ``gen_data.__all__`` and of the public modules."""
    lines = ["# Python", "Everything in `gen_data.__all__`, and two modules.", "## gen_data"]
    for name in sorted(set(gen_data.__all__) - {"__version__"}):
        lines.append(f"::: {_home(name)}\n    options: {{heading_level: 3}}")
    for module, about in MODULES.items():
        lines += [f"## {module}", about, f"::: {module}\n    options: {{heading_level: 3}}"]
    return "\n\n".join(lines) + "\n"


def _home(name: str) -> str:
    """Dotted name of the definition behind a public name."""
    found = getattr(gen_data, name)
    return f"{found.__module__}.{found.__qualname__}"
