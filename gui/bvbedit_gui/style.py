"""How the page looks, and the little that it does by itself: keys, and asking before it is left."""

STYLE = """
html { overflow: hidden !important; }
.v-theme--dark { --v-theme-surface: 30, 33, 38 !important; --v-theme-background: 30, 33, 38 !important; }
.fill, .fill .v-application__wrap { height: 100vh; min-height: 0 !important; }
.part { display: contents; }
.desk { display: flex; height: calc(100vh - 45px); }
.panels { flex: 1; min-width: 0; display: grid; gap: 1px; background: rgba(128, 128, 128, .35);
  grid-template-columns: round(54%, 1px) minmax(0, 1fr); grid-template-rows: round(55%, 1px) minmax(0, 1fr); }
.panel { background: rgb(var(--v-theme-surface)); display: flex; flex-direction: column; min-width: 0; min-height: 0;
  overflow: hidden; }
.panel-max { grid-column: 1 / 3; grid-row: 1 / 3; }
.panel-head { display: flex; align-items: center; height: 32px; padding: 0 4px 0 8px; flex: none; }
/* Pictures are as large as their areas in whole pixels: scaled by a fraction of one, text would blur. */
.picture { flex: 1; min-height: 0; position: relative; overflow: hidden; }
.stale > :not(.stale-word), .figure-room.stale .figure { opacity: .12; }
.stale-word { position: absolute; inset: 0; display: flex; align-items: center; justify-content: center; z-index: 2;
  pointer-events: none; }
.controls { flex: none; }
.note.line { height: 16px; white-space: nowrap; overflow: hidden; text-overflow: ellipsis; }
.note.text-error { opacity: 1; }
.note { opacity: .8; line-height: 16px !important; flex: none; overflow-wrap: anywhere; }
.side { width: 320px; flex: none; display: flex; flex-direction: column; border-left: 1px solid rgba(128,128,128,.35);
  background: rgb(var(--v-theme-surface)); }
.side-room { flex: 1; overflow-y: auto; min-height: 0; }
.side .v-tabs { flex: none; }
.foot { position: sticky; bottom: 0; background: rgb(var(--v-theme-surface)); z-index: 2; padding: 4px 0; }
.knob { min-height: 32px; }
.knob-label { width: 62px; flex: none; line-height: 1.1; overflow-wrap: anywhere; }
.knob-field { width: 92px; flex: none; }
.knob-field input { font-size: 12px; padding: 0 0 0 6px !important; min-height: 26px !important; }
.knob-field .v-field__append-inner, .knob-field .v-text-field__suffix { padding: 0 4px 0 0; font-size: 11px;
  min-height: 26px; }
.knob-field .v-field { --v-input-control-height: 26px; }
.knob-field input::-webkit-outer-spin-button, .knob-field input::-webkit-inner-spin-button { -webkit-appearance: none; }
.region-label { width: 26px; flex: none; }
.region-field { width: 40px; flex: none; margin-left: 3px; padding: 1px 3px; font-size: 12px; text-align: right;
  border: 1px solid rgba(128, 128, 128, .6); border-radius: 3px; color: inherit; }
.region-field:disabled { opacity: .5; }
.region-field::-webkit-outer-spin-button, .region-field::-webkit-inner-spin-button { -webkit-appearance: none; }
.region { border-top: 1px solid rgba(128, 128, 128, .35); padding-top: 6px; }
.iso-text { width: 150px; flex: none; text-align: right; white-space: nowrap; overflow: hidden;
  text-overflow: ellipsis; }
.bar { flex: none; height: 34px; padding: 0 14px 17px 8px; display: flex; align-items: center; }
.bar-title { white-space: nowrap; margin-right: 12px; }
.bar-colours { flex: 1; height: 10px; position: relative; border: 1px solid rgba(128, 128, 128, .5); }
.bar-tick { position: absolute; top: 9px; transform: translateX(-50%); white-space: nowrap; line-height: 1.4; }
.bar-tick::before { content: ""; position: absolute; left: 50%; top: -4px; height: 5px; border-left: 1px solid; }
.figure-room { flex: 1; min-height: 0; position: relative; overflow: hidden; }
.figure { position: absolute; inset: 0; }
.figure svg { display: block; width: 100%; height: 100%; }
.scroll { overflow-y: auto !important; }
.probe { display: flex; gap: 12px; }
.probe > div { flex: 1; display: flex; align-items: center; }
.start { height: calc(100vh - 45px); }
.start-inner { max-width: 860px; margin: 24px auto; padding: 0 16px; }
.choices { display: flex; flex-wrap: wrap; }
.sample { width: 265px; justify-content: flex-start; padding: 8px 12px; }
.sample-inner { text-align: left; white-space: normal; width: 240px; letter-spacing: normal; }
.sample-about { opacity: .75; line-height: 1.25; min-height: 2.5em; }
.recipe { font-size: 12px; max-height: 50vh; overflow: auto; padding: 8px; border: 1px solid rgba(128, 128, 128, .4);
  user-select: text; }
.step { display: flex; line-height: 1.3; overflow-wrap: anywhere; white-space: normal; }
.step-number { width: 44px; flex: none; opacity: .6; }
.history .v-list-item { min-height: 26px !important; }
.v-app-bar .small, .panel-head .small { margin-top: 5px; }
.panel-head .small { margin-top: 0; }
.small .v-field { --v-input-control-height: 32px; --v-field-padding-top: 4px; font-size: 13px; }
.small .v-field__input { font-size: 13px; min-height: 32px; padding: 4px 0 4px 10px; }
.small .v-label { font-size: 12px; }
.small .v-select__selection-text { font-size: 13px; }
.v-btn-toggle { height: 26px !important; }
.v-btn-toggle .v-btn { min-width: 30px; padding: 0 8px; height: 26px !important; text-transform: none; }
.v-switch { margin-left: 6px; }
.v-switch .v-label { font-size: 13px; }
"""

