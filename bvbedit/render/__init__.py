"""Pictures of BRDFs: scenes, a direct-light integrator, image metrics. Knows no commands."""

import sys
from types import ModuleType
from typing import Any

from bvbedit.render.integrator import render, render_passes

__all__ = ["render", "render_passes"]


class _Room(ModuleType):
    """``bvbedit.render`` names this room and, on the Python surface, the verb: so the room can be called."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        return render(*args, **options)


sys.modules[__name__].__class__ = _Room
