"""Pictures of BRDFs: scenes, a direct-light integrator, image metrics. Knows no commands."""
