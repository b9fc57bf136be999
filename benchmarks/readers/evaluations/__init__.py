"""Evaluations of lanes, maps, voxels, tracks, scene flow and text, most of them in no registry.

::

    python -m benchmarks.readers.evaluations --repositories FOLDER

Each judges the truth as a prediction, which must score perfectly, and the truth moved away, which
must not. Their code is cloned at fixed commits into ``--repositories``. Needed besides: git, g++,
the headers of OpenCV (``apt-get install libopencv-dev``), and ``pip install ortools scipy av2
einops``. A new evaluation is one function, and one line of ``__main__.EVALUATIONS``.
"""
