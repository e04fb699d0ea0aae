"""The last steps of a fit: from the best net for a grid of the chart to the best one for the metric's own samples.

Data resampled on a grid are not the data, and a weight is only the first order of an error. Gauss-Newton steps on pairs
drawn from the sample sets themselves take both away: in trials with six measurements most
models gained about a tenth, and where data are noisy a step may bring nothing; then it is not taken.
"""

from collections.abc import Callable

import numpy as np

from bvbedit.brdf.encodings import Encoding
from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.losses import Loss
from bvbedit.brdf.samples import Samples, split
from bvbedit.spline.adaptive import AxisLines
from bvbedit.spline.fitting import along_all, fit_axis
from bvbedit.spline.scattered import ScatteredBasis, conjugate_gradients
from bvbedit.spline.tensor import TensorSpline

# Conjugate gradient steps in each Gauss-Newton step. Later ones move what the samples hardly determine.
STEPS = 6
# Share of the grid's own normal matrix that is added: it holds back, but does not hold, what no sample meets.
DAMPING = 0.1
# Lengths of a step that are tried.
LENGTHS = (1.0, 0.5, 0.25, 0.1)
# Smaller squares of an error count as so large, that of a black material's exact fit too.
SMALLEST_ERROR = 1e-150


def polish(
    spline: TensorSpline,
    lines: tuple[AxisLines, ...],
    samples: Samples,
    encoding: Encoding,
    loss: Loss,
    *,
    project: Callable[[Floats], Floats],
    rounds: int,
    progress: Callable[[float], None] | None = None,
) -> TensorSpline:
    """Return the spline after Gauss-Newton steps towards the smallest product of the metric over both sets.

    ``lines`` are the weighted lines of the grid from which the spline was fitted, ``project`` the orthogonal projection
    that keeps degenerate faces. Part of the samples judges each step, and over these it is never worse than before.
    """
    samples, judges = split(samples)
    if len(judges.parameters) == 0:
        return spline.with_control(project(spline.control))
    axes = [
        fit_axis(x.parameters, t, p, x.roots**2) for x, t, p in zip(lines, spline.knots, spline.degrees, strict=True)
    ]
    inverses = [a.inverse_normal for a in axes]
    normals = [
        rows.T @ rows
        for rows in (x.collocation(t, p).dense() for x, t, p in zip(lines, spline.knots, spline.degrees, strict=True))
    ]
    basis = ScatteredBasis(samples.parameters, spline.knots, spline.degrees)
    target = loss.transform(samples.reflectance, *samples.cosines)
    control = project(spline.control)
    values = basis.apply(control)
    sizes = np.array([part.stop - part.start for part in samples.parts])

    judged = ScatteredBasis(judges.parameters, spline.knots, spline.degrees)
    judged_values = judged.apply(control)

    def product(y: Floats) -> float:
        return float(np.sum(np.log(np.maximum(judges.errors(encoding.decode(y), loss), np.finfo(float).tiny))))

    score = product(judged_values)
    for i in range(rounds):
        f = encoding.decode(values)
        error = loss.transform(f, *samples.cosines) - target
        slope = loss.slope(f, *samples.cosines) * encoding.slope(values)
        counts = np.empty((len(f), 1))
        for part, size in zip(samples.parts, sizes, strict=True):
            if size == 0:
                continue
            # Least squares of the logarithm of an error: it counts by its inverse square.
            counts[part] = 1.0 / (size * max(samples.norm(error, part, loss) ** 2, SMALLEST_ERROR))
        weighted = samples.weights * counts * loss.reweighting(error) * slope
        curvature = weighted * slope
        # As much damping in all as there is curvature in all.
        damping = DAMPING * float(curvature.sum()) / 3 / float(np.prod([np.trace(n) for n in normals])) * basis.overlap

        def operator(x: Floats, curvature: Floats = curvature, damping: float = damping) -> Floats:
            image = basis.apply_transposed(curvature * basis.apply(x))
            return project(image + damping * along_all(normals, x))

        step = conjugate_gradients(
            operator,
            project(basis.apply_transposed(-weighted * error)),
            lambda r: project(along_all(inverses, r)),
            STEPS,
        )
        moved = judged.apply(step)
        found, length = min((product(judged_values + x * moved), x) for x in LENGTHS)
        if not found < score:
            break
        control, values, score = control + length * step, values + length * basis.apply(step), found
        judged_values = judged_values + length * moved
        if progress is not None:
            progress((i + 1) / rounds)
    return spline.with_control(control)
