"""The viewer: PyVista scenes of a model. Talks to bvbedit through its public functions only."""
