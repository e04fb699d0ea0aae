"""The preview's thread: a newer wish ends the older one, failures are told in words, passes grow better."""

from time import sleep

import numpy as np
import pytest

from bvbedit.errors import BvbError
from bvbedit.render.image_metrics import compare_pictures
from bvbedit.render.prepared import PreparedScene
from bvbedit_gui import preview as preview_module
from bvbedit_gui.preview import Preview, Seen, Wish, composed
from tests.edit.samples import smooth
from tests.gui.files import dimmed

SIDE = 32


class Told:
    """What the preview has told, and a way to wait for it."""

    def __init__(self, passes: bool) -> None:
        self.seen: list[tuple[Wish, Seen]] = []
        self.failed: list[tuple[Wish, str]] = []
        self.preview = Preview(lambda *a: self.seen.append(a), lambda *a: self.failed.append(a), passes=passes)

    def wait(self) -> None:
        while self.preview.busy:
            sleep(0.002)


@pytest.fixture
def told(request):
    made = Told(getattr(request, "param", False))
    yield made
    made.preview.close()


def wish(model, other=None, scene="sphere", last=8):
    return Wish(model, other, scene, SIDE, last)


def test_the_first_picture_is_from_traced_rays_and_so_is_that_of_the_other(told):
    model, other = smooth(), dimmed(smooth())
    told.preview.ask(wish(model, other))
    told.wait()
    ((_, seen),) = told.seen
    prepared = PreparedScene(model, "sphere", width=SIDE, height=SIDE, spp=1, density=model.density)
    np.testing.assert_array_equal(seen.picture, prepared.shade(model))
    np.testing.assert_array_equal(seen.other, prepared.shade(other))


@pytest.mark.parametrize("told", [True], indirect=True)
def test_later_pictures_stand_on_more_samples(told):
    told.preview.ask(wish(smooth(), dimmed(smooth()), last=16))
    told.wait()
    samples = [seen.samples for _, seen in told.seen]
    assert samples == sorted(samples)
    assert samples[0] == 1
    assert samples[-1] == 16
    assert all(seen.other is not None for _, seen in told.seen)


@pytest.mark.parametrize("told", [True], indirect=True)
def test_a_newer_wish_ends_the_older_one(told):
    first = wish(smooth(), last=4096)
    told.preview.ask(first)
    while not told.seen:
        sleep(0.002)
    newer = wish(dimmed(smooth()), last=4)
    told.preview.ask(newer)
    told.wait()
    of_newer = [n for n, (of, _) in enumerate(told.seen) if of is newer]
    assert of_newer
    assert all(of is newer for of, _ in told.seen[of_newer[0] :])
    assert max(seen.samples for of, seen in told.seen if of is first) < 4096


def test_of_many_wishes_the_newest_is_seen(told):
    wishes = [wish(dimmed(smooth(), 0.5 + 0.01 * n)) for n in range(30)]
    for one in wishes:
        told.preview.ask(one)
    told.wait()
    assert told.seen[-1][0] is wishes[-1]
    assert told.failed == []


def test_failures_are_told_in_words_and_the_next_wish_works(told, monkeypatch):
    for scene in ("nowhere", "absent.toml"):
        told.preview.ask(wish(smooth(), scene=scene))
        told.wait()
        assert scene in told.failed[-1][1]

    for error, word in (
        (MemoryError(), "Not enough memory"),
        (BvbError("Too dark."), "Too dark."),
        (KeyError(), "report"),
    ):

        def broken(*_, error=error, **__):
            raise error

        with monkeypatch.context() as patched:
            patched.setattr(preview_module, "PreparedScene", broken)
            told.preview._prepared.clear()
            told.preview.ask(wish(smooth()))
            told.wait()
        assert word in told.failed[-1][1]
    assert told.seen == []
    told.preview.ask(wish(smooth()))
    told.wait()
    assert len(told.seen) == 1


def test_it_ends_in_the_middle_of_a_picture():
    told = Told(True)
    told.preview.ask(wish(smooth(), last=4096))
    while not told.seen:
        sleep(0.002)
    told.preview.close()
    assert not told.preview._thread.is_alive()


def test_the_figures_of_a_difference_are_those_of_the_pictures():
    rng = np.random.default_rng(1)
    ours = rng.random((8, 8, 3)).astype(np.float32)
    theirs = ours + np.float32(0.01) * rng.random((8, 8, 3)).astype(np.float32)
    for exposure in (0.0, 1.0, -2.0):
        picture, found, gain = composed(Seen(ours, theirs, 1, np.inf), "difference", exposure)
        assert found == compare_pictures(ours, theirs, exposure)
        assert picture.shape == (8, 3 * 8 + 8, 3)
        assert picture[:, -8:].max() == round(255 * found.pae) * gain
        assert gain >= 1
    alike, _, gain = composed(Seen(ours, ours, 1, np.inf), "difference", 0.0)
    assert alike[:, -8:].max() == 0
    assert gain == 64


def test_a_preview_that_has_ended_takes_no_wishes():
    told = Told(False)
    told.preview.close()
    told.preview.close()
    told.preview.ask(wish(smooth()))
    sleep(0.02)
    assert told.seen == []
