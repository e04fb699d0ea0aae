"""The viewer's server: on this machine alone, behind a key that is drawn anew each time, in a browser or a notebook.

Whoever may connect to a port of this machine is not the same as who may edit: the page sends the key that its address
has, and every message without it is refused. The first page leaves the key as a cookie, so that it can be loaded again.
"""

import asyncio
import hmac
import os
import secrets
import socket
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from http.cookies import Morsel
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.document import Document
from bvbedit.errors import BvbError
from bvbedit.io import load
from bvbedit_gui.opengl import require_opengl
from bvbedit_gui.places import Places
from bvbedit_gui.session import Opened, Session, opened_file

LOCAL = "127.0.0.1"


def free_port(host: str = LOCAL) -> int:
    """Return a port that nothing listens on. Raises BvbError where the host is not this machine's."""
    try:
        with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as trial:
            trial.bind((host, 0))
            return int(trial.getsockname()[1])
    except OSError as error:
        raise BvbError(f"Cannot listen on {host}: {error.strerror or error}. Choose another --host.") from None


def check_port(host: str, port: int) -> None:
    """Raise BvbError where a port cannot be listened on."""
    if not 1 <= port <= 65535:
        raise BvbError(f"port is {port}. Choose 1 to 65535, or leave it out.")
    try:
        with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as trial:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind((host, port))
    except OSError as error:
        raise BvbError(f"Cannot listen on {host}, port {port}: {error.strerror or error}. Choose another.") from None


class Page:
    """A viewer with its page on a server of its own. ``url`` has the key: who has it may edit.

    Raises BvbError on a machine without OpenGL, and where the port is taken.
    """

    def __init__(self, session: Session, *, host: str = LOCAL, port: int | None = None, passes: bool = True) -> None:
        require_opengl()
        # What is printed by others at the start of a server.
        os.environ["WSLINK_READY_MSG"] = ""
        from trame.app import get_server

        self.host = host
        if port is None:
            port = free_port(host)
        else:
            check_port(host, port)
        self.port = port
        self.key = secrets.token_urlsafe(24)
        self.server = get_server(f"bvbedit-{secrets.token_hex(4)}", client_type="vue3")
        self.session = session
        self._passes = passes
        self.viewer: Any = None
        self._cookie = f"bvbedit-{self.port}"

    @property
    def url(self) -> str:
        """The address for the browser, with the key."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        if self.host in ("0.0.0.0", "::"):
            host = socket.gethostname()
        return f"http://{host}:{self.port}/index.html?reconnect=auto&secret={self.key}"

    def start(self, opened: Callable[[], object] | None = None) -> "asyncio.Future[Any]":
        """Start serving in the running event loop; ``opened`` is called when the page can be loaded."""
        from bvbedit_gui.page import build
        from bvbedit_gui.viewer import Viewer

        self.viewer = Viewer(self.server, self.session, passes=self._passes)
        build(self.viewer)
        self.server.controller.on_server_bind.add(self._guard)
        self.server.add_protocol_to_configure(lambda root: root.registerLinkProtocol(_gate(self.key, self._cookie)))
        if opened is not None:
            self.server.controller.on_server_ready.add(lambda **_: opened())
        self.viewer.start()
        task: asyncio.Future[Any] = self.server.start(
            exec_mode="coroutine",
            host=self.host,
            port=self.port,
            open_browser=False,
            show_connection_info=False,
            disable_logging=True,
            timeout=0,
            backend="aiohttp",
        )
        return task

    def _guard(self, server: Any) -> None:
        from aiohttp import web

        async def no_manager(_: Any) -> Any:
            return web.json_response(None)

        # Pages ask a manager of servers first, to be told that there is none: without an answer, they log an error.
        server.app.router.add_post("/paraview/", no_manager)
        server.app.on_response_prepare.append(self._leave_cookie)

    async def _leave_cookie(self, request: Any, response: Any) -> None:
        if _equal(request.query.get("secret", ""), self.key):
            # The response's own cookies are written before this is called.
            cookie: Morsel[str] = Morsel()
            cookie.set(self._cookie, self.key, self.key)
            cookie.update({"httponly": "yes", "samesite": "Strict", "path": "/"})
            response.headers.add("Set-Cookie", cookie.OutputString())
        response.headers["Referrer-Policy"] = "no-referrer"
        response.headers["X-Content-Type-Options"] = "nosniff"
        if request.path.endswith((".html", "/")):
            response.headers["Cache-Control"] = "no-store"

    async def stop(self) -> None:
        """Keep what is unsaved, and stop serving."""
        await self.server.stop()
        self.viewer.end()


def _equal(given: object, key: str) -> bool:
    """Compare in a time that tells nothing."""
    return isinstance(given, str) and hmac.compare_digest(given.encode(), key.encode())


def _gate(key: str, cookie: str) -> Any:
    """Return the protocol that lets a connection in which knows the key, or has it as a cookie."""
    from wslink.websocket import LinkProtocol

    class Gate(LinkProtocol):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self._trusted: set[str] = set()

        def onConnect(self, request: Any, client: str) -> None:  # noqa: N802
            # Cookies go to all ports of a machine: pages of other servers on it must not come in by ours.
            origin = request.headers.get("Origin")
            own = origin is None or urlsplit(origin).netloc == request.host
            if own and _equal(request.cookies.get(cookie, ""), key):
                self._trusted.add(client)

        def onClose(self, client: str) -> None:  # noqa: N802
            self._trusted.discard(client)

        async def validateToken(self, token: Any, client: str) -> bool:  # noqa: N802
            return client in self._trusted or _equal(token, key)

    return Gate()


def view(
    paths: Sequence[Path],
    *,
    measured: Path | None = None,
    host: str = LOCAL,
    port: int | None = None,
    browser: bool = True,
    tell: Callable[[str], object] = print,
) -> None:
    """Open the viewer in the user's browser, and serve it until Ctrl-C.

    ``paths`` are materials to begin with, models or measurements; ``measured`` is what the first of them is compared
    with. Only these files, and those under the present folder, can be opened and saved. ``tell`` is called with lines
    for the user: the address, how to reach it from elsewhere, and a warning where others may.
    Raises BvbError for files that cannot be read, a port that is taken, and a machine without OpenGL.
    """
    require_opengl()
    folder = Path.cwd()
    named = [*paths, *([measured] if measured is not None else [])]
    session = Session(Places.of(folder, *named))
    materials = [opened_file(path.resolve(), path.name) for path in paths]
    if measured is not None:
        if not materials:
            raise BvbError("A measurement needs a model to be compared with. Name one first, or open it alone.")
        materials[0] = compared_with(materials[0], load(measured), measured.name)
    for material in materials:
        session.add(material)
    if materials:
        session.current = next(iter(session))[0]
    page = Page(session, host=host, port=port)
    from aiohttp.web import GracefulExit

    # Ctrl-C is how it is ended, which the server turns into an exit with a status of failure.
    with suppress(KeyboardInterrupt, GracefulExit):
        asyncio.run(_serve(page, browser, tell))


def compared_with(opened: Opened, reference: Brdf, name: str) -> Opened:
    """Return the material with another one as its source."""
    from dataclasses import replace

    return replace(opened, reference=reference, reference_name=name)


async def _serve(page: Page, browser: bool, tell: Callable[[str], object]) -> None:
    def ready() -> None:
        tell(f"The viewer is at {page.url}")
        if page.host != LOCAL:
            tell(f"Warning: {page.host} can be reached by others; whoever has this address can edit and save here.")
        elif os.environ.get("SSH_CONNECTION"):
            tell(f"From your own machine: ssh -L {page.port}:127.0.0.1:{page.port} {socket.gethostname()}")
        tell("Ctrl-C ends it; what is unsaved is kept.")
        if browser:
            _open_browser(page.url)

    asyncio.get_running_loop().set_exception_handler(_closed_tabs_pass)
    serving = page.start(ready)
    try:
        await serving
    except asyncio.CancelledError:
        pass
    finally:
        page.viewer.end()


def _closed_tabs_pass(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Report what went wrong in the event loop, but not that a tab was closed while a picture was sent to it."""
    if not isinstance(context.get("exception"), ConnectionError):
        loop.default_exception_handler(context)


