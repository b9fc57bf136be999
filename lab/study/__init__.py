"""Experiments with detectors: the effect of a change of a configuration on real pictures.

Only ``detector``, ``pretrained`` and ``training`` import torch.
"""
