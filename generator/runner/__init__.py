"""From a plan to a data set on disk: processes, shards, resumption, verification.

A data set is a pure function of its plan. Which process made a shard, in which order, after how
many crashes, is visible in ``run/`` only and nowhere else.
"""
