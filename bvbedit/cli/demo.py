"""The whole job on a sample made on the spot: measure, fit, edit, render, compare; all of it stays in a folder."""

from pathlib import Path
from typing import Any

from bvbedit.cli.models import Json
from bvbedit.cli.output import report

MATERIAL = "gold-metallic-paint"
NOISE = 0.02
FITS: dict[str, tuple[str, dict[str, Any]]] = {
    "paper": (
        "the paper's configuration",
        {
            "chart": "in-out",
            "encoding": "linear",
            "size": (20, 20, 80),
            "knots": "piegl-tiller",
            "precision": "float32",
        },
    ),
    "adaptive": ("automatic, up to 16 KiB", {"max_bytes": 16 * 1024}),
}
EDITS = ("broaden factor=2.5 part=highlight", "tint hue=-25 saturation=1.5")
PICTURE: dict[str, Any] = {"width": 320, "height": 320, "spp": 64}
# Differences are made visible by a power of two, so that one pixel in a hundred is as bright as can be.
LARGEST_AMPLIFICATION = 128
# Every third node of each axis is enough for the floor that noise sets.
FLOOR_STRIDE = 3


def demo(*, out: Path = Path("bvbedit-demo"), as_json: Json = False) -> None:
    """Measure a sample material, fit it twice, edit, compare, render, and leave a report with pictures.

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
            "payload_bytes": models[name].storage.payload_bytes(spline.control, spline.degrees),
            "seconds": seconds,
            **api.compare(models[name], measured).to_dict(),
        }

    _tell("Comparing all with the material without noise")
    truth = {
        name: api.compare(brdf, material.brdf, stride=FLOOR_STRIDE).grid.log_cosine_rms
        for name, brdf in {"measured": measured, **models}.items()
    }
    errors = _pictures(out, material.brdf, measured, models)
    edited = _edited(out, models["adaptive"])
    missing = _screenshot(out, measured, models["adaptive"])
    with replacing(out / "report.md") as stream:
        table_bytes = (out / f"{MATERIAL}.binary").stat().st_size
        stream.write(_report(material.description, table_bytes, rows, truth, errors, edited, missing).encode())
    report(
        {
            "folder": str(out),
            "report": str(out / "report.md"),
            "files": sorted(f.name for f in out.iterdir()),
            "notes": [missing] if missing else [],
            "seconds": perf_counter() - start,
        },
        as_json,
    )


def _tell(line: str) -> None:
    """Say what is being done, where somebody watches."""
    import sys

    if sys.stderr.isatty():
        print(line, file=sys.stderr)


def _pictures(out: Path, truth: Any, measured: Any, models: dict[str, Any]) -> dict[str, Any]:
    """Render truth, measurement and models with the same random numbers; return image errors against the truth."""
    from dataclasses import asdict

    import numpy as np

    from bvbedit import api
    from bvbedit.io.exr import write_exr
    from bvbedit.io.png import write_png
    from bvbedit.render.image_metrics import compare_pictures
    from bvbedit.render.sheet import amplified_difference, sheet
    from bvbedit.render.tonemap import tone_map

    pictures = {}
    for name, brdf in {"truth": truth, "measured": measured, **models}.items():
        _tell(f"Rendering {name}")
        pictures[name] = api.render(brdf, "sphere", density=truth.density, **PICTURE)
        write_exr(out / f"{name}.exr", pictures[name])
    toned = {name: tone_map(p) for name, p in pictures.items()}
    shown = {"measured": "measurement, with noise", **{name: label for name, (label, _) in FITS.items()}}
    largest = max(
        float(np.percentile(np.abs(toned[name].astype(float) - toned["truth"]).max(axis=2), 99)) for name in shown
    )
    factor = next(f for f in (LARGEST_AMPLIFICATION, 64, 32, 16, 8, 4, 2, 1) if f * largest <= 255 or f == 1)
    panels = [(label, toned[name]) for name, label in shown.items()]
    panels += [
        (f"its difference from the truth, x {factor}", amplified_difference(toned[name], toned["truth"], factor))
        for name in shown
    ]
    write_png(out / "comparison.png", sheet(panels, columns=len(shown)))
    return {name: asdict(compare_pictures(pictures[name], pictures["truth"])) for name in shown}


def _edited(out: Path, model: Any) -> list[str]:
    """Edit a model, save it with its history, render each state, and return what was done and what physics says."""
    from bvbedit import api
    from bvbedit.edit.document import Document
    from bvbedit.edit.operations import edit_of_line
    from bvbedit.io.png import write_png
    from bvbedit.render.sheet import sheet
    from bvbedit.render.tonemap import tone_map

    document = Document.of(model, file="adaptive.bvb")
    for line in EDITS:
        _tell(f"Editing: {line}")
        document = document.do(edit_of_line(line))
    document.save(out / "edited.bvb")
    labels = ["adaptive", *EDITS]
    pictures = [
        (label, tone_map(api.render(document.at(n), "sphere", density=model.density, **PICTURE)))
        for n, label in enumerate(labels)
    ]
    write_png(out / "edited.png", sheet(pictures, columns=len(pictures)))
    before, after = document.changes().plausibility()
    return [f"Before: {before.text()}.", f"After: {after.text()}."]


def _screenshot(out: Path, measured: Any, model: Any) -> str:
    """Draw volume and lobes where OpenGL allows it; return why not where it does not."""
    import bvbedit_gui
    from bvbedit.errors import BvbError

    _tell("Drawing volume and lobes")
    try:
        bvbedit_gui.screenshot(model, out / "volume.png", measured=measured, title=MATERIAL)
    except BvbError as error:
        return f"No volume.png: {error}"
    return ""


def _report(
    description: str,
    table_bytes: int,
    rows: dict[str, Any],
    truth: dict[str, float],
    errors: dict[str, Any],
    edited: list[str],
    missing: str,
) -> str:
    def row(label: str, measured: str, values: list[str]) -> str:
        return f"| {label} | {measured} | " + " | ".join(values) + " |"

    def metric(*path: str) -> list[str]:
        out = []
        for name in rows:
            value = rows[name]
            for key in path:
                value = value[key]
            out.append(f"{value:.5g}")
        return out

    def image(key: str, form: str) -> tuple[str, list[str]]:
        return format(errors["measured"][key], form), [format(errors[name][key], form) for name in rows]

    lines = [
        f"# {MATERIAL}",
        "",
        f"{description}.",
        f"Measured by a simulated goniophotometer on MERL's grid with {NOISE:.0%} noise, and fitted twice.",
        "",
        row("", "the measurement itself", [r["label"] for r in rows.values()]),
        row("---", "---", ["---"] * len(rows)),
        row("control points", "", [" x ".join(map(str, r["size"])) for r in rows.values()]),
        row(
            "file",
            f"{table_bytes:,} bytes",
            [f"[{r['file']}]({r['file']}), {r['file_bytes']:,} bytes" for r in rows.values()],
        ),
        row("net and knots", "", [f"{r['payload_bytes']:,} bytes" for r in rows.values()]),
        row("fit", "", [f"{r['seconds']:.2f} s" for r in rows.values()]),
        row("**distance from the material without noise**", "", [""] * len(rows)),
        row("log-cosine RMS, grid", f"{truth['measured']:.5g}", [f"{truth[name]:.5g}" for name in rows]),
        row("picture: mean error", *image("mae", ".5f")),
        row("picture: largest error", *image("pae", ".5f")),
        row("picture: PSNR, dB", *image("psnr", ".1f")),
        row("**distance from the measurement**", "", [""] * len(rows)),
        row("log-cosine RMS, grid", "0", metric("grid", "log_cosine_rms")),
        row("log-cosine RMS, nodes", "0", metric("nodes", "log_cosine_rms")),
        row("relative L1, grid", "0", metric("grid", "relative_l1")),
        row("mean error E_avg, 1/sr", "0", metric("paper", "e_avg")),
        row("largest error E_max, 1/sr", "0", metric("paper", "e_max")),
        "",
        "- *log-cosine RMS*: root mean square of the difference of log(1 + f cos theta_i cos theta_o), f being the",
        "  reflectance. A model nearer to the material than the measurement is has smoothed its noise away.",
        "- *grid*, *nodes*: where one looks: at even steps of both directions, or at the measurement's own nodes, most",
        "  of them near the mirror direction.",
        "- *relative L1*: sum of the errors by the sum of the values. *E_avg*, *E_max*: lengths of the RGB vector's",
        "  error, up to grazing angles (Lee & Park 2008, equation 7).",
        "- Pictures are compared as 8-bit sRGB, from 0 to 1: mean and largest difference (MAE, PAE), signal to noise.",
        "",
        "![measurement, models and their differences from the material](comparison.png)",
        "",
        "Then the adaptive model is edited; [edited.bvb](edited.bvb) keeps the history, which `bvbedit history` tells:",
        "",
        *(f"{n}. `{line}`" for n, line in enumerate(EDITS, 1)),
        "",
        "![the adaptive model before and after each edit](edited.png)",
        "",
        *edited,
        "",
    ]
    if missing:
        lines += [missing, ""]
    else:
        lines += ["Iso-value surfaces, control net and lobes of the adaptive model:", "", "![volume](volume.png)", ""]
    return "\n".join(lines)
