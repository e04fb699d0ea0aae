"""One immutable tensor-product B-spline for curves, surfaces, volumes and 4-D volumes with any number of channels."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within, is_whole, one_per_axis, real_array, shown
from bvbedit.spline.banded import Banded
from bvbedit.spline.basis import collocation
from bvbedit.spline.evaluation import MAX_PARAMETERS, Tables, evaluate_any, evaluate_cubic_rgb, tables
from bvbedit.spline.knots import Floats, greville
from bvbedit.spline.reduction import checked_reduction, reduced
from bvbedit.spline.refinement import (
    checked_elevation,
    checked_knots_of,
    containing,
    divided,
    elevation,
    insertion,
    with_inserted,
)
from bvbedit.spline.removal import remove_within


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
        self.knots: tuple[Floats, ...] = tuple(
            checked_knots_of(axis, t, p) for axis, (t, p) in enumerate(zip(knots, degrees, strict=True))
        )
        self.degrees: tuple[int, ...] = tuple(int(p) for p in degrees)
        net = np.array(real_array(control, "Control points"), order="C")
        size = tuple(len(t) - p - 1 for t, p in zip(self.knots, self.degrees, strict=True))
        if net.ndim != len(size) + 1 or net.shape[:-1] != size or net.shape[-1] == 0:
            raise BvbError(f"Control points have shape {net.shape}. Knots and degrees ask for {size} and channels.")
        if not all_finite(net):
            where = tuple(int(i) for i in np.argwhere(~np.isfinite(net))[0])
            raise BvbError(f"Control point {where} is {net[where]}. Control points must be finite.")
        net.setflags(write=False)
        self.control: Floats = net

    def __reduce__(self) -> tuple[object, ...]:
        # Copies that pickle makes of read-only arrays are writable.
        return TensorSpline, (self.degrees, self.knots, self.control)

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
        return self.evaluate_inside(x).reshape(*shape, self.channels)

    def evaluate_inside(self, x: Floats) -> Floats:
        """Return the values (n, channels) at ``x`` (n, d), contiguous, known to be inside; nothing is checked."""
        out = np.empty((len(x), self.channels))
        if self.degrees == (3, 3, 3) and self.channels == 3:
            evaluate_cubic_rgb(self.knots, self._tables, self.control, x, out)
        else:
            evaluate_any(self.knots, self.degrees, self.control, x, out)
        return out

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
        axis = self._axis(axis)
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
        differences = Banded(keep.astype(np.int64), np.tile([-1.0, 1.0], (len(keep), 1)), n).apply(self.control, axis)
        knots = np.delete(t, np.flatnonzero(gap <= 0) + 1)[1:-1]
        with np.errstate(over="ignore", invalid="ignore"):
            control = differences * (p / gap[keep]).reshape(-1, *(1,) * (self.parameters - axis))
        return self._with_axis(axis, p - 1, knots, control, trusted=False)

    def antiderivative(self, axis: int) -> "TensorSpline":
        """Return the integral along ``axis`` from its start, a spline of one degree more.

        Raises BvbError for an unknown axis, degree 16, and where sums leave the range of float64.
        """
        axis = self._axis(axis)
        p, t = self.degrees[axis], self.knots[axis]
        checked_elevation(p, 1, axis)
        with np.errstate(over="ignore", invalid="ignore"):
            weighted = np.moveaxis(np.moveaxis(self.control, axis, -1) * (_supports(t, p) / (p + 1)), -1, axis)
            start = np.zeros_like(weighted.take([0], axis))
            control = np.concatenate([start, np.cumsum(weighted, axis=axis)], axis=axis)
        return self._with_axis(axis, p + 1, np.concatenate([t[:1], t, t[-1:]]), control, trusted=False)

    def integrate(self, box: Sequence[tuple[float, float]] | None = None) -> Floats:
        """Return the integral (channels,) over ``box``, d intervals (a, b) with a <= b, or over the whole domain.

        Exact up to rounding. Raises BvbError for a box that is not inside the domain, and where sums leave the range
        of float64.
        """
        values = self.control
        for axis, ((a, b), t, p) in enumerate(zip(self._box(box), self.knots, self.degrees, strict=True)):
            cut = _cut(axis, t, p, a, b)
            first = int(np.searchsorted(cut, a))
            n = int(np.searchsorted(cut, b)) - first
            weights = np.zeros(len(cut) - p - 1)
            weights[first : first + n] = _supports(cut[first : first + n + p + 1], p) / (p + 1) if a < b else 0.0
            weights = insertion(t, p, cut).apply_transposed(weights, 0)
            with np.errstate(over="ignore", invalid="ignore"):
                values = np.tensordot(weights, values, axes=(0, 0))
        if not np.isfinite(values).all():
            raise BvbError("The integral leaves the range of float64. Scale the spline, or shorten its domain.")
        return values

    def insert_knots(self, axis: int, values: ArrayLike) -> "TensorSpline":
        """Return the same spline with the knots ``values`` (k,), sorted and inside the domain, inserted on ``axis``.

        A value that stands k times gains k copies. Raises BvbError that names axis, index and value for knots outside
        the domain, unsorted, not finite, or more than degree + 1 times in all. Source: Lyche & Morken (1986).

        >>> bump = TensorSpline((2,), ([0, 0, 0, 1, 1, 1],), [[0.0], [1.0], [0.0]])
        >>> bump.insert_knots(0, [0.5]).control[:, 0].tolist()
        [0.0, 0.5, 0.5, 0.0]
        """
        axis = self._axis(axis)
        return self._over(axis, with_inserted(self.knots[axis], self.degrees[axis], values, axis))

    def refine(self, axis: int, factor: int | None = None, *, knots: ArrayLike | None = None) -> "TensorSpline":
        """Return the same spline with each span of ``axis`` cut into ``factor`` equal parts, or over given ``knots``.

        ``knots`` is a full clamped knot vector that contains the spline's. Raises BvbError where it does not, for a
        factor below 1, and for spans too narrow to be cut.
        """
        axis = self._axis(axis)
        if (factor is None) == (knots is None):
            raise BvbError(f"Axis {axis}: refining needs a factor or knots. Give one of them.")
        t, p = self.knots[axis], self.degrees[axis]
        fine = divided(t, p, factor, axis) if knots is None else containing(t, p, knots, axis)
        return self._over(axis, fine)

    def _over(self, axis: int, fine: Floats) -> "TensorSpline":
        p = self.degrees[axis]
        return self._with_axis(axis, p, fine, insertion(self.knots[axis], p, fine).apply(self.control, axis))

    def remove_knots(
        self, axis: int, tolerance: float, *, held: tuple[int, int] | None = None
    ) -> tuple["TensorSpline", float]:
        """Return the spline with as many interior knots of ``axis`` removed as ``tolerance`` allows, and the bound.

        The bound, at most ``tolerance``, is certified: no value of any channel changes by more. The knot that costs
        least goes first. ``held`` values and derivatives at the two ends stay, by default the values alone: the first
        and the last control points of the change, over the knots as they were, are zero.
        Raises BvbError for an unknown axis, and for a tolerance below zero or not finite.
        """
        return self._without(axis, tolerance, held, None, -1)

    def remove_knot(
        self, axis: int, value: float, times: int = 1, *, held: tuple[int, int] | None = None
    ) -> tuple["TensorSpline", float]:
        """Return the spline without ``times`` copies of the interior knot ``value`` of ``axis``, and the bound.

        Raises BvbError where the knot does not stand there so often, and where ``held`` control points forbid it.
        """
        axis = self._axis(axis)
        t, p = self.knots[axis], self.degrees[axis]
        count = int(np.sum(t[p + 1 : -p - 1] == value)) if is_real_within(value, t[0], t[-1]) else 0
        if not is_whole(times) or not 1 <= times <= count:
            raise BvbError(
                f"Axis {axis}: knot {shown(value)} stands {count} times inside the domain and cannot be removed "
                f"{shown(times)} times. Look at the spline's knots."
            )
        spline, bound = self._without(axis, np.finfo(np.float64).max, held, float(value), int(times))
        if len(spline.knots[axis]) > len(t) - times:
            raise BvbError(f"Axis {axis}: knot {value} cannot go while {held} control points stay. Hold fewer.")
        return spline, bound

    def _without(
        self, axis: int, tolerance: float, held: tuple[int, int] | None, at: float | None, most: int
    ) -> tuple["TensorSpline", float]:
        axis = self._axis(axis)
        if not is_real_within(tolerance, 0.0, np.finfo(np.float64).max):
            raise BvbError(f"Axis {axis}: a tolerance of {shown(tolerance)} allows nothing. Choose a number >= 0.")
        p = self.degrees[axis]
        knots, control, bound = remove_within(
            self.knots[axis], p, self.control, axis, tolerance, self._held(axis, held), at, most
        )
        return self._with_axis(axis, p, knots, control), bound

    def elevate(self, axis: int, by: int = 1) -> "TensorSpline":
        """Return the same spline with the degree of ``axis`` raised ``by``; every knot gains as many copies.

        Raises BvbError for an unknown axis and beyond degree 16.
        """
        axis = self._axis(axis)
        p = self.degrees[axis]
        knots, matrix = elevation(self.knots[axis], p, checked_elevation(p, by, axis))
        return self._with_axis(axis, p + by, knots, matrix.apply(self.control, axis))

    def reduce(
        self, axis: int, by: int = 1, tolerance: float | None = None, *, held: tuple[int, int] | None = None
    ) -> tuple["TensorSpline", float]:
        """Return the nearest spline with the degree of ``axis`` lowered ``by``, and the certified bound of the change.

        What ``elevate`` added goes without loss. ``held`` values and derivatives at the two ends stay, by default the
        values alone. Raises BvbError for an unknown axis, below degree 0, for more held than the new degree has, and
        where the bound passes ``tolerance``.
        """
        axis = self._axis(axis)
        p = self.degrees[axis]
        if tolerance is not None and not is_real_within(tolerance, 0.0, np.inf):
            raise BvbError(f"Axis {axis}: a tolerance of {shown(tolerance)} allows nothing. Choose a number >= 0.")
        by = checked_reduction(p, by, axis)
        ends = (0, 0) if held is None and by == p else self._held(axis, held)
        with np.errstate(over="ignore", invalid="ignore"):
            knots, control, bound = reduced(self.knots[axis], p, self.control, axis, by, ends)
        if not np.isfinite(bound):
            raise BvbError(f"Axis {axis}: reducing the degree leaves the range of float64. Scale the spline.")
        if tolerance is not None and bound > tolerance:
            raise BvbError(
                f"Axis {axis}: reducing the degree by {by} changes values by up to {bound:.3g}, more than "
                f"{tolerance:g}. Allow more, or refine first."
            )
        return self._with_axis(axis, p - by, knots, control, trusted=False), bound

    def split(self, axis: int, at: float) -> tuple["TensorSpline", "TensorSpline"]:
        """Return the parts before and after the parameter ``at`` inside the domain of ``axis``, both clamped.

        Raises BvbError for an unknown axis and a parameter that is not strictly inside, or within 1e-100 of a knot.
        """
        axis = self._axis(axis)
        a, b = self.domain[axis]
        if not is_real_within(at, a, b) or not a < at < b:
            raise BvbError(f"Axis {axis} cannot be split at {shown(at)}. Stay inside ({a}, {b}).")
        return self._restricted(axis, a, float(at)), self._restricted(axis, float(at), b)

    def restrict(self, box: Sequence[tuple[float, float]]) -> "TensorSpline":
        """Return the part over ``box``, d intervals (a, b) with a < b inside the domain, clamped.

        Raises BvbError for another box.
        """
        spline = self
        for axis, (a, b) in enumerate(self._box(box)):
            if not b - a > 0:
                raise BvbError(f"Axis {axis}: the interval ({a}, {b}) is empty. Give its start and a larger end.")
            spline = spline._restricted(axis, a, b)
        return spline

    def _restricted(self, axis: int, a: float, b: float) -> "TensorSpline":
        t, p = self.knots[axis], self.degrees[axis]
        cut = _cut(axis, t, p, a, b)
        first = int(np.searchsorted(cut, a))
        # Of p + 1 copies at a jump inside, those at the end b belong to the part before it.
        n = int(np.searchsorted(cut, b)) - first
        matrix = insertion(t, p, cut)
        rows = Banded(matrix.first[first : first + n], matrix.rows[first : first + n], matrix.columns)
        return self._with_axis(axis, p, cut[first : first + n + p + 1], rows.apply(self.control, axis))

    def _axis(self, axis: object) -> int:
        if not is_whole(axis) or axis not in range(self.parameters):
            raise BvbError(f"Axis {shown(axis)} does not exist. Choose one of 0 ... {self.parameters - 1}.")
        return int(axis)

    def _held(self, axis: int, held: object) -> tuple[int, int]:
        if held is None:
            # A spline of degree 0 has no end values to speak of: its steps are all alike.
            return (1, 1) if self.degrees[axis] > 0 else (0, 0)
        low, high = (*one_per_axis(held, "Held control points"), None, None)[:2]
        if not is_whole(low) or not is_whole(high) or min(low, high) < 0 or low + high > self.size[axis]:
            raise BvbError(
                f"Axis {axis}: {shown(held)} control points cannot be held at the ends of {self.size[axis]}. "
                "Give two whole numbers."
            )
        return int(low), int(high)

    def _box(self, box: object) -> tuple[tuple[float, float], ...]:
        if box is None:
            return self.domain
        intervals = real_array(one_per_axis(box, "Box"), "Box")
        if intervals.shape != (self.parameters, 2):
            raise BvbError(f"A box of shape {intervals.shape} is none. Give {self.parameters} intervals (a, b).")
        for axis, ((a, b), (low, high)) in enumerate(zip(intervals, self.domain, strict=True)):
            if not low <= a <= b <= high:  # true for nan too
                raise BvbError(f"Axis {axis}: the interval ({a}, {b}) is not inside [{low}, {high}]. Stay inside.")
        return tuple((float(a), float(b)) for a, b in intervals)

    def _with_axis(
        self, axis: int, degree: int, knots: Floats, control: Floats, *, trusted: bool = True
    ) -> "TensorSpline":
        degrees = (*self.degrees[:axis], degree, *self.degrees[axis + 1 :])
        vectors = (*self.knots[:axis], knots, *self.knots[axis + 1 :])
        # Even convex combinations may, by rounding at its very end.
        if not all_finite(control):
            raise BvbError(f"Axis {axis}: control points would leave the range of float64. Scale the spline.")
        return assembled(degrees, vectors, control) if trusted else TensorSpline(degrees, vectors, control)

    def _differentiated(self, orders: Sequence[int]) -> "TensorSpline":
        orders = one_per_axis(orders, "Derivative orders")
        if len(orders) != self.parameters:
            raise BvbError(f"{len(orders)} derivative orders given. This spline has {self.parameters} parameters.")
        spline = self
        for axis, order in enumerate(orders):
            spline = spline.derivative(axis, order)
        return spline

    @cached_property
    def _tables(self) -> Tables:
        return tables(self.knots, self.degrees)


def assembled(degrees: tuple[int, ...], knots: tuple[Floats, ...], control: Floats) -> TensorSpline:
    """Return the spline of parts that are known to suit one another and that nobody else holds: nothing is copied."""
    spline = object.__new__(TensorSpline)
    control = np.ascontiguousarray(control)
    for array in (*knots, control):
        array.setflags(write=False)
    spline.degrees, spline.knots, spline.control = degrees, knots, control
    return spline


def all_finite(net: Floats) -> bool:
    """Return whether no number of ``net`` is nan or infinite, without an array of answers."""
    return bool(np.isfinite(net.min()) and np.isfinite(net.max()))


def _supports(t: Floats, p: int) -> Floats:
    """Return the length (n,) of each basis function's support."""
    return np.asarray(t[p + 1 :] - t[: -p - 1])


def _cut(axis: int, t: Floats, p: int, a: float, b: float) -> Floats:
    """Return the knots ``t`` of ``axis`` with p + 1 copies of ``a`` and ``b``. Raises BvbError next to another knot."""
    more = [np.repeat(x, p + 1 - np.sum(t == x)) for x in dict.fromkeys((a, b))]
    return checked_knots_of(axis, np.sort(np.concatenate([t, *more])), p)


def _check_inside(x: Floats, a: float, b: float, axis: int) -> None:
    if len(x) and not (x.min() >= a and x.max() <= b):  # false for nan too
        i = int(np.flatnonzero(~((x >= a) & (x <= b)))[0])
        raise BvbError(f"Parameter {i} = {x[i]} of axis {axis} is outside the domain [{a}, {b}]. Stay inside.")
