"""Experiments with detectors: the effect of a change of a configuration on real pictures.

Only ``detector`` and ``training`` import torch.
"""