# Values that a user is typing are undone by the browser itself, so keys mean the document only elsewhere. What trame's
# client does with changes and requests at the same time is read from trame-client 4.1.
SCRIPT = """
(function () {
  if (window.bvbeditKeys) return;
  window.bvbeditKeys = true;
  document.addEventListener("keydown", function (event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    const typing = event.target.matches && event.target.matches("input[type=text], textarea");
    const key = event.key.toLowerCase();
    const name = key === "z" ? (event.shiftKey ? "redo" : "undo") : key === "y" ? "redo" : key === "s" ? "save" : "";
    if (!name || (typing && name !== "save") || !window.trame) return;
    event.preventDefault();
    window.trame.trigger(name);
  });
  // Trame holds changes back while an answer is awaited, and a request would overtake them: an edit would be applied
  // with the value that stood in the field before. So a request waits for what was typed before it, in its turn.
  const ask = window.trame.trigger;
  let turn = Promise.resolve();
  async function told() {
    const state = window.trame.state, client = window.trame.client;
    while (state.dirtyKeys.size && client.isConnected()) {
      if (!client.isBusy()) state.flush();
      await new Promise(done => setTimeout(done, 4));
    }
  }
  window.trame.trigger = async function (...request) {
    turn = turn.then(told, told);
    await turn;
    return ask.apply(window.trame, request);
  };
  // A change on its way to the server may cross one that comes from there, and each would keep what the other had: so
  // the server is asked for what it has in the end. Each connection has a state of its own, with the same listeners.
  const shared = Object.getPrototypeOf(window.trame.state), flush = shared.flush;
  const flights = new Set();
  window.trame.state.addListener(function ({ type, keys }) {
    if (type !== "dirty-state") return;
    const own = window.trame.state.dirtyKeys;
    for (const { sent, crossed } of flights)
      keys.filter(key => sent.has(key) && !own.has(key)).forEach(key => crossed.add(key));
  });
  shared.flush = async function (...names) {
    const sent = new Set(this.client.isBusy() ? [] : [...this.dirtyKeys, ...names.flat()]);
    // The next one with the same keys begins before this one is known to have ended: each is a flight of its own.
    const flight = { sent, crossed: new Set() };
    flights.add(flight);
    await flush.apply(this, names);
    flights.delete(flight);
    if (flight.crossed.size && this.client.isConnected())
      this.client.getConnection().getSession().call("trame.force.push", [...flight.crossed]);
  };
  // Expressions of the page know nothing of the browser's clipboard.
  document.addEventListener("click", function (event) {
    const button = event.target.closest && event.target.closest("[data-copies]");
    if (!button) return;
    const tell = text => window.trame.state.set("toast", text);
    const refused = () => tell("The browser does not let pages copy: select the text, and copy it by Ctrl+C.");
    if (!navigator.clipboard) return refused();
    navigator.clipboard.writeText(window.trame.state.get(button.dataset.copies)).then(() => tell("Copied"), refused);
  });
  function asks() { return window.trame && window.trame.state && window.trame.state.get("unsaved"); }
  window.addEventListener("beforeunload", function (event) { if (asks()) event.preventDefault(); });
  // Trame ends the connection before it is known whether the user leaves; who leaves does not need it ended.
  const close = WebSocket.prototype.close;
  WebSocket.prototype.close = function () {
    if (window.event && window.event.type === "beforeunload" && asks()) return;
    close.apply(this, arguments);
  };
})();
"""
