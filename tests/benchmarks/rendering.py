"""Rendering beside Mitsuba 3, and what densities and smoothness do for noise: python -m tests.benchmarks.rendering.

    python -m tests.benchmarks.rendering [FILE ...]             samples per second, beside Mitsuba
    python -m tests.benchmarks.rendering --noise [FILE ...]     noise at equal samples, by densities
    python -m tests.benchmarks.rendering --smooth [FILE ...]    noise at equal samples, of a table and of its fit

FILE is a measurement; without any, sample materials take their place. Every figure of speed is a ratio within this
run, the median of rounds that alternate between the opponents. The first needs the extra ``mitsuba``, and for its
vectorised variant LLVM, which Mitsuba looks for at run time. Both trace the scene ``sphere`` with as many surfaces on
the way, but with light followed to the plane: Mitsuba has no ``direct_light_only``. Its path tracer picks one of the
two lights at each surface, where ours asks for the sun only, and finds the even sky by the material's density; rays
are as many. The noise of both is told beside their speed.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import perf_counter, process_time

import numba
import numpy as np
from rich.console import Console
from rich.table import Table

import bvbedit
from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.analytic.densities import Cosine, Mixture, VisibleGGX
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.materials import material_named
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.render import render
from bvbedit.render.scene_file import scene_of
from tests.benchmarks import mitsuba_spline
from tests.render.mitsuba_scene import diffuse, followed_everywhere, mitsuba_scene

ROUNDS = 5
SIDE, SPP = 256, 16
MAX_BYTES = 16384
PAIRS = 1_000_000
# Its independent samples would be a poor opponent in noise: ours are well spread in each pixel.
SAMPLER = "multijitter"
GREY = (0.7, 0.5, 0.3)

NOISE_SIDE, NOISE_SPP, REFERENCE_SPP, NOISE_SEEDS = 64, 16, 2048, 8
NOISY = ("chrome", "gold-metallic-paint", "satin-paint")
# Noise of a generated measurement, as a share of its values.
SPECKLE = 0.05
SMOOTH_SEEDS = 16

ALPHAS = np.geomspace(2e-3, 0.8, 48)
SHARES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7)


def seconds(work: Callable[[], object]) -> tuple[float, float]:
    """Return the seconds of wall clock and of all threads' CPU that a work takes."""
    wall, cpu = perf_counter(), process_time()
    work()
    return perf_counter() - wall, process_time() - cpu


def medians(*works: Callable[[], object]) -> list[tuple[float, float]]:
    """Return the median times (wall, CPU) of each work, warmed up, their rounds interleaved."""
    for work in works:
        work()
    times = [[seconds(work) for work in works] for _ in range(ROUNDS)]
    return [(median(w for w, _ in t), median(c for _, c in t)) for t in zip(*times, strict=True)]


def fitted_lobe(brdf: Brdf) -> tuple[float, float]:
    """Return the roughness of a GGX lobe and the share of the cosine that suit a material best.

    They minimise the second moment of the estimate of the albedo, relative to its square, the mean over elevations of
    the viewer: the noise under an even sky. The moments are estimated with draws of the material's own density.
    """
    rng = np.random.default_rng(0)
    theta = np.radians(np.arange(5, 81, 5))
    wo = np.repeat(spherical(theta, 0.0), 1024, axis=0)
    wi, own = brdf.density.sample(wo, rng.uniform(size=(len(wo), 2)))
    value = np.where(own > 0, brdf.evaluate_unit(wi, wo)[0].mean(axis=1) * wi[:, 2], 0.0)
    own = np.where(own > 0, own, 1.0)
    albedo = (value / own).reshape(len(theta), -1).mean(axis=1)
    even = Cosine().pdf(wi, wo)

    def moment(lobe: np.ndarray, share: float) -> float:
        density = share * even + (1 - share) * lobe
        square = (value**2 / (own * np.maximum(density, 1e-30))).reshape(len(theta), -1).mean(axis=1)
        return float(np.mean(square / albedo**2))

    lobes = {float(alpha): VisibleGGX(float(alpha)).pdf(wi, wo) for alpha in ALPHAS}
    return min(((a, s) for a in lobes for s in SHARES), key=lambda pair: moment(lobes[pair[0]], pair[1]))


def lobe_density(alpha: float, cosine_share: float) -> Mixture:
    return Mixture([Cosine(), VisibleGGX(alpha)], [cosine_share, 1 - cosine_share])


def noise_of(picture: Callable[[int], np.ndarray]) -> float:
    """Return the variance of a pixel, relative to the square of the mean, from what two pictures differ by."""
    a, b = picture(101), picture(102)
    return float(np.mean((a - b) ** 2) / 2 / np.mean(a) ** 2)


