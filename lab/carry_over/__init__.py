"""Statistics of labelled pictures that decide whether a detector carries over to real ones."""
