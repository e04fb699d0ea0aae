"""What an edit does to the energy: how much of the light the material reflects, told while knobs move."""

from typing import TYPE_CHECKING, Any

import numpy as np

from bvbedit.brdf.albedo import albedo
from bvbedit.brdf.spline_brdf import SplineBrdf

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

STARTS: dict[str, Any] = {"albedo_note": "", "albedo_above": False}
# Elevations at which the albedo is looked at, below the rim, where measurements say little.
ELEVATIONS = np.radians(np.arange(0.0, 86.0, 5.0))
# Seconds to wait before: it is less urgent than pictures.
REST = 0.2
# What is above one by less is the error of the integral.
SLACK = 1.002


class EnergyView:
    """Tells the largest albedo of what the viewer shows, and of the model without the edit that is being tried."""

    def __init__(self, viewer: "Viewer") -> None:
        self._viewer = viewer
        self.state = viewer.state
        self.state.update(STARTS)
        self.queue = viewer.latest("edit", REST)

    def refresh(self) -> None:
        """Look anew."""
        shown, document = self._viewer.shown, self._viewer.document
        if not isinstance(shown, SplineBrdf) or document is None:
            self.state.update(STARTS)
            return
        tried = self._viewer.editing.pending is not None
        self.queue.ask(
            lambda: (largest_albedo(shown), largest_albedo(document.model) if tried else None),
            lambda found: self._show(*found),
        )

    def _show(self, now: float, before: float | None) -> None:
        told = f"Reflects at most {_percent(now)} of the light"
        if before is not None:
            told += f" (before the edit {_percent(before)})"
        above = now > SLACK
        with self.state:
            self.state.albedo_note = told + (": more than arrives; make_plausible repairs that." if above else ".")
            self.state.albedo_above = above


def largest_albedo(model: SplineBrdf) -> float:
    """Return the largest directional albedo over elevations and channels."""
    return float(albedo(model, ELEVATIONS).value.max())


def _percent(share: float) -> str:
    # The space before the sign does not break.
    return f"{100 * share:.3g}\u00a0%" if share < 10 else f"{100 * share:,.0f}\u00a0%"
