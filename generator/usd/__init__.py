"""Import and export of OpenUSD stages.

USD multiplies row vectors from the left, its cameras look along -Z with +Y up, and each stage
declares its unit and up axis. This package converts all of that to the project's conventions.
"""
