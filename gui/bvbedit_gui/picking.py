"""Clicks on the volume: control points that are picked, the region that they make, and knots put on an axis."""

import asyncio
from typing import TYPE_CHECKING, Any

import numpy as np

from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.region import HALF_ANGLES, PLAIN_ANGLES, Region
from bvbedit.errors import BvbError
from bvbedit_gui import volume
from bvbedit_gui.drawing import number
from bvbedit_gui.knobs import is_regional, region_of

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

# Pixels within which a control point, or an axis, is meant.
POINT_REACH, AXIS_REACH = 14, 12
# Control points that belong less to a region than this are not marked.
BELONGS = 0.02
# The largest share of the control points that are marked.
MOST = 0.6
STARTS: dict[str, Any] = {"picked": "", "probe": [0.3, 0.5, 0.5]}


class Picking:
    """What the mouse means on the volume's picture."""

    def __init__(self, viewer: "Viewer") -> None:
        self._viewer = viewer
        self.state = viewer.state
        self.state.update(STARTS)
        self._picked: list[int] = []
        self._of: SplineBrdf | None = None
        # What is marked in the picture now.
        self._shown: tuple[bytes, bytes | None] = b"", None
        self._inserting: asyncio.Task[None] | None = None
        self.state.change("mode")(self._mode_changed)

    def _mode_changed(self, mode: Any, **_: Any) -> None:
        # What is to be picked has to be seen.
        if mode == "pick":
            self.state.show_net = True

    def clicked(self, x: float, y: float, shift: bool) -> None:
        """Pick the control point there, or insert a knot there, as the mode says."""
        viewer = self._viewer
        if viewer.session.current is None or not isinstance(viewer.shown, SplineBrdf):
            return
        if self.state.mode == "pick":
            points = volume.net_points(viewer.shown)
            found = viewer.volume.scene.nearest_point(points, x, y, POINT_REACH)
            with self.state:
                if found is None:
                    self.state.toast = "There is no control point."
                else:
                    self.pick(found, more=shift)
                    self.state.tab = "edit"
        elif self.state.mode == "knot":
            place = viewer.volume.scene.place_on_axis(x, y, AXIS_REACH)
            if place is None or not 0 < place[1] < 1:
                with self.state:
                    self.state.toast = "Click on one of the three axes with numbers: a knot is inserted there."
            else:
                # The loop itself would not hold it.
                self._inserting = asyncio.get_running_loop().create_task(viewer.editing.insert_knot(*place))

    def pick(self, point: int, *, more: bool = False) -> None:
        """Pick a control point by its number, perhaps beside those that are picked: the region spans them all."""
        model = self._viewer.shown
        if not isinstance(model, SplineBrdf):
            return
        if self._of is None or self._of.spline.size != model.spline.size or not more:
            self._picked = []
        self._of = model
        self._picked.append(point)
        points = volume.net_points(model)[self._picked]
        angles = model.chart.angles(points)
        names = HALF_ANGLES if model.chart is HALF_DIFF else PLAIN_ANGLES
        for k, name in enumerate(names):
            low, high = float(angles[:, k].min()), float(angles[:, k].max())
            self.state[f"region_{name}_on"] = True
            self.state[f"region_{name}"] = [round(low, 1), round(high, 1)]
        for name in (*HALF_ANGLES, *PLAIN_ANGLES):
            if name not in names:
                self.state[f"region_{name}_on"] = False
        self._fill_in(model, points[-1])
        self._tell(model, point)
        self.show_region()

    def _fill_in(self, model: SplineBrdf, place: Floats) -> None:
        """Let curves run through the place, and let points be moved there."""
        wi, wo = model.chart.to_directions(place[None])
        theta_i, theta_o = (float(np.degrees(np.arctan2(np.hypot(w[0, 0], w[0, 1]), w[0, 2]))) for w in (wi, wo))
        cross = wi[0, 0] * wo[0, 1] - wi[0, 1] * wo[0, 0]
        phi = float(np.degrees(np.arctan2(abs(cross), float(wi[0, :2] @ wo[0, :2]))))
        f = model.evaluate(wi, wo)[0]
        self.state.probe = [round(float(p), 4) for p in place]
        if self._viewer.editing.op != "move_points" or not self.state.edit_pending:
            self.state.knob_move_points_at = [round(theta_i, 2), round(theta_o, 2), round(phi, 2)]
            self.state.knob_move_points_rgb = [float(f"{v:.4g}") for v in f]

    def _tell(self, model: SplineBrdf, point: int) -> None:
        index = tuple(int(i) for i in np.unravel_index(point, model.spline.size))
        value = model.encoding.decode(model.spline.control[index])
        angles = model.chart.angles(volume.net_points(model)[point][None])[0]
        named = ", ".join(
            f"{name.replace('theta', 'θ').replace('phi', 'φ')} {angle:.1f}°"
            for name, angle in zip(model.chart.axes, angles, strict=True)
        )
        rgb = ", ".join(number(v) for v in value)
        count = f" ({len(self._picked)} picked)" if len(self._picked) > 1 else ""
        self.state.picked = f"Control point {index}{count}: {named}; {rgb} /sr"

    def forget(self) -> None:
        """Pick nothing."""
        self._picked = []
        self.state.picked = ""
        self.show_region()

    def show_region(self) -> None:
        """Mark the control points that the edit in the panel reaches, and the one that was picked last."""
        viewer = self._viewer
        model = viewer.shown
        if not isinstance(model, SplineBrdf):
            self._show(np.zeros((0, 3)), None)
            return
        points = volume.net_points(model)
        if any(n >= len(points) for n in self._picked):
            self._picked = []
            self.state.picked = ""
        marked = points[self._picked[-1]] if self._picked else None
        chosen = np.zeros((0, 3))
        try:
            region = region_of(self.state)
            if region and is_regional(viewer.editing.op):
                named: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in region.items()}
                reached = Region(**named).weights(model.chart, points) > BELONGS
                # Where nearly all are, marking them would hide the rest of the picture and tell nothing.
                if reached.mean() <= MOST:
                    chosen = points[reached]
        except (BvbError, TypeError):
            pass  # told beside the knobs
        self._show(chosen, marked)

    def _show(self, points: Floats, marked: Floats | None) -> None:
        # While a knob moves the region stays: a picture of it would only delay that of the result.
        shown = points.tobytes(), None if marked is None else marked.tobytes()
        if shown != self._shown:
            self._shown = shown
            self._viewer.volume.scene.show_selected(points, marked)
            self._viewer.volume.draw()
