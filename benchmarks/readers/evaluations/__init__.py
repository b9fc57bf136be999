"""Evaluations of lanes, maps, voxels, tracks, scene flow and text, most of them in no registry.

::

    python -m benchmarks.readers.evaluations --repositories FOLDER

Each judges the truth as a prediction, which must score perfectly, and the truth moved away, which
must not. Their code is cloned at fixed commits into ``--repositories``; further requirements: git,
and ``pip install ortools scipy av2 einops``. Two are programs in C++, CULane's and OpenLane's for
images: ``--culane`` and ``--openlane`` name their executables. A new evaluation is one
function, and one line of ``__main__.EVALUATIONS``.
"""
