"""A study's table made up, but like real ones: errors fall with size and fluctuate, mirrors are hard, models cheap."""

import numpy as np

from bvbedit.study.table import Picture, Row, Table

SIDES = (4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24)
BYTES = tuple(1024 * 2**k for k in range(8))
ANALYTIC = {"lambert": (3, 3.0), "phong": (7, 1.4), "ward": (8, 1.2), "ggx": (8, 1.0), "ggx 2": (13, 0.7)}
NAMES = ("paper-white", "teflon", "satin", "car-paint", "gold-paint", "chrome")
# Of the classes: r_max / r_avg, the half-width of the highlight in degrees, how hard it is for the paper's nets, and
# for nets that follow the highlight.
KINDS = ((40.0, 90.0, 0.1, 0.3), (2000.0, 4.0, 1.0, 0.6), (9000.0, 0.3, 20.0, 1.5))
CLASS_OF = (0, 0, 1, 1, 0, 2)


def made_table(materials=6, *, seed=1, scenes=("sphere",), sides=SIDES, sizes=BYTES, failing=0.01) -> Table:
    """Return a table of so many materials; a share ``failing`` of its cells has failed."""
    rng = np.random.default_rng(seed)
    rows = []
    for m in range(materials):
        name = NAMES[m] if m < len(NAMES) else f"material-{m:03d}"
        kind = CLASS_OF[m % len(CLASS_OF)]
        contrast, width, hard, own = KINDS[kind]
        contrast *= rng.lognormal(0, 0.3)
        hard, own, bright = hard * rng.lognormal(0, 0.5), own * rng.lognormal(0, 0.5), rng.lognormal(-1.5, 0.6)

        def cell(
            configuration,
            series,
            error,
            file_bytes,
            rng=rng,
            name=name,
            bright=bright,
            contrast=contrast,
            width=width,
            **more,
        ):
            if rng.random() < failing:
                return Row(
                    material=name,
                    configuration=configuration,
                    series=series,
                    kind=more.get("kind", "spline"),
                    status="failed",
                    reason="Not enough memory, or so. Run fewer jobs.",
                )
            noisy = error * rng.lognormal(0, 0.12)
            e_max = bright * contrast * noisy / (noisy + 0.1) * rng.lognormal(0, 0.2)
            pictures = []
            for k, scene in enumerate(scenes):
                pae = round(min(1.0, 0.002 + 3 * noisy**0.8 * rng.lognormal(0, 0.3) / (1 + k)) * 255) / 255
                mae = min(pae, 0.08 * noisy * rng.lognormal(0, 0.2))
                psnr = float(-20 * np.log10(min(1.0, max(1.5 * mae, 1e-5))))
                seconds = 0.4 + 2e-6 * file_bytes**0.8 * rng.lognormal(0, 0.05)
                pictures.append(Picture(scene, mae, pae, psnr, seconds))
            values = {
                "grid_log_cosine_rms": noisy * 0.4,
                "grid_fores": noisy * 0.6,
                "grid_relative_l1": noisy * 1.1,
                "nodes_log_cosine_rms": noisy,
                "nodes_fores": noisy * 1.2,
                "nodes_relative_l1": noisy * 1.3,
                "e_max": e_max,
                "e_avg": bright * noisy * 0.2,
                "e_max_45": e_max * 0.6,
                "e_avg_45": bright * noisy * 0.15,
                "r_max": bright * contrast,
                "r_avg": bright,
                "highlight": width,
                "albedo_error": noisy * 0.1,
                "condition": 10.0 * rng.lognormal(0, 1),
                "fit_seconds": 0.5 + 1e-5 * file_bytes,
                "evaluations_per_second": 5e6 / (1 + 2e-6 * file_bytes) * rng.lognormal(0, 0.1),
                "file_bytes": int(file_bytes),
            }
            return Row(
                material=name,
                configuration=configuration,
                series=series,
                status="done",
                pictures=tuple(pictures),
                **(
                    {"kind": "spline"}
                    | values
                    | {k: float(v) if isinstance(v, np.floating) else v for k, v in more.items()}
                ),
            )

        paper = {"chart": "in-out", "encoding": "linear", "precision": "float32", "degrees": "3x3x3"}
        for series, knots, wobble, gain in (
            ("paper", "piegl-tiller", 0.45, 1.0),
            ("paper dominant", "dominant", 0.12, 0.5),
        ):
            for n in sides:
                points = 4 * n**3
                error = gain * hard * 0.15 * (8 / n) ** 1.6 * (1 + wobble * np.sin(2.2 * n) ** 2)
                more = {"knots": knots, "size": f"{n}x{n}x{4 * n}", "numbers": 3 * points + 6 * n}
                packed = 12 * points * rng.uniform(0.72, 0.93)
                rows.append(
                    cell(f"{series} {n}", series, error, packed, payload_bytes=12 * points + 48 * n, **paper, **more)
                )
        for series, chart, encoding, level in (
            ("half-diff root", "half-diff", "root", own),
            ("half-diff log", "half-diff", "log", own * 1.15),
            ("in-out root", "in-out", "root", hard * 0.5),
        ):
            for size in sizes:
                error = level * 0.05 * (1024 / size) ** 0.55 + 0.0008
                side = max(4, round((size / 3) ** (1 / 3)))
                more = {"chart": chart, "encoding": encoding, "knots": "dominant", "precision": "quantised"}
                more |= {"degrees": "3x3x3", "size": f"{2 * side}x{side}x{side}", "numbers": 6 * side**3}
                packed = size * rng.uniform(0.93, 1.0)
                rows.append(
                    cell(f"{series} {size} bytes", series, error, packed, payload_bytes=int(size * 0.9), **more)
                )
        for model, (parameters, level) in ANALYTIC.items():
            more = {"kind": "analytic", "numbers": parameters, "payload_bytes": 4 * parameters}
            rows.append(cell(model, "analytic", level * own * 0.12, 4 * parameters, **more))
    return Table(tuple(rows), tuple(scenes))
