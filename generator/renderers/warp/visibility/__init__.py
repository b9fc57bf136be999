"""Which surface every pixel shows, and the label images that follow from it."""
