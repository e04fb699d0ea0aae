"""Who may edit: nobody without the key, whatever is asked for, and nobody from elsewhere; what cannot draw says so."""

import asyncio
import socket
import subprocess
import sys
from contextlib import asynccontextmanager
from itertools import count

import aiohttp
import msgpack
import pytest
from wslink.chunking import UnChunker, generate_chunks
from wslink.protocol import AUTHENTICATION_ERROR

from bvbedit.cli import main
from bvbedit_gui import opengl
from bvbedit_gui.places import Places
from bvbedit_gui.serve import Page
from bvbedit_gui.session import Session, opened_file
from tests.gui.browser import Served
from tests.gui.test_screenshot import Child, needs_opengl

WRONG = ("", "wslink-secret", "x" * 32, None, 0, True, [], {})


@asynccontextmanager
async def page_in(folder):
    """Serve gold.bvb of a folder in this process."""
    session = Session(Places.of(folder))
    session.add(opened_file(folder / "gold.bvb", "gold.bvb"))
    page = Page(session, passes=False)
    serving = asyncio.ensure_future(page.start())
    try:
        await asyncio.wait_for(page.server.ready, 60)
        await page.viewer.settled()
        yield page
    finally:
        await page.stop()
        await serving


class Client:
    """A connection that speaks as the page does."""

    def __init__(self, socket):
        self._socket, self._unchunk, self._numbers = socket, UnChunker(), count()
        self._unchunk.set_max_message_size(1 << 30)

    async def call(self, method, *args, kind="rpc"):
        """Return what is answered."""
        number = f"{kind}:c0:{next(self._numbers)}"
        message = {"wslink": "1.0", "id": number, "method": method, "args": list(args), "kwargs": {}}
        for chunk in generate_chunks(msgpack.packb(message), 1 << 20):
            await self._socket.send_bytes(chunk)
        while True:
            received = await self._socket.receive(60)
            assert received.type == aiohttp.WSMsgType.BINARY, received
            answer = self._unchunk.process_chunk(received.data)
            if answer is not None and answer["id"] == number:
                return answer
            # Without the key nothing else is sent, either: no state, no pictures.
            assert number == "rpc:c0:0" or answer is None or self.trusted, answer

    trusted = False

    async def hello(self, *secrets):
        """Say hello with a key, or without one; return whether it was accepted."""
        answer = await self.call("wslink.hello", *({"secret": s} for s in secrets), kind="system")
        accepted = "result" in answer
        assert accepted or answer["error"]["code"] == AUTHENTICATION_ERROR
        self.trusted = accepted
        return accepted


def connected(http, page, **options):
    return http.ws_connect(f"http://127.0.0.1:{page.port}/ws", **options)


def served(use, folder):
    """Run ``use`` with a page and a client without cookies."""

    async def run():
        async with page_in(folder) as page, aiohttp.ClientSession(cookie_jar=aiohttp.DummyCookieJar()) as http:
            await use(page, http)

    asyncio.run(run())


def methods(page):
    """Return the names of all that can be called."""
    (handler,) = page.server._server._ws_handlers
    return sorted(handler.functionMap)


@needs_opengl
def test_without_the_key_everything_is_refused(folder):
    async def use(page, http):
        viewer = page.viewer
        before = viewer.state.iso
        asked = methods(page)
        assert {"trame.state.update", "trame.state.get", "trame.trigger", "trame.rca.event", "trame.rca.size"} <= set(
            asked
        )
        change = [{"key": "iso", "value": -2.5}]
        for secrets in ((), *((wrong,) for wrong in WRONG)):
            async with connected(http, page) as socket:
                client = Client(socket)
                assert not await client.hello(*secrets)
                for method in asked:
                    answer = await client.call(method, change)
                    assert answer["error"]["code"] == AUTHENTICATION_ERROR, method
                    assert "result" not in answer
        assert viewer.state.iso == before

    served(use, folder)


@needs_opengl
def test_the_key_lets_in_and_the_cookie_does_so_alone(folder):
    async def use(page, http):
        async with connected(http, page) as socket:
            client = Client(socket)
            assert await client.hello(page.key)
            assert "iso" in (await client.call("trame.state.get"))["result"]["state"]
            await client.call("trame.state.update", [{"key": "iso", "value": -0.75}])
            assert page.viewer.state.iso == -0.75
        async with http.get(page.url) as answer:
            assert answer.status == 200
            (cookie,) = answer.cookies.values()
            assert (cookie.value, cookie["httponly"], cookie["samesite"]) == (page.key, True, "Strict")
            assert answer.headers["Cache-Control"] == "no-store"
            assert answer.headers["Referrer-Policy"] == "no-referrer"
            assert page.key not in await answer.text()
        own = f"http://127.0.0.1:{page.port}"
        for secret, origin, accepted in (
            (page.key, own, True),
            (page.key, None, True),
            # Another page in the same browser, of another server on this machine.
            (page.key, "http://127.0.0.1:1", False),
            (page.key, "null", False),
            ("wrong", own, False),
        ):
            headers = {"Cookie": f"{cookie.key}={secret}", **({"Origin": origin} if origin else {})}
            async with connected(http, page, headers=headers) as socket:
                assert await Client(socket).hello("wslink-secret") == accepted, (secret, origin)

    served(use, folder)


@needs_opengl
def test_no_cookie_is_left_without_the_key(folder):
    async def use(page, http):
        for query in ("", "?secret=", "?secret=wslink-secret", "?reconnect=auto"):
            async with http.get(f"http://127.0.0.1:{page.port}/index.html{query}") as answer:
                assert not answer.cookies

    served(use, folder)


@needs_opengl
def test_it_listens_on_this_machine_alone(folder):
    async def use(page, _):
        assert {address[0] for address in page.server._server.runner.addresses} == {"127.0.0.1"}
        for host in ("127.0.0.2", "::1"):
            with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as trial, pytest.raises(OSError):
                trial.connect((host, page.port))

    served(use, folder)


@needs_opengl
def test_another_host_is_warned_of(folder):
    viewer = Served(folder, "--host", "0.0.0.0")
    assert viewer.interrupt() == 0
    assert any(line.startswith("Warning: 0.0.0.0 can be reached by others") for line in viewer.lines)


@pytest.mark.parametrize("arguments", [[], ["gold.bvb"]])
def test_without_opengl_it_says_in_one_line_what_to_install(arguments, monkeypatch, capsys, folder):
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: Child(-11))
    monkeypatch.setattr(sys, "argv", ["bvbedit", "view", *arguments, "--no-browser"])
    monkeypatch.chdir(folder)
    opengl._failure.cache_clear()
    try:
        with pytest.raises(SystemExit) as stop:
            main()
    finally:
        opengl._failure.cache_clear()
    out, err = capsys.readouterr()
    assert (stop.value.code, out, err.count("\n")) == (1, "", 1)
    assert err.startswith("error: Cannot draw on this machine")
    assert "apt-get install libegl1 libgl1-mesa-dri" in err
