"""Experiments with detectors: what a change of a configuration is worth on real pictures.

Only ``detector`` and ``training`` import torch.
"""
