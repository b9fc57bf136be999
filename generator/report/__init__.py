"""What a data set contains, in numbers: read from its label files, shown as tables and a page."""
