"""The mark of tests that draw: they are left out where OpenGL is missing."""

import pytest

from bvbedit.errors import BvbError
from bvbedit_gui.opengl import require_opengl


def drawing_works() -> str:
    """Return why nothing can be drawn here, or nothing."""
    try:
        require_opengl()
    except BvbError as error:
        return str(error)
    return ""


_why = drawing_works()
needs_opengl = pytest.mark.skipif(bool(_why), reason=_why)
