"""Least squares at scattered points: the basis of a volume there, and steps towards the best net.

Points that are no grid have no separable normal matrix. It is never formed: conjugate gradients need only its product
with a net, two passes over the points, and the separable normal matrix of a grid is a good preconditioner.
"""

from collections.abc import Callable, Sequence

import numpy as np

from bvbedit.spline.evaluation import span_bins
from bvbedit.spline.knots import Floats

# Nets in which sums are gathered side by side: as many as there are threads to expect, whatever there are.
PARTS = 4


class ScatteredBasis:
    """The basis functions of a volume at ``points`` (N, 3) within its knots.

    Neighbouring points should stand next to one another: in no order a pass takes up to twice as long.
    """

    def __init__(self, points: Floats, knots: Sequence[Floats], degrees: Sequence[int]) -> None:
        from bvbedit.jit import frozen
        from bvbedit.spline import scattered_kernels

        self.size = tuple(len(t) - p - 1 for t, p in zip(knots, degrees, strict=True))
        self._counts = np.array([p + 1 for p in degrees])
        self._first = np.empty((len(points), 3), dtype=np.int64)
        self._basis = np.zeros((len(points), 3, max(degrees) + 1))
        for a, (t, p) in enumerate(zip(knots, degrees, strict=True)):
            scattered_kernels.basis_along(a, frozen(t), p, span_bins(t, p), points, self._first, self._basis)

    @property
    def overlap(self) -> float:
        """The mean sum of squares of the basis functions at a point: the trace of the normal matrix for each point."""
        squares = np.einsum("nak,nak->na", self._basis, self._basis)
        return float(np.mean(squares[:, 0] * squares[:, 1] * squares[:, 2]))

    def apply(self, control: Floats) -> Floats:
        """Return the values (N, c) of the net ``control`` (n_1, n_2, n_3, c) at the points."""
        from bvbedit.spline import scattered_kernels

        out = np.empty((len(self._first), control.shape[-1]))
        scattered_kernels.apply_at(self._first, self._basis, self._counts, np.ascontiguousarray(control), out)
        return out

    def apply_transposed(self, values: Floats) -> Floats:
        """Return the net (n_1, n_2, n_3, c) of the sums of basis functions times ``values`` (N, c)."""
        from bvbedit.spline import scattered_kernels

        nets = np.zeros((PARTS, *self.size, values.shape[1]))
        scattered_kernels.gather_at(self._first, self._basis, self._counts, np.ascontiguousarray(values), nets)
        return np.asarray(nets.sum(axis=0))


def conjugate_gradients(
    operator: Callable[[Floats], Floats],
    right: Floats,
    precondition: Callable[[Floats], Floats],
    iterations: int,
) -> Floats:
    """Return x after so many steps from zero towards operator(x) = ``right``, both symmetric and positive.

    Few steps are a regularisation: what the points hardly determine is hardly moved.
    """
    x = np.zeros_like(right)
    r, z = right, precondition(right)
    direction, rz = z, float(np.vdot(right, z))
    for _ in range(iterations):
        if not rz > 0:
            break
        image = operator(direction)
        curvature = float(np.vdot(direction, image))
        if not curvature > 0:
            break
        alpha = rz / curvature
        x = x + alpha * direction
        r = r - alpha * image
        z = precondition(r)
        rz, before = float(np.vdot(r, z)), rz
        direction = z + (rz / before) * direction
    return x
