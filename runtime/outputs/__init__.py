"""Where skeletons go: one module per sink."""
