"""The whole job on a sample made on the spot: measure, fit, compare, render; pictures and a report stay in a folder."""

from pathlib import Path
from typing import Any

from bvbedit.cli.models import Json
from bvbedit.cli.output import report

MATERIAL = "gold-metallic-paint"
NOISE = 0.02
FITS: dict[str, tuple[str, dict[str, Any]]] = {
    "paper": (
        "the paper's configuration",
        {"chart": "in-out", "encoding": "linear", "size": (20, 20, 80), "knots": "piegl-tiller"},
    ),
    "half-diff": ("half-diff, root, 48 KiB", {"chart": "half-diff", "encoding": "root"}),
}
PICTURE: dict[str, Any] = {"width": 320, "height": 320, "spp": 64}
AMPLIFIED = 32


def demo(*, out: Path = Path("bvbedit-demo"), as_json: Json = False) -> None:
    """Measure a sample material, fit it twice, compare, render, and leave a report with pictures.

    Parameters
    ----------
    out
        The folder to write into; made if it is not there.
    as_json
        Print one JSON object.
    """
    from time import perf_counter

    from bvbedit import api
    from bvbedit.brdf.goniophotometer import measure
    from bvbedit.brdf.materials import material_named
    from bvbedit.brdf.spline_brdf import payload_bytes
    from bvbedit.io import make_folder
    from bvbedit.io.files import replacing

    start = perf_counter()
    make_folder(out)
    material = material_named(MATERIAL)
    _tell(f"Measuring {MATERIAL} on MERL's grid, with {NOISE:.0%} noise")
    measured = measure(material.brdf, "merl", noise=NOISE, seed=1)
    api.save(measured, out / f"{MATERIAL}.binary")

    models, rows = {}, {}
    for name, (label, options) in FITS.items():
        _tell(f"Fitting {label}")
        before = perf_counter()
        models[name] = api.fit(measured, **options)
        seconds = perf_counter() - before
        file = out / f"{name}.bvb"
        api.save(models[name], file)
        _tell(f"Comparing {label} with the measurement")
        spline = models[name].spline
        rows[name] = {
            "label": label,
            "file": file.name,
            "size": list(spline.size),
            "file_bytes": file.stat().st_size,
            "payload_bytes": payload_bytes(spline.size, spline.degrees, "float32"),
            "seconds": seconds,
            **api.compare(models[name], measured).to_dict(),
        }

    errors = _pictures(out, measured, models)
    drawn = _screenshot(out, measured, models["half-diff"])
    with replacing(out / "report.md") as stream:
        stream.write(_report(material.description, rows, errors, drawn).encode())
    report(
        {
            "folder": str(out),
            "report": str(out / "report.md"),
            "files": sorted(f.name for f in out.iterdir()),
            "seconds": perf_counter() - start,
        },
        as_json,
    )


def _tell(line: str) -> None:
    import sys

    print(line, file=sys.stderr)


def _pictures(out: Path, measured: Any, models: dict[str, Any]) -> dict[str, Any]:
    """Render measurement and models with the same random numbers; return the image errors of each model."""
    from dataclasses import asdict

    from bvbedit import api
    from bvbedit.io.exr import write_exr
    from bvbedit.io.png import write_png
    from bvbedit.render.image_metrics import compare_pictures
    from bvbedit.render.sheet import amplified_difference, sheet
    from bvbedit.render.tonemap import tone_map

    pictures = {}
    for name, brdf in {"measured": measured, **models}.items():
        _tell(f"Rendering {name}")
        pictures[name] = api.render(brdf, "sphere", **PICTURE)
        write_exr(out / f"{name}.exr", pictures[name])
    toned = {name: tone_map(p) for name, p in pictures.items()}
    panels = [("measured", toned["measured"])]
    for name in models:
        panels.append((FITS[name][0], toned[name]))
        panels.append((f"difference x {AMPLIFIED}", amplified_difference(toned[name], toned["measured"], AMPLIFIED)))
    write_png(out / "comparison.png", sheet(panels))
    return {name: asdict(compare_pictures(pictures[name], pictures["measured"])) for name in models}


def _screenshot(out: Path, measured: Any, model: Any) -> bool:
    """Draw volume and lobes where OpenGL allows it; say why where it does not."""
    import bvbedit_gui
    from bvbedit.errors import BvbError

    _tell("Drawing volume and lobes")
    try:
        bvbedit_gui.screenshot(model, out / "volume.png", measured=measured, title=MATERIAL)
    except BvbError as error:
        _tell(f"No volume.png: {error}")
        return False
    return True


def _report(description: str, rows: dict[str, Any], errors: dict[str, Any], drawn: bool) -> str:
    def row(label: str, values: list[str]) -> str:
        return f"| {label} | " + " | ".join(values) + " |"

    def metric(*path: str) -> list[str]:
        out = []
        for name in rows:
            value = rows[name]
            for key in path:
                value = value[key]
            out.append(f"{value:.5g}")
        return out

    lines = [
        f"# {MATERIAL}",
        "",
        f"{description}.",
        f"Measured by a simulated goniophotometer on MERL's grid with {NOISE:.0%} noise, and fitted twice.",
        "",
        row("", [r["label"] for r in rows.values()]),
        row("---", ["---"] * len(rows)),
        row("control points", [" x ".join(map(str, r["size"])) for r in rows.values()]),
        row("file", [f"[{r['file']}]({r['file']}), {r['file_bytes']:,} bytes" for r in rows.values()]),
        row("payload", [f"{r['payload_bytes']:,} bytes" for r in rows.values()]),
        row("fit", [f"{r['seconds']:.2f} s" for r in rows.values()]),
        row("log-cosine RMS, grid", metric("grid", "log_cosine_rms")),
        row("log-cosine RMS, nodes", metric("nodes", "log_cosine_rms")),
        row("relative L1, grid", metric("grid", "relative_l1")),
        row("E_avg of the paper, 1/sr", metric("paper", "e_avg")),
        row("E_max of the paper, 1/sr", metric("paper", "e_max")),
        row("image MAE", [f"{errors[n]['mae']:.5f}" for n in rows]),
        row("image PAE", [f"{errors[n]['pae']:.5f}" for n in rows]),
        row("image PSNR", [f"{errors[n]['psnr']:.1f} dB" for n in rows]),
        "",
        "All errors are distances from the noisy measurement.",
        "",
        "![measurement, models and differences](comparison.png)",
        "",
    ]
    if drawn:
        lines += ["Iso-value surfaces, control net and lobes of the half-diff model:", "", "![volume](volume.png)", ""]
    return "\n".join(lines)
