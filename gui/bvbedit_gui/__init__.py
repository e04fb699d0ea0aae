"""The viewer: PyVista scenes of a model, edited in a browser. Talks to bvbedit through its public functions only.

What is imported here costs what it needs only when it is called: PyVista and trame are large.
"""

from bvbedit_gui.picture import screenshot
from bvbedit_gui.serve import show, view

__all__ = ["screenshot", "show", "view"]
