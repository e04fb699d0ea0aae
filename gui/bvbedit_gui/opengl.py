"""Whether this machine can draw at all.

Where the OpenGL library is missing, opening a VTK window ends the process with a signal that no ``except`` sees. So a
child process opens one first, and what happens to the child is told in words.
"""

import os
import signal
import subprocess
import sys
from functools import cache

from bvbedit.errors import BvbError

INSTALL = "apt-get install libegl1 libgl1-mesa-dri"
# The first start of Mesa on a busy machine took 3 s.
TIMEOUT = 60.0

# Clears a window to a colour and reads it back: a library without a driver opens windows, but paints nothing.
PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
window, renderer, pixel = vtkRenderWindow(), vtkRenderer(), vtkUnsignedCharArray()
window.SetOffScreenRendering(1)
window.SetSize(16, 16)
renderer.SetBackground(1, 0, 0)
window.AddRenderer(renderer)
window.Render()
window.GetPixelData(8, 8, 8, 8, 0, pixel, 0)
raise SystemExit(0 if [pixel.GetValue(i) for i in range(3)] == [255, 0, 0] else "the picture came out wrong")
"""


def require_opengl() -> None:
    """Return if VTK can draw off-screen here, on which windows may be opened in this process.

    Sets ``VTK_DEFAULT_OPENGL_WINDOW`` for VTK to use EGL where there is no display. The child process runs once.
    Raises BvbError that says what to install.
    """
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    failure = _failure()
    if failure:
        raise BvbError(f"Cannot draw on this machine: {failure}. Install OpenGL: {INSTALL}.")


@cache
def _failure() -> str:
    """Return why the probe failed, in words, or nothing if it passed."""
    try:
        child = subprocess.run(
            [sys.executable, "-c", PROBE],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            timeout=TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"opening a window took longer than {TIMEOUT:g} s"
    except OSError as error:
        return f"no process could be started to try ({error})"
    if child.returncode == 0:
        return ""
    if child.returncode < 0:
        number = -child.returncode
        known = number in {s.value for s in signal.Signals}
        return f"opening a window ends the process ({signal.Signals(number).name if known else f'signal {number}'})"
    lines = child.stderr.decode(errors="replace").strip().splitlines()
    return f"opening a window failed ({lines[-1] if lines else f'exit status {child.returncode}'})"
