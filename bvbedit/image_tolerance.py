"""The smallest model whose picture cannot be told from that of the measurement: model only what a scene requires."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from os import PathLike, fspath
from typing import TYPE_CHECKING

from bvbedit.api import fit
from bvbedit.brdf.base import Brdf, check_brdf
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within

if TYPE_CHECKING:
    from bvbedit.render.scene import Scene

# The picture by which models are judged, with other random numbers than those that the scene's weights are found by.
SIDE, SPP, SEED = 192, 16, 1
# Bytes of the smallest file that is tried, doubled until one is good enough or no larger one is worth having.
SMALLEST, LARGEST = 3 << 10, 384 << 10
# Halvings, of the logarithm, between a file that is too small and one that is good enough: to 6 %.
HALVINGS = 4


@dataclass(frozen=True)
class Tried:
    """A model on the way, and how far its picture is from that of the measurement."""

    max_bytes: int
    mae: float
    pae: float


def fit_to_image(
    brdf: Brdf,
    scene: "str | PathLike[str] | Scene",
    tolerance: float,
    *,
    fit_within: Callable[[int], SplineBrdf] | None = None,
    progress: Callable[[float], None] | None = None,
) -> SplineBrdf:
    """Return the model of the smallest file found whose picture of ``scene`` differs from that of ``brdf``.

    At most by ``tolerance``, in 0 ... 1: the peak absolute error (PAE) of 8-bit pictures of 192 x 192 pixels with the
    same random numbers. ``report["image"]`` states scene, PAE, MAE and the models that were tried. ``fit_within``
    returns a model of at most so many bytes, by default what ``fit`` makes for the scene. Raises BvbError where no file
    of up to 384 KiB is good enough, and as ``fit`` and ``render`` do.
    """
    check_brdf(brdf, "brdf")
    if not is_real_within(tolerance, 0.0, 1.0):
        raise BvbError(f"The image tolerance is {tolerance!r}. Give a share of white, like 0.01, in 0 ... 1.")
    from bvbedit.render.image_metrics import compare_pictures
    from bvbedit.render.prepared import PreparedScene

    prepared = PreparedScene(brdf, scene, width=SIDE, height=SIDE, spp=SPP, seed=SEED)
    reference = prepared.shade(brdf)
    tried: list[Tried] = []

    def attempt(max_bytes: int) -> SplineBrdf | None:
        model = fit(brdf, max_bytes=max_bytes, scene=scene) if fit_within is None else fit_within(max_bytes)
        stored = model.with_spline(model.spline.with_control(model.storage.rounded(model.spline.control)))
        found = compare_pictures(prepared.shade(stored), reference)
        tried.append(Tried(max_bytes, found.mae, found.pae))
        if progress is not None:
            progress(min(0.95, len(tried) / (HALVINGS + 4)))
        return model if found.pae <= tolerance else None

    small, size = SMALLEST, SMALLEST
    good = attempt(size)
    while good is None:
        small, size = size, 2 * size
        if size > LARGEST:
            best = min(tried, key=lambda t: t.pae)
            raise BvbError(
                f"No file of up to {LARGEST >> 10} KiB has a PAE of {tolerance:.4g} in this scene: {best.pae:.4g} is "
                f"the best, of {best.max_bytes:,} bytes. Allow more."
            )
        good = attempt(size)
    shown = tried[-1]
    for _ in range(HALVINGS if size > small else 0):
        middle = round((small * size) ** 0.5)
        better = attempt(middle)
        if better is None:
            small = middle
        else:
            good, size, shown = better, middle, tried[-1]
    if progress is not None:
        progress(1.0)
    name = fspath(scene) if isinstance(scene, str | PathLike) else "given"
    image = {"scene": name, "pae": shown.pae, "mae": shown.mae, "tolerance": tolerance}
    return good.told(image={**image, "tried": [asdict(t) for t in tried]})
