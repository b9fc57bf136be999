"""OpenUSD: the one package that speaks it, in both directions.

USD multiplies row vectors from the left, looks along -Z with +Y up, and measures in whatever unit
and axes a stage declares; nothing of that leaves this package.
"""
