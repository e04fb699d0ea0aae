"""The panel of fits: a measurement, or the present model anew, in a process that can be stopped."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.document import Document
from bvbedit.edit.fitting import Fit, FitOptions
from bvbedit.errors import BvbError
from bvbedit_gui import tasks
from bvbedit_gui.session import Opened
from bvbedit_gui.words import of_fit
from bvbedit_gui.worker import Stopped, Worker

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

STARTS: dict[str, Any] = {
    "fit_of": "model",
    "fit_chart": "auto",
    "fit_encoding": "auto",
    "fit_by": "bytes",
    "fit_kib": 16,
    "fit_tolerance": 0.01,
    "fit_size": [16, 12, 10],
    "fit_knots": "dominant",
    "fit_share": 0.0,
    "fitting": False,
    "fit_result": "",
    "can_fit_source": False,
}


class FitView:
    """Fits with the options in the panel."""

    def __init__(self, viewer: "Viewer") -> None:
        self._viewer = viewer
        self.state = viewer.state
        self.state.update(STARTS)
        self.worker = Worker()

    def synchronise(self, here: Opened | None) -> None:
        """Offer what can be fitted."""
        self.state.can_fit_source = here is not None and here.measurement is not None
        if not self.state.can_fit_source:
            self.state.fit_of = "model"

    def options(self) -> dict[str, Any]:
        """Return the options in the panel. Raises BvbError for numbers that are none."""
        state = self.state
        options: dict[str, Any] = {
            "chart": state.fit_chart,
            "encoding": state.fit_encoding,
            "knots": state.fit_knots,
        }
        try:
            if state.fit_by == "bytes":
                options["max_bytes"] = round(1024 * float(state.fit_kib))
            elif state.fit_by == "tolerance":
                options["tolerance"] = float(state.fit_tolerance)
            elif state.fit_by == "size":
                options["size"] = tuple(int(n) for n in state.fit_size)
            elif state.fit_by != "knee":
                raise BvbError("Choose by what the size of the fit is found: bytes, tolerance, size or by itself.")
        except (TypeError, ValueError, OverflowError):
            raise BvbError("A field of the fit is no number. Fill it in.") from None
        return options

    async def fit(self) -> None:
        """Fit the measurement, or the present model anew, in another process.

        Who works on something else by the time that it ends goes on with that.
        """
        state, session = self.state, self._viewer.session
        if self.worker.busy:
            return
        with self._viewer.telling("fit"):
            here, key = session.here, session.current
            assert key is not None  # there is a material
            options = self.options()
            state.update({"fitting": True, "fit_share": 0.0, "fit_result": ""})
            state.flush()
            if state.fit_of == "source":
                if here.measurement is None:
                    raise BvbError("There is no measurement to fit. Open one, or fit the present model.")
                made = FitOptions(**options)
                model = await self.worker.run(tasks.fitted, here.measurement, made, progress=self._progress)
                seen = session.current == key
                self._put_measured(here, key, made, model)
            else:
                document, edit = here.known_document, Fit(**options)
                model = await self.worker.run(tasks.refitted, document.model, edit, progress=self._progress)
                seen = session.current == key
                if seen:
                    await self._viewer.editing.do(document, edit, model)
                else:
                    self._do_elsewhere(key, document, edit, model)
            if seen:
                state.fit_result = of_fit(model)
            else:
                state.toast = f"{here.name} is fitted: {of_fit(model)}"
        state.fitting = False

    def _put_measured(self, here: Opened, key: int, options: FitOptions, model: SplineBrdf) -> None:
        """Open the model of a measurement: in the place of that, or beside the model that it has already."""
        session = self._viewer.session
        if key not in session:
            raise Stopped("It was closed meanwhile.")
        assert here.measurement is not None  # it was fitted
        document = Document.of_fit(model, options, **here.measurement.told())
        fitted = Opened(
            f"{Path(here.name).stem}.bvb",
            document,
            reference=here.reference,
            reference_name=here.reference_name,
            measurement=here.measurement,
        )
        looked_at = session.current
        if here.document is None:
            # The measurement stays as what the model is compared with.
            session.put(fitted, key)
        else:
            session.add(fitted)
        if looked_at == key:
            self._viewer.arrived()
            self.state.tab = "fit"
        else:
            session.current = looked_at
            self._told_elsewhere()

    def _do_elsewhere(self, key: int, document: Document, edit: Fit, model: SplineBrdf) -> None:
        """Make a fit a step of the history of a document that is not the one that is worked on now."""
        session = self._viewer.session
        if key not in session or session[key].document is not document:
            raise Stopped("It was closed or has changed meanwhile.")
        session.put(session[key].with_document(document.done(edit, model)), key)
        self._told_elsewhere()

    def _told_elsewhere(self) -> None:
        self._viewer.synchronise()
        self._viewer.saving.keep_soon()

    def _progress(self, share: float) -> None:
        with self.state:
            self.state.fit_share = round(100 * share)

    def forget(self) -> None:
        """Tell no more of a fit: another material is worked on."""
        self.state.fit_result = self.state.error_fit = ""

    def stop(self) -> None:
        """Stop the fit."""
        self.worker.close()
