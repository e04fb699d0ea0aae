"""What an edit does to the energy: how much of the light the material reflects, told while knobs move."""

from typing import TYPE_CHECKING, Any

from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit_gui.plots.albedos import AlbedoCurve, albedo_curve

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

STARTS: dict[str, Any] = {"albedo_note": "", "albedo_above": False}
# Seconds to wait before: it is less urgent than pictures.
REST = 0.2


class EnergyView:
    """Tells the largest albedo of what the viewer shows, and of the model without the edit that is being tried."""

    def __init__(self, viewer: "Viewer") -> None:
        self._viewer = viewer
        self.state = viewer.state
        self.state.update(STARTS)
        self.queue = viewer.latest("edit", REST)
        # Of the model that was looked at last without an edit: while a knob moves it stays.
        self._known: tuple[SplineBrdf, AlbedoCurve] | None = None

    def refresh(self) -> None:
        """Look anew."""
        shown, document = self._viewer.shown, self._viewer.document
        if not isinstance(shown, SplineBrdf) or document is None:
            self.queue.forget()
            self.state.update(STARTS)
            return
        tried = self._viewer.editing.pending is not None
        self.queue.ask(
            lambda: (albedo_curve(shown) if tried else self._of(shown), self._of(document.model) if tried else None),
            lambda found: self._show(*found),
        )

    def _of(self, model: SplineBrdf) -> AlbedoCurve:
        known = self._known
        if known is None or known[0] is not model:
            self._known = known = model, albedo_curve(model)
        return known[1]

    def _show(self, now: AlbedoCurve, before: AlbedoCurve | None) -> None:
        told = f"Reflects at most {_percent(now.largest[0])} of the light"
        if before is not None:
            told += f" (before the edit {_percent(before.largest[0])})"
        above = bool(now.creates_energy)
        with self.state:
            self.state.albedo_note = told + (": more than arrives; make_plausible repairs that." if above else ".")
            self.state.albedo_above = above


def _percent(share: float) -> str:
    # The space before the sign does not break.
    return f"{100 * share:.3g}\u00a0%" if share < 10 else f"{100 * share:,.0f}\u00a0%"
