"""Least-squares fits of a tensor-product spline to data on a grid: approximate lofting, and the weighted problem.

Lee & Park (2008) loft a volume: least-squares curves along one axis on common knots, then their control points along
the next. On a full grid with equal weights this is the tensor-product least-squares solution, as the pseudo-inverse
of a Kronecker product is the Kronecker product of the pseudo-inverses.
"""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within, one_per_axis, real_array, shown
from bvbedit.spline.banded import Banded
from bvbedit.spline.basis import collocation
from bvbedit.spline.knots import Floats, checked_knots, increasing
from bvbedit.spline.tensor import TensorSpline

# Condition of an axis' collocation matrix beyond which coefficients lose half of their 16 digits to the knots.
CONDITION_LIMIT = 1e8
# Weight of the second differences, relative to the mean diagonal of the normal matrix, where that limit is passed:
# large enough to tame every null vector, small enough to leave what the data determine at 1e-5 of its size.
PENALTY = 1e-9
# A dense factor of one axis, m x n doubles, may take this many (256 MiB).
LARGEST_FACTOR = 1 << 25
# Rounding lets no gradient shrink much further than this.
SMALLEST_TOLERANCE = 1e-15
# Marginal weights below this share of the largest are raised to it in the preconditioner, which must be invertible.
MARGINAL_FLOOR = 1e-4


@dataclass(frozen=True)
class AxisFit:
    """What one axis contributes to a least-squares fit."""

    matrix: Banded
    pseudo_inverse: Floats
    """(n, m): control points = pseudo_inverse @ data."""
    inverse_normal: Floats
    """(n, n): inverse of the (weighted, penalised) normal matrix."""
    factor: Floats
    """(n, n): upper triangular R, the (weighted, penalised) normal matrix being R^T R."""
    condition: float
    """Condition number of the (weighted) collocation matrix, before any penalty; the normal matrix has its square."""
    penalised: bool


@dataclass(frozen=True)
class FitResult:
    """A fitted spline and how it came about."""

    spline: TensorSpline
    conditions: tuple[float, ...]
    """Condition number of each axis' collocation matrix."""
    notes: tuple[str, ...]
    """What a user should know: penalties, iterations that did not converge."""
    iterations: int = 0
    residual: float = 0.0
    """Norm of the preconditioned gradient at the end, relative to the right-hand side's."""


