"""Fitting of a configuration's sensors to unlabelled recordings of real ones."""
