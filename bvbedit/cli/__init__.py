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
app.command("bvbedit.cli.models:fit")
app.command("bvbedit.cli.models:info")
app.command("bvbedit.cli.models:compare")
app.command("bvbedit.cli.models:export_table", name="export")
app.command("bvbedit.cli.editing:edit")
app.command("bvbedit.cli.editing:run")
app.command("bvbedit.cli.editing:history")
app.command("bvbedit.cli.structure:refine")
app.command("bvbedit.cli.structure:remove")
app.command("bvbedit.cli.structure:elevate")
app.command("bvbedit.cli.structure:reduce")
app.command("bvbedit.cli.structure:blend")
app.command("bvbedit.cli.pictures:render")
app.command("bvbedit.cli.pictures:view")
app.command("bvbedit.cli.samples:sample_app", name="sample")
app.command("bvbedit.cli.demo:demo")


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