def _open_browser(url: str) -> None:
    """Open the address in the user's browser, where there is one that has a screen."""
    import webbrowser

    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return
    try:
        webbrowser.open(url)
    except webbrowser.Error:
        return


class Notebook:
    """A viewer in a notebook's cell. ``model`` is what it shows now, edits and all; ``stop()`` ends it."""

    def __init__(self, page: Page, height: int) -> None:
        self._page, self._height = page, height
        self._task = asyncio.ensure_future(page.start())

    @property
    def model(self) -> SplineBrdf:
        """The model with all edits. Raises BvbError where nothing is open, or only a measurement."""
        return self._page.session.here.model

    @property
    def document(self) -> Document:
        """The document with its history. Raises BvbError where nothing is open, or only a measurement."""
        return self._page.session.document

    @property
    def url(self) -> str:
        """The address of the page, for a browser of its own."""
        return self._page.url

    def _repr_html_(self) -> str:
        return (
            f'<iframe src="{self.url}" width="100%" height="{self._height}" style="border:0" '
            'title="bvbedit viewer"></iframe>'
        )

    async def stop(self) -> None:
        """Stop serving."""
        await self._page.stop()


def show(model: Brdf, *, measured: Brdf | None = None, height: int = 720, port: int | None = None) -> Notebook:
    """Return the viewer of ``model`` for a notebook's cell, where it can be edited: ``.model`` is the edited one.

    ``measured`` is what it is compared with; ``height`` in pixels. Files under the present folder can be opened and
    saved from it. Raises BvbError where no event loop runs, as one does in a notebook, and without OpenGL.
    """
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        raise BvbError("show() is for notebooks. From a script save the model, and run: bvbedit view FILE") from None
    from bvbedit.brdf.base import check_brdf

    check_brdf(model, "model")
    session = Session(Places.of(Path.cwd()))
    if isinstance(model, SplineBrdf):
        opened = Opened("model", Document.of(model), reference=measured, reference_name="measured")
    else:
        opened = Opened("measurement", reference=model, reference_name="measurement")
    session.add(opened)
    return Notebook(Page(session, port=port), height)
