"""Reports on data sets: statistics of label files, as tables and as an HTML page."""
