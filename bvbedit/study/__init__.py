"""Studies: what accuracy costs in bytes and time, over materials and configurations. Knows nothing of the viewer."""
