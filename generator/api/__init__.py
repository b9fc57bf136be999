"""The Python API behind ``import gen_data``: data sets as sequences of samples."""
