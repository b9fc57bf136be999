"""Exports, read by the packages of their users: ``python -m benchmarks.readers``.

Small data sets of a fixed configuration are generated with every exporter; each reader opens one
export with its package, and boxes, masks, classes, poses and lenses are compared with the result of
``gen_data.open``. A new reader is one function, and one line of ``table.READERS``.
"""