def random_pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors (count, 3) that float32 holds: half of the pairs near the mirror direction."""
    rng = np.random.default_rng(1)
    wi, wo = rng.normal(size=(2, count, 3))
    for w in (wi, wo):
        w[:, 2] = np.abs(w[:, 2]) + 0.01
        w /= np.linalg.norm(w, axis=1, keepdims=True)
    h = np.concatenate([rng.normal(size=(count, 2)) * 0.05, np.ones((count, 1))], axis=1)
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    mirrored = 2 * np.sum(wo * h, axis=1, keepdims=True) * h - wo
    near = (np.arange(count) % 2 == 0) & (mirrored[:, 2] > 0.01)
    wi[near] = mirrored[near]
    return wi.astype(np.float32), wo.astype(np.float32)


def compared(
    rows: Table, what: str, ours: Callable[[int], np.ndarray], theirs: Callable[[int], np.ndarray], promised: str
) -> None:
    """Add a row that tells speed and noise of two path tracers, which render with a seed."""
    seeds = iter(range(1, 1000))
    (our_time, our_cpu), (their_time, their_cpu) = medians(lambda: ours(next(seeds)), lambda: theirs(next(seeds)))
    our_noise, their_noise = noise_of(ours), noise_of(theirs)
    means = ours(7).mean(axis=(0, 1)) / theirs(7).mean(axis=(0, 1)) - 1
    samples = SIDE * SIDE * SPP / 1e6
    rows.add_row(
        what,
        f"{samples / our_time:.2f}",
        f"{samples / their_time:.2f}",
        f"{our_time / their_time:.2f} x",
        promised,
        f"{our_cpu / their_cpu:.2f} x",
        f"{our_noise / their_noise:.2f} x",
        f"{our_time * our_noise / (their_time * their_noise):.2f} x",
        f"{100 * np.abs(means).max():.2f} %",
    )


def speed(console: Console, sources: dict[str, Brdf], paths: list[Path], threads: int) -> None:
    import drjit as dr
    import mitsuba as mi

    scene = followed_everywhere(scene_of("sphere"))
    rows = Table(
        "material, opponent",
        "ours, M/s",
        "theirs, M/s",
        "time, ours / theirs",
        "promised",
        "CPU time",
        "variance",
        "variance x time",
        "means differ",
        title=f"{SIDE} x {SIDE} pixels, {SPP} samples, {threads} threads, Mitsuba {mi.__version__}",
    )
    kernels = Table(
        "material",
        "net",
        "ours, M pairs/s",
        "theirs",
        "time, ours / theirs",
        "CPU time",
        "rms difference",
        "largest, of the peak",
    )
    models = {name: bvbedit.fit(brdf, max_bytes=MAX_BYTES) for name, brdf in sources.items()}

    def ours(model: Brdf) -> Callable[[int], np.ndarray]:
        return lambda seed: render(model, scene, width=SIDE, height=SIDE, spp=SPP, seed=seed)

    def theirs(bsdf: dict[str, str]) -> Callable[[int], np.ndarray]:
        loaded = mitsuba_scene(mi, scene, [bsdf], SIDE, SIDE, SPP, SAMPLER)
        return lambda seed: np.array(mi.render(loaded, spp=SPP, seed=seed))

    mi.set_variant("llvm_ad_rgb")
    dr.set_thread_count(threads)
    for number, (name, model) in enumerate(models.items()):
        agreement(kernels, mi, dr, name, model)
        mitsuba_spline.register(mi, dr, f"spline_{number}", model, *fitted_lobe(model))
        compared(
            rows, f"{name}, llvm_ad_rgb, the same net", ours(model), theirs({"type": f"spline_{number}"}), "<= 0.67 x"
        )
    compared(rows, "Lambert, llvm_ad_rgb", ours(Lambert(GREY)), theirs(diffuse(GREY)), "")
    mi.set_variant("scalar_rgb")
    compared(rows, "Lambert, scalar_rgb", ours(Lambert(GREY)), theirs(diffuse(GREY)), "")
    for path in paths:
        if path.suffix == ".bsdf":
            measured = theirs({"type": "measured", "filename": str(path)})
            compared(rows, f"{path.stem}, scalar_rgb, measured", ours(models[path.stem]), measured, "<= 0.33 x")
    console.print(kernels)
    console.print(rows)


def agreement(rows: Table, mi, dr, name: str, model: SplineBrdf) -> None:
    """Add a row that tells how far the opponent's evaluation is from ours, and how fast both are without rays."""
    wi, wo = random_pairs(PAIRS)
    volume = mitsuba_spline.Volume(mi, dr, model)
    their_wi, their_wo = mi.Vector3f(wi.T), mi.Vector3f(wo.T)

    def theirs() -> object:
        f = volume(their_wi, their_wo, mi.Bool(True))
        dr.eval(f)
        dr.sync_thread()
        return f

    our_wi, our_wo = wi.astype(float), wo.astype(float)
    for w in (our_wi, our_wo):
        w /= np.linalg.norm(w, axis=1, keepdims=True)
    f = model.evaluate_unit(our_wi, our_wo)[0]
    difference = np.array(theirs()).T - f
    rms = float(np.sqrt(np.mean(difference**2) / np.mean(f**2)))
    assert rms < 1e-4, f"{name}: Mitsuba evaluates another material"
    (our_time, our_cpu), (their_time, their_cpu) = medians(lambda: model.evaluate_unit(our_wi, our_wo), theirs)
    rows.add_row(
        name,
        f"{model.chart.name}, {model.encoding.name}, {' x '.join(map(str, model.spline.size))}",
        f"{PAIRS / our_time / 1e6:.1f}",
        f"{PAIRS / their_time / 1e6:.1f}",
        f"{our_time / their_time:.2f} x",
        f"{our_cpu / their_cpu:.2f} x",
        f"{rms:.1e}",
        f"{np.abs(difference).max() / f.max():.1e}",
    )