def fit_axis(parameters: Floats, knots: Floats, degree: int, weights: Floats | None = None) -> AxisFit:
    """Factorise the least-squares problem of one axis by QR, never by its normal matrix.

    ``parameters`` (m,) increasing, ``knots`` full, ``weights`` (m,) >= 0 or none. Where the condition passes 1e8
    (knots that Schoenberg & Whitney allow but that data hardly support) a small second-difference penalty is added.
    Raises BvbError where there are more control points than data, or the factor would be too large.
    """
    m, n = len(parameters), len(knots) - degree - 1
    if n > m:
        raise BvbError(f"{n} control points cannot be fitted to {m} data on one axis. Choose at most {m}.")
    if m * n > LARGEST_FACTOR:
        raise BvbError(f"{n} control points over {m} data need a factor of {m * n * 8 >> 20} MiB. Choose fewer.")
    matrix = collocation(knots, degree, parameters)
    root = np.ones(m) if weights is None else np.sqrt(weights)
    rows = root[:, None] * matrix.dense()
    q, r = np.linalg.qr(rows)
    singular = np.linalg.svd(r, compute_uv=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    penalised = not condition <= CONDITION_LIMIT
    if penalised:
        scale = np.sqrt(PENALTY * np.sum(r * r) / n)
        differences = np.diff(np.eye(n), min(2, n - 1), axis=0)
        q, r = np.linalg.qr(np.concatenate([rows, scale * differences]))
    inverse_r = np.linalg.solve(r, np.eye(n))
    return AxisFit(matrix, inverse_r @ q[:m].T * root, inverse_r @ inverse_r.T, r, condition, penalised)


def marginal_axes(
    weights: Floats, parameters: Sequence[Floats], knots: Sequence[Floats], degrees: Sequence[int]
) -> tuple[list[AxisFit], list[Floats], float]:
    """Return the axes' fits under the marginals of ``weights`` (m_1, ..., m_d), the marginals, and their level.

    The largest of each marginal (m_a,) is one, and none is below 1e-4; level times their product has the sum of the
    weights, and is equal to them where they are separable and that floor is not reached.
    """
    marginals = []
    for a in range(weights.ndim):
        marginal = weights.mean(axis=tuple(b for b in range(weights.ndim) if b != a))
        marginals.append(np.maximum(marginal / marginal.max(), MARGINAL_FLOOR))
    axes = [fit_axis(u, t, p, w) for u, t, p, w in zip(parameters, knots, degrees, marginals, strict=True)]
    return axes, marginals, float(weights.mean() / np.prod([w.mean() for w in marginals]))


def diagonalised(axis: AxisFit, penalty: Floats) -> tuple[Floats, Floats, Floats]:
    """Return T, T^-T (n, n) and d (n,): T^T N T = 1 for the axis' normal matrix N, and T^T E^T E T = diag(d).

    ``penalty`` is E (k, n). The d are squares of singular values of E R^-1: an eigenvalue problem of the products would
    lose the small ones in rounding. Where k < n the n - k null directions have d = 0 exactly.
    """
    _, singular, q = np.linalg.svd(np.linalg.solve(axis.factor.T, penalty.T).T)
    d = np.zeros(len(q))
    d[: len(singular)] = singular**2
    return np.linalg.solve(axis.factor, q.T), axis.factor.T @ q.T, d


def loft(
    values: Floats,
    parameters: Sequence[Floats],
    knots: Sequence[Floats],
    degrees: Sequence[int],
    weights: Sequence[Floats] | None = None,
) -> FitResult:
    """Return the least-squares spline to ``values`` (m_1, ..., m_d, c) on a grid.

    ``parameters`` are the d increasing grid axes (m_a,), ``knots`` d full clamped knot vectors over them. The weight of
    a node is the product of ``weights`` (m_a,) > 0 of its axes, or one.
    Raises BvbError where the shapes do not match, values are not finite, nodes do not increase within the knots, or an
    axis has more control points than data. Source: Lee & Park (2008), section 3.2.
    """
    values, parameters, knots, degrees = _checked_data(values, parameters, knots, degrees)
    rows: Sequence[Floats | None] = [None] * len(degrees) if weights is None else weights
    axes = [fit_axis(u, t, p, w) for u, t, p, w in zip(parameters, knots, degrees, rows, strict=True)]
    control = along_all([a.pseudo_inverse for a in axes], values)
    return FitResult(TensorSpline(degrees, knots, control), tuple(a.condition for a in axes), _penalty_notes(axes))


def fit_weighted(
    values: Floats,
    weights: Floats,
    parameters: Sequence[Floats],
    knots: Sequence[Floats],
    degrees: Sequence[int],
    *,
    start: Floats,
    project: Callable[[Floats], Floats] = lambda control: control,
    penalty: Sequence[Floats] | None = None,
    tolerance: float = 1e-4,
    max_iterations: int = 200,
    progress: Callable[[float], None] | None = None,
) -> FitResult:
    """Return the spline that minimises sum weights (V - values)^2 over a grid, among the nets that ``project`` keeps.

    ``weights`` (m_1, ..., m_d) >= 0 need not be separable; data of weight zero have no influence. ``start`` (n_1, ...,
    n_d, c) is the first net: of nets that fit equally well, that one is found whose spline is nearest to the start's,
    weighed by the marginals of the weights. ``project`` is an orthogonal projection on nets. Conjugate gradients on A^T
    W A, preconditioned by the separable inverse that the marginals of W give, until the preconditioned gradient has
    shrunk to ``tolerance`` of the right-hand side's.

    ``penalty`` are matrices E_a (k_a, n_a). The sum to be minimised then grows by |E_a C|^2 of every line of the spline
    along axis a through the nodes of the other axes, the lines weighed by the other marginals: with N_a the normal
    matrix of a's marginal, by level C^T (sum_a E_a^T E_a along a, N_b along the others) C as in ``marginal_axes``.
    So the preconditioner still is the inverse itself where the weights are separable.

    Raises BvbError as ``loft`` does, for weights that are negative, not finite or all zero, another start, penalties of
    another shape or not finite, and a tolerance outside [1e-15, 1].
    """
    values, parameters, knots, degrees = _checked_data(values, parameters, knots, degrees)
    size = tuple(len(t) - p - 1 for t, p in zip(knots, degrees, strict=True))
    start, weights = real_array(start, "Start"), _checked_weights(weights, values.shape[:-1])
    if start.shape != (*size, values.shape[-1]) or not np.isfinite(start).all():
        raise BvbError(f"The start {start.shape} is no net of size {size} with finite values. Start from a lofted net.")
    if not is_real_within(tolerance, SMALLEST_TOLERANCE, 1.0):
        raise BvbError(f"Tolerance {shown(tolerance)} cannot end a fit. Choose one in {SMALLEST_TOLERANCE:g} ... 1.")
    weights = weights / weights.max()
    d = len(degrees)
    axes, _, level = marginal_axes(weights, parameters, knots, degrees)
    matrices = [a.matrix for a in axes]
    inverses = [a.inverse_normal for a in axes]
    if penalty is not None:
        rows = _checked_penalty(penalty, size)
        bases, duals, diagonals = zip(*(diagonalised(a, e) for a, e in zip(axes, rows, strict=True)), strict=True)
        damping = outer_sum(diagonals)[..., None]

    right = weights[..., None] * values
    # Sums and squares of extreme data leave the range of float64: the iteration works on numbers of order one.
    exponent = int(np.frexp(max(right.max(), -right.min(), float(np.abs(start).max())))[1])
    np.ldexp(right, -exponent, out=right)
    for a in range(d):
        right = matrices[a].apply_transposed(right, a)
    right = project(right)

    def normal(x: Floats) -> Floats:
        image = _normal(matrices, weights, x)
        if penalty is not None:
            image += level * along_all(duals, damping * along_all([t.T for t in duals], x))
        return project(image)

    def precondition(r: Floats) -> Floats:
        if penalty is not None:
            return project(along_all(bases, along_all([t.T for t in bases], r) / (1.0 + damping)))
        return project(along_all(inverses, r))

    x = project(np.ldexp(start, -exponent))
    r = right - normal(x)
    z = precondition(r)
    direction = z
    rz = float(np.vdot(r, z))
    # Where the data are zero the start alone tells what is small.
    scale = max(float(np.vdot(right, precondition(right))), tolerance**2 * rz)
    goal = tolerance**2 * scale
    first, iterations = rz, 0
    while rz > goal and iterations < max_iterations:
        image = normal(direction)
        alpha = rz / float(np.vdot(direction, image))
        x = x + alpha * direction
        r = r - alpha * image
        z = precondition(r)
        rz, before = float(np.vdot(r, z)), rz
        direction = z + (rz / before) * direction
        iterations += 1
        if progress is not None:
            # The gradient falls roughly geometrically, so that its logarithm tells how far the way has come.
            progress(min(1.0, np.log(first / max(rz, goal)) / max(np.log(first / goal), 1e-9)))
    notes = _penalty_notes(axes)
    residual = float(np.sqrt(max(rz, 0.0) / scale)) if scale > 0 else 0.0
    if rz > goal:
        notes += (f"stopped after {iterations} iterations with the gradient at {residual:.1e} of its scale",)
    # Every step was projected, so that ``x`` needs no projection again.
    spline = TensorSpline(degrees, knots, np.ldexp(x, exponent))
    return FitResult(spline, tuple(a.condition for a in axes), notes, iterations, residual)


def _normal(matrices: Sequence[Banded], weights: Floats, x: Floats) -> Floats:
    """Return A^T W A x: expand all axes but the first, treat that one in a single pass, and go back."""
    from bvbedit.spline import kernels

    for a in reversed(range(1, len(matrices))):
        x = matrices[a].apply(x, a)
    out = np.empty_like(x)
    first = matrices[0]
    kernels.weighted_normal(
        first.first,
        first.rows,
        weights.reshape(len(first.rows), -1),
        x.reshape(first.columns, -1),
        out.reshape(first.columns, -1),
    )
    for a in range(1, len(matrices)):
        out = matrices[a].apply_transposed(out, a)
    return out


def along_all(matrices: Sequence[Floats], x: Floats) -> Floats:
    """Return ``x`` with a dense matrix applied along each axis: the longest contiguous runs, axis 0, first."""
    for axis, matrix in enumerate(matrices):
        before, n = int(np.prod(x.shape[:axis])), x.shape[axis]
        out = matrix @ x.reshape(before, n, -1)
        x = out.reshape((*x.shape[:axis], len(matrix), *x.shape[axis + 1 :]))
    return x


def outer_sum(rows: Sequence[Floats]) -> Floats:
    """Return the array (n_1, ..., n_d) of the sums of one entry of each of the ``rows`` (n_a,)."""
    return functools.reduce(np.add.outer, rows)


def _penalty_notes(axes: Sequence[AxisFit]) -> tuple[str, ...]:
    return tuple(
        f"axis {i}: the knots leave the collocation matrix at condition {a.condition:.1e}; "
        "a small second-difference penalty was added"
        for i, a in enumerate(axes)
        if a.penalised
    )


def _checked_weights(weights: object, shape: tuple[int, ...]) -> Floats:
    """Return the weights of data on a grid of the given ``shape`` as an array."""
    out = real_array(weights, "Weights")
    if out.shape != shape or not np.isfinite(out).all() or not out.any() or out.min() < 0:
        raise BvbError(
            f"Weights of shape {out.shape} cannot weigh these data. "
            f"Give finite weights >= 0 of shape {shape}, not all zero."
        )
    return out


def _checked_penalty(penalty: object, size: tuple[int, ...]) -> list[Floats]:
    """Return the penalties of the axes as arrays that suit a net of that ``size``."""
    rows = [real_array(e, "Penalties") for e in one_per_axis(penalty, "Penalties")]
    if [e.shape[1:] for e in rows] != [(n,) for n in size] or not all(np.isfinite(e).all() for e in rows):
        raise BvbError(
            f"Penalties of shapes {[e.shape for e in rows]} do not suit a net of size {size}. "
            "Give a finite matrix (k_a, n_a) for each axis."
        )
    return rows


def _checked_data(
    values: Floats, parameters: Sequence[Floats], knots: Sequence[Floats], degrees: Sequence[int]
) -> tuple[Floats, tuple[Floats, ...], tuple[Floats, ...], tuple[int, ...]]:
    """Return the data, grid axes, knots and degrees of a fit as arrays that suit one another."""
    values = real_array(values, "Data")
    degrees = one_per_axis(degrees, "Degrees")
    nodes = tuple(np.atleast_1d(real_array(u, "Nodes")) for u in one_per_axis(parameters, "Nodes"))
    vectors = one_per_axis(knots, "Knot vectors")
    shape = tuple(u.size for u in nodes)
    if values.size == 0 or values.shape[:-1] != shape or not len(shape) == len(vectors) == len(degrees):
        raise BvbError(
            f"Data {values.shape} do not lie on a grid of {shape} nodes with {len(vectors)} knot vectors and "
            f"{len(degrees)} degrees. Give values (m_1, ..., m_d, channels), and one of each for every axis."
        )
    vectors = tuple(checked_knots(t, p) for t, p in zip(vectors, degrees, strict=True))
    for axis, (u, t) in enumerate(zip(nodes, vectors, strict=True)):
        if not ((u >= t[0]) & (u <= t[-1])).all():  # false for nan too
            raise BvbError(
                f"Nodes of axis {axis} lie outside the knots' [{t[0]:g}, {t[-1]:g}]. Knots must span the data."
            )
        # Coinciding nodes would leave null vectors that not even the penalty tames.
        if u.ndim != 1 or not increasing(u):
            raise BvbError(f"Nodes of axis {axis} do not increase. Give each node once, in order.")
    if not np.isfinite(values).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(values))[0])
        raise BvbError(f"Datum {where} is {values[where]}. Fill or leave out what is not finite.")
    return values, nodes, vectors, degrees
