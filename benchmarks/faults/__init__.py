"""Counted fault injection: ``python -m benchmarks.faults [--quick | --full] [--only NAME]``.

Each campaign is a function of a ``Scale`` and an empty folder that returns a ``Result``. Campaigns
that need a privilege or a tool state what they left out, and why, instead of counting it as held.
"""
