"""What takes long in the browser: the page goes on meanwhile, and it ends when it is told to."""

from tests.gui.browser import Desk, served


def test_a_fit_lets_the_page_go_on_and_stops_when_told(context, folder):
    with served(folder, "gold.bvb") as viewer:
        desk = Desk(context, viewer.url)
        desk.click("tab fit")
        desk.click("fit_by=size")
        for axis in range(3):
            desk.fill(f"fit_size {axis}", 70)
            desk.wait("fit_size", f"size => size[{axis}] === 70")
        desk.click("fit")
        desk.wait("fitting", "fitting => fitting")
        # While it is fitted, the server hears what the page says, and draws.
        before = desk.picture("lobes")
        desk.fill("theta_i", 15)
        desk.soon(lambda: desk.known("theta_i"), lambda known: known == 15)
        desk.soon(lambda: (desk.picture("lobes") != before).any(), bool)
        assert desk.known("fitting")
        desk.click("stop")
        desk.wait("fitting", "fitting => !fitting")
        assert desk.state("error_fit") == "Stopped. Nothing was changed."
        assert [step["line"] for step in desk.state("history")] == ["as opened"]
        # Another one is done to its end, and told until another material is seen.
        desk.click("fit_by=bytes")
        desk.fill("fit_kib", 4)
        desk.click("fit")
        desk.wait("fit_result", "told => told.includes('log_cosine_rms')")
        assert [step["line"] for step in desk.state("history")][1].startswith("fit ")
        desk.open("blue.bvb")
        desk.wait("fit_result", "told => told === ''")
        assert desk.complaints == []


def test_a_recipe_is_copied_and_a_name_is_saved_by_enter(context, folder):
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    with served(folder, "gold.bvb") as viewer:
        desk = Desk(context, viewer.url)
        desk.fill("knob_gain_factor", 1.5)
        desk.wait("edit_pending", "pending => pending")
        desk.click("apply")
        desk.wait("history", "history => history.length === 2")
        desk.click("recipe")
        desk.click("copy")
        desk.wait("toast", "toast => toast === 'Copied'")
        copied = desk.page.evaluate("navigator.clipboard.readText()")
        assert copied == desk.state("recipe")
        # It needs the file that was opened, and writes another one.
        assert 'file = "gold.bvb"' in copied
        assert 'file = "gold-again.bvb"' in copied
        desk.page.keyboard.press("Escape")

        desk.click("save as")
        field = desk.mark("save name").locator("input")
        field.fill("by-enter")
        field.press("Enter")
        desk.soon(lambda: (folder / "by-enter.bvb").exists(), bool)
        desk.wait("dialog", "dialog => dialog === ''")

        desk.click("tab history")
        name = desk.mark("named").locator("input")
        name.fill("brighter")
        name.press("Enter")
        desk.wait("history", "history => history[1].name === 'brighter'")
        assert desk.complaints == []


def test_what_is_asked_for_comes_after_what_was_typed_before(context, folder):
    with served(folder, "gold.bvb") as viewer:
        desk = Desk(context, viewer.url)
        desk.mark("field knob_gain_factor").wait_for()
        # While the first value is on its way, the client holds others back.
        desk.page.evaluate(
            """() => {
              window.trame.state.set("theta_i", 12);
              window.trame.state.set("knob_gain_factor", 3);
              document.querySelector('[data-test="apply"]').click();
            }"""
        )
        desk.wait("history", "history => history.length === 2")
        assert desk.state("history")[1]["line"] == "gain factor=3"
        desk.page.evaluate(
            """() => {
              window.trame.state.set("theta_i", 13);
              window.trame.state.set("knob_gain_factor", 0.5);
              document.querySelector('[data-test="apply"]').click();
              window.trame.trigger("undo");
            }"""
        )
        desk.wait("can_redo", "can => can")
        assert [step["line"] for step in desk.state("history")][2:] == ["gain factor=0.5"]
        assert desk.complaints == []


def test_page_and_server_agree_though_their_changes_have_crossed(context, folder):
    with served(folder, "gold.bvb") as viewer:
        desk = Desk(context, viewer.url)
        desk.page.locator('[data-picture="lobes"] img').wait_for()
        # What the server has sent arrives while a change of the page is on its way: the first, or one right after it.
        for crossed, values in ((1, [20]), (2, [21, 22])):
            desk.page.evaluate(
                """async ([crossed, values]) => {
                  const state = window.trame.state, remote = state.client.getRemote().Trame, send = remote.updateState;
                  while (state.client.isBusy()) await new Promise(done => setTimeout(done, 5));
                  let count = 0;
                  await new Promise(done => {
                    remote.updateState = function (changes) {
                      const answer = send.call(remote, changes);
                      count += 1;
                      if (count < values.length) state.set("theta_i", values[count]);
                      if (count === crossed) state._updateFromServer({ theta_i: 30 });
                      if (count === values.length) done();
                      return answer;
                    };
                    state.set("theta_i", values[0]);
                  });
                  remote.updateState = send;
                }""",
                [crossed, values],
            )
            desk.soon(lambda: desk.known("theta_i"), lambda known, last=values[-1]: known == last)
            desk.wait("theta_i", f"value => value === {values[-1]}")
        # And where nothing crosses, changes of both arrive.
        desk.page.evaluate("() => window.trame.state.set('theta_i', 40)")
        desk.soon(lambda: desk.known("theta_i"), lambda known: known == 40)
        assert desk.state("theta_i") == 40
        assert desk.complaints == []
