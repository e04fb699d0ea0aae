"""One immutable tensor-product B-spline for curves, surfaces, volumes and 4-D volumes with any number of channels."""

from collections.abc import Sequence
from functools import cached_property
from math import factorial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_whole, one_per_axis, real_array, shown
from bvbedit.spline.banded import Banded
from bvbedit.spline.basis import basis_derivatives, collocation, find_spans
from bvbedit.spline.knots import Floats, checked_knots, greville

MAX_PARAMETERS = 4


class TensorSpline:
    """V(u_1 ... u_d) = sum N_{i_1}(u_1) ... N_{i_d}(u_d) v_{i_1 ... i_d}, clamped, of 1 to 4 parameters.

    ``degrees`` d whole numbers in 0 ... 16; ``knots`` d full clamped knot vectors; ``control`` (n_1, ..., n_d,
    channels). The arrays are copied to float64 and read-only: an edit returns a new spline.
    At an interior knot of full multiplicity, where the spline jumps, the value from the right is taken.

    Raises BvbError for bad degrees or knots, control points that do not match them or are not finite.

    >>> line = TensorSpline((1,), ([0, 0, 1, 1],), [[0.0], [2.0]])
    >>> float(line.evaluate([[0.25]])[0, 0])
    0.5
    """

    def __init__(self, degrees: Sequence[int], knots: Sequence[ArrayLike], control: ArrayLike) -> None:
        degrees, knots = one_per_axis(degrees, "Degrees"), one_per_axis(knots, "Knot vectors")
        if not 1 <= len(degrees) <= MAX_PARAMETERS or len(degrees) != len(knots):
            raise BvbError(
                f"{len(degrees)} degrees and {len(knots)} knot vectors are no spline. "
                f"Give one of each for 1 ... {MAX_PARAMETERS} parameters."
            )
        self.knots: tuple[Floats, ...] = tuple(checked_knots(t, p) for t, p in zip(knots, degrees, strict=True))
        self.degrees: tuple[int, ...] = tuple(int(p) for p in degrees)
        net = np.array(real_array(control, "Control points"), order="C")
        size = tuple(len(t) - p - 1 for t, p in zip(self.knots, self.degrees, strict=True))
        if net.ndim != len(size) + 1 or net.shape[:-1] != size or net.shape[-1] == 0:
            raise BvbError(f"Control points have shape {net.shape}. Knots and degrees ask for {size} and channels.")
        if not np.isfinite(net).all():
            where = tuple(int(i) for i in np.argwhere(~np.isfinite(net))[0])
            raise BvbError(f"Control point {where} is {net[where]}. Control points must be finite.")
        net.setflags(write=False)
        self.control: Floats = net

    def __repr__(self) -> str:
        return f"<TensorSpline degrees {self.degrees}, size {self.size}, {self.channels} channels>"

    @property
    def parameters(self) -> int:
        """The number of parameters d."""
        return len(self.degrees)

    @property
    def size(self) -> tuple[int, ...]:
        """The number of control points along each axis."""
        return self.control.shape[:-1]

    @property
    def channels(self) -> int:
        """The number of values at each control point."""
        return int(self.control.shape[-1])

    @property
    def domain(self) -> tuple[tuple[float, float], ...]:
        """The parameter interval of each axis."""
        return tuple((float(t[0]), float(t[-1])) for t in self.knots)

    @property
    def greville(self) -> tuple[Floats, ...]:
        """The Greville abscissae of each axis: the parameters at which the control points are thought to stand."""
        return tuple(greville(t, p) for t, p in zip(self.knots, self.degrees, strict=True))

    def with_control(self, control: ArrayLike) -> "TensorSpline":
        """Return the spline with the same knots and other control points (n_1, ..., n_d, channels)."""
        return TensorSpline(self.degrees, self.knots, control)

    def evaluate(self, points: ArrayLike, derivatives: Sequence[int] | None = None) -> Floats:
        """Return the values (..., channels) at ``points`` (..., d), or the partial derivative of the given orders.

        ``derivatives`` holds one order for each axis: (1, 0, 0) is d/du. Raises BvbError for points outside the
        domain, not finite, or of another dimension.

        >>> bump = TensorSpline((2,), ([0, 0, 0, 1, 1, 1],), [[0.0], [1.0], [0.0]])
        >>> float(bump.evaluate([0.0], derivatives=(1,))[0])
        2.0
        """
        if derivatives is not None:
            return self._differentiated(derivatives).evaluate(points)
        x = real_array(points, "Points")
        d = self.parameters
        if x.ndim == 0 or x.shape[-1] != d:
            raise BvbError(f"Points have shape {x.shape}. This spline needs a last axis of {d} parameters.")
        shape = x.shape[:-1]
        x = np.ascontiguousarray(x.reshape(-1, d))
        if len(x):
            for axis, (a, b) in enumerate(self.domain):
                _check_inside(x[:, axis], a, b, axis)
        out = np.empty((len(x), self.channels))
        if self.degrees == (3, 3, 3) and self.channels == 3:
            self._evaluate_cubic_rgb(x, out)
        else:
            self._evaluate_any(x, out)
        return out.reshape(*shape, self.channels)

    def evaluate_grid(self, axes: Sequence[ArrayLike]) -> Floats:
        """Return the values (m_1, ..., m_d, channels) on the grid of the given ``axes`` of m_a parameters each.

        Raises BvbError for parameters outside the domain or not finite, and for another number of axes.
        """
        axes = one_per_axis(axes, "Grid axes")
        if len(axes) != self.parameters:
            raise BvbError(f"{len(axes)} grid axes given. This spline has {self.parameters} parameters.")
        matrices = []
        for axis, (given, t, p, (a, b)) in enumerate(zip(axes, self.knots, self.degrees, self.domain, strict=True)):
            x = np.atleast_1d(real_array(given, f"Grid axis {axis}"))
            if x.ndim != 1:
                raise BvbError(f"Grid axis {axis} has shape {x.shape}. Give one row of parameters.")
            _check_inside(x, a, b, axis)
            matrices.append(collocation(t, p, x))
        values = self.control
        # The last axis first: the array is small while the contiguous runs are short.
        for axis in reversed(range(self.parameters)):
            values = matrices[axis].apply(values, axis)
        return values

    def derivative(self, axis: int, order: int = 1) -> "TensorSpline":
        """Return the partial derivative along ``axis`` as a spline of lower degree (The NURBS Book, equation 3.3).

        Past the degree it is the zero spline of degree 0. Raises BvbError for an unknown axis or a negative order.
        """
        if not is_whole(axis) or axis not in range(self.parameters):
            raise BvbError(f"Axis {shown(axis)} does not exist. Choose one of 0 ... {self.parameters - 1}.")
        if not is_whole(order) or order < 0:
            raise BvbError(f"Derivative order {shown(order)} is not possible. Choose a whole number >= 0.")
        spline = self
        for _ in range(order):
            spline = spline._derived(axis)
        return spline

    def _derived(self, axis: int) -> "TensorSpline":
        p, t, n = self.degrees[axis], self.knots[axis], self.size[axis]
        if p == 0:
            return self.with_control(np.zeros_like(self.control))
        gap = t[p + 1 : n + p] - t[1:n]
        # At a knot of full multiplicity the spline jumps: the difference across it is no derivative.
        keep = np.flatnonzero(gap > 0)
        slope = p / gap[keep]
        matrix = Banded(keep.astype(np.int64), np.stack([-slope, slope], axis=1), n)
        knots = np.delete(t, np.flatnonzero(gap <= 0) + 1)[1:-1]
        return TensorSpline(
            (*self.degrees[:axis], p - 1, *self.degrees[axis + 1 :]),
            (*self.knots[:axis], knots, *self.knots[axis + 1 :]),
            matrix.apply(self.control, axis),
        )

    def _differentiated(self, orders: Sequence[int]) -> "TensorSpline":
        orders = one_per_axis(orders, "Derivative orders")
        if len(orders) != self.parameters:
            raise BvbError(f"{len(orders)} derivative orders given. This spline has {self.parameters} parameters.")
        spline = self
        for axis, order in enumerate(orders):
            spline = spline.derivative(axis, order)
        return spline

    def _evaluate_cubic_rgb(self, x: Floats, out: Floats) -> None:
        from bvbedit.spline import kernels

        t0, t1, t2 = self.knots
        b0, b1, b2 = self._bins
        p0, p1, p2 = self._polynomials
        kernels.evaluate_cubic_rgb(x, t0, t1, t2, b0, b1, b2, p0, p1, p2, self.control, out)

    def _evaluate_any(self, x: Floats, out: Floats) -> None:
        from bvbedit.spline import kernels

        # Axes that are missing become constants of degree 0, so that one kernel serves 1 to 4 parameters.
        missing = MAX_PARAMETERS - self.parameters
        degrees = np.array((*self.degrees, *(0,) * missing), dtype=np.int64)
        knots = (*self.knots, *(np.array([0.0, 1.0]),) * missing)
        starts = np.cumsum([0, *(len(t) for t in knots)])
        points = np.concatenate([x, np.zeros((len(x), missing))], axis=1)
        spans = np.stack([find_spans(t, p, points[:, a]) for a, (t, p) in enumerate(zip(knots, degrees, strict=True))])
        control = self.control.reshape(*self.size, *(1,) * missing, self.channels)
        kernels.evaluate_any(
            points, degrees, np.concatenate(knots), starts, np.ascontiguousarray(spans.T), control, out
        )

    @cached_property
    def _bins(self) -> tuple[NDArray[np.int64], ...]:
        """The spans at the left ends of about four equal bins for each control point, for each axis."""
        return tuple(
            find_spans(t, p, np.linspace(t[0], t[-1], 4 * n + 1)[:-1])
            for t, p, n in zip(self.knots, self.degrees, self.size, strict=True)
        )

    @cached_property
    def _polynomials(self) -> tuple[Floats, ...]:
        """The basis functions of each span, (spans, p+1, p+1), in powers of (u - t_s)/(t_{s+1} - t_s)."""
        return tuple(_polynomials(t, p) for t, p in zip(self.knots, self.degrees, strict=True))


def _polynomials(t: Floats, p: int) -> Floats:
    """Taylor's series at the left end of each span; spans without length hold zeros, and are never looked up."""
    out = np.zeros((len(t) - 1, p + 1, p + 1))
    spans = np.flatnonzero(np.diff(t) > 0)
    width = t[spans + 1] - t[spans]
    for k in range(p + 1):
        out[spans, :, k] = basis_derivatives(t, p, t[spans], k)[1] * (width**k / factorial(k))[:, None]
    return out


def _check_inside(x: Floats, a: float, b: float, axis: int) -> None:
    if len(x) and not (x.min() >= a and x.max() <= b):  # false for nan too
        bad = x[~((x >= a) & (x <= b))][0]
        raise BvbError(f"Parameter {bad} of axis {axis} is outside the domain [{a}, {b}]. Stay inside.")
