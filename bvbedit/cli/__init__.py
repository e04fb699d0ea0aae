"""The command line: each command reads files, writes files and prints a short table, or one JSON object."""

import os
import sys

from cyclopts import App

from bvbedit.errors import BvbError

# Plain text help: parsing Markdown would cost a third of the start-up time.
app = App(
    name="bvbedit",
    help="Fit, edit and preview measured BRDFs as B-spline volumes.",
    help_format="plaintext",
    version_flags=["--version"],
    suppress_keyboard_interrupt=False,  # told in words, below
)
# Commands are named by module, so that each pays only for what it imports.
app.command("bvbedit.cli.models:fit", help="Fit a measurement with an editable model.")
app.command("bvbedit.cli.models:info", help="Tell what a file holds.")
app.command("bvbedit.cli.models:compare", help="Tell how far one BRDF is from another.")
app.command("bvbedit.cli.models:export_table", name="export", help="Write a model as a table for other tools.")
app.command("bvbedit.cli.editing:edit", help='Edit a model in words, like --op "tint rgb=1,0.8,0.6 theta_h=0..20".')
app.command("bvbedit.cli.editing:run", help="Make a recipe, for one material or many.")
app.command("bvbedit.cli.editing:history", help="Tell how a model came about.")
app.command("bvbedit.cli.structure:refine", help="Insert knots: the same material.")
app.command("bvbedit.cli.structure:remove", help="Remove knots within a tolerance.")
app.command("bvbedit.cli.structure:elevate", help="Raise a degree: the same material.")
app.command("bvbedit.cli.structure:reduce", help="Lower a degree.")
app.command("bvbedit.cli.structure:blend", help="Mix two materials.")
app.command("bvbedit.cli.pictures:render", help="Render pictures.")
app.command("bvbedit.cli.pictures:view", help="Open the viewer, to look and to edit; or draw a picture.")
app.command("bvbedit.cli.study:study_app", name="study", help="Measure the trade of accuracy against bytes and time.")
app.command("bvbedit.cli.samples:sample_app", name="sample", help="Sample materials, to start without a measurement.")
app.command("bvbedit.cli.study_report:recommend", help="Tell which configuration to use, by a study.")
app.command("bvbedit.cli.demo:demo", help="The whole job on a sample made on the spot.")


def main() -> None:
    """Run the command of ``sys.argv``: exit status 0 is done, 1 could not do it, 2 wrong usage."""
    # Read when numpy is first imported, later. The threads that multiply small matrices wait by spinning, and take the
    # processors from those that do the work: a fit took 13 % longer. Who sets the variable has it his way.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        app(sys.argv[1:], result_action="return_value")
    except BvbError as error:
        _fail(str(error))
    except KeyboardInterrupt:
        _fail("Interrupted. Nothing was left half-written; run the command again.", 130)
    except BrokenPipeError:
        # The reader of our output has gone, as `| head` does: nobody is left to tell.
        sys.stderr.close()
        sys.exit(1)
    except MemoryError:
        _fail("Not enough memory. Ask for less at once, or use a larger machine.")


def _fail(message: str, status: int = 1) -> None:
    print(f"error: {' '.join(message.split())}", file=sys.stderr)
    sys.exit(status)