def noise(console: Console, sources: dict[str, Brdf]) -> None:
    rows = Table(
        "material",
        "scene",
        "own density",
        "cosine",
        "GGX lobe",
        "cosine / own",
        "GGX / own",
        "alpha, cosine share",
        title=f"MSE at {NOISE_SPP} samples over the squared mean, reference {REFERENCE_SPP} samples, {NOISE_SIDE} x "
        f"{NOISE_SIDE} pixels, {NOISE_SEEDS} pictures; all with multiple importance sampling of lights",
    )
    size = {"width": NOISE_SIDE, "height": NOISE_SIDE}
    for name, brdf in sources.items():
        model = bvbedit.fit(brdf, max_bytes=MAX_BYTES)
        alpha, share = fitted_lobe(model)
        for scene in ("sphere", "studio"):
            reference = render(model, scene, **size, spp=REFERENCE_SPP, seed=10**6).astype(float)

            def mse(density, model=model, scene=scene, reference=reference) -> float:
                pictures = (
                    render(model, scene, **size, spp=NOISE_SPP, seed=seed, density=density)
                    for seed in range(NOISE_SEEDS)
                )
                return float(np.mean([np.mean((p - reference) ** 2) for p in pictures]) / np.mean(reference) ** 2)

            own, cosine, lobe = (mse(d) for d in (model.density, Cosine(), lobe_density(alpha, share)))
            rows.add_row(
                name,
                scene,
                f"{own:.2e}",
                f"{cosine:.2e}",
                f"{lobe:.2e}",
                f"{cosine / own:.1f} x",
                f"{lobe / own:.2f} x",
                f"{alpha:.3f}, {share:g}",
            )
    console.print(rows)


def smooth(console: Console, sources: dict[str, Brdf]) -> None:
    rows = Table(
        "material",
        "scene",
        "density of",
        "table",
        "fit",
        "fit / table",
        "fit / table, median pixel",
        title=f"variance of a pixel at {NOISE_SPP} samples over the squared mean, from {SMOOTH_SEEDS} pictures with "
        "common directions; fits at the knee",
    )
    size = {"width": NOISE_SIDE, "height": NOISE_SIDE}
    for name, table in sources.items():
        model = bvbedit.fit(table)
        for scene in ("sphere", "studio"):
            for source, density in {"fit": model.density, "table": table.density}.items():
                variances = []
                for brdf in (table, model):
                    pictures = np.array(
                        [
                            render(brdf, scene, **size, spp=NOISE_SPP, seed=seed, density=density).mean(axis=-1)
                            for seed in range(SMOOTH_SEEDS)
                        ],
                        dtype=float,
                    )
                    variances.append(pictures.var(axis=0, ddof=1) / pictures.mean() ** 2)
                its, fits = variances
                where = its > 0
                rows.add_row(
                    name,
                    scene,
                    source,
                    f"{its.mean():.3e}",
                    f"{fits.mean():.3e}",
                    f"{fits.mean() / its.mean():.3f}",
                    f"{np.median(fits[where] / its[where]):.3f}",
                )
    console.print(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--noise", action="store_true")
    parser.add_argument("--smooth", action="store_true")
    parser.add_argument("--threads", type=int, default=2)
    wish = parser.parse_args()
    numba.set_num_threads(min(wish.threads, numba.config.NUMBA_NUM_THREADS))
    given: dict[str, Brdf] = {p.stem: bvbedit.load(p) for p in wish.files}
    console = Console(width=180)
    if wish.noise:
        noise(console, given or {n: material_named(n).brdf for n in NOISY})
    if wish.smooth:
        generated = {n: measure(material_named(n).brdf, "merl", noise=SPECKLE, seed=1) for n in NOISY if not given}
        smooth(console, given or generated)
    if not (wish.noise or wish.smooth):
        speed(console, given or {NOISY[1]: material_named(NOISY[1]).brdf}, wish.files, wish.threads)


if __name__ == "__main__":
    main()
