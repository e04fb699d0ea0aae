"""The viewer: PyVista scenes of a model. Talks to bvbedit through its public functions only."""

from bvbedit_gui.picture import screenshot

__all__ = ["screenshot"]
