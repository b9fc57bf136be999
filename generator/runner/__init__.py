"""Generation of data sets on disk: processes, shards, resumption, verification.

A data set is a pure function of its plan. The processes, the order of the shards and the crashes of
a run leave traces in ``run/`` only.
"""
