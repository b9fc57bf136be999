"""Calibrations of users' own cameras and rigs, from the files of common tools."""
